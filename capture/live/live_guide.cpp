// SPDX-License-Identifier: BSD-3-Clause
#include "capture/live/live_guide.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "capture/image_quality/frame_motion.hpp"
#include "capture/image_quality/frame_quality.hpp"
#include "core/image/exif.hpp"
#include "core/image/image_codec.hpp"
#include "core/option_range.hpp"
#include "core/system/file_io.hpp"
#include "core/system/utc_now.hpp"

namespace orbitfuse {
namespace {

constexpr double darkest_mean_level = 8;     // of 255
constexpr std::size_t photos_in_memory = 4;  // of 36 MB each; those behind them are read back

/// The image of a frame on disk, upright.
std::optional<cv::Mat> read_back(const std::filesystem::path& file) {
  const Result<std::string> bytes = read_file(file);
  if (!bytes) return std::nullopt;
  const Result<cv::Mat> image = decode_image(*bytes, file.string());
  if (!image) return std::nullopt;
  return apply_orientation(*image, read_exif(*bytes).orientation);
}

/// Nothing where one of the moments is unknown.
std::optional<double> seconds_between(std::optional<std::int64_t> from_ns,
                                      std::optional<std::int64_t> to_ns) {
  if (!from_ns || !to_ns) return std::nullopt;
  return 1e-9 * static_cast<double>(*to_ns - *from_ns);
}

void note_edges(FrameRecord& frame, const cv::Mat& image) {
  if (frame.quality && !frame.quality->edge_blur) frame.quality->edge_blur = measure_edges(image);
}

}  // namespace

Status LiveGuideOptions::validate() const {
  ORBITFUSE_TRY(plan.validate());
  ORBITFUSE_TRY(coverage.validate());
  const OptionCheck check("guide");
  ORBITFUSE_TRY(check("looks_per_second", looks_per_second, above_up_to(0, 100)));
  if (turntable_step_deg) {
    ORBITFUSE_TRY(check("turntable_step_deg", std::abs(*turntable_step_deg), above_up_to(0, 120)));
  }
  ORBITFUSE_TRY(check("key_motion", key_motion, between(0, 1)));
  return check("unseen_after_s", unseen_after_s, above(0));
}

LiveGuide::LiveGuide(SessionWriter& writer, LiveGuideOptions options, PositionFinder finder)
    : writer_(writer),
      options_(std::move(options)),
      finder_(std::move(finder)),
      coverage_(options_.plan, options_.coverage) {
  if (options_.turntable_step_deg) table_.emplace(*options_.turntable_step_deg);
  for (const Modality modality : options_.plan.modalities) {
    Camera& camera = cameras_[modality];
    camera.shown.modality = modality;
    camera.policy = policy_for(modality);
    say_next(camera, std::nullopt, Refusal::none);
  }
  if (finder_) looker_ = std::jthread([this] { find_mat_in_frames(); });
}

std::unique_ptr<PositionPolicy> LiveGuide::policy_for(Modality modality) {
  if (options_.stations_come_with_frames) return carried_stations(coverage_, modality);
  if (table_) return turntable_steps(coverage_, *table_);
  return finder_ ? mat_in_view(coverage_, modality, finder_) : operator_key(coverage_, modality);
}

LiveGuide::~LiveGuide() { finish(); }

void LiveGuide::finish() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
    changed_.notify_all();
  }
  if (looker_.joinable()) looker_.join();
}

void LiveGuide::resume(const std::vector<FrameRecord>& earlier) {
  const std::lock_guard lock(mutex_);
  for (const FrameRecord& frame : earlier) {
    const auto known = cameras_.find(frame.modality);
    if (known == cameras_.end() || !frame.station || frame.tracking) continue;
    known->second.shown.latest_file = frame.file;
    add_at_station(known->second, frame);
    known->second.policy->resume_at(*frame.station);
    known->second.chosen.remember(frame, coverage_.sectors());
  }
  for (auto& [modality, camera] : cameras_) say_next(camera, camera.position, Refusal::none);
}

/// The source's or the operator's word: there, and at rest.
void LiveGuide::add_at_station(Camera& camera, const FrameRecord& frame) {
  set_position(camera, {frame.station->azimuth_deg, frame.station->elevation_deg, 0, 0},
               frame.host_time_ns);
  camera.position->speed_deg_s = 0;
  judge(camera, frame, camera.position);
}

void LiveGuide::add(const FrameRecord& stored, const cv::Mat& pixels, double kelvin_per_count) {
  FrameRecord frame = stored;
  const bool at_station = frame.station && !frame.tracking;
  // Measuring takes long: the other camera's frames and the page don't wait for it.
  cv::Mat image = pixels;
  if (image.empty() && needs_image(frame)) {
    if (const auto read = read_back(writer_.folder() / frame.file)) image = *read;
  }
  if ((at_station || frame.has_flag(FrameFlag::still)) && !image.empty()) note_edges(frame, image);
  const std::lock_guard lock(mutex_);
  const auto known = cameras_.find(frame.modality);
  if (known == cameras_.end()) return;  // this orbit is not asked for
  Camera& camera = known->second;
  camera.shown.latest_file = frame.file;
  if (at_station) {
    if (!camera.stations_come) camera.policy = carried_stations(coverage_, frame.modality);
    camera.stations_come = true;
    add_at_station(camera, frame);
  } else {
    place(camera, {frame, image, kelvin_per_count});
  }
}

/// A frame that doesn't carry its station.
void LiveGuide::place(Camera& camera, const Look& look) {
  const auto& [frame, image, kelvin_per_count] = look;
  const bool photo = frame.has_flag(FrameFlag::still);
  const std::optional<OrbitPosition> told = photo ? camera.policy->of_photo(frame) : std::nullopt;
  if (told) {
    camera.announced = told;
    judge_announced(camera, frame);
    camera.announced.reset();  // the next photo tells anew
  } else if (camera.announced && photo) {
    judge_announced(camera, frame);
  } else if (camera.announced) {
    if (!image.empty()) judge_between_neighbours(camera, look);
  } else if (camera.policy->finder()) {
    if (photo)
      camera.photos.push_back(
          {frame, camera.photos.size() < photos_in_memory ? image : cv::Mat(), kelvin_per_count});
    else
      camera.waiting = look;
    changed_.notify_all();
  }
}

bool LiveGuide::needs_image(const FrameRecord& frame) {
  if ((frame.station && !frame.tracking) || frame.has_flag(FrameFlag::still)) return true;
  const std::lock_guard lock(mutex_);
  const auto known = cameras_.find(frame.modality);
  return known != cameras_.end() && known->second.announced.has_value();
}

/// A frame that is shaken differs from its neighbours.
void LiveGuide::judge_between_neighbours(Camera& camera, const Look& look) {
  std::deque<Look>& looks = camera.since_key;
  const auto agrees = [&](const Look& before) {
    if (before.image.size() != look.image.size() || before.image.type() != look.image.type())
      return false;
    cv::Mat same_scale = before.image;
    if (before.kelvin_per_count != look.kelvin_per_count)
      before.image.convertTo(same_scale, -1, before.kelvin_per_count / look.kelvin_per_count);
    return apparent_motion(same_scale, look.image) <= options_.key_motion;
  };
  if (!looks.empty() && !agrees(looks.back())) {
    looks.clear();
    camera.shown.refusal = Refusal::moving;
    camera.shown.instruction = text(Refusal::moving);
    camera.shown.awaits = Awaited::nothing;
  }
  looks.push_back(look);
  if (looks.size() < 3) return;
  looks.pop_front();
  note_edges(looks.front().frame, looks.front().image);
  judge_announced(camera, looks.front().frame);
}

Result<std::string> LiveGuide::operator_at_station(std::optional<std::int64_t> time_ns) {
  const std::lock_guard lock(mutex_);
  KeyPress key{time_ns ? *time_ns : utc_now_ns(), std::nullopt};
  if (table_) key.number = table_->key(key.time_ns);
  std::string words;
  for (auto& [modality, camera] : cameras_) {
    const std::optional<OrbitPosition> there = camera.policy->at_key(key);
    if (!there) continue;
    camera.since_key.clear();
    camera.announced = there;
    words += fmt::format("{}{}: the next good frame is azimuth {:.0f}°, {:.0f}° high",
                         words.empty() ? "" : "; ", name(modality), there->azimuth_deg,
                         there->elevation_deg);
  }
  if (!words.empty()) return words;
  return fail(ErrorKind::usage, "at the station", "nothing is waiting for it",
              coverage_.complete() ? "all stations are done"
                                   : "the frames tell their stations by themselves");
}

void LiveGuide::judge_announced(Camera& camera, const FrameRecord& frame) {
  const std::optional<OrbitPosition> there = camera.announced;
  camera.position = there;
  judge(camera, frame, there);
  const Refusal refusal = camera.shown.refusal;
  // A blurred frame is followed by another from the same place; a place between stations stays one.
  if (refusal == Refusal::none || refusal == Refusal::between_stations ||
      refusal == Refusal::out_of_band)
    camera.announced.reset();
}

void LiveGuide::set_position(Camera& camera, OrbitPosition position,
                             std::optional<std::int64_t> time_ns) {
  const double seconds = seconds_between(camera.position_time_ns, time_ns).value_or(0);
  if (camera.position && seconds > 0 && seconds <= options_.unseen_after_s) {
    const double across = angle_difference_deg(position.azimuth_deg, camera.position->azimuth_deg);
    position.speed_deg_s =
        std::hypot(across, position.elevation_deg - camera.position->elevation_deg) / seconds;
  } else {
    // Whether it moves is known only from the second look on.
    position.speed_deg_s = std::numeric_limits<double>::infinity();
  }
  camera.position = position;
  camera.position_time_ns = time_ns;
}

void LiveGuide::judge(Camera& camera, const FrameRecord& frame,
                      const std::optional<OrbitPosition>& position) {
  FrameAssessment assessment;
  assessment.modality = frame.modality;
  assessment.file = frame.file;
  assessment.position = position;
  if (frame.quality) assessment.rank = frame.quality->sharpness;
  if (frame.quality) assessment.edge_blur = frame.quality->edge_blur;
  assessment.sharpness = camera.sharpness.relative(assessment.rank.value_or(0), position);
  // Thermal frames clip where the scene leaves the sensor's range, which is no exposure fault.
  if (frame.quality && frame.modality == Modality::visible) {
    assessment.overexposed = frame.quality->clipped_fraction;
    // What a picture this dark shows is noise, even where no pixel is 0.
    assessment.underexposed = frame.quality->mean_level < darkest_mean_level ? 1 : 0;
  }
  assessment.nuc = frame.has_flag(FrameFlag::nuc);
  // A photo was taken on purpose; whether the hand was still shows in its sharpness.
  if (assessment.position && frame.has_flag(FrameFlag::still)) assessment.position->speed_deg_s = 0;
  camera.shown.judged_file = frame.file;
  camera.shown.refusal = coverage_.add(assessment);
  if (camera.shown.refusal == Refusal::none) {
    const Status noted = camera.chosen.choose(frame, coverage_.sectors(), camera.position, writer_);
    if (!noted && !error_) error_ = noted.error();
  }
  say_next(camera, position, camera.shown.refusal);
}

void LiveGuide::say_next(Camera& camera, const std::optional<OrbitPosition>& position,
                         Refusal last) const {
  const Modality modality = camera.shown.modality;
  GuideStep step{coverage_.instruction(modality, position, last)};
  if (!coverage_.missing(modality).empty())
    step = camera.policy->next_step(
        {position, last, camera.announced.has_value(), !camera.shown.latest_file.empty()});
  camera.shown.instruction = step.words;
  camera.shown.awaits = step.awaits;
}

std::optional<LiveGuide::Look> LiveGuide::Camera::next_to_look() {
  std::optional<Look> next;
  if (!photos.empty()) {
    next = std::move(photos.front());
    photos.pop_front();
  } else {
    waiting.swap(next);
  }
  return next;
}

/// The looking thread: every photo, and of a video the newest frame, no faster than asked.
void LiveGuide::find_mat_in_frames() {
  const auto pause = std::chrono::duration<double>(1 / options_.looks_per_second);
  std::unique_lock lock(mutex_);
  const auto has_photos = [this] {
    return std::any_of(cameras_.begin(), cameras_.end(),
                       [](const auto& c) { return !c.second.photos.empty(); });
  };
  const auto has_work = [this, has_photos] {
    return has_photos() || std::any_of(cameras_.begin(), cameras_.end(),
                                       [](const auto& c) { return c.second.waiting.has_value(); });
  };
  while (true) {
    changed_.wait(lock, [&] { return over_ || has_work(); });
    if (!has_work()) return;  // over, and everything was judged
    const auto started = std::chrono::steady_clock::now();
    for (auto& [modality, camera] : cameras_) {
      std::optional<Look> next = camera.next_to_look();
      if (!next) continue;
      FrameRecord& frame = next->frame;
      lock.unlock();
      if (next->image.empty()) {
        if (const auto read = read_back(writer_.folder() / frame.file)) next->image = *read;
      }
      std::optional<OrbitPosition> seen;
      if (!next->image.empty()) seen = finder_(next->image, modality);
      if (seen) note_edges(frame, next->image);
      lock.lock();
      if (seen) {
        set_position(camera, *seen, frame.host_time_ns);
      } else if (frame.host_time_ns && seconds_between(camera.position_time_ns, frame.host_time_ns)
                                               .value_or(std::numeric_limits<double>::infinity()) >
                                           options_.unseen_after_s) {
        camera.position.reset();
      }
      judge(camera, frame, seen ? camera.position : std::nullopt);
    }
    changed_.wait_for(lock, pause - (std::chrono::steady_clock::now() - started),
                      [&] { return over_ || has_photos(); });
  }
}

std::vector<LiveCamera> LiveGuide::cameras() const {
  const std::lock_guard lock(mutex_);
  std::vector<LiveCamera> list;
  for (const Modality modality : options_.plan.modalities) {
    const Camera& camera = cameras_.at(modality);
    LiveCamera& shown = list.emplace_back(camera.shown);
    shown.position = camera.position;
    shown.done = coverage_.done_count(modality);
    shown.of = static_cast<int>(coverage_.sectors().size());
    const bool by_place = camera.policy->finder() || table_;
    if (const Sector* next = coverage_.target(modality, by_place ? camera.position : std::nullopt))
      shown.target = OrbitPosition{next->azimuth_deg, next->elevation_deg, 0, 0};
  }
  return list;
}

std::string instruction_for(const LiveCamera& camera, Operator where) {
  const std::string key = where == Operator::at_terminal ? "press Enter" : "tap At the station";
  switch (camera.awaits) {
    case Awaited::nothing:
      break;
    case Awaited::key:
      return camera.instruction + ", then " + key;
    case Awaited::photo:
      return camera.instruction + ", then take the photo";
    case Awaited::key_or_photo:
      return camera.instruction + ", then " + key + " or take the photo";
  }
  return camera.instruction;
}

std::vector<Sector> LiveGuide::sectors() const {
  const std::lock_guard lock(mutex_);
  return coverage_.sectors();
}

int LiveGuide::done_count(Modality modality) const {
  const std::lock_guard lock(mutex_);
  return coverage_.done_count(modality);
}

bool LiveGuide::complete() const {
  const std::lock_guard lock(mutex_);
  return coverage_.complete();
}

std::optional<Error> LiveGuide::error() const {
  const std::lock_guard lock(mutex_);
  return error_;
}

}  // namespace orbitfuse
