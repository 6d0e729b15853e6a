// SPDX-License-Identifier: BSD-3-Clause
#include "core/session/manifest_json.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/geometry/geometry_json.hpp"

namespace orbitfuse {
namespace manifest {

namespace {

constexpr OptionRange small_count = from_to(0, 1'000'000);

Result<Modality> read_modality(const JsonFields& line) {
  std::string text;
  ORBITFUSE_TRY(line.get("modality", text));
  const auto modality = modality_from_name(text);
  if (!modality) return line.wrong("modality", "visible or thermal");
  return *modality;
}

Result<Camera> read_camera(const JsonFields& line) {
  ORBITFUSE_ASSIGN(const Camera c, camera_of_json(line));
  // Corners of a fitted model may lie beyond where it folds; a middle of an edge that does is no
  // fit.
  const double w = c.width, h = c.height;
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(0, h / 2), Eigen::Vector2d(w, h / 2),
                                       Eigen::Vector2d(w / 2, 0), Eigen::Vector2d(w / 2, h)}) {
    if (!c.normalized_of(pixel).allFinite())
      return fail(ErrorKind::input, line.place(),
                  fmt::format("a distortion (k1 {:g}, k2 {:g}, p1 {:g}, p2 {:g}) that folds the "
                              "image over within its edges",
                              c.k1, c.k2, c.p1, c.p2),
                  "correct the camera");
  }
  return c;
}

Json json_of(const Station& s) {
  Json station = {{"loop", s.loop},
                  {"index", s.index},
                  {"azimuth_deg", s.azimuth_deg},
                  {"elevation_deg", s.elevation_deg}};
  if (s.azimuth_sigma_deg) station["azimuth_sigma_deg"] = *s.azimuth_sigma_deg;
  if (s.elevation_sigma_deg) station["elevation_sigma_deg"] = *s.elevation_sigma_deg;
  return station;
}

/// Sessions of earlier versions wrote 90 degrees or more for an unknown origin.
Result<std::optional<double>> station_sigma(const JsonFields& line, const char* field) {
  if (!line.has(field)) return std::nullopt;
  double sigma = 0;
  ORBITFUSE_TRY(line.get(field, sigma, at_least(0)));
  return sigma >= 90 ? std::nullopt : std::optional(sigma);
}

Result<Station> read_station(const JsonFields& line) {
  Station s;
  ORBITFUSE_TRY(line.get("loop", s.loop, small_count));
  ORBITFUSE_TRY(line.get("index", s.index, small_count));
  // Azimuths may count several rounds; a number that no orbit has would make a station of noise.
  ORBITFUSE_TRY(line.get("azimuth_deg", s.azimuth_deg, from_to(-1e5, 1e5)));
  ORBITFUSE_TRY(line.get("elevation_deg", s.elevation_deg, from_to(-90, 90)));
  ORBITFUSE_ASSIGN(s.azimuth_sigma_deg, station_sigma(line, "azimuth_sigma_deg"));
  ORBITFUSE_ASSIGN(s.elevation_sigma_deg, station_sigma(line, "elevation_sigma_deg"));
  return s;
}

/// In a manifest a time is a number, and this one says that it is unknown.
constexpr std::int64_t no_time = 0;

Status read_time(const JsonFields& line, const char* field, std::optional<std::int64_t>& time_ns) {
  ORBITFUSE_TRY(line.get(field, time_ns));
  if (time_ns == no_time) time_ns.reset();
  return {};
}

/// A path that stays inside the session: a manifest from elsewhere must not reach other files.
bool is_inside(const std::filesystem::path& file) {
  if (file.empty() || file.is_absolute()) return false;
  for (const auto& part : file) {
    if (part == "..") return false;
  }
  return true;
}

Status read_optional_parts(const JsonFields& line, FrameRecord& frame) {
  if (line.has("station")) {
    ORBITFUSE_ASSIGN(const JsonFields child, line.child("station"));
    ORBITFUSE_ASSIGN(frame.station, read_station(child));
  }
  if (line.has("cam_from_world")) {
    ORBITFUSE_ASSIGN(const JsonFields child, line.child("cam_from_world"));
    ORBITFUSE_ASSIGN(frame.cam_from_world, rigid_of_json(child));
  }
  if (line.has("camera")) {
    ORBITFUSE_ASSIGN(const JsonFields child, line.child("camera"));
    ORBITFUSE_ASSIGN(frame.camera, read_camera(child));
  }
  if (line.has("quality")) {
    ORBITFUSE_ASSIGN(const JsonFields child, line.child("quality"));
    FrameQuality quality;
    ORBITFUSE_TRY(child.get_all("sharpness", quality.sharpness, "mean_level", quality.mean_level,
                                "clipped_fraction", quality.clipped_fraction));
    if (child.has("edges")) {
      quality.edge_blur.emplace();
      ORBITFUSE_TRY(child.get("edge_sigma_px", quality.edge_blur->sigma_px));
      ORBITFUSE_TRY(child.get("edges", quality.edge_blur->edges, small_count));
    }
    frame.quality = quality;
  }
  if (line.has("radiometry")) {
    ORBITFUSE_ASSIGN(const JsonFields child, line.child("radiometry"));
    ORBITFUSE_ASSIGN(frame.radiometry, read_radiometry(child));
  }
  return line.get_present("flags", frame.flags);
}

std::string line_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::size_t end_of_lines(std::string_view manifest) {
  const std::size_t last = manifest.find_last_not_of(" \t\r\n");
  if (last == manifest.npos) return 0;
  const std::size_t end = manifest.find('\n', last);
  return end == manifest.npos ? manifest.size() : end + 1;
}

Status read_header(const JsonFields& line, Session& session) {
  std::uint64_t format = 0;
  ORBITFUSE_TRY(line.get("format", format));
  if (format != session_format_version) return line.wrong("format", "1 (update orbitfuse)");
  ORBITFUSE_TRY(line.get("id", session.id));
  if (session.id.empty()) return line.wrong("id", "a text");
  session.created = line.remark("created");
  if (const Json* notes = line.find("notes"); notes != nullptr && notes->is_object()) {
    for (const auto& [key, value] : notes->items()) {
      if (value.is_string()) session.notes[key] = value.get<std::string>();
    }
  }
  return {};
}

Result<DeviceInfo> read_device(const JsonFields& line) {
  DeviceInfo device;
  ORBITFUSE_TRY(line.get("id", device.id));
  ORBITFUSE_ASSIGN(device.modality, read_modality(line));
  device.driver = line.remark("driver");
  device.model = line.remark("model");
  device.serial = line.remark("serial");
  if (line.has("lens")) {
    ORBITFUSE_ASSIGN(const JsonFields lens, line.child("lens"));
    ORBITFUSE_TRY(lens.get_present("focal_px", device.lens.focal_px, "focal_relative_sigma",
                                   device.lens.focal_relative_sigma));
    if (device.lens.focal_px && !(*device.lens.focal_px > 0))
      return lens.wrong("focal_px", "a number above 0");
    if (lens.has("calibrated")) {
      ORBITFUSE_ASSIGN(const JsonFields camera, lens.child("calibrated"));
      ORBITFUSE_ASSIGN(device.lens.calibrated, read_camera(camera));
    }
  }
  return device;
}

Result<FrameRecord> read_frame(const JsonFields& line) {
  FrameRecord frame;
  ORBITFUSE_ASSIGN(frame.modality, read_modality(line));
  ORBITFUSE_TRY(line.get_all("device", frame.device, "file", frame.file));
  if (!is_inside(frame.file)) return line.wrong("file", "a path inside the session folder");
  ORBITFUSE_TRY(line.get("width", frame.width, small_count));
  ORBITFUSE_TRY(line.get("height", frame.height, small_count));
  ORBITFUSE_TRY(line.get_all("sequence", frame.sequence));
  ORBITFUSE_TRY(read_time(line, "host_time_ns", frame.host_time_ns));
  ORBITFUSE_TRY(read_time(line, "device_time_ns", frame.device_time_ns));
  frame.tracking = line.marked("tracking");
  frame.thermal_is_gray = line.marked("thermal_is_gray");
  frame.content_hash = line.remark("content_hash");
  frame.source = line.remark("source");
  ORBITFUSE_TRY(read_optional_parts(line, frame));
  return frame;
}

Result<GapRecord> read_gap(const JsonFields& line) {
  GapRecord gap;
  ORBITFUSE_TRY(
      line.get_all("device", gap.device, "first_sequence", gap.first_sequence, "count", gap.count));
  gap.reason = line.remark("reason");
  return gap;
}

Result<StreamRecord> read_stream(const JsonFields& line) {
  StreamRecord stream;
  ORBITFUSE_TRY(line.get_all("device", stream.device, "first_sequence", stream.first_sequence,
                             "last_sequence", stream.last_sequence, "received", stream.received,
                             "lost", stream.lost));
  return stream;
}

Result<EventRecord> read_event(const JsonFields& line) {
  EventRecord event;
  event.device = line.remark("device");
  ORBITFUSE_TRY(line.get_all("host_time_ns", event.host_time_ns, "kind", event.kind));
  event.detail = line.remark("detail");
  return event;
}

}  // namespace manifest

using manifest::Json;

std::string manifest_header_line(const Session& session) {
  return manifest::line_of({{"type", "session"},
                            {"format", session_format_version},
                            {"id", session.id},
                            {"created", session.created},
                            {"notes", session.notes}});
}

std::string manifest_line(const DeviceInfo& device) {
  Json lens = {{"focal_relative_sigma", device.lens.focal_relative_sigma}};
  if (device.lens.focal_px) lens["focal_px"] = *device.lens.focal_px;
  if (device.lens.calibrated) lens["calibrated"] = camera_json(*device.lens.calibrated);
  return manifest::line_of({{"type", "device"},
                            {"id", device.id},
                            {"modality", name(device.modality)},
                            {"driver", device.driver},
                            {"model", device.model},
                            {"serial", device.serial},
                            {"lens", lens}});
}

std::string manifest_line(const FrameRecord& frame) {
  Json json = {{"type", "frame"},
               {"modality", name(frame.modality)},
               {"device", frame.device},
               {"file", frame.file},
               {"width", frame.width},
               {"height", frame.height},
               {"sequence", frame.sequence},
               {"host_time_ns", frame.host_time_ns.value_or(manifest::no_time)},
               {"device_time_ns", frame.device_time_ns.value_or(manifest::no_time)},
               {"content_hash", frame.content_hash}};
  if (frame.station) json["station"] = manifest::json_of(*frame.station);
  if (frame.tracking) json["tracking"] = true;
  if (frame.thermal_is_gray) json["thermal_is_gray"] = true;
  if (!frame.flags.empty()) json["flags"] = frame.flags;
  if (frame.cam_from_world) json["cam_from_world"] = rigid_json(*frame.cam_from_world);
  if (frame.camera) json["camera"] = camera_json(*frame.camera);
  if (!frame.source.empty()) json["source"] = frame.source;
  if (frame.radiometry) json["radiometry"] = manifest::json_of_radiometry(*frame.radiometry);
  if (frame.quality) {
    json["quality"] = {{"sharpness", frame.quality->sharpness},
                       {"mean_level", frame.quality->mean_level},
                       {"clipped_fraction", frame.quality->clipped_fraction}};
    if (const auto& blur = frame.quality->edge_blur) {
      json["quality"]["edge_sigma_px"] = blur->sigma_px;
      json["quality"]["edges"] = blur->edges;
    }
  }
  return manifest::line_of(json);
}

std::string manifest_line(const GapRecord& gap) {
  return manifest::line_of({{"type", "gap"},
                            {"device", gap.device},
                            {"first_sequence", gap.first_sequence},
                            {"count", gap.count},
                            {"reason", gap.reason}});
}

std::string manifest_line(const StreamRecord& stream) {
  return manifest::line_of({{"type", "stream"},
                            {"device", stream.device},
                            {"first_sequence", stream.first_sequence},
                            {"last_sequence", stream.last_sequence},
                            {"received", stream.received},
                            {"lost", stream.lost}});
}

std::string manifest_line(const EventRecord& event) {
  return manifest::line_of({{"type", "event"},
                            {"device", event.device},
                            {"host_time_ns", event.host_time_ns},
                            {"kind", event.kind},
                            {"detail", event.detail}});
}

std::string manifest_end_line(const Session& session) {
  return manifest::line_of({{"type", "end"}, {"id", session.id}});
}

}  // namespace orbitfuse
