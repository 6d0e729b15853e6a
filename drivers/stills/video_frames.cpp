// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/video_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "capture/image_quality/frame_motion.hpp"
#include "capture/image_quality/frame_quality.hpp"
#include "core/geometry/quarter_turn.hpp"
#include "core/image/image_codec.hpp"
#include "core/option_range.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

constexpr int looked_at_px = 640;  // what sharpness and motion are measured at

tl::unexpected<Error> unreadable(const fs::path& file, const std::string& found) {
  return fail(ErrorKind::input, file.string(), found,
              "copy it again from the phone, or export it as MP4 with H.264");
}

/// A video from its first frame on.
class Reader {
 public:
  static Result<Reader> open(const fs::path& file) {
    std::error_code error;
    if (!fs::is_regular_file(file, error)) return unreadable(file, "not a file");
    std::array<char, 400> head{};
    std::ifstream stream(file, std::ios::binary);
    stream.read(head.data(), head.size());
    if (!is_video({head.data(), static_cast<std::size_t>(stream.gcount())}))
      return unreadable(file, "not a video (MP4, MOV, MKV, AVI or MPEG)");
    Reader reader;
    try {
      // FFmpeg takes what stands before a colon in a relative name for a protocol.
      reader.capture_.open(fs::absolute(file).string(), cv::CAP_FFMPEG);
    } catch (const cv::Exception&) {
      reader.capture_.release();
    }
    if (!reader.capture_.isOpened())
      return unreadable(file, "a video that can't be read (is its end missing?)");
    reader.capture_.set(cv::CAP_PROP_ORIENTATION_AUTO, 0);
    reader.turn_ = turn_of(reader.capture_);
    const double samples = 3 * reader.capture_.get(cv::CAP_PROP_FRAME_WIDTH) *
                           reader.capture_.get(cv::CAP_PROP_FRAME_HEIGHT);
    if (!(samples > 0 && samples <= static_cast<double>(max_image_samples)))
      return unreadable(file, "a video without a size that can be");
    return reader;
  }

  /// False at the end, or where nothing more can be decoded.
  bool next(cv::Mat& image) {
    try {
      if (!capture_.read(image) || image.empty()) return false;
    } catch (const cv::Exception&) {
      return false;
    }
    if (image.channels() == 1) cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
    image = upright(turn_, image);
    return image.type() == CV_8UC3;
  }
  std::optional<std::int64_t> time_ns() const {
    const double ms = capture_.get(cv::CAP_PROP_POS_MSEC);
    if (!(ms > 0 && ms < 1e9)) return std::nullopt;
    return std::llround(ms * 1e6);
  }
  std::optional<std::int64_t> announced() const {
    const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
    if (!(count > 0 && count < 1e9)) return std::nullopt;
    return std::llround(count);
  }

 private:
  /// OpenCV before 4.7 takes FFmpeg's angle for clockwise, and would turn the picture by it.
  static QuarterTurn turn_of(const cv::VideoCapture& capture) {
    const int told = cvRound(capture.get(cv::CAP_PROP_ORIENTATION_META));
    const bool reversed = CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR < 7;
    const int clockwise_deg = ((reversed ? -told : told) % 360 + 360) % 360;
    return {clockwise_deg % 90 == 0 ? clockwise_deg / 90 : 0};
  }

  cv::VideoCapture capture_;
  QuarterTurn turn_;
};

/// What is kept of each frame of the first reading.
struct Look {
  double way = 0;        ///< of the picture since the first frame, in widths
  double sharpness = 0;  ///< below 0: no frame of this video's size
};

std::vector<Look> look_at_all(Reader& reader, const VideoOptions& options, const Progress& progress,
                              VideoAccount& account, Status& status) {
  std::vector<Look> looks;
  cv::Mat image, small, before;
  cv::Size size;
  double way = 0;
  while (reader.next(image)) {
    if (account.frames == options.max_looked_at) {
      account.cut_off = true;
      break;
    }
    ++account.frames;
    if (status = progress.check("import"); !status) break;
    if (size.empty()) size = image.size();
    if (image.size() != size) {
      looks.push_back({way, -1});
      ++account.other_size;
      continue;
    }
    const int width = std::min(looked_at_px, image.cols);
    cv::resize(image, small, {width, std::max(1, image.rows * width / image.cols)}, 0, 0,
               cv::INTER_AREA);
    if (!before.empty()) way += apparent_motion(before, small);
    looks.push_back({way, measure_quality(small).sharpness});
    cv::swap(before, small);
  }
  return looks;
}

/// The sharpest frame of each stretch that lies half a step and more behind the last one taken: two
/// neighbours on both sides of a border are one view.
std::vector<bool> choose(const std::vector<Look>& looks, const VideoOptions& options) {
  std::vector<bool> chosen(looks.size(), false);
  const double step = std::max(options.min_step, looks.back().way / options.max_frames);
  const std::size_t none = looks.size();
  std::size_t best = none;
  double stretch = 0, nearest_way = 0;
  const auto take_best = [&] {
    if (best == none) return;
    chosen[best] = true;
    nearest_way = looks[best].way + step / 2;
    best = none;
  };
  for (std::size_t i = 0; i < looks.size(); ++i) {
    if (looks[i].sharpness < 0) continue;
    // The end of the way belongs to the last stretch.
    const double here = std::min(std::floor(looks[i].way / step), options.max_frames - 1.0);
    if (here != stretch) take_best();
    stretch = here;
    if (looks[i].way < nearest_way) continue;
    if (best == none || looks[i].sharpness > looks[best].sharpness) best = i;
  }
  take_best();
  return chosen;
}

}  // namespace

Status VideoOptions::validate() const {
  const OptionCheck check("video");
  ORBITFUSE_TRY(check("max_frames", max_frames, from_to(2, 5000)));
  ORBITFUSE_TRY(check("min_step", min_step, above_up_to(0, 1)));
  ORBITFUSE_TRY(check("max_edge_px", max_edge_px, above(0)));
  return check("max_looked_at", static_cast<double>(max_looked_at), at_least(1));
}

std::string VideoAccount::words() const {
  std::string text =
      fmt::format("{} of {} frames taken, {} passed over for a sharper one of nearly the same view",
                  taken, frames, less_sharp());
  if (blurred > 0)
    text += fmt::format(", {} blurred though the sharpest of their stretch: film slower", blurred);
  if (featureless > 0) text += fmt::format(", {} with nothing to see", featureless);
  if (other_size > 0) text += fmt::format(", {} of another size", other_size);
  if (cut_off) text += "; the video goes on, the rest is not looked at: cut it to the orbit";
  // Containers count a frame more or less.
  if (!cut_off && announced && *announced > frames + std::max<std::int64_t>(2, *announced / 50))
    text += fmt::format("; {} more are announced and can't be read: it is cut off or damaged",
                        *announced - frames);
  if (not_read_again > 0)
    text += fmt::format("; {} of the sharpest could not be read a second time: copy it again",
                        not_read_again);
  if (taken == 1) text += "; the camera hardly moved";
  return text;
}

bool has_video_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  constexpr std::array<std::string_view, 10> known{".mp4", ".mov", ".m4v",  ".mkv", ".webm",
                                                   ".avi", ".mpg", ".mpeg", ".mts", ".3gp"};
  return std::find(known.begin(), known.end(), extension) != known.end();
}

/// FFmpeg also reads play lists, which name other files: none of these begins so.
bool is_video(std::string_view b) {
  using namespace std::string_view_literals;
  const auto at = [&](std::size_t place, std::string_view word) {
    return b.size() >= place + word.size() && b.substr(place, word.size()) == word;
  };
  for (const std::string_view box : {"ftyp"sv, "moov"sv, "mdat"sv, "wide"sv, "free"sv, "skip"sv})
    if (at(4, box)) return true;
  const bool transport =
      (at(0, "\x47"sv) && at(188, "\x47"sv)) || (at(4, "\x47"sv) && at(196, "\x47"sv));
  return transport || at(0, "\x1a\x45\xdf\xa3"sv) || (at(0, "RIFF"sv) && at(8, "AVI "sv)) ||
         at(0, "\0\0\1\xba"sv) || at(0, "\0\0\1\xb3"sv);
}

std::string video_fingerprint(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  std::ifstream stream(file, std::ios::binary);
  if (error || !stream) return {};
  std::string ends(std::size_t{1} << 20, '\0');
  stream.read(ends.data(), static_cast<std::streamsize>(ends.size() / 2));
  const auto head = static_cast<std::size_t>(stream.gcount());
  if (size > head) {
    const std::uintmax_t rest = std::min<std::uintmax_t>(size - head, ends.size() / 2);
    stream.seekg(-static_cast<std::streamoff>(rest), std::ios::end);
    stream.read(ends.data() + head, static_cast<std::streamsize>(rest));
  }
  return content_hash(fmt::format("{} {}", size, ends));
}

Result<VideoAccount> take_video_frames(const fs::path& file, const VideoOptions& options,
                                       const Progress& progress,
                                       const std::function<Status(VideoFrame)>& take) {
  ORBITFUSE_TRY(options.validate());
  VideoAccount account;
  std::vector<bool> chosen;
  {
    ORBITFUSE_ASSIGN(Reader reader, Reader::open(file));
    account.announced = reader.announced();
    Status status;
    const std::vector<Look> looks = look_at_all(reader, options, progress, account, status);
    ORBITFUSE_TRY(status);
    if (looks.empty()) return unreadable(file, "a video without frames");
    chosen = choose(looks, options);
  }
  ORBITFUSE_ASSIGN(Reader reader, Reader::open(file));
  cv::Mat image;
  account.not_read_again = std::count(chosen.begin(), chosen.end(), true);
  for (std::size_t i = 0; i < chosen.size() && reader.next(image); ++i) {
    ORBITFUSE_TRY(progress.check("import"));
    account.not_read_again -= chosen[i];
    if (!chosen[i]) continue;
    const EdgeBlur blur = measure_edges(image);
    if (blur.edges == 0) {
      ++account.featureless;
    } else if (blur.sigma_px > options.max_edge_px) {
      ++account.blurred;
    } else {
      ORBITFUSE_TRY(take({static_cast<std::int64_t>(i), reader.time_ns(), image}));
      ++account.taken;
    }
  }
  return account;
}

}  // namespace orbitfuse
