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
#include "core/system/file_io.hpp"
#include "core/image/image_codec.hpp"
#include "core/system/utc_now.hpp"

namespace orbitfuse {
namespace {

constexpr double darkest_mean_level = 8;  // of 255

std::size_t slot(Modality modality) { return modality == Modality::visible ? 0 : 1; }

/// The image of a frame on disk, upright.
std::optional<cv::Mat> read_back(const std::filesystem::path& file) {
  const Result<std::string> bytes = read_file(file);
  if (!bytes) return std::nullopt;
  const Result<cv::Mat> image = decode_image(*bytes, file.string());
  if (!image) return std::nullopt;
  return apply_orientation(*image, read_exif(*bytes).orientation);
}

/// Refused for what another frame from the same place may not have.
bool to_repeat(Refusal last) {
  return last == Refusal::nuc || last == Refusal::blurred || last == Refusal::featureless ||
         last == Refusal::badly_exposed || last == Refusal::moving;
}

void note_edges(FrameRecord& frame, const cv::Mat& image) {
  if (frame.quality && !frame.quality->edge_blur) frame.quality->edge_blur = measure_edges(image);
}

}  // namespace

Status LiveGuideOptions::validate() const {
  ORBITFUSE_TRY(plan.validate());
  ORBITFUSE_TRY(coverage.validate());
  if (!(looks_per_second > 0 && looks_per_second <= 100)) {
    return fail(ErrorKind::usage, "guide.looks_per_second", fmt::format("{}", looks_per_second),
                "must be > 0, at most 100");
  }
  if (!(std::abs(turntable_step_deg) <= 120)) {
    return fail(ErrorKind::usage, "guide.turntable_step_deg", fmt::format("{}", turntable_step_deg),
                "must be within 120 degrees, 0 for no turntable");
  }
  if (!(key_motion > 0 && key_motion < 1)) {
    return fail(ErrorKind::usage, "guide.key_motion", fmt::format("{}", key_motion),
                "must be > 0 and < 1");
  }
  if (!(unseen_after_s > 0)) {
    return fail(ErrorKind::usage, "guide.unseen_after_s", fmt::format("{}", unseen_after_s),
                "must be > 0");
  }
  return {};
}

LiveGuide::LiveGuide(SessionWriter& writer, LiveGuideOptions options, PositionFinder finder)
    : writer_(writer),
      options_(std::move(options)),
      finder_(std::move(finder)),
      coverage_(options_.plan, options_.coverage),
      table_(options_.turntable_step_deg) {
  for (const Modality modality : options_.plan.modalities) {
    cameras_[modality].shown.modality = modality;
    Camera& camera = cameras_[modality];
    camera.told_by_source = options_.stations_come_with_frames;
    camera.shown.instruction = instruction(modality, camera, std::nullopt, Refusal::none);
  }
  if (finder_) looker_ = std::jthread([this] { look(); });
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
    table_.resume_at(known->second.table, *frame.station);
    remember_choice(known->second, frame);
  }
  for (auto& [modality, camera] : cameras_)
    camera.shown.instruction = instruction(modality, camera, camera.position, Refusal::none);
}

/// The source's or the operator's word: there, and at rest.
void LiveGuide::add_at_station(Camera& camera, const FrameRecord& frame) {
  set_position(camera, {frame.station->azimuth_deg, frame.station->elevation_deg, 0, 0},
               frame.host_time_ns);
  camera.position->speed_deg_s = 0;
  judge(camera, frame, camera.position);
}

void LiveGuide::add(const FrameRecord& stored) {
  FrameRecord frame = stored;
  const bool at_station = frame.station && !frame.tracking;
  const bool judged_alone = at_station || frame.has_flag("still");
  // Reading takes long: the other camera's frames and the page don't wait for it.
  std::optional<cv::Mat> image;
  if (judged_alone || is_announced(frame.modality)) image = read_back(writer_.folder() / frame.file);
  if (judged_alone && image) note_edges(frame, *image);
  const std::lock_guard lock(mutex_);
  const auto known = cameras_.find(frame.modality);
  if (known == cameras_.end()) return;  // this orbit is not asked for
  Camera& camera = known->second;
  camera.shown.latest_file = frame.file;
  if (at_station) {
    camera.told_by_source = true;
    add_at_station(camera, frame);
  } else if (options_.turntable_step_deg != 0 && frame.has_flag("still")) {
    judge_table_photo(camera, frame);
  } else if (camera.announced && frame.has_flag("still")) {
    judge_announced(camera, frame);
  } else if (camera.announced) {
    if (image) judge_between_neighbours(camera, frame, *image);
  } else if (finder_) {
    if (frame.has_flag("still")) {
      camera.photos.push_back(frame);
    } else {
      camera.waiting = frame;
    }
    changed_.notify_all();
  }
}

void LiveGuide::judge_table_photo(Camera& camera, const FrameRecord& frame) {
  if (table_.keys() == 0) camera.table.counts_photos = true;
  if (camera.table.counts_photos) {
    camera.announced = at_photo(camera.table);
  } else if (const auto key =
                 table_.key_before(frame.has_flag("file-time") ? 0 : frame.host_time_ns)) {
    camera.announced = at_key(camera.table, *key);
  } else {
    camera.announced = at_key(camera.table, table_.keys());
    camera.announced->sigma_deg = 180;  // it may be from any station
  }
  judge_announced(camera, frame);
  camera.announced.reset();  // the next photo tells anew where the table is
}

bool LiveGuide::is_announced(Modality modality) {
  const std::lock_guard lock(mutex_);
  const auto known = cameras_.find(modality);
  return known != cameras_.end() && known->second.announced.has_value();
}

/// A frame that is shaken differs from its neighbours.
void LiveGuide::judge_between_neighbours(Camera& camera, const FrameRecord& frame, const cv::Mat& image) {
  std::deque<Look>& looks = camera.since_key;
  const auto agrees = [&](const cv::Mat& before) {
    return before.size() == image.size() && before.type() == image.type() &&
           apparent_motion(before, image) <= options_.key_motion;
  };
  if (!looks.empty() && !agrees(looks.back().image)) {
    looks.clear();
    camera.shown.refusal = Refusal::moving;
    camera.shown.instruction = text(Refusal::moving);
  }
  looks.push_back({frame, image});
  if (looks.size() < 3) return;
  looks.pop_front();
  note_edges(looks.front().frame, looks.front().image);
  judge_announced(camera, looks.front().frame);
}

void LiveGuide::operator_at_station(std::int64_t time_ns) {
  const std::lock_guard lock(mutex_);
  const bool turned = options_.turntable_step_deg != 0;
  if (time_ns == 0) time_ns = utc_now_ns();
  const int key = turned ? table_.key(time_ns) : 0;
  for (auto& [modality, camera] : cameras_) {
    if (turned && camera.table.counts_photos) continue;  // its photos tell, and may come late
    camera.since_key.clear();
    camera.announced = turned ? at_key(camera.table, key) : next_station(modality);
  }
}

OrbitPosition LiveGuide::at_photo(TableView& view) const {
  const std::vector<double>& loops = options_.plan.loop_elevations_deg;
  const double azimuth_deg = table_.photo(view);
  return {azimuth_deg, loops[table_.turn(view, azimuth_deg) % loops.size()], 0, 0};
}

OrbitPosition LiveGuide::at_key(TableView& view, int key) const {
  const std::vector<double>& loops = options_.plan.loop_elevations_deg;
  return {table_.azimuth_deg(key), loops[table_.turn_at_key(view, key) % loops.size()], 0, 0};
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

std::optional<OrbitPosition> LiveGuide::next_station(Modality modality) const {
  const std::vector<const Sector*> missing = coverage_.missing(modality);
  if (missing.empty()) return std::nullopt;
  return OrbitPosition{missing.front()->azimuth_deg, missing.front()->elevation_deg, 0, 0};
}

void LiveGuide::set_position(Camera& camera, OrbitPosition position, std::int64_t time_ns) {
  const double seconds = 1e-9 * static_cast<double>(time_ns - camera.position_time_ns);
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
  assessment.rank = frame.quality ? frame.quality->sharpness : 0;
  if (frame.quality) assessment.edge_blur = frame.quality->edge_blur;
  assessment.sharpness = camera.sharpness.relative(assessment.rank, position);
  // Thermal frames clip where the scene leaves the sensor's range, which is no exposure fault.
  if (frame.quality && frame.modality == Modality::visible) {
    assessment.overexposed = frame.quality->clipped_fraction;
    // What a picture this dark shows is noise, even where no pixel is 0.
    assessment.underexposed = frame.quality->mean_level < darkest_mean_level ? 1 : 0;
  }
  assessment.nuc = frame.has_flag("nuc");
  // A photo was taken on purpose; whether the hand was still shows in its sharpness.
  if (assessment.position && frame.has_flag("still")) assessment.position->speed_deg_s = 0;
  camera.shown.judged_file = frame.file;
  camera.shown.refusal = coverage_.add(assessment);
  if (camera.shown.refusal == Refusal::none) note_choice(camera, frame);
  camera.shown.instruction = instruction(frame.modality, camera, position, camera.shown.refusal);
}

/// What to do next, in the words of how positions are known here.
std::string LiveGuide::instruction(Modality modality, const Camera& camera,
                                   const std::optional<OrbitPosition>& position,
                                   Refusal last) const {
  const std::optional<OrbitPosition> next = next_station(modality);
  if (next && options_.turntable_step_deg != 0) return table_instruction(camera, last);
  // The next key records the next missing station, wherever the camera stood before.
  if (next && !finder_ && !camera.told_by_source) {
    if (camera.announced && to_repeat(last)) return text(last);
    return fmt::format("go to azimuth {:.0f}°, {:.0f}° high, then press Enter", next->azimuth_deg,
                       next->elevation_deg);
  }
  if (next && camera.told_by_source && camera.shown.latest_file.empty()) return "no frame yet";
  return coverage_.instruction(modality, position, last);
}

std::string LiveGuide::table_instruction(const Camera& camera, Refusal last) const {
  const TableView& view = camera.table;
  if (to_repeat(last) && camera.announced && !view.counts_photos) return text(last);
  const std::string then = view.counts_photos ? "take the photo"
                           : view.start_deg   ? "press Enter"
                                              : "press Enter or take the photo";
  if (!view.start_deg && !table_.begun()) return "put the table at its start, then " + then;
  std::string words = to_repeat(last) ? text(last) + "; " : "";
  words += fmt::format("turn the table by {:g}°", std::abs(options_.turntable_step_deg));
  const std::vector<double>& loops = options_.plan.loop_elevations_deg;
  const double elevation_deg = loops[table_.turn_after_step(view) % loops.size()];
  if (camera.position && elevation_deg != camera.position->elevation_deg)
    words += fmt::format(", move the camera to {:g}° high", elevation_deg);
  return words + ", then " + then;
}

/// Of an earlier recording: to be demoted when a better one comes.
void LiveGuide::remember_choice(Camera& camera, const FrameRecord& frame) {
  const std::vector<Sector>& sectors = coverage_.sectors();
  for (std::size_t i = 0; i < sectors.size(); ++i) {
    if (sectors[i].file[slot(frame.modality)] == frame.file) camera.chosen[i] = frame;
  }
}

void LiveGuide::note_choice(Camera& camera, const FrameRecord& frame) {
  const std::vector<Sector>& sectors = coverage_.sectors();
  for (std::size_t i = 0; i < sectors.size(); ++i) {
    if (sectors[i].file[slot(frame.modality)] != frame.file) continue;
    const auto amend = [this](const FrameRecord& record) {
      if (const Status status = writer_.amend(record); !status && !error_) error_ = status.error();
    };
    if (frame.station && !frame.tracking) return;  // written with its station
    FrameRecord chosen = frame;
    chosen.tracking = false;
    chosen.station =
        Station{sectors[i].loop,
                sectors[i].index,
                camera.position ? camera.position->azimuth_deg : sectors[i].azimuth_deg,
                camera.position ? camera.position->elevation_deg : sectors[i].elevation_deg,
                1,
                1};
    // The new one first: a crash between the two leaves two stations, never none.
    amend(chosen);
    const auto before = camera.chosen.find(i);
    if (before != camera.chosen.end()) {
      FrameRecord replaced = before->second;
      replaced.tracking = true;
      amend(replaced);
    }
    camera.chosen[i] = chosen;
    return;
  }
}

std::optional<FrameRecord> LiveGuide::Camera::next_to_look() {
  std::optional<FrameRecord> next;
  if (!photos.empty()) {
    next = std::move(photos.front());
    photos.pop_front();
  } else {
    waiting.swap(next);
  }
  return next;
}

/// The looking thread: every photo, and of a video the newest frame, no faster than asked.
void LiveGuide::look() {
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
      std::optional<FrameRecord> next = camera.next_to_look();
      if (!next) continue;
      FrameRecord& frame = *next;
      lock.unlock();
      const std::optional<cv::Mat> image = read_back(writer_.folder() / frame.file);
      std::optional<OrbitPosition> seen;
      if (image) seen = finder_(*image, modality);
      if (seen) note_edges(frame, *image);
      lock.lock();
      if (seen) {
        set_position(camera, *seen, frame.host_time_ns);
      } else if (1e-9 * static_cast<double>(frame.host_time_ns - camera.position_time_ns) >
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
    list.push_back(camera.shown);
    list.back().position = camera.position;
  }
  return list;
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
