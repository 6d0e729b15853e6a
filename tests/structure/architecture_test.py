#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ARCHITECTURE.md names what is there: its files exist, and its functions and types stand in a source."""
import re
import sys
from pathlib import Path

root = Path(__file__).resolve().parents[2]
folders = ["core", "capture", "drivers", "recon", "fusion", "app", "bench", "cmake", "config", "docs", "packaging", "tests"]
files = [p.relative_to(root).as_posix() for f in folders for p in (root / f).rglob("*") if p.is_file()]
files += [p.name for p in root.iterdir() if p.is_file()]
code = {".cpp", ".hpp", ".cu", ".js", ".css", ".html", ".txt", ".cmake"}
words = set()
for file in files:
    if Path(file).suffix in code:
        words |= set(re.findall(r"\w+", (root / file).read_text(errors="replace")))


def is_there(path):
    path = path.strip("/")
    return any(f == path or f.startswith(path + "/") or f.endswith("/" + path) or f"/{path}/" in f for f in files)


text = re.sub(r"```.*?```", "", (root / "ARCHITECTURE.md").read_text(), flags=re.DOTALL)
wrong = []
checked = 0
for name in dict.fromkeys(re.findall(r"`([^`]+)`", text)):
    # Not a name: a relation, a pattern, an option, what a build or a run makes.
    if re.search(r"[*<{ =]", name) or name.startswith(("--", "out/", "build/")) or name.endswith("_"):
        continue
    checked += 1
    if "/" in name or re.search(r"\.(cpp|hpp|js|md|html)$", name):
        if not is_there(name):
            wrong.append(f"no file {name}")
    elif re.split(r"::|\.", name.split("(")[0])[-1] not in words:
        wrong.append(f"no source has {name}")
print("\n".join(wrong) or f"{checked} names")
sys.exit(bool(wrong) or checked < 100)
