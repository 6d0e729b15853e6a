// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/v4l2/video_system.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace orbitfuse::v4l2 {
namespace {

namespace fs = std::filesystem;

class KernelVideoSystem final : public VideoSystem {
 public:
  int open(const std::string& path, int flags) override { return ::open(path.c_str(), flags); }
  int close(int fd) override { return ::close(fd); }
  int ioctl(int fd, unsigned long request, void* argument) override {
    return ::ioctl(fd, request, argument);
  }
  void* mmap(std::size_t length, int fd, off_t offset) override {
    return ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, fd, offset);
  }
  int munmap(void* address, std::size_t length) override { return ::munmap(address, length); }
  int poll(pollfd* fds, nfds_t count, int timeout_ms) override {
    return ::poll(fds, count, timeout_ms);
  }
  std::vector<Node> nodes() override { return read_nodes("/sys/class/video4linux"); }
};

std::string first_line(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

}  // namespace

std::int64_t VideoSystem::now_ns(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

std::shared_ptr<VideoSystem> make_video_system() { return std::make_shared<KernelVideoSystem>(); }

std::vector<VideoSystem::Node> read_nodes(const std::string& sysfs_class_folder) {
  std::vector<VideoSystem::Node> nodes;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(sysfs_class_folder, ignored)) {
    VideoSystem::Node node;
    node.path = "/dev/" + entry.path().filename().string();
    node.product = first_line(entry.path() / "name");
    // device/ is the USB interface; its parent is the USB device, whose folder name is the port.
    std::error_code broken;
    const fs::path usb_interface = fs::canonical(entry.path() / "device", broken);
    if (!broken && fs::exists(usb_interface.parent_path() / "idVendor", ignored)) {
      const fs::path usb = usb_interface.parent_path();
      node.serial = first_line(usb / "serial");
      node.usb_path = usb.filename().string();
      const std::string name = usb_interface.filename();  // "1-4:1.0"
      node.function = name.substr(name.find(':') + 1) + "/" + first_line(entry.path() / "index");
      node.usb_id = first_line(usb / "idVendor") + ":" + first_line(usb / "idProduct");
    }
    nodes.push_back(std::move(node));
  }
  std::sort(nodes.begin(), nodes.end(), [](const auto& a, const auto& b) {
    return std::pair(a.path.size(), a.path) < std::pair(b.path.size(), b.path);
  });
  return nodes;
}

}  // namespace orbitfuse::v4l2
