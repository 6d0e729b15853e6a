// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "core/result.hpp"

namespace orbitfuse::fusion {

inline constexpr int patch_side = 8;
inline constexpr int patch_size = patch_side * patch_side;

/// Atoms of 8x8 patches in columns (row-major samples), unit length, mean 0, with their Gram
/// matrix.
class Dictionary {
 public:
  /// Input error for another row count, no atom, or samples that are not finite. Atoms of length
  /// zero and repeats of an earlier atom are left out: OMP would divide by zero on them.
  static Result<Dictionary> from_atoms(const Eigen::MatrixXf& atoms);
  /// Bytes as written by `quantised`. Errors: input (another size), from_atoms'.
  static Result<Dictionary> from_bytes(std::string_view bytes);
  /// The one the project trained and ships.
  static const Dictionary& shipped();

  const Eigen::MatrixXf& atoms() const { return atoms_; }
  const Eigen::MatrixXf& gram() const { return gram_; }
  int size() const { return static_cast<int>(atoms_.cols()); }

 private:
  Eigen::MatrixXf atoms_, gram_;
};

/// One signed byte a sample, relative to its atom's largest.
std::string quantised(const Eigen::MatrixXf& atoms);

}  // namespace orbitfuse::fusion
