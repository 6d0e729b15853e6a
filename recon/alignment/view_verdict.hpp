// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

namespace orbitfuse {

/// What a pose is worth. `doubtful` ones are kept, named and warned of; `dropped` ones are not.
enum class Confidence { sure, doubtful, dropped };

/// Why a view is not sure.
enum class DoubtReason {
  none,
  not_found,                ///< neither form nor temperatures know its edges anywhere
  weak_support,             ///< few of its edges are in place, against the other loops' views
  off_its_loop,             ///< far from where its station and its loop have it, or aimed elsewhere
  temperatures_elsewhere,   ///< the other views' temperatures place it elsewhere
  temperatures_unlike,      ///< its image is not what the other views' temperatures show there
  neighbours_elsewhere,     ///< patches of its neighbours place it where form doesn't hold it
  temperatures_contradict,  ///< they find it nowhere; form alone keeps it
  undecided,                ///< so many are contradicted that nobody is left to judge
  loop_in_doubt,            ///< most of its loop is in doubt
  few_common_points,        ///< hardly a point of it is seen by two other views
  uncertain_place,          ///< its points and their residuals leave it room
};

constexpr std::string_view name(DoubtReason reason) {
  switch (reason) {
    case DoubtReason::none:
      return "none";
    case DoubtReason::not_found:
      return "not_found";
    case DoubtReason::weak_support:
      return "weak_support";
    case DoubtReason::off_its_loop:
      return "off_its_loop";
    case DoubtReason::temperatures_elsewhere:
      return "temperatures_elsewhere";
    case DoubtReason::temperatures_unlike:
      return "temperatures_unlike";
    case DoubtReason::neighbours_elsewhere:
      return "neighbours_elsewhere";
    case DoubtReason::temperatures_contradict:
      return "temperatures_contradict";
    case DoubtReason::undecided:
      return "undecided";
    case DoubtReason::loop_in_doubt:
      return "loop_in_doubt";
    case DoubtReason::few_common_points:
      return "few_common_points";
    case DoubtReason::uncertain_place:
      return "uncertain_place";
  }
  return "unknown";
}

struct ViewVerdict {
  Confidence confidence = Confidence::sure;
  DoubtReason reason = DoubtReason::none;
  std::string detail = {};  ///< figures, in words
  /// Doubtful for the time being: dropped in the end unless bundling brings it to where its image
  /// and its patches are what the other views show.
  bool on_probation = false;

  bool sure() const { return confidence == Confidence::sure; }
};

}  // namespace orbitfuse
