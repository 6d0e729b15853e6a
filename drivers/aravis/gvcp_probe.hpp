// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <string>

namespace orbitfuse::aravis {

/// Whether a GigE Vision device answers a discovery request at this address in time. Opening a
/// camera that is away blocks Aravis for seconds; this asks first.
bool answers(const std::string& ip_address, std::chrono::milliseconds timeout);

}  // namespace orbitfuse::aravis
