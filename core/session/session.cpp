// SPDX-License-Identifier: BSD-3-Clause
#include "core/session/session.hpp"
#include "core/first_names.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <system_error>
#include <unordered_map>
#include <utility>

#include "core/nested_text.hpp"
#include "core/session/lost_lines.hpp"
#include "core/session/manifest_json.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

using manifest::Json;

using FrameIndex = std::unordered_map<std::string, std::size_t>;  ///< by file

/// One parsed line applied to the session. Unknown types are skipped: newer writers may add some.
/// A later frame line about the same file amends the earlier one: the guide chooses stations after
/// the frames are on disk.
Status apply(const Json& line, const std::string& where, Session& session, FrameIndex& index) {
  const JsonFields reader = manifest::fields_of(line, where);
  std::string type;
  ORBITFUSE_TRY(reader.get("type", type));
  session.complete = type == "end";
  if (type == "session") return manifest::read_header(reader, session);
  if (type == "device") {
    ORBITFUSE_ASSIGN(DeviceInfo device, manifest::read_device(reader));
    std::erase_if(session.devices, [&](const DeviceInfo& d) { return d.id == device.id; });
    session.devices.push_back(std::move(device));
  } else if (type == "frame") {
    ORBITFUSE_ASSIGN(FrameRecord frame, manifest::read_frame(reader));
    const auto [known, is_new] = index.emplace(frame.file, session.frames.size());
    if (is_new)
      session.frames.push_back(std::move(frame));
    else
      session.frames[known->second] = std::move(frame);
  } else if (type == "gap") {
    ORBITFUSE_ASSIGN(GapRecord gap, manifest::read_gap(reader));
    session.gaps.push_back(std::move(gap));
  } else if (type == "stream") {
    ORBITFUSE_ASSIGN(StreamRecord stream, manifest::read_stream(reader));
    session.streams.push_back(std::move(stream));
  } else if (type == "event") {
    ORBITFUSE_ASSIGN(EventRecord event, manifest::read_event(reader));
    session.events.push_back(std::move(event));
  }
  return {};
}

Status drop_missing_files(Session& session) {
  // A file that can't be asked may be there: a session without it would be a guess.
  std::optional<Error> unknown;
  std::vector<std::string>& missing_files = session.missing_files;
  std::erase_if(session.frames, [&](const FrameRecord& frame) {
    std::error_code error;
    const std::filesystem::path file = session.path_of(frame);
    if (std::filesystem::is_regular_file(file, error)) return false;
    const bool missing = !error || error == std::errc::no_such_file_or_directory ||
                         error == std::errc::not_a_directory;
    if (!missing) {
      if (!unknown)
        unknown = Error{ErrorKind::input, file.string(), error.message(),
                        "check its permissions, those of its folder, and that its disk is there"};
      return false;
    }
    missing_files.push_back(frame.file);
    return true;
  });
  if (unknown) return tl::unexpected(*std::move(unknown));
  constexpr std::size_t most_named = 3;  // a folder that was deleted is one sentence
  if (missing_files.size() > most_named) {
    session.warnings.push_back(fmt::format("{} files are listed in the manifest, but missing: {}",
                                           missing_files.size(),
                                           first_names(missing_files, most_named)));
    return {};
  }
  for (const std::string& file : missing_files)
    session.warnings.push_back(file + ": listed in the manifest, but the file is missing");
  return {};
}

}  // namespace

bool FrameRecord::has_flag(FrameFlag flag) const {
  return std::find(flags.begin(), flags.end(), name(flag)) != flags.end();
}

const DeviceInfo* Session::device(const std::string& id_wanted) const {
  for (const DeviceInfo& d : devices) {
    if (d.id == id_wanted) return &d;
  }
  return nullptr;
}

std::vector<const FrameRecord*> Session::frames_of(Modality modality, bool with_tracking) const {
  std::vector<const FrameRecord*> out;
  for (const FrameRecord& frame : frames) {
    if (frame.modality == modality && (with_tracking || !frame.tracking)) out.push_back(&frame);
  }
  return out;
}

Status check_readable(const FrameRecord& frame) {
  const Json line = Json::parse(manifest_line(frame));
  const std::string& where = frame.source.empty() ? frame.file : frame.source;
  const auto read =
      manifest::read_frame(manifest::fields_of(line, where, "correct what is known of this frame"));
  return read.map([](const FrameRecord&) {});
}

Status check_readable(const DeviceInfo& device) {
  const Json line = Json::parse(manifest_line(device));
  const auto read = manifest::read_device(
      manifest::fields_of(line, "device " + device.id, "correct what is known of this camera"));
  return read.map([](const DeviceInfo&) {});
}

Result<Session> open_session(const std::filesystem::path& folder) {
  std::error_code ignored;
  const std::filesystem::path file = folder / "manifest.jsonl";
  if (!std::filesystem::is_directory(folder, ignored)) {
    const bool is_file = std::filesystem::exists(folder, ignored);
    return fail(ErrorKind::input, folder.string(), is_file ? "is a file" : "no such folder",
                "give a session folder");
  }
  if (std::filesystem::status(file, ignored).type() == std::filesystem::file_type::not_found) {
    return fail(
        ErrorKind::input, folder.string(), "no manifest.jsonl, so not a session",
        fmt::format("make one with: orbitfuse import NEW_SESSION --visible {0} (or --thermal "
                    "{0})",
                    folder.string()));
  }
  ORBITFUSE_ASSIGN(std::string text, read_file(file));
  // Editors and tools leave blank lines behind the last one; between lines they are damage.
  text.resize(manifest::end_of_lines(text));
  Session session;
  session.folder = folder;
  FrameIndex index;
  std::size_t at = 0;
  for (int number = 1; at < text.size(); ++number) {
    const std::size_t end = text.find('\n', at);
    const bool is_last = end == std::string::npos;
    const std::string_view line(text.data() + at, (is_last ? text.size() : end) - at);
    const std::string where = fmt::format("{}:{}", file.string(), number);
    const Json json = parse_json(line);
    if (const auto twice = json.is_discarded() ? repeated_key(line) : std::nullopt)
      return fail(ErrorKind::input, where,
                  fmt::format("the key \"{}\" twice in one object", twice->key),
                  "restore the manifest from a backup");
    if (json.is_discarded() && is_last && number > 1) {
      session.complete = false;
      session.warnings.push_back(where +
                                 ": cut in the middle of the line (a crash while recording?)");
      break;
    }
    if (!json.is_object()) {
      return fail(ErrorKind::input, where, "not a JSON object",
                  "restore the manifest from a backup");
    }
    const auto type = json.find("type");
    const bool is_header = type != json.end() && *type == "session";
    if (is_header != (number == 1))
      return fail(ErrorKind::input, where,
                  is_header ? "a second session header" : "the first line is not a session header",
                  "restore the manifest from a backup");
    ORBITFUSE_TRY(apply(json, where, session, index));
    if (is_last) break;
    at = end + 1;
  }
  if (session.id.empty()) {
    return fail(
        ErrorKind::input, file.string(), "empty manifest",
        "restore it from a backup, or import the images beside it, if there are any, into a "
        "new folder");
  }
  for (const FrameRecord& frame : session.frames) {
    const DeviceInfo* device = session.device(frame.device);
    if (device && device->modality != frame.modality) {
      return fail(ErrorKind::input, file.string(),
                  fmt::format("{} is {}, its device \"{}\" is {}", frame.file, name(frame.modality),
                              frame.device, name(device->modality)),
                  "restore the manifest from a backup");
    }
    if (!device) {
      return fail(ErrorKind::input, file.string(),
                  frame.file + " is of unknown device \"" + frame.device + "\"",
                  "restore the manifest from a backup");
    }
  }
  for (const LostLines& lost : lost_lines(session)) {
    session.lost_lines += lost.count;
    session.warnings.push_back(fmt::format(
        "{}: {} of its frames {} in no line of the manifest, first id {}: lines were removed or "
        "lost",
        lost.device, lost.count, lost.count == 1 ? "is" : "are", lost.first_sequence));
  }
  ORBITFUSE_TRY(drop_missing_files(session));
  if (!session.complete)
    session.warnings.push_back("the session was not closed: it may be incomplete");
  return session;
}

}  // namespace orbitfuse
