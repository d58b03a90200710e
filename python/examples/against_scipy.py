"""A table against SciPy: the same splines from a loop and from one call, how long they take and how far apart they are.

usage: python against_scipy.py [PICTURE.png]      needs scipy and matplotlib
"""

import sys
import time
from collections.abc import Callable

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, make_smoothing_spline

import faircurve as fc

CURVES, KNOTS, SAMPLES = 1000, 10, 80
random = np.random.default_rng(20_000)
t = np.cumsum(random.uniform(0.2, 1.8, (CURVES, KNOTS)), axis=1)
points = random.normal(size=(CURVES, KNOTS, 2)).cumsum(axis=1)
u = np.ascontiguousarray(np.linspace(t[:, 0], t[:, -1], SAMPLES, axis=1))

CASES: dict[str, tuple[Callable[[], NDArray[np.float64]], Callable[[], NDArray[np.float64]]]] = {
    "natural": (
        lambda: np.stack([CubicSpline(*c, bc_type="natural")(v) for *c, v in zip(t, points, u)]),
        lambda: fc.Natural().fit(points, t=t).sample(SAMPLES),
    ),
    "not-a-knot": (
        lambda: np.stack([CubicSpline(*c)(v) for *c, v in zip(t, points, u)]),
        lambda: fc.CubicSplineBatch(t, points)(u),
    ),
    "smoothing, λ = 0.1": (
        lambda: np.stack([make_smoothing_spline(*c, lam=0.1)(v) for *c, v in zip(t, points, u)]),
        lambda: fc.Smoothing(lam=0.1, pin_ends=False).fit(points, t=t).sample(SAMPLES),
    ),
}


def best(act: Callable[[], NDArray[np.float64]], runs: int) -> tuple[float, NDArray[np.float64]]:
    """The shortest of some runs, in seconds, and what came out."""
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        act()
        times.append(time.perf_counter() - start)
    return min(times), act()


figure, axes = plt.subplots(figsize=(7, 4))
print(f"{'':<20}{'a loop over SciPy':>18}{'faircurve':>12}{'ratio':>8}{'largest difference':>20}")
for k, (name, (loop, batch)) in enumerate(CASES.items()):
    batch()
    (fast, ours), (slow, theirs) = best(batch, 7), best(loop, 2)
    error = np.abs(theirs - ours).max() / np.abs(theirs).max()
    print(f"{name:<20}{1e6 * slow / CURVES:>12.1f} µs{1e6 * fast / CURVES:>12.2f} µs{slow / fast:>7.0f}×{error:>18.1e}")
    axes.barh([k - 0.2, k + 0.2], [1e6 * slow / CURVES, 1e6 * fast / CURVES], 0.35, color=["0.7", "tab:green"])
axes.set(xscale="log", xlabel="µs a curve", yticks=range(len(CASES)), yticklabels=CASES, title=f"{CURVES:,} curves, {SAMPLES} samples each")
figure.tight_layout()
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "against_scipy.png", dpi=120)
