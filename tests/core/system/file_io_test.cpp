// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/file_io.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/support/file_size_limit.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

using test::FileSizeLimit;
using test::TempFolder;

TEST(FileIo, WritesAndReadsBack) {
  const TempFolder folder;
  const std::string bytes("a\0b\nc", 5);
  ASSERT_TRUE(write_file_atomic(folder / "x/y/z.bin", bytes));
  EXPECT_EQ(*read_file(folder / "x/y/z.bin"), bytes);
  EXPECT_EQ(*file_hash(folder / "x/y/z.bin"), content_hash(bytes));
  EXPECT_NE(content_hash(bytes), content_hash("other"));
  EXPECT_EQ(content_hash("").size(), 32u);
}

TEST(FileIo, MissingFileAndFolderAreNamed) {
  const TempFolder folder;
  const auto missing = read_file(folder / "none.txt");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, ErrorKind::input);
  EXPECT_NE(missing.error().message().find("none.txt"), std::string::npos);
  EXPECT_FALSE(read_file(folder.path()));
}

TEST(FileIo, AFileThatMayNotBeReadIsNoWrongPath) {
  if (::geteuid() == 0) GTEST_SKIP() << "root reads everything";
  const TempFolder folder;
  test::put(folder / "mine.txt", "x");
  ASSERT_EQ(::chmod((folder / "mine.txt").c_str(), 0), 0);
  const auto bytes = read_file(folder / "mine.txt");
  ASSERT_FALSE(bytes);
  EXPECT_EQ(bytes.error().remedy, "check its permissions");
}

TEST(FileIo, OnlyRegularFilesOfABoundedSizeAreRead) {
  const TempFolder folder;
  const auto found = [](const std::filesystem::path& file, std::uint64_t at_most = max_file_bytes) {
    const auto bytes = read_file(file, at_most);
    return bytes ? "read" : bytes.error().found;
  };
  EXPECT_EQ(found("/dev/zero"), "a device, not a file");
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_EQ(found(folder / "pipe"), "a pipe, not a file");  // and not waited for
  EXPECT_EQ(found(folder.path()), "a folder, not a file");
  test::put(folder / "sparse", "");
  std::filesystem::resize_file(folder / "sparse", 8ull << 30);
  EXPECT_EQ(found(folder / "sparse"), "8192 MiB, at most 2048 MiB are read");
  test::put(folder / "text", std::string(2000, 'x'));
  EXPECT_EQ(found(folder / "text", 2000), "read");
  EXPECT_NE(found(folder / "text", 1999), "read");
  EXPECT_FALSE(file_hash("/dev/zero"));
  EXPECT_FALSE(file_hash(folder / "pipe"));
  EXPECT_EQ(found("/proc/self/status"), "read");  // reports a size of 0
}

TEST(FileIo, FullDiskKeepsTheOldFile) {
  const TempFolder folder;
  ASSERT_TRUE(write_file_atomic(folder / "a.txt", "old"));
  {
    const FileSizeLimit full(1000);
    const Status status = write_file_atomic(folder / "a.txt", std::string(5000, 'x'));
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().kind, ErrorKind::device);
    EXPECT_NE(status.error().message().find("free"), std::string::npos);
  }
  EXPECT_EQ(*read_file(folder / "a.txt"), "old");
  // Nothing half-written is left beside it.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(FileIo, TargetThatIsAFolderIsAnError) {
  const TempFolder folder;
  std::filesystem::create_directories(folder / "target/child");
  EXPECT_FALSE(write_file_atomic(folder / "target", "x"));
}

}  // namespace
}  // namespace orbitfuse
