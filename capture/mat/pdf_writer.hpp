// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace orbitfuse {

/// A page of black rectangles, thin lines and short texts; all lengths in millimetres from the
/// page's lower left corner. Vector graphics, so that edges are as sharp as the printer.
class PdfPage {
 public:
  PdfPage(double width_mm, double height_mm) : width_mm_(width_mm), height_mm_(height_mm) {}

  void rectangle(double x, double y, double width, double height);
  void line(double x0, double y0, double x1, double y1);
  /// ASCII only; other bytes become '?'.
  void text(double x, double y, double size_mm, const std::string& words);
  /// Until the end of the page nothing is drawn outside this rectangle.
  void clip(double x, double y, double width, double height);
  void end_clip();

  double width_mm() const { return width_mm_; }
  double height_mm() const { return height_mm_; }
  const std::string& content() const { return content_; }

 private:
  double width_mm_, height_mm_;
  std::string content_;
};

/// PDF 1.4 (ISO 32000 subset): catalog, pages, one uncompressed content stream each, Helvetica.
std::string pdf_file(const std::vector<PdfPage>& pages, const std::string& title);

}  // namespace orbitfuse
