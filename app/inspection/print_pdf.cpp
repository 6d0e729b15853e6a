// SPDX-License-Identifier: BSD-3-Clause
#include "app/inspection/print_pdf.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>

#include "core/system/file_io.hpp"
#include "core/system/process.hpp"
#include "core/system/scratch_folder.hpp"
#include "core/system/trace.hpp"

namespace orbitfuse::inspection {
namespace fs = std::filesystem;
namespace {

constexpr const char* instead =
    "open the HTML in any browser and print it to a file, or install chromium (Debian: apt-get "
    "install chromium) and call again";

/// A path as a URL: names may hold what means something else there.
std::string file_url(const fs::path& path) {
  std::string url = "file://";
  for (const char c : path.string()) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '/' || c == '-' || c == '_' || c == '.';
    url += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return url;
}

std::string last_line(const fs::path& log) {
  const auto text = read_file(log, max_settings_bytes);
  if (!text) return {};
  const std::size_t end = text->find_last_not_of("\n\r ");
  if (end == std::string::npos) return {};
  const std::size_t begin = text->rfind('\n', end);
  return ": " +
         text->substr(begin == std::string::npos ? 0 : begin + 1, end - begin).substr(0, 200);
}

}  // namespace

Result<std::string> find_browser() {
  const char* folders = std::getenv("PATH");
  for (const char* name : {"chromium", "chromium-browser", "google-chrome", "google-chrome-stable"})
    for (std::string_view rest = folders != nullptr ? folders : ""; !rest.empty();) {
      const std::size_t colon = rest.find(':');
      const fs::path file = fs::path(rest.substr(0, colon)) / name;
      if (file.is_absolute() && ::access(file.c_str(), X_OK) == 0) return file.string();
      rest = colon == std::string_view::npos ? "" : rest.substr(colon + 1);
    }
  return fail(ErrorKind::unavailable, "--pdf", "no chromium on PATH", instead);
}

Status print_pdf(const fs::path& html, const fs::path& pdf, const Progress& progress) {
  ORBITFUSE_ASSIGN(const std::string browser, find_browser());
  // The browser's profile, log and output.
  ORBITFUSE_ASSIGN(const ScratchFolder scratch, ScratchFolder::make());
  const fs::path printed = scratch.path() / "page.pdf", log = scratch.path() / "log";
  std::error_code unknown;
  const fs::path page = fs::absolute(html, unknown);
  // A browser that waits for a display or a lock would wait for ever.
  std::vector<std::string> command = {"timeout",
                                      "--kill-after=5",
                                      "180",
                                      browser,
                                      "--headless",
                                      "--disable-gpu",
                                      "--no-first-run",
                                      "--disable-background-networking",
                                      "--disable-dev-shm-usage",
                                      "--host-resolver-rules=MAP * ~NOTFOUND",
                                      "--no-pdf-header-footer",
                                      "--user-data-dir=" + (scratch.path() / "profile").string(),
                                      "--print-to-pdf=" + printed.string()};
  // Its sandbox refuses to start for root; the page is ours and has no script.
  if (::geteuid() == 0) command.emplace_back("--no-sandbox");
  command.push_back(file_url(page));
  const TraceSpan span("print pdf");
  ORBITFUSE_ASSIGN(const int status, run_process(command, log, "pdf", progress));
  const auto bytes = read_file(printed);
  if (status != 0 || !bytes || !bytes->starts_with("%PDF"))
    return fail(ErrorKind::unavailable, browser,
                fmt::format("printed no PDF (exit status {}{})", status, last_line(log)), instead);
  return write_file_atomic(pdf, *bytes);
}

}  // namespace orbitfuse::inspection
