// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "app/view/finished_run.hpp"

namespace orbitfuse::view {

/// A recorded photo as PictureParts ("visible" or "thermal"), without the lens's distortion, so
/// that it lies over a render from its pose; a thermal one without the shading of its lens, which
/// the field is without; at most 1280 pixels wide. Input error: no such view,
/// the session is not there, a file that the session doesn't list or that cannot be read.
Result<std::string> photo(const FinishedRun& run, std::size_t index);

}  // namespace orbitfuse::view
