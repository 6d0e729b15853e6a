// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <optional>
#include <utility>

#include "capture/recording/resumed_event.hpp"
#include "capture/recording/resumed_ids.hpp"
#include "core/image/image_codec.hpp"
#include "drivers/synthetic/orbit.hpp"
#include "drivers/synthetic/renderer.hpp"
#include "drivers/synthetic/sensor.hpp"
#include "drivers/synthetic/stations.hpp"

namespace orbitfuse {
namespace {

/// A date for the recording; the thermal walk follows the visible one by two hours, as in the
/// field.
constexpr std::int64_t visible_start_ns = 1'790'000'000'000'000'000;
constexpr std::int64_t thermal_delay_ns = 7200ll * 1'000'000'000;

class SyntheticSource : public FrameSource {
 public:
  SyntheticSource(const SyntheticOptions& options, Modality modality)
      : options_(options),
        modality_(modality),
        camera_(synthetic::camera_of(synthetic::orbit_of(options, modality))),
        scene_(options.seed) {}

  DeviceInfo describe() const override {
    DeviceInfo device;
    device.id = std::string(name(modality_)) + "0";
    device.modality = modality_;
    device.driver = "synthetic";
    device.model =
        modality_ == Modality::visible ? "rendered colour camera" : "rendered microbolometer";
    device.serial = "seed " + std::to_string(options_.seed);
    // The data sheet's focal length, as EXIF or a lens label would give it; not the distortion.
    device.lens.focal_px = camera_.fx;
    return device;
  }

  Status start() override {
    ORBITFUSE_TRY(options_.validate());
    walk_ = synthetic::walk(options_, modality_);
    next_ = 0;
    return {};
  }

  /// Goes on after the last frame of the same walk that the earlier recording has.
  bool resume(const Earlier& earlier) override {
    const std::vector<FrameRecord>& frames = earlier.frames;
    std::size_t known = 0;
    for (std::size_t i = 0; i < walk_.size(); ++i) {
      const auto found = std::find_if(frames.begin(), frames.end(),
                                      [&](const FrameRecord& f) { return is_of(f, walk_[i]); });
      if (found == frames.end()) continue;
      ++known;
      next_ = i + 1;
      ids_.go_on(i, found->sequence, earlier.next_id);
    }
    if (known == 0) return false;
    resumed_ = resumed_event(known, walk_.size(), next_ == walk_.size());
    return true;
  }

  Result<Delivery> next(std::chrono::milliseconds) override {
    if (resumed_) return *std::exchange(resumed_, std::nullopt);
    Delivery delivery;
    if (next_ >= walk_.size()) {
      delivery.kind = Delivery::Kind::end;
      return delivery;
    }
    const synthetic::Exposure& exposure = walk_[next_];
    delivery.kind = Delivery::Kind::frame;
    Frame& frame = delivery.frame;
    frame.id = ids_.give(next_);
    frame.device_time_ns = device_time_ns(exposure);
    frame.host_time_ns = visible_start_ns + device_time_ns(exposure) +
                         (modality_ == Modality::thermal ? thermal_delay_ns : 0);
    frame.tracking = exposure.tracking;
    if (!exposure.tracking) frame.station = exposure.nominal;
    ORBITFUSE_TRY(render(exposure.cam_from_world, next_, frame));
    ++next_;
    return delivery;
  }

  void stop() override {}
  bool can_wait() const override { return true; }

 private:
  static std::int64_t device_time_ns(const synthetic::Exposure& exposure) {
    return static_cast<std::int64_t>(exposure.time_s * 1e9);
  }

  bool is_of(const FrameRecord& f, const synthetic::Exposure& exposure) const {
    // The first exposure is at 0, which a manifest can't tell from no time.
    if (f.device_time_ns.value_or(0) != device_time_ns(exposure) || f.width != camera_.width ||
        f.height != camera_.height)
      return false;
    return exposure.tracking ||
           (f.station && f.station->azimuth_deg == exposure.nominal.azimuth_deg &&
            f.station->elevation_deg == exposure.nominal.elevation_deg);
  }

  Status render(const Rigid3d& cam_from_world, std::uint64_t index, Frame& frame) const {
    const int samples = options_.samples_per_axis;
    if (modality_ == Modality::thermal) {
      frame.pixels = synthetic::spoil_thermal(
          synthetic::render_thermal(scene_, camera_, cam_from_world, samples), options_.defects,
          options_.seed, index);
      return {};
    }
    cv::Mat image = synthetic::render_visible(scene_, camera_, cam_from_world, samples);
    synthetic::spoil_visible(image, options_.visible_noise, options_.seed, index);
    // A camera that compresses by itself: its JPEG is what goes to disk, byte for byte.
    ORBITFUSE_ASSIGN(frame.encoded, encode_jpeg(image, options_.jpeg_quality));
    frame.extension = ".jpg";
    return {};
  }

  SyntheticOptions options_;
  Modality modality_;
  Camera camera_;
  synthetic::Scene scene_;
  std::vector<synthetic::Exposure> walk_;
  std::size_t next_ = 0;
  ResumedIds ids_;
  std::optional<Delivery> resumed_;  ///< to be told first
};

}  // namespace

std::unique_ptr<FrameSource> make_synthetic_source(const SyntheticOptions& options,
                                                   Modality modality) {
  return std::make_unique<SyntheticSource>(options, modality);
}

}  // namespace orbitfuse
