// SPDX-License-Identifier: BSD-3-Clause
#include "capture/mat/mat_pdf.hpp"

#include <gtest/gtest.h>

#include <regex>
#include <sstream>

#include "capture/mat/mat_finder.hpp"
#include "tests/support/rendered_mat.hpp"

namespace orbitfuse {
namespace {

constexpr double pt_per_m = 72 / 0.0254;

struct Page {
  double width_pt = 0, height_pt = 0;
  std::vector<MatRectangle> black;  // metres from the page's lower left corner
};

/// Every entry of the cross-reference table leads to its object.
void check_table(const std::string& file) {
  EXPECT_EQ(file.rfind("%PDF-1.", 0), 0u);
  const std::size_t start = std::stoul(file.substr(file.rfind("startxref") + 10));
  std::istringstream table(file.substr(start));
  std::string word;
  std::size_t zero = 0, count = 0;
  table >> word >> zero >> count;
  EXPECT_EQ(word, "xref");
  EXPECT_GT(count, 4u);
  for (std::size_t i = 0; i < count; ++i) {
    std::string offset, generation, kind;
    table >> offset >> generation >> kind;
    if (i == 0) continue;
    const std::string head = std::to_string(i) + " 0 obj";
    EXPECT_EQ(file.compare(std::stoul(offset), head.size(), head), 0) << i;
  }
}

/// Filled rectangles of an uncompressed content stream: "x y width height re", then "f".
std::vector<MatRectangle> filled_rectangles(const std::string& content) {
  std::vector<MatRectangle> black;
  MatRectangle last;
  std::istringstream lines(content);
  for (std::string line; std::getline(lines, line);) {
    if (line.ends_with(" re")) {
      std::istringstream numbers(line);
      numbers >> last.left >> last.bottom >> last.width >> last.height;
      for (double* v : {&last.left, &last.bottom, &last.width, &last.height}) *v /= pt_per_m;
    } else if (line == "f") {
      black.push_back(last);
    }
  }
  return black;
}

/// A reader of the subset that the writer uses.
std::vector<Page> read_pdf(const std::string& file) {
  check_table(file);
  std::vector<Page> pages;
  const std::regex box(R"(MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \])"), stream(R"(>>\r?\nstream\r?\n)");
  for (std::sregex_iterator it(file.begin(), file.end(), box), end; it != end; ++it) {
    pages.push_back({std::stod((*it)[1]), std::stod((*it)[2]), {}});
  }
  std::size_t page = 0;
  for (std::sregex_iterator it(file.begin(), file.end(), stream), end; it != end; ++it, ++page) {
    const auto at = static_cast<std::size_t>(it->position() + it->length());
    pages.at(page).black = filled_rectangles(file.substr(at, file.find("endstream", at) - at));
  }
  EXPECT_EQ(page, pages.size());
  return pages;
}

TEST(MatPdf, OnePageHoldsTheMatAtItsTrueSize) {
  const MatDesign design{};
  const auto pages = read_pdf(*mat_pdf(design, "one"));
  ASSERT_EQ(pages.size(), 1u);
  EXPECT_NEAR(pages[0].width_pt / pt_per_m, 0.6 + 2 * 0.012, 1e-4);
  EXPECT_EQ(pages[0].black.size(), black_rectangles(design).size());
  // What is on the page is found by the finder: azimuth 0 is to the right, counter-clockwise.
  std::vector<MatRectangle> black = pages[0].black;
  for (MatRectangle& r : black) {
    r.left -= 0.012 + 0.3;
    r.bottom -= 0.012 + 0.3;
  }
  const cv::Mat page = test::printed_mat(black, design.size_m, 0.0005);
  const Camera camera = Camera::from_fov(640, 480, 50);
  MatFinder finder(design);
  finder.set_focal_px(Modality::visible, camera.fx);
  const auto found =
      finder.find(test::view_of_mat(page, design.size_m, camera, test::orbit_pose(40, 45, 1)),
                  Modality::visible);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->position.azimuth_deg, 40, 0.5);
  EXPECT_NEAR(found->position.elevation_deg, 45, 1);
}

TEST(MatPdf, TilesCoverTheMatOnce) {
  MatDesign design{};
  const auto pages = read_pdf(*mat_pdf(design, "A4"));
  EXPECT_EQ(pages.size(), 4u * 3u);  // 0.6 m over 186 x 273 mm
  for (const Page& page : pages) EXPECT_NEAR(page.width_pt, 595.2756, 1e-3);
  // Area of black: tiles overlap nowhere once each is cut at its clip.
  double whole = 0, tiled = 0;
  for (const MatRectangle& r : black_rectangles(design)) whole += r.width * r.height;
  for (std::size_t i = 0; i < pages.size(); ++i) {
    for (const MatRectangle& r : pages[i].black) {
      const double x0 = std::max(r.left, 0.012), x1 = std::min(r.left + r.width, 0.198);
      const double y0 = std::max(r.bottom, 0.012), y1 = std::min(r.bottom + r.height, 0.285);
      tiled += std::max(0.0, x1 - x0) * std::max(0.0, y1 - y0);
    }
  }
  EXPECT_NEAR(tiled / whole, 1, 1e-4);
}

TEST(MatPdf, MatBeyondTheLargestPageComesOnSeveral) {
  MatDesign design{};
  design.size_m = 8;
  const auto pages = read_pdf(*mat_pdf(design, "one"));
  EXPECT_EQ(pages.size(), 4u);
  for (const Page& page : pages) EXPECT_LE(page.width_pt, 14400);
}

TEST(MatPdf, FoilVersionIsInvertedWithAPaintedBorder) {
  const MatDesign foil = MatDesign::for_thermal(0.6), paper = [] {
    MatDesign d = MatDesign::for_thermal(0.6);
    d.thermal = false;
    return d;
  }();
  double inverted = 0, normal = 0;
  for (const MatRectangle& r : black_rectangles(foil)) inverted += r.width * r.height;
  for (const MatRectangle& r : black_rectangles(paper)) normal += r.width * r.height;
  EXPECT_NEAR(inverted + normal, 0.36, 1e-9);  // what one leaves white the other paints
}

TEST(MatPdf, NonsenseIsRefused) {
  EXPECT_EQ(mat_pdf({}, "A7").error().where, "mat.paper");
  MatDesign design;
  design.size_m = 19;
  EXPECT_FALSE(mat_pdf(design, "A4"));
  design.size_m = std::nan("");
  EXPECT_EQ(mat_pdf(design, "one").error().where, "mat.size_m");
  design = {};
  design.tags_per_side = 16;
  EXPECT_EQ(design.validate().error().where, "mat.tags_per_side");
  design = {};
  design.tag_share = 1;
  EXPECT_EQ(design.validate().error().where, "mat.tag_share");
}

}  // namespace
}  // namespace orbitfuse
