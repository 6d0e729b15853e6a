#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# On a processor without AVX2 the program says so, whatever it is asked; on the oldest one with AVX2 it
# runs. Both are emulated: old_processor.sh PROGRAM. Exit code 77: skipped.
set -euo pipefail
program=$1
command -v qemu-x86_64 > /dev/null || { echo "SKIPPED: install first: apt-get install qemu-user" >&2; exit 77; }

for verb in --version doctor; do
  status=0
  said=$(qemu-x86_64 -cpu Nehalem "$program" "$verb" 2>&1) || status=$?
  [ "$status" -eq 6 ] && [[ $said == *"no AVX2"* ]] ||
    { echo "FAILED: without AVX2, $verb: exit code $status, $said" >&2; exit 1; }
done
qemu-x86_64 -cpu Haswell "$program" --version 2> /dev/null | grep -q '^orbitfuse ' ||
  { echo "FAILED: no version on a Haswell" >&2; exit 1; }
