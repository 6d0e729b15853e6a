// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/rig/rig_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>
#include <optional>

namespace orbitfuse {
namespace {

using Frames = std::vector<const FrameRecord*>;

constexpr std::int64_t one_second_ns = 1'000'000'000;

std::string stem_of(const FrameRecord& frame) {
  return std::filesystem::path(frame.source.empty() ? frame.file : frame.source).stem().string();
}

std::vector<std::string> stems_of(const Frames& frames) {
  std::vector<std::string> stems;
  for (const FrameRecord* frame : frames) stems.push_back(stem_of(*frame));
  return stems;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Of `all`, as many as are taken for all: a folder may hold a file of another name.
bool are_most(std::size_t some, std::size_t all) { return 5 * some >= 4 * all; }

/// What a name begins with before its first digit; none where it has no digit.
std::optional<std::string> word_before_number(const std::string& name) {
  const auto digit = std::find_if(name.begin(), name.end(), is_digit);
  if (digit == name.end()) return std::nullopt;
  return std::string(name.begin(), digit);
}

/// The word before the number that most names begin with: a camera's.
std::string camera_word(const std::vector<std::string>& names) {
  std::map<std::string, std::size_t> uses;
  for (const std::string& name : names)
    if (const auto word = word_before_number(name)) ++uses[*word];
  for (const auto& [word, count] : uses)
    if (are_most(count, names.size())) return word;
  return {};
}

/// Without the words round their numbers that a folder's names have in common: "DJI_0042_T" is
/// 0042.
std::vector<std::string> without_words(std::vector<std::string> names) {
  for (int end = 0; end < 2; ++end) {
    const std::string word = camera_word(names);
    for (std::string& name : names) {
      if (word_before_number(name) == word) name.erase(0, word.size());
      std::reverse(name.begin(), name.end());
    }
  }
  return names;
}

RigPairs by_name(const Frames& visible, const std::vector<std::string>& visible_names,
                 const Frames& thermal, const std::vector<std::string>& thermal_names) {
  std::map<std::string, const FrameRecord*> named;
  std::map<std::string, int> uses;
  for (std::size_t i = 0; i < visible.size(); ++i) {
    named[visible_names[i]] = visible[i];
    ++uses[visible_names[i]];
  }
  RigPairs result;
  for (std::size_t i = 0; i < thermal.size(); ++i) {
    const auto found = named.find(thermal_names[i]);
    // Two photos of one name leave open which of them is meant.
    if (found != named.end() && uses[found->first] == 1)
      result.pairs.emplace_back(found->second, thermal[i]);
  }
  return result;
}

RigPairs by_equal_name(const Frames& visible, const Frames& thermal) {
  RigPairs result = by_name(visible, stems_of(visible), thermal, stems_of(thermal));
  result.found_by = "equal file names";
  return result;
}

/// Whether numbers are times rather than a counter's, with or without a date before it: these lie
/// as close to each other as there are files.
bool are_times(const std::vector<std::string>& names) {
  constexpr std::size_t fewest_digits = 6;
  constexpr double apart = 100;  // a file, on average
  double least = std::numeric_limits<double>::infinity(), most = -least;
  std::size_t numbers = 0;
  for (const std::string& name : names) {
    std::string digits;
    std::copy_if(name.begin(), name.end(), std::back_inserter(digits), is_digit);
    if (digits.size() < fewest_digits) continue;
    ++numbers;
    double value = 0;
    for (const char digit : digits) value = 10 * value + (digit - '0');
    least = std::min(least, value), most = std::max(most, value);
  }
  return are_most(numbers, names.size()) && most - least >= apart * static_cast<double>(numbers);
}

/// Cameras of two sensors write a word beside the time or number ("-visible", "_T").
RigPairs by_number(const Frames& visible, const Frames& thermal, bool times) {
  const std::vector<std::string> numbers = without_words(stems_of(thermal));
  if (times != are_times(numbers)) return {};
  RigPairs result = by_name(visible, without_words(stems_of(visible)), thermal, numbers);
  result.found_by = "file names alike but for a word";
  return result;
}

const FrameRecord* nearest_in_time(const Frames& frames, std::int64_t time_ns) {
  const FrameRecord* best = nullptr;
  std::int64_t least = std::numeric_limits<std::int64_t>::max();
  for (const FrameRecord* frame : frames) {
    if (!frame->host_time_ns) continue;
    const auto apart = std::abs(*frame->host_time_ns - time_ns);
    if (apart > one_second_ns || apart >= least) continue;
    least = apart;
    best = frame;
  }
  return best;
}

RigPairs by_time(const Frames& visible, const Frames& thermal) {
  RigPairs result{{}, "times within a second"};
  for (const FrameRecord* frame : thermal) {
    if (!frame->host_time_ns) continue;
    const FrameRecord* partner = nearest_in_time(visible, *frame->host_time_ns);
    if (partner != nullptr && nearest_in_time(thermal, *partner->host_time_ns) == frame)
      result.pairs.emplace_back(partner, frame);
  }
  return result;
}

}  // namespace

RigPairs find_rig_pairs(const Session& session) {
  const Frames visible = session.frames_of(Modality::visible, false),
               thermal = session.frames_of(Modality::thermal, false);
  const auto note = session.notes.find(rig_note);
  const bool declared = note != session.notes.end() && note->second == "yes";
  const bool stations = std::any_of(thermal.begin(), thermal.end(),
                                    [](const FrameRecord* f) { return f->station.has_value(); });
  if (stations && !declared) return {};
  std::vector<RigPairs> ways{by_equal_name(visible, thermal), by_number(visible, thermal, true),
                             by_time(visible, thermal)};
  // Two cameras' counters agree by chance, until one of them misses a shot.
  if (declared) ways.push_back(by_number(visible, thermal, false));
  constexpr std::size_t fewest = 4;
  for (RigPairs& found : ways)
    if (found.pairs.size() >= fewest && are_most(found.pairs.size(), thermal.size())) {
      found.declared = declared;
      return std::move(found);
    }
  RigPairs none;
  none.declared = declared;
  return none;
}

}  // namespace orbitfuse
