// SPDX-License-Identifier: BSD-3-Clause
#include "bench/capture/manifest_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "tests/support/gev_simulator.hpp"

namespace orbitfuse::bench {
namespace {

using nlohmann::json;

struct Stream {
  std::map<std::uint64_t, int> ids;
  std::uint64_t frames = 0, lost = 0;  ///< since the last stream line
};

/// Whether an image holds one frame of the simulator.
bool is_simulated(const cv::Mat& image) {
  const auto* p = image.ptr<std::uint16_t>();
  for (std::uint64_t number = 0; number < 4001; ++number) {
    if (testing::GevSimulator::pixel(number, 0) != p[0]) continue;
    for (std::size_t i = 0; i < image.total(); ++i) {
      if (p[i] != testing::GevSimulator::pixel(number, i)) return false;
    }
    return true;
  }
  return false;
}

/// Counts of unknown scale are shown as gray; the camera's own samples lie beside them.
std::filesystem::path samples_of(const json& line) {
  const std::filesystem::path file = line.at("file").get<std::string>();
  const json flags = line.value("flags", json::array());
  if (std::find(flags.begin(), flags.end(), "raw-counts") == flags.end()) return file;
  return file.parent_path() / "originals" / (file.stem().string() + ".tiff");
}

void check_image(const std::filesystem::path& folder, const json& line,
                 std::vector<std::string>& bad) {
  const std::string name = samples_of(line);
  const cv::Mat image = cv::imread((folder / name).string(), cv::IMREAD_UNCHANGED);
  if (image.empty()) {
    bad.push_back(name + " cannot be read");
  } else if (image.cols != line.at("width") || image.rows != line.at("height")) {
    bad.push_back(name + " has another size than its line");
  } else if (line.at("modality") == "thermal" &&
             (image.type() != CV_16UC1 || !is_simulated(image))) {
    bad.push_back(name + " is not what the camera sent");
  }
}

void check_ids(const std::string& device, const Stream& stream, std::vector<std::string>& bad) {
  if (stream.ids.empty()) return;
  std::uint64_t expected = stream.ids.begin()->first;
  for (const auto& [id, times] : stream.ids) {
    if (id != expected)
      bad.push_back(fmt::format("{}: ids {} to {} are in no line", device, expected, id - 1));
    if (times != 1) bad.push_back(fmt::format("{}: id {} is there {} times", device, id, times));
    expected = id + 1;
  }
}

void check_stream(const json& line, Stream& stream, std::vector<std::string>& bad) {
  const std::string device = line.at("device");
  const std::uint64_t first = line.at("first_sequence"), last = line.at("last_sequence"),
                      received = line.at("received"), lost = line.at("lost");
  if (received + lost != last - first + 1)
    bad.push_back(fmt::format("{}: {} received and {} lost are not {} to {}", device, received,
                              lost, first, last));
  if (received != stream.frames || lost != stream.lost)
    bad.push_back(fmt::format("{}: its stream line says {} and {}, its lines {} and {}", device,
                              received, lost, stream.frames, stream.lost));
  stream.frames = stream.lost = 0;
}

}  // namespace

Checked check_session(const std::filesystem::path& folder, bool killed) {
  Checked result;
  std::map<std::string, Stream> streams;
  std::set<std::string> files;
  std::ifstream manifest(folder / "manifest.jsonl");
  if (!manifest) result.violations.push_back("there is no manifest");
  std::string text;
  for (bool at_end = false; std::getline(manifest, text);) {
    at_end = manifest.eof();
    const json line = json::parse(text, nullptr, false);
    if (line.is_discarded()) {
      if (!(killed && at_end))
        result.violations.push_back("a line is no JSON: " + text.substr(0, 60));
      continue;
    }
    const std::string type = line.value("type", "");
    result.complete = type == "end";
    if (type == "event" && line.value("kind", "") == "resumed") {
      for (auto& [device, stream] : streams) stream.frames = stream.lost = 0;
    } else if (type == "frame" && files.insert(line.at("file")).second) {
      Stream& stream = streams[line.at("device")];
      ++stream.ids[line.at("sequence")];
      ++stream.frames;
      ++result.frames;
      check_image(folder, line, result.violations);
    } else if (type == "gap") {
      Stream& stream = streams[line.at("device")];
      const std::uint64_t first = line.at("first_sequence"), count = line.at("count");
      for (std::uint64_t i = 0; i < count; ++i) ++stream.ids[first + i];
      stream.lost += count;
      result.lost += count;
    } else if (type == "stream") {
      check_stream(line, streams[line.at("device")], result.violations);
    }
  }
  for (const auto& [device, stream] : streams) check_ids(device, stream, result.violations);
  return result;
}

}  // namespace orbitfuse::bench
