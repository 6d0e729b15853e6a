// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/live/live_state.hpp"
#include "capture/recording/latest_frame.hpp"

namespace orbitfuse {

struct PageOptions {
  std::string host =
      "127.0.0.1";             ///< the address to listen on; anything but loopback needs a token
  int port = 8470;             ///< 0: any free one
  std::string token;           ///< empty off loopback: a random one is made
  bool require_token = false;  ///< on loopback too

  Status validate() const;
};

/// What a button does: in words for whoever pressed it what came of it, or why nothing did.
using PageAction = std::function<Result<std::string>()>;

/// What the page shows and does. All are called from the server's threads.
struct PageHooks {
  std::function<LiveState()> state;
  /// The newest frame of a modality; nothing: none yet.
  std::function<std::optional<LatestFrame>(Modality)> latest;
  PageAction start, stop, at_station, correct;  ///< may be empty
};

/// The capture page. It answers with one page without any outside address, its state as JSON,
/// previews as JPEG and temperatures; a content security policy keeps browsers from asking anybody
/// else. Requests without the token (where one is needed) get 401; requests for another host name
/// than an address or localhost get 403 (DNS rebinding); changes need a POST with the header
/// X-OrbitFuse, which other sites' pages cannot send. Peers that are slow or silent hold up neither
/// other viewers nor the end of the program (ConnectionGate).
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
