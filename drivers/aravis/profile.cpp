// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/aravis/profile.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>

#include "capture/recording/thermal_samples.hpp"
#include "core/nested_text.hpp"

namespace orbitfuse::aravis {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> bad(const fs::path& file, const std::string& key, const std::string& found,
                          const std::string& remedy) {
  return fail(ErrorKind::usage, file.string() + (key.empty() ? "" : ": " + key), found, remedy);
}

Result<CameraProfile> profile_of(const toml::table& table, const fs::path& file) {
  constexpr std::array<std::string_view, 6> known{"name",  "models",        "settings",
                                                  "scale", "kelvin_per_dn", "nuc_command"};
  for (const auto& [key, value] : table) {
    if (std::find(known.begin(), known.end(), key.str()) == known.end()) {
      return bad(file, std::string(key.str()), "unknown key",
                 "use name, models, settings, scale, kelvin_per_dn, nuc_command");
    }
  }
  CameraProfile profile;
  profile.name = table["name"].value_or(file.stem().string());
  profile.nuc_command = table["nuc_command"].value_or(std::string());
  profile.kelvin_per_dn = table["kelvin_per_dn"].value_or(0.0);
  if (const auto* models = table["models"].as_array()) {
    for (const auto& model : *models) profile.models.push_back(model.value_or(std::string()));
  }
  const std::string scale = table["scale"].value_or(std::string("none"));
  if (scale == "linear")
    profile.scale = SampleScale::linear;
  else if (scale == "radiometric")
    profile.scale = SampleScale::radiometric;
  else if (scale != "none")
    return bad(file, "scale", scale, "one of none, linear, radiometric");
  if (profile.scale == SampleScale::linear &&
      !(profile.kelvin_per_dn > 0 && profile.kelvin_per_dn <= max_kelvin_per_sample)) {
    const bool given = table.contains("kelvin_per_dn");
    return bad(file, "kelvin_per_dn", given ? fmt::format("{}", profile.kelvin_per_dn) : "missing",
               "scale = \"linear\" needs it, above 0 and at most 10, e.g. 0.01");
  }
  // An array of one-entry tables, because the order matters and TOML tables have none.
  const auto* settings = table["settings"].as_array();
  if (!settings) return profile;
  for (const auto& entry : *settings) {
    const auto* pair = entry.as_table();
    if (!pair || pair->size() != 1)
      return bad(file, "settings", "not a list of {Feature = value}", "write [{Width = 640}, ...]");
    const auto first = pair->begin();
    const toml::key& feature = first->first;
    const toml::node& value = first->second;
    FeatureValue setting;
    if (auto b = value.value_exact<bool>())
      setting = *b;
    else if (auto i = value.value_exact<std::int64_t>())
      setting = *i;
    else if (auto d = value.value_exact<double>())
      setting = *d;
    else if (auto s = value.value_exact<std::string>())
      setting = *s;
    else
      return bad(file, std::string(feature.str()), "not a value", "a boolean, number or string");
    profile.settings.emplace_back(std::string(feature.str()), setting);
  }
  return profile;
}

}  // namespace

Result<CameraProfile> read_profile(const fs::path& file) {
  ORBITFUSE_ASSIGN(const std::string text, read_toml_text(file));
  try {
    return profile_of(toml::parse(text, file.string()), file);
  } catch (const toml::parse_error& error) {
    return bad(file, "", std::string(error.description()), "correct the TOML");
  }
}

namespace {

std::vector<fs::path> profile_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

Result<CameraProfile> named_profile(const fs::path& folder, const std::string& name) {
  std::string known;
  for (const fs::path& file : profile_files(folder)) {
    if (file.stem() == name) return read_profile(file);
    known += (known.empty() ? "" : ", ") + file.stem().string();
  }
  return fail(ErrorKind::usage, "camera profile \"" + name + "\"", "not in " + folder.string(),
              known.empty() ? "give the folder of camera profiles" : "use one of " + known);
}

Result<CameraProfile> find_profile(const fs::path& folder, const std::string& model) {
  const std::vector<fs::path> files = profile_files(folder);
  Result<CameraProfile> generic =
      fail(ErrorKind::input, folder.string(), "no profile for \"" + model + "\" and no generic one",
           "restore config/cameras/generic.toml");
  for (const fs::path& file : files) {
    ORBITFUSE_ASSIGN(CameraProfile profile, read_profile(file));
    const bool fits =
        std::any_of(profile.models.begin(), profile.models.end(), [&](const std::string& part) {
          return !part.empty() && model.find(part) != std::string::npos;
        });
    if (fits) return profile;
    if (profile.name == "generic") generic = profile;
  }
  return generic;
}

}  // namespace orbitfuse::aravis
