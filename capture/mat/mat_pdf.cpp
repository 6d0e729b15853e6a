// SPDX-License-Identifier: BSD-3-Clause
#include "capture/mat/mat_pdf.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>

#include "capture/mat/pdf_writer.hpp"

namespace orbitfuse {
namespace {

struct Paper {
  double width_mm, height_mm;  // 0: as large as the mat
};
const std::map<std::string, Paper> papers{
    {"A4", {210, 297}}, {"A3", {297, 420}}, {"A1", {594, 841}}, {"one", {0, 0}}};

constexpr double margin_mm = 12;  // most printers reach within 5 mm; the rest is for marks
constexpr double mm = 1000;       // a metre
constexpr int most_tiles = 400;

void marks(PdfPage& page, double w, double h) {
  const double inner = margin_mm, length = 5;
  for (const double x : {inner, inner + w}) {
    for (const double y : {inner, inner + h}) {
      page.line(x, y < page.height_mm() / 2 ? y - length : y, x,
                y < page.height_mm() / 2 ? y : y + length);
      page.line(x < page.width_mm() / 2 ? x - length : x, y,
                x < page.width_mm() / 2 ? x : x + length, y);
    }
  }
}

void ruler(PdfPage& page, double left, double y) {
  page.line(left, y, left + 100, y);
  page.line(left, y - 1, left, y + 1);
  page.line(left + 100, y - 1, left + 100, y + 1);
  page.text(left + 102, y - 1, 3, "100 mm: print at 100 %, not fitted to the page");
}

/// What of the mat is where on which page: tile (row, column) shows as much as fits between
/// margins.
struct Tiling {
  Paper sheet;
  double side_mm = 0, tile_w_mm = 0, tile_h_mm = 0;
  int columns = 0, rows = 0;
};

Tiling tiling_of(const MatDesign& design, const std::string& paper) {
  Tiling t;
  t.side_mm = design.size_m * mm;
  t.sheet = papers.at(paper);
  if (t.sheet.width_mm <= 0) {
    const double whole = std::min(t.side_mm + 2 * margin_mm, PdfWriter::largest_page_mm);
    t.sheet = {whole, whole};
  }
  t.tile_w_mm = std::min(t.side_mm, t.sheet.width_mm - 2 * margin_mm);
  t.tile_h_mm = std::min(t.side_mm, t.sheet.height_mm - 2 * margin_mm);
  t.columns = static_cast<int>(std::ceil(t.side_mm / t.tile_w_mm - 1e-9));
  t.rows = static_cast<int>(std::ceil(t.side_mm / t.tile_h_mm - 1e-9));
  return t;
}

/// The part of the mat that lies on a tile; rows from the top.
void paint(PdfPage& page, const Tiling& t, int row, int column,
           const std::vector<MatRectangle>& black) {
  // Lower left corner of the tile in the mat's frame.
  const double left = column * t.tile_w_mm - t.side_mm / 2,
               bottom = t.side_mm / 2 - (row + 1) * t.tile_h_mm;
  page.clip(margin_mm, margin_mm, t.tile_w_mm, t.tile_h_mm);
  for (const MatRectangle& r : black) {
    const double x = r.left * mm - left, y = r.bottom * mm - bottom;
    if (x >= t.tile_w_mm || y >= t.tile_h_mm || x + r.width * mm <= 0 || y + r.height * mm <= 0)
      continue;
    page.rectangle(margin_mm + x, margin_mm + y, r.width * mm, r.height * mm);
  }
  page.end_clip();
}

}  // namespace

Status check_paper(const std::string& paper) {
  if (papers.count(paper)) return {};
  return fail(ErrorKind::usage, "mat.paper", paper, "use A4, A3, A1 or one (a single page)");
}

Result<std::string> mat_pdf(const MatDesign& design, const std::string& paper) {
  ORBITFUSE_TRY(design.validate());
  ORBITFUSE_TRY(check_paper(paper));
  const Tiling tiling = tiling_of(design, paper);
  if (tiling.columns * tiling.rows > most_tiles) {
    return fail(ErrorKind::usage, "mat.paper",
                fmt::format("{} pages of {}", tiling.columns * tiling.rows, paper),
                "use larger paper or \"one\" for a plotter");
  }
  const std::vector<MatRectangle> black = black_rectangles(design);
  PdfWriter writer(fmt::format("OrbitFuse mat, {:g} m", design.size_m));
  for (int row = 0; row < tiling.rows; ++row) {
    for (int column = 0; column < tiling.columns; ++column) {
      PdfPage page = writer.add_page(tiling.sheet.width_mm, tiling.sheet.height_mm);
      paint(page, tiling, row, column, black);
      marks(page, tiling.tile_w_mm, tiling.tile_h_mm);
      if (tiling.sheet.width_mm > 150) ruler(page, margin_mm + 8, margin_mm - 8);
      const double top = tiling.sheet.height_mm - margin_mm + 6;
      page.text(margin_mm + 8, top, 3,
                fmt::format("OrbitFuse mat {:g} m, {} x {} tags{}; row {} of {}, column {} of {}; "
                            "azimuth 0 is to the right",
                            design.size_m, design.tags_per_side, design.tags_per_side,
                            design.thermal ? ", black = matt paint on foil" : "", row + 1,
                            tiling.rows, column + 1, tiling.columns));
    }
  }
  return writer.bytes();
}

}  // namespace orbitfuse
