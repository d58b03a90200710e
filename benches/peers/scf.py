"""Times smooth connection functions in SciPy: curves of least integral of |kappa|^nu ds through given points.

Nothing published computes them; this is what somebody would write who has SciPy and the formulas. A segment is a piece
[T0, T1] of one universal curve for each nu, with q = 1 - 1/nu,

    S(T) = sgn T sin^q |T|,   J(T) = integral of |sin|^q from 0 to T,   par = J(T1) - J(T0),   perp = (S(T1) - S(T0)) / q,

J by the incomplete beta function. By mirroring and reversing, its angles to the chord become a >= b, a + b <= 0; then
T1 = |T0| + a - b, an inflection lies at T = 0, and T0 is the root of a - pi/2 + |T0| + atan2(perp, par), by brentq. With
D = hypot(perp, par) and a chord d the cost is D^(nu-1) par / d^(nu-1), and its derivatives by the angles are -nu M0 and nu M1,
M = -+ D^(nu-1) S(T) / d^(nu-1) (envelope theorem). At the ends of a curve, where kappa = 0, T0 = 0 and a is found instead.

Two cases: segments alone, with derivatives, and whole open curves, whose inner slopes are optimised

* `scipy`: by `minimize(method="BFGS", jac=True)`;
* `scipy-newton`: by damped Newton, the tridiagonal Hessian by differences of the gradient in three colours, `solveh_banded`.

One JSON line a case and peer, as natural.py prints them (for segments a "curve" is a segment), with these besides:

    "nu", "cost": mean, "gradient": largest entry at the end, "iterations": [median, most], "solves": mean a curve,
    "failed": n, "excess": [median, largest] of the cost over the lowest that any peer reached on the same curve, relative

The costs stay in scf-scipy.npz (`cost` and `slopes` of BFGS, `newton_cost` and `newton_slopes`). --faircurve FILE.npz
with an array `cost` for the same curves (all, or the first so many) counts towards the lowest and adds
`faircurve_excess`. With --write-input only the input is written, for faircurve to read: scf-points.npz (coords,
offsets) and scf-segments.npz (start, end: angles to the unit chord, radians).

usage: scf.py [--runs 3] [--data benches/data] [--curves 20] [--write-input] [--faircurve FILE.npz]
"""

import argparse
import json
import math
import os
import platform
import statistics
import time
from pathlib import Path

# Small vectors only: threads of the BLAS slow them down. To be set before NumPy starts.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np  # noqa: E402
import scipy  # noqa: E402
from scipy.linalg import solveh_banded  # noqa: E402
from scipy.optimize import brentq, minimize  # noqa: E402
from scipy.special import beta, betainc  # noqa: E402

NU = 2.0
Q = 1.0 - 1.0 / NU
HALF = 0.5 * beta(0.5, 0.5 * (Q + 1.0))  # J(pi/2)
SEED, CURVES, POINTS, SEGMENTS = 58, 10_000, 10, 2_000
FAR = (math.inf, 0.0, 0.0)  # no minimiser: infinite cost, no derivatives
TOLERANCE = 1e-8  # of the gradient's largest entry, where costs are of order 1

solves = 0  # segments solved since the program started


def S(t):
    # Rounding may bring sin below 0 at pi.
    return math.copysign(max(math.sin(abs(t)), 0.0) ** Q, t)


def J(t):
    s = abs(t)
    part = HALF * betainc(0.5 * (Q + 1.0), 0.5, math.sin(s) ** 2)
    return math.copysign(part if s <= 0.5 * math.pi else 2.0 * HALF - part, t)


def chord(t0, t1):
    return J(t1) - J(t0), (S(t1) - S(t0)) / Q


# --- One segment --------------------------------------------------------------------------------------------------


def canonical(a, b):
    """Cost and moments at both ends over the unit chord, for a >= b, a + b <= 0."""
    turn = a - b
    if turn == 0.0 and a == 0.0:
        return 0.0, 0.0, 0.0
    if turn >= math.pi:
        return FAR

    def plain(t):  # no inflection: T0 = t
        par, perp = chord(t, t + turn)
        return a - 0.5 * math.pi + t + math.atan2(perp, par)

    def inflected(t):  # T0 = -t
        par, perp = chord(-t, t + turn)
        return a - 0.5 * math.pi + t + math.atan2(perp, par)

    # T0 = 0 is on both branches; where the angles are equal, par is 0 there and the plain branch has no root.
    if turn > 0.0 and plain(0.0) >= 0.0:
        # At the far end perp = 0, and the condition's value is (a + b)/2 <= 0.
        far = 0.5 * (math.pi - turn)
        t0 = brentq(plain, 0.0, far, xtol=1e-15, rtol=1e-14) if plain(far) < 0.0 else far
    else:
        root = first_root(inflected, min(math.pi - turn, math.pi - a))
        if root is None:
            return FAR
        t0 = -root
    t1 = abs(t0) + turn
    par, perp = chord(t0, t1)
    size = math.hypot(par, perp) ** (NU - 1.0)
    return size * par, -size * S(t0), -size * S(t1)


def first_root(f, most):
    """The first root in (0, most), of a function that is negative at first; None if a search in steps finds none."""
    below = most * 1e-9
    if f(below) >= 0.0:
        return below
    for step in range(1, 17):
        # Steps that widen: the first root is near 0 when the second may be near `most`.
        above = most * (step / 16) ** 2
        if f(above) > 0.0:
            return brentq(f, below, above, xtol=1e-15, rtol=1e-14)
        below = above
    return None


def segment(a, b):
    """Cost over the unit chord, and its derivatives by both angles (to the chord, radians)."""
    global solves
    solves += 1
    mirrored = a < b
    if mirrored:
        a, b = -a, -b
    reverse = a + b > 0.0
    if reverse:
        # Reversed, (a, b) becomes (b, a); then mirrored again, since that is in the wrong order.
        a, b = -b, -a
    cost, m0, m1 = canonical(a, b)
    if reverse:
        m0, m1 = m1, m0  # two changes of sign cancel
    sign = -1.0 if mirrored else 1.0
    return cost, -NU * sign * m0, NU * sign * m1


def free_start(b):
    """The same where the start is free, so that kappa = 0 there: cost, and its derivative by the angle at the end."""
    global solves
    solves += 1
    if b == 0.0:
        return 0.0, 0.0
    sign, b = (1.0, b) if b < 0.0 else (-1.0, -b)

    def condition(t):  # T0 = 0, T1 = t, the free angle is b + t
        par, perp = chord(0.0, t)
        return b + t - 0.5 * math.pi + math.atan2(perp, par)

    t = first_root(condition, math.pi)
    if t is None:
        return math.inf, 0.0
    par, perp = chord(0.0, t)
    size = math.hypot(par, perp) ** (NU - 1.0)
    return size * par, -sign * NU * size * S(t)


# --- One curve ----------------------------------------------------------------------------------------------------


def wrapped(angle):
    return math.remainder(angle, 2.0 * math.pi)


class Curve:
    """An open curve with free ends: its total cost and gradient by the slopes at its inner points."""

    def __init__(self, points):
        step = np.diff(points, axis=0)
        self.angle = np.arctan2(step[:, 1], step[:, 0]).tolist()
        self.scale = (np.hypot(step[:, 0], step[:, 1]) ** (1.0 - NU)).tolist()
        across = points[2:] - points[:-2]
        self.start = np.arctan2(across[:, 1], across[:, 0])

    def __call__(self, slopes):
        inner = slopes.tolist()
        gradient = np.zeros(len(inner))
        total, by = free_start(wrapped(inner[0] - self.angle[0]))
        total *= self.scale[0]
        gradient[0] = by * self.scale[0]
        for k in range(len(inner) - 1):
            a, b = (wrapped(slope - self.angle[k + 1]) for slope in inner[k : k + 2])
            cost, by_a, by_b = segment(a, b)
            total += cost * self.scale[k + 1]
            gradient[k] += by_a * self.scale[k + 1]
            gradient[k + 1] += by_b * self.scale[k + 1]
        # The last segment, reversed: its angle stays.
        cost, by = free_start(wrapped(inner[-1] - self.angle[-1]))
        gradient[-1] += by * self.scale[-1]
        return total + cost * self.scale[-1], gradient


def bfgs(curve):
    found = minimize(curve, curve.start, jac=True, method="BFGS", options={"gtol": TOLERANCE})
    return found.x, found.nit


def newton(curve):
    """Damped Newton: Hessian + lambda, lambda raised until it is positive definite and the cost falls."""
    x = curve.start.copy()
    cost, gradient = curve(x)
    damping = 0.0
    for iteration in range(100):
        if np.abs(gradient).max() < TOLERANCE:
            return x, iteration
        hessian = differenced(curve, x, gradient)
        while True:
            try:
                trial = x - solveh_banded(hessian + [[0.0], [damping]], gradient)
                trial_cost, trial_gradient = curve(trial)
                # Rounding, where the step is small.
                if trial_cost <= cost * (1.0 + 1e-13):
                    break
            except np.linalg.LinAlgError:
                pass
            damping = max(10.0 * damping, 1e-3 * np.abs(hessian[1]).max())
            if damping > 1e12:
                return x, iteration
        x, cost, gradient = trial, trial_cost, trial_gradient
        damping = 0.1 * damping if damping > 1e-6 else 0.0
    return x, 100


def differenced(curve, x, gradient, h=1e-6):
    """The tridiagonal Hessian as solveh_banded takes it: its columns k, k + 3, ... share no row."""
    n = len(x)
    diagonal, upper, lower = np.zeros(n), np.zeros(n), np.zeros(n)
    for colour in range(min(3, n)):
        columns = np.arange(colour, n, 3)
        moved = x.copy()
        moved[columns] += h
        change = (curve(moved)[1] - gradient) / h
        diagonal[columns] = change[columns]
        above, below = columns[columns > 0], columns[columns < n - 1]
        upper[above] = change[above - 1]
        lower[below + 1] = change[below + 1]
    return np.stack([0.5 * (upper + lower), diagonal])


# --- The cases ------------------------------------------------------------------------------------------------------


def random_points():
    """Open curves (CURVES, POINTS, 2): chords of 0.5 to 1.5 that turn by normal angles of 0.6 radians."""
    random = np.random.default_rng(SEED)
    length = random.uniform(0.5, 1.5, (CURVES, POINTS - 1))
    turn = random.normal(scale=0.6, size=(CURVES, POINTS - 1))
    angle = turn.cumsum(axis=1)
    step = np.stack([length * np.cos(angle), length * np.sin(angle)], axis=-1)
    return np.concatenate([np.zeros((CURVES, 1, 2)), step.cumsum(axis=1)], axis=1)


def random_angles():
    """Angles (SEGMENTS, 2) to the chord, of up to a right angle: all have a minimiser."""
    return np.random.default_rng(SEED + 1).uniform(-0.5 * math.pi, 0.5 * math.pi, (SEGMENTS, 2))


def write_input():
    points = random_points()
    offsets = np.arange(0, CURVES * POINTS + 1, POINTS, dtype=np.int64)
    ARGUMENTS.data.mkdir(exist_ok=True)
    np.savez(ARGUMENTS.data / "scf-points.npz", coords=points.reshape(-1, 2), offsets=offsets)
    start, end = random_angles().T
    np.savez(ARGUMENTS.data / "scf-segments.npz", start=start, end=end)


def median_time(run):
    """Microseconds: the median, the fastest and the slowest of several runs, after one that is not counted."""
    run()
    times = []
    for _ in range(ARGUMENTS.runs):
        start = time.perf_counter()
        run()
        times.append(1e6 * (time.perf_counter() - start))
    return statistics.median(times), min(times), max(times)


def report(case, peer, curves, points, timed, times, besides):
    micro = [round(t / timed, 4) for t in times]
    versions = {"python": platform.python_version(), "numpy": np.__version__, "scipy": scipy.__version__}
    line = {"case": case, "peer": peer, "versions": versions, "threads": 1, "curves": curves, "points": points}
    line |= {"us_per_curve": micro[0], "timed_curves": timed, "runs": ARGUMENTS.runs, "spread": micro[1:]}
    line |= {"load": round(os.getloadavg()[0], 1), "nu": NU} | besides
    print(json.dumps(line), flush=True)


def segments_case():
    angles = random_angles().tolist()
    found = np.array([segment(a, b) for a, b in angles])
    failed = int((~np.isfinite(found[:, 0])).sum())
    times = median_time(lambda: [segment(a, b) for a, b in angles])
    case = f"scf segments, nu {NU:g}"
    report(case, "scipy", SEGMENTS, 2 * SEGMENTS, SEGMENTS, times, {"cost": found[:, 0].mean(), "failed": failed})


def curves_case():
    timed = ARGUMENTS.curves
    curves = [Curve(points) for points in random_points()[:timed]]
    case, peers = f"scf {CURVES}x{POINTS}x2, nu {NU:g}", {"scipy": bfgs, "scipy-newton": newton}
    reached, lines = {}, []
    for peer, fit in peers.items():
        before = solves
        fits = [fit(curve) for curve in curves]
        used = (solves - before) / timed
        costs, gradients = zip(*(curve(slopes) for curve, (slopes, _) in zip(curves, fits, strict=True)), strict=True)
        reached[peer] = np.array(costs), np.array([slopes for slopes, _ in fits])
        iterations = [n for _, n in fits]
        largest = [np.abs(gradient).max() for gradient in gradients]
        besides = {"cost": float(np.mean(costs)), "gradient": float(max(largest))}
        besides |= {"iterations": [statistics.median(iterations), max(iterations)], "solves": used}
        besides |= {"failed": int(sum(g > 1e3 * TOLERANCE for g in largest))}
        times = median_time(lambda fit=fit: [fit(curve) for curve in curves])
        lines.append((peer, times, besides))
    (cost, slopes), (newton_cost, newton_slopes) = reached.values()
    np.savez(
        ARGUMENTS.data / "scf-scipy.npz", cost=cost, slopes=slopes, newton_cost=newton_cost, newton_slopes=newton_slopes
    )
    least, ours = np.minimum(cost, newton_cost), None
    if ARGUMENTS.faircurve:
        with np.load(ARGUMENTS.faircurve) as file:
            ours = file["cost"][:timed]
        least = np.minimum(least, ours)

    def excess(found):
        above = found / least - 1.0
        return [float(np.median(above)), float(above.max())]

    for peer, times, besides in lines:
        besides["excess"] = excess(reached[peer][0])
        if ours is not None:
            besides["faircurve_excess"] = excess(ours)
        report(case, peer, CURVES, CURVES * POINTS, timed, times, besides)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--data", type=Path, default=Path(__file__).parent.parent / "data")
    parser.add_argument("--curves", type=int, default=20, help="how many of the curves are timed")
    parser.add_argument("--write-input", action="store_true", help="write the input and time nothing")
    parser.add_argument("--faircurve", type=Path, help="faircurve's costs of the same curves, as NPZ")
    ARGUMENTS = parser.parse_args()
    if ARGUMENTS.write_input:
        write_input()
    else:
        ARGUMENTS.data.mkdir(exist_ok=True)
        segments_case()
        curves_case()
