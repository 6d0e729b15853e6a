// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "recon/depth/dense_depth.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/nerf/photo_detail.hpp"

namespace orbitfuse::bench {

/// What a trained field shows of the views that measure, at their full size.
struct TestError {
  double psnr_db = 0;  ///< over the modality's span (visible: 0..1), mean over the views
  double mae_k = 0;    ///< thermal, pixels above 0 C
  int views = 0;
};

/// `detail` may add to what the field shows.
Result<TestError> test_error(const nerf::Field& field, const nerf::Dataset& data,
                             nerf::PhotoDetail* detail = nullptr);

/// Of the views that train.
Result<nerf::PhotoDetail> detail_of(const nerf::Dataset& data, const nerf::DetailOptions& options);

/// SSIM, cosine similarity, mutual information, PSNR and histogram similarity as the seed paper's
/// tables give them, on 8-bit images (thermal: over the session's span), mean over the views.
Result<std::map<std::string, double>> table_metrics(const nerf::Field& field,
                                                    const nerf::Dataset& data,
                                                    nerf::PhotoDetail* detail = nullptr);

/// Test views, temperatures as gray, and inverse depth as PNG files.
Status write_pictures(const nerf::Field& field, const nerf::Dataset& data,
                      const std::string& folder, nerf::PhotoDetail* detail = nullptr);

/// Dense depth of the views that train, added to the data. Returns CPU seconds.
Result<double> add_depth(nerf::Dataset& data, const depth::DepthOptions& options);

/// One training run: what was asked and its error against run time.
struct Run {
  std::string name;
  double before_cpu_s = 0;  ///< spent before training (depth, the guide)
  nerf::TrainReport report;
};

/// FOLDER/STEM.json and FOLDER/STEM.svg: error of the views that measure against CPU seconds.
Status write_curves(const std::string& folder, const std::string& stem,
                    const std::vector<Run>& runs);

}  // namespace orbitfuse::bench
