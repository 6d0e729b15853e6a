// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/given_cameras.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <set>
#include <string_view>

#include "core/formats/transforms_json.hpp"

namespace orbitfuse::stages {
namespace {

constexpr double max_pixels = 64e6;  // a view is held whole, with depth and opacity

/// "1" and "nan" would take the place of numbers where X,Y,Z or VIEW,U,V is asked.
bool is_a_number(const std::string& name) {
  double value = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), value);
  return error != std::errc::invalid_argument && end == name.data() + name.size();
}

/// Of a file, and of a view in VIEW,U,V.
bool fits_a_name(const std::string& name) {
  constexpr std::size_t longest = 100;
  constexpr std::string_view unfit = "/\\\",\x7f";
  return !name.empty() && !is_a_number(name) && name.size() <= longest && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [&](unsigned char c) {
           return c > ' ' && unfit.find(static_cast<char>(c)) == std::string_view::npos;
         });
}

/// "front" of "images/front.png"; numbers for all where two are called alike, or one can't be.
std::vector<std::string> names_of(const std::vector<TransformsFrame>& frames) {
  std::vector<std::string> names;
  for (const TransformsFrame& frame : frames)
    names.push_back(std::filesystem::path(frame.file_path).stem().string());
  if (std::set(names.begin(), names.end()).size() < names.size() ||
      !std::all_of(names.begin(), names.end(), fits_a_name))
    for (std::size_t i = 0; i < names.size(); ++i) names[i] = fmt::format("{:03}", i);
  return names;
}

}  // namespace

Result<GivenCameras> read_given_cameras(const std::string& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored))
    return fail(ErrorKind::input, file, "no such file",
                "check the path, or let the program choose new cameras: orbitfuse render OUT "
                "--path auto");
  ORBITFUSE_ASSIGN(const Transforms transforms, read_transforms_json(file));
  const std::vector<std::string> names = names_of(transforms.frames);
  GivenCameras given;
  bool bent = false;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const TransformsFrame& frame = transforms.frames[i];
    if (static_cast<double>(frame.camera.width) * frame.camera.height > max_pixels)
      return fail(ErrorKind::input, fmt::format("{}: frames[{}]", file, i),
                  fmt::format("{}x{} pixels", frame.camera.width, frame.camera.height),
                  "choose w and h for at most 64 megapixels");
    bent = bent || frame.camera.has_distortion();
    given.views.views.push_back(
        {names[i], frame.camera.without_distortion(), frame.cam_from_world});
    given.files.push_back(frame.file_path);
  }
  given.views.described = fmt::format("{} given cameras{}", names.size(),
                                      bent ? ", without their lens distortion" : "");
  return given;
}

}  // namespace orbitfuse::stages
