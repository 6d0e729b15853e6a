// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "capture/clock/clock_map.hpp"
#include "capture/frame_source.hpp"
#include "capture/recording/frame_rhythm.hpp"
#include "capture/recording/freeze_watch.hpp"
#include "capture/recording/lasting_failure.hpp"
#include "capture/recording/raw_counts.hpp"
#include "capture/recording/thermal_samples.hpp"
#include "drivers/v4l2/identity.hpp"
#include "drivers/v4l2/pixels.hpp"
#include "drivers/v4l2/video_system.hpp"

struct v4l2_buffer;

namespace orbitfuse::v4l2 {

struct V4l2Options {
  std::string camera = "/dev/video0";  ///< see CameraName
  std::string device_id = "visible0";  ///< key in the session
  Modality modality = Modality::visible;
  int width = 0, height = 0;  ///< 0: what the driver has set now
  double rate_hz = 0;         ///< 0: as above
  std::string format;         ///< "MJPG", "YUYV", "NV12", "GREY", "Y16 "; empty: the first
                              ///< of these that the camera has (Y16 first for thermal)
  int buffers = 4;            ///< fewer lose frames while one is stored
  double kelvin_per_dn = 0;   ///< UVC thermal cameras with linear output, e.g. 0.01
  /// Locked by default: a camera that adapts between stations changes colours between views.
  bool lock_exposure = true, lock_focus = true, lock_white_balance = true;
  /// Absent: the value that the camera's automatic had found after `adapt`.
  std::optional<int> exposure_100us, focus, white_balance_k;
  std::chrono::milliseconds adapt{1000};        ///< of streaming on automatic before locking
  std::chrono::milliseconds stall{2000};        ///< silence after which the stream is reopened
  std::chrono::milliseconds reopen_every{250};  ///< while the camera is away
  std::chrono::milliseconds nuc_settle{500};    ///< thermal frames right after a freeze still drift
  /// Resets the camera's USB port ("1-4.2"); called when reopening alone did not end a stall.
  std::function<Status(const std::string& usb_path)> reset_port;

  Status validate() const;
};

/// A UVC (or other V4L2 streaming) camera. Frames that the driver flags as damaged, or that are
/// shorter than their format, are rejected deliveries; sequence gaps show as id gaps. When the
/// camera is unplugged or stalls, everything is closed, and it is looked for (find_again) until it
/// is back, with the size and format that it had: events "disconnected", "stalled", "reopen-failed"
/// (back, but taken, forbidden or without bandwidth), "reconnected" tell, settings are pushed again
/// and verified ("setting-lost" when one is not). Serials are not always unique, so the port counts
/// too. A camera of the same serial in another port is taken ("moved", and its frames are flagged
/// "other-port") unless one like it was plugged in at the same time; when another one turns up in
/// the first port, that one is the session's
/// ("twin"). Without a serial, and once there was a twin, only the port counts: a camera like it
/// elsewhere is not taken ("look-alike").
/// Frozen thermal frames are flagged "nuc" (FreezeWatch).
/// "late-frame" tells of a pause without a gap in the driver's count (FrameRhythm).
class V4l2Source final : public FrameSource {
 public:
  V4l2Source(V4l2Options options, std::shared_ptr<VideoSystem> system = make_video_system());
  ~V4l2Source() override;

  DeviceInfo describe() const override;
  Status start() override;
  Result<Delivery> next(std::chrono::milliseconds timeout) override;
  void stop() override;
  std::vector<Delivery> unfinished() override;

 private:
  struct Mapping {
    void* address = nullptr;
    std::size_t length = 0;
  };
  using Clock = std::chrono::steady_clock;

  Status open_and_stream(const VideoSystem::Node& node);
  Status choose_format();
  Status set_rate();
  struct Lock;
  std::vector<Lock> locks() const;
  Status apply_controls();
  void set_automatic(const Lock& lock);
  void lock(const Lock& lock, int value);
  void lock_adapted();
  Status map_buffers();
  void close_device();
  Delivery lose(EventKind kind, const std::string& why);
  Delivery stall(const std::string& why);
  std::optional<Delivery> try_reopen();
  std::optional<Delivery> tell_look_alike();
  bool original_is_back();
  Result<Delivery> dequeue();
  Result<Delivery> empty_at_start(v4l2_buffer& buffer);
  Delivery delivery_of(std::uint32_t index, std::uint32_t bytes, std::uint32_t flags,
                       FreezeWatch::Clock::time_point taken_at);
  void watch_rhythm(std::uint64_t id, std::int64_t stamp_ns);
  void tell(EventKind kind, std::string detail);
  std::uint64_t unwrap(std::uint32_t sequence);
  int ioctl(unsigned long request, void* argument);

  V4l2Options options_;
  std::shared_ptr<VideoSystem> system_;
  std::optional<CameraIdentity> identity_;  ///< of the camera that was opened first
  mutable std::mutex node_mutex_;  ///< describe() comes from other threads while a camera reopens
  VideoSystem::Node node_;
  Layout layout_;
  std::optional<Layout> first_layout_;  ///< a session keeps its size
  ClockMap clock_;
  int fd_ = -1;
  bool away_ = false;
  bool moved_ = false;            ///< found again in another port, by its serial
  bool look_alike_told_ = false;  ///< in this outage
  Clock::time_point ports_looked_at_{};
  std::vector<Mapping> buffers_;
  RawCounts raw_counts_;
  ThermalSamples temperatures_;  ///< of Y16, where its scale is given
  FreezeWatch freeze_;
  std::vector<Delivery> pending_;  ///< events to tell before the next frame
  Clock::time_point last_frame_{}, last_attempt_{}, lost_at_{};
  std::uint64_t next_id_ = 0, base_id_ = 0;
  int stalls_in_a_row_ = 0, empty_at_start_ = 0;
  LastingFailure failure_;                         ///< to reopen
  std::map<std::uint32_t, int> locked_;            ///< controls and the values they were locked at
  bool adapting_ = false;                          ///< some are automatic still
  std::optional<std::int64_t> adapting_since_ns_;  ///< monotonic; absent: no frame yet
  FrameRhythm rhythm_;
  int late_frames_ = 0;
  Clock::time_point last_late_event_{};
  std::optional<std::uint32_t> last_sequence_;
};

}  // namespace orbitfuse::v4l2
