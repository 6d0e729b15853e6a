// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>

namespace orbitfuse::terminal {

/// Set by SIGINT, SIGTERM and, unless it is ignored (nohup), SIGHUP; a second signal ends the
/// process at once with code 130.
const std::atomic<bool>& interrupt_flag();
void install_interrupt_handler();

}  // namespace orbitfuse::terminal
