#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Success against level, as bars, from the JSON that bench_registration writes with --out.

python3 bench/plot_bars.py registration.json registration.svg

A line across a bar is what is asked of that level. Answers that are wrong stand on the bar: hatched
where the program flagged them as ambiguous or gave an error, red where it said nothing.
"""
import json
import sys
from xml.sax.saxutils import escape

LEFT, RIGHT, ROW, BAR, WIDTH = 190, 640, 34, 20, 760
HEAD = 46


def x_of(share):
    return LEFT + (RIGHT - LEFT) * share


def row_of(level, y):
    trials = level["trials"]
    # A pair that ends with an error says so, as a flagged answer does.
    told = level["wrong_flagged"] + level["errors"]
    if trials < 1 or level["right"] + told > trials:
        raise ValueError(f"level {level['level']!r}: {level['right']} right and {told} flagged "
                         f"of {trials} trials")
    right = level["right"] / trials
    flagged = told / trials
    silent = 1 - right - flagged
    parts = []
    start = 0.0
    for share, fill in ((right, "#2471a3"), (flagged, "url(#flagged)"), (silent, "#c0392b")):
        if share > 1e-9:
            parts.append(f'<rect x="{x_of(start):.1f}" y="{y}" width="{(RIGHT - LEFT) * share:.1f}" '
                         f'height="{BAR}" fill="{fill}"/>')
        start += share
    bar = x_of(level["bar"])
    parts.append(f'<line x1="{bar:.1f}" x2="{bar:.1f}" y1="{y - 4}" y2="{y + BAR + 4}" '
                 'stroke="#222" stroke-width="2"/>')
    parts.append(f'<text x="{LEFT - 10}" y="{y + 15}" text-anchor="end">'
                 f'{escape(level["level"])}</text>')
    parts.append(f'<text x="{RIGHT + 10}" y="{y + 15}">{level["right"]}/{trials}, '
                 f'{level["cpu_ms_median"]:.0f} ms</text>')
    return parts


def svg_of(report):
    levels = report["levels"]
    if not levels:
        raise ValueError("no level in it")
    bottom = HEAD + ROW * len(levels)
    title = (f'right answers; {report["trials_per_cloud"]} pairs a level and cloud, seeds from '
             f'{report["first_seed"]}; median CPU time')
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{bottom + 54}" '
        'font-family="sans-serif" font-size="12">',
        '<defs><pattern id="flagged" width="6" height="6" patternUnits="userSpaceOnUse">'
        '<rect width="6" height="6" fill="#fdebd0"/>'
        '<path d="M0 6 L6 0" stroke="#b7950b"/></pattern></defs>',
        f'<rect width="{WIDTH}" height="{bottom + 54}" fill="white"/>',
        f'<text x="{LEFT}" y="20">{escape(title)}</text>',
    ]
    for percent in range(0, 101, 20):
        x = x_of(percent / 100)
        lines.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{HEAD - 8}" y2="{bottom}" stroke="#ddd"/>'
                     f'<text x="{x:.1f}" y="{bottom + 16}" text-anchor="middle">{percent} %</text>')
    for i, level in enumerate(levels):
        lines += row_of(level, HEAD + ROW * i)
    legend = ((LEFT, "#2471a3", "right"), (LEFT + 80, "url(#flagged)", "wrong, flagged"),
              (LEFT + 210, "#c0392b", "wrong, nothing said"))
    for x, fill, text in legend:
        lines.append(f'<rect x="{x}" y="{bottom + 30}" width="14" height="12" fill="{fill}"/>'
                     f'<text x="{x + 20}" y="{bottom + 40}">{text}</text>')
    lines.append(f'<line x1="{LEFT + 372}" x2="{LEFT + 372}" y1="{bottom + 28}" y2="{bottom + 44}" '
                 f'stroke="#222" stroke-width="2"/><text x="{LEFT + 380}" y="{bottom + 40}">asked</text>')
    return "\n".join(lines + ["</svg>", ""])


def main(arguments):
    if len(arguments) != 2:
        print(__doc__.strip(), file=sys.stderr)
        return 2
    source, target = arguments
    try:
        with open(source, encoding="utf-8") as file:
            svg = svg_of(json.load(file))
        with open(target, "w", encoding="utf-8") as file:
            file.write(svg)
    except KeyError as error:
        print(f"{source}: no {error} in it; bench_registration --out writes such a file",
              file=sys.stderr)
        return 3
    except (OSError, ValueError) as error:
        print(f"{source}: {error}", file=sys.stderr)
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
