"""Storms on their own clocks: positions every six hours become hourly ones, with speeds.

usage: python storms.py [PICTURE.png]      needs matplotlib
"""

import csv
import gzip
import sys
from itertools import groupby
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection

import faircurve as fc

DATA = Path(__file__).parents[2] / "examples" / "data" / "storms.csv.gz"
KM_A_DEGREE = 111.2

with gzip.open(DATA, "rt") as file:
    storms = [list(rows) for _, rows in groupby(csv.DictReader(file), key=lambda row: row["id"])]
points = [np.array([[row["lon"], row["lat"]] for row in storm], float) for storm in storms]
hours = [np.array([row["hours"] for row in storm], float) for storm in storms]

fit = fc.Smoothing(deviation=0.2).fit(points, t=hours)
print(fit)
hourly = [np.arange(t[0], t[-1] + 0.5) for t in hours]
places, velocities = fit(hourly), fit(hourly, nu=1)
speeds = [
    KM_A_DEGREE * np.hypot(v[:, 0] * np.cos(np.radians(p[:, 1])), v[:, 1]) for p, v in zip(places, velocities)
]
fastest = max(range(len(storms)), key=lambda i: speeds[i].max())
print(f"{sum(map(len, places)):,} hourly positions; {storms[fastest][0]['name']} is the fastest, with {speeds[fastest].max():.0f} km an hour")

figure, axes = plt.subplots(figsize=(10, 6))
lines = LineCollection(
    [segment for p in places for segment in np.stack([p[:-1], p[1:]], axis=1)], array=np.concatenate([s[:-1] for s in speeds]),
    cmap="viridis", linewidth=0.7, clim=(0, 80),
)  # fmt: skip
axes.add_collection(lines)
axes.autoscale_view()
axes.set(aspect="equal", xlabel="longitude", ylabel="latitude", title="Storms, smoothed within 0.2 degrees")
figure.colorbar(lines, label="km an hour", shrink=0.6)
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "storms.png", dpi=120)
