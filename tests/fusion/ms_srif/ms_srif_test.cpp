// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/ms_srif/ms_srif.hpp"

#include <gtest/gtest.h>

#include <random>

#include "fusion/ms_srif/ksvd.hpp"

namespace orbitfuse::fusion {
namespace {

Eigen::MatrixXf random_atoms(int count, unsigned seed) {
  std::mt19937 random(seed);
  Eigen::MatrixXf atoms(patch_size, count);
  for (Eigen::Index i = 0; i < atoms.size(); ++i)
    atoms.data()[i] = static_cast<float>(random() % 2001) / 1000 - 1;
  return atoms;
}

TEST(Dictionary, ZeroRepeatedAndOppositeAtomsAreLeftOut) {
  Eigen::MatrixXf atoms = random_atoms(10, 1);
  atoms.col(3).setZero();
  atoms.col(4).setConstant(7);  // mean-free it is nothing
  atoms.col(5) = 2 * atoms.col(0);
  atoms.col(6) = -atoms.col(1);
  const auto dictionary = Dictionary::from_atoms(atoms);
  ASSERT_TRUE(dictionary);
  EXPECT_EQ(dictionary->size(), 6);
  for (int i = 0; i < dictionary->size(); ++i) EXPECT_NEAR(dictionary->gram()(i, i), 1, 1e-5);
}

TEST(Dictionary, UnusableOnesAreErrors) {
  EXPECT_FALSE(Dictionary::from_atoms(Eigen::MatrixXf::Zero(patch_size, 5)));
  EXPECT_FALSE(Dictionary::from_atoms(Eigen::MatrixXf::Ones(63, 5)));
  Eigen::MatrixXf atoms = random_atoms(3, 1);
  atoms(0, 0) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(Dictionary::from_atoms(atoms));
  EXPECT_FALSE(Dictionary::from_bytes("short"));
  EXPECT_FALSE(Dictionary::from_bytes(""));
}

TEST(Dictionary, BytesKeepTheAtoms) {
  const auto exact = Dictionary::from_atoms(random_atoms(20, 2));
  const auto read = Dictionary::from_bytes(quantised(exact->atoms()));
  ASSERT_TRUE(read);
  ASSERT_EQ(read->size(), 20);
  for (int i = 0; i < 20; ++i) EXPECT_GT(exact->atoms().col(i).dot(read->atoms().col(i)), 0.999F);
}

TEST(BatchOmp, FindsASparseSignal) {
  const auto dictionary = Dictionary::from_atoms(random_atoms(100, 3));
  const Eigen::VectorXf signal = 5 * dictionary->atoms().col(7) - 3 * dictionary->atoms().col(50);
  SparseCode code;
  BatchOmp(*dictionary).solve(signal, {10, 1e-3F, 0}, code);
  ASSERT_EQ(code.atoms.size(), 2U);
  EXPECT_EQ(code.atoms[0], 7);
  EXPECT_EQ(code.atoms[1], 50);
  EXPECT_NEAR(code.weights[0], 5, 1e-4);
  EXPECT_NEAR(code.weights[1], -3, 1e-4);
  EXPECT_NEAR(code.l1(), 8, 1e-3);
}

TEST(BatchOmp, ResidualIsThatOfTheCodeAndFallsWithAtoms) {
  const Dictionary& dictionary = Dictionary::shipped();
  const Eigen::VectorXf signal = 100 * random_atoms(1, 9).col(0);
  float before = signal.norm();
  for (const int atoms : {1, 4, 16, 40}) {
    SparseCode code;
    BatchOmp(dictionary).solve(signal, {atoms, 0, 0}, code);
    Eigen::VectorXf rest = signal;
    for (std::size_t i = 0; i < code.atoms.size(); ++i)
      rest -= code.weights[i] * dictionary.atoms().col(code.atoms[i]);
    EXPECT_NEAR(rest.norm(), code.residual, 0.02F * signal.norm());
    EXPECT_LT(code.residual, before);
    before = code.residual;
  }
}

TEST(BatchOmp, FlatSignalCostsNoAtomAndHugeOnesEnd) {
  SparseCode code;
  BatchOmp omp(Dictionary::shipped());
  omp.solve(Eigen::VectorXf::Zero(patch_size), {63, 0, 0}, code);
  EXPECT_TRUE(code.atoms.empty());
  omp.solve(1e15F * random_atoms(1, 4).col(0), {63, 0, 0}, code);
  EXPECT_LE(code.atoms.size(), 63U);
  for (const float w : code.weights) EXPECT_TRUE(std::isfinite(w));
}

TEST(Ksvd, ErrorFallsAndSeedsRepeat) {
  // Patches made of few hidden atoms: training must find a better dictionary than it began with.
  const auto hidden = Dictionary::from_atoms(random_atoms(12, 5));
  std::mt19937 random(6);
  Eigen::MatrixXf patches(patch_size, 600);
  for (int i = 0; i < 600; ++i)
    patches.col(i) = 3 * hidden->atoms().col(static_cast<int>(random() % 12)) +
                     hidden->atoms().col(static_cast<int>(random() % 12));
  std::vector<double> errors;
  const KsvdOptions options{.atoms = 16, .nonzeros = 2, .iterations = 8, .seed = 1};
  const auto first = train_ksvd(patches, options, [&](int, double rms) { errors.push_back(rms); });
  ASSERT_TRUE(first);
  EXPECT_LT(errors.back(), 0.7 * errors.front());
  const auto second = train_ksvd(patches, options, [](int, double) {});
  EXPECT_EQ(first->atoms(), second->atoms());
  EXPECT_FALSE(train_ksvd(patches.leftCols(10), options, [](int, double) {}));
}

/// One quarter textured in the visible image, noise of 5 gray levels in the right half of both; of
/// levels that say as much.
std::pair<Plane, Plane> part_textured() {
  Plane v(64, 64, 50.0F), t(64, 64, 150.0F);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 20; ++x) v(y, x) = static_cast<float>((x + y) % 7) * 20;
  cv::RNG random(3);
  for (Plane* p : {&v, &t})
    for (int y = 0; y < 64; ++y)
      for (int x = 48; x < 64; ++x) (*p)(y, x) += static_cast<float>(random.gaussian(5));
  return {v, t};
}

TEST(MsSrif, SkippedPatchesAreReported) {
  const auto [v, t] = part_textured();
  MsSrifReport report;
  MsSrifOptions options;
  options.levels = 0;
  ASSERT_TRUE(fuse_ms_srif(v, t, options, &report));
  EXPECT_GT(report.flat_patches, report.patches / 4);
  EXPECT_GT(report.certain_patches, report.patches / 20);
  EXPECT_LT(report.flat_patches + report.certain_patches, report.patches);
  EXPECT_FALSE(report.skipped);
  ASSERT_TRUE(fuse_ms_srif(v, v, {}, &report));
  EXPECT_TRUE(report.skipped);
}

/// Where neither source has structure: the visible level, but not below something bright and hot.
TEST(MsSrif, PlainGroundHasTheVisibleLevelAndHotBodiesTheirs) {
  Plane v(96, 96, 120.0F), t(96, 96, 20.0F);
  v(5, 5) = 121;
  EXPECT_NEAR(fuse_ms_srif(v, t, {}).value()(60, 60), 120, 1);
  const Plane dark(96, 96, 20.0F), hot(96, 96, 250.0F);
  EXPECT_NEAR(fuse_ms_srif(dark, hot, {}).value()(60, 60), 250, 1);
}

TEST(MsSrif, SkippingChangesNothingWherePatchesAreCertain) {
  const auto [v, t] = part_textured();
  MsSrifOptions options;
  options.levels = 0;
  options.relative_residual = 0.001;
  MsSrifReport with, without;
  const Plane skipping = fuse_ms_srif(v, t, options, &with).value();
  options.certain_ratio = 0;
  const Plane all = fuse_ms_srif(v, t, options, &without).value();
  EXPECT_EQ(without.certain_patches, 0);
  EXPECT_LT(with.atoms_per_patch, without.atoms_per_patch);
  const cv::Rect textured(0, 0, 40, 64);
  EXPECT_LT(cv::norm(skipping(textured), all(textured), cv::NORM_INF), 1);
}

}  // namespace
}  // namespace orbitfuse::fusion
