#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws each benchmark page's plot from the page's own table: docs/benchmarks/PAGE.svg.

python3 bench/plot_pages.py            # draws all
python3 bench/plot_pages.py --check    # exit code 1, and names, where a plot is not its table's
"""
import re
import sys
import textwrap
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))  # the tests load this file by its path
from page_tables import (number, numbers, table_with, tables_of)
from svg_plot import (ASKED, Axis, Drawing, EDGE, FIRST, FRAME, PANEL_TOP, SECOND, WIDTH, frame_below,
                      frame_left, from_zero, label_points, legend, logarithmic, row_label, short,
                      text_width)

PAGES = Path(__file__).resolve().parent.parent / "docs" / "benchmarks"



def seconds(cell):
    minutes = re.search(r"([\d.]+) min (\d+)", cell)
    return 60 * float(minutes[1]) + float(minutes[2]) if minutes else number(cell)


def draw_run(page):
    """A row a stage, a bar a session, what the stage's error is beside its bar."""
    table = table_with(page, "stage")
    sessions = [(i, head[:head.index(", s")]) for i, head in enumerate(table.heads) if ", s" in head]
    stages = [row for row in table.rows if row[0] != "all"]
    whole = [row for row in table.rows if row[0] == "all"]
    left, bar, row_height = 168, 15, 42
    # What follows a semicolon in the table is too long to stand beside a bar.
    texts = {(r, i): f"{row[i]} s" + (f", {row[i + 1].split(';')[0]}" if row[i + 1] else "")
             for r, row in enumerate(stages) for i, _ in sessions if seconds(row[i]) is not None}
    # As many pixels a second as leave room for the text behind each bar.
    per_second = min((WIDTH - EDGE - 6 - left - text_width(text)) / max(seconds(stages[r][i]), 1)
                     for (r, i), text in texts.items())
    longest = max(seconds(stages[r][i]) for r, i in texts)
    axis = Axis(0, longest, left, left + per_second * longest)
    drawing = Drawing()
    bottom = PANEL_TOP + row_height * len(stages)
    frame_below(drawing, axis, PANEL_TOP, bottom, "wall seconds (lower is better)")
    entries = []
    for color, (i, name) in zip((FIRST, SECOND), sessions):
        total = f", all: {whole[0][i]}" if whole else ""
        entries.append(("bar", color, f"{name}{total}"))
    legend(drawing, left, entries)
    for r, row in enumerate(stages):
        y = PANEL_TOP + row_height * r + 5
        row_label(drawing, left - 8, y + bar, textwrap.wrap(row[0], 24))
        for k, (i, _) in enumerate(sessions):
            if (r, i) in texts:
                end = axis.at(seconds(row[i]))
                drawing.bar(left, end, y + k * (bar + 1), bar, (FIRST, SECOND)[k % 2])
                drawing.text(end + 6, y + k * (bar + 1) + 12, texts[r, i])
    return drawing.svg(bottom + 46)


def draw_registration(page):
    """CPU time against the error of rotation, a point a level."""
    table = table_with(page, "level", "success", "rotation", "CPU ms")
    right, rotation, time = (table.column(c) for c in ("success", "rotation", "CPU ms"))
    rows = [row for row in table.rows
            if number(row[rotation]) is not None and number(row[time]) is not None]
    left, bottom = 70, 380
    across = from_zero([number(row[time]) for row in rows], left, WIDTH - 30)
    upwards = logarithmic([number(row[rotation]) for row in rows], bottom, PANEL_TOP)
    drawing = Drawing()
    frame_below(drawing, across, PANEL_TOP, bottom, "CPU ms, median (lower is better)")
    frame_left(drawing, upwards, left, WIDTH - 30,
               "rotation error of right answers, deg, median (lower is better), log", 24)
    legend(drawing, left, [("dot", FIRST, "a level, with its right answers")])
    points = []
    for row in rows:
        x, y = across.at(number(row[time])), upwards.at(number(row[rotation]))
        drawing.dot(x, y, FIRST)
        points.append((x, y, f"{row[0]}: {row[right].split()[0]}"))
    label_points(drawing, points, (left, PANEL_TOP - 8, WIDTH, bottom))
    return drawing.svg(bottom + 46)


def error_panel(drawing, cells, middles, axis, bottom, asked, label):
    """A row's usual error as a dot and its worst as a ring; a line at what is asked."""
    frame_below(drawing, axis, PANEL_TOP, bottom, label)
    if asked is not None:
        drawing.line(axis.at(asked), PANEL_TOP, axis.at(asked), bottom, ASKED, dash=True)
    for cell, y in zip(cells, middles):
        found = numbers(cell)
        if not found:
            drawing.text(axis.start + 6, y + 4, cell or "-")
            continue
        drawing.line(axis.at(found[0]), y, axis.at(found[-1]), y, FIRST)
        drawing.dot(axis.at(found[-1]), y, FIRST, ring=True)
        drawing.dot(axis.at(found[0]), y, FIRST)


def error_axis(cells, asked, start, end):
    """From 0; logarithmic where small errors would lie on one heap."""
    values = [asked] + [v for cell in cells for v in numbers(cell)]
    if max(values) > 15 * min(values):
        return logarithmic(values, start, end)
    return from_zero(values, start, end)


def draw_poses(page, bars=(1.0, 1.0)):
    """A row a scene: its centres' and its rotations' errors, CPU seconds at the right."""
    table = table_with(page, "scene", "centres", "rotation", "CPU s")
    scene, centres, rotation, time = (
        table.column(c) for c in ("scene", "centres", "rotation", "CPU s"))
    told = [i for i, head in enumerate(table.heads) if head in ("perturbation", "posed", "now")]
    names = [", ".join([row[scene]] + [row[i] for i in told]) for row in table.rows]
    labels = [textwrap.wrap(name, 26) for name in names]
    middles, y = [], PANEL_TOP
    for lines in labels:
        high = max(28, 14 * len(lines) + 8)
        middles.append(y + high / 2)
        y += high
    drawing = Drawing()
    legend(drawing, 184, [("dot", FIRST, "centres: RMS, rotation: mean"), ("ring", FIRST, "worst view"),
                          ("line", ASKED, f"bar: {bars[0]:g} %, {bars[1]:g} deg")])
    panels = ((centres, 184, 390, "centres, %", bars[0]),
              (rotation, 432, 638, "rotation, deg", bars[1]))
    for column, start, end, unit, bar in panels:
        cells = [row[column] for row in table.rows]
        axis = error_axis(cells, bar, start, end)
        label = f"{unit} (lower is better)" + (", log" if axis.log else "")
        error_panel(drawing, cells, middles, axis, y, bar, label)
    drawing.text(WIDTH - EDGE, PANEL_TOP - 6, "CPU s", "end")
    for row, lines, middle in zip(table.rows, labels, middles):
        row_label(drawing, 174, middle, lines)
        drawing.text(WIDTH - EDGE, middle + 4, row[time].split()[0] if row[time] else "-", "end")
    return drawing.svg(y + 46)


def quality_panel(drawing, table, column, left, right, bottom):
    time = table.column("CPU ms")
    timed = [row for row in table.rows if number(row[time]) is not None]
    values = [number(row[column]) for row in table.rows if number(row[column]) is not None]
    across = from_zero([number(row[time]) for row in timed], left, right)
    low, high = min(values), max(values)
    upwards = Axis(low - 0.08 * (high - low), high + 0.08 * (high - low), bottom, PANEL_TOP)
    frame_below(drawing, across, PANEL_TOP, bottom, "CPU ms (lower is better)")
    frame_left(drawing, upwards, left, right, f"{table.heads[column].split()[0]} (higher is better)",
               left - 44)
    points, written = [], []
    for row in table.rows:
        quality = number(row[column])
        if quality is None:
            continue
        y = upwards.at(quality)
        if row in timed:
            drawing.dot(across.at(number(row[time])), y, FIRST)
            points.append((across.at(number(row[time])), y, row[0]))
        else:
            drawing.line(left, y, right, y, SECOND, dash=True)
            name = row[0].removeprefix("reference ")
            drawing.text(left + 4, y - 4, name, fill=SECOND)
            written.append((left + 4, y - 15, left + 4 + text_width(name), y))
    label_points(drawing, points, (left, PANEL_TOP - 8, right, bottom), written)


def draw_fusion(page):
    """CPU time against Qabf and Qcb; references without a time are lines."""
    table = table_with(page, "method", "Qabf", "Qcb", "CPU ms")
    drawing, bottom = Drawing(), 360
    legend(drawing, 70, [("dot", FIRST, "ours"), ("line", SECOND, "reference's result, no time known")])
    quality_panel(drawing, table, table.column("Qabf"), 70, 346, bottom)
    quality_panel(drawing, table, table.column("Qcb"), 412, 688, bottom)
    return drawing.svg(bottom + 46)


def better_by(value, reference, head):
    """Percent; the column's head says which way is better."""
    if "higher" not in head and "lower" not in head:
        raise ValueError(f"head '{head}' does not say which way is better")
    return (100.0 if "higher" in head else -100.0) * (value / reference - 1.0)


def draw_cnn_lpif(page):
    """Percent better than the reference, metric by metric, and what is asked."""
    table = table_with(page, "method", "Qabf", "Qcb", "Qcv", "SSIM")
    rows = {row[0].split()[0].rstrip(","): row for row in table.rows}
    metrics = [table.column(name) for name in ("Qabf", "Qcb", "Qcv", "SSIM")]
    shares = {name: [better_by(number(rows[name][i]), number(rows["reference"][i]), table.heads[i])
                     for i in metrics] for name in ("ours", "bar")}
    values = shares["ours"] + shares["bar"] + [0.0]
    pad = 0.12 * (max(values) - min(values))
    room_for_text = 190
    axis = Axis(min(values) - pad, max(values), 70, WIDTH - room_for_text)
    drawing, row_height = Drawing(), 38
    bottom = PANEL_TOP + row_height * len(metrics)
    frame_below(drawing, axis, PANEL_TOP, bottom, "better than the reference by, % (higher is better)")
    legend(drawing, 70, [("bar", FIRST, "ours"), ("line", ASKED, "asked")])
    for k, i in enumerate(metrics):
        y = PANEL_TOP + row_height * k
        row_label(drawing, 60, y + row_height / 2, [table.heads[i].split()[0]])
        end = axis.at(shares["ours"][k])
        drawing.bar(axis.at(0), end, y + 10, 18, FIRST)
        asked = axis.at(shares["bar"][k])
        drawing.line(asked, y + 4, asked, y + row_height - 4, ASKED, dash=True)
        drawing.text(max(end, axis.at(0), asked) + 6, y + row_height / 2 + 4,
                     f'{shares["ours"][k]:+.1f} % ({rows["ours"][i]}, reference {rows["reference"][i]})')
    drawing.line(axis.at(0), PANEL_TOP, axis.at(0), bottom)
    return drawing.svg(bottom + 46)


def draw_outages(page):
    """The ways of losing a camera: how soon it is told, how soon frames come again."""
    table = table_with(page, "case", "told after", "back after")
    told, back = table.column("told after"), table.column("back after")
    left, bar, row_height = 190, 12, 34
    limits = ((told, 0.5, FIRST), (back, 3.0, SECOND))
    values = [number(row[i]) for row in table.rows for i in (told, back) if number(row[i]) is not None]
    axis = from_zero(values + [limit for _, limit, _ in limits], left, WIDTH - 40)
    drawing, bottom = Drawing(), PANEL_TOP + row_height * len(table.rows)
    frame_below(drawing, axis, PANEL_TOP, bottom, "seconds, the worst of each case (lower is better)")
    legend(drawing, left - 60, [("bar", FIRST, "told"), ("bar", SECOND, "back after its return"),
                                 ("line", ASKED, "asked: told in 0.5 s, back in 3 s")])
    for _, limit, _ in limits:
        drawing.line(axis.at(limit), PANEL_TOP, axis.at(limit), bottom, ASKED, dash=True)
    for r, row in enumerate(table.rows):
        y = PANEL_TOP + row_height * r + 5
        row_label(drawing, left - 8, y + bar, textwrap.wrap(row[0], 28))
        for k, (i, _, color) in enumerate(limits):
            if number(row[i]) is None:
                continue
            end = axis.at(number(row[i]))
            drawing.bar(left, end, y + k * bar, bar, color)
            beyond = [axis.at(limit) for _, limit, _ in limits if 0 <= axis.at(limit) - end < 40]
            drawing.text(max([end] + beyond) + 6, y + k * bar + 10, f"{row[i]} s")
    return drawing.svg(bottom + 46)


def draw_measurement(page):
    """A row a scene: errors of spots, and how many of them the stated uncertainty covers."""
    table = table_with(page, "scene", "median error", "90 % of errors", "stated uncertainty covers")
    median, most, covers = (
        table.column(c) for c in ("median error", "90 % of errors", "stated uncertainty covers"))
    asked = next(row for row in table.rows if row[0] == "bar")
    rows = [row for row in table.rows if row is not asked]
    left, row_height, middle = 168, 30, 430
    drawing, bottom = Drawing(), PANEL_TOP + row_height * len(rows)
    middles = [PANEL_TOP + row_height * (r + 0.5) for r in range(len(rows))]
    legend(drawing, 120, [("dot", FIRST, "median"), ("ring", FIRST, "90 % are below"),
                          ("line", ASKED, f"asked: median {asked[median]} K, {asked[covers]} covered")])
    for row, y in zip(rows, middles):
        row_label(drawing, left - 8, y, [row[0]])
    errors = [f"{row[median]} / {row[most]}" for row in rows]
    error_panel(drawing, errors, middles, from_zero([number(row[most]) for row in rows], left, middle - 40),
                bottom, number(asked[median]), "error of a spot, K (lower is better)")
    shares = [row[covers] for row in rows]
    low = min(number(cell) for cell in [*shares, asked[covers]])
    error_panel(drawing, shares, middles, Axis(low - 2, 100, middle, WIDTH - 30), bottom,
                number(asked[covers]), "errors within the stated uncertainty, %")
    return drawing.svg(bottom + 46)


def rows_and_asked(table, column, head=None):
    """The rows but those called "bar", and what is asked of each: by its column `head`, or by the "bar" below it."""
    if head is not None:
        return table.rows, [number(row[table.column(head)]) for row in table.rows]
    rows, asked = [], []
    for row in table.rows:
        if row[0] == "bar":
            asked += [number(row[column])] * (len(rows) - len(asked))
        else:
            rows.append(row)
    return rows, asked + [None] * (len(rows) - len(asked))


def draw_asked(drawing, axis, asked, row_height):
    for r, value in enumerate(asked):
        if value is not None:
            y = PANEL_TOP + row_height * r
            drawing.line(axis.at(value), y, axis.at(value), y + row_height, ASKED, dash=True)


def draw_scale(page):
    """A row a way and a scene: the median error and what 90 % are below, on a logarithmic axis."""
    table = table_with(page, "by", "scene", "error, median", "error of 90 %")
    median, most = table.column("error, median"), table.column("error of 90 %")
    rows, asked = rows_and_asked(table, median)
    left, row_height = 250, 26
    drawing, bottom = Drawing(), PANEL_TOP + row_height * len(rows)
    middles = [PANEL_TOP + row_height * (r + 0.5) for r in range(len(rows))]
    legend(drawing, left, [("dot", FIRST, "median error"), ("ring", FIRST, "90 % are below"),
                           ("line", ASKED, "bar of the median")])
    cells = [f"{abs(number(row[median]))} / {row[most]}" for row in rows]
    axis = logarithmic([v for cell in cells for v in numbers(cell)], left, WIDTH - 30)
    for row, y in zip(rows, middles):
        row_label(drawing, left - 8, y, [f"{row[0]}: {row[1].split(',')[0]}"])
    error_panel(drawing, cells, middles, axis, bottom, None, "% of the true scale (lower is better), log")
    draw_asked(drawing, axis, asked, row_height)
    return drawing.svg(bottom + 46)


@dataclass
class Bar:
    """One bar a row: which figure of which column, and what the legend calls it."""
    head: str
    name: str
    which: int = 0  # of a cell's numbers; -1 is the last


def draw_bars(page, labels, bars, unit, asked_head=None):
    """A row a row of the table, named by the columns `labels`: an empty cell means the row's before."""
    table = table_with(page, *labels, *(bar.head for bar in bars))
    at = [table.column(bar.head) for bar in bars]
    rows, asked = rows_and_asked(table, at[0], asked_head)
    figures = [[value_at(row[i], bar.which) for i, bar in zip(at, bars)] for row in rows]
    left, thick = 230, 13
    row_height = len(bars) * (thick + 1) + 12
    limits = {value for value in asked if value is not None}
    axis = from_zero([v for row in figures for v in row if v is not None] + [*limits], left, WIDTH - 60)
    drawing, bottom = Drawing(), PANEL_TOP + row_height * len(rows)
    frame_below(drawing, axis, PANEL_TOP, bottom, unit)
    colors = (FIRST, SECOND, FRAME)
    entries = [("bar", color, bar.name) for color, bar in zip(colors, bars)]
    if limits:
        name = f"asked: {short(*limits)}" if len(limits) == 1 else asked_head or "bar"
        entries.append(("line", ASKED, name))
    legend(drawing, EDGE, entries)
    names = [""] * len(labels)
    for r, row in enumerate(rows):
        names = [row[table.column(label)] or before for label, before in zip(labels, names)]
        y = PANEL_TOP + row_height * r + 6
        row_label(drawing, left - 8, y + row_height / 2 - 6, textwrap.wrap(", ".join(names), 36)[:2])
        for k, (value, color) in enumerate(zip(figures[r], colors)):
            if value is None:
                continue
            end = axis.at(value)
            drawing.bar(left, end, y + k * (thick + 1), thick, color)
            if asked[r] is not None and 0 <= axis.at(asked[r]) - end < 40:
                end = axis.at(asked[r])  # the text stands behind the line
            drawing.text(end + 5, y + k * (thick + 1) + 11, short(value))
    draw_asked(drawing, axis, asked, row_height)
    return drawing.svg(bottom + 46)


def value_at(cell, which):
    found = numbers(cell)
    return found[which] if -len(found) <= which < len(found) else None


def draw_heat(page):
    """A row a scene: rank correlation of colour and temperature, the median view's and the worst's."""
    table = table_with(page, "scene", "median view", "worst view")
    median, worst = table.column("median view"), table.column("worst view")
    asked, left, row_height = 0.9, 168, 28
    drawing, bottom = Drawing(), PANEL_TOP + row_height * len(table.rows)
    middles = [PANEL_TOP + row_height * (r + 0.5) for r in range(len(table.rows))]
    legend(drawing, left, [("dot", FIRST, "median view"), ("ring", FIRST, "worst view"),
                           ("line", ASKED, f"asked: {short(asked)}")])
    for row, y in zip(table.rows, middles):
        row_label(drawing, left - 8, y, [row[0]])
    low = min([asked] + [number(row[worst]) for row in table.rows])
    error_panel(drawing, [f"{row[median]} / {row[worst]}" for row in table.rows], middles,
                Axis(low - 0.02, 1, left, WIDTH - 30), bottom, asked,
                "rank correlation over the warmer pixels (higher is better)")
    return drawing.svg(bottom + 46)


@dataclass
class Plot:
    draw: object
    heads: tuple  # starts of its table's heads
    shown: tuple  # starts of the heads whose figures are drawn
    rows: str = ""  # a pattern of the first cells of the rows that are drawn; all without one


def bar_plot(labels, bars, unit, asked_head=None):
    heads = tuple(dict.fromkeys(bar.head for bar in bars))
    return Plot(lambda page: draw_bars(page, labels, bars, unit, asked_head), (*labels, *heads), heads)


POSES = Plot(draw_poses, ("scene", "centres", "rotation", "CPU s"), ("centres", "rotation", "CPU s"))
VISIBLE_BARS = (0.1, 0.15)
PLOTS = {
    "run": Plot(draw_run, ("stage",), ("container", "error", "car"), rows="(?!all)"),
    "registration": Plot(draw_registration, ("level", "success", "rotation", "CPU ms"),
                         ("success", "rotation", "CPU ms")),
    "poses": POSES,
    "poses_perturbed": replace(POSES, heads=("scene", "perturbation", "centres", "rotation", "CPU s")),
    "rigs": bar_plot(("scene",), [Bar("edges agree", "right pairs"), Bar("edges agree", "shuffled pairs", 1)],
                     "agreement of the thermal edges with the photo's (higher is better)"),
    "poses_visible": replace(POSES, draw=lambda page: draw_poses(page, VISIBLE_BARS)),
    "fusion": Plot(draw_fusion, ("method", "Qabf", "Qcb", "CPU ms"), ("Qabf", "Qcb", "CPU ms")),
    "cnn_lpif": Plot(draw_cnn_lpif, ("method", "Qabf", "Qcb", "Qcv", "SSIM"),
                     ("Qabf", "Qcb", "Qcv", "SSIM"), rows="reference|bar|ours"),
    "measurement": Plot(draw_measurement, ("scene", "median error", "stated uncertainty covers"),
                        ("median error", "90 % of errors", "stated uncertainty covers"), rows="(?!bar)"),
    "export": bar_plot(("scene",), [Bar("vertices", "vertices to the true surface"),
                                    Bar("what test views see", "what test views see to the surface")],
                       "median distance, % of the extent (lower is better)"),
    "export_scale": Plot(draw_scale, ("by", "scene", "error, median", "error of 90 %"), ("error, median",),
                         rows="(?!bar)"),
    "planner": bar_plot(("scene", "budget"), [Bar("seconds", "expected", -2), Bar("seconds", "came", -1)],
                        "seconds of a run", "budget"),
    "view": bar_plot(("what",), [Bar("wall", "median of six views"), Bar("slowest", "the slowest")],
                     "wall seconds (lower is better)", "bar"),
    "capture/outages": Plot(draw_outages, ("case", "told after", "back after"), ("told after", "back after")),
    "capture/odometry": bar_plot(
        ("walk",), [Bar("worst azimuth error", "worst error"), Bar("stated at the end", "stated at the end")],
        "degrees of azimuth (lower is better)"),
    "capture/sharpness": bar_plot(
        ("images",), [Bar("as it is", "as it is"), Bar("Gaussian 1", "Gaussian 1"), Bar("motion 9", "motion 9")],
        "width of the edges, sigma in pixels at 640, median"),
    "heat": Plot(draw_heat, ("scene", "median view", "worst view"), ("median view", "worst view")),
    "nerf_refinement": bar_plot(("scene", "error put in"), [Bar("left alone", "left alone"), Bar("set right", "set right")],
                                "dB on test views (higher is better)"),
    "nerf_detail": bar_plot(("scene",), [Bar("field alone", "field alone"), Bar("with detail", "with detail")],
                            "dB on views that were not trained on (higher is better)"),
    "nerf_open_space": bar_plot(("scene",), [Bar("thermal, MAE", "without"), Bar("thermal, MAE", "with", 1)],
                                "kelvin off on test views (lower is better)"),
    "nerf_recipes": bar_plot(("scene",), [Bar("nerfacto", "nerfacto"), Bar("nerf-rgb", "nerf-rgb, nerf-ir"), Bar("ours", "ours")],
                             "dB on test views (higher is better)"),
}


def main(arguments):
    if arguments not in ([], ["--check"]):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    stale = []
    for name, plot in PLOTS.items():
        target = PAGES / f"{name}.svg"
        try:
            svg = plot.draw((PAGES / f"{name}.md").read_text(encoding="utf-8"))
            if not arguments:
                target.write_text(svg, encoding="utf-8")
            elif not target.exists() or target.read_text(encoding="utf-8") != svg:
                stale.append(target)
        except (OSError, ValueError) as error:
            print(f"{name}.md: {error}", file=sys.stderr)
            return 3
    for target in stale:
        print(f"{target}: not its page's table; draw it with bench/plot_pages.py", file=sys.stderr)
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
