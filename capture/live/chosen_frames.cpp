// SPDX-License-Identifier: BSD-3-Clause
#include "capture/live/chosen_frames.hpp"

namespace orbitfuse {
namespace {

/// The sector whose file the frame is.
std::optional<std::size_t> sector_of(const FrameRecord& frame, const std::vector<Sector>& sectors) {
  for (std::size_t i = 0; i < sectors.size(); ++i) {
    const auto best = sectors[i].best.find(frame.modality);
    if (best != sectors[i].best.end() && best->second.file == frame.file) return i;
  }
  return std::nullopt;
}

}  // namespace

void ChosenFrames::remember(const FrameRecord& frame, const std::vector<Sector>& sectors) {
  if (const std::optional<std::size_t> i = sector_of(frame, sectors)) by_sector_[*i] = frame;
}

Status ChosenFrames::choose(const FrameRecord& frame, const std::vector<Sector>& sectors,
                            const std::optional<OrbitPosition>& position, SessionWriter& writer) {
  const std::optional<std::size_t> i = sector_of(frame, sectors);
  if (!i) return {};
  if (frame.station && !frame.tracking) return {};  // written with its station
  const Sector& sector = sectors[*i];
  FrameRecord chosen = frame;
  chosen.tracking = false;
  chosen.station = Station{sector.loop,
                           sector.index,
                           position ? position->azimuth_deg : sector.azimuth_deg,
                           position ? position->elevation_deg : sector.elevation_deg,
                           1,
                           1};
  // The new one first: a crash between the two leaves two stations, never none.
  Status written = writer.amend(chosen);
  if (const auto before = by_sector_.find(*i); before != by_sector_.end()) {
    FrameRecord replaced = before->second;
    replaced.tracking = true;
    const Status demoted = writer.amend(replaced);
    if (written) written = demoted;
  }
  by_sector_[*i] = chosen;
  return written;
}

}  // namespace orbitfuse
