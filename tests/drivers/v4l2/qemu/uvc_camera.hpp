// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <map>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "tests/drivers/v4l2/qemu/usbip_link.hpp"

namespace orbitfuse::v4l2::guest {

/// What goes wrong with one frame.
enum class Fault {
  none,
  cut,    ///< its second half never comes (its end is marked)
  error,  ///< the camera marks it with the error bit
  lost,   ///< nothing of it comes, not even its turn of the frame bit
};

/// A USB video camera in software: it is plugged in by its constructor and served by a thread.
/// Each frame shows its number; the camera remembers what it sent, which is the truth that a
/// recording is held to.
class UvcCamera {
 public:
  explicit UvcCamera(std::string serial, double rate_hz = 10);
  ~UvcCamera();

  void fail_next(Fault fault);              ///< the next frame that begins
  void fall_silent() { silent_ = true; }    ///< until the host commits a format again
  void halt_endpoint() { halted_ = true; }  ///< one transfer fails with a stall
  void unplug();

  int frames_begun() const { return frame_; }
  std::set<int> faulty_frames() const;
  /// The value of a control as the host left it.
  std::uint32_t exposure_mode() const { return control(camera_terminal, 0x02); }
  std::uint32_t exposure_100us() const { return control(camera_terminal, 0x04); }
  std::uint32_t white_balance_k() const { return control(processing_unit, 0x0a); }
  std::uint32_t white_balance_auto() const { return control(processing_unit, 0x0b); }
  void set_exposure_100us(std::uint32_t value);  ///< as its own automatic would

 private:
  using Clock = std::chrono::steady_clock;
  using Request = UsbipLink::Request;
  struct Control {
    int bytes;
    std::uint32_t minimum, maximum, step, initial, current;
  };
  using ControlKey = std::pair<std::uint8_t, std::uint8_t>;  ///< entity, selector

  void serve();
  void handle(Request request);
  void handle_control(const Request& request);
  std::optional<Bytes> standard_request(const Request& request);
  std::optional<Bytes> stream_request(const Request& request);
  std::optional<Bytes> control_request(const Request& request);
  void settle_stream(Bytes wanted);
  void begin_frame();
  void send_payloads();
  std::uint32_t control(std::uint8_t entity, std::uint8_t selector) const;

  const std::string serial_;
  const std::uint32_t interval_100ns_;
  std::atomic<bool> silent_{false}, halted_{false}, unplugging_{false};
  std::atomic<int> frame_{0};  ///< number of the newest frame
  mutable std::mutex mutex_;   ///< of what follows
  std::deque<Fault> faults_;
  std::set<int> faulty_;
  std::map<ControlKey, Control> controls_;

  // Only the serving thread's.
  UsbipLink link_;
  std::deque<Request> transfers_;  ///< waiting for payloads
  Bytes stream_settings_;          ///< the probe and commit control
  Bytes picture_;                  ///< of the frame that is being sent
  std::size_t sent_ = 0, sendable_ = 0;
  bool sending_ = false, frame_bit_ = false, marked_bad_ = false;
  Clock::time_point next_frame_at_{};
  std::thread thread_;
};

/// Frame `number` as the camera sends it.
Bytes picture(Format format, int number);
/// The number that a stored picture shows; none when it isn't exactly that frame. Thermal: 16-bit
/// counts; visible: 8-bit grey or BGR.
std::optional<int> shown_number(const cv::Mat& stored);

}  // namespace orbitfuse::v4l2::guest
