// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "capture/guide/coverage.hpp"
#include "capture/recording/session_writer.hpp"
#include "core/session/session.hpp"

namespace orbitfuse {

/// The frames of one camera that stand for sectors, as the session's manifest marks them: a chosen
/// frame has its sector's station, one that a better frame replaced is a tracking frame again.
class ChosenFrames {
 public:
  /// `frame` was judged good: where it is now the file of a sector, the manifest is amended.
  /// `position`: where it was taken; absent: in the middle of its sector. Device error where the
  /// manifest can't be written; the choice holds all the same.
  Status choose(const FrameRecord& frame, const std::vector<Sector>& sectors,
                const std::optional<OrbitPosition>& position, SessionWriter& writer);
  /// Of an earlier recording: to be demoted when a better one comes.
  void remember(const FrameRecord& frame, const std::vector<Sector>& sectors);

 private:
  std::map<std::size_t, FrameRecord> by_sector_;
};

}  // namespace orbitfuse
