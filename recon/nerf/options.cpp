// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/options.hpp"

#include "core/near_word.hpp"
#include "core/nested_text.hpp"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <variant>

namespace orbitfuse::nerf {
namespace {

using Member = std::variant<int TrainOptions::*, double TrainOptions::*, bool TrainOptions::*,
                            std::uint64_t TrainOptions::*, std::string TrainOptions::*,
                            std::filesystem::path TrainOptions::*, Sampling TrainOptions::*>;

/// May a run go on with another value?
enum class Change { free, never };

struct Entry {
  const char* key;
  Member member;
  Change change;
  double low = 0, high = 1e30;
};

#define FIELD(member, change, ...) \
  Entry { #member, &TrainOptions::member, Change::change __VA_OPT__(, ) __VA_ARGS__ }

const std::vector<Entry>& table() {
  static const std::vector<Entry> entries = {
      FIELD(preset, free),
      FIELD(iterations, free, 1, 1e7),
      FIELD(budget_s, free, 0),
      FIELD(target_psnr, free, 0, 100),
      FIELD(holdout_every, never, 0, 1e6),
      FIELD(plateau_db, free, 0, 100),
      FIELD(keep_best, free),
      FIELD(eval_count, free, 0, 10000),
      FIELD(seed, never),
      FIELD(checkpoint, free),
      FIELD(checkpoint_every_s, free, 0),
      FIELD(resume, free),
      FIELD(levels, never, 1, 16),
      FIELD(features_per_level, never, 2, 4),
      FIELD(log2_table, never, 8, 22),
      FIELD(base_resolution, never, 2, 1024),
      FIELD(max_resolution, never, 4, 1 << 16),
      FIELD(hidden, never, 16, 256),
      FIELD(color_hidden, never, 16, 256),
      FIELD(color_layers, never, 1, 2),
      FIELD(sh_degree, never, 0, 4),
      FIELD(texture_share, free, 0, 1),
      FIELD(sampling, never),
      FIELD(samples_per_step, free, 256, 1 << 22),
      FIELD(occupancy_resolution, never, 16, 256),
      FIELD(occupancy_threshold, free, 0, 0.9),
      FIELD(surface_samples, free, 1, 128),
      FIELD(haze_samples, free, 0, 128),
      FIELD(proposal_samples_1, free, 8, 1024),
      FIELD(proposal_samples_2, free, 8, 1024),
      FIELD(fine_samples, free, 4, 1024),
      FIELD(learning_rate, free, 1e-6, 1),
      FIELD(network_learning_rate, free, 1e-6, 1),
      FIELD(distortion_weight, free, 0, 100),
      FIELD(depth_weight, free, 0, 1000),
      FIELD(depth_end, free, 0, 1),
      FIELD(depth_final_weight, free, 0, 1000),
      FIELD(min_views, never, 0, 1e6),
      FIELD(carve, never),
      FIELD(level_anneal_end, never, 0, 1),
      FIELD(per_image_offset, never),
      FIELD(even_exposure, never),
      FIELD(even_shading, never),
      FIELD(refine_poses, never),
      FIELD(shared_geometry, never),
  };
  return entries;
}
#undef FIELD

std::string nearest(const std::string& word, const std::vector<std::string>& known) {
  return *std::min_element(known.begin(), known.end(), [&](const auto& a, const auto& b) {
    return edit_distance(word, a) < edit_distance(word, b);
  });
}

const Entry* find(const std::string& key) {
  for (const Entry& entry : table())
    if (key == entry.key) return &entry;
  return nullptr;
}

template <class T>
bool parse(const std::string& text, T& out) {
  const char* end = text.data() + text.size();
  const auto [ptr, error] = std::from_chars(text.data(), end, out);
  return error == std::errc() && ptr == end;
}

bool assign(const std::string& text, bool& out) {
  out = text == "true" || text == "1";
  return out || text == "false" || text == "0";
}
bool assign(const std::string& text, int& out) { return parse(text, out); }
bool assign(const std::string& text, double& out) { return parse(text, out); }
bool assign(const std::string& text, std::uint64_t& out) { return parse(text, out); }
bool assign(const std::string& text, std::string& out) { return out = text, true; }
bool assign(const std::string& text, std::filesystem::path& out) { return out = text, true; }
bool assign(const std::string& text, Sampling& out) {
  out = text == "proposal" ? Sampling::proposal : Sampling::occupancy;
  return text == "proposal" || text == "occupancy";
}

std::string text_of(bool value) { return value ? "true" : "false"; }
std::string text_of(const std::filesystem::path& value) { return value.string(); }
std::string text_of(Sampling value) {
  return value == Sampling::proposal ? "proposal" : "occupancy";
}
template <class T>
std::string text_of(const T& value) {
  return fmt::format("{}", value);
}

std::string range_text(const Entry& entry) {
  return entry.high < 1e30 ? fmt::format("in {:.15g}..{:.15g}", entry.low, entry.high)
                           : fmt::format("of at least {:.15g}", entry.low);
}

/// What the range leaves out.
std::string step_text(const std::string& key) {
  if (key == "features_per_level") return ", 2 or 4";
  const bool of_16 = key == "hidden" || key == "color_hidden" || key == "occupancy_resolution";
  return of_16 ? ", a multiple of 16" : "";
}

}  // namespace

std::string TrainOptions::allowed(const std::string& key) {
  const Entry* entry = find(key);
  if (!entry) return "one of TrainOptions";
  return std::visit(
      [&]<class T>(T TrainOptions::*) -> std::string {
        if constexpr (std::is_same_v<T, bool>) return "true or false";
        if constexpr (std::is_same_v<T, int>)
          return "an integer " + range_text(*entry) + step_text(key);
        if constexpr (std::is_same_v<T, double>) return "a number " + range_text(*entry);
        if constexpr (std::is_same_v<T, std::uint64_t>) return "an integer of at least 0";
        if constexpr (std::is_same_v<T, Sampling>) return "occupancy or proposal";
        return "text";
      },
      entry->member);
}

Status TrainOptions::validate() const {
  for (const Entry& entry : table()) {
    double value = entry.low;
    if (const auto* i = std::get_if<int TrainOptions::*>(&entry.member)) value = this->*(*i);
    if (const auto* d = std::get_if<double TrainOptions::*>(&entry.member)) value = this->*(*d);
    const std::string key = entry.key;
    const bool stepped = step_text(key).empty() ||
                         (key == "features_per_level" ? value != 3 : std::fmod(value, 16) == 0);
    if (!(value >= entry.low && value <= entry.high) || !stepped)
      return fail(ErrorKind::usage, "nerf." + key, get(key), "choose " + allowed(key));
  }
  if (max_resolution < base_resolution)
    return fail(ErrorKind::usage, "nerf.max_resolution", fmt::format("{}", max_resolution),
                fmt::format("choose at least base_resolution ({})", base_resolution));
  if (resume && checkpoint.empty())
    return fail(ErrorKind::usage, "nerf.resume", "no checkpoint named", "set nerf.checkpoint");
  return {};
}

Status TrainOptions::set(const std::string& key, const std::string& value) {
  const Entry* entry = find(key);
  if (!entry)
    return fail(ErrorKind::usage, "nerf." + key, "unknown key",
                "did you mean nerf." + nearest(key, keys()) + "?");
  const bool ok =
      std::visit([&](auto member) { return assign(value, this->*member); }, entry->member);
  if (!ok)
    return fail(ErrorKind::usage, "nerf." + key, "'" + value + "'", "choose " + allowed(key));
  return {};
}

std::string TrainOptions::get(const std::string& key) const {
  const Entry* entry = find(key);
  return entry ? std::visit([&](auto member) { return text_of(this->*member); }, entry->member)
               : std::string();
}

std::vector<std::string> TrainOptions::keys() {
  std::vector<std::string> out;
  for (const Entry& entry : table()) out.emplace_back(entry.key);
  return out;
}

bool TrainOptions::free_to_change(const std::string& key) {
  const Entry* entry = find(key);
  return entry != nullptr && entry->change == Change::free;
}

std::string default_preset(Modality modality) {
  return modality == Modality::visible ? "fast-visible" : "fast-thermal";
}

std::vector<std::string> preset_names() {
  return {"fast-visible", "fast-thermal", "nerfacto", "nerf-rgb", "nerf-ir"};
}

Result<TrainOptions> preset(const std::string& name) {
  TrainOptions o;
  o.preset = name;
  if (name == "fast-visible") return o;
  if (name == "fast-thermal") {
    // As published for NeRF-IR: a stronger distortion loss and a smaller output branch.
    o.distortion_weight = 0.01;
    o.color_hidden = 32;
    o.sh_degree = 0;      // emitted heat hardly depends on the direction
    o.texture_share = 0;  // on two of four scenes worse by texture (docs/notes/nerf.md)
    o.per_image_offset = true;
    o.refine_poses =
        true;  // thermal poses are a third of a degree off where visible ones are exact
    return o;
  }
  // The published trainers: proposal sampling, 16 levels, 2^19 entries, a deeper colour network.
  o.sampling = Sampling::proposal;
  o.iterations = 30000;
  o.levels = 16;
  o.features_per_level = 2;
  o.log2_table = 19;
  o.max_resolution = 2048;
  o.color_layers = 2;
  o.sh_degree = 4;
  o.samples_per_step = 4096 * 48;
  o.learning_rate = o.network_learning_rate = 1e-2;
  o.distortion_weight = 0.002;
  o.depth_weight = 0;
  o.even_exposure = false;
  o.even_shading = false;
  o.texture_share = 0;
  o.carve = false;
  o.min_views = 0;
  if (name == "nerfacto") return o;
  if (name == "nerf-rgb") {
    o.hidden = 128;
    o.color_hidden = 128;
    o.features_per_level = 4;
    o.proposal_samples_2 = 128;
    o.fine_samples = 64;
    o.samples_per_step = 4096 * 64;
    return o;
  }
  if (name == "nerf-ir") {
    o.color_hidden = 32;
    o.proposal_samples_1 = 128;
    o.proposal_samples_2 = 64;
    o.fine_samples = 32;
    o.distortion_weight = 0.01;
    o.samples_per_step = 4096 * 32;
    return o;
  }
  return fail(ErrorKind::usage, "nerf.preset", "'" + name + "'",
              "did you mean " + nearest(name, preset_names()) + "?");
}

Result<TrainOptions> load_options(const std::filesystem::path& file) {
  ORBITFUSE_ASSIGN(const std::string toml_text, read_toml_text(file));
  toml::table config;
  try {
    config = toml::parse(toml_text, file.string());
  } catch (const toml::parse_error& error) {
    return fail(ErrorKind::usage, file.string(),
                fmt::format("line {}: {}", error.source().begin.line, error.description()),
                "correct the TOML");
  }
  ORBITFUSE_ASSIGN(TrainOptions options,
                   preset(config["preset"].value_or(std::string("fast-visible"))));
  for (const auto& [key, node] : config) {
    std::ostringstream text;
    if (const auto* string = node.as_string()) {
      text << string->get();
    } else {
      node.visit([&](const auto& value) { text << value; });
    }
    ORBITFUSE_TRY(options.set(std::string(key.str()), text.str()));
  }
  ORBITFUSE_TRY(options.validate());
  return options;
}

}  // namespace orbitfuse::nerf
