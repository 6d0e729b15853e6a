// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/geometry/camera.hpp"
#include "core/geometry/transform.hpp"
#include "core/modality.hpp"
#include "core/result.hpp"
#include "drivers/stills/import.hpp"

namespace orbitfuse {

struct KnownView {
  std::filesystem::path file;  ///< as the source wrote it, made absolute where it is relative to it
  Camera camera;
  std::optional<Rigid3d> cam_from_world;
  std::optional<double> elevation_deg;
};

/// Views of one modality with known poses, found by file name.
class KnownViews {
 public:
  void add(KnownView view);
  /// The same file, else the only view with its file name, else with its stem.
  const KnownView* find(const std::filesystem::path& file) const;
  /// Why a file whose name is there has no view: "000.jpg is there twice (left, right)"; else
  /// empty.
  std::string ambiguity(const std::filesystem::path& file) const;
  const std::vector<KnownView>& all() const { return views_; }
  bool empty() const { return views_.empty(); }
  /// Their camera, when all share one.
  std::optional<Camera> shared_camera() const;

 private:
  struct Named {
    std::size_t index = 0;  ///< of the first
    int views = 0;          ///< of that name
  };
  std::vector<KnownView> views_;
  std::unordered_map<std::string, std::size_t> by_file_;
  std::unordered_map<std::string, Named> by_name_, by_stem_;
};

/// Reads the sources that `options` name, visible and thermal.
Result<std::map<Modality, KnownViews>> read_known_poses(const ImportOptions& options);

/// ground_truth.json: K, and c2w per frame, of "visible" and "thermal" (docs/formats.md).
Result<std::map<Modality, KnownViews>> read_ground_truth_views(const std::filesystem::path& file);

}  // namespace orbitfuse
