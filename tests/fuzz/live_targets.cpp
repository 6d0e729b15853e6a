// SPDX-License-Identifier: BSD-3-Clause
// What reaches a recording from outside while it runs: requests to its page, and what cameras send.
// GigE Vision's stream packets are put together by Aravis; its frames and answers come to us.
#include <linux/videodev2.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "capture/clock/clock_map.hpp"
#include "capture/page/capture_page.hpp"
#include "capture/recording/frame_encoding.hpp"
#include "capture/recording/frame_rhythm.hpp"
#include "capture/recording/raw_counts.hpp"
#include "capture/recording/thermal_samples.hpp"
#include "core/http/connection_gate.hpp"
#include "core/system/file_io.hpp"
#include "drivers/aravis/gvcp_probe.hpp"
#include "drivers/aravis/profile.hpp"
#include "drivers/aravis/thermal_table.hpp"
#include "drivers/v4l2/pixels.hpp"
#include "tests/fuzz/targets.hpp"

namespace orbitfuse::fuzz {
namespace {

constexpr const char* token = "0123456789abcdef";

void must(bool holds) {
  if (!holds) std::abort();
}

/// A page with all its hooks, which needs a token. Notes whether a button was pressed.
struct Page {
  std::atomic<bool> pressed{false};
  WebServer server;

  static PageOptions options() {
    PageOptions o;
    o.require_token = true;
    o.token = token;
    return o;
  }
  PageHooks hooks() {
    PageHooks h;
    h.state = [] { return LiveState{}; };
    h.latest = [](Modality modality) -> std::optional<LatestFrame> {
      if (modality == Modality::visible)
        return LatestFrame{modality, cv::Mat(12, 16, CV_8UC3, cv::Scalar(9, 8, 7)), "v"};
      return LatestFrame{modality, cv::Mat(12, 16, CV_16UC1, cv::Scalar(30000)), "t"};
    };
    h.start = h.stop = h.at_station = h.correct = [this]() -> Result<std::string> {
      pressed = true;
      return "done";
    };
    return h;
  }
  Page() : server(options(), capture_page(hooks())) {}
};

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// The same bytes over a socket that is no network: parts of them as separate reads.
void over_a_connection(std::string_view bytes, Page& page) {
  static const std::string name =
      std::string(1, '\0') + "orbitfuse-fuzz-" + std::to_string(::getpid());
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, name.data(), name.size());
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
  static ConnectionGate gate(
      [&] {
        const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
        must(::bind(fd, reinterpret_cast<const sockaddr*>(&address), size) == 0);
        ::listen(fd, 64);
        return fd;
      }(),
      GateLimits{},
      [&page](const std::string& request, const std::atomic<bool>&) {
        return page.server.answer(request);
      });
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  must(::connect(fd, reinterpret_cast<const sockaddr*>(&address), size) == 0);
  for (std::size_t at = 0; at < bytes.size(); at += 1000) {
    const std::string_view part = bytes.substr(at, 1000);
    if (::send(fd, part.data(), part.size(), MSG_NOSIGNAL) < 0) break;
  }
  ::shutdown(fd, SHUT_WR);
  char answer[4096];
  while (::recv(fd, answer, sizeof answer, 0) > 0) {
  }
  ::close(fd);
}

/// Whatever is asked, the answer is one of HTTP; nobody presses a button or sees a picture without
/// the token, nor without the header that other sites' pages can't send.
void http(std::string_view bytes) {
  static Page page;
  const std::string request(bytes);
  must(request_size(request).value_or(0) <= request.size() + (std::size_t{1} << 30));
  page.pressed = false;
  const std::string answer = page.server.answer(request);
  must(answer.empty() || answer.starts_with("HTTP/1."));
  const bool served = answer.starts_with("HTTP/1.1 200");
  const std::string asked = lower(request);
  if (page.pressed) must(asked.find("x-orbitfuse") != std::string::npos);
  // A token in the address may be written in percent escapes.
  if (page.pressed || served)
    must(request.find(token) != std::string::npos || request.find('%') != std::string::npos);
  over_a_connection(bytes, page);
}

/// Numbers at the front of an input, and the rest.
class Front {
 public:
  explicit Front(std::string_view bytes) : bytes_(bytes) {}
  template <class T>
  T take() {
    T value{};
    const std::size_t size = std::min(sizeof value, bytes_.size());
    std::memcpy(&value, bytes_.data(), size);
    bytes_.remove_prefix(size);
    return value;
  }
  bool empty() const { return bytes_.empty(); }
  std::string_view rest() const { return bytes_; }

 private:
  std::string_view bytes_;
};

std::span<const std::uint8_t> octets(std::string_view bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

void camera_frame(Front in) {
  constexpr std::uint32_t formats[] = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_NV12,
                                       V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_Y16,   0};
  v4l2::Layout layout;
  layout.fourcc = formats[in.take<std::uint8_t>() % 6];
  layout.width = in.take<std::uint8_t>();
  layout.height = in.take<std::uint8_t>();
  layout.bytes_per_line = in.take<std::int16_t>();
  const bool thermal = in.take<std::uint8_t>() & 1;
  Frame frame;
  if (!v4l2::unpack(octets(in.rest()), layout, frame)) return;
  if (layout.fourcc == V4L2_PIX_FMT_Y16) {
    RawCounts counts;
    Frame raw = frame;
    raw.pixels = frame.pixels.clone();
    static_cast<void>(counts.apply(raw));
    ThermalSamples samples = ThermalSamples::linear(0.04);
    static_cast<void>(samples.apply(frame, 0x3fff));
  }
  frame.thermal_is_gray = thermal && frame.pixels.depth() == CV_8U;
  static_cast<void>(encode_frame(frame, thermal ? Modality::thermal : Modality::visible, "fuzz"));
}

void camera_constants(Front in) {
  aravis::PlanckParameters p;
  for (double* value : {&p.r, &p.b, &p.f, &p.j0, &p.j1, &p.emissivity, &p.reflected_k,
                        &p.transmission, &p.atmosphere_k})
    *value = static_cast<double>(in.take<float>());
  auto kelvin = aravis::planck_table(p);
  if (!kelvin) return;
  ThermalSamples samples = ThermalSamples::table(std::move(*kelvin));
  Frame frame;
  frame.pixels.create(4, 8, CV_16UC1);
  for (auto it = frame.pixels.begin<std::uint16_t>(); it != frame.pixels.end<std::uint16_t>(); ++it)
    *it = in.take<std::uint16_t>();
  static_cast<void>(samples.apply(frame, 65535));
}

void camera_stamps(Front in) {
  ClockMap clock;
  FrameRhythm rhythm;
  GvspFrameCounter counter;
  std::int64_t arrival_ns = 1'800'000'000'000'000'000, last = 0;
  while (!in.empty()) {
    const auto id = in.take<std::uint16_t>();
    const auto stamp = in.take<std::int64_t>();
    arrival_ns += in.take<std::uint32_t>();
    const ClockMap::Stamp at = clock.add(stamp, arrival_ns);
    must(at.host_time_ns > last);
    last = at.host_time_ns;
    if (const auto count = counter.unwrap(id)) rhythm.note(*count, stamp);
  }
  must(rhythm.frames_in(1) >= 1);
}

void camera(std::string_view bytes) {
  Front in(bytes);
  switch (in.take<std::uint8_t>() % 4) {
    case 0:
      return camera_frame(in);
    case 1:
      return camera_constants(in);
    case 2:
      return camera_stamps(in);
    default:
      static_cast<void>(aravis::is_discovery_answer(octets(in.rest())));
      static_cast<void>(aravis::register_in_answer(octets(in.rest())));
  }
}

void profile(std::string_view bytes) {
  static const ScratchFile file;
  static_cast<void>(aravis::read_profile(file.with(bytes)));
}

std::vector<std::string> http_seeds() {
  const std::string head = std::string("\r\nHost: 127.0.0.1:8470\r\nX-Token: ") + token + "\r\n";
  const std::string post = head + "X-OrbitFuse: 1\r\n";
  return {
      "GET / HTTP/1.1" + head + "\r\n",
      "GET /state HTTP/1.1" + head + "Accept: */*\r\n\r\n",
      "GET /preview/thermal?palette=inferno&low=280&high=343 HTTP/1.1" + head + "\r\n",
      "HEAD /preview/visible HTTP/1.0" + head + "Range: bytes=0-10,20-\r\n\r\n",
      "GET /temperature?u=0.5&v=%30.5&token=" + std::string(token) +
          " HTTP/1.1\r\nHost: [::1]:1\r\n\r\n",
      "POST /stop HTTP/1.1" + post + "\r\n",
      "POST /nuc HTTP/1.1" + post + "Content-Length: 3\r\n\r\na=b",
      "POST /start HTTP/1.1" + post +
          "Content-Type: multipart/form-data; boundary=x\r\nContent-Length: "
          "75\r\n\r\n--x\r\nContent-Disposition: form-data; name=\"a\"; "
          "filename=\"b\"\r\n\r\nc\r\n--x--\r\n",
      "POST /station HTTP/1.1" + post + "Transfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n0\r\n\r\n",
      "POST /stop HTTP/1.1" + post +
          "Content-Encoding: gzip\r\nContent-Length: 4\r\n\r\n\x1f\x8b\x08",
      "GET /" + std::string(8000, 'a') + " HTTP/1.1" + head + "\r\n",
      "OPTIONS * HTTP/1.1" + head + "Expect: 100-continue\r\n\r\n"};
}

template <class T>
void put(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::vector<std::string> camera_seeds() {
  std::vector<std::string> seeds;
  for (char format = 0; format < 5; ++format) {
    for (char thermal = 0; thermal < 2; ++thermal) {
      std::string seed{0, format, 8, 4, 16, 0, thermal};
      cv::Mat image(4, 8, CV_8UC3, cv::Scalar(1, 2, 3));
      seeds.push_back(seed + (format == 1 ? *encode_jpeg(image, 80) : std::string(64, 'x')));
    }
  }
  std::string constants(1, 1), stamps(1, 2);
  for (const float value : {16000.F, 1430.F, 1.F, 100.F, 40.F, 0.95F, 293.F, 0.9F, 290.F})
    put(constants, value);
  seeds.push_back(constants + std::string(64, '\x50'));
  for (int i = 0; i < 40; ++i) {
    put(stamps, static_cast<std::uint16_t>(i + 1));
    put(stamps, std::int64_t{1} + i * 33'000'000);
    put(stamps, std::uint32_t{33'000'000});
  }
  seeds.push_back(stamps);
  seeds.push_back(std::string("\3\0\0\0\x81\0\4\x6f\x66\1\2\3\4", 13));
  seeds.push_back(std::string("\3\0\0\0\3\0\0\x6f\x66", 9));
  return seeds;
}

std::vector<std::string> profile_seeds() {
  std::vector<std::string> seeds;
  for (const char* name : {"flir-a50-a70", "flir-ax5-hot", "flir-radiometric", "generic"})
    seeds.push_back(
        read_file(std::string(ORBITFUSE_SOURCE_DIR) + "/config/cameras/" + name + ".toml").value());
  return seeds;
}

}  // namespace

const std::vector<Target>& live_targets() {
  static const std::vector<Target> list{{"http", http, http_seeds},
                                        {"camera", camera, camera_seeds},
                                        {"profile", profile, profile_seeds}};
  return list;
}

}  // namespace orbitfuse::fuzz
