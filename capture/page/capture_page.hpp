// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "capture/live/live_state.hpp"
#include "capture/recording/latest_frame.hpp"
#include "core/http/web_server.hpp"

namespace orbitfuse {

/// What a button does: in words for whoever pressed it what came of it, or why nothing did.
using PageAction = std::function<Result<std::string>()>;

/// What the page shows and does. All are called from the server's threads.
struct PageHooks {
  std::function<LiveState()> state;
  /// The newest frame of a modality; nothing: none yet.
  std::function<std::optional<LatestFrame>(Modality)> latest;
  PageAction start, stop, at_station, correct;  ///< may be empty
};

/// The capture page, for a WebServer: one page without any outside address, its state as JSON,
/// previews as JPEG and temperatures; a content security policy keeps browsers from asking anybody
/// else.
WebSite capture_page(PageHooks hooks);

}  // namespace orbitfuse
