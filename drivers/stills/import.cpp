// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/import.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>

#include "capture/recording/frame_encoding.hpp"
#include "capture/recording/session_folder.hpp"
#include "capture/recording/session_writer.hpp"
#include "core/image/exif.hpp"
#include "core/system/file_io.hpp"
#include "core/image/image_codec.hpp"
#include "drivers/stills/image_list.hpp"
#include "drivers/stills/known_poses.hpp"
#include "drivers/stills/still_photo.hpp"
#include "drivers/stills/thermal_decoder.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

struct Source {
  fs::path file;
  std::optional<std::int64_t> taken_ns;
  int position = 0;  ///< in capture order, counting files that turn out unreadable
};

/// Capture order: by time where every file has one (file name breaks ties of one-second clocks),
/// else by name.
std::vector<Source> in_capture_order(std::vector<Source> sources) {
  const bool all_timed = std::all_of(sources.begin(), sources.end(), [](const Source& s) { return s.taken_ns.has_value(); });
  if (all_timed) {
    std::stable_sort(sources.begin(), sources.end(),
                     [](const Source& a, const Source& b) { return *a.taken_ns < *b.taken_ns; });
  }
  for (std::size_t i = 0; i < sources.size(); ++i) sources[i].position = static_cast<int>(i);
  return sources;
}

/// The camera of a source at the image's own size; nothing when the shapes differ.
std::optional<Camera> fitted(const Camera& camera, cv::Size size) {
  if (camera.width == size.width && camera.height == size.height) return camera;
  const double aspect = static_cast<double>(camera.width) / camera.height;
  if (std::abs(aspect * size.height / size.width - 1) > 0.01) return std::nullopt;
  return camera.scaled_to(size.width, size.height);
}

/// Folder and file: enough to tell "visible/000.jpg" from "thermal/000.jpg" on any machine.
std::string short_name(const fs::path& file) {
  return (file.parent_path().filename() / file.filename()).string();
}

class Importer {
 public:
  /// Without a writer everything is done but the writing.
  Importer(const ImportOptions& options, const fs::path& folder, SessionWriter* writer, const Progress& progress)
      : options_(options), folder_(folder), writer_(writer), progress_(progress), decoder_(options) {}

  Status run() {
    ORBITFUSE_ASSIGN(known_, read_known_poses(options_));
    ORBITFUSE_ASSIGN(const auto visible, visible_sources());
    ORBITFUSE_ASSIGN(const auto visible_tracking, listed(options_.visible_tracking));
    ORBITFUSE_ASSIGN(auto thermal, thermal_sources());
    ORBITFUSE_ASSIGN(auto thermal_tracking, listed(options_.thermal_tracking));
    ORBITFUSE_TRY(check_known(Modality::visible, {&visible, &visible_tracking}));
    ORBITFUSE_TRY(check_known(Modality::thermal, {&thermal, &thermal_tracking}));
    ORBITFUSE_TRY(check_disk({&visible, &visible_tracking}));
    total_ = visible.size() + visible_tracking.size() + thermal.size() + thermal_tracking.size();
    ORBITFUSE_TRY(add_visible(with_exif_times(visible), false));
    ORBITFUSE_TRY(add_visible(with_exif_times(visible_tracking), true));
    // First every thermal file is looked at: what 16-bit samples mean is decided for all of them.
    std::vector<Source> stations = observed(thermal), tracking = observed(thermal_tracking);
    ORBITFUSE_TRY(add_thermal(in_capture_order(std::move(stations)), false));
    ORBITFUSE_TRY(add_thermal(in_capture_order(std::move(tracking)), true));
    if (report_.visible + report_.thermal + report_.tracking == 0) {
      return fail(ErrorKind::input, "import", first_failure_.empty() ? "no readable image" : first_failure_,
                  "give folders with JPEG, PNG or TIFF images");
    }
    return finish();
  }

  ImportReport take_report() { return std::move(report_); }

 private:
  Result<std::vector<fs::path>> listed(const std::vector<fs::path>& paths) const {
    if (paths.empty()) return std::vector<fs::path>{};
    return list_images(paths);
  }

  Result<std::vector<fs::path>> visible_sources() const {
    if (!options_.visible.empty()) return list_images(options_.visible);
    return files_of_transforms(Modality::visible);
  }
  Result<std::vector<fs::path>> thermal_sources() const {
    if (!options_.thermal.empty()) return list_images(options_.thermal);
    return files_of_transforms(Modality::thermal);
  }
  /// Photos are copied as they are.
  Status check_disk(std::initializer_list<const std::vector<fs::path>*> photos) const {
    std::uint64_t needed = min_free_session_bytes;
    for (const auto* files : photos) {
      for (const fs::path& file : *files) {
        std::error_code unreadable;
        const std::uintmax_t size = fs::file_size(file, unreadable);
        if (!unreadable) needed += size;
      }
    }
    return check_free_space(folder_, needed, "free disk space, or import to another disk");
  }

  /// Poses that were given belong to the images that were given.
  Status check_known(Modality modality, std::initializer_list<const std::vector<fs::path>*> lists) {
    const auto known = known_.find(modality);
    if (known == known_.end() || known->second.all().empty()) return {};
    std::size_t images = 0, with_pose = 0;
    for (const auto* files : lists) {
      images += files->size();
      for (const fs::path& file : *files) with_pose += known->second.find(file) != nullptr;
    }
    if (images == 0 || with_pose == images) return {};
    const std::string found = fmt::format("{} of {} images have a pose among the {} given", with_pose, images,
                                          known->second.all().size());
    if (with_pose == 0)
      return fail(ErrorKind::input, fmt::format("known poses, {}", name(modality)),
                  fmt::format("{}; the first given is for {}", found, known->second.all().front().file.string()),
                  "give the poses of these images, or none");
    report_.warnings.push_back(fmt::format("{}: {}; the others are left to the pose stage", name(modality), found));
    return {};
  }

  std::vector<fs::path> files_of_transforms(Modality modality) const {
    std::vector<fs::path> files;
    if (!options_.transforms_json || !known_.count(modality)) return files;
    for (const KnownView& view : known_.at(modality).all()) files.push_back(view.file);
    return files;
  }

  std::vector<Source> with_exif_times(const std::vector<fs::path>& files) const {
    std::vector<Source> sources;
    for (const fs::path& file : files) {
      const Result<std::string> bytes = read_file(file);
      sources.push_back({file, bytes ? read_exif(*bytes).taken_ns : std::nullopt, 0});
    }
    return in_capture_order(std::move(sources));
  }

  std::vector<Source> observed(const std::vector<fs::path>& files) {
    std::vector<Source> sources;
    for (const fs::path& file : files) {
      Source source{file, std::nullopt, 0};
      if (const Result<ThermalFile> thermal = read_thermal_file(file)) {
        decoder_.observe(*thermal);
        source.taken_ns = taken_ns(*thermal);
      }
      sources.push_back(source);
    }
    return sources;
  }

  void pass_over(const Error& error) {
    if (first_failure_.empty()) first_failure_ = error.message();
    report_.warnings.push_back("left out: " + error.message());
  }

  Status step() {
    ++done_;
    progress_.report({"import", static_cast<double>(done_), static_cast<double>(total_), -1, ""});
    return progress_.check("import");
  }

  Status add_visible(const std::vector<Source>& sources, bool tracking) {
    for (const Source& source : sources) {
      ORBITFUSE_TRY(step());
      const Result<std::string> bytes = read_file(source.file);
      if (!bytes) {
        pass_over(bytes.error());
        continue;
      }
      ORBITFUSE_TRY(add_visible_frame(*bytes, source, tracking, options_.visible_stations));
    }
    return {};
  }

  Status add_visible_frame(std::string bytes, const Source& source, bool tracking,
                           const std::optional<DeclaredStations>& stations) {
    Result<StillPhoto> still = visible_still(std::move(bytes), source.file.string());
    if (!still) {
      pass_over(still.error());
      return {};
    }
    return add_frame(std::move(*still), source, tracking, stations);
  }

  Status add_thermal(const std::vector<Source>& sources, bool tracking) {
    for (const Source& source : sources) {
      ORBITFUSE_TRY(step());
      const Result<ThermalFile> file = read_thermal_file(source.file);
      if (!file) {
        pass_over(file.error());
        continue;
      }
      Result<StillPhoto> still = thermal_still(*file, decoder_, source.file.string());
      if (!still) {
        pass_over(still.error());
        continue;
      }
      report_.has_temperatures = report_.has_temperatures || !still->frame.thermal_is_gray;
      ORBITFUSE_TRY(add_frame(std::move(*still), source, tracking, options_.thermal_stations));
      if (options_.embedded_visible && file->flir && !file->flir->embedded_visible.empty()) {
        ++embedded_;
        ORBITFUSE_TRY(add_visible_frame(file->flir->embedded_visible, source, tracking,
                                        options_.thermal_stations));
      }
    }
    return {};
  }

  Status add_frame(StillPhoto still, const Source& source, bool tracking,
                   const std::optional<DeclaredStations>& stations) {
    ORBITFUSE_ASSIGN(Group* group, group_of(still, source));
    Frame& frame = still.frame;
    DeviceInfo& device = still.camera;
    frame.source = short_name(source.file);
    frame.tracking = tracking;
    frame.host_time_ns = source.taken_ns.value_or(0);
    const KnownViews& known = known_[device.modality];
    const KnownView* view = known.find(source.file);
    if (view) apply_known(*view, still.size, frame, device);
    if (known.shared_camera() && !options_.ground_truth_priors_only) {
      device.lens.calibrated = fitted(*known.shared_camera(), still.size);
    }
    if (stations && !frame.tracking) frame.station = station_at(*stations, source.position, view);
    if (group->id.empty()) {
      group->id = device.id = next_device_id(device.modality);
      if (writer_) ORBITFUSE_TRY(writer_->add_device(device));
    }
    frame.id = group->frames;
    const Result<FrameRecord> record =
        writer_ ? writer_->append(group->id, frame) : rehearsed(frame, device.modality);
    if (!record) {
      if (record.error().kind != ErrorKind::input) return tl::unexpected(record.error());
      pass_over(record.error());
      return {};
    }
    ++group->frames;
    count(*record);
    return {};
  }

  /// What can be said of a frame before it is stored.
  static Result<FrameRecord> rehearsed(const Frame& frame, Modality modality) {
    ORBITFUSE_TRY(encode_frame(frame, modality, frame.source));
    FrameRecord record;
    record.modality = modality;
    record.tracking = frame.tracking;
    record.station = frame.station;
    record.cam_from_world = frame.cam_from_world;
    return record;
  }

  void apply_known(const KnownView& view, cv::Size size, Frame& frame, DeviceInfo& device) {
    const std::optional<Camera> camera = fitted(view.camera, size);
    if (!camera) {
      report_.warnings.push_back(fmt::format("{}: {}x{} does not fit its known camera of {}x{}; pose not used",
                                             frame.source, size.width, size.height, view.camera.width,
                                             view.camera.height));
      return;
    }
    if (options_.ground_truth_priors_only) {
      device.lens.focal_px = camera->fx;
      return;
    }
    frame.camera = camera;
    frame.cam_from_world = view.cam_from_world;
  }

  Station station_at(const DeclaredStations& declared, int position, const KnownView* view) const {
    const int per_loop = std::max(1, static_cast<int>(std::lround(360 / declared.spacing_deg)));
    Station station;
    station.loop = position / per_loop;
    station.index = position % per_loop;
    station.azimuth_deg = station.index * declared.spacing_deg;
    station.azimuth_sigma_deg = 180;  // where the orbit began is unknown
    station.elevation_sigma_deg = 90;
    if (station.loop < static_cast<int>(declared.elevations_deg.size())) {
      station.elevation_deg = declared.elevations_deg[static_cast<std::size_t>(station.loop)];
      station.elevation_sigma_deg = declared.elevation_sigma_deg;
    } else if (options_.ground_truth_priors_only && view && view->elevation_deg) {
      station.elevation_deg = *view->elevation_deg;
      station.elevation_sigma_deg = declared.elevation_sigma_deg;
    }
    return station;
  }

  /// Photos of one camera, lens and size share a device, so that they may share intrinsics.
  struct Group {
    Modality modality = Modality::visible;
    std::string key, described, first_file, id;
    std::uint64_t frames = 0;
  };

  Result<Group*> group_of(StillPhoto& still, const Source& source) {
    const Modality modality = still.camera.modality;
    const auto& focal = modality == Modality::visible ? options_.visible_focal_px : options_.thermal_focal_px;
    if (focal) still.camera.lens.focal_px = focal;
    const std::string key = still.key();
    for (Group& group : groups_) {
      if (group.modality != modality) continue;
      if (group.key == key) return &group;
      if (focal) {
        return fail(ErrorKind::input, short_name(source.file),
                    fmt::format("is of {}, but {} of {}", still.described(), group.first_file, group.described),
                    fmt::format("one focal length of {:g} px is not true of both: import them one by one, "
                                "or leave the option away",
                                *focal));
      }
    }
    groups_.push_back({modality, key, still.described(), short_name(source.file), {}, 0});
    return &groups_.back();
  }

  std::string next_device_id(Modality modality) const {
    const auto known = std::count_if(groups_.begin(), groups_.end(), [&](const Group& group) {
      return group.modality == modality && !group.id.empty();
    });
    return fmt::format("{}{}", name(modality), known);
  }

  void tell_of_groups(Modality modality) {
    std::vector<std::string> list;
    for (const Group& group : groups_) {
      if (group.modality == modality)
        list.push_back(fmt::format("{} from {} ({})", group.id, group.first_file, group.described));
    }
    if (list.size() < 2) return;
    report_.warnings.push_back(fmt::format(
        "{}: {} cameras, lenses or image sizes, each calibrated on its own: {}; leave out what is not of this "
        "orbit",
        name(modality), list.size(), fmt::join(list, "; ")));
  }

  void count(const FrameRecord& record) {
    int& counter = record.tracking ? report_.tracking
                   : record.modality == Modality::visible ? report_.visible
                                                          : report_.thermal;
    ++counter;
    if (record.cam_from_world) ++report_.with_pose;
    if (record.station) ++report_.with_station;
  }

  Status finish() {
    for (const Group& group : groups_) {
      if (group.frames > 0 && writer_)
        ORBITFUSE_TRY(writer_->append(StreamRecord{group.id, 0, group.frames - 1, group.frames, 0}));
    }
    tell_of_groups(Modality::visible);
    tell_of_groups(Modality::thermal);
    check_station_count(options_.visible_stations, report_.visible, "visible");
    check_station_count(options_.thermal_stations, report_.thermal, "thermal");
    if (options_.embedded_visible && embedded_ == 0)
      report_.warnings.push_back("no thermal image has a photo embedded: there are no visible frames from them");
    if (decoder_.samples_are_raw_counts()) {
      report_.warnings.push_back("thermal samples are raw counts without a known scale: kept as grey intensities, "
                                 "no temperatures (give their scale if you know it)");
    }
    return writer_ ? writer_->close() : Status{};
  }

  void check_station_count(const std::optional<DeclaredStations>& stations, int frames, const char* what) {
    if (!stations) return;
    const int expected = stations->loops * static_cast<int>(std::lround(360 / stations->spacing_deg));
    if (frames != expected) {
      report_.warnings.push_back(fmt::format("{}: {} frames, but {} stations declared", what, frames, expected));
    }
  }

  const ImportOptions& options_;
  const fs::path& folder_;
  SessionWriter* writer_;
  const Progress& progress_;
  ThermalDecoder decoder_;
  std::map<Modality, KnownViews> known_;
  std::deque<Group> groups_;  ///< a deque: groups are pointed to while others join
  std::size_t done_ = 0, total_ = 0;
  std::string first_failure_;
  ImportReport report_;
  int embedded_ = 0;  ///< photos found in radiometric JPEGs
};

/// The sources are untouched; half a session would only be in the way of the next attempt.
void empty(const fs::path& folder) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored))
    fs::remove_all(entry.path(), ignored);
}

Status run(Importer& importer) {
  Status status = importer.run();
  if (!status && status.error().kind == ErrorKind::cancelled)
    status.error().remedy = "nothing was kept; import again";
  return status;
}

}  // namespace

Result<ImportReport> import_session(const ImportOptions& options, const fs::path& session_folder,
                                    const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(check_is_new(session_folder));
  MadeFolders made;
  ORBITFUSE_TRY(made.make(session_folder));
  std::map<std::string, std::string> notes = {{"recorded_by", "import"}};
  if (options.rig) notes["rig"] = "yes";  // recon/poses/rig/rig_pairs.hpp reads it
  ORBITFUSE_ASSIGN(auto writer, SessionWriter::create(session_folder, notes));
  Importer importer(options, session_folder, writer.get(), progress);
  if (const Status status = run(importer); !status) {
    writer.reset();
    empty(session_folder);
    return tl::unexpected(status.error());
  }
  made.keep();
  ImportReport report = importer.take_report();
  ORBITFUSE_ASSIGN(report.session, open_session(session_folder));
  return report;
}

Result<ImportReport> rehearse_import(const ImportOptions& options, const fs::path& session_folder,
                                     const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  ORBITFUSE_TRY(SessionWriter::try_create(session_folder));
  Importer importer(options, session_folder, nullptr, progress);
  ORBITFUSE_TRY(run(importer));
  return importer.take_report();
}

}  // namespace orbitfuse
