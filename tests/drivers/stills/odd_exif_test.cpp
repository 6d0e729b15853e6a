// SPDX-License-Identifier: BSD-3-Clause
// Numbers in EXIF that no camera, lens or clock can mean: they are as if they were not there.
#include <gtest/gtest.h>

#include "core/image/exif.hpp"
#include "tests/support/made_files.hpp"

namespace orbitfuse {
namespace {

constexpr std::int64_t second_ns = 1'000'000'000;
constexpr std::int64_t taken_ns = 1'714'979'289 * second_ns;  // of made::exif_block()

std::string with(const std::string& from, const std::string& to) {
  std::string block = made::exif_block(1);
  block.replace(block.find(from), from.size(), to);
  return block;
}

/// With the offset of its time in place of the focal length.
ExifInfo of_offset(const std::string& offset) {
  using namespace std::string_literals;
  std::string block = with("\x0a\x92\x05\0\x01\0\0\0"s, "\x11\x90\x02\0\x07\0\0\0"s);
  block.replace(100, 7, offset + '\0');
  return read_exif(block);
}

TEST(OddExif, OffsetsThatNoPlaceHasAreNone) {
  EXPECT_EQ(of_offset("+02:00").taken_ns, taken_ns - 7200 * second_ns);
  EXPECT_EQ(of_offset("-03:30").taken_ns, taken_ns + 12600 * second_ns);
  EXPECT_EQ(of_offset("+14:00").taken_ns, taken_ns - 50400 * second_ns);
  EXPECT_TRUE(of_offset("+00:00").taken_has_offset);
  for (const char* odd : {"+99:99", "-15:00", "+02:60", "hello!", "   :  ", "+-2:00", "2:00  "}) {
    EXPECT_EQ(of_offset(odd).taken_ns, taken_ns) << odd;
    EXPECT_FALSE(of_offset(odd).taken_has_offset) << odd;
  }
}

TEST(OddExif, TimesThatASessionCannotHoldAreNone) {
  EXPECT_EQ(read_exif(made::exif_block(1)).taken_ns, taken_ns);
  for (const char* odd : {"2199:01:01 00:00:00", "9999:12:31 23:59:59", "0000:00:00 00:00:00",
                          "2024:02:30 07:08:09", "2024:05:06 -7:08:09", "2024:05:06 07:08:61"})
    EXPECT_FALSE(read_exif(with("2024:05:06 07:08:09", odd)).taken_ns) << odd;
}

TEST(OddExif, FocalLengthsOfNoLensAreNone) {
  using namespace std::string_literals;
  const auto of = [](int focal_35mm) {
    const std::string number{static_cast<char>(focal_35mm), static_cast<char>(focal_35mm >> 8)};
    return read_exif(with("\x05\xa4\x03\0\x01\0\0\0\x1a\0"s, "\x05\xa4\x03\0\x01\0\0\0"s + number))
        .focal_35mm;
  };
  EXPECT_EQ(of(26), 26);
  EXPECT_EQ(of(2000), 2000);
  for (const int odd : {0, 1, 65535}) EXPECT_FALSE(of(odd)) << odd;
}

TEST(OddExif, OrientationsThatAreNoneAreUpright) {
  for (const int odd : {0, 9, 255}) EXPECT_EQ(read_exif(made::exif_block(odd)).orientation, 1);
  EXPECT_EQ(read_exif(made::exif_block(6)).orientation, 6);
}

}  // namespace
}  // namespace orbitfuse
