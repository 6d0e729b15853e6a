// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/weakly_held.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "core/geometry/seen_by_some.hpp"
#include "recon/poses/doubts.hpp"
#include "recon/poses/estimate/center_uncertainty.hpp"
#include "recon/poses/index.hpp"

namespace orbitfuse {
namespace {

/// Of each view's points, those that two other sure views see.
std::vector<int> points_of_three(const Reconstruction& model, const std::vector<char>& doubted) {
  std::vector<int> common(model.views.size(), 0);
  for (const SparsePoint& point : model.points) {
    const auto sure = std::count_if(point.track.begin(), point.track.end(),
                                    [&](const Observation& o) { return !doubted[at(o.view)]; });
    for (const Observation& o : point.track)
      if (sure - (doubted[at(o.view)] ? 0 : 1) >= 2) ++common[at(o.view)];
  }
  return common;
}

constexpr const char* advice = "take one between it and the next";

}  // namespace

std::vector<DoubtfulView> weakly_held(const Reconstruction& model,
                                      const WeaklyHeldOptions& options) {
  if (model.views.size() < 3) return {};
  std::vector<char> doubted(model.views.size(), 0);
  std::vector<DoubtfulView> views;
  const auto doubt = [&](std::size_t v, DoubtReason reason, std::string why) {
    doubted[v] = 1;
    views.push_back({model.views[v].name, reason, std::move(why)});
  };
  const std::vector<double> uncertainty = center_uncertainty(model);
  for (std::size_t v = 0; v < uncertainty.size(); ++v)
    // What no point holds is said by its count.
    if (std::isfinite(uncertainty[v]) && uncertainty[v] > options.most_uncertain)
      doubt(v, DoubtReason::uncertain_place,
            fmt::format("its points leave its place uncertain by {:.2f} % of the orbit's radius, "
                        "{:.2f} % is trusted; {}",
                        100 * uncertainty[v], 100 * options.most_uncertain, advice));
  // The weakest first: what it alone vouched for is counted without it.
  for (;;) {
    const std::vector<int> common = points_of_three(model, doubted);
    std::size_t weakest = common.size();
    for (std::size_t v = 0; v < common.size(); ++v)
      if (!doubted[v] && common[v] < options.fewest_points &&
          (weakest == common.size() || common[v] < common[weakest]))
        weakest = v;
    if (weakest == common.size()) break;
    doubt(weakest, DoubtReason::few_common_points,
          fmt::format("{} of its points are seen by two other sure views, {} hold a view; {}",
                      common[weakest], options.fewest_points, advice));
  }
  const auto order = [](const DoubtfulView& a, const DoubtfulView& b) { return a.name < b.name; };
  std::sort(views.begin(), views.end(), order);
  return views;
}

Joint weakest_sure_joint(const Reconstruction& model, const std::vector<DoubtfulView>& doubtful) {
  const Joint joint = weakest_joint(model);
  if (doubtful.empty()) return joint;
  std::set<std::string> doubted;
  for (const DoubtfulView& view : doubtful) doubted.insert(view.name);
  std::vector<char> sure(model.views.size(), 1);
  for (std::size_t v = 0; v < sure.size(); ++v)
    if (doubted.contains(model.views[v].name)) sure[v] = 0;
  Joint of_sure = weakest_joint(part_of(model, sure));
  if (of_sure.share >= joint.share) return joint;
  std::vector<char> beyond(model.views.size(), 0);
  for (std::size_t v = 0, next = 0; v < sure.size(); ++v)
    if (sure[v] != 0) beyond[v] = of_sure.beyond[next++];
  of_sure.beyond = std::move(beyond);
  return of_sure;
}

void doubt_beyond(const Joint& joint, const Reconstruction& model,
                  std::vector<DoubtfulView>& doubtful) {
  if (!joint.loose()) return;
  for (std::size_t v = 0; v < joint.beyond.size(); ++v) {
    if (joint.beyond[v] == 0) continue;
    add_doubt({model.views[v].name, DoubtReason::few_common_points,
               fmt::format("{} points{} join it and {} more to the other views, too few to say how "
                           "the two parts lie; take views between them",
                           joint.points, joint.views_of_point > 2 ? " that three views see" : "",
                           joint.views_beyond - 1)},
              doubtful);
  }
}

void doubt_minority(const Reconstruction& model, std::vector<DoubtfulView>& doubtful) {
  const std::size_t doubted = doubtful.size();
  if (2 * doubted <= model.views.size()) return;
  for (const PosedView& view : model.views)
    add_doubt({view.name, DoubtReason::uncertain_place,
               fmt::format("{} of {} views are in doubt, and nothing says that the others hold",
                           doubted, model.views.size())},
              doubtful);
}

}  // namespace orbitfuse
