// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/ms_srif/ksvd.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "core/system/parallel.hpp"

namespace orbitfuse::fusion {
namespace {

std::vector<SparseCode> code_all(const Dictionary& dictionary, const Eigen::MatrixXf& patches,
                                 int nonzeros) {
  std::vector<SparseCode> codes(static_cast<std::size_t>(patches.cols()));
  parallel_blocks(static_cast<int>(patches.cols()), 512, [&](int begin, int end) {
    BatchOmp omp(dictionary);
    for (int i = begin; i < end; ++i)
      omp.solve(patches.col(i), {nonzeros, 1e-3F, 0}, codes[static_cast<std::size_t>(i)]);
  });
  return codes;
}

/// The atom and its weights as the best rank-1 fit to what the others leave (power iteration).
void update_atom(Eigen::MatrixXf& atoms, int k, const Eigen::MatrixXf& patches,
                 std::vector<SparseCode>& codes, const std::vector<std::pair<int, int>>& users) {
  Eigen::MatrixXf left(patch_size, static_cast<Eigen::Index>(users.size()));
  for (std::size_t u = 0; u < users.size(); ++u) {
    const auto [patch, place] = users[u];
    const SparseCode& code = codes[static_cast<std::size_t>(patch)];
    Eigen::VectorXf rest = patches.col(patch);
    for (std::size_t j = 0; j < code.atoms.size(); ++j)
      if (static_cast<int>(j) != place) rest -= code.weights[j] * atoms.col(code.atoms[j]);
    left.col(static_cast<Eigen::Index>(u)) = rest;
  }
  Eigen::VectorXf atom = atoms.col(k);
  Eigen::VectorXf weights = left.transpose() * atom;
  for (int i = 0; i < 3; ++i) {
    const Eigen::VectorXf moved = left * weights;
    if (!(moved.norm() > 0)) return;
    atom = moved.normalized();
    weights = left.transpose() * atom;
  }
  atoms.col(k) = atom;
  for (std::size_t u = 0; u < users.size(); ++u)
    codes[static_cast<std::size_t>(users[u].first)]
        .weights[static_cast<std::size_t>(users[u].second)] = weights[static_cast<Eigen::Index>(u)];
}

}  // namespace

Result<Dictionary> train_ksvd(const Eigen::MatrixXf& patches, const KsvdOptions& options,
                              const std::function<void(int, double)>& told) {
  if (patches.rows() != patch_size || patches.cols() < 2 * options.atoms)
    return fail(ErrorKind::input, "patches", std::to_string(patches.cols()),
                "at least two an atom, 64 samples each");
  std::mt19937 random(options.seed);
  Eigen::MatrixXf atoms(patch_size, options.atoms);
  for (int k = 0; k < options.atoms; ++k)
    atoms.col(k) = patches.col(
        static_cast<Eigen::Index>(random() % static_cast<std::uint32_t>(patches.cols())));
  for (int iteration = 0;; ++iteration) {
    ORBITFUSE_ASSIGN(const Dictionary dictionary, Dictionary::from_atoms(atoms));
    std::vector<SparseCode> codes = code_all(dictionary, patches, options.nonzeros);
    double energy = 0;
    int worst = 0;
    for (std::size_t i = 0; i < codes.size(); ++i) {
      energy += static_cast<double>(codes[i].residual) * static_cast<double>(codes[i].residual);
      if (codes[i].residual > codes[static_cast<std::size_t>(worst)].residual)
        worst = static_cast<int>(i);
    }
    told(iteration, std::sqrt(energy / static_cast<double>(patches.size())));
    if (iteration == options.iterations) return dictionary;

    atoms = dictionary.atoms();
    std::vector<std::vector<std::pair<int, int>>> users(static_cast<std::size_t>(atoms.cols()));
    for (std::size_t i = 0; i < codes.size(); ++i)
      for (std::size_t j = 0; j < codes[i].atoms.size(); ++j)
        users[static_cast<std::size_t>(codes[i].atoms[j])].push_back(
            {static_cast<int>(i), static_cast<int>(j)});
    for (int k = 0; k < atoms.cols(); ++k) {
      const auto& who = users[static_cast<std::size_t>(k)];
      if (who.empty())
        atoms.col(k) = patches.col(worst).stableNormalized();
      else
        update_atom(atoms, k, patches, codes, who);
    }
    const Eigen::Index trained = atoms.cols();
    if (trained < options.atoms) {  // repeats were dropped
      atoms.conservativeResize(Eigen::NoChange, options.atoms);
      for (Eigen::Index k = trained; k < options.atoms; ++k)
        atoms.col(k) = patches.col(
            static_cast<Eigen::Index>(random() % static_cast<std::uint32_t>(patches.cols())));
    }
  }
}

}  // namespace orbitfuse::fusion
