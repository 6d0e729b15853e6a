// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/import_inputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "capture/recording/session_folder.hpp"
#include "core/image/image_codec.hpp"
#include "core/system/file_io.hpp"
#include "drivers/stills/image_list.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

class Gathering {
 public:
  Gathering(const ImportOptions& options, const fs::path& folder, ThermalDecoder& decoder,
            Remarks& remarks)
      : options_(options), folder_(folder), decoder_(decoder), remarks_(remarks) {}

  Result<ImportInputs> run() {
    ORBITFUSE_ASSIGN(auto thermal, listed(Modality::thermal, options_.thermal));
    ORBITFUSE_ASSIGN(const auto thermal_tracking,
                     listed(Modality::thermal, options_.thermal_tracking));
    std::vector<fs::path> thermal_files = thermal;
    thermal_files.insert(thermal_files.end(), thermal_tracking.begin(), thermal_tracking.end());
    ORBITFUSE_ASSIGN(inputs_.known, read_known_poses(options_, thermal_files, remarks_));
    if (options_.thermal.empty()) thermal = files_of_transforms(Modality::thermal);
    ORBITFUSE_ASSIGN(auto visible, visible_sources());
    share_one_folder(visible, thermal);
    ORBITFUSE_ASSIGN(const auto visible_tracking,
                     listed(Modality::visible, options_.visible_tracking));
    ORBITFUSE_TRY(check_given_once(visible, visible_tracking));
    ORBITFUSE_TRY(check_given_once(thermal, thermal_tracking));
    ORBITFUSE_TRY(check_known(Modality::visible, {&visible, &visible_tracking}));
    ORBITFUSE_TRY(check_known(Modality::thermal, {&thermal, &thermal_tracking}));
    ORBITFUSE_TRY(check_stations_of(visible));
    ORBITFUSE_TRY(check_disk({&visible, &visible_tracking}));
    inputs_.thermal = observed(thermal);
    inputs_.thermal_tracking = observed(thermal_tracking);
    ORBITFUSE_TRY(check_object_parameters());
    inputs_.visible = photos_alone(photo_sources(visible));
    inputs_.visible_tracking = photos_alone(photo_sources(visible_tracking));
    if (!visible.empty() && inputs_.visible.empty())
      return fail(ErrorKind::input, visible.front().string(),
                  "a thermal image, and so are all of the photos",
                  "give it with --thermal (--embedded-visible takes the photos inside), and photos "
                  "with --visible");
    ORBITFUSE_TRY(check_roles());
    take_out_copies(Modality::visible, {&inputs_.visible, &inputs_.visible_tracking});
    take_out_copies(Modality::thermal, {&inputs_.thermal, &inputs_.thermal_tracking});
    to_one_clock(
        {&inputs_.visible, &inputs_.visible_tracking, &inputs_.thermal, &inputs_.thermal_tracking});
    for (std::vector<Source>* sources :
         {&inputs_.visible, &inputs_.visible_tracking, &inputs_.thermal, &inputs_.thermal_tracking})
      *sources = in_capture_order(std::move(*sources));
    return std::move(inputs_);
  }

 private:
  Result<std::vector<fs::path>> listed(Modality modality, const std::vector<fs::path>& paths) {
    if (paths.empty()) return std::vector<fs::path>{};
    ORBITFUSE_ASSIGN(ImageList list, list_images(modality, paths));
    for (const fs::path& file : list.no_files) {
      remarks_.left_out(file.string(), "no file (a link to nothing, a pipe or a device)");
    }
    if (!list.folders.empty())
      remarks_.add(fmt::format(
          "left out: the images in {}{}: folders in folders are not looked into; name "
          "those that are of this orbit",
          list.folders.front().string(),
          list.folders.size() == 1 ? ""
                                   : fmt::format(" and {} more folders", list.folders.size() - 1)));
    for (const fs::path& file : list.unread) {
      remarks_.left_out(
          file.string(),
          fmt::format("{} files are not read; convert it to {}", unread_kind(file),
                      modality == Modality::thermal
                          ? "16-bit TIFF or PNG (100 x kelvin), which keep temperatures"
                          : "JPEG, PNG or TIFF"));
    }
    for (const fs::path& file : list.nameless) {
      remarks_.left_out(file.string(),
                        "an image whose name has no extension; rename it (.jpg, .png, .tiff)");
    }
    for (const fs::path& file : list.hidden) {
      remarks_.left_out(file.string(),
                        "a hidden file (deleted? Its name begins with a dot); name it to take it");
    }
    for (const auto& [link, file] : list.links) {
      remarks_.left_out(link.string(), "the same image as " + file.filename().string(), "a link");
    }
    tell_videos_among_photos(list.videos_among_photos, list.images);
    return std::move(list.images);
  }

  void tell_videos_among_photos(const std::vector<fs::path>& videos,
                                const std::vector<fs::path>& images) {
    const std::set<fs::path> named(images.begin(), images.end());
    std::vector<std::string> names;
    for (const fs::path& video : videos)
      if (!named.count(video)) names.push_back(video.filename().string());
    if (names.empty()) return;
    remarks_.add(
        fmt::format("left out: {}: {} among photos ({}{}): perhaps parts of those (Live Photos); "
                    "name a video itself to take it",
                    videos.front().parent_path().string(),
                    names.size() == 1 ? "a video" : fmt::format("{} videos", names.size()),
                    names.front(), names.size() > 1 ? ", ..." : ""));
  }

  Result<std::vector<fs::path>> visible_sources() {
    if (!options_.visible.empty()) return listed(Modality::visible, options_.visible);
    return files_of_transforms(Modality::visible);
  }

  /// A frame is of the orbit or of the way between its stations: as a copy of itself it would be
  /// left out without a word on which of the two was meant.
  static Status check_given_once(const std::vector<fs::path>& orbit,
                                 const std::vector<fs::path>& tracking) {
    std::error_code unresolved;
    std::set<fs::path> names;
    for (const fs::path& file : orbit) names.insert(fs::weakly_canonical(file, unresolved));
    for (const fs::path& file : tracking)
      if (names.contains(fs::weakly_canonical(file, unresolved)))
        return fail(ErrorKind::usage, file.string(), "given twice, once as a tracking frame",
                    "name each folder and file once");
    return {};
  }

  /// Photos are copied as they are; HEIC grows as JPEG.
  Status check_disk(std::initializer_list<const std::vector<fs::path>*> photos) const {
    std::uint64_t needed = min_free_session_bytes;
    for (const auto* files : photos) {
      for (const fs::path& file : *files) {
        std::error_code unreadable;
        const std::uintmax_t size = fs::file_size(file, unreadable);
        if (!unreadable) needed += unread_kind(file) == "HEIC" ? 4 * size : size;
      }
    }
    return check_free_space(folder_, needed, "free disk space, or import to another disk");
  }

  /// Where the frames of a video were taken is nobody's word.
  Status check_stations_of(const std::vector<fs::path>& photos) const {
    if (!options_.visible_stations) return {};
    for (const fs::path& file : photos) {
      if (!has_video_extension(file)) continue;
      return fail(ErrorKind::usage, file.string(),
                  "a video, but the photos are declared to be at stations",
                  "leave --station-spacing-deg out, or import the video by itself");
    }
    return {};
  }

  /// Poses that were given belong to the images that were given.
  Status check_known(Modality modality, std::initializer_list<const std::vector<fs::path>*> lists) {
    const auto known = inputs_.known.find(modality);
    if (known == inputs_.known.end() || known->second.all().empty()) return {};
    std::vector<fs::path> all;
    for (const auto* files : lists) all.insert(all.end(), files->begin(), files->end());
    known->second.tell_apart(all);
    const std::size_t images = all.size();
    std::size_t with_pose = 0;
    std::string twice;  // the first name that more than one view bears
    for (const fs::path& file : all) {
      with_pose += known->second.find(file) != nullptr;
      if (twice.empty()) twice = known->second.ambiguity(file);
    }
    if (images == 0 || with_pose == images) return {};
    const std::string found =
        fmt::format("{} of {} images have a pose among the {} given{}{}", with_pose, images,
                    known->second.all().size(), twice.empty() ? "" : "; ", twice);
    if (with_pose == 0)
      return fail(ErrorKind::input, fmt::format("known poses, {}", name(modality)),
                  fmt::format("{}; the first given is for {}", found,
                              known->second.all().front().file.string()),
                  twice.empty() ? "give the poses of these images, or none"
                                : "give each image one pose and a name of its own");
    remarks_.add(fmt::format("{}: {}; {}", name(modality), found,
                             with_pose == 1
                                 ? "it is not used: all poses are estimated"
                                 : "the others stay without one, unless all are estimated: --set "
                                   "poses.use_known_poses=false"));
    return {};
  }

  std::vector<fs::path> files_of_transforms(Modality modality) const {
    std::vector<fs::path> files;
    if (!options_.transforms_json || !inputs_.known.count(modality)) return files;
    std::set<fs::path> named;  // a file may have several poses, and is one frame
    for (const KnownView& view : inputs_.known.at(modality).all())
      if (named.insert(view.file).second) files.push_back(view.file);
    return files;
  }

  std::vector<Source> observed(const std::vector<fs::path>& files) {
    std::vector<Source> sources;
    for (const fs::path& file : files) {
      Source source;
      source.file = file;
      Result<std::string> bytes = read_file(file, max_image_bytes);
      if (!bytes) {
        sources.push_back(source);
        continue;
      }
      source.hash = content_hash(*bytes);
      const auto frames = flir_recording_frames(*bytes);  // none of other files
      source.pages = frames.empty() ? thermal_page_count(*bytes) : static_cast<int>(frames.size());
      for (source.page = 0; source.page < source.pages; ++source.page) {
        source.taken_ns.reset();
        source.utc_offset_s.reset();
        if (const Result<ThermalFile> thermal = thermal_file(*bytes, file, source.page, &frames)) {
          decoder_.observe(*thermal, source.short_name());
          source.taken_ns = thermal->taken_ns;
          source.utc_offset_s = thermal->utc_offset_s;
        }
        sources.push_back(source);
      }
    }
    return sources;
  }

  /// A thermal camera's folder holds both: what its radiometric JPEGs show are temperatures.
  std::vector<Source> photos_alone(std::vector<Source> sources) {
    std::erase_if(sources, [&](const Source& source) {
      if (!source.thermal_kind) return false;
      const bool has_photo_inside = std::string(source.thermal_kind) == "FLIR";
      remarks_.left_out(
          source.file.string(),
          fmt::format("a thermal image, not a photo (give it with --thermal{})",
                      has_photo_inside ? "; --embedded-visible takes the photo inside" : ""));
      return true;
    });
    return sources;
  }

  void take_out_copies(Modality modality, std::initializer_list<std::vector<Source>*> lists) {
    CopyFilter filter(inputs_.known[modality]);
    for (std::vector<Source>* sources : lists) {
      filter.take_out(*sources, remarks_);
    }
  }

  /// A folder that holds both orbits may be given as either: its files say which they are of. Not
  /// where the photos are the thermal images' previews, of their names and sizes.
  void share_one_folder(std::vector<fs::path>& photos, std::vector<fs::path>& thermal) {
    const std::set<fs::path> shown(photos.begin(), photos.end());
    if (!std::all_of(thermal.begin(), thermal.end(),
                     [&](const fs::path& file) { return shown.contains(file); }))
      return;
    std::set<fs::path> measured;
    std::map<std::string, cv::Size> measured_sizes, shown_sizes;  // by name without extension
    for (const fs::path& file : thermal) {
      const Result<ThermalFile> read = read_thermal_file(file, 0);
      if (!read) continue;
      const bool measures = read->kind != ThermalFile::Kind::gray8;
      if (measures) measured.insert(file);
      (measures ? measured_sizes : shown_sizes)[file.stem().string()] = read->image.size();
    }
    const bool previews =
        std::all_of(shown_sizes.begin(), shown_sizes.end(), [&](const auto& photo) {
          const auto found = measured_sizes.find(photo.first);
          return found != measured_sizes.end() && found->second == photo.second;
        });
    if (measured.empty() || previews) return;
    std::erase_if(thermal, [&](const fs::path& file) { return !measured.contains(file); });
    std::erase_if(photos, [&](const fs::path& file) { return measured.contains(file); });
    remarks_.add(fmt::format(
        "one folder given as both: its {} thermal images are told from the other {}, photos",
        thermal.size(), photos.size()));
  }

  /// One folder given twice is no pair of orbits.
  Status check_roles() const {
    std::map<std::string, fs::path> photos;
    for (const Source& photo : inputs_.visible)
      if (!photo.hash.empty()) photos.emplace(photo.hash, photo.file);
    const auto is_photo = [&](const Source& source) { return photos.contains(source.hash); };
    const std::vector<Source>& thermal = inputs_.thermal;
    if (thermal.empty() || !std::all_of(thermal.begin(), thermal.end(), is_photo)) return {};
    return fail(ErrorKind::input, thermal.front().file.string(),
                fmt::format("the same image as {}, and so are all thermal ones: photos are no "
                            "thermal images",
                            photos.at(thermal.front().hash).string()),
                "give the thermal camera's own files with --thermal and the photos alone with "
                "--visible (photos inside radiometric JPEGs come with --embedded-visible)");
  }

  /// Only radiometric JPEGs say what was assumed of the object; temperatures of others are as they
  /// are.
  Status check_object_parameters() {
    if (!options_.object.any() || decoder_.radiometric_jpegs() == decoder_.files()) return {};
    const int others = decoder_.files() - decoder_.radiometric_jpegs();
    const std::string found = fmt::format(
        "emissivity, distance, reflected or air temperature or humidity is given, but "
        "{} of {} thermal files are no radiometric JPEGs",
        others, decoder_.files());
    if (decoder_.radiometric_jpegs() == 0) {
      return fail(ErrorKind::usage, "import.object", found,
                  "their temperatures can't be corrected: leave it out");
    }
    remarks_.add(found + ": their temperatures stay as they are");
    return {};
  }

  const ImportOptions& options_;
  const fs::path& folder_;
  ThermalDecoder& decoder_;
  Remarks& remarks_;
  ImportInputs inputs_;
};

}  // namespace

Result<ImportInputs> gather_inputs(const ImportOptions& options, const fs::path& folder,
                                   ThermalDecoder& decoder, Remarks& remarks) {
  return Gathering(options, folder, decoder, remarks).run();
}

}  // namespace orbitfuse
