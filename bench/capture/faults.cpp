// SPDX-License-Identifier: BSD-3-Clause
// Every fault of the simulators at random times, recording after recording, and an independent
// reader over what is left: bench_capture_faults --minutes N --seed S [--folder F]
#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "app/recording/open_cameras.hpp"
#include "app/recording/recording.hpp"
#include "bench/capture/manifest_check.hpp"
#include "bench/capture/paced_video.hpp"
#include "capture/page/capture_page.hpp"
#include "core/system/file_io.hpp"
#include "drivers/aravis/aravis_source.hpp"
#include "drivers/v4l2/v4l2_source.hpp"
#include "tests/support/gev_simulator.hpp"

namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using namespace orbitfuse;
using Clock = std::chrono::steady_clock;
using testing::GevFaults;
using testing::GevOptions;
using testing::GevSimulator;

// ---- The recording program, a process of its own so that it can be killed. ----

std::atomic<bool> interrupted{false};
constexpr int refused = 3, failed = 4;

int record(const fs::path& folder, bool resume, std::uint32_t seed) {
  std::signal(SIGINT, [](int) { interrupted = true; });
  aravis::AravisOptions thermal;
  thermal.camera = "127.0.0.1";
  thermal.profiles = recording::shipped_profiles();
  v4l2::V4l2Options visible;
  std::vector<std::unique_ptr<FrameSource>> sources;
  sources.push_back(std::make_unique<aravis::AravisSource>(thermal));
  sources.push_back(
      std::make_unique<v4l2::V4l2Source>(visible, std::make_shared<bench::PacedVideo>(seed)));
  recording::RecordingOptions options;
  options.session = folder;
  options.resume = resume;
  options.live = true;
  recording::Recording recording(std::move(sources), options);
  PageOptions page;
  page.port = 0;
  page.token = "campaign-token";
  page.require_token = true;
  PageHooks hooks;
  hooks.state = [&] { return recording.state(); };
  hooks.latest = [&](Modality modality) { return recording.latest(modality); };
  hooks.correct = [&] { return recording.request_correction(); };
  WebServer server(page, capture_page(hooks));
  const auto tell = [](const Error& error) {
    std::fprintf(stderr, "%s\n", error.message().c_str());
  };
  if (const Status status = server.start(); !status) {
    tell(status.error());
    return refused;
  }
  if (const Status status = recording.prepare(); !status) {
    tell(status.error());
    return refused;
  }
  std::ofstream(folder / "page.port") << server.port() << std::endl;
  const auto ending = recording.run(&interrupted);
  if (!ending) tell(ending.error());
  return ending ? 0 : failed;
}

// ---- What goes wrong round it. ----

/// Peers that connect to the page, send a byte now and then, and never read.
class SlowPeers {
 public:
  explicit SlowPeers(int port) {
    for (int i = 0; port > 0 && i < 30; ++i) {
      const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
      sockaddr_in address{};
      address.sin_family = AF_INET;
      address.sin_port = htons(static_cast<std::uint16_t>(port));
      address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      if (::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0)
        fds_.push_back(fd);
      else
        ::close(fd);
    }
    drip_ = std::jthread([this](const std::stop_token& over) {
      const std::string text = "GET /state HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ";
      for (std::size_t i = 0; !over.stop_requested(); ++i) {
        const char byte = i < text.size() ? text[i] : 'x';
        for (const int fd : fds_) (void)!::send(fd, &byte, 1, MSG_NOSIGNAL | MSG_DONTWAIT);
        std::this_thread::sleep_for(100ms);
      }
    });
  }
  ~SlowPeers() {
    drip_ = {};
    for (const int fd : fds_) ::close(fd);
  }

 private:
  std::vector<int> fds_;
  std::jthread drip_;
};

class Campaign {
 public:
  Campaign(fs::path folder, std::uint32_t seed) : folder_(std::move(folder)), random_(seed) {}

  /// One recording with its faults; false when the GVCP port is taken.
  bool round();
  void report() const;
  bool clean() const { return violations_ == 0; }

 private:
  double chance() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  std::chrono::milliseconds some_ms(int least, int most) {
    return std::chrono::milliseconds(std::uniform_int_distribution<int>(least, most)(random_));
  }
  pid_t start(const fs::path& session, bool resume);
  void spoil(GevSimulator& camera);
  void camera_fault(GevSimulator& camera, const char* name, GevFaults fault,
                    std::chrono::milliseconds for_ms);
  void spoil_disk(const fs::path& session);
  int end(pid_t child, bool kill, bool over_already);
  void violation(const std::string& what);

  fs::path folder_;
  std::mt19937 random_;
  int rounds_ = 0, killed_ = 0, violations_ = 0;
  std::uint64_t frames_ = 0, lost_ = 0;
  double slowest_exit_s_ = 0;
  bool may_resume_ = false;
  std::map<std::string, int> faults_;
  std::string last_fault_;
};

void Campaign::violation(const std::string& what) {
  ++violations_;
  fmt::print("round {}: {}\n", rounds_, what);
  std::fflush(stdout);
}

pid_t Campaign::start(const fs::path& session, bool resume) {
  const std::string log = (folder_ / "log").string(), seed = std::to_string(random_()),
                    where = session.string();
  const pid_t child = fork();
  if (child != 0) return child;
  const int fd = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  dup2(fd, 1);
  dup2(fd, 2);
  execl("/proc/self/exe", "bench_capture_faults", "--record", where.c_str(),
        resume ? "resume" : "new", seed.c_str(), static_cast<char*>(nullptr));
  _exit(127);
}

void Campaign::camera_fault(GevSimulator& camera, const char* name, GevFaults fault,
                            std::chrono::milliseconds for_ms) {
  ++faults_[last_fault_ = name];
  camera.set_faults(fault);
  std::this_thread::sleep_for(for_ms);
  if (chance() < 0.85) camera.set_faults({});  // else it ends like this
}

void Campaign::spoil(GevSimulator& camera) {
  GevFaults fault;
  switch (std::uniform_int_distribution<int>(0, 13)(random_)) {
    case 0:
      fault.freeze = true;
      return camera_fault(camera, "freeze", fault, some_ms(500, 4000));
    case 1:
      fault.stall = true;
      return camera_fault(camera, "stall", fault, some_ms(300, 2500));
    case 2:
      fault.pause = true;
      return camera_fault(camera, "pause", fault, some_ms(300, 2500));
    case 3:
      fault.mute_control = true;
      return camera_fault(camera, "mute", fault, some_ms(500, 8000));
    case 4:
      fault.link_down = true;
      return camera_fault(camera, "link down", fault, some_ms(300, 5000));
    case 5:
      fault.packet_loss = 0.01;
      return camera_fault(camera, "loss", fault, some_ms(500, 3000));
    case 6:
      fault.packet_loss = 0.005;
      fault.answer_resend = false;
      return camera_fault(camera, "loss without resend", fault, some_ms(500, 3000));
    case 7:
      fault.reorder = fault.duplicate = 0.02;
      return camera_fault(camera, "reorder, duplicate", fault, some_ms(500, 3000));
    case 8:
      fault.short_frame_every = 5;
      return camera_fault(camera, "short", fault, some_ms(500, 3000));
    case 9:
      fault.wrong_size_every = 5;
      return camera_fault(camera, "lower", fault, some_ms(500, 3000));
    case 10:
      fault.wrong_format_every = 5;
      return camera_fault(camera, "format", fault, some_ms(500, 3000));
    case 11:
      ++faults_[last_fault_ = "clock step"];
      camera.step_clock(chance() < 0.5 ? -3.2 : 5);
      return;
    case 12:
      ++faults_[last_fault_ = "numbers restart"];
      camera.restart_ids();
      return;
    default:
      ++faults_[last_fault_ = "restart"];
      camera.kill();
      std::this_thread::sleep_for(some_ms(200, 4000));
      if (chance() < 0.85) camera.start_when_free();
  }
}

/// As if the disk were full: nothing can be written into the images' folder.
void Campaign::spoil_disk(const fs::path& session) {
  ++faults_[last_fault_ = "disk"];
  std::error_code error;
  fs::rename(session / "thermal", session / "thermal.kept", error);
  if (!error) std::ofstream(session / "thermal") << "no folder";
}

/// The exit status, 128 + signal for one that was killed.
int Campaign::end(pid_t child, bool kill_it, bool over_already) {
  constexpr double most_s = 2;
  if (!over_already) kill(child, kill_it ? SIGKILL : SIGINT);
  const auto asked = Clock::now();
  int status = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    if (Clock::now() - asked > 60s) {
      violation("it does not end");
      kill(child, SIGKILL);
      waitpid(child, &status, 0);
      break;
    }
    std::this_thread::sleep_for(2ms);
  }
  const double took_s = std::chrono::duration<double>(Clock::now() - asked).count();
  if (!over_already && !kill_it) {
    slowest_exit_s_ = std::max(slowest_exit_s_, took_s);
    if (took_s > most_s)
      violation(fmt::format("it took {:.2f} s to end, {} last", took_s, last_fault_));
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

bool Campaign::round() {
  ++rounds_;
  const fs::path session = folder_ / "session";
  const bool resume = may_resume_ && chance() < 0.5;
  if (!resume) fs::remove_all(session);
  GevOptions options;
  options.width = 160;
  options.height = 120;
  options.enforce_control = chance() < 0.5;
  GevSimulator camera(options);
  if (!camera.start_when_free()) return false;
  std::error_code ignored;
  fs::remove(session / "page.port", ignored);
  const pid_t child = start(session, resume);
  const auto limit = Clock::now() + 20s;
  while (!fs::exists(session / "page.port") && Clock::now() < limit)
    std::this_thread::sleep_for(20ms);
  const int port = std::atoi(read_file(session / "page.port").value_or("0").c_str());
  std::unique_ptr<SlowPeers> peers;
  if (chance() < 0.5) {
    ++faults_["slow peers"];
    peers = std::make_unique<SlowPeers>(port);
  }
  std::this_thread::sleep_for(some_ms(300, 2000));
  const int count = std::uniform_int_distribution<int>(1, 4)(random_);
  for (int i = 0; i < count; ++i) {
    spoil(camera);
    std::this_thread::sleep_for(some_ms(100, 2500));
  }
  const bool disk = chance() < 0.15, kill_it = !disk && chance() < 0.25;
  if (disk) {
    spoil_disk(session);
    std::this_thread::sleep_for(3s);
  }
  killed_ += kill_it;
  const int code = end(child, kill_it, false);
  if (disk && fs::exists(session / "thermal.kept")) {
    fs::remove(session / "thermal");
    fs::rename(session / "thermal.kept", session / "thermal");
  }
  if (kill_it ? code != 128 + SIGKILL : code != 0 && code != failed)
    violation(fmt::format("it ended with {}", code));
  const bench::Checked checked = bench::check_session(session, kill_it);
  for (const std::string& what : checked.violations) violation(what);
  if (!kill_it && checked.complete != (code == 0))
    violation(fmt::format("exit code {} and {} session", code,
                          checked.complete ? "a complete" : "an incomplete"));
  if (!checked.violations.empty())
    fs::copy(session, folder_ / fmt::format("violation{}", rounds_), fs::copy_options::recursive,
             ignored);
  frames_ += checked.frames;
  lost_ += checked.lost;
  may_resume_ = checked.violations.empty() && checked.frames < 3000;
  return true;
}

void Campaign::report() const {
  fmt::print(
      "{} recordings, {} of them killed; {} frames checked, {} lost and accounted for; slowest end "
      "{:.2f} s\n",
      rounds_, killed_, frames_, lost_, slowest_exit_s_);
  for (const auto& [name, times] : faults_) fmt::print("  {:<22} {}\n", name, times);
  fmt::print("{} violations\n", violations_);
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() == 4 && words[0] == "--record")
    std::_Exit(record(words[1], words[2] == "resume",
                      static_cast<std::uint32_t>(std::stoul(
                          words[3]))));  // as the program ends: its exit handlers wait for nobody
  double minutes = 1;
  unsigned long seed = 1;
  fs::path folder = fs::temp_directory_path() / fmt::format("capture_faults.{}", getpid());
  for (std::size_t i = 0; i + 1 < words.size(); i += 2) {
    if (words[i] == "--minutes") minutes = std::atof(words[i + 1].c_str());
    if (words[i] == "--seed") seed = std::strtoul(words[i + 1].c_str(), nullptr, 10);
    if (words[i] == "--folder") folder = words[i + 1];
  }
  fs::create_directories(folder);
  Campaign campaign(folder, static_cast<std::uint32_t>(seed));
  const auto over = Clock::now() + std::chrono::duration<double, std::ratio<60>>(minutes);
  while (Clock::now() < over) {
    if (campaign.round()) continue;
    std::fputs("the GVCP port 3956 on the loopback is in use\n", stderr);
    return 1;
  }
  campaign.report();
  if (campaign.clean()) fs::remove_all(folder);
  return campaign.clean() ? 0 : 1;
}
