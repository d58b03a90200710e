"""Writes smoothing.json, the reference values of the smoothing splines: python make_smoothing.py > smoothing.json

Minimises sum w_i |y_i - p(t_i)|^2 + lambda * integral of |p''|^2 dt, per coordinate; weights multiply the squares (not
their roots), lambda multiplies the integral over the parameter as given. SciPy's make_smoothing_spline(x, y, w, lam)
has the same conventions; it has no periodic form and needs five points.

"values" and "second_derivatives" come from the dense system (W + lambda K) g = W y, K = Q R^-1 Q^T, in 60 digits
(mpmath); "scipy_values" from SciPy 1.17.1 in double precision.
"""
import json
import sys

import mpmath as mp
import numpy as np
from scipy.interpolate import make_smoothing_spline

mp.mp.dps = 60


def exact(t, y, w, lam, period):
    """Values and second derivatives at the knots; period is None for natural ends."""
    n = len(t)
    t = [mp.mpf(x) for x in t]
    closed = period is not None
    h = [t[i + 1] - t[i] for i in range(n - 1)] + ([mp.mpf(period) - (t[-1] - t[0])] if closed else [])
    knots = range(n) if closed else range(1, n - 1)
    q, r = mp.zeros(n, len(knots)), mp.zeros(len(knots), len(knots))
    for column, k in enumerate(knots):
        left, right = h[k - 1], h[k]
        q[(k - 1) % n, column] += 1 / left
        q[k, column] -= 1 / left + 1 / right
        q[(k + 1) % n, column] += 1 / right
        r[column, column] += (left + right) / 3
        for other, x in ((column - 1, left / 6), (column + 1, right / 6)):
            if closed or 0 <= other < len(knots):
                r[column, other % len(knots)] += x
    r_inverse = r ** -1
    big_w = mp.diag([mp.mpf(x) for x in w])
    system = big_w + mp.mpf(lam) * (q * r_inverse * q.T)
    values, second = [], []
    for axis in range(len(y[0])):
        g = mp.lu_solve(system, big_w * mp.matrix([mp.mpf(p[axis]) for p in y]))
        gamma = r_inverse * (q.T * g)
        values.append([float(x) for x in g])
        second.append(([] if closed else [0.0]) + [float(x) for x in gamma] + ([] if closed else [0.0]))
    return [list(p) for p in zip(*values)], [list(p) for p in zip(*second)]


def case(random, n, closed, weighted, lam):
    t = np.round(np.cumsum(random.uniform(0.05, 2.0, n)) * 2.0**20) / 2.0**20
    y = np.round(random.normal(size=(n, 2)) * 2.0**20) / 2.0**20
    w = 10.0 ** random.uniform(-2, 2, n) if weighted else np.ones(n)
    period = float(t[-1] - t[0]) + 0.75 if closed else None
    values, second = exact(t.tolist(), y.tolist(), w.tolist(), lam, period)
    out = {"t": t.tolist(), "y": y.tolist(), "w": w.tolist() if weighted else None, "lambda": lam, "period": period,
           "values": values, "second_derivatives": second}
    if not closed and n >= 5:
        out["scipy_values"] = [[float(make_smoothing_spline(t, y[:, c], w, lam)(x)) for c in range(2)] for x in t]
        gap = np.abs(np.array(out["scipy_values"]) - np.array(values)).max()
        print(f"n {n}, lambda {lam}: scipy differs by {gap:.1e}", file=sys.stderr)
    return out


random = np.random.default_rng(20)
cases = [case(random, n, closed, weighted, lam)
         for closed in (False, True)
         for n, weighted, lam in ((2, True, 1.0), (3, True, 0.1), (4, False, 1.0), (5, True, 0.01), (12, True, 100.0),
                                  (12, False, 0.0), (20, True, 1e-4), (20, False, 1e6), (25, True, 1.0),
                                  (25, True, 1e30))]
print("{\"cases\": [\n" + ",\n".join(json.dumps(c) for c in cases) + "\n]}")
