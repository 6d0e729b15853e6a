// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/film.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <exception>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "app/view/request_fields.hpp"
#include "app/view/shot_request.hpp"
#include "core/image/image_io.hpp"
#include "core/option_range.hpp"
#include "core/system/folder_change_lock.hpp"
#include "fusion/heat/heat.hpp"

namespace orbitfuse::view {
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr std::size_t most_pictures = 5000;
/// A page's name is never empty (shot_request.cpp): none can end the film's jobs by its own.
constexpr const char* film_client = "";
constexpr std::chrono::milliseconds before_asking_again{100};

/// Great circle from a to b (unit length), t in 0..1; any way round for opposite directions.
Eigen::Vector3d between_directions(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double t) {
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(a, b);
  return Eigen::Quaterniond::Identity().slerp(t, turn) * a;
}

/// Where a film's pictures go until it is whole.
struct Unfinished {
  fs::path path;
  ~Unfinished() {
    std::error_code ignored;
    if (!path.empty()) fs::remove_all(path, ignored);
  }
};

fs::path free_name(const fs::path& folder, const std::string& extension) {
  std::error_code ignored;
  for (int n = 1;; ++n) {
    const std::string number = fmt::format("{:03}", n);
    if (!fs::exists(folder / number, ignored) && !fs::exists(folder / (number + ".mp4"), ignored))
      return folder / (number + extension);
  }
}

/// Under the next free name. Two viewers of one run may finish at once.
Result<fs::path> put_there(const fs::path& partial, const fs::path& folder,
                           const std::string& extension) {
  FolderChangeLock lock;
  ORBITFUSE_TRY(lock.acquire(folder));
  const fs::path finished = free_name(folder, extension);
  std::error_code error;
  fs::rename(partial, finished, error);
  if (error)
    return fail(ErrorKind::device, finished.string(), error.message(), "make room, and try again");
  return finished;
}

/// cv::VideoWriter says nothing of a full disk.
Status check_film(const fs::path& file, std::size_t pictures) {
  cv::VideoCapture film(file.string(), cv::CAP_FFMPEG);
  const double count = film.isOpened() ? film.get(cv::CAP_PROP_FRAME_COUNT) : 0;
  if (count == static_cast<double>(pictures)) return {};
  return fail(ErrorKind::device, file.parent_path().string(),
              fmt::format("{:.0f} of {} pictures came to lie in the film", count, pictures),
              "make room on that disk, and try again");
}

}  // namespace

Status FilmOrder::validate() const {
  const OptionCheck check("film");
  ORBITFUSE_TRY(check("seconds_a_view", seconds_a_view, from_to(0.1, 60)));
  ORBITFUSE_TRY(check("fps", fps, from_to(1, 60)));
  ORBITFUSE_TRY(check("width", width, from_to(64, 1280)));
  ORBITFUSE_TRY(check("height", height, from_to(64, 1280)));
  if (!(span.high_k > span.low_k))
    return fail(ErrorKind::usage, "film.span", fmt::format("{} to {}", span.low_k, span.high_k),
                "give a span that rises");
  return palette.empty() ? Status() : orbitfuse::palette(palette).map([](const cv::Mat&) {});
}

Result<FilmOrder> film_order_of(const json& j, const FinishedRun& run) {
  FilmOrder order;
  const JsonFields fields = request_fields(j);
  std::string kind, layer;
  ORBITFUSE_TRY(fields.get_all("kind", kind, "layer", layer));
  if (kind != "mp4" && kind != "png") return fields.wrong("kind", "mp4 or png");
  order.kind = kind == "mp4" ? FilmKind::mp4 : FilmKind::pictures;
  if (layer == "visible" && run.has(Modality::visible))
    order.layer = FilmLayer::visible;
  else if (layer == "thermal" && run.has(Modality::thermal))
    order.layer = FilmLayer::thermal;
  else if (layer == "fused" && run.has(Modality::visible) && run.has(Modality::thermal))
    order.layer = FilmLayer::fused;
  else
    return fields.wrong("layer", "a layer that the run has");
  ORBITFUSE_TRY(fields.get_word("palette", order.palette, 40));
  std::array<double, 2> span{};
  ORBITFUSE_TRY(fields.get("span", span, reachable));
  order.span = {span[0], span[1]};
  double width = 0, height = 0, fps = order.fps;
  ORBITFUSE_TRY(fields.get("width", width, from_to(64, 1280)));
  ORBITFUSE_TRY(fields.get("height", height, from_to(64, 1280)));
  // Encoders want even sizes.
  order.width = static_cast<int>(width) / 2 * 2;
  order.height = static_cast<int>(height) / 2 * 2;
  ORBITFUSE_TRY(fields.get_present("seconds_a_view", order.seconds_a_view, "fps", fps));
  if (!(fps >= 1 && fps <= 60)) return fields.wrong("fps", "a number, 1 to 60");
  order.fps = static_cast<int>(fps);
  ORBITFUSE_TRY(order.validate());
  return order;
}

std::vector<Bookmark> way_along(const std::vector<Bookmark>& bookmarks, int frames_a_view) {
  std::vector<Bookmark> way;
  for (std::size_t i = 0; i + 1 < bookmarks.size(); ++i) {
    const Bookmark &a = bookmarks[i], &b = bookmarks[i + 1];
    const Eigen::Vector3d from = a.position - a.target, to = b.position - b.target;
    for (int k = 0; k < frames_a_view; ++k) {
      const double part = static_cast<double>(k) / frames_a_view;
      const double t = part * part * (3 - 2 * part);  // at rest at both ends
      Bookmark at;
      at.name = a.name;
      at.target = (1 - t) * a.target + t * b.target;
      const double distance = std::pow(from.norm(), 1 - t) * std::pow(to.norm(), t);
      at.position =
          at.target + distance * between_directions(from.normalized(), to.normalized(), t);
      at.fov_deg = (1 - t) * a.fov_deg + t * b.fov_deg;
      way.push_back(at);
    }
  }
  if (!bookmarks.empty()) way.push_back(bookmarks.back());
  return way;
}

Shot shot_of_bookmark(const Bookmark& from, const Eigen::Vector3d& up, int width, int height) {
  const Eigen::Vector3d ahead = (from.target - from.position).normalized();
  Eigen::Vector3d right = ahead.cross(up);
  if (right.norm() < 1e-6) right = ahead.unitOrthogonal();
  Eigen::Matrix3d world_from_cam;
  world_from_cam.col(0) = right.normalized();
  world_from_cam.col(2) = ahead;
  world_from_cam.col(1) = ahead.cross(world_from_cam.col(0));
  Shot shot;
  shot.cam_from_world = Rigid3d{Eigen::Quaterniond(world_from_cam), from.position}.inverse();
  shot.camera = camera_of(from.fov_deg, width, height);
  return shot;
}

Result<cv::Mat> FilmMaker::picture(const FilmOrder& order, const Bookmark& from) const {
  const LayerWish wish{.visible = order.layer == FilmLayer::visible,
                       .thermal = order.layer == FilmLayer::thermal,
                       .fused = order.layer == FilmLayer::fused,
                       .every_pixel = true,
                       .detail = true};
  const Shot shot = shot_of_bookmark(from, run_.up, order.width, order.height);
  // A job a picture: none of them has waited longer than the viewers that came meanwhile. Where too
  // many wait, the film waits until there are fewer.
  const auto render = [&] {
    RenderTurns::Job job(turns_, film_client, &over_);
    return layers_.render(shot, wish, job);
  };
  Result<Layers> rendered = render();
  while (!rendered && rendered.error().kind == ErrorKind::unavailable && !over_) {
    std::this_thread::sleep_for(before_asking_again);
    rendered = render();
  }
  ORBITFUSE_ASSIGN(const Layers seen, std::move(rendered));
  if (order.layer == FilmLayer::visible) return seen.visible;
  if (order.layer == FilmLayer::fused) return seen.fused;
  ORBITFUSE_ASSIGN(const cv::Mat colors, palette(order.palette));
  cv::Mat painted = colorize(seen.kelvin, order.span, colors);
  fusion::hatch_unmeasured(painted, seen.kelvin);
  return painted;
}

Result<fs::path> FilmMaker::make(const FilmOrder& order, const std::vector<Bookmark>& way) {
  const fs::path folder = run_.out / "films";
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    return fail(ErrorKind::device, folder.string(), error.message(), "make room, or check rights");
  const bool mp4 = order.kind == FilmKind::mp4;
  const std::string extension = mp4 ? ".mp4" : "";
  const Unfinished partial{folder / fmt::format(".partial-{}{}", ::getpid(), extension)};
  fs::remove_all(partial.path, error);
  cv::VideoWriter writer;
  if (mp4 && !writer.open(partial.path.string(), cv::CAP_FFMPEG,
                          cv::VideoWriter::fourcc('a', 'v', 'c', '1'), order.fps,
                          {order.width, order.height}))
    return fail(ErrorKind::unavailable, folder.string(), "no H.264 encoder here",
                "make pictures instead");
  for (std::size_t i = 0; i < way.size(); ++i) {
    ORBITFUSE_ASSIGN(const cv::Mat image, picture(order, way[i]));
    if (mp4)
      writer.write(image);
    else
      ORBITFUSE_TRY(write_png(partial.path / fmt::format("{:05}.png", i), image));
    const std::lock_guard lock(mutex_);
    done_ = i + 1;
  }
  writer.release();
  if (mp4) ORBITFUSE_TRY(check_film(partial.path, way.size()));
  return put_there(partial.path, folder, extension);
}

/// OpenCV and the standard library throw where memory is short; a thread that throws ends the
/// viewer.
Result<fs::path> FilmMaker::made(const FilmOrder& order, const std::vector<Bookmark>& way) {
  try {
    return make(order, way);
  } catch (const std::exception& thrown) {
    return fail(ErrorKind::device, "film", thrown.what(), "try again, or make a smaller one");
  }
}

Status FilmMaker::begin(const FilmOrder& order, const std::vector<Bookmark>& bookmarks) {
  ORBITFUSE_TRY(order.validate());
  if (bookmarks.size() < 2)
    return fail(ErrorKind::usage, "film", fmt::format("{} views are kept", bookmarks.size()),
                "keep two views or more: the film goes from one to the next");
  std::vector<Bookmark> way = way_along(
      bookmarks, std::max(1, static_cast<int>(std::lround(order.seconds_a_view * order.fps))));
  if (way.size() > most_pictures)
    return fail(ErrorKind::usage, "film", fmt::format("{} pictures", way.size()),
                fmt::format("choose fewer views, seconds or fps: {} at most", most_pictures));
  std::unique_lock lock(mutex_);
  if (making_)
    return fail(ErrorKind::usage, "film", "one is being made", "wait for it, or stop it");
  if (worker_.joinable()) worker_.join();
  making_ = true;
  over_ = false;
  done_ = 0;
  total_ = way.size();
  file_.clear();
  error_.clear();
  worker_ = std::thread([this, order, way = std::move(way)] {
    const Result<fs::path> film = made(order, way);
    const std::lock_guard finished(mutex_);
    making_ = false;
    if (film)
      file_ = fs::absolute(*film).lexically_normal().string();
    else
      error_ = film.error().kind == ErrorKind::cancelled ? "stopped" : film.error().message();
  });
  return {};
}

void FilmMaker::stop() {
  std::thread ending;
  {
    const std::lock_guard lock(mutex_);
    over_ = true;  // of the film whose thread is taken here: begin() makes it false again
    ending = std::move(worker_);
  }
  if (ending.joinable()) ending.join();
}

json FilmMaker::state() const {
  const std::lock_guard lock(mutex_);
  json j = {{"making", making_}, {"done", done_}, {"total", total_}};
  if (!file_.empty()) j["file"] = file_;
  if (!error_.empty()) j["error"] = error_;
  return j;
}

}  // namespace orbitfuse::view
