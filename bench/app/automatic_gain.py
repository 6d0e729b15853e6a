#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Thermal images as a camera on automatic shows them: 8 bits, another curve for each image.

    bench/app/automatic_gain.py SCENE OUT span|equalised|palette|mixed

SCENE holds visible/, thermal/ (16-bit TIFF, centikelvin), test/ and ground_truth.json. OUT gets
thermal/ with JPEGs (span: each image between its own 1 and 99 percentiles; equalised: histogram
with a plateau; palette: span, in false colours; mixed: span, every fourth black-hot), links to the
rest, and a ground_truth.json that names the JPEGs. Then:

    orbitfuse import S --visible OUT/visible --thermal OUT/thermal \\
        --ground-truth OUT/ground_truth.json --priors-only --station-spacing-deg 30 --loops 2
    orbitfuse run S --out R [--set train.thermal.even_exposure=false]
    orbitfuse eval R --ground-truth OUT/ground_truth.json
"""
import pathlib
import re
import sys

import cv2
import numpy as np


def curve_of(image: np.ndarray, kind: str) -> np.ndarray:
    if kind != "equalised":
        low, high = np.percentile(image, [1, 99])
        return np.clip((image - low) / (high - low), 0, 1)
    counts, edges = np.histogram(image, bins=1024)
    plateau = 0.7 * np.percentile(counts[counts > 0], 90) + 1
    rising = np.cumsum(np.minimum(counts, plateau))
    return np.interp(image, edges[1:], rising / rising[-1])


def main() -> None:
    if len(sys.argv) != 4 or sys.argv[3] not in ("span", "equalised", "palette", "mixed"):
        sys.exit(__doc__)
    scene, out, kind = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]), sys.argv[3]
    (out / "thermal").mkdir(parents=True)
    for name in ("visible", "test"):
        (out / name).symlink_to(scene / name)
    for number, file in enumerate(sorted((scene / "thermal").glob("*.tiff"))):
        image = cv2.imread(str(file), cv2.IMREAD_UNCHANGED).astype(np.float64)
        gray = np.round(255 * curve_of(image, kind)).astype(np.uint8)
        if kind == "mixed" and number % 4 == 3:
            gray = 255 - gray
        if kind == "palette":
            gray = cv2.applyColorMap(gray, cv2.COLORMAP_INFERNO)
        cv2.imwrite(str(out / "thermal" / (file.stem + ".jpg")), gray, [cv2.IMWRITE_JPEG_QUALITY, 92])
    truth = (scene / "ground_truth.json").read_text()
    (out / "ground_truth.json").write_text(re.sub(r'"(thermal/[^"]*)\.tiff"', r'"\1.jpg"', truth))


main()
