"""Dots to Béziers: closed curves through the 58 dots of an octopus, as cubics that any drawing program reads.

usage: python strokes.py [PICTURE.png]      needs matplotlib
"""

import csv
import sys
from pathlib import Path as File

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import PathPatch
from matplotlib.path import Path

import faircurve as fc

DATA = File(__file__).parents[2] / "examples" / "data" / "octopus.csv"

with DATA.open() as file:
    rows = [row for row in csv.DictReader(file) if row["curve"] == "octopus-58"]
dots = np.array([[row["x"], row["y"]] for row in rows], float)
figure, panels = plt.subplots(1, 3, figsize=(13, 5))
methods = {"natural": fc.Natural(), "least bending and length": fc.Fair({"bending": 1, "length": 0.01}), "scf": fc.Smooth()}
for axes, (name, method) in zip(panels, methods.items()):
    fit = method.fit([dots], closed=True)
    pieces = fit.to_bezier(1e-3 * np.ptp(dots))[0]
    print(f"{name}: {fit.status[0]}, length {fit.length[0]:.1f}, {len(pieces)} cubics")
    vertices = np.concatenate([pieces[0, :1], pieces[:, 1:].reshape(-1, 2)])
    codes = [Path.MOVETO] + [Path.CURVE4] * (len(vertices) - 1)
    axes.add_patch(PathPatch(Path(vertices, codes), facecolor="0.93", edgecolor="tab:purple"))
    axes.plot(*dots.T, ".", color="0.4", markersize=3)
    axes.set(aspect="equal", title=name)
    axes.axis("off")
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "strokes.png", dpi=120)
