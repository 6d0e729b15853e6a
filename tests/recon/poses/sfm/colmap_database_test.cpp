// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/colmap_database.hpp"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <fstream>

#include "tests/support/file_size_limit.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {

/// The tables of COLMAP's that are read here, with images numbered against their names' order.
void make_database(const std::filesystem::path& path, int cols = 128) {
  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &handle), SQLITE_OK);
  const std::string sql =
      "CREATE TABLE images (image_id INTEGER PRIMARY KEY, name TEXT UNIQUE);"
      "CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data "
      "BLOB);"
      "CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data "
      "BLOB);"
      "CREATE TABLE matches (pair_id INTEGER PRIMARY KEY, rows INTEGER);"
      "CREATE TABLE two_view_geometries (pair_id INTEGER PRIMARY KEY, rows INTEGER);"
      "INSERT INTO images VALUES (1, 'c.png'), (2, 'a.png'), (3, 'b.png');"
      "INSERT INTO keypoints VALUES (1, 1, 2, ''), (2, 2, 2, ''), (3, 0, 2, '');"
      "INSERT INTO descriptors VALUES (1, 1, " +
      std::to_string(cols) + ", CAST(printf('%.*c', " + std::to_string(cols) + ", 'A') AS BLOB));";
  ASSERT_EQ(sqlite3_exec(handle, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
      << sqlite3_errmsg(handle);
  sqlite3_close(handle);
}

TEST(ColmapDatabase, ImagesAreNumberedByNameAndKeepTheirFeatures) {
  const test::TempFolder folder;
  make_database(folder / "db");
  ASSERT_TRUE(number_images_by_name(folder / "db"));
  const auto counts = count_database(folder / "db");
  ASSERT_TRUE(counts);
  EXPECT_EQ(counts->images, 3);
  EXPECT_EQ(counts->images_with_features, 2);
  EXPECT_DOUBLE_EQ(counts->mean_features, 1);
  const auto descriptors = read_descriptors(folder / "db");
  ASSERT_TRUE(descriptors) << descriptors.error().message();
  EXPECT_EQ(descriptors->size(), 3u);
  EXPECT_EQ(descriptors->at("a.png").rows(), 0);
  ASSERT_EQ(descriptors->at("c.png").rows(), 1);
  EXPECT_EQ(descriptors->at("c.png")(0, 127), 'A');

  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open((folder / "db").c_str(), &handle), SQLITE_OK);
  std::string order;
  sqlite3_exec(
      handle, "SELECT name FROM images ORDER BY image_id",
      [](void* text, int, char** columns, char**) {
        *static_cast<std::string*>(text) += columns[0];
        return 0;
      },
      &order, nullptr);
  sqlite3_close(handle);
  EXPECT_EQ(order, "a.pngb.pngc.png");
}

TEST(ColmapDatabase, FeaturesAreWrittenForTheImagesThatItHas) {
  const test::TempFolder folder;
  make_database(folder / "db");
  SiftFeatures found;
  found.keypoints = {{1.5F, 2.5F, 3.0F, 0.5F}, {8.0F, 9.0F, 1.0F, 0.0F}};
  found.descriptors.resize(2, 128);
  found.descriptors.row(0).setConstant(7);
  found.descriptors.row(1).setConstant(9);
  // COLMAP could not read "z.png"; nothing was found in "b.png".
  const Status written = write_features(
      folder / "db", {{"a.png", found}, {"c.png", found}, {"z.png", found}, {"b.png", {}}});
  ASSERT_TRUE(written) << written.error().message();
  const auto descriptors = read_descriptors(folder / "db");
  const auto keypoints = read_keypoints(folder / "db");
  ASSERT_TRUE(descriptors && keypoints);
  EXPECT_EQ(descriptors->size(), 3u);
  EXPECT_EQ(descriptors->at("c.png"), found.descriptors.cast<float>());
  EXPECT_EQ(keypoints->at("c.png"), (Eigen::Matrix2d() << 1.5, 8, 2.5, 9).finished());
  EXPECT_EQ(descriptors->at("b.png").rows(), 0);
  EXPECT_EQ(keypoints->at("a.png"), keypoints->at("c.png"));
  std::ofstream(folder / "other") << "no database";
  EXPECT_FALSE(write_features(folder / "other", {{"c.png", found}}));
}

TEST(ColmapDatabase, ADiskThatTakesNoMoreIsNoForeignFile) {
  const test::TempFolder folder;
  make_database(folder / "db");
  SiftFeatures many;
  many.keypoints.resize(5000, {1.5F, 2.5F, 3.0F, 0.5F});
  many.descriptors.setZero(5000, 128);
  const Status written = [&] {
    const test::FileSizeLimit full(100'000);
    return write_features(folder / "db", {{"a.png", many}});
  }();
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, ErrorKind::device) << written.error().message();
}

TEST(ColmapDatabase, OtherFilesAreNamed) {
  const test::TempFolder folder;
  test::put(folder / "text",
            "this is a text file, long enough to be taken for a header of a database");
  for (const auto& failed :
       {number_images_by_name(folder / "text"), number_images_by_name(folder / "none")}) {
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().kind, ErrorKind::input);
  }
  EXPECT_FALSE(count_database(folder / "text"));
  EXPECT_FALSE(read_descriptors(folder / "text"));
  make_database(folder / "short", 64);
  const auto cut = read_descriptors(folder / "short");
  ASSERT_FALSE(cut);
  EXPECT_NE(cut.error().found.find("128"), std::string::npos);
}

}  // namespace
}  // namespace orbitfuse
