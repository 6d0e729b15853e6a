// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include "capture/frame_source.hpp"

namespace orbitfuse {

/// What a source of finitely many frames tells when it goes on with a session: how many of them
/// are there already. Event "skipped", or "nothing-new" when the last one is among them.
inline Delivery resumed_event(std::size_t recorded, std::size_t all, bool up_to_the_last) {
  Delivery event;
  event.kind = Delivery::Kind::event;
  event.reason = up_to_the_last ? "nothing-new" : "skipped";
  event.detail = fmt::format("{} of {} frames are in the session already{}", recorded, all,
                             up_to_the_last ? ", the last one too: nothing is left" : "");
  return event;
}

}  // namespace orbitfuse
