// SPDX-License-Identifier: BSD-3-Clause
#include "capture/mat/pdf_writer.hpp"

#include <fmt/format.h>

namespace orbitfuse {
namespace {

double pt(double mm) { return mm * 72 / 25.4; }

std::string literal(const std::string& words) {
  std::string out = "(";
  for (const char c : words) {
    if (c == '(' || c == ')' || c == '\\') out += '\\';
    out += c >= ' ' && c <= '~' ? c : '?';
  }
  return out + ")";
}

}  // namespace

void PdfPage::rectangle(double x, double y, double width, double height) {
  content_ +=
      fmt::format("{:.4f} {:.4f} {:.4f} {:.4f} re f\n", pt(x), pt(y), pt(width), pt(height));
}

void PdfPage::line(double x0, double y0, double x1, double y1) {
  content_ +=
      fmt::format("0.3 w {:.4f} {:.4f} m {:.4f} {:.4f} l S\n", pt(x0), pt(y0), pt(x1), pt(y1));
}

void PdfPage::text(double x, double y, double size_mm, const std::string& words) {
  content_ += fmt::format("BT /F1 {:.2f} Tf {:.4f} {:.4f} Td {} Tj ET\n", pt(size_mm), pt(x), pt(y),
                          literal(words));
}

void PdfPage::clip(double x, double y, double width, double height) {
  content_ +=
      fmt::format("q {:.4f} {:.4f} {:.4f} {:.4f} re W n\n", pt(x), pt(y), pt(width), pt(height));
}

void PdfPage::end_clip() { content_ += "Q\n"; }

std::string pdf_file(const std::vector<PdfPage>& pages, const std::string& title) {
  // Objects: 1 catalog, 2 pages, 3 font, 4 info, then page and content in turn.
  std::vector<std::string> objects;
  std::string kids;
  for (std::size_t i = 0; i < pages.size(); ++i) kids += fmt::format("{} 0 R ", 5 + 2 * i);
  objects.push_back(
      "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>");
  objects.push_back(fmt::format("<< /Type /Pages /Kids [{}] /Count {} >>", kids, pages.size()));
  objects.push_back("<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>");
  objects.push_back(fmt::format("<< /Title {} /Creator (OrbitFuse) >>", literal(title)));
  for (std::size_t i = 0; i < pages.size(); ++i) {
    // UserUnit (PDF 1.6) would be needed beyond 200 inches; readers take larger pages all the same.
    objects.push_back(
        fmt::format("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.4f} {:.4f}] /Contents {} 0 R "
                    "/Resources << /Font << /F1 3 0 R >> >> >>",
                    pt(pages[i].width_mm()), pt(pages[i].height_mm()), 6 + 2 * i));
    objects.push_back(fmt::format("<< /Length {} >>\nstream\n{}endstream",
                                  pages[i].content().size(), pages[i].content()));
  }
  std::string file = "%PDF-1.4\n";
  std::string table = fmt::format("xref\n0 {}\n0000000000 65535 f \n", objects.size() + 1);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    table += fmt::format("{:010} 00000 n \n", file.size());
    file += fmt::format("{} 0 obj\n{}\nendobj\n", i + 1, objects[i]);
  }
  const std::size_t start = file.size();
  file +=
      table + fmt::format("trailer\n<< /Size {} /Root 1 0 R /Info 4 0 R >>\nstartxref\n{}\n%%EOF\n",
                          objects.size() + 1, start);
  return file;
}

}  // namespace orbitfuse
