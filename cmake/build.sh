#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Configures and builds the release preset; arguments go to the build (e.g. --target orbitfuse).
set -euo pipefail
cd "$(dirname "$0")/.."

launcher=(-DORBITFUSE_PRECOMPILE=ON)
if command -v ccache > /dev/null; then
  launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache
            -DORBITFUSE_PRECOMPILE=OFF)
fi
cmake --preset release "${launcher[@]}"
cmake --build --preset release "$@"
