// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/transforms_json.hpp"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/formats/rigid_matrix.hpp"
#include "core/geometry/geometry_json.hpp"
#include "core/image/image_io.hpp"
#include "core/json_fields.hpp"
#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

using Json = nlohmann::json;

/// A field of the frame, else of the whole file; null where it is in neither.
const Json& field(const Json& frame, const Json& shared, const char* key) {
  static const Json nothing;
  for (const Json* object : {&frame, &shared}) {
    const auto found = object->find(key);
    if (found != object->end() && !found->is_null()) return *found;
  }
  return nothing;
}

/// The numbers of a frame's camera, by key: what is there must be a number, since a passed over
/// "fl_x": "90" would leave another focal length in its place.
using Numbers = std::map<std::string, double, std::less<>>;

Result<Numbers> read_numbers(const Json& frame, const Json& shared, const std::string& where) {
  Numbers numbers;
  for (const char* key : {"w", "h", "fl_x", "fl_y", "camera_angle_x", "camera_angle_y", "cx", "cy",
                          "k1", "k2", "k3", "k4", "p1", "p2"}) {
    const Json& value = field(frame, shared, key);
    if (value.is_null()) continue;
    if (!value.is_number())
      return fail(ErrorKind::input, where, fmt::format("\"{}\": {}", key, shown(value)),
                  "write a number there, without quotes");
    numbers.emplace(key, value.get<double>());
  }
  return numbers;
}

std::optional<double> number(const Numbers& numbers, const char* key) {
  const auto found = numbers.find(key);
  return found == numbers.end() ? std::nullopt : std::optional(found->second);
}

/// Lenses that Camera has not are refused by name: taken as a pinhole they bend everything.
Status check_model(const Json& frame, const Json& shared, const std::string& where) {
  const Json& fisheye = field(frame, shared, "is_fisheye");
  if (!fisheye.is_null() && fisheye != Json(false) && fisheye != Json(0))
    return fail(ErrorKind::input, where, fmt::format("\"is_fisheye\": {}", shown(fisheye)),
                "undistort the images first");
  const Json& model = field(frame, shared, "camera_model");
  if (model.is_null()) return {};
  for (const char* known : {"SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV"})
    if (model == Json(known)) return {};
  return fail(ErrorKind::input, where, fmt::format("\"camera_model\": {}", shown(model)),
              "PINHOLE, SIMPLE_PINHOLE, RADIAL, SIMPLE_RADIAL and OPENCV are read; undistort the "
              "images of another lens first");
}

/// From the focal length in pixels, else from the angle that so many pixels span.
Result<std::optional<double>> focal_length(const Numbers& numbers, const char* key,
                                           const char* angle_key, int pixels,
                                           const std::string& where) {
  const auto angle = number(numbers, angle_key);
  if (angle && !(*angle > 0 && *angle < std::numbers::pi))
    return fail(ErrorKind::input, where, fmt::format("\"{}\": {}", angle_key, *angle),
                "it is the whole angle of view in radians, above 0 and below 3.14 (degrees times "
                "0.01745)");
  auto focal = number(numbers, key);
  if (!focal && angle) focal = 0.5 * pixels / std::tan(0.5 * *angle);
  return focal;
}

Result<Camera> read_camera(const Json& frame, const Json& shared, const std::string& where) {
  ORBITFUSE_ASSIGN(const Numbers numbers, read_numbers(frame, shared, where));
  const auto width = number(numbers, "w"), height = number(numbers, "h");
  if (!width || !height)
    return fail(ErrorKind::input, where, "no image size (w, h)", "add \"w\" and \"h\" to the file");
  for (const double size : {*width, *height})
    if (!(size >= 1 && size <= 1e6))
      return fail(ErrorKind::input, where,
                  fmt::format("an image of {} x {} pixels", *width, *height),
                  "write its width as \"w\" and its height as \"h\", from 1 to a million");
  Camera camera;
  camera.width = static_cast<int>(*width);
  camera.height = static_cast<int>(*height);
  ORBITFUSE_ASSIGN(auto fx, focal_length(numbers, "fl_x", "camera_angle_x", camera.width, where));
  ORBITFUSE_ASSIGN(const auto fy,
                   focal_length(numbers, "fl_y", "camera_angle_y", camera.height, where));
  if (!fx) fx = fy;
  if (!fx)
    return fail(ErrorKind::input, where, "no focal length", "add \"fl_x\" or \"camera_angle_x\"");
  camera.fx = *fx;
  camera.fy = fy.value_or(*fx);
  camera.cx = number(numbers, "cx").value_or(0.5 * camera.width);
  camera.cy = number(numbers, "cy").value_or(0.5 * camera.height);
  camera.k1 = number(numbers, "k1").value_or(0);
  camera.k2 = number(numbers, "k2").value_or(0);
  camera.p1 = number(numbers, "p1").value_or(0);
  camera.p2 = number(numbers, "p2").value_or(0);
  for (const char* key : {"k3", "k4"}) {
    if (number(numbers, key).value_or(0) != 0) {
      return fail(ErrorKind::input, where, fmt::format("distortion {} is not supported", key),
                  "undistort the images or fit k1, k2, p1, p2");
    }
  }
  ORBITFUSE_TRY(check_model(frame, shared, where));
  ORBITFUSE_TRY(camera.validate(where));
  return camera;
}

/// NeRF's synthetic scenes name no size, nor their images' ".png": all are of the first one's size.
void take_size_of_image(Json& root, const std::filesystem::path& file) {
  const Json& first = root["frames"].front();
  if (root.contains("w") || root.contains("h") || !first.is_object() || first.contains("w") ||
      first.contains("h") || !first.contains("file_path") || !first["file_path"].is_string())
    return;
  const std::string image = (file.parent_path() / first["file_path"].get<std::string>()).string();
  for (const char* extension : {"", ".png", ".jpg"}) {
    const Result<cv::Mat> pixels = read_visible(image + extension);
    if (!pixels) continue;
    root["w"] = pixels->cols;
    root["h"] = pixels->rows;
    return;
  }
}

}  // namespace

Result<Transforms> read_transforms_json(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(const std::string text, read_file(file, max_text_bytes));
  Json root = parse_json(text);
  if (root.is_discarded())
    return fail(ErrorKind::input, file.string(), json_fault(text), "write the file again");
  if (!root.is_object()) {
    return fail(ErrorKind::input, file.string(), "not a JSON object", "write the file again");
  }
  if (!root.contains("frames") || !root["frames"].is_array() || root["frames"].empty()) {
    return fail(ErrorKind::input, file.string() + ": frames", "no list of frames",
                "give a nerfstudio or instant-ngp transforms.json");
  }
  take_size_of_image(root, file);
  Transforms transforms;
  for (std::size_t i = 0; i < root["frames"].size(); ++i) {
    const Json& frame = root["frames"][i];
    const std::string where = fmt::format("{}: frames[{}]", file.string(), i);
    if (!frame.is_object() || !frame.contains("file_path") || !frame["file_path"].is_string() ||
        frame["file_path"].get_ref<const std::string&>().empty()) {
      return fail(ErrorKind::input, where, "no file_path", "name the frame's image");
    }
    TransformsFrame out;
    out.file_path = frame["file_path"].get<std::string>();
    if (frame.contains("thermal_file_path") && frame["thermal_file_path"].is_string()) {
      out.thermal_file_path = frame["thermal_file_path"].get<std::string>();
    }
    for (const char* key : {"mask_path", "depth_file_path"})
      if (!field(frame, root, key).is_null()) ++transforms.unused[key];
    ORBITFUSE_ASSIGN(out.camera, read_camera(frame, root, where));
    ORBITFUSE_ASSIGN(
        out.cam_from_world,
        rigid_of_opengl_json(frame.value("transform_matrix", Json()), where + ".transform_matrix"));
    transforms.frames.push_back(std::move(out));
  }
  return transforms;
}

Status write_transforms_json(const std::filesystem::path& file, const Transforms& transforms) {
  Json root;
  root["conventions"] = {{"transform_matrix", "camera-to-world"},
                         {"camera_axes", "OpenGL: x right, y up, looks along -z"},
                         {"pixels", "centre of the top-left pixel is (0.5, 0.5)"}};
  root["camera_model"] = "OPENCV";
  Json frames = Json::array();
  for (const TransformsFrame& frame : transforms.frames) {
    const Camera& c = frame.camera;
    Json out = {{"file_path", frame.file_path},
                {"w", c.width},
                {"h", c.height},
                {"fl_x", c.fx},
                {"fl_y", c.fy},
                {"cx", c.cx},
                {"cy", c.cy},
                {"k1", c.k1},
                {"k2", c.k2},
                {"p1", c.p1},
                {"p2", c.p2}};
    if (frame.thermal_file_path) out["thermal_file_path"] = *frame.thermal_file_path;
    if (!frame.source.empty()) out["source"] = frame.source;
    out["transform_matrix"] = matrix_json(opengl_of_cam_from_world(frame.cam_from_world));
    frames.push_back(std::move(out));
  }
  root["frames"] = std::move(frames);
  return write_file_atomic(file, root.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace orbitfuse
