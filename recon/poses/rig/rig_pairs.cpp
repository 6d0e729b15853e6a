// SPDX-License-Identifier: BSD-3-Clause
#include "recon/poses/rig/rig_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>

namespace orbitfuse {
namespace {

using Frames = std::vector<const FrameRecord*>;

constexpr std::int64_t one_second_ns = 1'000'000'000;

std::string stem_of(const FrameRecord& frame) {
  return std::filesystem::path(frame.source.empty() ? frame.file : frame.source).stem().string();
}

RigPairs by_name(const Frames& visible, const Frames& thermal) {
  std::map<std::string, const FrameRecord*> by_stem;
  std::map<std::string, int> uses;
  for (const FrameRecord* frame : visible) {
    by_stem[stem_of(*frame)] = frame;
    ++uses[stem_of(*frame)];
  }
  RigPairs result{{}, "equal file names"};
  for (const FrameRecord* frame : thermal) {
    const auto found = by_stem.find(stem_of(*frame));
    // Two photos of one name leave open which of them is meant.
    if (found != by_stem.end() && uses[found->first] == 1)
      result.pairs.emplace_back(found->second, frame);
  }
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
  constexpr std::size_t fewest = 4;
  for (RigPairs found : {by_name(visible, thermal), by_time(visible, thermal)})
    if (found.pairs.size() >= fewest && 5 * found.pairs.size() >= 4 * thermal.size()) return found;
  return {};
}

}  // namespace orbitfuse
