// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/sfm/colmap_database.hpp"

#include <fmt/format.h>
#include <sqlite3.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

constexpr int sift_bytes = 128;

/// A statement and what it is given; freed with it.
using Statement = std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)>;

class Database {
 public:
  static Result<Database> open(const fs::path& path, int flags) {
    sqlite3* handle = nullptr;
    const int status = sqlite3_open_v2(path.c_str(), &handle, flags, nullptr);
    Database database(handle, path);
    if (status == SQLITE_OK) return database;
    return fail(ErrorKind::input, path.string(), "no COLMAP database",
                "COLMAP wrote none: see whether it runs by hand (colmap feature_importer -h)");
  }

  /// Calls `row` for each row of the answer.
  Status query(const char* sql, const std::function<void(sqlite3_stmt*)>& row) const {
    return run(
        sql, [](sqlite3_stmt*) {}, row);
  }

  /// A row of a table of features, by the image's name, where there is one.
  Status set_rows(const char* table, const std::string& name, std::size_t rows, int cols,
                  const void* data, std::size_t bytes) const {
    const std::string sql = fmt::format(
        "UPDATE {} SET rows = ?, cols = ?, data = ? "
        "WHERE image_id = (SELECT image_id FROM images WHERE name = ?)",
        table);
    const auto bind = [&](sqlite3_stmt* statement) {
      sqlite3_bind_int64(statement, 1, static_cast<sqlite3_int64>(rows));
      sqlite3_bind_int(statement, 2, cols);
      sqlite3_bind_blob64(statement, 3, data, bytes, SQLITE_STATIC);
      sqlite3_bind_text(statement, 4, name.c_str(), -1, SQLITE_STATIC);
    };
    return run(sql.c_str(), bind, [](sqlite3_stmt*) {});
  }

  Result<double> number(const char* sql) const {
    double value = 0;
    ORBITFUSE_TRY(query(sql, [&](sqlite3_stmt* row) { value = sqlite3_column_double(row, 0); }));
    return value;
  }

 private:
  Database(sqlite3* handle, fs::path path)
      : handle_(handle, sqlite3_close), path_(std::move(path)) {}

  Status run(const char* sql, const std::function<void(sqlite3_stmt*)>& bind,
             const std::function<void(sqlite3_stmt*)>& row) const {
    sqlite3_stmt* prepared = nullptr;
    int status = sqlite3_prepare_v2(handle_.get(), sql, -1, &prepared, nullptr);
    const Statement statement(prepared, sqlite3_finalize);
    if (status == SQLITE_OK) {
      bind(prepared);
      while ((status = sqlite3_step(prepared)) == SQLITE_ROW) row(prepared);
    }
    if (status == SQLITE_DONE) return {};
    if (status == SQLITE_IOERR || status == SQLITE_FULL || status == SQLITE_READONLY)
      return fail(ErrorKind::device, path_.string(), sqlite3_errmsg(handle_.get()),
                  "see that the disk works, has room and may be written to (and the limit of a "
                  "file's size, ulimit -f), and run again");
    return fail(ErrorKind::input, path_.string(),
                fmt::format("not a COLMAP database ({})", sqlite3_errmsg(handle_.get())),
                "delete it and run the pose stage again");
  }

  std::unique_ptr<sqlite3, int (*)(sqlite3*)> handle_;
  fs::path path_;
};

}  // namespace

Result<DatabaseCounts> count_database(const fs::path& path) {
  ORBITFUSE_ASSIGN(const Database database, Database::open(path, SQLITE_OPEN_READONLY));
  const auto number = [&](const char* sql) { return database.number(sql); };
  DatabaseCounts counts;
  ORBITFUSE_ASSIGN(const double images, number("SELECT COUNT(*) FROM images"));
  ORBITFUSE_ASSIGN(const double featured, number("SELECT COUNT(*) FROM keypoints WHERE rows > 0"));
  ORBITFUSE_ASSIGN(const double features, number("SELECT TOTAL(rows) FROM keypoints"));
  ORBITFUSE_ASSIGN(const double tried, number("SELECT COUNT(*) FROM matches"));
  ORBITFUSE_ASSIGN(const double verified,
                   number("SELECT COUNT(*) FROM two_view_geometries WHERE rows > 0"));
  counts.images = static_cast<int>(images);
  counts.images_with_features = static_cast<int>(featured);
  counts.mean_features = features / std::max(counts.images, 1);
  counts.matched_pairs = static_cast<int>(tried);
  counts.verified_pairs = static_cast<int>(verified);
  return counts;
}

Status number_images_by_name(const fs::path& path) {
  ORBITFUSE_ASSIGN(const Database database, Database::open(path, SQLITE_OPEN_READWRITE));
  // By way of numbers that no image has, because the tables allow none twice.
  const std::string ranks =
      "CREATE TEMP TABLE ranks AS SELECT image_id AS old, "
      "ROW_NUMBER() OVER (ORDER BY name) AS new FROM images";
  const auto execute = [&](const std::string& sql) {
    return database.query(sql.c_str(), [](sqlite3_stmt*) {});
  };
  ORBITFUSE_TRY(execute("BEGIN"));
  ORBITFUSE_TRY(execute(ranks));
  for (const char* table : {"images", "keypoints", "descriptors"}) {
    ORBITFUSE_TRY(execute(fmt::format(
        "UPDATE {} SET image_id = 1000000000 + (SELECT new FROM ranks WHERE old = image_id)",
        table)));
    ORBITFUSE_TRY(execute(fmt::format("UPDATE {} SET image_id = image_id - 1000000000", table)));
  }
  return execute("COMMIT");
}

Status write_features(const fs::path& path, const std::map<std::string, SiftFeatures>& features) {
  ORBITFUSE_ASSIGN(const Database database, Database::open(path, SQLITE_OPEN_READWRITE));
  // COLMAP's keypoint: its place, and the matrix that takes the unit circle to its own.
  using Row = std::array<float, 6>;
  ORBITFUSE_TRY(database.query("BEGIN", [](sqlite3_stmt*) {}));
  for (const auto& [name, image] : features) {
    if (image.keypoints.empty()) continue;
    std::vector<Row> rows;
    for (const SiftKeypoint& point : image.keypoints) {
      const float along = point.scale_px * std::cos(point.orientation_rad),
                  across = point.scale_px * std::sin(point.orientation_rad);
      rows.push_back({point.x, point.y, along, -across, across, along});
    }
    ORBITFUSE_TRY(database.set_rows("keypoints", name, rows.size(), 6, rows.data(),
                                    rows.size() * sizeof(Row)));
    ORBITFUSE_TRY(database.set_rows("descriptors", name, rows.size(), sift_bytes,
                                    image.descriptors.data(), rows.size() * sift_bytes));
  }
  return database.query("COMMIT", [](sqlite3_stmt*) {});
}

Result<std::map<std::string, Descriptors>> read_descriptors(const fs::path& path) {
  ORBITFUSE_ASSIGN(const Database database, Database::open(path, SQLITE_OPEN_READONLY));
  std::map<std::string, Descriptors> found;
  bool whole = true;
  ORBITFUSE_TRY(database.query(
      "SELECT images.name, descriptors.rows, descriptors.cols, descriptors.data FROM images "
      "LEFT JOIN descriptors ON descriptors.image_id = images.image_id",
      [&](sqlite3_stmt* row) {
        const auto* name = reinterpret_cast<const char*>(sqlite3_column_text(row, 0));
        const Eigen::Index rows = sqlite3_column_int(row, 1);
        Descriptors& descriptors = found[name != nullptr ? name : ""];
        // A product with a matrix of no columns would not be defined.
        descriptors.resize(0, sift_bytes);
        if (rows <= 0) return;
        whole = whole && sqlite3_column_int(row, 2) == sift_bytes &&
                sqlite3_column_bytes(row, 3) == rows * sift_bytes;
        if (!whole) return;
        using Bytes = Eigen::Matrix<std::uint8_t, Eigen::Dynamic, sift_bytes, Eigen::RowMajor>;
        const auto* bytes = static_cast<const std::uint8_t*>(sqlite3_column_blob(row, 3));
        descriptors = Eigen::Map<const Bytes>(bytes, rows, sift_bytes).cast<float>();
      }));
  if (whole) return found;
  return fail(ErrorKind::input, path.string(), "descriptors of another size than SIFT's 128 bytes",
              "delete it and run the pose stage again");
}

Result<std::map<std::string, Eigen::Matrix2Xd>> read_keypoints(const fs::path& path) {
  ORBITFUSE_ASSIGN(const Database database, Database::open(path, SQLITE_OPEN_READONLY));
  std::map<std::string, Eigen::Matrix2Xd> found;
  bool whole = true;
  ORBITFUSE_TRY(database.query(
      "SELECT images.name, keypoints.rows, keypoints.cols, keypoints.data FROM images "
      "LEFT JOIN keypoints ON keypoints.image_id = images.image_id",
      [&](sqlite3_stmt* row) {
        const auto* name = reinterpret_cast<const char*>(sqlite3_column_text(row, 0));
        const Eigen::Index rows = sqlite3_column_int(row, 1), cols = sqlite3_column_int(row, 2);
        Eigen::Matrix2Xd& pixels = found[name != nullptr ? name : ""];
        if (rows <= 0) return;
        whole = whole && cols >= 2 &&
                sqlite3_column_bytes(row, 3) == rows * cols * static_cast<int>(sizeof(float));
        if (!whole) return;
        using Table = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
        const auto* values = static_cast<const float*>(sqlite3_column_blob(row, 3));
        pixels = Eigen::Map<const Table>(values, rows, cols).leftCols(2).transpose().cast<double>();
      }));
  if (whole) return found;
  return fail(ErrorKind::input, path.string(), "keypoints of another size than it states",
              "delete it and run the pose stage again");
}

Result<NamedMatches> read_matches(const fs::path& path, MatchKind kind) {
  ORBITFUSE_ASSIGN(const Database database, Database::open(path, SQLITE_OPEN_READONLY));
  NamedMatches found;
  bool whole = true;
  // COLMAP's number of a pair: the lower image's times 2^31 - 1, plus the other's.
  const std::string sql = fmt::format(
      "SELECT a.name, b.name, m.rows, m.data FROM {} m "
      "JOIN images a ON a.image_id = m.pair_id / 2147483647 "
      "JOIN images b ON b.image_id = m.pair_id % 2147483647 WHERE m.rows > 0",
      kind == MatchKind::proposed ? "matches" : "two_view_geometries");
  ORBITFUSE_TRY(database.query(sql.c_str(), [&](sqlite3_stmt* row) {
    std::string first = reinterpret_cast<const char*>(sqlite3_column_text(row, 0)),
                second = reinterpret_cast<const char*>(sqlite3_column_text(row, 1));
    const int rows = sqlite3_column_int(row, 2);
    whole =
        whole && sqlite3_column_bytes(row, 3) == rows * 2 * static_cast<int>(sizeof(std::uint32_t));
    if (!whole) return;
    const auto* data = static_cast<const std::uint32_t*>(sqlite3_column_blob(row, 3));
    const bool in_order = first < second;
    if (!in_order) std::swap(first, second);
    std::vector<FeatureMatch>& matches = found[{first, second}];
    for (int i = 0; i < rows; ++i) {
      const auto a = static_cast<int>(data[2 * i]), b = static_cast<int>(data[2 * i + 1]);
      matches.emplace_back(in_order ? a : b, in_order ? b : a);
    }
  }));
  if (whole) return found;
  return fail(ErrorKind::input, path.string(), "matches of another size than it states",
              "delete it and run the pose stage again");
}

}  // namespace orbitfuse
