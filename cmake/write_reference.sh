#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Writes docs/cli.md and config/orbitfuse.toml from the program itself; tests hold them to it.
set -euo pipefail
cd "$(dirname "$0")/.."
program=build/release/app/orbitfuse

{
  cat docs/cli_intro.md
  printf '\n## orbitfuse\n\n```\n%s\n```\n' "$("$program" --help)"
  "$program" --help | sed -n '/Subcommands:/,$p' | awk '/^  [a-z]/ {print $1}' | while read -r verb; do
    printf '\n## %s\n\n```\n%s\n```\n' "$verb" "$("$program" "$verb" --help)"
  done
} > docs/cli.md

{
  cat <<'TEXT'
# SPDX-License-Identifier: BSD-3-Clause
# Every key but those of training recipes (recon/nerf/options.hpp) with its default: what `orbitfuse run`
# does without --config. Copy what you change into a file of your own and give it with --config, or set
# single keys with --set key=value.
TEXT
  "$program" run --print-config
} > config/orbitfuse.toml
