// SPDX-License-Identifier: BSD-3-Clause
#include "core/session/lost_lines.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

namespace orbitfuse {
namespace {

/// First id and the one after the last.
using Span = std::pair<std::uint64_t, std::uint64_t>;

struct Stream {
  std::vector<Span> lines;  ///< of frames and gaps
  std::optional<Span> all;  ///< what they must stand for, each id

  void reach(const Span& span) {
    if (!all) all = span;
    all = Span(std::min(all->first, span.first), std::max(all->second, span.second));
  }
  void add(const Span& span) {
    lines.push_back(span);
    reach(span);
  }
};

}  // namespace

std::vector<LostLines> lost_lines(const Session& session) {
  std::map<std::string, Stream> streams;
  for (const FrameRecord& frame : session.frames)
    streams[frame.device].add({frame.sequence, frame.sequence + 1});
  for (const GapRecord& gap : session.gaps)
    streams[gap.device].add({gap.first_sequence, gap.first_sequence + gap.count});
  for (const StreamRecord& stream : session.streams)
    streams[stream.device].reach({stream.first_sequence, stream.last_sequence + 1});
  std::vector<LostLines> found;
  for (auto& [device, stream] : streams) {
    if (!stream.all) continue;
    std::sort(stream.lines.begin(), stream.lines.end());
    stream.lines.emplace_back(stream.all->second, stream.all->second);
    LostLines lost{device};
    std::uint64_t next = stream.all->first;
    for (const auto& [first, end] : stream.lines) {
      if (first > next) {
        if (lost.count == 0) lost.first_sequence = next;
        lost.count += first - next;
      }
      next = std::max(next, end);
    }
    if (lost.count > 0) found.push_back(lost);
  }
  return found;
}

}  // namespace orbitfuse
