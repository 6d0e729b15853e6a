// SPDX-License-Identifier: BSD-3-Clause
#include "core/session/manifest_json.hpp"

#include <fmt/format.h>

#include <cmath>

namespace orbitfuse {
namespace manifest {

tl::unexpected<Error> Reader::wrong(const char* key, const char* expected) const {
  return fail(ErrorKind::input, where_ + ": " + key,
              has(key) ? "found " + object_[key].dump().substr(0, 40) + ", expected " + expected
                       : std::string("missing, expected ") + expected,
              "restore the manifest from a backup");
}

Result<std::string> Reader::text(const char* key) const {
  if (!has(key) || !object_[key].is_string()) return wrong(key, "a text");
  return object_[key].get<std::string>();
}

std::string Reader::text_or(const char* key, const std::string& fallback) const {
  return has(key) && object_[key].is_string() ? object_[key].get<std::string>() : fallback;
}

Result<double> Reader::number(const char* key) const {
  if (!has(key) || !object_[key].is_number()) return wrong(key, "a number");
  const double value = object_[key].get<double>();
  if (!std::isfinite(value)) return wrong(key, "a finite number");
  return value;
}

// Times of bigger size would overflow where they are subtracted.
static constexpr std::int64_t largest = std::int64_t{1} << 62;

Result<std::int64_t> Reader::integer(const char* key) const {
  if (!has(key) || !object_[key].is_number_integer()) return wrong(key, "an integer");
  const auto value = object_[key].get<std::int64_t>();
  const bool too_big = object_[key].is_number_unsigned() && value < 0;  // wrapped
  if (too_big || value > largest || value < -largest) return wrong(key, "at most 2^62 either way");
  return value;
}

// Ids near 2^64 would wrap where they are counted on; JSON's readers keep integers to 2^53. No
// camera comes there: it would take 285,000 years at 1,000 frames a second.
static constexpr std::uint64_t largest_count = std::uint64_t{1} << 53;

Result<std::uint64_t> Reader::count(const char* key) const {
  if (!has(key) || !object_[key].is_number_unsigned()) return wrong(key, "an integer >= 0");
  const auto value = object_[key].get<std::uint64_t>();
  if (value > largest_count) return wrong(key, "at most 2^53");
  return value;
}

Result<Reader> Reader::child(const char* key) const {
  if (!has(key) || !object_[key].is_object()) return wrong(key, "an object");
  return Reader(object_[key], where_ + ": " + key);
}

namespace {

Result<int> small_count(const Reader& line, const char* key) {
  ORBITFUSE_ASSIGN(const std::uint64_t value, line.count(key));
  if (value > 1'000'000) return line.wrong(key, "at most 1000000");
  return static_cast<int>(value);
}

Result<Modality> read_modality(const Reader& line) {
  ORBITFUSE_ASSIGN(const std::string text, line.text("modality"));
  const auto modality = modality_from_name(text);
  if (!modality) return line.wrong("modality", "visible or thermal");
  return *modality;
}

Json json_of(const Camera& c) {
  return {{"width", c.width}, {"height", c.height}, {"fx", c.fx}, {"fy", c.fy}, {"cx", c.cx},
          {"cy", c.cy},       {"k1", c.k1},         {"k2", c.k2}, {"p1", c.p1}, {"p2", c.p2}};
}

Result<Camera> read_camera(const Reader& line) {
  Camera c;
  ORBITFUSE_ASSIGN(c.width, small_count(line, "width"));
  ORBITFUSE_ASSIGN(c.height, small_count(line, "height"));
  ORBITFUSE_ASSIGN(c.fx, line.number("fx"));
  ORBITFUSE_ASSIGN(c.fy, line.number("fy"));
  ORBITFUSE_ASSIGN(c.cx, line.number("cx"));
  ORBITFUSE_ASSIGN(c.cy, line.number("cy"));
  ORBITFUSE_ASSIGN(c.k1, line.number("k1"));
  ORBITFUSE_ASSIGN(c.k2, line.number("k2"));
  ORBITFUSE_ASSIGN(c.p1, line.number("p1"));
  ORBITFUSE_ASSIGN(c.p2, line.number("p2"));
  ORBITFUSE_TRY(c.validate("manifest camera"));
  // Corners of a fitted model may lie beyond where it folds; a middle of an edge that does is no
  // fit.
  const double w = c.width, h = c.height;
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(0, h / 2), Eigen::Vector2d(w, h / 2),
                                       Eigen::Vector2d(w / 2, 0), Eigen::Vector2d(w / 2, h)}) {
    if (!c.normalized_of(pixel).allFinite())
      return fail(ErrorKind::input, "manifest camera",
                  fmt::format("a distortion (k1 {:g}, k2 {:g}, p1 {:g}, p2 {:g}) that folds the "
                              "image over within its edges",
                              c.k1, c.k2, c.p1, c.p2),
                  "correct the camera");
  }
  return c;
}

Json json_of(const Rigid3d& pose) {
  const auto& q = pose.rotation;
  const auto& t = pose.translation;
  return {{"rotation_wxyz", {q.w(), q.x(), q.y(), q.z()}}, {"translation", {t.x(), t.y(), t.z()}}};
}

Result<Rigid3d> read_pose(const Reader& line) {
  const auto numbers = [&](const char* key, std::size_t count) -> Result<std::vector<double>> {
    if (!line.has(key) || !line.json()[key].is_array() || line.json()[key].size() != count) {
      return line.wrong(key, "a list of numbers");
    }
    std::vector<double> out;
    for (const Json& value : line.json()[key]) {
      if (!value.is_number() || !std::isfinite(value.get<double>()))
        return line.wrong(key, "finite numbers");
      out.push_back(value.get<double>());
    }
    return out;
  };
  ORBITFUSE_ASSIGN(const auto q, numbers("rotation_wxyz", 4));
  ORBITFUSE_ASSIGN(const auto t, numbers("translation", 3));
  Rigid3d pose{Eigen::Quaterniond(q[0], q[1], q[2], q[3]), {t[0], t[1], t[2]}};
  if (std::abs(pose.rotation.norm() - 1.0) > 1e-3)
    return line.wrong("rotation_wxyz", "a unit quaternion");
  pose.rotation.normalize();
  return pose;
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
Result<std::optional<double>> station_sigma(const Reader& line, const char* field) {
  if (!line.has(field)) return std::nullopt;
  ORBITFUSE_ASSIGN(const double sigma, line.number(field));
  if (sigma < 0) return line.wrong(field, "a number of degrees, 0 or more");
  return sigma >= 90 ? std::nullopt : std::optional(sigma);
}

Result<Station> read_station(const Reader& line) {
  Station s;
  ORBITFUSE_ASSIGN(s.loop, small_count(line, "loop"));
  ORBITFUSE_ASSIGN(s.index, small_count(line, "index"));
  ORBITFUSE_ASSIGN(s.azimuth_deg, line.number("azimuth_deg"));
  ORBITFUSE_ASSIGN(s.elevation_deg, line.number("elevation_deg"));
  // Azimuths may count several rounds; a number that no orbit has would make a station of noise.
  if (std::abs(s.azimuth_deg) > 1e5) return line.wrong("azimuth_deg", "at most 100000 either way");
  if (std::abs(s.elevation_deg) > 90) return line.wrong("elevation_deg", "-90 to 90");
  ORBITFUSE_ASSIGN(s.azimuth_sigma_deg, station_sigma(line, "azimuth_sigma_deg"));
  ORBITFUSE_ASSIGN(s.elevation_sigma_deg, station_sigma(line, "elevation_sigma_deg"));
  return s;
}

/// A path that stays inside the session: a manifest from elsewhere must not reach other files.
bool is_inside(const std::filesystem::path& file) {
  if (file.empty() || file.is_absolute()) return false;
  for (const auto& part : file) {
    if (part == "..") return false;
  }
  return true;
}

Status read_optional_parts(const Reader& line, FrameRecord& frame) {
  if (line.has("station")) {
    ORBITFUSE_ASSIGN(const Reader child, line.child("station"));
    ORBITFUSE_ASSIGN(frame.station, read_station(child));
  }
  if (line.has("cam_from_world")) {
    ORBITFUSE_ASSIGN(const Reader child, line.child("cam_from_world"));
    ORBITFUSE_ASSIGN(frame.cam_from_world, read_pose(child));
  }
  if (line.has("camera")) {
    ORBITFUSE_ASSIGN(const Reader child, line.child("camera"));
    ORBITFUSE_ASSIGN(frame.camera, read_camera(child));
  }
  if (line.has("quality")) {
    ORBITFUSE_ASSIGN(const Reader child, line.child("quality"));
    FrameQuality quality;
    ORBITFUSE_ASSIGN(quality.sharpness, child.number("sharpness"));
    ORBITFUSE_ASSIGN(quality.mean_level, child.number("mean_level"));
    ORBITFUSE_ASSIGN(quality.clipped_fraction, child.number("clipped_fraction"));
    if (child.has("edges")) {
      quality.edge_blur.emplace();
      ORBITFUSE_ASSIGN(quality.edge_blur->sigma_px, child.number("edge_sigma_px"));
      ORBITFUSE_ASSIGN(quality.edge_blur->edges, small_count(child, "edges"));
    }
    frame.quality = quality;
  }
  if (line.has("radiometry")) {
    ORBITFUSE_ASSIGN(const Reader child, line.child("radiometry"));
    ORBITFUSE_ASSIGN(frame.radiometry, read_radiometry(child));
  }
  if (line.has("flags")) {
    if (!line.json()["flags"].is_array()) return line.wrong("flags", "a list of texts");
    for (const Json& flag : line.json()["flags"]) {
      if (!flag.is_string()) return line.wrong("flags", "a list of texts");
      frame.flags.push_back(flag.get<std::string>());
    }
  }
  return {};
}

std::string line_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

Status read_header(const Reader& line, Session& session) {
  ORBITFUSE_ASSIGN(const std::uint64_t format, line.count("format"));
  if (format != session_format_version) return line.wrong("format", "1 (update orbitfuse)");
  ORBITFUSE_ASSIGN(session.id, line.text("id"));
  if (session.id.empty()) return line.wrong("id", "a text");
  session.created = line.text_or("created", "");
  if (line.has("notes") && line.json()["notes"].is_object()) {
    for (const auto& [key, value] : line.json()["notes"].items()) {
      if (value.is_string()) session.notes[key] = value.get<std::string>();
    }
  }
  return {};
}

Result<DeviceInfo> read_device(const Reader& line) {
  DeviceInfo device;
  ORBITFUSE_ASSIGN(device.id, line.text("id"));
  ORBITFUSE_ASSIGN(device.modality, read_modality(line));
  device.driver = line.text_or("driver", "");
  device.model = line.text_or("model", "");
  device.serial = line.text_or("serial", "");
  if (line.has("lens")) {
    ORBITFUSE_ASSIGN(const Reader lens, line.child("lens"));
    if (lens.has("focal_px")) {
      ORBITFUSE_ASSIGN(device.lens.focal_px, lens.number("focal_px"));
      if (!(*device.lens.focal_px > 0)) return lens.wrong("focal_px", "a number > 0");
    }
    if (lens.has("focal_relative_sigma")) {
      ORBITFUSE_ASSIGN(device.lens.focal_relative_sigma, lens.number("focal_relative_sigma"));
    }
    if (lens.has("calibrated")) {
      ORBITFUSE_ASSIGN(const Reader camera, lens.child("calibrated"));
      ORBITFUSE_ASSIGN(device.lens.calibrated, read_camera(camera));
    }
  }
  return device;
}

Result<FrameRecord> read_frame(const Reader& line) {
  FrameRecord frame;
  ORBITFUSE_ASSIGN(frame.modality, read_modality(line));
  ORBITFUSE_ASSIGN(frame.device, line.text("device"));
  ORBITFUSE_ASSIGN(frame.file, line.text("file"));
  if (!is_inside(frame.file)) return line.wrong("file", "a path inside the session folder");
  ORBITFUSE_ASSIGN(frame.width, small_count(line, "width"));
  ORBITFUSE_ASSIGN(frame.height, small_count(line, "height"));
  ORBITFUSE_ASSIGN(frame.sequence, line.count("sequence"));
  ORBITFUSE_ASSIGN(frame.host_time_ns, line.integer("host_time_ns"));
  ORBITFUSE_ASSIGN(frame.device_time_ns, line.integer("device_time_ns"));
  frame.tracking = line.flag("tracking");
  frame.thermal_is_gray = line.flag("thermal_is_gray");
  frame.content_hash = line.text_or("content_hash", "");
  frame.source = line.text_or("source", "");
  ORBITFUSE_TRY(read_optional_parts(line, frame));
  return frame;
}

Result<GapRecord> read_gap(const Reader& line) {
  GapRecord gap;
  ORBITFUSE_ASSIGN(gap.device, line.text("device"));
  ORBITFUSE_ASSIGN(gap.first_sequence, line.count("first_sequence"));
  ORBITFUSE_ASSIGN(gap.count, line.count("count"));
  gap.reason = line.text_or("reason", "");
  return gap;
}

Result<StreamRecord> read_stream(const Reader& line) {
  StreamRecord stream;
  ORBITFUSE_ASSIGN(stream.device, line.text("device"));
  ORBITFUSE_ASSIGN(stream.first_sequence, line.count("first_sequence"));
  ORBITFUSE_ASSIGN(stream.last_sequence, line.count("last_sequence"));
  ORBITFUSE_ASSIGN(stream.received, line.count("received"));
  ORBITFUSE_ASSIGN(stream.lost, line.count("lost"));
  return stream;
}

Result<EventRecord> read_event(const Reader& line) {
  EventRecord event;
  event.device = line.text_or("device", "");
  ORBITFUSE_ASSIGN(event.host_time_ns, line.integer("host_time_ns"));
  ORBITFUSE_ASSIGN(event.kind, line.text("kind"));
  event.detail = line.text_or("detail", "");
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
  if (device.lens.calibrated) lens["calibrated"] = manifest::json_of(*device.lens.calibrated);
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
               {"host_time_ns", frame.host_time_ns},
               {"device_time_ns", frame.device_time_ns},
               {"content_hash", frame.content_hash}};
  if (frame.station) json["station"] = manifest::json_of(*frame.station);
  if (frame.tracking) json["tracking"] = true;
  if (frame.thermal_is_gray) json["thermal_is_gray"] = true;
  if (!frame.flags.empty()) json["flags"] = frame.flags;
  if (frame.cam_from_world) json["cam_from_world"] = manifest::json_of(*frame.cam_from_world);
  if (frame.camera) json["camera"] = manifest::json_of(*frame.camera);
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
