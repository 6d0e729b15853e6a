// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "recon/poses/features/sift.hpp"
#include "recon/poses/sfm/descriptor_matching.hpp"

namespace orbitfuse {

struct DatabaseCounts {
  int images = 0, images_with_features = 0;
  double mean_features = 0;
  int matched_pairs = 0;   ///< pairs that were tried
  int verified_pairs = 0;  ///< with a two-view geometry
};

/// Input error when the file is not a COLMAP database.
Result<DatabaseCounts> count_database(const std::filesystem::path& database);

/// Numbers the images in the order of their names. COLMAP numbers them as its threads finish, and
/// the mapper's choices depend on the numbers. Only before matching: pairs carry numbers too.
Status number_images_by_name(const std::filesystem::path& database);

/// By image name, of images that the database has with no features yet (COLMAP's feature_importer,
/// given empty lists). Images that it has not, COLMAP could not read: they stay without features.
Status write_features(const std::filesystem::path& database,
                      const std::map<std::string, SiftFeatures>& features);

/// By image name; images without features have no rows.
Result<std::map<std::string, Descriptors>> read_descriptors(const std::filesystem::path& database);

/// Positions of features by image name, a column each, in the proxies' pixels.
Result<std::map<std::string, Eigen::Matrix2Xd>> read_keypoints(
    const std::filesystem::path& database);

enum class MatchKind {
  proposed,  ///< by descriptors alone
  verified,  ///< held by one two-view geometry
};
/// By the names of both images, the lower one first; empty pairs are left out.
using NamedMatches = std::map<std::pair<std::string, std::string>, std::vector<FeatureMatch>>;
Result<NamedMatches> read_matches(const std::filesystem::path& database, MatchKind kind);

}  // namespace orbitfuse
