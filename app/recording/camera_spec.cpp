// SPDX-License-Identifier: BSD-3-Clause
#include "app/recording/camera_spec.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

namespace orbitfuse::recording {
namespace {

const std::map<std::string, std::vector<std::string>> drivers{
    {"aravis", {"profile"}},
    {"v4l2",
     {"exposure", "focus", "format", "kelvin-per-dn", "lock", "rate", "size", "white-balance"}},
    {"network", {}},
    {"stills", {"existing", "gray"}},
    {"replay", {"speed"}},
    {"synthetic", {"size", "spacing"}}};

/// What was meant by a device, an address or a folder without the driver before it; empty: unknown.
std::string with_driver(const std::string& text) {
  std::error_code unreadable;
  if (text.starts_with("/dev/video")) return "v4l2:" + text;
  for (const char* scheme : {"rtsp://", "http://", "https://"})
    if (text.starts_with(scheme)) return "network:" + text;
  return std::filesystem::is_directory(text, unreadable) ? "stills:" + text : "";
}

tl::unexpected<Error> wrong(const std::string& spec, std::string found, std::string remedy) {
  return fail(ErrorKind::usage, "camera \"" + spec + "\"", std::move(found), std::move(remedy));
}

std::optional<double> parse(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

}  // namespace

std::string CameraSpec::value(const std::string& key) const {
  const auto found = settings.find(key);
  return found == settings.end() ? std::string() : found->second;
}

Result<CameraSpec> parse_camera_spec(const std::string& text) {
  CameraSpec spec;
  // Nothing but settings needs a comma, and addresses may hold one.
  std::size_t comma = text.starts_with("network:") ? std::string::npos : text.find(',');
  const std::string head = text.substr(0, comma);
  const std::size_t colon = head.find(':');
  spec.driver = head.substr(0, colon);
  if (colon != std::string::npos) spec.camera = head.substr(colon + 1);
  const auto known = drivers.find(spec.driver);
  if (known == drivers.end()) {
    std::vector<std::string> names;
    for (const auto& entry : drivers) names.push_back(entry.first);
    const std::string meant = with_driver(text);
    return wrong(text,
                 meant.empty() ? "unknown driver \"" + spec.driver + "\"" : "no driver before it",
                 meant.empty() ? fmt::format("use one of {}", fmt::join(names, ", "))
                               : "did you mean '" + meant + "'?");
  }
  while (comma != std::string::npos) {
    const std::size_t next = text.find(',', comma + 1);
    const std::string setting =
        text.substr(comma + 1, next == std::string::npos ? next : next - comma - 1);
    const std::size_t equals = setting.find('=');
    const std::string key = setting.substr(0, equals);
    const std::vector<std::string>& keys = known->second;
    if (equals == std::string::npos || std::find(keys.begin(), keys.end(), key) == keys.end()) {
      return wrong(text, "unknown setting \"" + setting + "\"",
                   keys.empty() ? spec.driver + " has none"
                                : fmt::format("{} has {}, written key=value", spec.driver,
                                              fmt::join(keys, ", ")));
    }
    if (spec.settings.contains(key)) return wrong(text, key + " is given twice", "give it once");
    spec.settings[key] = setting.substr(equals + 1);
    comma = next;
  }
  return spec;
}

Result<double> number(const CameraSpec& spec, const std::string& key, double fallback) {
  const std::string text = spec.value(key);
  if (text.empty()) return fallback;
  const std::optional<double> value = parse(text);
  if (!value || !(*value > 0)) return wrong(spec.driver, key + "=" + text, "give a number above 0");
  return *value;
}

Result<ImageSize> size(const CameraSpec& spec, ImageSize fallback) {
  const std::string text = spec.value("size");
  if (text.empty()) return fallback;
  const std::size_t x = text.find('x');
  const auto width = parse(text.substr(0, x));
  const auto height = x == std::string::npos ? std::nullopt : parse(text.substr(x + 1));
  if (!width || !height || *width < 8 || *height < 8 || *width > 20000 || *height > 20000) {
    return wrong(spec.driver, "size=" + text, "write it like size=1280x720");
  }
  return ImageSize{static_cast<int>(*width), static_cast<int>(*height)};
}

Result<bool> yes_or_no(const CameraSpec& spec, const std::string& key) {
  const std::string text = spec.value(key);
  if (text == "yes") return true;
  if (text.empty() || text == "no") return false;
  return wrong(spec.driver, key + "=" + text, "yes or no");
}

}  // namespace orbitfuse::recording
