// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

// The project's own sources as text: what includes what, and which names are defined where.
namespace orbitfuse::structure {

struct SourceFile {
  std::string path;    ///< from the repository's root, "recon/nerf/field/network.hpp"
  std::string folder;  ///< "recon/nerf/field"
  std::string name;    ///< "network.hpp"
  std::string text;
  std::vector<std::string> includes;  ///< of this project, as written: paths from the root

  bool is_header() const { return name.ends_with(".hpp"); }
};

/// C++ sources under these folders of the root, in order of their paths.
std::vector<SourceFile> read_sources(const std::string& root,
                                     const std::vector<std::string>& folders);

/// "recon/nerf/field" -> "recon/nerf"; "core/image" -> "core"; "app/stages" -> "app".
std::string module_of(const std::string& folder);

/// Types defined at the file's outermost level, with their namespace: "orbitfuse::nerf::Ray".
std::vector<std::string> types_of(const SourceFile& file);

/// A path back to where it began, or empty: edges by node.
std::vector<std::string> find_circle(const std::map<std::string, std::vector<std::string>>& edges);

}  // namespace orbitfuse::structure
