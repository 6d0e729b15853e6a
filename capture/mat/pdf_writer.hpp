// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <hpdf.h>

#include <memory>
#include <string>
#include <type_traits>

#include "core/result.hpp"

namespace orbitfuse {

/// A page of black rectangles, thin lines and short texts; all lengths in millimetres from the
/// page's lower left corner. Vector graphics, so that edges are as sharp as the printer.
class PdfPage {
 public:
  void rectangle(double x, double y, double width, double height);
  void line(double x0, double y0, double x1, double y1);
  /// ASCII only; other bytes become '?'.
  void text(double x, double y, double size_mm, const std::string& words);
  /// Until the end of the clip nothing is drawn outside this rectangle.
  void clip(double x, double y, double width, double height);
  void end_clip();

  double width_mm() const { return width_mm_; }
  double height_mm() const { return height_mm_; }

 private:
  friend class PdfWriter;
  HPDF_Page page_ = nullptr;  ///< both belong to the writer
  HPDF_Font font_ = nullptr;
  double width_mm_ = 0, height_mm_ = 0;
};

/// A PDF document in memory, by libHaru. Its first failure is what bytes() answers with.
class PdfWriter {
 public:
  explicit PdfWriter(const std::string& title);
  /// At most largest_page_mm a side; the page is good until the writer is gone.
  PdfPage add_page(double width_mm, double height_mm);
  /// The whole file.
  Result<std::string> bytes();

  static constexpr double largest_page_mm = 14400 * 25.4 / 72;  ///< PDF 1.4, Annex C: 200 inches

 private:
  struct Free {
    void operator()(HPDF_Doc document) const { HPDF_Free(document); }
  };
  std::unique_ptr<std::remove_pointer_t<HPDF_Doc>, Free> document_;
};

}  // namespace orbitfuse
