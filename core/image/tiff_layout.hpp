// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tiffio.h>

#include <cstdint>
#include <optional>
#include <string>

// What the tags of a TIFF's page say of its samples.
namespace orbitfuse {

struct TiffLayout {
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 1, channels = 1, format = SAMPLEFORMAT_UINT, planar = PLANARCONFIG_CONTIG;
  std::uint16_t photometric = PHOTOMETRIC_MINISBLACK, compression = COMPRESSION_NONE;
};

TiffLayout layout_of(TIFF* tiff);
/// Same size and samples: of one camera.
bool alike(const TiffLayout& a, const TiffLayout& b);
/// OpenCV's; nothing for samples that are not read.
std::optional<int> depth_of(const TiffLayout& layout);
/// Why such samples can't be read; empty where they can.
std::string unread_layout(const TiffLayout& layout);

/// A mask, or a reduced copy of another image.
bool is_copy(TIFF* tiff);
/// Whether the last channel says how much can be seen through; others may be infrared, or anything.
bool has_alpha(TIFF* tiff);
/// The page's own samples lie where its tags say, as far as a file can tell: none in its header.
/// Else what is wrong.
std::string misplaced_samples(TIFF* tiff);
/// What the samples mean: the ImageDescription, or GDAL's scale in the words of our own tag.
std::string description_of(TIFF* tiff);

}  // namespace orbitfuse
