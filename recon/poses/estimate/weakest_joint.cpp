// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/estimate/weakest_joint.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "core/numeric/median.hpp"
#include "core/system/parallel.hpp"
#include "recon/poses/index.hpp"
#include "recon/poses/sfm/descriptor_matching.hpp"

namespace orbitfuse {
namespace {

constexpr int fewest_on_a_side = 3, most_views = 1000, modes = 3;
/// Pairs across that are looked at: each takes 50 ms at 3000 features a view.
constexpr std::size_t most_looked_at = 800;
/// Of a view, for the joint to be held by many.
constexpr int partners_per_view = 3;
/// Fewer are chance.
constexpr int fewest_alike = 20;

using Tracks = std::vector<std::vector<int>>;

/// The views of each point, once each.
Tracks views_of_points(const Reconstruction& model) {
  Tracks tracks;
  for (const SparsePoint& point : model.points) {
    std::set<int> views;
    for (const Observation& o : point.track) views.insert(o.view);
    if (views.size() >= 2) tracks.emplace_back(views.begin(), views.end());
  }
  return tracks;
}

/// Symmetric normalised Laplacian; a point counts once for each of its views, however many they
/// are. Views without points are tied to nothing.
Eigen::MatrixXd laplacian(const Tracks& tracks, int count, Eigen::VectorXd& root_degree) {
  Eigen::MatrixXd common = Eigen::MatrixXd::Zero(count, count);
  for (const std::vector<int>& views : tracks)
    for (const int a : views)
      for (const int b : views)
        if (a != b) common(a, b) += 1.0 / static_cast<double>(views.size() - 1);
  root_degree = common.rowwise().sum().cwiseMax(1e-9).cwiseSqrt();
  const Eigen::VectorXd inverse = root_degree.cwiseInverse();
  return Eigen::MatrixXd::Identity(count, count) -
         inverse.asDiagonal() * common * inverse.asDiagonal();
}

/// [k]: the points that views before and from the k-th of the order on see.
std::vector<int> points_across(const Tracks& tracks, const std::vector<int>& order) {
  std::vector<int> rank(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) rank[at(order[k])] = static_cast<int>(k);
  std::vector<int> across(order.size() + 1, 0);
  for (const std::vector<int>& views : tracks) {
    int first = static_cast<int>(order.size()), last = -1;
    for (const int v : views)
      first = std::min(first, rank[at(v)]), last = std::max(last, rank[at(v)]);
    ++across[at(first + 1)], --across[at(last + 1)];
  }
  std::partial_sum(across.begin(), across.end(), across.begin());
  return across;
}

double median_points_a_view(const Tracks& tracks, int count) {
  std::vector<double> points(at(count), 0);
  for (const std::vector<int>& views : tracks)
    for (const int v : views) ++points[at(v)];
  return std::max(1.0, median(points));
}

/// Of tracks of `views_of_point` views and more.
void take_weakest(const Tracks& tracks, int views_of_point, const std::vector<int>& order,
                  Joint& joint) {
  if (tracks.empty()) return;  // every view is weakly held then, which says more
  const auto count = static_cast<int>(order.size());
  const double points_a_view = median_points_a_view(tracks, count);
  const std::vector<int> across = points_across(tracks, order);
  for (int k = fewest_on_a_side; k <= count - fewest_on_a_side; ++k) {
    const double share = across[at(k)] / points_a_view;
    if (share >= joint.share) continue;
    joint.share = share;
    joint.points = across[at(k)];
    joint.views_of_point = views_of_point;
    joint.beyond.assign(at(count), 0);
    const bool first_is_smaller = k <= count / 2;
    joint.views_beyond = first_is_smaller ? k : count - k;
    for (int i = 0; i < count; ++i)
      joint.beyond[at(order[at(i)])] = (i < k) == first_is_smaller ? 1 : 0;
  }
}

Tracks tracks_of_three(Tracks tracks) {
  std::erase_if(tracks, [](const std::vector<int>& views) { return views.size() < 3; });
  return tracks;
}

/// Pairs of a view on each side that were not matched yet; of too many, an even sample.
std::vector<ViewPair> unmatched_across(const FeatureGraph& graph, const Reconstruction& model,
                                       const Joint& joint) {
  std::map<std::string, bool> beyond;
  for (std::size_t v = 0; v < model.views.size(); ++v)
    beyond[model.views[v].name] = joint.beyond[v] != 0;
  std::vector<ViewPair> across;
  for (const ViewPair& pair : exhaustive_pairs(graph.count())) {
    const auto a = beyond.find(graph.frames[at(pair.first)]->file),
               b = beyond.find(graph.frames[at(pair.second)]->file);
    if (a != beyond.end() && b != beyond.end() && a->second != b->second &&
        !graph.proposed.contains(pair))
      across.push_back(pair);
  }
  if (across.size() <= most_looked_at) return across;
  std::vector<ViewPair> some;
  for (std::size_t i = 0; i < most_looked_at; ++i)
    some.push_back(across[i * across.size() / most_looked_at]);
  return some;
}

/// How many features of each pair match by their descriptors alone.
Result<std::vector<int>> features_alike(const FeatureGraph& graph,
                                        const std::vector<ViewPair>& pairs,
                                        const Progress& progress) {
  std::vector<int> alike(pairs.size(), 0);
  parallel_for(static_cast<int>(pairs.size()), [&](int i) {
    if (progress.cancelled()) return;
    const auto& [a, b] = pairs[at(i)];
    alike[at(i)] = static_cast<int>(
        match_descriptors(graph.descriptors[at(a)], graph.descriptors[at(b)]).size());
  });
  ORBITFUSE_TRY(progress.check("poses.visible"));
  return alike;
}

/// The pairs that are most alike, as long as one of the two views has too few partners.
std::vector<ViewPair> likeliest(const std::vector<ViewPair>& pairs, const std::vector<int>& alike,
                                int views) {
  std::vector<std::size_t> order(pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t x, std::size_t y) { return alike[x] > alike[y]; });
  std::vector<int> taken(at(views), 0);
  std::vector<ViewPair> likely;
  for (const std::size_t i : order) {
    if (alike[i] < fewest_alike) break;
    const auto& [a, b] = pairs[i];
    if (taken[at(a)] >= partners_per_view && taken[at(b)] >= partners_per_view) continue;
    ++taken[at(a)], ++taken[at(b)];
    likely.push_back(pairs[i]);
  }
  std::sort(likely.begin(), likely.end());
  return likely;
}

}  // namespace

Joint weakest_joint(const Reconstruction& model) {
  const auto count = static_cast<int>(model.views.size());
  Joint joint;
  joint.beyond.assign(at(count), 0);
  const Tracks tracks = views_of_points(model);
  if (count < 2 * fewest_on_a_side || count > most_views || tracks.empty()) return joint;
  const Tracks of_three = tracks_of_three(tracks);
  Eigen::VectorXd root_degree;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(
      laplacian(tracks, count, root_degree));
  for (int mode = 1; mode <= std::min(modes, count - 1); ++mode) {
    const Eigen::VectorXd place = solver.eigenvectors().col(mode).cwiseQuotient(root_degree);
    std::vector<int> order(at(count));
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return place[a] < place[b]; });
    take_weakest(tracks, 2, order, joint);
    take_weakest(of_three, 3, order, joint);
  }
  return joint;
}

Result<std::vector<ViewPair>> likely_pairs_across(const FeatureGraph& graph,
                                                  const Reconstruction& model, const Joint& joint,
                                                  const Progress& progress) {
  const std::vector<ViewPair> across = unmatched_across(graph, model, joint);
  ORBITFUSE_ASSIGN(const std::vector<int> alike, features_alike(graph, across, progress));
  return likeliest(across, alike, graph.count());
}

}  // namespace orbitfuse
