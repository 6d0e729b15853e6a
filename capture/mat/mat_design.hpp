// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/result.hpp"

namespace orbitfuse {

/// A square mat of ArUco tags that lies under or round the object. Its frame: origin in the middle,
/// x to the right and y to the top of the page, z up. Azimuth is counted from x towards y, so
/// counter-clockwise seen from above.
struct MatDesign {
  double size_m = 0.6;      ///< side of the whole mat; a car wants several metres
  int tags_per_side = 9;    ///< the object hides the middle ones; many small tags survive that
  double tag_share = 0.75;  ///< of the pitch; the rest is the quiet zone
  /// For foil and paint: fewer, larger tags with wider quiet zones, because thermal images are
  /// small and soft, and inverted, because paint (black on the page) is what looks bright.
  bool thermal = false;

  static MatDesign for_thermal(double size_m);
  Status validate() const;

  int tags() const { return tags_per_side * tags_per_side; }
  double pitch_m() const { return size_m / tags_per_side; }
  double tag_m() const { return pitch_m() * tag_share; }
  /// Corners of a tag in the order of OpenCV's detector: top left, top right, bottom right, bottom
  /// left, as printed; metres in the mat's frame.
  std::array<Eigen::Vector3d, 4> corners_m(int id) const;
};

/// A black rectangle on the mat, metres in the mat's frame.
struct MatRectangle {
  double left = 0, bottom = 0, width = 0, height = 0;
};

/// What is black on the printed page.
std::vector<MatRectangle> black_rectangles(const MatDesign& design);

}  // namespace orbitfuse
