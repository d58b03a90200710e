"""Times fair curves of bounded curvature: faircurve's Python package, SciPy's SLSQP and CasADi with IPOPT.

1,000 curves of 5 points at unit steps, heights normal with sigma 0.6, 16 edges a span, bending + 0.1 length; every curve's bound is
0.9 of its largest curvature without limits. The peers minimise the same discrete energy with the same gauge,

    E(f) = sum |T' - T|^2 / a + 0.1 sum s + gamma/2 sum (s' - s)^2,    |T' - T| / a <= kappa,    a = (s + s')/2

from the curve without limits; faircurve finds that curve within its time. IPOPT has exact sparse second derivatives, and its
start-up (building and differentiating expressions) is outside of its time, one function for all curves. SLSQP has exact
gradients. One JSON line a peer, with the number of curves whose energy is within 1e-6 of faircurve's, or below.

usage: limits.py [--ipopt 50] [--slsqp 3]     needs numpy, scipy, casadi and faircurve
"""

import argparse
import json
import os
import platform
import time

import casadi
import numpy as np
import scipy
from scipy.optimize import minimize

import faircurve as fc

CURVES, POINTS, SEGMENTS, SIGMA, LENGTH, PART = 1000, 5, 16, 0.6, 0.1, 0.9
VERTICES = (POINTS - 1) * SEGMENTS + 1
FREE = np.array([v for v in range(VERTICES) if v % SEGMENTS])
GAUGE = 30 * 2  # times h^-3

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--ipopt", type=int, default=50, help="curves that IPOPT is timed on")
parser.add_argument("--slsqp", type=int, default=3, help="curves that SLSQP is timed on")
ARGUMENTS = parser.parse_args()


def curvatures(f):
    edge = np.diff(f, axis=-2)
    s = np.sqrt((edge**2).sum(-1))
    turn = np.diff(edge / s[..., None], axis=-2)
    return np.sqrt((turn**2).sum(-1)) / (0.5 * (s[..., 1:] + s[..., :-1]))


def problem():
    """Energy with gauge, energy alone and squared curvatures as functions of the free vertices, the data and gamma."""
    free, data, gamma = casadi.SX.sym("free", 2, len(FREE)), casadi.SX.sym("data", 2, POINTS), casadi.SX.sym("gamma")
    where = {v: k for k, v in enumerate(FREE)}
    at = [free[:, where[v]] if v in where else data[:, v // SEGMENTS] for v in range(VERTICES)]
    edges = [b - a for a, b in zip(at, at[1:])]
    s = [casadi.sqrt(casadi.dot(e, e)) for e in edges]
    t = [e / length for e, length in zip(edges, s)]
    a = [0.5 * (p + q) for p, q in zip(s, s[1:])]
    turns = [q - p for p, q in zip(t, t[1:])]
    energy = sum(casadi.dot(d, d) / m for d, m in zip(turns, a)) + LENGTH * sum(s)
    gauge = sum((s[v] - s[v - 1]) ** 2 for v in FREE)
    squares = casadi.vertcat(*[casadi.dot(d, d) / (m * m) for d, m in zip(turns, a)])
    return free, data, gamma, energy, energy + 0.5 * gamma * gauge, squares


def report(peer, seconds, curves, energies, exact, **more):
    near = int(sum(e <= (1 + 1e-6) * x for e, x in zip(energies, exact)))
    line = {"case": f"bounded {CURVES}x{POINTS}x2, {SEGMENTS} a span", "peer": peer, "us_per_curve": round(1e6 * seconds / curves, 1)}
    line |= {"timed_curves": curves, "near": near, "threads": len(os.sched_getaffinity(0)), "load": round(os.getloadavg()[0], 1)}
    print(json.dumps(line | more | {"python": platform.python_version()}), flush=True)


rng = np.random.default_rng(21)
points = np.stack([np.broadcast_to(np.arange(POINTS, dtype=float), (CURVES, POINTS)), SIGMA * rng.normal(size=(CURVES, POINTS))], -1)
method = fc.Fair({"bending": 1, "length": LENGTH}, per_span=SEGMENTS)
start = method.fit(points).sample(per_span=SEGMENTS).reshape(CURVES, VERTICES, 2)
bound = PART * curvatures(start).max(-1)
bounds = np.repeat(bound, POINTS).reshape(CURVES, POINTS)
times = []
for _ in range(5):
    began = time.perf_counter()
    fit = method.fit(points, largest_curvatures=bounds, device="cpu")
    times.append(time.perf_counter() - began)
table = fit.report()
kept = np.flatnonzero(fit.status == "converged")
report("faircurve for Python", float(np.median(times)), CURVES, table["energy"], table["energy"], kept=len(kept), version=fc.__version__)

free, data, gamma, energy, with_gauge, squares = problem()
x, p = casadi.vec(free), casadi.vertcat(casadi.vec(data), gamma)
alone = casadi.Function("energy", [x, p], [energy])
options = {"ipopt.print_level": 0, "print_time": False, "ipopt.tol": 1e-9, "ipopt.sb": "yes", "ipopt.max_iter": 500}
solver = casadi.nlpsol("solver", "ipopt", {"x": x, "p": p, "f": with_gauge, "g": squares}, options)
first = casadi.Function("e", [x, p], [with_gauge, casadi.gradient(with_gauge, x)])
limits = casadi.Function("c", [x, p], [squares, casadi.jacobian(squares, x)])


def parameters(i):
    return np.append(points[i].ravel(), GAUGE * (np.sqrt((np.diff(start[i], axis=0) ** 2).sum(-1)).mean()) ** -3)


def timed(peer, count, one, version):
    chosen, found, own, began = kept[:count], [], [], time.perf_counter()
    for i in chosen:
        result, iterations = one(i)
        found.append(result)
        own.append(iterations)
    seconds = time.perf_counter() - began
    energies = [float(alone(result, parameters(i))) for result, i in zip(found, chosen)]
    report(peer, seconds, count, energies, table["energy"][chosen], iterations=float(np.median(own)), version=version)


def by_ipopt(i):
    found = solver(x0=start[i][FREE].ravel(), p=parameters(i), lbg=-np.inf, ubg=bound[i] ** 2)
    return found["x"], solver.stats()["iter_count"]


def by_slsqp(i):
    own, most = parameters(i), bound[i] ** 2

    def value(x):
        e, g = first(x, own)
        return float(e), np.asarray(g).ravel()

    room = {
        "type": "ineq",
        "fun": lambda x: most - np.asarray(limits(x, own)[0]).ravel(),
        "jac": lambda x: -np.asarray(limits(x, own)[1]),
    }
    found = minimize(value, start[i][FREE].ravel(), jac=True, method="SLSQP", constraints=[room], options={"maxiter": 2000, "ftol": 1e-12})
    return found.x, found.nit


timed("CasADi and IPOPT", ARGUMENTS.ipopt, by_ipopt, casadi.__version__)
timed("SciPy SLSQP", ARGUMENTS.slsqp, by_slsqp, scipy.__version__)
