// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <sstream>

#include "core/formats/colmap_records.hpp"
#include "core/json_fields.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::colmap {
namespace {

/// The data lines of a file with their numbers. Comments are skipped; an empty line counts,
/// because an image without observations has one.
class Lines {
 public:
  explicit Lines(std::string text) : in_(std::move(text)) {}
  bool next(std::string& line) {
    while (std::getline(in_, line)) {
      ++number_;
      if (!line.empty() && line.back() == '\r') line.pop_back();
      if (line.empty() || line.front() != '#') return true;
    }
    return false;
  }
  int number() const { return number_; }

 private:
  std::istringstream in_;
  int number_ = 0;
};

tl::unexpected<Error> unreadable(const std::filesystem::path& file, const Lines& lines,
                                 const std::string& line) {
  return fail(ErrorKind::input, fmt::format("{}:{}", file.string(), lines.number()),
              "unreadable line: " + shown(nlohmann::json(line)), "export the model again");
}

bool blank(const std::string& line) { return line.find_first_not_of(" \t") == std::string::npos; }

Result<std::vector<CameraRecord>> read_text_cameras(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(std::string text, read_file(file));
  Lines lines(std::move(text));
  std::vector<CameraRecord> cameras;
  for (std::string line; lines.next(line);) {
    if (blank(line)) continue;
    std::istringstream words(line);
    CameraRecord camera;
    std::string model;
    if (!(words >> camera.id >> model >> camera.width >> camera.height))
      return unreadable(file, lines, line);
    const auto id = model_id(model);
    if (!id) return unknown_model(fmt::format("{}:{}", file.string(), lines.number()), model);
    camera.model = *id;
    camera.parameters.resize(*parameter_count(*id));
    for (double& p : camera.parameters) {
      if (!(words >> p)) return unreadable(file, lines, line);
    }
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

Result<std::vector<ImageRecord>> read_text_images(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(std::string text, read_file(file));
  Lines lines(std::move(text));
  std::vector<ImageRecord> images;
  for (std::string line; lines.next(line);) {
    if (blank(line)) continue;
    std::istringstream words(line);
    ImageRecord image;
    auto& q = image.cam_from_world.rotation;
    auto& t = image.cam_from_world.translation;
    if (!(words >> image.id >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z() >>
          image.camera)) {
      return unreadable(file, lines, line);
    }
    words >> std::ws;
    std::getline(words, image.name);  // names may hold spaces
    if (image.name.empty()) return unreadable(file, lines, line);
    if (!lines.next(line))
      return fail(ErrorKind::input, fmt::format("{}:{}", file.string(), lines.number()),
                  image.name + ": no line of observations after it", "export the model again");
    std::istringstream pixels(line);
    double x, y;
    std::int64_t point;
    while (!(pixels >> std::ws).eof()) {
      if (!(pixels >> x >> y >> point)) return unreadable(file, lines, line);
      image.pixels.emplace_back(x, y);
      image.points.push_back(point);
    }
    images.push_back(std::move(image));
  }
  return images;
}

Result<std::vector<PointRecord>> read_text_points(const std::filesystem::path& file) {
  std::vector<PointRecord> points;
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return points;
  ORBITFUSE_ASSIGN(std::string text, read_file(file));
  Lines lines(std::move(text));
  for (std::string line; lines.next(line);) {
    if (blank(line)) continue;
    std::istringstream words(line);
    PointRecord point;
    int r, g, b;
    auto& p = point.position;
    if (!(words >> point.id >> p.x() >> p.y() >> p.z() >> r >> g >> b >> point.error)) {
      return unreadable(file, lines, line);
    }
    point.rgb = {static_cast<std::uint8_t>(r), static_cast<std::uint8_t>(g),
                 static_cast<std::uint8_t>(b)};
    std::uint32_t image, index;
    while (!(words >> std::ws).eof()) {
      if (!(words >> image >> index)) return unreadable(file, lines, line);
      point.track.emplace_back(image, index);
    }
    points.push_back(std::move(point));
  }
  return points;
}

}  // namespace

Result<Records> read_text(const std::filesystem::path& folder) {
  Records records;
  ORBITFUSE_ASSIGN(records.cameras, read_text_cameras(folder / "cameras.txt"));
  ORBITFUSE_ASSIGN(records.images, read_text_images(folder / "images.txt"));
  ORBITFUSE_ASSIGN(records.points, read_text_points(folder / "points3D.txt"));
  return records;
}

Status write_text(const std::filesystem::path& folder, const Records& records) {
  std::string cameras = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n";
  for (const CameraRecord& c : records.cameras) {
    cameras += fmt::format("{} {} {} {} {}\n", c.id, model_name(c.model), c.width, c.height,
                           fmt::join(c.parameters, " "));
  }
  std::string images = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then X Y POINT3D_ID ...\n";
  for (const ImageRecord& image : records.images) {
    const auto& q = image.cam_from_world.rotation;
    const auto& t = image.cam_from_world.translation;
    images += fmt::format("{} {} {} {} {} {} {} {} {} {}\n", image.id, q.w(), q.x(), q.y(), q.z(),
                          t.x(), t.y(), t.z(), image.camera, image.name);
    for (std::size_t k = 0; k < image.pixels.size(); ++k) {
      if (k > 0) images += ' ';
      images += fmt::format("{} {} {}", image.pixels[k].x(), image.pixels[k].y(), image.points[k]);
    }
    images += '\n';
  }
  std::string points = "# POINT3D_ID X Y Z R G B ERROR TRACK[] as IMAGE_ID POINT2D_IDX\n";
  for (const PointRecord& p : records.points) {
    points += fmt::format("{} {} {} {} {} {} {} {}", p.id, p.position.x(), p.position.y(),
                          p.position.z(), int{p.rgb[0]}, int{p.rgb[1]}, int{p.rgb[2]}, p.error);
    for (const auto& [image, index] : p.track) points += fmt::format(" {} {}", image, index);
    points += '\n';
  }
  ORBITFUSE_TRY(write_file_atomic(folder / "cameras.txt", cameras));
  ORBITFUSE_TRY(write_file_atomic(folder / "images.txt", images));
  return write_file_atomic(folder / "points3D.txt", points);
}

}  // namespace orbitfuse::colmap
