#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What slurm_farm.sh asks of a farm's folder: one order a call, code 1 with what does not hold."""
import json
import pathlib
import re
import sys
import time

SLOTS = 2


def outcome(farm, session, stage):
    record = farm / ".farm" / session / f"{stage}.json"
    return json.loads(record.read_text()) if record.exists() else {"state": "waiting", "starts": 0}


def plan_of(farm):
    return json.loads((farm / "farm.json").read_text())


def without_times(value):
    """Of a result, what two runs of the same session must have in common."""
    if isinstance(value, dict):
        return {k: without_times(v) for k, v in value.items() 
                if not k.endswith("_s") and not k.startswith("milliseconds")}
    if isinstance(value, str):  # "brief": "60 steps, 1.5 CPU s, ...", "0.13 s a view"
        return re.sub(r"[0-9.]+ (CPU s|s a view)", "TIME", value)
    return [without_times(v) for v in value] if isinstance(value, list) else value


def differences(mine, theirs, stage):
    """Every file a stage lists, by its hash; the training's curve without its times; of the report,
    which tells times and paths, which files there are."""
    if not theirs.exists():
        return ["the single run has no such result"]
    if not mine.exists():
        return ["no result"]
    a, b = (json.loads((f / "stage.json").read_text()) for f in (mine, theirs))
    found = [] if without_times(a["metrics"]) == without_times(b["metrics"]) or stage == "report" else ["metrics differ"]
    a, b = ({o["file"]: o["hash"] for o in record["outputs"]} for record in (a, b))
    if a.keys() != b.keys():
        found.append(f"files differ: {sorted(a.keys() ^ b.keys())}")
    if stage == "report":
        return found
    for name in a.keys() & b.keys():
        if a[name] == b[name]:
            continue
        if name == "curve.json":
            x, y = (without_times(json.loads((f / name).read_text())) for f in (mine, theirs))
            if x == y:
                continue
        found.append(f"{name} differs")
    return found


def check_against_single(farm, single, session, stages):
    bad = []
    for stage in stages:
        if outcome(farm, session, stage)["state"] != "done":
            bad.append(f"{session}/{stage}: {outcome(farm, session, stage)}")
        bad += [f"{session}/{stage}: {d}" for d in differences(farm / session / stage, single / stage, stage)]
    if not (farm / session / "report" / "report.html").exists():
        bad.append(f"{session}: no report")
    return bad


def check_farm(farm, single, interrupted, broken):
    farm, single = pathlib.Path(farm), pathlib.Path(single)
    broken, cause = broken.split("=")
    plan, bad, same = plan_of(farm), [], 0
    for session in (s["name"] for s in plan["sessions"]):
        for stage in plan["stages"]:
            expected = 2 if f"{session}/{stage}" == interrupted else 1
            if session == broken:
                expected = int(stage == plan["stages"][0])
            if outcome(farm, session, stage)["starts"] != expected:
                bad.append(f"{session}/{stage}: {outcome(farm, session, stage)['starts']} starts, {expected} expected")
        if session != broken:
            found = check_against_single(farm, single, session, plan["stages"])
            same += not found
            bad += found
    first = outcome(farm, broken, plan["stages"][0])
    if first["state"] != "failed" or cause not in first["cause"]:
        bad.append(f"{broken}: {first}, {cause} expected")
    rows = (farm / "farm.csv").read_text()
    if cause not in rows or broken not in (farm / "farm.html").read_text():
        bad.append(f"{broken} is not in the overview with its cause")
    print(f"{same} sessions equal to the single run; {interrupted} started twice; {broken}: {first['cause']}")
    return bad


def check_resumed(farm, single):
    farm, single = pathlib.Path(farm), pathlib.Path(single)
    plan, bad, twice = plan_of(farm), [], []
    for session in (s["name"] for s in plan["sessions"]):
        bad += check_against_single(farm, single, session, plan["stages"])
        twice += [(session, stage) for stage in plan["stages"] if outcome(farm, session, stage)["starts"] == 2]
        bad += [f"{session}/{stage}: more than two starts" for stage in plan["stages"]
                if outcome(farm, session, stage)["starts"] > 2]
    if ("car1", "train_visible") not in twice or len({session for session, _ in twice}) < len(twice):
        bad.append(f"started twice: {twice}; one a session, car1's training among them, expected")
    log = (farm / ".farm" / "car1" / "train_visible.log").read_text()
    stopped = re.search("stopped by the user at step ([1-9][0-9]*)", log)
    if not stopped:
        bad.append("car1's training was not stopped between two steps, with its checkpoint")
    print(f"cancelled at step {stopped and stopped[1]} and resumed: started twice {twice}")
    return bad


def check_gathered(farm):
    farm = pathlib.Path(farm)
    plan, bad = plan_of(farm), []
    starts = {"a": 1, "b": 2, "c": 2}
    for session, expected in starts.items():
        for stage in plan["stages"]:
            o = outcome(farm, session, stage)
            if o["state"] != "done" or o["starts"] != (expected if stage == "depth" else 1):
                bad.append(f"{session}/{stage}: {o}")
    if plan["needs"]["depth"]["time_min"] <= plan["needs"]["fuse"]["time_min"]:
        bad.append(f"depth ran out of time and got no more: {plan['needs']['depth']}")
    gathers = list((farm / ".farm" / "slurm").glob("gather-*.log"))
    if len(gathers) != 2:
        bad.append(f"{len(gathers)} gathering jobs, 2 expected")
    print(f"gathered: depth's time {plan['needs']['depth']['time_min']} min")
    return bad


def check_measured(farm, stage_s, begin):
    farm, stage_s = pathlib.Path(farm), float(stage_s)
    plan, wall = plan_of(farm), time.time() - float(begin)
    outcomes = [outcome(farm, s["name"], stage) for s in plan["sessions"] for stage in plan["stages"]]
    work = sum(o["wall_s"] for o in outcomes if o["state"] == "done")
    cost = (SLOTS * wall - work) / len(outcomes)
    print(f"{len(outcomes)} stages of {work / len(outcomes):.2f} s ({stage_s} asked for) in {SLOTS} slots: "
          f"{wall:.1f} s of wall time; idle {cost:.2f} s a stage, {100 * cost / (work / len(outcomes) + cost):.1f} %; "
          f"{len(plan['slurm']['rounds'][0]['jobs']) - 1} jobs a session")
    return [f"{o}" for o in outcomes if o["state"] != "done"]


def edit(farm, field, value):
    file = pathlib.Path(farm) / "farm.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), field: value}))
    return []


def running(farm, session):
    """The stage that runs, or nothing."""
    print(next((s for s in plan_of(pathlib.Path(farm))["stages"]
                if outcome(pathlib.Path(farm), session, s)["state"] == "running"), ""))
    return []


def state(farm, session, stage):
    print(outcome(pathlib.Path(farm), session, stage)["state"])
    return []


ORDERS = {"farm": check_farm, "resumed": check_resumed, "gathered": check_gathered,
          "measured": check_measured, "edit": edit, "state": state, "running": running}
failures = ORDERS[sys.argv[1]](*sys.argv[2:])
print("\n".join(failures), end="\n" if failures else "")
sys.exit(bool(failures))
