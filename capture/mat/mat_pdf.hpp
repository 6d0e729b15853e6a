// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "capture/mat/mat_design.hpp"

namespace orbitfuse {

/// "A4", "A3", "A1": tiles of that paper to glue together; "one": a single page for a plotter, or
/// as few as hold the mat where it is larger than the 5 m that a PDF page may have.
Status check_paper(const std::string& paper);

/// The mat at its true size, with cutting marks, tile numbers, a 100 mm ruler that shows whether
/// the printer scaled it, and the direction of azimuth 0. Usage error for an unknown paper or when
/// more than 400 tiles would be needed; device error when the library that writes PDF fails.
Result<std::string> mat_pdf(const MatDesign& design, const std::string& paper);

}  // namespace orbitfuse
