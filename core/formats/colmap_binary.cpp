// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cstring>
#include <string_view>

#include "core/formats/append_bytes.hpp"
#include "core/formats/colmap_records.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::colmap {
namespace {

/// Little-endian fields one after the other. After the first read past the end every further one
/// gives zeros and ok() is false, so that loops need one check a record.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T get() {
    T value{};
    if (left() < sizeof(T)) {
      ok_ = false;
      return value;
    }
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  std::string get_text() {
    const std::size_t end = bytes_.find('\0', at_);
    if (!ok_ || end == std::string_view::npos) {
      ok_ = false;
      return {};
    }
    std::string text(bytes_.substr(at_, end - at_));
    at_ = end + 1;
    return text;
  }
  /// A count of records of at least `bytes_each`, checked against what is left.
  std::uint64_t get_count(std::size_t bytes_each) {
    const auto count = get<std::uint64_t>();
    if (count > left() / bytes_each) ok_ = false;
    return ok_ ? count : 0;
  }
  std::size_t left() const { return bytes_.size() - at_; }
  bool ok() const { return ok_; }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

tl::unexpected<Error> cut(const std::filesystem::path& file, const char* what,
                          std::uint64_t index) {
  return fail(ErrorKind::input, file.string(),
              fmt::format("truncated or damaged at {} {}", what, index), "export the model again");
}

Result<std::vector<CameraRecord>> read_binary_cameras(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(file));
  ByteReader in(bytes);
  std::vector<CameraRecord> cameras;
  const std::uint64_t count = in.get_count(24);
  if (!in.ok()) return cut(file, "camera", 0);
  for (std::uint64_t i = 0; i < count; ++i) {
    CameraRecord camera;
    camera.id = in.get<std::uint32_t>();
    camera.model = in.get<std::int32_t>();
    camera.width = in.get<std::uint64_t>();
    camera.height = in.get<std::uint64_t>();
    if (!in.ok()) return cut(file, "camera", i);
    const auto parameters = parameter_count(camera.model);
    if (!parameters) return unknown_model(file.string(), fmt::format("number {}", camera.model));
    for (std::size_t k = 0; k < *parameters; ++k) camera.parameters.push_back(in.get<double>());
    if (!in.ok()) return cut(file, "camera", i);
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

Result<std::vector<ImageRecord>> read_binary_images(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(file));
  ByteReader in(bytes);
  std::vector<ImageRecord> images;
  const std::uint64_t count = in.get_count(73);
  if (!in.ok()) return cut(file, "image", 0);
  for (std::uint64_t i = 0; i < count; ++i) {
    ImageRecord image;
    image.id = in.get<std::uint32_t>();
    for (double* q : {&image.cam_from_world.rotation.w(), &image.cam_from_world.rotation.x(),
                      &image.cam_from_world.rotation.y(), &image.cam_from_world.rotation.z()}) {
      *q = in.get<double>();
    }
    for (int k = 0; k < 3; ++k) image.cam_from_world.translation[k] = in.get<double>();
    image.camera = in.get<std::uint32_t>();
    image.name = in.get_text();
    const std::uint64_t pixels = in.get_count(24);
    if (!in.ok()) return cut(file, "image", i);
    for (std::uint64_t k = 0; k < pixels; ++k) {
      const double x = in.get<double>(), y = in.get<double>();
      image.pixels.emplace_back(x, y);
      image.points.push_back(in.get<std::int64_t>());
    }
    if (!in.ok()) return cut(file, "image", i);
    images.push_back(std::move(image));
  }
  return images;
}

Result<std::vector<PointRecord>> read_binary_points(const std::filesystem::path& file) {
  std::vector<PointRecord> points;
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return points;  // poses without points are useful
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(file));
  ByteReader in(bytes);
  const std::uint64_t count = in.get_count(51);
  if (!in.ok()) return cut(file, "point", 0);
  for (std::uint64_t i = 0; i < count; ++i) {
    PointRecord point;
    point.id = in.get<std::uint64_t>();
    for (int k = 0; k < 3; ++k) point.position[k] = in.get<double>();
    for (auto& c : point.rgb) c = in.get<std::uint8_t>();
    point.error = in.get<double>();
    const std::uint64_t track = in.get_count(8);
    if (!in.ok()) return cut(file, "point", i);
    for (std::uint64_t k = 0; k < track; ++k) {
      const auto image = in.get<std::uint32_t>();
      point.track.emplace_back(image, in.get<std::uint32_t>());
    }
    points.push_back(std::move(point));
  }
  return points;
}

}  // namespace

Result<Records> read_binary(const std::filesystem::path& folder) {
  Records records;
  ORBITFUSE_ASSIGN(records.cameras, read_binary_cameras(folder / "cameras.bin"));
  ORBITFUSE_ASSIGN(records.images, read_binary_images(folder / "images.bin"));
  ORBITFUSE_ASSIGN(records.points, read_binary_points(folder / "points3D.bin"));
  return records;
}

Status write_binary(const std::filesystem::path& folder, const Records& records) {
  std::string cameras, images, points;
  append_bytes<std::uint64_t>(cameras, records.cameras.size());
  for (const CameraRecord& c : records.cameras) {
    append_bytes(cameras, c.id);
    append_bytes<std::int32_t>(cameras, c.model);
    append_bytes(cameras, c.width);
    append_bytes(cameras, c.height);
    for (double p : c.parameters) append_bytes(cameras, p);
  }
  append_bytes<std::uint64_t>(images, records.images.size());
  for (const ImageRecord& image : records.images) {
    append_bytes(images, image.id);
    const auto& q = image.cam_from_world.rotation;
    for (double v : {q.w(), q.x(), q.y(), q.z()}) append_bytes(images, v);
    for (int k = 0; k < 3; ++k) append_bytes(images, image.cam_from_world.translation[k]);
    append_bytes(images, image.camera);
    images.append(image.name.c_str(), image.name.size() + 1);
    append_bytes<std::uint64_t>(images, image.pixels.size());
    for (std::size_t k = 0; k < image.pixels.size(); ++k) {
      append_bytes(images, image.pixels[k].x());
      append_bytes(images, image.pixels[k].y());
      append_bytes(images, image.points[k]);
    }
  }
  append_bytes<std::uint64_t>(points, records.points.size());
  for (const PointRecord& point : records.points) {
    append_bytes(points, point.id);
    for (int k = 0; k < 3; ++k) append_bytes(points, point.position[k]);
    for (std::uint8_t c : point.rgb) append_bytes(points, c);
    append_bytes(points, point.error);
    append_bytes<std::uint64_t>(points, point.track.size());
    for (const auto& [image, index] : point.track) {
      append_bytes(points, image);
      append_bytes(points, index);
    }
  }
  ORBITFUSE_TRY(write_file_atomic(folder / "cameras.bin", cameras));
  ORBITFUSE_TRY(write_file_atomic(folder / "images.bin", images));
  return write_file_atomic(folder / "points3D.bin", points);
}

}  // namespace orbitfuse::colmap
