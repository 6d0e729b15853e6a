// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/result.hpp"

namespace orbitfuse::terminal {

/// Documented in docs/cli.md; scripts rely on them.
enum ExitCode {
  exit_ok = 0,
  exit_usage = 2,
  exit_input = 3,
  exit_device = 4,
  exit_quality = 5,
  exit_unavailable = 6,
  exit_internal = 70,
  exit_interrupted = 130,
};

constexpr ExitCode exit_code(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::usage:
      return exit_usage;
    case ErrorKind::input:
      return exit_input;
    case ErrorKind::device:
      return exit_device;
    case ErrorKind::quality:
      return exit_quality;
    case ErrorKind::unavailable:
      return exit_unavailable;
    case ErrorKind::cancelled:
      return exit_interrupted;
  }
  return exit_internal;
}

}  // namespace orbitfuse::terminal
