// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "core/progress.hpp"
#include "core/result.hpp"

namespace orbitfuse::inspection {

/// The browser that prints: chromium, or another of its family, on PATH. Unavailable: none; the
/// remedy says how to get a PDF all the same.
Result<std::string> find_browser();

/// Prints a page of this machine as a PDF by headless Chromium, without network. The file is there
/// whole or not at all. Errors: unavailable (no browser, or it doesn't print), device, cancelled.
Status print_pdf(const std::filesystem::path& html, const std::filesystem::path& pdf,
                 const Progress& progress);

}  // namespace orbitfuse::inspection
