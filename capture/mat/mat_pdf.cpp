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

}  // namespace

Status check_paper(const std::string& paper) {
  if (papers.count(paper)) return {};
  return fail(ErrorKind::usage, "mat.paper", paper, "use A4, A3, A1 or one (a single page)");
}

Result<std::string> mat_pdf(const MatDesign& design, const std::string& paper) {
  ORBITFUSE_TRY(design.validate());
  ORBITFUSE_TRY(check_paper(paper));
  const double side = design.size_m * mm;
  Paper sheet = papers.at(paper);
  if (paper == "one") sheet = {side + 2 * margin_mm, side + 2 * margin_mm};
  // Each tile shows as much of the mat as fits between its margins.
  const double tile_w = std::min(side, sheet.width_mm - 2 * margin_mm),
               tile_h = std::min(side, sheet.height_mm - 2 * margin_mm);
  const int columns = static_cast<int>(std::ceil(side / tile_w - 1e-9)),
            rows = static_cast<int>(std::ceil(side / tile_h - 1e-9));
  if (columns * rows > most_tiles) {
    return fail(ErrorKind::usage, "mat.paper", fmt::format("{} pages of {}", columns * rows, paper),
                "use larger paper or \"one\" for a plotter");
  }
  const std::vector<MatRectangle> black = black_rectangles(design);
  std::vector<PdfPage> pages;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      // Lower left corner of the tile in the mat's frame; rows from the top.
      const double left = column * tile_w - side / 2, bottom = side / 2 - (row + 1) * tile_h;
      PdfPage page(sheet.width_mm, sheet.height_mm);
      page.clip(margin_mm, margin_mm, tile_w, tile_h);
      for (const MatRectangle& r : black) {
        const double x = r.left * mm - left, y = r.bottom * mm - bottom;
        if (x >= tile_w || y >= tile_h || x + r.width * mm <= 0 || y + r.height * mm <= 0) continue;
        page.rectangle(margin_mm + x, margin_mm + y, r.width * mm, r.height * mm);
      }
      page.end_clip();
      marks(page, tile_w, tile_h);
      if (sheet.width_mm > 150) ruler(page, margin_mm + 8, margin_mm - 8);
      const double top = sheet.height_mm - margin_mm + 6;
      page.text(margin_mm + 8, top, 3,
                fmt::format("OrbitFuse mat {:g} m, {} x {} tags{}; row {} of {}, column {} of {}; "
                            "azimuth 0 is to the right",
                            design.size_m, design.tags_per_side, design.tags_per_side,
                            design.thermal ? ", black = matt paint on foil" : "", row + 1, rows,
                            column + 1, columns));
      pages.push_back(std::move(page));
    }
  }
  return pdf_file(pages, fmt::format("OrbitFuse mat, {:g} m", design.size_m));
}

}  // namespace orbitfuse
