"""Times fair curves in surfaces: faircurve's Python package, SciPy in longitudes and latitudes, and Pymanopt on a product of spheres.

10,000 tracks of 5 points on the unit sphere, at steps of 5 degrees that turn by a normal angle of sigma 0.2, 16 edges a span. The peers
minimise the same discrete energy with the same gauge on a few of them,

    E(x) = sum |m|^2 / a + L sum s + gamma/2 sum (s' - s)^2,    m = (I - x x^T)(T' - T),    a = (s + s')/2,    |x| = 1

from the same start, the spline of the points moved onto the sphere. Both have exact gradients: SciPy's L-BFGS-B by the angles of the free
vertices, Pymanopt's trust regions with products of Hessians by differences of gradients. One JSON line a peer, with the
number of curves whose energy is within 1e-6 of faircurve's, or below.

Geodesics between 10,000 random pairs of points of WGS84, 64 edges, have their lengths checked against geographiclib.

usage: surfaces.py [--scipy 20] [--pymanopt 5]     needs numpy, scipy, pymanopt, geographiclib and faircurve
"""

import argparse
import json
import os
import platform
import time

import numpy as np
import pymanopt
import scipy
from geographiclib.geodesic import Geodesic
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize

import faircurve as fc
from walks import walks

CURVES, POINTS, SEGMENTS, STEP, SIGMA = 10_000, 5, 16, np.radians(5.0), 0.2
LENGTH = 0.1 / STEP**2
VERTICES = (POINTS - 1) * SEGMENTS + 1
FREE = np.array([v for v in range(VERTICES) if v % SEGMENTS])

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--scipy", type=int, default=20, help="curves that SciPy is timed on")
parser.add_argument("--pymanopt", type=int, default=5, help="curves that Pymanopt is timed on")
ARGUMENTS = parser.parse_args()


def on_both(rng):
    """Points of the unit sphere, and the same turns at steps of the same length in the plane."""
    points, turns = walks(rng, CURVES, POINTS, STEP, SIGMA)
    angle = np.cumsum(turns, axis=1)
    steps = STEP * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return points, np.concatenate([np.zeros((CURVES, 1, 2)), np.cumsum(steps, axis=1)], axis=1)


def best(act, runs=5):
    """The least time of a few runs in seconds, and what came out."""
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        out = act()
        times.append(time.perf_counter() - start)
    return min(times), out


def energy(x, gamma):
    """The energy, that without the gauge, and the gradient by all vertices in space."""
    edge = np.diff(x, axis=0)
    s = np.linalg.norm(edge, axis=1)
    t = edge / s[:, None]
    d, n, a = np.diff(t, axis=0), x[1:-1], 0.5 * (s[1:] + s[:-1])
    q = (n * d).sum(1)
    m = d - q[:, None] * n
    bend = (m * m).sum(1) / a
    uneven = np.diff(s)[FREE - 1]
    alone = bend.sum() + LENGTH * s.sum()
    by_t, by_s = np.zeros_like(t), np.full_like(s, LENGTH)
    by_t[1:] += 2 * m / a[:, None]
    by_t[:-1] -= 2 * m / a[:, None]
    by_s[1:] -= 0.5 * bend / a
    by_s[:-1] -= 0.5 * bend / a
    np.add.at(by_s, FREE, gamma * uneven)
    np.add.at(by_s, FREE - 1, -gamma * uneven)
    by_edge = (by_t - (by_t * t).sum(1, keepdims=True) * t) / s[:, None] + by_s[:, None] * t
    g = np.zeros_like(x)
    g[1:] += by_edge
    g[:-1] -= by_edge
    g[1:-1] -= (2 * q / a)[:, None] * d
    return alone + 0.5 * gamma * (uneven**2).sum(), alone, g


def start(points):
    """The natural spline by chords, moved onto the sphere."""
    t = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    u = np.concatenate([np.linspace(a, b, SEGMENTS, endpoint=False) for a, b in zip(t, t[1:])] + [[t[-1]]])
    x = CubicSpline(t, points, bc_type="natural")(u)
    return x / np.linalg.norm(x, axis=1, keepdims=True)


def gamma_of(x):
    s = np.linalg.norm(np.diff(x, axis=0), axis=1)
    return 2 * s.mean() ** -3


def by_scipy(points):
    x = start(points)
    gamma = gamma_of(x)
    # Angles from the middle of the track, so that no pole is near.
    middle = x[VERTICES // 2]
    axes = np.linalg.svd(middle[None])[2]
    axes[0] = middle
    y = x @ axes.T

    def place(angles):
        lon, lat = angles.reshape(2, -1)
        out = y.copy()
        out[FREE] = np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=1)
        return out

    def act(angles):
        lon, lat = angles.reshape(2, -1)
        value, _, g = energy(place(angles), gamma)
        g = g[FREE]
        by_lon = g[:, 0] * -np.cos(lat) * np.sin(lon) + g[:, 1] * np.cos(lat) * np.cos(lon)
        by_lat = g[:, 0] * -np.sin(lat) * np.cos(lon) + g[:, 1] * -np.sin(lat) * np.sin(lon) + g[:, 2] * np.cos(lat)
        return value, np.concatenate([by_lon, by_lat])

    first = np.concatenate([np.arctan2(y[FREE, 1], y[FREE, 0]), np.arcsin(y[FREE, 2])])
    found = minimize(act, first, jac=True, method="L-BFGS-B", options={"maxiter": 20_000, "maxfun": 20_000, "ftol": 1e-15, "gtol": 1e-9})
    return energy(place(found.x), gamma)[1]


def by_pymanopt(points):
    x = start(points)
    gamma = gamma_of(x)
    manifold = pymanopt.manifolds.Oblique(3, len(FREE))

    def place(free):
        out = x.copy()
        out[FREE] = free.T
        return out

    @pymanopt.function.numpy(manifold)
    def cost(free):
        return energy(place(free), gamma)[0]

    @pymanopt.function.numpy(manifold)
    def gradient(free):
        return energy(place(free), gamma)[2][FREE].T

    @pymanopt.function.numpy(manifold)
    def hessian(free, along):
        step = 1e-6 / max(np.linalg.norm(along), 1e-300)
        ahead, back = (energy(place(free + sign * step * along), gamma)[2][FREE].T for sign in (1, -1))
        return (ahead - back) / (2 * step)

    problem = pymanopt.Problem(manifold, cost, euclidean_gradient=gradient, euclidean_hessian=hessian)
    optimizer = pymanopt.optimizers.TrustRegions(max_iterations=1_000, max_time=600, min_gradient_norm=1e-6, verbosity=0)
    found = optimizer.run(problem, initial_point=x[FREE].T.copy())
    return energy(place(found.point), gamma)[1]


def line(case, peer, seconds, curves, **more):
    numbers = {"us_per_curve": round(1e6 * seconds / curves, 2), "timed_curves": curves, "load": round(os.getloadavg()[0], 2)}
    versions = {"python": platform.python_version(), "scipy": scipy.__version__, "pymanopt": pymanopt.__version__, "faircurve": fc.__version__}
    print(json.dumps({"case": case, "peer": peer, "versions": versions, **numbers, **more}), flush=True)


def tracks():
    points, flat = on_both(np.random.default_rng(1))
    case = f"{CURVES} tracks of {POINTS} points on the sphere, {SEGMENTS} edges a span"
    on_sphere = fc.Fair({"geodesic_bending": 1, "length": LENGTH}, surface="ellipsoid:1,1,1")
    in_space = fc.Fair({"bending": 1, "length": LENGTH})
    seconds, fit = best(lambda: on_sphere.fit(points))
    report = fit.report()
    assert (fit.status == "converged").all()
    for name, fair, given in [("faircurve, in space", in_space, points), ("faircurve, in the plane", in_space, flat)]:
        free, other = best(lambda: fair.fit(given))
        per_iteration = (seconds / report["iterations"].sum()) / (free / other.report()["iterations"].sum())
        line(case, name, free, CURVES, iterations=float(np.mean(other.report()["iterations"])), sphere_per_iteration=round(per_iteration, 2))
    line(case, "faircurve", seconds, CURVES, iterations=float(np.mean(report["iterations"])))
    lon, lat = np.arctan2(points[..., 1], points[..., 0]), np.arcsin(points[..., 2])
    degrees = np.degrees(np.stack([lon, lat], axis=-1))
    seconds_of_degrees, _ = best(lambda: fc.Fair(surface="wgs84").fit(degrees))
    line(case, "faircurve, longitudes and latitudes of WGS84, tautness", seconds_of_degrees, CURVES)
    for peer, act, count in [("scipy L-BFGS-B", by_scipy, ARGUMENTS.scipy), ("pymanopt trust regions", by_pymanopt, ARGUMENTS.pymanopt)]:
        began = time.perf_counter()
        energies = np.array([act(points[i]) for i in range(count)])
        took = time.perf_counter() - began
        close = int((energies <= report["energy"][:count] * (1 + 1e-6)).sum())
        line(case, peer, took, count, as_good=close, times_faircurve=round(took / count / (seconds / CURVES)))


def geodesics():
    rng = np.random.default_rng(2)
    at = rng.normal(size=(CURVES, 2, 3))
    at /= np.linalg.norm(at, axis=-1, keepdims=True)
    pairs = np.degrees(np.stack([np.arctan2(at[..., 1], at[..., 0]), np.arcsin(at[..., 2])], axis=-1))
    seconds, fit = best(lambda: fc.Geodesic("wgs84", per_span=64).fit(pairs), 1)
    exact = np.array([Geodesic.WGS84.Inverse(a[1], a[0], b[1], b[0])["s12"] for a, b in pairs])
    began = time.perf_counter()
    for a, b in pairs[:1000]:
        Geodesic.WGS84.Inverse(a[1], a[0], b[1], b[0])
    of_library = (time.perf_counter() - began) / 1000
    found, usable = fit.length, fit.status == "converged"
    error = np.abs(found / exact - 1)[usable]
    angle = np.degrees(np.arccos(np.clip((at[:, 0] * at[:, 1]).sum(-1), -1, 1)))
    line(
        f"{CURVES} geodesics of WGS84, 64 edges", "faircurve", seconds, CURVES, usable=int(usable.sum()), error=float(error.max()),
        median_error=float(np.median(error)), within_1e6=int((error < 1e-6).sum()), farthest_unusable=float(angle[~usable].min(initial=180.0)),
        geographiclib_us=round(1e6 * of_library, 1),
    )  # fmt: skip


tracks()
geodesics()
