// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/usb/usb_bus.hpp"

#include <fmt/format.h>
#include <libusb.h>
#include <sys/time.h>

#include <array>
#include <fstream>
#include <thread>

namespace orbitfuse::usb {
namespace {

constexpr std::uint8_t class_still_image = 0x06, class_video = 0x0e, class_miscellaneous = 0xef;
constexpr std::uint8_t subclass_usb3_vision = 0x05;

std::string path_of(libusb_device* device) {
  std::array<std::uint8_t, 8> ports{};
  const int depth = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  if (depth <= 0) return fmt::format("usb{}", libusb_get_bus_number(device));  // a root hub
  std::string path = fmt::format("{}-{}", libusb_get_bus_number(device), ports[0]);
  for (int i = 1; i < depth; ++i) path += fmt::format(".{}", ports[static_cast<std::size_t>(i)]);
  return path;
}

int speed_of(libusb_device* device) {
  switch (libusb_get_device_speed(device)) {
    case LIBUSB_SPEED_LOW:
      return 1;
    case LIBUSB_SPEED_FULL:
      return 12;
    case LIBUSB_SPEED_HIGH:
      return 480;
    case LIBUSB_SPEED_SUPER:
      return 5000;
    case LIBUSB_SPEED_SUPER_PLUS:
      return 10000;
    default:
      return 0;
  }
}

bool has_camera_interface(libusb_device* device) {
  libusb_config_descriptor* config = nullptr;
  if (libusb_get_active_config_descriptor(device, &config) != 0) return false;
  bool found = false;
  for (int i = 0; i < config->bNumInterfaces; ++i) {
    for (int a = 0; a < config->interface[i].num_altsetting; ++a) {
      const libusb_interface_descriptor& d = config->interface[i].altsetting[a];
      found = found || d.bInterfaceClass == class_video || d.bInterfaceClass == class_still_image ||
              (d.bInterfaceClass == class_miscellaneous &&
               d.bInterfaceSubClass == subclass_usb3_vision);
    }
  }
  libusb_free_config_descriptor(config);
  return found;
}

class LibusbBus final : public UsbBus {
 public:
  explicit LibusbBus(libusb_context* context) : context_(context) {
    if (!libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG)) return;
    const int events = LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT;
    hotplug_ =
        libusb_hotplug_register_callback(context_, events, LIBUSB_HOTPLUG_NO_FLAGS,
                                         LIBUSB_HOTPLUG_MATCH_ANY, LIBUSB_HOTPLUG_MATCH_ANY,
                                         LIBUSB_HOTPLUG_MATCH_ANY, on_change, this, &handle_) == 0;
  }
  ~LibusbBus() override {
    if (hotplug_) libusb_hotplug_deregister_callback(context_, handle_);
    libusb_exit(context_);
  }

  Result<std::vector<UsbDevice>> list() override {
    std::vector<UsbDevice> devices;
    ORBITFUSE_TRY(for_each([&](libusb_device* device, const libusb_device_descriptor& d) {
      UsbDevice found;
      found.vendor = d.idVendor;
      found.product = d.idProduct;
      found.path = path_of(device);
      found.megabit_s = speed_of(device);
      found.is_camera = has_camera_interface(device);
      read_strings("/sys/bus/usb/devices", found);
      devices.push_back(std::move(found));
    }));
    return devices;
  }

  void wait(std::chrono::milliseconds timeout) override {
    if (!hotplug_) {
      std::this_thread::sleep_for(timeout);
      return;
    }
    changed_ = 0;
    timeval limit{timeout.count() / 1000, (timeout.count() % 1000) * 1000};
    libusb_handle_events_timeout_completed(context_, &limit, &changed_);
  }

  Status reset(const std::string& path) override {
    int result = LIBUSB_ERROR_NO_DEVICE;
    ORBITFUSE_TRY(for_each([&](libusb_device* device, const libusb_device_descriptor&) {
      if (path_of(device) != path) return;
      libusb_device_handle* handle = nullptr;
      result = libusb_open(device, &handle);
      if (result != 0) return;
      result = libusb_reset_device(handle);
      libusb_close(handle);
    }));
    // NOT_FOUND: it came back as another device, which is what a reset may do.
    if (result == 0 || result == LIBUSB_ERROR_NOT_FOUND) return {};
    return fail(
        ErrorKind::device, "USB port " + path, libusb_error_name(result),
        result == LIBUSB_ERROR_ACCESS
            ? "allow it with a udev rule (MODE=\"0664\", GROUP=\"plugdev\") or replug by hand"
            : "unplug it and plug it in again");
  }

 private:
  template <class Visit>
  Status for_each(const Visit& visit) {
    libusb_device** devices = nullptr;
    const ssize_t count = libusb_get_device_list(context_, &devices);
    if (count < 0) {
      return fail(ErrorKind::device, "USB", libusb_error_name(static_cast<int>(count)),
                  "check that /dev/bus/usb exists");
    }
    for (ssize_t i = 0; i < count; ++i) {
      libusb_device_descriptor descriptor{};
      if (libusb_get_device_descriptor(devices[i], &descriptor) == 0) visit(devices[i], descriptor);
    }
    libusb_free_device_list(devices, 1);
    return {};
  }

  static int LIBUSB_CALL on_change(libusb_context*, libusb_device*, libusb_hotplug_event,
                                   void* self) {
    static_cast<LibusbBus*>(self)->changed_ = 1;
    return 0;  // stay registered
  }

  libusb_context* context_;
  libusb_hotplug_callback_handle handle_ = 0;
  bool hotplug_ = false;
  int changed_ = 0;
};

std::string first_line(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

}  // namespace

std::string UsbDevice::id() const { return fmt::format("{:04x}:{:04x}", vendor, product); }

bool UsbDevice::same_as(const UsbDevice& other) const {
  if (vendor != other.vendor || product != other.product || serial != other.serial) return false;
  return !serial.empty() || path == other.path;
}

void read_strings(const std::filesystem::path& root, UsbDevice& device) {
  device.manufacturer = first_line(root / device.path / "manufacturer");
  device.model = first_line(root / device.path / "product");
  device.serial = first_line(root / device.path / "serial");
}

Result<std::unique_ptr<UsbBus>> make_usb_bus() {
  libusb_context* context = nullptr;
  if (const int error = libusb_init(&context); error != 0) {
    return fail(ErrorKind::unavailable, "USB", libusb_error_name(error),
                "run on a machine (not a container) with USB");
  }
  return std::unique_ptr<UsbBus>(std::make_unique<LibusbBus>(context));
}

}  // namespace orbitfuse::usb
