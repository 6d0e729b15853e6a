# SPDX-License-Identifier: BSD-3-Clause
"""A small SVG plot: axes, bars, dots, legends, labels that find their place. What is plotted is plot_pages.py's."""
import math
from dataclasses import dataclass
from xml.sax.saxutils import escape

# GitHub shows a page's images about this wide: one user unit is one pixel there.
WIDTH = 700
EDGE = 12
FIRST, SECOND, ASKED, FRAME, GRID = "#2471a3", "#ca6f1e", "#c0392b", "#555555", "#e2e2e2"
LEGEND_Y = 22
PANEL_TOP = 44


def text_width(text):
    """Of 12 px sans-serif, about: no font is at hand to ask."""
    return 6.0 * len(text)


class Drawing:
    def __init__(self):
        self.parts = []

    def text(self, x, y, text, anchor="start", fill="#222222"):
        self.parts.append(f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{fill}">'
                          f'{escape(text)}</text>')

    def line(self, x1, y1, x2, y2, stroke=FRAME, dash=False):
        dashes = ' stroke-dasharray="5 3"' if dash else ""
        self.parts.append(f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" '
                          f'stroke="{stroke}"{dashes}/>')

    def bar(self, x1, x2, y, height, fill):
        self.parts.append(f'<rect x="{min(x1, x2):.1f}" y="{y:.1f}" width="{abs(x2 - x1):.1f}" '
                          f'height="{height}" fill="{fill}"/>')

    def dot(self, x, y, color, ring=False):
        fill = "#ffffff" if ring else color
        self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" fill="{fill}" '
                          f'stroke="{color}" stroke-width="1.5"/>')

    def turned_text(self, x, y, text):
        self.parts.append(f'<text transform="translate({x:.1f} {y:.1f}) rotate(-90)" '
                          f'text-anchor="middle" fill="#222222">{escape(text)}</text>')

    def svg(self, height):
        # A white panel of its own: black text stays readable on a dark page.
        return "\n".join(
            [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height:.0f}" '
             f'viewBox="0 0 {WIDTH} {height:.0f}" font-family="sans-serif" font-size="12">',
             f'<rect width="{WIDTH}" height="{height:.0f}" fill="#ffffff"/>'] + self.parts
            + ["</svg>", ""])


def short(value):
    return f"{value:g}"


@dataclass
class Axis:
    """From values to pixels; logarithmic where low is above 0 and so asked for."""
    low: float
    high: float
    start: float
    end: float
    log: bool = False

    def at(self, value):
        if self.log:
            share = math.log(max(value, self.low) / self.low) / math.log(self.high / self.low)
        else:
            share = (value - self.low) / (self.high - self.low)
        return self.start + (self.end - self.start) * share

    def ticks(self):
        if self.log:
            decades = range(math.floor(math.log10(self.low)), math.ceil(math.log10(self.high)) + 1)
            every = [m * 10.0 ** d for d in decades for m in (1, 2, 5)]
            return [float(f"{t:.6g}") for t in every if self.low * 0.999 <= t <= self.high * 1.001]
        step = round_step((self.high - self.low) / 5)
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return [float(f"{i * step:.6g}") for i in range(first, last + 1)]


def round_step(least):
    """The least of 1, 2, 5 times a power of ten that is not below."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(m * power for m in (1, 2, 5, 10) if m * power >= least * 0.999)


def from_zero(values, start, end):
    return Axis(0.0, max(values) * 1.05, start, end)


def logarithmic(values, start, end):
    """From one 1, 2 or 5 to another round the values; what is 0 lies on the low end."""
    least = min((v for v in values if v > 0), default=0.01)
    return Axis(round_down(least), round_step(max(values)), start, end, log=True)


def round_down(value):
    return float(f"{1 / round_step(1 / value):.6g}")


def frame_below(drawing, axis, top, bottom, label):
    """Grid, ticks and label of an axis that runs to the right."""
    for tick in axis.ticks():
        drawing.line(axis.at(tick), top, axis.at(tick), bottom, GRID)
        drawing.text(axis.at(tick), bottom + 16, short(tick), "middle")
    drawing.line(axis.start, bottom, axis.end, bottom)
    drawing.text((axis.start + axis.end) / 2, bottom + 34, label, "middle")


def frame_left(drawing, axis, left, right, label, label_x):
    """The same of one that runs upwards."""
    for tick in axis.ticks():
        drawing.line(left, axis.at(tick), right, axis.at(tick), GRID)
        drawing.text(left - 6, axis.at(tick) + 4, short(tick), "end")
    drawing.line(left, axis.start, left, axis.end)
    drawing.turned_text(label_x, (axis.start + axis.end) / 2, label)


def legend(drawing, x, entries):
    """Entries of a kind (bar, dot, ring, line), a colour and a text, one after the other."""
    for kind, color, text in entries:
        if kind == "bar":
            drawing.bar(x, x + 14, LEGEND_Y - 10, 11, color)
        elif kind == "line":
            drawing.line(x, LEGEND_Y - 4, x + 16, LEGEND_Y - 4, color, dash=True)
        else:
            drawing.dot(x + 8, LEGEND_Y - 4, color, ring=kind == "ring")
        drawing.text(x + 20, LEGEND_Y, text)
        x += 20 + text_width(text) + 14


def row_label(drawing, right, middle, lines):
    for i, line in enumerate(lines):
        drawing.text(right, middle + 4 + 14 * (i - (len(lines) - 1) / 2), line, "end")


def overlap(a, b):
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def label_points(drawing, points, area, written=()):
    """Writes each point's text beside it: the first place that covers no point and no text."""
    taken = [(x - 6, y - 6, x + 6, y + 6) for x, y, _ in points] + list(written)
    for x, y, text in points:
        wide = text_width(text)
        places = [(x + 9, y + 4), (x - 9 - wide, y + 4), (x - wide / 2, y - 10), (x - wide / 2, y + 20),
                  (x + 6, y - 10), (x + 6, y + 20), (x - 6 - wide, y - 10), (x - 6 - wide, y + 20)]
        boxes = [(px, py - 11, px + wide, py + 3) for px, py in places]
        free = [i for i, box in enumerate(boxes)
                if box[0] >= area[0] and box[2] <= area[2] and box[1] >= area[1]
                and box[3] <= area[3] and not any(overlap(box, other) for other in taken)]
        best = free[0] if free else 0
        taken.append(boxes[best])
        drawing.text(places[best][0], places[best][1], text)
