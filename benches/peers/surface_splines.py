"""Times splines on the sphere in time: faircurve's Python package against SciPy with gradients of JAX.

2,000 tracks of 12 points on the unit sphere, at steps of 5 degrees that turn by a normal angle of sigma 0.3, at uneven times. Both make

    E = 1/2 sum of integrals |(I - n n^T) x''|^2 dt

least over places and velocities at 4 nodes a span, by Simpson's rule on cubic pieces. SciPy's L-BFGS-B has unit vectors of free length for
places, and the tangential part of free vectors for velocities; it starts from the natural spline in space. One JSON line a
peer, with the number of curves whose energy is within 1e-6 of faircurve's, or below.

usage: surface_splines.py [--scipy 10]     needs numpy, scipy, jax and faircurve
"""

import argparse
import json
import os
import platform
import time

import jax
import jax.numpy as jnp
import numpy as np
import scipy
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize

import faircurve as fc
from walks import walks

jax.config.update("jax_enable_x64", True)

CURVES, POINTS, PARTS, STEP, SIGMA = 2_000, 12, 4, np.radians(5.0), 0.3

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--scipy", type=int, default=10, help="curves that SciPy is timed on")
ARGUMENTS = parser.parse_args()


def tracks(rng):
    """Points of the unit sphere, and their times."""
    points, _ = walks(rng, CURVES, POINTS, STEP, SIGMA)
    steps = rng.uniform(0.5, 1.5, size=(CURVES, POINTS - 1))
    return points, np.concatenate([np.zeros((CURVES, 1)), np.cumsum(steps, axis=1)], axis=1)


def angles(places):
    return np.degrees(np.stack([np.arctan2(places[..., 1], places[..., 0]), np.arcsin(places[..., 2])], axis=-1))


@jax.jit
def energy(places, velocities, h):
    """Of nodes, at steps h."""
    x, y, v, w, h = places[:-1], places[1:], velocities[:-1], velocities[1:], h[:, None]
    start = (6 * (y - x) / h - 4 * v - 2 * w) / h
    end = (-6 * (y - x) / h + 2 * v + 4 * w) / h
    middle = 0.5 * (x + y) + h * (v - w) / 8

    def square(place, second):
        along = jnp.sum(place * second, axis=1) ** 2 / jnp.sum(place * place, axis=1)
        return jnp.sum(second * second, axis=1) - along

    whole = square(x, start) + 4 * square(middle, 0.5 * (start + end)) + square(y, end)
    return jnp.sum(whole * h[:, 0]) / 6


def of_vector(vector, fixed, h):
    places, velocities = vector.reshape(2, -1, 3)
    places = places / jnp.linalg.norm(places, axis=1, keepdims=True)
    places = places.at[::PARTS].set(fixed)
    velocities = velocities - jnp.sum(velocities * places, axis=1, keepdims=True) * places
    return 0.5 * energy(places, velocities, h)


slope = jax.jit(jax.value_and_grad(of_vector))


def with_scipy(points, t):
    nodes = np.interp(np.arange((POINTS - 1) * PARTS + 1) / PARTS, np.arange(POINTS), t)
    spline = CubicSpline(t, points, bc_type="natural")
    start = np.concatenate([spline(nodes), spline(nodes, 1)]).reshape(-1)
    h = np.diff(nodes)
    found = minimize(
        lambda vector: tuple(np.asarray(x, dtype=float) for x in slope(vector, points, h)),
        start, jac=True, method="L-BFGS-B", options={"maxiter": 20_000, "maxfun": 40_000, "ftol": 1e-15, "gtol": 1e-9},
    )  # fmt: skip
    return 2 * found.fun


def best(act, runs=5):
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        act()
        times.append(time.perf_counter() - start)
    return min(times)


def main():
    points, t = tracks(np.random.default_rng(1))
    degrees = angles(points)
    natural = fc.Natural(surface="sphere:1")
    energies = natural.fit(degrees, t=t, device="cpu").energy
    own = best(lambda: natural.fit(degrees, t=t, device="cpu")) / CURVES
    print(json.dumps({"peer": "faircurve", "curves": CURVES, "us_a_curve": round(1e6 * own, 1)}))
    with_scipy(points[0], t[0])
    start = time.perf_counter()
    found = np.array([with_scipy(points[i], t[i]) for i in range(ARGUMENTS.scipy)])
    theirs = (time.perf_counter() - start) / ARGUMENTS.scipy
    excess = found / energies[: ARGUMENTS.scipy] - 1
    line = {
        "peer": f"scipy {scipy.__version__} L-BFGS-B, jax {jax.__version__}",
        "curves": ARGUMENTS.scipy,
        "us_a_curve": round(1e6 * theirs),
        "times": round(theirs / own),
        "as_low": int((excess < 1e-6).sum()),
        "excess": float(np.median(excess)),
        "lowest": float(excess.min()),
    }
    print(json.dumps(line))
    print(json.dumps({"machine": platform.machine(), "threads": os.cpu_count(), "load": round(os.getloadavg()[0], 1)}))


if __name__ == "__main__":
    main()
