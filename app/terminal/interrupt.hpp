// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>

namespace orbitfuse::terminal {

/// Set by SIGINT, SIGTERM and, unless it is ignored (nohup), SIGHUP. One that comes more than a
/// second later ends the process at once with code 130; before, it is taken for the same wish: a
/// shell that goes away sends SIGHUP twice within a millisecond.
const std::atomic<bool>& interrupt_flag();
void install_interrupt_handler();

}  // namespace orbitfuse::terminal
