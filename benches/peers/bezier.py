"""Times the completion of Bézier curves of least bending energy in NumPy: unknown control points U of A U = -B K.

M by the closed form in f64; a batch of curves of degrees 3 to 10, 2-D, the first and the last control point always known. Two cases:
each degree has two patterns, or each curve one at random. NumPy is timed as it is written by people who have a batch:

* `numpy`: curves grouped by the number of their unknown points, then one batched `numpy.linalg.solve` a group, every curve with its own
  matrix A, gathered from M by fancy indexing;
* `numpy-grouped`: curves grouped by degree and pattern, then one `solve` a group with all its right-hand sides: what somebody
  writes who sees that A depends on the pattern alone.

One JSON line a case and peer, as natural.py prints them. With --write-input the curves are written for faircurve to read, with NumPy's own
control points: bezier-few.npz and bezier-any.npz (coords, offsets, known, solved).

usage: bezier.py [--runs 3] [--data benches/data] [--curves 200000] [--write-input]
"""

import argparse
import json
import os
import platform
import statistics
import time
from math import comb
from pathlib import Path

import numpy as np

SEED, DEGREES, CURVES = 6, range(3, 11), 200_000
CASES = {"few": "bezier cubics to decics, 16 patterns", "any": "bezier cubics to decics, any pattern"}


def energy_matrix(d):
    n = d - 2
    gram = np.array([[comb(n, i) * comb(n, j) / ((2 * n + 1) * comb(2 * n, i + j)) for j in range(n + 1)] for i in range(n + 1)])
    second = np.zeros((n + 1, d + 1))
    for i in range(n + 1):
        second[i, i : i + 3] = (1, -2, 1)
    return (d * (d - 1)) ** 2 * second.T @ gram @ second


MATRICES = {d: energy_matrix(d) for d in DEGREES}


def curves(kind, count):
    rng = np.random.default_rng(SEED)
    degrees = np.array([DEGREES[i % len(DEGREES)] for i in range(count)])
    offsets = np.concatenate([[0], np.cumsum(degrees + 1)])
    coords = rng.uniform(-1, 1, (offsets[-1], 2))
    known = np.zeros(offsets[-1], bool)
    if kind == "any":
        known[:] = rng.random(offsets[-1]) < 0.5
    else:
        for i, d in enumerate(degrees):
            # Ends with their neighbours (of cubics one), or every other point.
            own = known[offsets[i] : offsets[i + 1]]
            if (i // len(DEGREES)) % 2:
                own[::2] = True
            else:
                own[[1, -1] if d == 3 else [1, -2]] = True
    known[offsets[:-1]] = known[offsets[1:] - 1] = True
    return degrees, offsets, coords, known


def solve(degrees, offsets, coords, known):
    """A matrix a curve, curves of as many unknown points together."""
    solved = coords.copy()
    for d in DEGREES:
        rows = np.flatnonzero(degrees == d)
        flags = known[offsets[rows][:, None] + np.arange(d + 1)]
        points = coords[offsets[rows][:, None] + np.arange(d + 1)]
        unknowns = d + 1 - flags.sum(1)
        for m in range(1, d):
            own = np.flatnonzero(unknowns == m)
            if len(own) == 0:
                continue
            u = np.argsort(flags[own], 1, kind="stable")[:, :m]
            k = np.argsort(~flags[own], 1, kind="stable")[:, : d + 1 - m]
            a = MATRICES[d][u[:, :, None], u[:, None, :]]
            b = MATRICES[d][u[:, :, None], k[:, None, :]]
            x = np.linalg.solve(a, -b @ np.take_along_axis(points[own], k[:, :, None], 1))
            solved[offsets[rows[own]][:, None] + u] = x
    return solved


def solve_grouped(degrees, offsets, coords, known):
    """One factorisation a pattern."""
    solved = coords.copy()
    for d in DEGREES:
        rows = np.flatnonzero(degrees == d)
        flags = known[offsets[rows][:, None] + np.arange(d + 1)]
        codes = flags @ (1 << np.arange(d + 1))
        order = np.argsort(codes, kind="stable")
        for own in np.split(order, np.flatnonzero(np.diff(codes[order])) + 1):
            k, u = np.flatnonzero(flags[own[0]]), np.flatnonzero(~flags[own[0]])
            if len(u) == 0:
                continue
            start = offsets[rows[own]][:, None]
            given = coords[start + k].transpose(1, 0, 2).reshape(len(k), -1)
            x = np.linalg.solve(MATRICES[d][np.ix_(u, u)], -MATRICES[d][np.ix_(u, k)] @ given)
            solved[start + u] = x.reshape(len(u), len(own), 2).transpose(1, 0, 2)
    return solved


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--data", type=Path, default=Path("benches/data"))
    parser.add_argument("--curves", type=int, default=CURVES)
    parser.add_argument("--write-input", action="store_true")
    arguments = parser.parse_args()
    for kind, case in CASES.items():
        batch = curves(kind, arguments.curves)
        degrees, offsets, coords, known = batch
        if arguments.write_input:
            np.savez(arguments.data / f"bezier-{kind}.npz", coords=coords.ravel(), offsets=offsets, known=known, solved=solve(*batch).ravel())
            continue
        for peer, work in (("numpy", solve), ("numpy-grouped", solve_grouped)):
            times = []
            for run in range(arguments.runs + 1):
                start = time.perf_counter()
                work(*batch)
                if run:
                    times.append(1e6 * (time.perf_counter() - start) / len(degrees))
            line = {
                "case": case,
                "peer": peer,
                "versions": {"python": platform.python_version(), "numpy": np.__version__},
                "threads": os.cpu_count(),
                "curves": len(degrees),
                "points": int(offsets[-1]),
                "us_per_curve": statistics.median(times),
                "timed_curves": len(degrees),
                "runs": arguments.runs,
                "spread": [min(times), max(times)],
                "load": os.getloadavg()[0],
            }
            print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
