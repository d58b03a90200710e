"""Times the Python package of faircurve on the cases of natural.py, from numpy to numpy, and on strokes from pyarrow.

One JSON line a case on standard output, as natural.py prints them. Needs an environment that has the package.

usage: python.py [--runs 7] [--data benches/data]     after `natural.py --write-random` and `benches/data.sh hanzi`
"""

import argparse
import json
import os
import platform
import statistics
import time
from pathlib import Path

import numpy as np

import faircurve as fc

SAMPLES = 80  # a curve, in the random case
PER_SPAN = 8  # segments a span, for the strokes


def report(case, curves, points, run, runs):
    run()
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    micro = [round(1e6 * t / curves, 4) for t in (statistics.median(times), min(times), max(times))]
    versions = {"python": platform.python_version(), "numpy": np.__version__, "faircurve": fc.__version__}
    line = {"case": case, "peer": "faircurve for Python", "versions": versions, "threads": len(os.sched_getaffinity(0))}
    line |= {"curves": curves, "points": points, "us_per_curve": micro[0], "timed_curves": curves, "runs": runs}
    print(json.dumps(line | {"spread": micro[1:], "load": round(os.getloadavg()[0], 1)}), flush=True)


parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--runs", type=int, default=7)
parser.add_argument("--data", type=Path, default=Path("benches/data"))
arguments = parser.parse_args()

with np.load(arguments.data / "random.npz") as file:
    curves = len(file["offsets"]) - 1
    points, t = file["coords"].reshape(curves, -1, 2), file["t"].reshape(curves, -1)
fit_and_sample = lambda: fc.Natural().fit(points, t=t).sample(SAMPLES)
report("random 20000x10x2, 80 samples", curves, t.size, fit_and_sample, arguments.runs)
u = np.ascontiguousarray(np.linspace(t[:, 0], t[:, -1], SAMPLES, axis=1))
loop = lambda: fc.CubicSplineBatch(t, points, "natural")(u)
report("random 20000x10x2, 80 samples, CubicSplineBatch", curves, t.size, loop, arguments.runs)

with np.load(arguments.data / "hanzi.npz") as file:
    coords, offsets = file["coords"], file["offsets"]
strokes = lambda: fc.Natural().fit((coords, offsets)).sample(per_span=PER_SPAN)
report("hanzi strokes, 8 a span", len(offsets) - 1, len(coords), strokes, arguments.runs)
try:
    import pyarrow as pa
except ImportError:
    raise SystemExit(0) from None
lists = pa.ListArray.from_arrays(offsets.astype(np.int32), pa.FixedSizeListArray.from_arrays(coords.reshape(-1), 2))
from_arrow = lambda: fc.Natural().fit(lists).sample(per_span=PER_SPAN)
report("hanzi strokes, 8 a span, pyarrow", len(offsets) - 1, len(coords), from_arrow, arguments.runs)
