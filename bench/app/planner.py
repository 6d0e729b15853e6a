#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What the planner of `run --budget` was made from, and how well it does (docs/benchmarks/planner.md).

python3 bench/app/planner.py sweep SCENE... --out FILE.jsonl    # each knob alone, errors and seconds
python3 bench/app/planner.py curves FILE.jsonl                  # what error_curves.cpp was rounded from
python3 bench/app/planner.py budgets SCENE... --budgets 60 90 120 300 --out FILE.jsonl
python3 bench/app/planner.py rows FILE.jsonl                    # of `budgets`, for the page

SCENE: a recorded session with ground_truth.json (replay_data/*), or image folders with one (shared
data). Runs use all cores: leave the machine alone.
"""
import argparse
import json
import math
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROGRAM = Path(__file__).resolve().parents[2] / "build/release/app/orbitfuse"

# name: (last stage needed, options that differ from a run's without a budget)
SWEEP = {
    "thermal 600": ("train_thermal", ["train.thermal.iterations=600"]),
    "thermal 1200": ("train_thermal", ["train.thermal.iterations=1200"]),
    "thermal 4800": ("train_thermal", ["train.thermal.iterations=4800"]),
    "visible 1200": ("train_thermal", ["train.visible.iterations=1200"]),
    "visible 2400": ("train_visible", ["train.visible.iterations=2400"]),
    "visible 9600": ("train_visible", ["train.visible.iterations=9600"]),
    "visible 19200": ("train_visible", ["train.visible.iterations=19200"]),
    "visible 38400": ("train_visible", ["train.visible.iterations=38400"]),
    "depth 200": ("train_thermal", ["depth.width_px=200"]),
    "depth 400": ("train_thermal", ["depth.width_px=400"]),
}
FIRST_CHANGED = {"thermal": "train_thermal", "visible": "train_visible", "depth": "depth"}
STAGES = ["poses_visible", "depth", "train_visible", "poses_thermal", "train_thermal", "register",
          "render", "fuse", "metrics", "report"]


def call(*words):
    done = subprocess.run([str(PROGRAM), *map(str, words)], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}: exit {done.returncode}\n{done.stderr}")
    return done


def session_of(scene, work):
    """As an operator would record it: stations, order and lenses, no poses."""
    if (scene / "manifest.jsonl").exists():
        return scene
    session = work / "session"
    call("import", session, "--visible", scene / "visible", "--thermal", scene / "thermal",
         "--ground-truth", scene / "ground_truth.json", "--priors-only", "--station-spacing-deg", "30",
         "--loops", "2")
    return session


def errors_of(scene, session, out):
    done = call("eval", session, "--out", out, "--ground-truth", scene / "ground_truth.json", "--json")
    result = json.loads(done.stdout.splitlines()[-1])
    views, moved = result.get("test_views", {}), result.get("registration", {})
    return {"visible_psnr_db": views.get("visible_psnr_db"), "mae_k": views.get("temperature_mae_c"),
            "thermal_centres_percent": moved.get("ate_percent"), "thermal_posed": moved.get("posed")}


def seconds_of(out):
    seconds = {}
    for stage in STAGES:
        record = out / stage / "stage.json"
        if record.exists():
            stage_json = json.loads(record.read_text())
            seconds[stage] = {"wall_s": stage_json["wall_s"], "cpu_s": stage_json["cpu_s"]}
    return seconds


def sweep(args):
    for scene in map(Path, args.scenes):
        with tempfile.TemporaryDirectory() as temp:
            work = Path(temp)
            session, base = session_of(scene, work), work / "base"
            call("run", session, "--out", base, "-q")
            variants = {"usual": (None, []), **SWEEP}
            for name, (last, options) in variants.items():
                out = base
                if last:
                    out = work / "variant"
                    shutil.copytree(base, out)
                    first = STAGES.index(FIRST_CHANGED[name.split()[0]])
                    for stage in STAGES[first:]:
                        shutil.rmtree(out / stage, ignore_errors=True)
                    sets = [word for option in options for word in ("--set", option)]
                    call("run", session, "--out", out, "-q", "--stage", last, *sets)
                line = {"scene": scene.name, "name": name, "seconds": seconds_of(out),
                        **errors_of(scene, session, out)}
                with open(args.out, "a") as file:
                    file.write(json.dumps(line) + "\n")
                if last:
                    shutil.rmtree(out)


def curves(args):
    lines = [json.loads(line) for line in open(args.file)]
    usual = {line["scene"]: line for line in lines if line["name"] == "usual"}
    for name in SWEEP:
        gains, logs = [], []
        for line in (line for line in lines if line["name"] == name):
            base = usual[line["scene"]]
            if line["visible_psnr_db"] is not None:
                gains.append(line["visible_psnr_db"] - base["visible_psnr_db"])
            if line["mae_k"] and base["mae_k"]:
                logs.append(math.log(line["mae_k"] / base["mae_k"]))
        print(f"{name:14s}", "dB", [round(g, 2) for g in gains], "log K", [round(v, 2) for v in logs])
        if gains:
            print(" " * 14, "mean", round(sum(gains) / len(gains), 2), "dB",
                  f"{sum(logs) / len(logs):.2f} log K" if logs else "")


def budgets(args):
    for scene in map(Path, args.scenes):
        for budget in args.budgets:
            with tempfile.TemporaryDirectory() as temp:
                work = Path(temp)
                session, out = session_of(scene, work), work / "out"
                begin = time.monotonic()
                call("run", session, "--out", out, "-q",
                     *(["--budget", f"{budget}s"] if budget else []))
                wall_s = time.monotonic() - begin
                line = {"scene": scene.name, "budget_s": budget,
                        "wall_s": wall_s, "seconds": seconds_of(out),
                        **errors_of(scene, session, out)}
                if (out / "plan.json").exists():
                    plan = json.loads((out / "plan.json").read_text())
                    line |= {"fits": plan["plan"]["fits"],
                             "expected": {"wall_s": plan["expected_total_s"], **plan["expected"]},
                             "choices": plan["choices"], "measured": plan["measured"]}
                with open(args.out, "a") as file:
                    file.write(json.dumps(line) + "\n")


def rows(args):
    def pair(line, key, form):
        """As expected, and as the run measured it on its held-out frames."""
        if "expected" not in line:
            return ""
        came = line["measured"].get(key)
        return f"{line['expected'][key]:{form}} / " + (f"{came:{form}}" if came is not None else "")

    for line in map(json.loads, open(args.file)):
        budget = f"{line['budget_s']} s" if line["budget_s"] else "none"
        if line.get("fits") is False:
            budget += ", said to be too few"
        expected = f"{line['expected']['wall_s']:.0f} / " if "expected" in line else ""
        print(f"| `{line['scene']}` | {budget} | {expected}{line['wall_s']:.1f} | "
              f"{pair(line, 'visible_psnr_db', '.1f')} | {pair(line, 'thermal_mae_k', '.2f')} | "
              f"{line['visible_psnr_db']:.1f} dB, {line['mae_k']:.2f} K | {line['thermal_posed']} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    for name, run in {"sweep": sweep, "budgets": budgets}.items():
        command = commands.add_parser(name)
        command.add_argument("scenes", nargs="+")
        command.add_argument("--out", required=True)
        if name == "budgets":
            command.add_argument("--budgets", nargs="+", type=int, default=[60, 90, 120, 300],
                                 help="seconds; 0: a run without a budget")
        command.set_defaults(run=run)
    for name, show in {"curves": curves, "rows": rows}.items():
        command = commands.add_parser(name)
        command.add_argument("file")
        command.set_defaults(run=show)
    args = parser.parse_args()
    args.run(args)


if __name__ == "__main__":
    main()
