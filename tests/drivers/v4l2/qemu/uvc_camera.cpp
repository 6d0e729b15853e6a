// SPDX-License-Identifier: BSD-3-Clause
#include "tests/drivers/v4l2/qemu/uvc_camera.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

namespace orbitfuse::v4l2::guest {
namespace {

enum Get : std::uint8_t {
  set_cur = 0x01,
  get_cur = 0x81,
  get_min,
  get_max,
  get_res,
  get_len,
  get_info,
  get_def
};
constexpr std::uint8_t commit_control = 0x02;

// Payload header (UVC 1.1, section 2.4.3.3).
enum HeaderBit : std::uint8_t {
  frame_id = 1,
  end_of_frame = 2,
  error_bit = 0x40,
  end_of_header = 0x80
};
constexpr std::size_t header_bytes = 2;

constexpr int bits = 16, block = width / bits;

}  // namespace

UvcCamera::UvcCamera(std::string serial, double rate_hz)
    : serial_(std::move(serial)),
      interval_100ns_(static_cast<std::uint32_t>(std::lround(1e7 / rate_hz))),
      controls_{{{camera_terminal, 0x02}, {1, 0, 0, 0x09, 8, 8}},  // automatic
                {{camera_terminal, 0x04}, {4, 1, 10000, 1, 156, 156}},
                {{processing_unit, 0x0a}, {2, 2800, 6500, 1, 4600, 4600}},
                {{processing_unit, 0x0b}, {1, 0, 1, 1, 1, 1}}} {  // automatic
  settle_stream(Bytes(34, 0));
  thread_ = std::thread([this] { serve(); });
}

UvcCamera::~UvcCamera() { unplug(); }

void UvcCamera::unplug() {
  unplugging_ = true;
  if (thread_.joinable()) thread_.join();
}

void UvcCamera::fail_next(Fault fault) {
  const std::lock_guard lock(mutex_);
  faults_.push_back(fault);
}

std::set<int> UvcCamera::faulty_frames() const {
  const std::lock_guard lock(mutex_);
  return faulty_;
}

std::uint32_t UvcCamera::control(std::uint8_t entity, std::uint8_t selector) const {
  const std::lock_guard lock(mutex_);
  return controls_.at({entity, selector}).current;
}

void UvcCamera::set_exposure_100us(std::uint32_t value) {
  const std::lock_guard lock(mutex_);
  controls_.at({camera_terminal, 0x04}).current = value;
}

void UvcCamera::serve() {
  while (!unplugging_ && link_.plugged()) {
    if (auto request = link_.receive(2)) handle(std::move(*request));
    begin_frame();
    send_payloads();
  }
  link_.unplug();
}

void UvcCamera::handle(Request request) {
  if (request.unlink) {
    const auto pending = std::find_if(transfers_.begin(), transfers_.end(), [&](const Request& t) {
      return t.number == request.unlinked_number;
    });
    const bool was_pending = pending != transfers_.end();
    if (was_pending) transfers_.erase(pending);
    link_.answer_unlink(request, was_pending);
  } else if (request.endpoint == 0) {
    handle_control(request);
  } else {
    transfers_.push_back(std::move(request));
  }
}

void UvcCamera::handle_control(const Request& request) {
  const auto& setup = request.setup;
  const bool of_class = (setup[0] & 0x60) == 0x20;
  std::optional<Bytes> answer;
  if (!of_class)
    answer = standard_request(request);
  else if (setup[4] == streaming_interface)
    answer = stream_request(request);
  else
    answer = control_request(request);
  if (!answer) return link_.answer(request, -EPIPE);  // a stall: not supported
  if (answer->size() > request.length) answer->resize(request.length);
  link_.answer(request, 0, *answer);
}

std::optional<Bytes> UvcCamera::standard_request(const Request& request) {
  const auto& setup = request.setup;
  if (setup[1] != 0x06) return request.in ? Bytes{0, 0} : Bytes{};  // status, features, interfaces
  switch (setup[3]) {
    case 1:
      return device_descriptor();
    case 2:
      return configuration_descriptor(interval_100ns_);
    case 3:
      if (setup[2] == 0) return language_descriptor();
      return string_descriptor(setup[2] == 1   ? "OrbitFuse"
                               : setup[2] == 2 ? "Software camera"
                                               : serial_);
    default:
      return std::nullopt;
  }
}

/// Only what it can do: the host asks with any settings and is told the nearest.
void UvcCamera::settle_stream(Bytes wanted) {
  wanted.resize(34, 0);
  Bytes settled{wanted[0], wanted[1], std::clamp<std::uint8_t>(wanted[2], 1, 3), 1};
  put(settled, interval_100ns_, 4);
  put(settled, 0, 10);
  put(settled, frame_bytes, 4);
  put(settled, payload_bytes, 4);
  put(settled, 1'000'000, 4);
  put(settled, 0, 4);
  stream_settings_ = std::move(settled);
}

std::optional<Bytes> UvcCamera::stream_request(const Request& request) {
  const std::uint8_t selector = request.setup[3];
  switch (request.setup[1]) {
    case set_cur:
      settle_stream(request.data);
      if (selector == commit_control) {  // streaming begins
        silent_ = false;
        sending_ = false;
      }
      return Bytes{};
    case get_cur:
    case get_min:
    case get_max:
    case get_def:
      return stream_settings_;
    case get_len:
      return Bytes{34, 0};
    case get_info:
      return Bytes{3};
    default:
      return std::nullopt;
  }
}

std::optional<Bytes> UvcCamera::control_request(const Request& request) {
  const std::lock_guard lock(mutex_);
  const auto found = controls_.find({request.setup[5], request.setup[3]});
  if (found == controls_.end()) return std::nullopt;
  Control& control = found->second;
  Bytes answer;
  switch (request.setup[1]) {
    case set_cur:
      control.current = get(request.data, 0, control.bytes);
      return answer;
    case get_cur:
      put(answer, control.current, control.bytes);
      return answer;
    case get_min:
      put(answer, control.minimum, control.bytes);
      return answer;
    case get_max:
      put(answer, control.maximum, control.bytes);
      return answer;
    case get_res:
      put(answer, control.step, control.bytes);
      return answer;
    case get_def:
      put(answer, control.initial, control.bytes);
      return answer;
    case get_len:
      put(answer, static_cast<std::uint64_t>(control.bytes), 2);
      return answer;
    case get_info:
      return Bytes{3};
    default:
      return std::nullopt;
  }
}

void UvcCamera::begin_frame() {
  if (sending_ || transfers_.empty() || silent_ || Clock::now() < next_frame_at_) return;
  // A machine that is late drops no frame: the next one is an interval later.
  next_frame_at_ = Clock::now() + std::chrono::nanoseconds(100ll * interval_100ns_);
  Fault fault = Fault::none;
  {
    const std::lock_guard lock(mutex_);
    if (!faults_.empty()) {
      fault = faults_.front();
      faults_.pop_front();
      faulty_.insert(frame_ + 1);
    }
    ++frame_;
  }
  frame_bit_ = !frame_bit_;
  if (fault == Fault::lost) return;
  picture_ = picture(static_cast<Format>(stream_settings_[2]), frame_);
  sent_ = 0;
  sendable_ = fault == Fault::cut ? picture_.size() / 2 : picture_.size();
  marked_bad_ = fault == Fault::error;
  sending_ = true;
}

void UvcCamera::send_payloads() {
  while (sending_ && !silent_ && !transfers_.empty()) {
    const Request transfer = std::move(transfers_.front());
    transfers_.pop_front();
    if (halted_.exchange(false)) return link_.answer(transfer, -EPIPE);
    const std::size_t room = std::min<std::size_t>(transfer.length, payload_bytes) - header_bytes;
    const std::size_t count = std::min(room, sendable_ - sent_);
    const bool last = sent_ + count == sendable_;
    Bytes payload(header_bytes + count);
    payload[0] = header_bytes;
    payload[1] =
        static_cast<std::uint8_t>(end_of_header | (frame_bit_ ? frame_id : 0) |
                                  (last ? end_of_frame : 0) | (marked_bad_ ? error_bit : 0));
    std::copy_n(picture_.begin() + static_cast<std::ptrdiff_t>(sent_), count,
                payload.begin() + header_bytes);
    sent_ += count;
    sending_ = !last;
    link_.answer(transfer, 0, payload);
  }
}

Bytes picture(Format format, int number) {
  if (format == Format::y16) {  // centikelvin: about 20 degrees C and the frame's number
    Bytes bytes;
    bytes.reserve(frame_bytes);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x)
        put(bytes, static_cast<std::uint64_t>(29315 + number + x % 7), 2);
    }
    return bytes;
  }
  // The number in binary: bright and dark columns over the whole height.
  cv::Mat luma(height, width, CV_8UC1);
  for (int x = 0; x < width; ++x) luma.col(x) = number >> (x / block) & 1 ? 235 : 16;
  Bytes bytes;
  if (format == Format::mjpeg) {
    cv::imencode(".jpg", luma, bytes, {cv::IMWRITE_JPEG_QUALITY, 90});
    return bytes;
  }
  bytes.assign(frame_bytes, 128);
  for (int i = 0; i < width * height; ++i) bytes[static_cast<std::size_t>(2 * i)] = luma.data[i];
  return bytes;
}

std::optional<int> shown_number(const cv::Mat& stored) {
  if (stored.cols != width || stored.rows != height) return std::nullopt;
  cv::Mat first = stored.row(0), all;
  cv::repeat(first, height, 1, all);
  if (cv::norm(all, stored, cv::NORM_INF) > (stored.depth() == CV_16U ? 0 : 24))
    return std::nullopt;
  if (stored.type() == CV_16UC1) {
    for (int x = 0; x < width; ++x) {
      if (first.at<std::uint16_t>(x) != first.at<std::uint16_t>(0) + x % 7) return std::nullopt;
    }
    return first.at<std::uint16_t>(0) - 29315;
  }
  int number = 0;
  for (int bit = 0; bit < bits; ++bit) {
    const int x = bit * block + block / 2;
    const int level =
        stored.channels() == 3 ? first.at<cv::Vec3b>(x)[1] : first.at<std::uint8_t>(x);
    if (level > 128) number |= 1 << bit;
  }
  return number;
}

}  // namespace orbitfuse::v4l2::guest
