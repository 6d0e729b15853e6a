// SPDX-License-Identifier: BSD-3-Clause
#include "app/eval/ground_truth.hpp"

#include <nlohmann/json.hpp>

#include "core/system/file_io.hpp"

namespace orbitfuse::eval {
namespace {
using nlohmann::json;

Camera camera_of(const json& k) {
  Camera camera;
  k.at("w").get_to(camera.width);
  k.at("h").get_to(camera.height);
  k.at("fx").get_to(camera.fx);
  k.at("fy").get_to(camera.fy);
  k.at("cx").get_to(camera.cx);
  k.at("cy").get_to(camera.cy);
  camera.k1 = k.value("k1", 0.0);
  camera.k2 = k.value("k2", 0.0);
  camera.p1 = k.value("p1", 0.0);
  camera.p2 = k.value("p2", 0.0);
  return camera;
}

Rigid3d pose_of(const json& c2w) {
  Eigen::Matrix4d m;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      m(r, c) = c2w.at(static_cast<std::size_t>(r)).at(static_cast<std::size_t>(c)).get<double>();
  return cam_from_world_of_opengl(m);
}

}  // namespace

Result<GroundTruth> read_ground_truth(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(const std::string text, read_file(file));
  GroundTruth truth;
  try {
    const json j = json::parse(text);
    for (const Modality modality : {Modality::visible, Modality::thermal}) {
      const auto it = j.find(std::string(name(modality)));
      if (it == j.end()) continue;
      const Camera camera = camera_of(it->at("K"));
      ORBITFUSE_TRY(camera.validate(file.string() + ": " + std::string(name(modality))));
      for (const json& f : it->at("frames"))
        truth.views[modality].push_back({f.at("file"), camera, pose_of(f.at("c2w"))});
    }
    if (j.contains("test")) {
      const Camera camera = camera_of(j.at("test").at("K"));
      for (const json& f : j.at("test").at("frames")) {
        TestView view{{}, {}, camera, pose_of(f.at("c2w"))};
        if (f.contains("visible")) view.visible = file.parent_path() / f.at("visible").get<std::string>();
        if (f.contains("thermal")) view.thermal = file.parent_path() / f.at("thermal").get<std::string>();
        truth.test.push_back(std::move(view));
      }
    }
  } catch (const json::exception& e) {
    return fail(ErrorKind::input, file.string(), e.what(), "docs/formats.md describes the file");
  }
  if (truth.views.empty())
    return fail(ErrorKind::input, file.string(), "neither visible nor thermal frames",
                "docs/formats.md describes the file");
  return truth;
}

}  // namespace orbitfuse::eval
