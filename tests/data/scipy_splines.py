#!/usr/bin/env python3
"""Reference values for tests/scipy.rs: 1,000 random splines by SciPy's CubicSpline, natural and periodic.

usage: scipy_splines.py   (needs NumPy and SciPy; writes scipy_splines.npz and scipy_values.npz beside itself)

scipy_splines.npz: the data, in the program's own format (coords, offsets, t, closed). Points and knots have few
decimals, so that the file stays small; a closed curve repeats its first point, whose parameter closes the period.
scipy_values.npz: for each curve, at VALUES parameters strictly inside its domain, the parameter and the point.
"""
import pathlib

import numpy as np
import scipy
from scipy.interpolate import CubicSpline

HERE = pathlib.Path(__file__).parent
CURVES, VALUES = 1000, 7
rng = np.random.default_rng(828)
coords, offsets, knots, closed, at, values = [], [0], [], [], [], []
for i in range(CURVES):
    periodic = i % 2 == 1
    n = int(rng.integers(4 if periodic else 2, 31))
    t = np.cumsum(rng.uniform(0.05, 2, n).round(3)) + round(rng.uniform(-5, 5), 3)
    y = rng.normal(size=(n, 2)).round(3)
    if periodic:
        y[-1] = y[0]
    spline = CubicSpline(t, y, bc_type="periodic" if periodic else "natural")
    s = t[0] + (t[-1] - t[0]) * rng.uniform(0.001, 0.999, VALUES)
    coords.append(y)
    knots.append(t)
    offsets.append(offsets[-1] + n)
    closed.append(periodic)
    at.append(s)
    values.append(spline(s))
np.savez_compressed(HERE / "scipy_splines.npz", coords=np.concatenate(coords), offsets=np.array(offsets),
                    t=np.concatenate(knots), closed=np.array(closed))
np.savez_compressed(HERE / "scipy_values.npz", coords=np.concatenate(values), offsets=np.arange(CURVES + 1) * VALUES,
                    t=np.concatenate(at))
print(scipy.__version__, offsets[-1], "points")
