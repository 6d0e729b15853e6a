// SPDX-License-Identifier: BSD-3-Clause
#include <cstdlib>

#include "core/system/file_io.hpp"
#include "recon/nerf/nerf.hpp"
#include "tests/fuzz/targets.hpp"

namespace orbitfuse::fuzz {
namespace {

constexpr std::size_t hash_length = 32;  // recon/nerf/field/checkpoint.cpp

/// The last bytes are a checksum of all before: repaired, so that what is behind it is reached.
void field(std::string_view bytes) {
  static const ScratchFile file;
  std::string whole(bytes);
  if (whole.size() > hash_length) {
    whole.resize(whole.size() - hash_length);
    whole += content_hash(whole);
  }
  static_cast<void>(nerf::Field::load(file.with(whole)));
}

std::vector<std::string> field_seeds() {
  nerf::Dataset data;
  data.modality = Modality::thermal;
  for (int i = 0; i < 4; ++i) {
    const double angle = 1.5 * i;
    Rigid3d pose;
    pose.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
    pose.translation = {0, 0, 3};
    cv::Mat image(12, 16, CV_32FC1, cv::Scalar(290 + i));
    data.views.push_back({"thermal/" + std::to_string(i) + ".tiff", Camera::from_fov(16, 12, 50),
                          pose, image, false});
  }
  nerf::TrainOptions options;
  for (const auto& [key, value] : {std::pair{"iterations", "2"},
                                   {"log2_table", "8"},
                                   {"levels", "2"},
                                   {"occupancy_resolution", "16"},
                                   {"hidden", "16"},
                                   {"color_hidden", "16"},
                                   {"samples_per_step", "256"}})
    static_cast<void>(options.set(key, value));
  nerf::Field trained;
  if (const auto report = nerf::train(data, options, {}, trained); !report) std::abort();
  const std::string path = scratch_folder() + "/seed_field.bin";
  static_cast<void>(trained.save(path));
  return {read_file(path).value()};
}

}  // namespace

const std::vector<Target>& field_targets() {
  static const std::vector<Target> list{{"field", field, field_seeds}};
  return list;
}

}  // namespace orbitfuse::fuzz
