// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/camera.hpp"
#include "core/result.hpp"
#include "core/session/session.hpp"

// The seam to hardware. A driver implements four functions: describe, start, next, stop.
namespace orbitfuse {

/// 146 years. A camera's stamp is 64 bits from the wire; beyond this it is no time, and differences
/// would overflow.
inline constexpr std::int64_t latest_stamp_ns = std::int64_t{1} << 62;

/// One frame as a driver delivers it. Either `encoded` holds a whole file (JPEG, PNG, TIFF),
/// which is stored byte for byte, or `pixels` holds samples, which are stored without loss:
/// CV_8UC3 BGR or CV_8UC1 for visible, CV_16UC1 counts of temperature (0 = invalid) or CV_8UC1 for
/// thermal.
struct Frame {
  std::uint64_t id = 0;  ///< the device's own count, unwrapped; a gap = lost frames
  std::optional<std::int64_t> host_time_ns;    ///< UTC epoch at arrival; absent: unknown
  std::optional<std::int64_t> device_time_ns;  ///< device clock; absent: unknown
  std::string encoded, extension;              ///< extension with its dot, e.g. ".jpg"
  cv::Mat pixels;
  double kelvin_per_count = 0.01;  ///< of 16-bit thermal pixels; coarser where the scene is hotter
                                   ///< than 382 C (core/temperature.hpp)
  cv::Mat original;                ///< 16-bit counts behind an 8-bit thermal picture (RawCounts)
  std::optional<Station> station;
  bool tracking = false;
  bool thermal_is_gray = false;  ///< 8-bit thermal: no temperatures
  std::vector<std::string> flags;
  std::optional<Rigid3d> cam_from_world;
  std::optional<Camera> camera;
  std::string source;                         ///< original file name, if there was one
  std::optional<FlirCalibration> radiometry;  ///< behind the temperatures, where the file has it

  void flag(FrameFlag with) { flags.emplace_back(name(with)); }
};

/// What next() brought.
struct Delivery {
  enum class Kind {
    frame,     ///< a good frame
    rejected,  ///< the frame with this id arrived damaged; `reason` says how
    lost,      ///< no frame came up to the one with this id, itself included; `reason` says why
    event,     ///< `event` is its kind, `detail` its text
    timeout,   ///< nothing within the time given; the stream goes on
    end,       ///< the stream is over (replay, synthetic)
  };
  Kind kind = Kind::timeout;
  Frame frame;         ///< kind frame; of rejected and lost ones only the id
  EventKind event{};   ///< kind event
  std::string reason;  ///< of an event its name
  std::string detail;
  bool kept = false;  ///< of an event `ignored`: only a part of the file is, the frame came
};

inline Delivery event_delivery(EventKind kind, std::string detail) {
  Delivery delivery;
  delivery.kind = Delivery::Kind::event;
  delivery.event = kind;
  delivery.reason = name(kind);
  delivery.detail = std::move(detail);
  return delivery;
}

/// What earlier recordings of a session knew of a device.
struct Earlier {
  DeviceInfo device;
  std::vector<FrameRecord> frames;
  std::vector<GapRecord> gaps;
  std::uint64_t next_id = 0;  ///< after all that they account for, received or lost
};

/// The word before why a frame that came damaged is lost, in GapRecord::reason.
inline constexpr const char* rejected_because = "rejected: ";

/// One camera. start, next and stop are called from one thread, describe from any thread after
/// the constructor; stop is idempotent and is called even when start failed.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  virtual DeviceInfo describe() const = 0;
  /// Opens the stream; device error naming what is wrong and what to do.
  virtual Status start() = 0;
  /// Waits at most `timeout`. An error ends the stream; damage to single frames is not an error
  /// but a `rejected` delivery. Ids rise strictly.
  virtual Result<Delivery> next(std::chrono::milliseconds timeout) = 0;
  virtual void stop() = 0;
  /// Goes on with a session. Called before the first next(); a source of files leaves out those
  /// that it delivered then. True when its ids go on from Earlier::next_id by themselves; else the
  /// recording shifts them there.
  virtual bool resume(const Earlier& /*earlier*/) { return false; }
  /// The session holds frames of this scale (K a count): a source that chooses the scale of its
  /// thermal frames takes none finer. Before the first next(), beside resume().
  virtual void store_no_finer_than(double /*kelvin_per_count*/) {}
  /// Asks for a shutter correction (NUC) as soon as can be; from any thread, after start(). Events
  /// of the stream (nuc, nuc_failed) tell what came of it. Unavailable error where none is known.
  virtual Status request_correction() {
    return fail(ErrorKind::unavailable, describe().id, "has no shutter correction (NUC)",
                "only GigE Vision cameras whose profile has a nuc_command have one");
  }
  /// What the transport counted, for people, e.g. "1800 completed, 12 resent"; empty: nothing is
  /// counted. From the thread of next(), before stop().
  virtual std::string transport_report() const { return {}; }
  /// What is to be told when the recording ends before the source does: files that were still
  /// waited for, frames under way, and what an outage that lasts to the end cost. From the thread
  /// of next(), before stop().
  virtual std::vector<Delivery> unfinished() { return {}; }
  /// Whether nothing is lost when the recorder takes its time (files): then it never drops.
  virtual bool can_wait() const { return false; }
};

}  // namespace orbitfuse
