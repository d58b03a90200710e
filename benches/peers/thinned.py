"""How near curves come to points that they were not given, and how often they cross themselves where the data do not.

Real curves are thinned to every fourth point and fitted; the distance of the points left out tells how near a method comes to
what was there. Whole strokes, borders and random paths tell how often it crosses itself. Lengths are counted in mean chords of
each curve, so that the weight of length is one without units. Prints two tables in Markdown.

usage: thinned.py [--data benches/data]     after `benches/data.sh`, where faircurve for Python, scipy and shapely are installed
"""

import argparse
from pathlib import Path

import numpy as np
import shapely
from scipy.interpolate import Akima1DInterpolator, CubicSpline, PchipInterpolator

import faircurve as fc

EVERY = 4  # of the points are kept
LEAST = 29  # points of a curve that is thinned: 8 remain
SAMPLES = 24  # a span, between which distances are taken to chords
BORDERS, TRACTS, STROKES, PATHS = 400, 300, 15_000, 3_000
SIGMAS = (0.2, 0.6, 1.2)  # of the heights of random paths with unit steps
WEIGHTS = (0, 0.1, 1, 3, 10, 30)  # of length beside bending


def read(file):
    with np.load(file) as arrays:
        coords, offsets = arrays["coords"], arrays["offsets"]
    curves = [coords[a:b] for a, b in zip(offsets[:-1], offsets[1:])]
    return [curve[np.r_[True, (np.diff(curve, axis=0) != 0).any(axis=1)]] for curve in curves]


def chords(curve):
    return np.linalg.norm(np.diff(curve, axis=0), axis=1)


def distances(points, curve):
    """Of points from a polyline."""
    start, step = curve[:-1], np.diff(curve, axis=0)
    squares = np.maximum((step**2).sum(axis=1), np.finfo(float).tiny)
    along = np.clip(((points[:, None] - start) * step).sum(axis=2) / squares, 0, 1)
    return np.linalg.norm(start + along[..., None] * step - points[:, None], axis=2).min(axis=1)


def of_faircurve(method, per_span):
    def run(curves):
        fit = method.fit(curves, device="cpu")
        return fit.sample(per_span=per_span), fit.status == "converged"

    return run


def of_scipy(make, power):
    """A loop over SciPy's splines, with steps of the parameter that are chords to a power."""

    def run(curves):
        samples = []
        for curve in curves:
            t = np.r_[0, np.cumsum(chords(curve) ** power)]
            within = (t[:-1, None] + np.diff(t)[:, None] * np.arange(SAMPLES) / SAMPLES).reshape(-1)
            samples.append(make(t, curve)(np.r_[within, t[-1]]))
        return samples, np.ones(len(curves), bool)

    return run


def methods(per_span):
    for word in ("chord", "centripetal", "uniform"):
        yield f"`Natural`, {word}", of_faircurve(fc.Natural(parametrisation=word), per_span)
    for weight in WEIGHTS:
        energy = {"bending": 1} | ({"length": weight} if weight else {})
        yield "`Fair`, bending" + (f" + {weight} length" if weight else ""), of_faircurve(fc.Fair(energy), per_span)
    yield "`Fair`, bending + tautness (the default)", of_faircurve(fc.Fair(), per_span)
    yield "`Smooth`, ν = 2", of_faircurve(fc.Smooth(), per_span)


def peers():
    makima = lambda t, points: Akima1DInterpolator(t, points, method="makima")
    yield "the polygon", lambda curves: (curves, np.ones(len(curves), bool))
    yield "SciPy CubicSpline, not-a-knot, chord", of_scipy(CubicSpline, 1)
    yield "SciPy Akima, chord", of_scipy(Akima1DInterpolator, 1)
    yield "SciPy makima, chord", of_scipy(makima, 1)
    yield "SciPy makima, centripetal", of_scipy(makima, 0.5)
    yield "SciPy PCHIP, chord", of_scipy(PchipInterpolator, 1)


def crossing(given, samples, converged):
    """Which curves cross themselves where their points' polygon does not."""
    if given[0].shape[1] == 3:
        return np.zeros(len(given), bool)
    simple = [shapely.is_simple(shapely.linestrings(curve)) for curve in given]
    still = [shapely.is_simple(shapely.linestrings(np.asarray(curve))) for curve in samples]
    return np.array(simple) & ~np.array(still) & converged


def row(*cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def stretched(given, samples, converged):
    ratios = np.array([chords(np.asarray(curve)).sum() / chords(points).sum() for points, curve in zip(given, samples)])[converged]
    return f"{np.median(ratios):.3f}", f"{ratios.max():.2f}"


def thinned(sets):
    row("set", "method", "converged", "mean distance (rms of a curve)", "largest, 95 % of curves", "crossings", "length over chords", "largest")
    row(*["---"] * 8)
    for name, curves in sets.items():
        whole = [curve[: (len(curve) - 1) // EVERY * EVERY + 1] for curve in curves]
        whole = [curve / chords(curve[::EVERY]).mean() for curve in whole if (chords(curve[::EVERY]) > 0).all()]
        given = [curve[::EVERY] for curve in whole]
        left_out = [np.delete(curve, np.s_[::EVERY], axis=0) for curve in whole]
        for method, run in [*peers(), *methods(SAMPLES)]:
            if given[0].shape[1] == 3 and method.startswith("`Smooth`"):
                continue
            samples, converged = run(given)
            far = [distances(points, np.asarray(curve)) for points, curve, ok in zip(left_out, samples, converged) if ok]
            rms, most = [np.sqrt((d**2).mean()) for d in far], [d.max() for d in far]
            numbers = f"{np.mean(rms):.4f}", f"{np.percentile(most, 95):.3f}"
            crossings = str(crossing(given, samples, converged).sum())
            row(f"{name} ({len(given)})", method, f"{converged.mean():.1%}", *numbers, crossings, *stretched(given, samples, converged))


def whole(sets):
    row("set", "method", "converged", "crossings", "length over chords", "largest")
    row(*["---"] * 6)
    for name, curves in sets.items():
        given = [curve / chords(curve).mean() for curve in curves]
        for method, run in methods(8):
            if name.startswith("borders") and not method.startswith("`Natural`"):
                continue  # Curves of thousands of points: minutes each.
            samples, converged = run(given)
            crossings = f"{crossing(given, samples, converged).mean():.2%}"
            row(f"{name} ({len(given)})", method, f"{converged.mean():.2%}", crossings, *stretched(given, samples, converged))


parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--data", type=Path, default=Path("benches/data"))
data = parser.parse_args().data
rng = np.random.default_rng(3)
borders, tracts, strokes = (read(data / name) for name in ("countries-50m.npz", "tracts.npz", "hanzi.npz"))
pick = lambda curves, count, least: [curves[k] for k in rng.permutation(len(curves)) if len(curves[k]) >= least][:count]
paths = [np.stack([np.arange(10.0), rng.normal(0, sigma, 10)], axis=1) for sigma in SIGMAS for _ in range(PATHS)]
thinned({"borders": pick(borders, BORDERS, LEAST), "tracts": pick(tracts, TRACTS, LEAST)})
print()
whole({"strokes": pick(strokes, STROKES, 3), "borders": pick(borders, len(borders), 4), "random paths": paths})
