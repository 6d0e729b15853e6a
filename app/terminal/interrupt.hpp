// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>

namespace orbitfuse::terminal {

/// Set by SIGINT and SIGTERM; a second signal ends the process at once with code 130.
const std::atomic<bool>& interrupt_flag();
void install_interrupt_handler();

}  // namespace orbitfuse::terminal
