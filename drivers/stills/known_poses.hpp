// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/geometry/camera.hpp"
#include "core/geometry/transform.hpp"
#include "core/modality.hpp"
#include "core/result.hpp"
#include "drivers/stills/import.hpp"
#include "drivers/stills/remarks.hpp"

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
  /// Of images that would share a view, only the one whose folders are named as the view's are may
  /// have it, or none of them.
  void tell_apart(const std::vector<std::filesystem::path>& images);
  /// The same file, else the view with its file name, else with its stem; of several the one with
  /// most of the folders above it, if that is one. A file with two different poses has none.
  const KnownView* find(const std::filesystem::path& file) const;
  /// Why a file whose name is there has no view: "000.jpg is there 2 times (left, right)"; else
  /// empty.
  std::string ambiguity(const std::filesystem::path& file) const;
  const std::vector<KnownView>& all() const { return views_; }
  bool empty() const { return views_.empty(); }
  /// Their camera, when all share one.
  std::optional<Camera> shared_camera() const;

 private:
  using Indices = std::vector<std::size_t>;
  std::vector<KnownView> views_;
  std::unordered_map<std::string, std::size_t> by_file_;
  std::unordered_map<std::string, Indices> by_name_, by_stem_;
  std::set<std::string> without_;       ///< images that another one took the view from
  std::set<std::string> contradicted_;  ///< files with two views that differ
};

/// Reads the sources that `options` name, visible and thermal; what they hold and nothing uses is
/// told. A transforms.json says of no frame which camera took it: those of `thermal_files` are
/// thermal.
Result<std::map<Modality, KnownViews>> read_known_poses(
    const ImportOptions& options, const std::vector<std::filesystem::path>& thermal_files,
    Remarks& remarks);

/// ground_truth.json: K, and c2w per frame, of "visible" and "thermal" (docs/formats.md).
Result<std::map<Modality, KnownViews>> read_ground_truth_views(const std::filesystem::path& file);

}  // namespace orbitfuse
