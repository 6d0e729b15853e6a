// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "core/result.hpp"

namespace orbitfuse {

/// Where a page is served, and to whom.
struct PageOptions {
  std::string host =
      "127.0.0.1";             ///< the address to listen on; anything but loopback needs a token
  int port = 8470;             ///< 0: any free one
  std::string token;           ///< empty off loopback: a random one is made
  bool require_token = false;  ///< on loopback too

  Status validate() const;
};

/// Of "PORT" or "HOST:PORT", as `option` gave it ("--page"), which a usage error names.
Result<PageOptions> page_options_of(const std::string& option, const std::string& address,
                                    const std::string& token);

}  // namespace orbitfuse
