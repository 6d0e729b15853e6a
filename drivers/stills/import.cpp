// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/import.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "capture/recording/frame_encoding.hpp"
#include "capture/recording/session_folder.hpp"
#include "capture/recording/session_writer.hpp"
#include "core/first_names.hpp"
#include "core/system/file_io.hpp"
#include "core/temperature.hpp"
#include "drivers/stills/camera_groups.hpp"
#include "drivers/stills/declared_stations.hpp"
#include "drivers/stills/import_inputs.hpp"
#include "drivers/stills/import_leftover.hpp"
#include "drivers/stills/known_fit.hpp"
#include "drivers/stills/known_poses.hpp"
#include "drivers/stills/remarks.hpp"
#include "drivers/stills/sources.hpp"
#include "drivers/stills/still_photo.hpp"
#include "drivers/stills/thermal_decoder.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

class Importer {
 public:
  /// Without a writer everything is done but the writing.
  Importer(const ImportOptions& options, const fs::path& folder, SessionWriter* writer,
           const Progress& progress)
      : options_(options),
        folder_(folder),
        writer_(writer),
        progress_(progress),
        decoder_(options),
        groups_(options),
        known_fit_(options, remarks_) {}

  Status run() {
    ORBITFUSE_ASSIGN(ImportInputs inputs, gather_inputs(options_, folder_, decoder_, remarks_));
    known_ = std::move(inputs.known);
    total_ = inputs.size();
    ORBITFUSE_TRY(add_visible(inputs.visible, false));
    ORBITFUSE_TRY(check_some(Modality::visible, inputs.visible.size(), report_.visible));
    ORBITFUSE_TRY(add_visible(inputs.visible_tracking, true));
    first_failure_.reset();
    ORBITFUSE_TRY(add_thermal(inputs.thermal, false));
    ORBITFUSE_TRY(check_some(Modality::thermal, inputs.thermal.size(), report_.thermal));
    ORBITFUSE_TRY(add_thermal(inputs.thermal_tracking, true));
    if (report_.visible + report_.thermal + report_.tracking == 0) {
      if (first_failure_) return tl::unexpected(*first_failure_);
      return fail(ErrorKind::input, "import", "no readable image",
                  "give folders with JPEG, PNG or TIFF images");
    }
    return finish();
  }

  ImportReport take_report() {
    report_.warnings = remarks_.sentences();
    return std::move(report_);
  }

 private:
  void pass_over(const Error& error) {
    if (!first_failure_) first_failure_ = error;
    remarks_.left_out(error);
  }

  /// A modality of which nothing is left was not imported, whatever there is of the other.
  Status check_some(Modality modality, std::size_t given, int taken) const {
    if (given == 0 || taken > 0 || !first_failure_) return {};
    return fail(ErrorKind::input, "import",
                fmt::format("none of the {} {} images given can be taken; {}: {}", given,
                            name(modality), first_failure_->where, first_failure_->found),
                first_failure_->remedy);
  }

  Status step() {
    ++done_;
    progress_.report({"import", static_cast<double>(done_), static_cast<double>(total_)});
    return progress_.check("import");
  }

  Status add_visible(const std::vector<Source>& sources, bool tracking) {
    for (const Source& source : sources) {
      ORBITFUSE_TRY(step());
      if (source.video) {
        ORBITFUSE_TRY(add_video(source, tracking));
        continue;
      }
      const Result<std::string> bytes = read_file(source.file, max_image_bytes);
      if (!bytes) {
        pass_over(bytes.error());
        continue;
      }
      ORBITFUSE_TRY(add_visible_frame(*bytes, source, tracking, options_.visible_stations));
    }
    return {};
  }

  Status add_video(const Source& source, bool tracking) {
    const auto account = take_video_frames(
        source.file, options_.video, progress_, [&](const VideoFrame& frame) -> Status {
          ORBITFUSE_ASSIGN(StillPhoto still, still_of_video(frame.image));
          still.frame.device_time_ns = frame.time_ns;
          Source one = source;
          one.page = static_cast<int>(frame.index);
          one.pages = one.page + 2;  // so that its number is in its name
          return add_frame(std::move(still), one, tracking, {});
        });
    if (!account && account.error().kind != ErrorKind::input)
      return tl::unexpected(account.error());
    if (!account) {
      pass_over(account.error());
    } else if (account->taken == 0) {
      pass_over({ErrorKind::input, source.file.string(), account->words(),
                 "film more slowly, in more light"});
    } else {
      remarks_.add_of_file("", source.short_name(), account->words());
    }
    return {};
  }

  Status add_visible_frame(std::string bytes, const Source& source, bool tracking,
                           const std::optional<DeclaredStations>& stations,
                           const ThermalFile* inside = nullptr) {
    Result<StillPhoto> still = visible_still(std::move(bytes), source.where(), inside);
    if (!still) {
      pass_over(still.error());
      return {};
    }
    tell_other_pages(still->other_pages, source);
    if (still->lies_across)
      remarks_.add_of_file("", source.short_name(),
                           "its photo lies across its temperatures as the sensor has them (one is "
                           "upright, the other not): it is left as it is stored");
    return add_frame(std::move(*still), source, tracking, stations);
  }

  Status add_thermal(const std::vector<Source>& sources, bool tracking) {
    for (const Source& source : sources) {
      ORBITFUSE_TRY(step());
      const Result<ThermalFile> file = read_page(source);
      if (!file) {
        pass_over(file.error());
        continue;
      }
      tell_other_pages(file->other_pages, source);
      Result<StillPhoto> still = thermal_still(*file, decoder_, source.where());
      if (!still) {
        pass_over(still.error());
        continue;
      }
      tell_lost_samples(*still, source);
      if (!still->two_scales.empty())
        remarks_.add_of_file("", source.short_name(), still->two_scales);
      if (const std::string how = still->how_held(); !how.empty())
        remarks_.add_of_file("", source.short_name(), how);
      report_.has_temperatures = report_.has_temperatures || !still->frame.thermal_is_gray;
      ORBITFUSE_TRY(add_frame(std::move(*still), source, tracking, options_.thermal_stations));
      if (options_.embedded_visible && file->flir && !file->flir->embedded_visible.empty()) {
        ++embedded_;
        ORBITFUSE_TRY(add_visible_frame(file->flir->embedded_visible, source, tracking,
                                        options_.thermal_stations, &*file));
      }
    }
    return {};
  }

  /// Pages come one after the other: their file is read once.
  Result<ThermalFile> read_page(const Source& source) {
    if (source.pages == 1) return read_thermal_file(source.file);
    if (paged_file_ != source.file) {
      ORBITFUSE_ASSIGN(paged_bytes_, read_file(source.file, max_image_bytes));
      paged_file_ = source.file;
      paged_frames_ = flir_recording_frames(paged_bytes_);
    }
    Result<ThermalFile> page = thermal_file(paged_bytes_, source.file, source.page, &paged_frames_);
    if (!page && page.error().where == source.file.string()) page.error().where = source.where();
    return page;
  }

  void tell_other_pages(const std::string& pages, Source source) {
    source.pages = 1;  // it is the file's matter
    if (!pages.empty()) remarks_.left_out(source.short_name(), pages);
  }

  void tell_lost_samples(StillPhoto& still, const Source& source) {
    if (still.without_temperature == 0) return;
    still.frame.flag(FrameFlag::clipped);
    remarks_.add_of_file(
        "", source.short_name(),
        fmt::format("{} of {} samples have no temperature that can be stored (above 0 K, at "
                    "most {:.0f} C, and not at an end of the camera's range or counts, which mean "
                    "that or hotter, or colder): dead pixels",
                    still.without_temperature, still.size.width * still.size.height,
                    celsius_from_kelvin(65535 * still.frame.kelvin_per_count)));
  }

  Status add_frame(StillPhoto still, const Source& source, bool tracking,
                   const std::optional<DeclaredStations>& stations) {
    if (still.transparent > 0)
      transparent_.push_back(
          fmt::format("{} ({:.3g} %)", source.short_name(), 100 * still.transparent));
    if (still.transparent > 0) still.frame.flag(FrameFlag::transparent);
    ORBITFUSE_ASSIGN(CameraGroup * group, groups_.of(still, source));
    Frame& frame = still.frame;
    DeviceInfo& device = still.camera;
    frame.source = source.short_name();
    frame.tracking = tracking;
    frame.host_time_ns = source.taken_ns;
    const KnownViews& known = known_[device.modality];
    const KnownView* view = known.find(source.file);
    known_fit_.apply(known, view, still.size, frame, device);
    if (stations && !frame.tracking) {
      const bool priors = options_.ground_truth_priors_only && view;
      frame.station =
          station_at(*stations, source.position, priors ? view->elevation_deg : std::nullopt);
    }
    if (group->id.empty()) {
      group->id = device.id = groups_.next_device_id(device.modality);
      if (!device.lens.focal_px && !frame.camera) lens_unknown_.insert(device.modality);
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

  void count(const FrameRecord& record) {
    int& counter = record.tracking                        ? report_.tracking
                   : record.modality == Modality::visible ? report_.visible
                                                          : report_.thermal;
    ++counter;
    if (record.cam_from_world) ++report_.with_pose;
    if (record.station) ++report_.with_station;
  }

  void tell_transparent() {
    if (transparent_.empty()) return;
    remarks_.add(fmt::format(
        "{} images have transparent pixels: {}; alpha is dropped, and what colour lies behind it "
        "is taken for the scene: import the images as they were taken",
        transparent_.size(), first_names(transparent_, 3)));
  }

  void tell_counts() {
    for (const auto& [modality, stations, frames] :
         {std::tuple(Modality::visible, &options_.visible_stations, report_.visible),
          std::tuple(Modality::thermal, &options_.thermal_stations, report_.thermal)}) {
      // Declared for both, though only one is given.
      if (!*stations || frames == 0 || frames == station_count(**stations)) continue;
      remarks_.add(fmt::format("{}: {} frames, but {} stations declared{}", name(modality), frames,
                               station_count(**stations), rest_words(**stations, frames)));
    }
    for (const auto& [stations, frames] : {std::pair(&options_.visible_stations, report_.visible),
                                           std::pair(&options_.thermal_stations, report_.thermal)})
      if (const std::string gap = *stations && frames > 0 ? gap_words(**stations) : "";
          !gap.empty()) {
        remarks_.add(gap);
        break;  // declared for both
      }
    if (options_.rig && report_.visible != report_.thermal) {
      const bool none = report_.visible == 0 || report_.thermal == 0;
      remarks_.add(fmt::format(
          "a rig's pairs are declared, but there are {} visible and {} thermal frames: {}",
          report_.visible, report_.thermal,
          none ? "no pairs" : "those without a partner of their name or time are no pair"));
    }
  }

  void tell_unknown_lenses() {
    for (const Modality modality : lens_unknown_)
      report_.notes.push_back(fmt::format(
          "the {0} {1} don't tell their focal length: a run {2}; if you know it, import with "
          "--{0}-focal-px (image width in pixels / 2 / tan(half the horizontal field of view))",
          name(modality), modality == Modality::visible ? "photos" : "files",
          modality == Modality::visible ? "finds it from the images, less surely where they are few"
                                        : "begins with an assumed one"));
  }

  void tell_lone_frames() {
    for (const auto& [modality, count] : {std::pair(Modality::visible, report_.visible),
                                          std::pair(Modality::thermal, report_.thermal)})
      if (count == 1)
        remarks_.add(fmt::format("one {} frame alone can't be posed: add views from other places",
                                 name(modality)));
  }

  Status finish() {
    ORBITFUSE_TRY(known_fit_.check());
    for (const CameraGroup& group : groups_.all()) {
      if (group.frames > 0 && writer_)
        ORBITFUSE_TRY(
            writer_->append(StreamRecord{group.id, 0, group.frames - 1, group.frames, 0}));
    }
    for (const Modality modality : {Modality::visible, Modality::thermal}) {
      if (auto several = groups_.described(modality)) remarks_.add(*std::move(several));
    }
    tell_counts();
    tell_transparent();
    if (options_.embedded_visible && embedded_ == 0)
      remarks_.add("no thermal image has a photo embedded: there are no visible frames from them");
    tell_unknown_lenses();
    tell_lone_frames();
    if (report_.has_temperatures) {
      report_.kelvin_per_count = decoder_.kelvin_per_count();
    }
    for (std::string& remark : decoder_.remarks()) remarks_.add(std::move(remark));
    if (decoder_.samples_are_raw_counts() && !decoder_.has_temperatures()) {
      remarks_.add(
          "thermal samples are raw counts without a known scale: kept as grey intensities, "
          "no temperatures (give their scale if you know it)");
    }
    return writer_ ? writer_->close() : Status{};
  }

  const ImportOptions& options_;
  const fs::path& folder_;
  SessionWriter* writer_;
  const Progress& progress_;
  ThermalDecoder decoder_;
  std::map<Modality, KnownViews> known_;
  CameraGroups groups_;
  Remarks remarks_;
  KnownFit known_fit_;
  fs::path paged_file_;  ///< whose pages are being added
  std::string paged_bytes_;
  std::vector<std::string_view> paged_frames_;  ///< of a recording, in these bytes
  std::size_t done_ = 0, total_ = 0;
  std::optional<Error> first_failure_;  ///< of the modality that is being added
  ImportReport report_;
  std::vector<std::string> transparent_;  ///< names and shares of images with alpha
  std::set<Modality> lens_unknown_;
  int embedded_ = 0;  ///< photos found in radiometric JPEGs
};

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
  remove_cut_import(session_folder);
  ORBITFUSE_TRY(check_is_new(session_folder));
  MadeFolders made;
  ORBITFUSE_TRY(made.make(session_folder));
  std::map<std::string, std::string> notes = {{"recorded_by", "import"}};
  if (options.rig) notes["rig"] = "yes";  // recon/poses/rig/rig_pairs.hpp reads it
  ORBITFUSE_ASSIGN(auto writer, SessionWriter::create(session_folder, notes));
  // Only now the folder is this process's own: another import may have taken it before.
  ImportLeftover leftover(session_folder);
  Importer importer(options, session_folder, writer.get(), progress);
  ORBITFUSE_TRY(run(importer));
  ImportReport report = importer.take_report();
  ORBITFUSE_ASSIGN(report.session, open_session(session_folder));
  leftover.keep();
  made.keep();
  return report;
}

Result<ImportReport> rehearse_import(const ImportOptions& options, const fs::path& session_folder,
                                     const Progress& progress) {
  ORBITFUSE_TRY(options.validate());
  if (!is_cut_import(session_folder)) ORBITFUSE_TRY(SessionWriter::try_create(session_folder));
  Importer importer(options, session_folder, nullptr, progress);
  ORBITFUSE_TRY(run(importer));
  return importer.take_report();
}

}  // namespace orbitfuse
