"""Times natural cubic splines in SciPy and in JAX: fit every curve on its own knots, then sample it.

One JSON line a case and peer, on standard output:

    {"case", "peer", "versions", "threads", "curves", "points", "us_per_curve", "timed_curves", "runs", "spread", "load"}

`curves` and `points` are those of the whole case; `timed_curves` is what one run really did (SciPy's loop takes a
seeded subset, and its time a curve stands for the whole). `us_per_curve` is the median over `runs` runs, `spread`
the fastest and the slowest of them in the same unit, `load` the machine's load average of the last minute (above
`threads`, others were at work and the times are too long). Files are read, and JAX compiles, outside the time.

With --write-random only the random curves are written, as random.npz (coords, offsets, t), for faircurve to read.

usage: natural.py [--runs 7] [--case random|hanzi] [--data benches/data] [--write-random]
"""

import argparse
import json
import os
import platform
import statistics
import time
from pathlib import Path

# Both must be set before the libraries start: as many threads as this process may use cores, and no more.
THREADS = len(os.sched_getaffinity(0))
os.environ.setdefault("OMP_NUM_THREADS", str(THREADS))
os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402
import scipy  # noqa: E402
from scipy.interpolate import CubicSpline  # noqa: E402

jax.config.update("jax_enable_x64", True)

SEED = 20_000
SAMPLES = 80  # a curve, in the random case
PER_SPAN = 8  # segments a span, for the strokes
SCIPY_CURVES = 2_000  # how many curves SciPy's loop is timed on


def median_time(run, runs):
    """Seconds: the median, the fastest and the slowest of several runs, after one that is not counted."""
    run()
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return statistics.median(times), min(times), max(times)


def report(case, peer, curves, points, timed, times):
    micro = [round(1e6 * t / timed, 4) for t in times]
    versions = {"python": platform.python_version(), "numpy": np.__version__}
    versions |= {"scipy": scipy.__version__} if peer == "scipy" else {"jax": jax.__version__}
    # SciPy's loop runs on one thread, whatever there is.
    threads = 1 if peer == "scipy" else THREADS
    line = {"case": case, "peer": peer, "versions": versions, "threads": threads, "curves": curves, "points": points}
    line |= {"us_per_curve": micro[0], "timed_curves": timed, "runs": ARGUMENTS.runs, "spread": micro[1:]}
    line |= {"load": round(os.getloadavg()[0], 1)}
    print(json.dumps(line), flush=True)


# --- SciPy: one curve after the other ---------------------------------------------------------------------------


def scipy_loop(curves, samplings):
    """curves: (knots, points) pairs; samplings: where to evaluate each."""
    return [CubicSpline(t, p, bc_type="natural")(s) for (t, p), s in zip(curves, samplings, strict=True)]


# --- JAX: one function of one curve, mapped over all ---------------------------------------------------------------


def natural_fit(t, p, count):
    """Lengths of the spans, and second derivatives at the knots, of the natural spline through p (n, d) at t (n,).

    Only the first `count` rows are data: what follows is padding, made identity rows, so that curves of different
    lengths can share one compiled function.
    """
    n = t.shape[0]
    row = jnp.arange(n)
    inner = (row > 0) & (row < count - 1)
    h = jnp.where(row[: n - 1] < count - 1, jnp.diff(t), 1.0)
    slope = jnp.diff(p, axis=0) / h[:, None]
    before, after = jnp.concatenate([h[:1], h]), jnp.concatenate([h, h[-1:]])
    lower = jnp.where(inner, before, 0.0)
    upper = jnp.where(inner, after, 0.0)
    diagonal = jnp.where(inner, 2.0 * (before + after), 1.0)
    bend = jnp.concatenate([slope, slope[-1:]]) - jnp.concatenate([slope[:1], slope])
    rhs = jnp.where(inner[:, None], 6.0 * bend, 0.0)
    # Faster here than Thomas' algorithm written with jax.lax.scan, and no less exact.
    return h, jax.lax.linalg.tridiagonal_solve(lower, diagonal, upper, rhs)


def evaluate(t, p, h, m, span, s):
    """The spline at the parameters s, which lie in the given spans."""
    width = h[span]
    a, b = (t[span + 1] - s) / width, (s - t[span]) / width
    cubic = ((a**3 - a)[:, None] * m[span] + (b**3 - b)[:, None] * m[span + 1]) * (width**2 / 6)[:, None]
    return a[:, None] * p[span] + b[:, None] * p[span + 1] + cubic


def fit_and_sample(t, p, s):
    """Samples anywhere: the span of each by comparing with all knots, for ten of them the fastest of JAX's ways."""
    h, m = natural_fit(t, p, t.shape[0])
    span = jnp.clip(jnp.searchsorted(t, s, side="right", method="compare_all") - 1, 0, t.shape[0] - 2)
    return evaluate(t, p, h, m, span, s)


def fit_and_sample_spans(t, p, count):
    """PER_SPAN samples from the start of every span; padded spans repeat nothing that is read."""
    h, m = natural_fit(t, p, count)
    spans = t.shape[0] - 1
    span = jnp.repeat(jnp.arange(spans), PER_SPAN)
    s = t[span] + jnp.tile(jnp.arange(PER_SPAN) / PER_SPAN, spans) * h[span]
    return evaluate(t, p, h, m, span, s)


# --- The cases ----------------------------------------------------------------------------------------------------


def random_curves():
    """Knots (B, n) and points (B, n, 2) of seeded random walks with uneven knots."""
    curves, points = 20_000, 10
    random = np.random.default_rng(SEED)
    t = np.cumsum(random.uniform(0.2, 1.8, (curves, points)), axis=1)
    p = random.normal(size=(curves, points, 2)).cumsum(axis=1)
    return t, p


def write_random():
    """The same curves as a file that faircurve reads."""
    t, p = random_curves()
    offsets = np.arange(0, t.size + 1, t.shape[1], dtype=np.int64)
    ARGUMENTS.data.mkdir(exist_ok=True)
    np.savez(ARGUMENTS.data / "random.npz", coords=p.reshape(-1, 2), offsets=offsets, t=t.ravel())


def random_case():
    """20,000 curves of 10 points in the plane, each with knots of its own, 80 samples each at equal steps."""
    t, p = random_curves()
    curves, points = t.shape
    s = np.linspace(t[:, 0], t[:, -1], SAMPLES, axis=1)
    case = "random 20000x10x2, 80 samples"

    timed = SCIPY_CURVES
    subset = [(t[i], p[i]) for i in range(timed)]
    report(case, "scipy", curves, curves * points, timed, median_time(lambda: scipy_loop(subset, s[:timed]), ARGUMENTS.runs))

    mapped = jax.jit(jax.vmap(fit_and_sample))
    on_device = [jnp.asarray(a) for a in (t, p, s)]
    agree(scipy_loop(subset, s[:timed]), np.asarray(mapped(*on_device))[:timed])
    times = median_time(lambda: mapped(*on_device).block_until_ready(), ARGUMENTS.runs)
    report(case, "jax", curves, curves * points, curves, times)


def strokes(path):
    """The stroke medians with chord-length knots; strokes with repeated points lose the repetition."""
    with np.load(path) as file:
        coords, offsets = file["coords"], file["offsets"]
    curves = []
    for start, end in zip(offsets[:-1], offsets[1:], strict=True):
        p = coords[start:end]
        p = p[np.concatenate([[True], (np.diff(p, axis=0) != 0).any(axis=1)])]
        chords = np.hypot(*np.diff(p, axis=0).T)
        curves.append((np.concatenate([[0.0], np.cumsum(chords)]), p))
    return [curve for curve in curves if len(curve[0]) >= 2]


def hanzi_case():
    """The strokes of all characters, 8 samples a span. SciPy on every k-th; JAX padded to buckets of length."""
    curves = strokes(ARGUMENTS.data / "hanzi.npz")
    points = sum(len(t) for t, _ in curves)
    case = "hanzi strokes, 8 a span"

    # SciPy's natural ends want three points; shorter strokes are straight lines and are left out of its subset.
    subset = [curve for curve in curves if len(curve[0]) >= 3][:: len(curves) // SCIPY_CURVES]
    fraction = np.arange(PER_SPAN) / PER_SPAN
    samplings = [np.append((t[:-1, None] + np.diff(t)[:, None] * fraction).ravel(), t[-1]) for t, _ in subset]
    times = median_time(lambda: scipy_loop(subset, samplings), ARGUMENTS.runs)
    report(case, "scipy", len(curves), points, len(subset), times)

    # Buckets of even length: at most one row in three is padding, at the price of 19 compiled functions.
    mapped = jax.jit(jax.vmap(fit_and_sample_spans))
    buckets = {}
    for t, p in curves:
        buckets.setdefault(len(t) + len(t) % 2, []).append((t, p))
    arrays = []
    for size, members in sorted(buckets.items()):
        ts = np.stack([np.pad(t, (0, size - len(t)), mode="edge") for t, _ in members])
        ps = np.stack([np.pad(p, ((0, size - len(p)), (0, 0)), mode="edge") for _, p in members])
        arrays.append((jnp.asarray(ts), jnp.asarray(ps), jnp.asarray([len(t) for t, _ in members])))

    def run():
        return jax.block_until_ready([mapped(*bucket) for bucket in arrays])

    found = dict(zip(sorted(buckets), run(), strict=True))
    for (t, p), s in list(zip(subset, samplings, strict=True))[:50]:
        members = buckets[len(t) + len(t) % 2]
        index = next(i for i, member in enumerate(members) if member[0] is t)
        agree([CubicSpline(t, p, bc_type="natural")(s[:-1])], [found[len(t) + len(t) % 2][index][: len(s) - 1]])
    report(case, "jax", len(curves), points, len(curves), median_time(run, ARGUMENTS.runs))


def agree(expected, found):
    """Both peers must compute the same curve, else their times mean nothing."""
    worst = max(np.abs(np.asarray(b) - a).max() / np.abs(a).max() for a, b in zip(expected, found, strict=True))
    assert worst < 1e-12, f"SciPy and JAX differ by {worst:.1e} of the curve's size"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--case", choices=["random", "hanzi"], action="append", help="default: both")
    parser.add_argument("--data", type=Path, default=Path(__file__).parent.parent / "data")
    parser.add_argument("--write-random", action="store_true", help="write random.npz and time nothing")
    ARGUMENTS = parser.parse_args()
    if ARGUMENTS.write_random:
        write_random()
    else:
        for name in ARGUMENTS.case or ["random", "hanzi"]:
            {"random": random_case, "hanzi": hanzi_case}[name]()
