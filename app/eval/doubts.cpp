// SPDX-License-Identifier: BSD-3-Clause
#include "app/eval/doubts.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace orbitfuse::eval {
namespace {

constexpr double doubted_ate_percent = 2, doubted_rotation_deg = 5;
constexpr double doubted_loss_db = 6;
constexpr double explains = 0.2;  // of the error that is left in the right order

bool doubted(const PoseError& error) {
  return error.ate_percent > doubted_ate_percent ||
         error.rotation_median_deg > doubted_rotation_deg;
}

/// The pairs with the truth of the frame `shift` further on, counted backwards if `reversed`.
std::vector<PosePair> reordered(std::vector<PosePair> pairs, std::size_t shift, bool reversed) {
  std::vector<Rigid3d> truth;
  for (const PosePair& pair : pairs) truth.push_back(pair.cam_from_truth);
  if (reversed) std::reverse(truth.begin(), truth.end());
  for (std::size_t i = 0; i < pairs.size(); ++i)
    pairs[i].cam_from_truth = truth[(i + shift) % truth.size()];
  return pairs;
}

/// In words, the order in which the truth fits; empty where none does.
std::string order_that_fits(const std::vector<PosePair>& pairs, const PoseError& error) {
  constexpr std::size_t most = 150;  // pairs: the time grows with their third power
  std::string words;
  if (pairs.size() > most) return words;
  double least = std::max(explains * error.ate_percent, 0.5);
  for (const bool reversed : {false, true})
    for (std::size_t shift = reversed ? 0 : 1; shift < pairs.size(); ++shift) {
      const std::vector<PosePair> other = reordered(pairs, shift, reversed);
      const auto fit = truth_from_estimate(other);
      if (!fit) continue;
      const PoseError left = pose_error(other, *fit);
      if (doubted(left) || left.ate_percent > least) continue;
      least = left.ate_percent;
      words = fmt::format(
          "; with the truth's poses{}{} they are {:.2f} % off",
          reversed ? " in the opposite order" : "",
          shift > 0 ? fmt::format("{} {} posed frames further on", reversed ? "," : "", shift) : "",
          left.ate_percent);
    }
  return words;
}

}  // namespace

std::optional<std::string> doubt_of_truth(const std::vector<PosePair>& pairs,
                                          const PoseError& error) {
  if (!doubted(error)) return std::nullopt;
  return fmt::format(
      "{:.1f} % of the extent and {:.1f} degrees (median) off: the poses are wrong, or the truth "
      "is of another scene or in another order{}",
      error.ate_percent, error.rotation_median_deg, order_that_fits(pairs, error));
}

std::optional<std::string> doubt_of_test_views(double test_psnr_db, double heldout_psnr_db) {
  if (!(test_psnr_db < heldout_psnr_db - doubted_loss_db)) return std::nullopt;
  return fmt::format(
      "the visible test views come out at {:.1f} dB, the run's own held-out views at {:.1f}: the "
      "truth may be of another scene or in another order, or its views stand where none was "
      "recorded",
      test_psnr_db, heldout_psnr_db);
}

}  // namespace orbitfuse::eval
