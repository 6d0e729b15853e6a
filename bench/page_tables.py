# SPDX-License-Identifier: BSD-3-Clause
"""Tables of a Markdown page, and the figures in their cells."""
import re
from dataclasses import dataclass


@dataclass
class Table:
    heads: list
    rows: list
    first_line: int  # of the rows, in the page

    def column(self, start):
        """Index of the first column whose head starts so; heads go on with units and a direction."""
        for i, head in enumerate(self.heads):
            if head.startswith(start):
                return i
        raise ValueError(f"no column '{start}' among {self.heads}")


def cells_of(line):
    return [plain(cell) for cell in line.strip().strip("|").split("|")]


def plain(text):
    return re.sub(r"[`*]", "", text).strip()


def tables_of(page):
    lines = page.splitlines()
    tables = []
    for i in range(len(lines) - 1):
        if lines[i].startswith("|") and re.fullmatch(r"\|[-:| ]+\|", lines[i + 1].strip()):
            end = i + 2
            while end < len(lines) and lines[end].startswith("|"):
                end += 1
            tables.append(Table(cells_of(lines[i]), [cells_of(row) for row in lines[i + 2:end]], i + 2))
    return tables


def table_with(page, *starts):
    """The page's first table that has columns whose heads start so."""
    for table in tables_of(page):
        if all(any(head.startswith(start) for head in table.heads) for start in starts):
            if not all(len(row) == len(table.heads) for row in table.rows):
                raise ValueError(f"rows and heads {table.heads} differ in length")
            return table
    raise ValueError(f"no table with columns {starts}")


def numbers(cell):
    return [float(n) for n in re.findall(r"[-+]?(?:\d+\.?\d*|\.\d+)", cell)]


def number(cell):
    """The first number, or None."""
    return next(iter(numbers(cell)), None)
