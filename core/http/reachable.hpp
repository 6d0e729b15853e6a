// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace orbitfuse {

/// Addresses to type into a browser for a server bound to `host`: `host` itself, or for a wildcard
/// (0.0.0.0, ::) those of this machine's interfaces that are up, others' before the loopback's.
std::vector<std::string> reachable_hosts(const std::string& host);

}  // namespace orbitfuse
