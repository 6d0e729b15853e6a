#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Pages of docs/benchmarks: command, processor, date, one table, its plot, limits, a link from the index."""
import importlib.util
import re
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = ROOT / "docs" / "benchmarks"
WITHOUT_PLOT = {
    "compare.md": "two pairs",
    "capture/faults.md": "cases that hold or don't, without a figure in common",
    "capture/v4l2.md": "the same",
    "cuda.md": "two machines side by side, six rows",
    "fuzzing.md": "runs of a fuzzer measure how fast a parser is",
    "hostile.md": "says what the program answers",
    "input/gray.md": "a few scenes, two figures each",
    "input/known_poses.md": "mistakes that are seen or not",
    "input/mirrored.md": "refused or not",
    "input/stations.md": "placed or not",
    "input/turned.md": "placed or not",
    "run_real.md": "what came of four recordings, without truth",
    "stability.md": "cases that hold or don't",
}

spec = importlib.util.spec_from_file_location("plot_pages", ROOT / "bench" / "plot_pages.py")
plot_pages = importlib.util.module_from_spec(spec)
spec.loader.exec_module(plot_pages)


class BenchmarkPages(unittest.TestCase):
    def test_plots_are_those_of_their_tables(self):
        for name, plot in plot_pages.PLOTS.items():
            with self.subTest(page=name):
                page = (PAGES / f"{name}.md").read_text(encoding="utf-8")
                svg = (PAGES / f"{name}.svg").read_text(encoding="utf-8")
                self.assertEqual(plot.draw(page), svg, "run python3 bench/plot_pages.py")

    def test_another_figure_is_another_plot(self):
        for name, plot in plot_pages.PLOTS.items():
            with self.subTest(page=name):
                page = (PAGES / f"{name}.md").read_text(encoding="utf-8")
                table = plot_pages.table_with(page, *plot.heads)
                column = table.column(plot.shown[-1])
                lines = page.splitlines()
                drawn = [i for i, row in enumerate(table.rows)
                         if re.match(plot.rows, row[0]) and plot_pages.numbers(row[column])]
                at = table.first_line + drawn[0]
                cells = lines[at].split("|")
                cells[column + 1] = re.sub(r"\d+(\.\d+)?", lambda m: f"{float(m[0]) * 1.5 + 1:.3f}",
                                           cells[column + 1], count=1)
                lines[at] = "|".join(cells)
                self.assertNotEqual(plot.draw("\n".join(lines)), plot.draw(page))

    def test_each_page_says_how_on_what_and_when(self):
        index = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
        for file in sorted(PAGES.rglob("*.md")):
            with self.subTest(page=file.name):
                name = file.relative_to(PAGES).as_posix()
                page = file.read_text(encoding="utf-8")
                self.assertRegex(page, r"bench_|build/release/bench|bench/app|tests/|nerf_")
                self.assertRegex(page, r"Intel|AMD")
                self.assertRegex(page, r"20\d\d-\d\d-\d\d")
                self.assertRegex(page, r"\n## Limits\n\n\S", "what the figures don't say")
                self.assertIn(f"benchmarks/{name}", index)
                self.assertEqual(len(plot_pages.tables_of(page)), 1, "one question, one table")
                images = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", page)
                self.assertTrue(images or name in WITHOUT_PLOT, "no plot")
                for image in images:
                    self.assertTrue((file.parent / image).exists(), image)

    def test_links_lead_to_files(self):
        pages = [*sorted((ROOT / "docs").rglob("*.md")), *sorted(ROOT.glob("*.md"))]
        self.assertGreater(len(pages), 20)
        for file in pages:
            for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", file.read_text(encoding="utf-8")):
                with self.subTest(page=str(file.relative_to(ROOT)), link=link):
                    self.assertTrue((file.parent / link).exists())


if __name__ == "__main__":
    unittest.main()
