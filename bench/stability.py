#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Every stress case of the computing modules: what it must give, and whether it gave it here.

python3 bench/stability.py            # runs them (20 s) and prints the table's rows
python3 bench/stability.py --list     # names alone

A case is a test whose name tells it: degenerate geometry, extreme scales, values that aren't finite,
constant images, empty sets, one thread against many, one instruction set against another.
"""
import re
import subprocess
import sys
from pathlib import Path

BUILD = Path(__file__).resolve().parent.parent / "build/release"

KINDS = {
    "degenerate geometry": {"degenerate", "coplanar", "collinear", "parallax", "symmetric", "slide"},
    "extreme scales": {"extreme", "huge", "tiny"},
    "not finite": {"nan", "nans", "infinity", "infinite", "finite"},
    "constant images": {"constant", "flat", "blank", "featureless"},
    "empty sets": {"empty", "zeros"},
    "1 and n threads": {"threads"},
    "instruction sets": {"isa", "instruction", "amx"},
}
# Derivatives are compared with finite differences in many a test.
PASSED_OVER = {"differences"}


def words(name):
    return [word.lower() for word in re.findall(r"[A-Z][a-z0-9]*|[a-z0-9]+", name)]


def kinds_of(name):
    told = words(name)
    if PASSED_OVER & set(told):
        return []
    kinds = [kind for kind, marks in KINDS.items() if marks & set(told)]
    if re.search(r"NotANumber|NotFinite", name):
        kinds.append("not finite")
    if re.search(r"\.Nothing|OfNothing|\.NoViews", name):  # "changes nothing" is no empty set
        kinds.append("empty sets")
    if "thread" in told and {"any", "count"} & set(told):
        kinds.append("1 and n threads")
    return list(dict.fromkeys(kinds))


def programs():
    found = [program for folder in ("core", "recon", "fusion")
             for program in sorted((BUILD / "tests" / folder).rglob("*_test")) if program.is_file()]
    if not found:
        sys.exit(f"no test programs in {BUILD}: build them first")
    return found


def tests_of(program):
    listed = subprocess.run([program, "--gtest_list_tests"], capture_output=True, text=True)
    if listed.returncode != 0:
        sys.exit(f"{program} can't list its tests")
    suite = ""
    for line in listed.stdout.splitlines():
        if line and not line.startswith(" "):
            suite = line.split("#")[0].strip()
        elif line.strip() and suite.endswith("."):
            yield suite + line.split("#")[0].strip()


def gave(program, names):
    """Those of `names` that passed, and those this machine can't run; a case that crashes is no pass,
    nor are those behind it."""
    done = subprocess.run([program, "--gtest_filter=" + ":".join(names)], capture_output=True,
                          text=True)
    return [{name for name in names if f"[  {state} ] {name} (" in done.stdout}
            for state in ("     OK", "SKIPPED")]


def main():
    totals = dict.fromkeys(KINDS, 0)
    failed = []
    if "--list" not in sys.argv:
        print("| module | " + " | ".join(KINDS) + " |")
        print("|---|" + "---|" * len(KINDS))
    for program in programs():
        cases = {name: kinds for name in tests_of(program) if (kinds := kinds_of(name))}
        if not cases:
            continue
        if "--list" in sys.argv:
            for name, kinds in cases.items():
                print(program.name, name, ", ".join(kinds))
            continue
        passed, skipped = gave(program, list(cases))
        failed += [name for name in cases if name not in passed | skipped]
        cells = []
        for kind in KINDS:
            of_kind = [name for name, kinds in cases.items() if kind in kinds]
            totals[kind] += len(of_kind)
            right = sum(name in passed for name in of_kind)
            out = sum(name in skipped for name in of_kind)
            cells.append((f"{right} of {len(of_kind)}" + (f", {out} not here" if out else ""))
                         if of_kind else "")
        print(f"| `{program.name}` | " + " | ".join(cells) + " |")
    if "--list" not in sys.argv:
        print("| all | " + " | ".join(str(total) for total in totals.values()) + " |")
    for name in failed:
        print("failed:", name, file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
