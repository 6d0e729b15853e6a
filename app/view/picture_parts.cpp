// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/picture_parts.hpp"

#include <cstdint>
#include <cstring>

#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"

namespace orbitfuse::view {

Status PictureParts::add_jpeg(const std::string& name, const cv::Mat& bgr, int quality) {
  ORBITFUSE_ASSIGN(std::string jpeg, encode_jpeg(bgr, quality));
  parts_.push_back({{"name", name},
                    {"encoding", "jpeg"},
                    {"width", bgr.cols},
                    {"height", bgr.rows},
                    {"bytes", jpeg.size()}});
  contents_.push_back(std::move(jpeg));
  return {};
}

void PictureParts::add_levels(const std::string& name, const cv::Mat& levels, bool gray) {
  // Gray levels may be 0, which is a level: counts begin at 1.
  const double scale = gray ? 0.01 : kelvin_per_count_for(std::vector<cv::Mat>{levels});
  const double offset = gray ? -scale : 0;
  const cv::Mat counts = counts_of_kelvin(levels - offset, scale);
  std::string bytes(reinterpret_cast<const char*>(counts.data), counts.total() * counts.elemSize());
  parts_.push_back({{"name", name},
                    {"encoding", "uint16"},
                    {"width", levels.cols},
                    {"height", levels.rows},
                    {"bytes", bytes.size()},
                    {"scale", scale},
                    {"offset", offset}});
  contents_.push_back(std::move(bytes));
}

std::string PictureParts::bytes() const {
  std::string head = nlohmann::json{{"parts", parts_}}.dump();
  head.append((4 - head.size() % 4) % 4, ' ');
  const auto length = static_cast<std::uint32_t>(head.size());
  std::string all(4, '\0');
  std::memcpy(all.data(), &length, 4);
  all += head;
  for (const std::string& part : contents_) all += part;
  return all;
}

}  // namespace orbitfuse::view
