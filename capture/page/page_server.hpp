// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/live/live_state.hpp"
#include "capture/recording/latest_frame.hpp"
#include "core/http/page_options.hpp"

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

/// The capture page on a WebServer. It answers with one page without any outside address, its state
/// as JSON, previews as JPEG and temperatures; a content security policy keeps browsers from asking
/// anybody else.
class PageServer {
 public:
  PageServer(PageOptions options, PageHooks hooks);
  ~PageServer();

  /// Device error with the remedy when the port is taken or the address is not this machine's.
  Status start();
  void stop();
  /// The answer, head and body, to the bytes of one request, without a connection; what start()
  /// serves. From any thread.
  std::string answer(const std::string& request);
  int port() const;
  /// What to open, the token included where one is needed: the first of urls().
  std::string url() const;
  /// For a wildcard address one for each of the machine's own, the loopback's last.
  std::vector<std::string> urls() const;
  const std::string& token() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace orbitfuse
