// SPDX-License-Identifier: BSD-3-Clause
// train_dictionary OUT.bin [PATCHES] [ITERATIONS]: trains the dictionary that MS-SRIF ships, on
// pyramid bases of dead-leaves images; prints the error curve as CSV.
#include <fmt/format.h>

#include <cstdlib>

#include "core/system/file_io.hpp"
#include "fusion/ms_srif/ksvd.hpp"
#include "fusion/pyramid/pyramid.hpp"
#include "fusion/training/dead_leaves.hpp"

using namespace orbitfuse;
using namespace orbitfuse::fusion;

namespace {

Eigen::MatrixXf cut_patches(int count) {
  Eigen::MatrixXf patches(patch_size, count);
  std::mt19937 random(7);
  Plane image;
  for (int n = 0; n < count;) {
    if (n % 200 == 0) {
      // What the method codes are bases: images reduced a few times.
      const int reductions = static_cast<int>(random() % 4);
      image = gaussian_pyramid(dead_leaves({256, 256}, random()), reductions).back();
    }
    const int x =
        static_cast<int>(random() % static_cast<std::uint32_t>(image.cols - patch_side + 1));
    const int y =
        static_cast<int>(random() % static_cast<std::uint32_t>(image.rows - patch_side + 1));
    Eigen::VectorXf patch(patch_size);
    for (int i = 0; i < patch_size; ++i) patch[i] = image(y + i / patch_side, x + i % patch_side);
    patch.array() -= patch.mean();
    if (patch.norm() < 8) continue;  // flat ones teach nothing
    patches.col(n++) = patch / std::max(patch.norm(), 1.0F) * 100;
  }
  return patches;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "train_dictionary OUT.bin [PATCHES] [ITERATIONS]\n");
    return 2;
  }
  const int count = argc > 2 ? std::atoi(argv[2]) : 20000;
  KsvdOptions options;
  if (argc > 3) options.iterations = std::atoi(argv[3]);
  fmt::print("iteration,rms_of_unit_patch_percent\n");
  const auto dictionary = train_ksvd(cut_patches(count), options, [](int i, double rms) {
    fmt::print("{},{:.4f}\n", i, rms * patch_side);
  });
  if (!dictionary) {
    fmt::print(stderr, "{}\n", dictionary.error().message());
    return 3;
  }
  const Status written = write_file_atomic(argv[1], quantised(dictionary->atoms()));
  if (!written) fmt::print(stderr, "{}\n", written.error().message());
  return written ? 0 : 4;
}
