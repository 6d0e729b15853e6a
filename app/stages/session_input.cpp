// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/session_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <unordered_map>

#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"
#include "core/system/parallel.hpp"

namespace orbitfuse::stages {
namespace {
namespace fs = std::filesystem;

Status check_size(const FrameRecord& frame, const fs::path& path, int width, int height) {
  if (frame.width == 0 || (frame.width == width && frame.height == height)) return {};
  return fail(ErrorKind::input, path.string(),
              fmt::format("{}x{} pixels, the manifest says {}x{}", width, height, frame.width,
                          frame.height),
              "import the session again from the original files");
}

/// Reads a frame once as its stage will, so that damage is found before any work is spent.
Status check_frame(const Session& session, const FrameRecord& frame, std::string& hash) {
  const fs::path path = session.path_of(frame);
  ORBITFUSE_ASSIGN(hash, file_hash(path));
  if (!frame.content_hash.empty() && frame.content_hash == hash) return {};
  // Not the recorded bytes: decoding says whether it is damaged or only edited.
  cv::Mat image;
  if (frame.modality == Modality::visible) {
    ORBITFUSE_ASSIGN(image, read_visible(path));
  } else if (frame.thermal_is_gray) {
    ORBITFUSE_ASSIGN(image, read_image(path));
  } else {
    ORBITFUSE_ASSIGN(image, read_thermal_k(path));
  }
  return check_size(frame, path, image.cols, image.rows);
}

/// Frames whose file is the one that was recorded for another frame: their times, stations and
/// poses are another picture's. Equal frames under one hash can't be told apart, and needn't.
void find_exchanged(const Session& session, const std::vector<std::string>& hashes,
                    std::vector<Status>& problems) {
  std::unordered_map<std::string, const FrameRecord*> recorded;
  for (const FrameRecord& frame : session.frames)
    if (!frame.content_hash.empty()) recorded.emplace(frame.content_hash, &frame);
  for (std::size_t i = 0; i < problems.size(); ++i) {
    const FrameRecord& frame = session.frames[i];
    if (frame.content_hash.empty() || hashes[i] == frame.content_hash) continue;
    if (const auto found = recorded.find(hashes[i]); found != recorded.end())
      problems[i] = fail(ErrorKind::input, session.path_of(frame).string(),
                         "holds what was recorded as " + found->second->file,
                         "files were exchanged or copied over each other: restore them");
  }
}

/// Every frame looked at, and by its number what is wrong with it. Error: cancelled.
Result<std::vector<Status>> check_frames(const Session& session, const Progress& progress,
                                         std::vector<std::string>& hashes) {
  std::vector<Status> problems(session.frames.size());
  hashes.resize(problems.size());
  parallel_for(static_cast<int>(problems.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    if (!progress.cancelled()) problems[k] = check_frame(session, session.frames[k], hashes[k]);
  });
  ORBITFUSE_TRY(progress.check("session"));
  find_exchanged(session, hashes, problems);
  return problems;
}

/// `hashes`: of the frames' files.
std::string content_of(const Session& session, Modality modality,
                       const std::vector<std::string>& hashes) {
  std::string text;
  for (const DeviceInfo& device : session.devices)
    if (device.modality == modality) text += manifest_line(device) + "\n";
  for (std::size_t i = 0; i < session.frames.size(); ++i)
    if (session.frames[i].modality == modality)
      text += manifest_line(session.frames[i]) + hashes[i] + "\n";
  return content_hash(text);
}

}  // namespace

int SessionInput::count(Modality modality) const {
  return static_cast<int>(session.frames_of(modality, false).size());
}

Samples samples_of(const Session& session, Modality modality) {
  if (modality == Modality::visible) return Samples::color;
  const bool measured = std::any_of(
      session.frames.begin(), session.frames.end(),
      [](const FrameRecord& f) { return f.modality == Modality::thermal && !f.thermal_is_gray; });
  return measured ? Samples::kelvin : Samples::gray;
}

Result<FrameFindings> look_at_frames(const Session& session, const Progress& progress) {
  std::vector<std::string> hashes;
  ORBITFUSE_ASSIGN(const std::vector<Status> problems, check_frames(session, progress, hashes));
  FrameFindings found;
  for (std::size_t i = 0; i < problems.size(); ++i) {
    const FrameRecord& frame = session.frames[i];
    if (!problems[i])
      found.damaged.push_back(problems[i].error());
    else if (!frame.content_hash.empty() && frame.content_hash != hashes[i])
      found.changed.push_back(frame.file);
  }
  return found;
}

Result<std::string> modality_content(const Session& session, Modality modality) {
  std::vector<std::string> hashes(session.frames.size());
  for (std::size_t i = 0; i < hashes.size(); ++i) {
    if (session.frames[i].modality != modality) continue;
    ORBITFUSE_ASSIGN(hashes[i], file_hash(session.path_of(session.frames[i])));
  }
  return content_of(session, modality, hashes);
}

Result<SessionInput> open_session_input(const fs::path& folder, const Progress& progress) {
  SessionInput input;
  ORBITFUSE_ASSIGN(input.session, open_session(folder));
  const Session& session = input.session;
  if (session.frames.empty())
    return fail(ErrorKind::input, folder.string(),
                fmt::format("the session has no frames{}{}", session.warnings.empty() ? "" : ": ",
                            fmt::join(session.warnings, "; ")),
                "record or import some first");

  std::vector<std::string> hashes;
  ORBITFUSE_ASSIGN(const std::vector<Status> problems, check_frames(session, progress, hashes));
  for (const Status& problem : problems) ORBITFUSE_TRY(problem);

  for (const Modality modality : {Modality::visible, Modality::thermal})
    input.content[modality] = content_of(session, modality, hashes);
  return input;
}

}  // namespace orbitfuse::stages
