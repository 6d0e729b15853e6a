// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tiffio.h>

#include <memory>
#include <string>
#include <string_view>

namespace orbitfuse {

/// A TIFF in memory; libtiff reads and writes it through callbacks.
struct TiffMemory {
  std::string_view input;
  std::string output;
  bool writing = false;
  bool tag_is_cut = false;  ///< a tag's value lies beyond the end of the file
  toff_t position = 0;

  toff_t size() const { return writing ? output.size() : input.size(); }
};

using TiffHandle = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

/// Null where it can't be read. Nothing is printed.
TiffHandle open_tiff(TiffMemory& file);
/// To be written into the memory's output.
TiffHandle create_tiff(TiffMemory& file);

}  // namespace orbitfuse
