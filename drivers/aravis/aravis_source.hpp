// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "capture/clock/clock_map.hpp"
#include "capture/frame_source.hpp"
#include "capture/recording/frame_rhythm.hpp"
#include "capture/recording/freeze_watch.hpp"
#include "capture/recording/lasting_failure.hpp"
#include "capture/recording/raw_counts.hpp"
#include "capture/recording/thermal_samples.hpp"
#include "drivers/aravis/profile.hpp"

namespace orbitfuse::aravis {

struct AravisOptions {
  std::string camera;                  ///< IP address, serial or Aravis id; empty: the first found
  std::string device_id = "thermal0";  ///< key in the session
  Modality modality = Modality::thermal;
  std::filesystem::path profiles;          ///< folder of camera profiles (config/cameras)
  std::string profile;                     ///< a profile by name; empty: by model
  int buffers = 24;                        ///< 0.8 s at 30 Hz: rides over a slow moment of the host
  std::chrono::milliseconds silence{400};  ///< told as "silent" after this long without a frame
  std::chrono::milliseconds give_up{1000};    ///< and reopened after this long
  std::chrono::milliseconds nuc_settle{500};  ///< frames right after a shutter freeze still drift
  /// After two reopenings without a frame the next one waits this long, then twice as long each
  /// time up to the most: a camera that is opened again and again may never come up. There is no
  /// last one: it is tried until the recording ends.
  std::chrono::milliseconds patience{2000}, most_patience{10000};

  Status validate() const;
};

struct StreamStatistics {
  std::uint64_t completed = 0, failures = 0, underruns = 0, resent = 0, size_mismatches = 0;

  StreamStatistics& operator+=(const StreamStatistics& other);
};

/// A GigE Vision camera. Aravis calls some damaged frames good, so every frame is checked for its
/// data size, width, height, pixel format and Aravis' own mismatch counter; ids are counted here
/// (16 bits, never 0); silence of the stream or of the control channel is told within half a
/// second. A lost camera is torn down on another thread; when that is over it is probed for,
/// reopened, and its settings pushed and verified again. It is back with its first frame. Frozen
/// (bit-equal) frames are flagged nuc. Ids leave room for the frames that an outage cost, so that
/// they count as lost: by the camera's own numbers where these went on, else by the outage's
/// length.
class AravisSource final : public FrameSource {
 public:
  explicit AravisSource(AravisOptions options);
  ~AravisSource() override;

  DeviceInfo describe() const override;
  Status start() override;
  Result<Delivery> next(std::chrono::milliseconds timeout) override;
  void stop() override;

  /// Done by the next next().
  Status request_correction() override;
  std::vector<Delivery> unfinished() override;
  std::string transport_report() const override;
  void store_no_finer_than(double kelvin_per_count) override;
  /// Asks the camera for a shutter correction now; frames until it settles are flagged.
  Status correct_nonuniformity();
  /// Of all connections since the source was made.
  StreamStatistics statistics() const;
  const ClockMap& clock() const { return clock_; }

 private:
  struct Link;
  using Clock = std::chrono::steady_clock;

  enum class State {
    streaming,  ///< the stream runs, or it is not started
    away,       ///< lost; there is no connection
    proving,    ///< opened again, but no frame has come yet
  };

  Status open();
  Status push_settings();
  Status settle_image(Link& link, const std::string& where);
  Result<std::optional<ThermalSamples>> temperatures();
  void bury_link();
  void watch_control();
  Delivery lose(const std::string& why);
  Delivery correct_as_asked();
  StreamStatistics link_statistics() const;
  std::optional<Delivery> try_reopen();
  Delivery on_silence();
  Delivery take(void* buffer);
  struct Arrival {
    std::int64_t utc_ns;
    Clock::time_point at;
  };
  Delivery come_back(void* buffer, const Arrival& arrival);
  Delivery inspect(void* buffer, const Arrival& arrival);
  std::optional<std::string> damage(void* buffer);
  void drain(std::vector<Delivery>& list);

  AravisOptions options_;
  CameraProfile profile_;
  std::shared_ptr<Link> link_;
  struct Image {
    int width = 0, height = 0;
    unsigned pixel_format = 0;
  };
  std::optional<Image> first_image_;  ///< a session keeps its size
  std::jthread control_watch_;
  std::atomic<bool> control_mute_{false}, correction_wanted_{false};
  StreamStatistics earlier_;                       ///< of connections that are gone
  std::optional<ThermalSamples> temperatures_;     ///< nothing: counts of unknown scale
  double least_kelvin_per_count_ = kelvin_per_dn;  ///< of earlier connections and recordings
  std::vector<Delivery> pending_;
  mutable std::mutex info_mutex_;  ///< others ask while a camera reopens
  DeviceInfo info_;
  Status correctable_;  ///< why not, where it isn't
  std::string address_;
  GvspFrameCounter counter_;
  ClockMap clock_;
  RawCounts raw_counts_;
  FreezeWatch freeze_;
  std::optional<std::uint16_t> last_number_;  ///< the camera's, of the last frame
  LastingFailure failure_;                    ///< to reopen
  std::uint64_t base_id_ = 0, next_id_ = 0, mismatches_ = 0;
  FrameRhythm rhythm_;  ///< tells how many frames an outage cost
  int duplicates_in_a_row_ = 0;
  State state_ = State::streaming;
  bool going_ = false;  ///< a connection was given to Teardowns since the last stop()
  bool silent_told_ = false, mute_told_ = false;
  int fruitless_ = 0;                               ///< reopenings of this outage without a frame
  Clock::time_point last_frame_{};                  ///< or the opening of its connection
  Clock::time_point last_came_{}, next_attempt_{};  ///< last_came_: of a frame, by its first packet
};

struct FoundCamera {
  std::string id, model, serial, address;
};
/// Cameras that answer on the local networks, loopback included.
std::vector<FoundCamera> discover();

}  // namespace orbitfuse::aravis
