// SPDX-License-Identifier: BSD-3-Clause
#include "capture/mat/mat_design.hpp"

#include "capture/mat/aruco_dictionary.hpp"
#include "core/option_range.hpp"

namespace orbitfuse {

MatDesign MatDesign::for_thermal(double size_m) {
  MatDesign design;
  design.size_m = size_m;
  design.tags_per_side = 5;
  design.tag_share = 0.6;
  design.thermal = true;
  return design;
}

Status MatDesign::validate() const {
  const OptionCheck check("mat");
  ORBITFUSE_TRY(check("size_m", size_m, from_to(0.05, 20)));
  ORBITFUSE_TRY(check("tags_per_side", tags_per_side, from_to(2, 15)));  // 250 tags in all
  return check("tag_share", tag_share, from_to(0.3, 0.85));              // tags need a quiet zone
}

std::array<Eigen::Vector3d, 4> MatDesign::corners_m(int id) const {
  const int column = id % tags_per_side, row = id / tags_per_side;  // rows from the top of the page
  const double x = (column + 0.5) * pitch_m() - 0.5 * size_m,
               y = 0.5 * size_m - (row + 0.5) * pitch_m();
  const double h = 0.5 * tag_m();
  return {
      Eigen::Vector3d{x - h, y + h, 0}, {x + h, y + h, 0}, {x + h, y - h, 0}, {x - h, y - h, 0}};
}

std::vector<MatRectangle> black_rectangles(const MatDesign& design) {
  std::vector<MatRectangle> list;
  const auto dictionary = dictionary_of(design);
  const int cells = dictionary->markerSize + 2;
  const double cell_m = design.tag_m() / cells;
  for (int id = 0; id < design.tags(); ++id) {
    cv::Mat bits;
    dictionary->drawMarker(id, cells, bits, 1);  // one pixel a cell
    const Eigen::Vector3d top_left = design.corners_m(id)[0];
    const int black = design.thermal ? 255 : 0;
    for (int row = 0; row < cells; ++row) {
      // Runs of cells as one rectangle: no hairlines between them in print.
      for (int column = 0; column < cells;) {
        int end = column;
        while (end < cells && bits.at<std::uint8_t>(row, end) == black) ++end;
        if (end > column) {
          list.push_back({top_left.x() + column * cell_m, top_left.y() - (row + 1) * cell_m,
                          (end - column) * cell_m, cell_m});
        }
        column = std::max(end, column + 1);
      }
    }
    if (!design.thermal) continue;
    // Inverted: the quiet zone round the tag is what is painted.
    const double p = design.pitch_m(), s = design.tag_m(), q = 0.5 * (p - s);
    const double left = top_left.x() - q, bottom = top_left.y() - s - q;
    list.push_back({left, bottom, p, q});
    list.push_back({left, bottom + q + s, p, q});
    list.push_back({left, bottom + q, q, s});
    list.push_back({left + q + s, bottom + q, q, s});
  }
  return list;
}

}  // namespace orbitfuse
