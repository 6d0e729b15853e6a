// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>

#include "fusion/ms_srif/batch_omp.hpp"

namespace orbitfuse::fusion {

struct KsvdOptions {
  int atoms = 256;
  int nonzeros = 6;  ///< a patch while training
  int iterations = 20;
  std::uint32_t seed = 1;
};

/// K-SVD (Aharon, Elad, Bruckstein 2006) on mean-free patches in columns; atoms nobody uses are
/// replaced by the worst-coded patch. `told` gets the iteration and the RMS error of a sample.
Result<Dictionary> train_ksvd(const Eigen::MatrixXf& patches, const KsvdOptions& options,
                              const std::function<void(int, double)>& told);

}  // namespace orbitfuse::fusion
