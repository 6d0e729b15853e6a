// SPDX-License-Identifier: BSD-3-Clause
#include "capture/mat/pdf_writer.hpp"

#include <fmt/format.h>

namespace orbitfuse {
namespace {

HPDF_REAL pt(double mm) { return static_cast<HPDF_REAL>(mm * 72 / 25.4); }

std::string ascii(std::string words) {
  for (char& c : words) {
    if (c < ' ' || c > '~') c = '?';
  }
  return words;
}

}  // namespace

void PdfPage::rectangle(double x, double y, double width, double height) {
  HPDF_Page_Rectangle(page_, pt(x), pt(y), pt(width), pt(height));
  HPDF_Page_Fill(page_);
}

void PdfPage::line(double x0, double y0, double x1, double y1) {
  HPDF_Page_SetLineWidth(page_, 0.3F);
  HPDF_Page_MoveTo(page_, pt(x0), pt(y0));
  HPDF_Page_LineTo(page_, pt(x1), pt(y1));
  HPDF_Page_Stroke(page_);
}

void PdfPage::text(double x, double y, double size_mm, const std::string& words) {
  HPDF_Page_BeginText(page_);
  HPDF_Page_SetFontAndSize(page_, font_, pt(size_mm));
  HPDF_Page_TextOut(page_, pt(x), pt(y), ascii(words).c_str());
  HPDF_Page_EndText(page_);
}

void PdfPage::clip(double x, double y, double width, double height) {
  HPDF_Page_GSave(page_);
  HPDF_Page_Rectangle(page_, pt(x), pt(y), pt(width), pt(height));
  HPDF_Page_Clip(page_);
  HPDF_Page_EndPath(page_);
}

void PdfPage::end_clip() { HPDF_Page_GRestore(page_); }

// Without a handler libHaru remembers its first error and does nothing from there on.
PdfWriter::PdfWriter(const std::string& title) : document_(HPDF_New(nullptr, nullptr)) {
  HPDF_SetInfoAttr(document_.get(), HPDF_INFO_TITLE, ascii(title).c_str());
  HPDF_SetInfoAttr(document_.get(), HPDF_INFO_CREATOR, "OrbitFuse");
  // Readers that scale pages to the paper would make every distance on the mat wrong.
  HPDF_SetViewerPreference(document_.get(), HPDF_PRINT_SCALING_NONE);
}

PdfPage PdfWriter::add_page(double width_mm, double height_mm) {
  PdfPage page;
  page.width_mm_ = width_mm;
  page.height_mm_ = height_mm;
  page.page_ = HPDF_AddPage(document_.get());
  page.font_ = HPDF_GetFont(document_.get(), "Helvetica", nullptr);
  HPDF_Page_SetWidth(page.page_, pt(width_mm));
  HPDF_Page_SetHeight(page.page_, pt(height_mm));
  return page;
}

Result<std::string> PdfWriter::bytes() {
  const auto failed = [this] {
    return fail(ErrorKind::device, "mat PDF",
                fmt::format("libHaru error {:#x}",
                            document_ ? HPDF_GetError(document_.get()) : HPDF_FAILD_TO_ALLOC_MEM),
                "try a smaller mat, and report the number");
  };
  if (!document_ || HPDF_SaveToStream(document_.get()) != HPDF_OK) return failed();
  std::string file(HPDF_GetStreamSize(document_.get()), '\0');
  HPDF_ResetStream(document_.get());
  auto size = static_cast<HPDF_UINT32>(file.size());
  HPDF_ReadFromStream(document_.get(), reinterpret_cast<HPDF_BYTE*>(file.data()), &size);
  if (size != file.size()) return failed();
  return file;
}

}  // namespace orbitfuse
