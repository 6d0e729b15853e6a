#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# From a fresh Debian 12 to the report: installs packages, builds, runs the whole job on the orbit
# in replay_data/ and says where the report is. Arguments go to `orbitfuse run`.
set -euo pipefail
cd "$(dirname "$0")/.."

cmake/install_packages.sh
cmake/build.sh --target orbitfuse
session=$(ls -d replay_data/*/ | head -n 1)
build/release/app/orbitfuse run "${session%/}" --out out/ "$@"
