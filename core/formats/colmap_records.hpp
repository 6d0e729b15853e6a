// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/geometry/transform.hpp"
#include "core/result.hpp"

// COLMAP's files record by record (https://colmap.github.io/format.html); colmap_model.cpp joins
// them. Two encodings, one set of records.
namespace orbitfuse::colmap {

struct CameraRecord {
  std::uint32_t id = 0;
  int model = 0;
  std::uint64_t width = 0, height = 0;
  std::vector<double> parameters;
};

struct ImageRecord {
  std::uint32_t id = 0;
  Rigid3d cam_from_world;
  std::uint32_t camera = 0;
  std::string name;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<std::int64_t> points;  ///< of each pixel, -1 = none
};

struct PointRecord {
  std::uint64_t id = 0;
  Eigen::Vector3d position;
  std::array<std::uint8_t, 3> rgb{};
  double error = 0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> track;  ///< image id, index of its pixel
};

struct Records {
  std::vector<CameraRecord> cameras;
  std::vector<ImageRecord> images;
  std::vector<PointRecord> points;
};

std::optional<std::size_t> parameter_count(int model);
std::optional<int> model_id(const std::string& model_name);
const char* model_name(int model);
tl::unexpected<Error> unknown_model(const std::string& where, const std::string& model);

Result<Records> read_binary(const std::filesystem::path& folder);
Result<Records> read_text(const std::filesystem::path& folder);
Status write_binary(const std::filesystem::path& folder, const Records& records);
Status write_text(const std::filesystem::path& folder, const Records& records);

}  // namespace orbitfuse::colmap
