// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse::view {

/// A view to come back to: where the viewer's camera stands, in the run's frame.
struct Bookmark {
  std::string name;
  Eigen::Vector3d position = Eigen::Vector3d::Zero(), target = Eigen::Vector3d::UnitX();
  double fov_deg = 45;  ///< of the picture's height
};

nlohmann::json to_json(const Bookmark& bookmark);
/// Usage error naming the field.
Result<Bookmark> bookmark_of(const nlohmann::json& j);

/// OUT/bookmarks.json (docs/formats.md). Every call reads the file anew and writes it whole and
/// atomically; who changes it locks the folder, so that two viewers of one run, threads or
/// processes, don't lose each other's.
class Bookmarks {
 public:
  explicit Bookmarks(const std::filesystem::path& out) : file_(out / "bookmarks.json") {}

  /// Input error for a damaged file, which is left as it is.
  Result<std::vector<Bookmark>> list() const;
  /// Usage error for a name that is taken.
  Status add(const Bookmark& bookmark);
  Status remove(const std::string& name);

 private:
  Status write(const std::vector<Bookmark>& list) const;

  std::filesystem::path file_;
};

}  // namespace orbitfuse::view
