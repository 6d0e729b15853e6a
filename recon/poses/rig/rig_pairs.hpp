// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/session/session.hpp"

namespace orbitfuse {

/// Frames of both modalities that one device shot at once.
struct RigPairs {
  std::vector<std::pair<const FrameRecord*, const FrameRecord*>> pairs;  ///< visible, thermal
  /// "equal file names", "file names alike but for a word", "times within a second"
  std::string found_by;
  bool declared = false;  ///< by the user, though there may be no pairs
};

/// The session's note that says whether its cameras are one rig ("yes"); import --rig writes it.
inline constexpr const char* rig_note = "rig";

/// Pairs by the names of the files that frames came from (an embedded photo bears its thermal
/// file's), else by names that differ in a word about a time, else by times within a second, where
/// four fifths of the thermal frames have a partner; of a declared rig at last by a counter that
/// words stand about.
/// Without the note, stations of the thermal frames' own say that they were shot apart: no pairs.
RigPairs find_rig_pairs(const Session& session);

}  // namespace orbitfuse
