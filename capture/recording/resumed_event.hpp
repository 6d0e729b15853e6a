// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include "capture/frame_source.hpp"

namespace orbitfuse {

/// What a source of finitely many frames tells when it goes on with a session: how many of them
/// are there already. Event "skipped", or "nothing-new" when the last one is among them.
inline Delivery resumed_event(std::size_t recorded, std::size_t all, bool up_to_the_last) {
  return event_delivery(up_to_the_last ? EventKind::nothing_new : EventKind::skipped,
                        fmt::format("{} of {} frames are in the session already{}", recorded, all,
                                    up_to_the_last ? ", the last one too: nothing is left" : ""));
}

}  // namespace orbitfuse
