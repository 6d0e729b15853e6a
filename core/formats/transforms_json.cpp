// SPDX-License-Identifier: BSD-3-Clause
#include "core/formats/transforms_json.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/formats/rigid_matrix.hpp"
#include "core/geometry/geometry_json.hpp"
#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

using Json = nlohmann::json;

/// A field of the frame, else of the whole file.
std::optional<double> number(const Json& frame, const Json& shared, const char* key) {
  for (const Json* object : {&frame, &shared}) {
    if (object->contains(key) && (*object)[key].is_number()) return (*object)[key].get<double>();
  }
  return std::nullopt;
}

Result<Camera> read_camera(const Json& frame, const Json& shared, const std::string& where) {
  const auto width = number(frame, shared, "w"), height = number(frame, shared, "h");
  if (!width || !height || !(*width >= 1) || !(*height >= 1) || *width > 1e6 || *height > 1e6) {
    return fail(ErrorKind::input, where, "no image size (w, h)", "add \"w\" and \"h\" to the file");
  }
  Camera camera;
  camera.width = static_cast<int>(*width);
  camera.height = static_cast<int>(*height);
  auto fx = number(frame, shared, "fl_x");
  if (const auto angle = number(frame, shared, "camera_angle_x"); !fx && angle) {
    fx = 0.5 * camera.width / std::tan(0.5 * *angle);
  }
  auto fy = number(frame, shared, "fl_y");
  if (const auto angle = number(frame, shared, "camera_angle_y"); !fy && angle) {
    fy = 0.5 * camera.height / std::tan(0.5 * *angle);
  }
  if (!fx) fx = fy;
  if (!fx)
    return fail(ErrorKind::input, where, "no focal length", "add \"fl_x\" or \"camera_angle_x\"");
  camera.fx = *fx;
  camera.fy = fy.value_or(*fx);
  camera.cx = number(frame, shared, "cx").value_or(0.5 * camera.width);
  camera.cy = number(frame, shared, "cy").value_or(0.5 * camera.height);
  camera.k1 = number(frame, shared, "k1").value_or(0);
  camera.k2 = number(frame, shared, "k2").value_or(0);
  camera.p1 = number(frame, shared, "p1").value_or(0);
  camera.p2 = number(frame, shared, "p2").value_or(0);
  for (const char* key : {"k3", "k4"}) {
    if (number(frame, shared, key).value_or(0) != 0) {
      return fail(ErrorKind::input, where, fmt::format("distortion {} is not supported", key),
                  "undistort the images or fit k1, k2, p1, p2");
    }
  }
  const Json& model = frame.contains("camera_model")    ? frame["camera_model"]
                      : shared.contains("camera_model") ? shared["camera_model"]
                                                        : Json();
  if (model.is_string() && model.get<std::string>().find("FISHEYE") != std::string::npos) {
    return fail(ErrorKind::input, where, "a fisheye camera model", "undistort the images first");
  }
  ORBITFUSE_TRY(camera.validate(where));
  return camera;
}

}  // namespace

Result<Transforms> read_transforms_json(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(const std::string text, read_file(file, max_text_bytes));
  if (nests_too_deep(text)) {
    return fail(ErrorKind::input, file.string(),
                fmt::format("lists within lists, more than {} deep", max_nesting),
                "give a nerfstudio or instant-ngp transforms.json");
  }
  Json root;
  try {
    root = Json::parse(text);
  } catch (const Json::exception& error) {
    // "[json.exception.parse_error.101] parse error at line 3, ...": the place, or the number.
    const std::string what = error.what();
    return fail(ErrorKind::input, file.string(),
                "not JSON, or cut off: " + what.substr(what.find("] ") + 2),
                "write the file again");
  }
  if (!root.is_object()) {
    return fail(ErrorKind::input, file.string(), "not a JSON object", "write the file again");
  }
  if (!root.contains("frames") || !root["frames"].is_array() || root["frames"].empty()) {
    return fail(ErrorKind::input, file.string() + ": frames", "no list of frames",
                "give a nerfstudio or instant-ngp transforms.json");
  }
  Transforms transforms;
  for (std::size_t i = 0; i < root["frames"].size(); ++i) {
    const Json& frame = root["frames"][i];
    const std::string where = fmt::format("{}: frames[{}]", file.string(), i);
    if (!frame.is_object() || !frame.contains("file_path") || !frame["file_path"].is_string()) {
      return fail(ErrorKind::input, where, "no file_path", "name the frame's image");
    }
    TransformsFrame out;
    out.file_path = frame["file_path"].get<std::string>();
    if (frame.contains("thermal_file_path") && frame["thermal_file_path"].is_string()) {
      out.thermal_file_path = frame["thermal_file_path"].get<std::string>();
    }
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
    out["transform_matrix"] = matrix_json(opengl_of_cam_from_world(frame.cam_from_world));
    frames.push_back(std::move(out));
  }
  root["frames"] = std::move(frames);
  return write_file_atomic(file, root.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace orbitfuse
