// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "app/view/bookmarks.hpp"
#include "app/view/layers.hpp"

namespace orbitfuse::view {

enum class FilmKind { mp4, pictures };
enum class FilmLayer { visible, thermal, fused };

struct FilmOrder {
  FilmKind kind = FilmKind::mp4;
  FilmLayer layer = FilmLayer::fused;
  std::string palette = "inferno";  ///< of thermal pictures
  TemperatureSpan span;             ///< likewise
  double seconds_a_view = 3;        ///< from one bookmark to the next
  int fps = 12;
  int width = 640, height = 480;

  Status validate() const;
};

/// Usage error naming the field.
Result<FilmOrder> film_order_of(const nlohmann::json& j, const FinishedRun& run);

/// The camera's way along bookmarks, at rest at each: round what it looks at, at a distance that
/// changes evenly, rather than straight through the object. Two or more bookmarks.
std::vector<Bookmark> way_along(const std::vector<Bookmark>& bookmarks, int frames_a_view);

/// The camera of a bookmark, level with `up` where it doesn't look along it.
Shot shot_of_bookmark(const Bookmark& bookmark, const Eigen::Vector3d& up, int width, int height);

/// Makes one film at a time, beside the viewers' pictures, into OUT/films/: NNN.mp4, or NNN/ with
/// one PNG a picture. What is not finished is not left there.
class FilmMaker {
 public:
  /// All must outlive it.
  FilmMaker(const FinishedRun& run, LayerRenderer& layers, RenderTurns& turns)
      : run_(run), layers_(layers), turns_(turns) {}
  ~FilmMaker() { stop(); }

  /// Usage error: fewer than two bookmarks, one is being made.
  Status begin(const FilmOrder& order, const std::vector<Bookmark>& bookmarks);
  /// Returns when nothing is being made any more.
  void stop();
  /// {"making", "done", "total", "file" (when finished), "error"}.
  nlohmann::json state() const;

 private:
  Result<std::filesystem::path> make(const FilmOrder& order, const std::vector<Bookmark>& way);
  Result<std::filesystem::path> made(const FilmOrder& order, const std::vector<Bookmark>& way);
  Result<cv::Mat> picture(const FilmOrder& order, const Bookmark& from) const;

  const FinishedRun& run_;
  LayerRenderer& layers_;
  RenderTurns& turns_;
  std::atomic<bool> over_{false};
  mutable std::mutex mutex_;
  bool making_ = false;
  std::size_t done_ = 0, total_ = 0;
  std::string file_, error_;
  std::thread worker_;
};

}  // namespace orbitfuse::view
