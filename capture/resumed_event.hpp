// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include "capture/frame_source.hpp"

namespace orbitfuse {

/// What a source of finitely many frames tells when it goes on with a session: how many of them
/// are there already. Event "skipped", or "nothing-new" when that is all of them.
inline Delivery resumed_event(std::size_t recorded, std::size_t all) {
  Delivery event;
  event.kind = Delivery::Kind::event;
  event.reason = recorded < all ? "skipped" : "nothing-new";
  event.detail = recorded < all
                     ? fmt::format("{} of {} frames are in the session already", recorded, all)
                     : fmt::format("all {} frames are in the session already", all);
  return event;
}

}  // namespace orbitfuse
