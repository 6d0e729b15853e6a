// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/geometry/reconstruction.hpp"
#include "core/progress.hpp"
#include "core/result.hpp"
#include "recon/poses/sfm/colmap_database.hpp"
#include "recon/poses/sfm/pair_selection.hpp"
#include "recon/poses/sfm/proxy_images.hpp"

// COLMAP's command line as a structure-from-motion engine, given features of our own. Its exit
// status is never believed (3.8 exits 0 on an empty folder): what it did is counted in its database
// and in its models.
namespace orbitfuse {

/// How hard the mapper tries; each level of the ladder lowers the thresholds.
struct MapperSettings {
  std::string name = "default settings";
  double init_min_tri_angle_deg = 16;
  int init_min_num_inliers = 100;
  double init_max_forward_motion = 0.95;
  int abs_pose_min_num_inliers = 30;
  double abs_pose_min_inlier_ratio = 0.25;
  int min_num_matches = 15;
};

/// Default first; the last are the settings that found a thermal model where the default found no
/// initial pair.
std::vector<MapperSettings> mapper_ladder();

struct ColmapOptions {
  std::string command = "colmap";
  std::uint64_t seed = 1;
  int max_features = 3000;
  double peak_threshold = 0.02 / 3;  ///< SIFT contrast; lower finds more on dim thermal images
  /// COLMAP's own features too, each described in the affine shape of its surroundings and pooled
  /// over their sizes: found again from twice as far round, in twenty times the time.
  bool affine_shapes = false;
};

/// One folder of proxies and its database.
class ColmapProject {
 public:
  /// `folder` is emptied; the proxies stay where they are.
  static Result<ColmapProject> create(const std::filesystem::path& folder,
                                      const std::filesystem::path& image_folder,
                                      const ColmapOptions& options);

  /// Features of all images; images of one device and size share a camera, whose focal starts at
  /// the device's prior. Quality error when no image has features.
  Result<DatabaseCounts> extract(const Session& session, const std::vector<ProxyImage>& images,
                                 const Progress& progress);
  /// Exact matching of ours (COLMAP's random trees answer differently on each run), verified by
  /// COLMAP. Adds to the pairs matched before; a pair that was is left as it is.
  Result<DatabaseCounts> match(const std::vector<ProxyImage>& images,
                               const std::vector<ViewPair>& pairs, const Progress& progress);
  /// The largest model, in the frames' own pixels and names; no views when there is none.
  Result<Reconstruction> map(const Session& session, const std::vector<ProxyImage>& images,
                             const MapperSettings& settings, const Progress& progress);

  const std::filesystem::path& database() const { return database_; }

 private:
  /// A camera a device and size, and images by the order of their names, without features: COLMAP
  /// writes its own tables, whose columns differ by version.
  Status enter_images(const Session& session, const std::vector<ProxyImage>& images,
                      const Progress& progress);
  Result<std::map<std::string, SiftFeatures>> find_features(const std::vector<ProxyImage>& images,
                                                            const Progress& progress) const;
  Result<std::map<std::string, SiftFeatures>> find_affine_features(std::size_t images,
                                                                   const Progress& progress) const;
  Status run(std::vector<std::string> arguments, const Progress& progress) const;
  std::vector<std::string> seed_and(const std::string& verb) const;

  ColmapOptions options_;
  std::filesystem::path folder_, image_folder_, database_;
};

}  // namespace orbitfuse
