// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <nanoflann.hpp>
#include <vector>

namespace orbitfuse {

/// Nearest neighbours among points, which must outlive the tree and be distinct enough for a
/// k-d tree (thin first).
class KdTree {
 public:
  explicit KdTree(const std::vector<Eigen::Vector3d>& points)
      : adaptor_{points}, tree_(3, adaptor_, {12}) {
    tree_.buildIndex();
  }
  /// Indices and squared distances of the k nearest, nearest first; returns how many were found.
  std::size_t nearest(const Eigen::Vector3d& x, std::size_t k, std::size_t* index,
                      double* squared_distance) const {
    return tree_.knnSearch(x.data(), k, index, squared_distance);
  }

 private:
  struct Adaptor {
    const std::vector<Eigen::Vector3d>& points;
    std::size_t kdtree_get_point_count() const { return points.size(); }
    double kdtree_get_pt(std::size_t i, std::size_t d) const {
      return points[i][static_cast<Eigen::Index>(d)];
    }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  };
  Adaptor adaptor_;
  nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Adaptor>, Adaptor, 3,
                                      std::size_t>
      tree_;
};

}  // namespace orbitfuse
