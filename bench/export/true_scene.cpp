// SPDX-License-Identifier: BSD-3-Clause
#include "bench/export/true_scene.hpp"

#include <cstring>
#include <nlohmann/json.hpp>

#include "app/stages/artifacts.hpp"
#include "core/formats/ply.hpp"
#include "core/geometry/pose_error.hpp"
#include "core/session/session.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace fs = std::filesystem;
using nlohmann::json;

Result<TriangleMesh> read_mesh(const fs::path& file) {
  TriangleMesh mesh;
  ORBITFUSE_ASSIGN(mesh.vertices, read_ply(file));
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(file));
  const std::size_t at = bytes.find("element face ");
  if (at == std::string::npos)
    return fail(ErrorKind::input, file.string(), "no faces", "name a mesh");
  const auto faces = static_cast<std::size_t>(std::stoull(bytes.substr(at + 13)));
  const char* p = bytes.data() + bytes.size() - faces * 13;
  for (std::size_t i = 0; i < faces; ++i, p += 13) {
    std::array<std::uint32_t, 3> t;
    std::memcpy(t.data(), p + 1, 12);
    mesh.triangles.push_back(t);
  }
  return mesh;
}

Result<Similarity3d> truth_from_run(const fs::path& run, const GroundTruth& truth) {
  ORBITFUSE_ASSIGN(const json record, stages::read_json(run / "run.json"));
  ORBITFUSE_ASSIGN(const Session session, open_session(record.at("session").get<std::string>()));
  ORBITFUSE_ASSIGN(const Reconstruction model,
                   stages::load_poses(run / "poses_visible", Modality::visible));
  std::vector<PosePair> pairs;
  for (const PosedView& view : model.views)
    for (const FrameRecord& frame : session.frames)
      if (frame.file == view.name)
        for (const TrueView& known : truth.views.at(Modality::visible))
          if (fs::path(known.name).filename() == fs::path(frame.source).filename())
            pairs.push_back({view.cam_from_world, known.cam_from_world});
  return truth_from_estimate(pairs);
}

}  // namespace orbitfuse
