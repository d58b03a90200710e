"""Times discrete fair curves in SciPy and in JAX: of all polygons through the points that of least energy.

The energy is faircurve's, bending + 0.1 length of polygons with 16 edges a span, and the gauge that keeps edges between data
points equal; the start is faircurve's, the natural spline divided into equal edges (peer_fair writes it):

    E(f) = sum |T' - T|^2 / a + 0.1 sum s + gamma/2 sum (s' - s)^2,    a = (s + s')/2,    gamma = 2 h^-3

with edges of lengths s and unit tangents T, the gauge at vertices that are no data points, h the mean edge of the start. All data
points are kept. One JSON line a peer, as natural.py prints them, with these besides:

    "iterations": [median, most], "energy": mean, "excess": [median, largest], "short": n

`energy` is without the gauge; `excess` that of the energy with the gauge over the lowest that any reached at the same
curve, relative, over the curves that the peer was timed on; `short` how many of them are more than 1e-6 above. The lines of
faircurve, from --faircurve, are printed again with the same energies computed from its vertices by the same function.

usage: fair.py [--runs 3] [--data benches/data] [--write-points] [--faircurve LINE.json] [--ftol 1e-12]
"""

import argparse
import json
import os
import platform
import statistics
import time
from functools import partial
from pathlib import Path

# All must be set before the libraries start: as many threads as this process may use cores, and no more.
THREADS = len(os.sched_getaffinity(0))
# SciPy's loop is all small vectors, which threads of its BLAS only slow down.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", str(THREADS))
os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402
import scipy  # noqa: E402
from scipy.optimize import minimize  # noqa: E402

jax.config.update("jax_enable_x64", True)

CASE = "fair 10000x5x2, 16 a span"  # as in peer_fair.rs
SEED, CURVES, POINTS, SEGMENTS = 64, 10_000, 5, 16
VERTICES = (POINTS - 1) * SEGMENTS + 1
LENGTH = 0.1
SCIPY_CURVES = 100  # how many curves SciPy's loop is timed on
CHUNK = 500  # curves that JAX iterates together: all wait for the last of their chunk, and larger chunks leave the caches
TOLERANCE = 1e-8  # of sqrt(g . z), for JAX: as faircurve's
MOST_ITERATIONS = 1000
MOST_OF_AN_EDGE = 0.5

DATA = np.arange(0, VERTICES, SEGMENTS)
FREE = np.setdiff1d(np.arange(VERTICES), DATA)
IS_FREE = np.isin(np.arange(VERTICES), FREE).astype(float)


def energy_and_gradient(xp, f, gamma, gauge=1.0):
    """E and its derivatives at the vertices f (..., VERTICES, 2), whichever of NumPy and JAX computes; one formula for all."""
    edge = f[..., 1:, :] - f[..., :-1, :]
    s = xp.sqrt((edge**2).sum(-1))
    t = edge / s[..., None]
    turn = t[..., 1:, :] - t[..., :-1, :]
    a = 0.5 * (s[..., 1:] + s[..., :-1])
    bending = (turn**2).sum(-1) / a
    uneven = IS_FREE[1:-1] * (s[..., 1:] - s[..., :-1])
    weight = gauge * gamma[..., None]
    energy = bending.sum(-1) + LENGTH * s.sum(-1) + (0.5 * weight * uneven**2).sum(-1)

    by_turn = 2.0 * turn / a[..., None]
    zero = xp.zeros_like(by_turn[..., :1, :])
    by_tangent = xp.concatenate([zero, by_turn], -2) - xp.concatenate([by_turn, zero], -2)
    by_a = -0.5 * bending / a
    by_uneven = weight * uneven
    none = xp.zeros_like(by_a[..., :1])
    by_length = LENGTH + xp.concatenate([none, by_a + by_uneven], -1) + xp.concatenate([by_a - by_uneven, none], -1)
    along = by_length - (t * by_tangent).sum(-1) / s
    by_edge = by_tangent / s[..., None] + along[..., None] * t
    gradient = xp.concatenate([zero, by_edge], -2) - xp.concatenate([by_edge, zero], -2)
    return energy, gradient


# --- SciPy: one curve after the other ---------------------------------------------------------------------------


def scipy_fit(start, gamma):
    """L-BFGS-B on the free coordinates."""
    f = start.copy()

    def both(x):
        f[FREE] = x.reshape(-1, 2)
        energy, gradient = energy_and_gradient(np, f, gamma)
        return energy, gradient[FREE].ravel()

    options = {"maxcor": 20, "ftol": ARGUMENTS.ftol, "gtol": 1e-8, "maxiter": 20_000, "maxfun": 40_000}
    found = minimize(both, start[FREE].ravel(), jac=True, method="L-BFGS-B", options=options)
    f[FREE] = found.x.reshape(-1, 2)
    return f, found.nit


# --- JAX: one function of one curve, mapped over all ---------------------------------------------------------------


def inverse_metric(length):
    """Of the two coordinates, the inverse of g -> 2 sum (D2 g)^2 a over the free vertices, for straight polygons of such edges.

    Rows and columns of data points are 0, so that they stay where they are.

    For curves that mostly run along x, second differences at data points bind y alone: along the curve nothing resists there.
    The points of the case stand at unit steps, so that one matrix serves all curves, which one frozen at each curve's own start
    does not: inverting those took JAX several times as long as the whole fit does with one for all.
    """
    rows = VERTICES - 2
    d2 = (np.eye(rows, VERTICES) - 2.0 * np.eye(rows, VERTICES, 1) + np.eye(rows, VERTICES, 2)) / length**2
    inverse = np.zeros((2, VERTICES, VERTICES))
    for c, a in enumerate((IS_FREE[1:-1], np.ones(rows))):
        metric = 2.0 * length * d2.T @ (a[:, None] * d2)
        inverse[c][np.ix_(FREE, FREE)] = np.linalg.inv(metric[np.ix_(FREE, FREE)])
    return inverse


def jax_fit(start, gamma):
    """Nonlinear conjugate gradients (the lesser of Hestenes-Stiefel and Dai-Yuan) with that metric as preconditioner.

    Each step goes where the slope vanishes by the secant through a trial at the last step's length: two gradients a step,
    no branches, which is what suits lanes in lockstep. No edge changes by more than half its length in a step.
    """
    metric = jnp.asarray(inverse_metric(1.0 / SEGMENTS))

    def gradient(x):
        return energy_and_gradient(jnp, x, gamma)[1]

    def precondition(g):
        return jnp.einsum("cij,jc->ic", metric, g)

    def going(state):
        _, _, _, norm2, _, _, iteration = state
        return (norm2 > TOLERANCE**2) & (iteration < MOST_ITERATIONS)

    def step(state):
        x, g, p, norm2, slope, alpha, iteration = state
        change, edge = p[1:] - p[:-1], x[1:] - x[:-1]
        most = MOST_OF_AN_EDGE / jnp.sqrt(((change**2).sum(-1) / (edge**2).sum(-1)).max())
        trial = jnp.minimum(alpha, most)
        bend = ((gradient(x + trial * p) * p).sum() - slope) / trial
        secant = jnp.where(bend > 0, -slope / bend, 2 * trial)
        alpha = jnp.minimum(secant, most)
        x = x + alpha * p
        after = gradient(x)
        z = precondition(after)
        norm2 = (after * z).sum()
        change = (after * p).sum() - slope
        beta = jnp.where(change > 0, jnp.maximum(jnp.minimum((norm2 - (g * z).sum()) / change, norm2 / change), 0.0), 0.0)
        descends = beta * (after * p).sum() < norm2
        p = jnp.where(descends, beta, 0.0) * p - z
        return x, after, p, norm2, (after * p).sum(), alpha, iteration + 1

    g = gradient(start)
    z = precondition(g)
    norm2 = (g * z).sum()
    state = jax.lax.while_loop(going, step, (start, g, -z, norm2, -norm2, jnp.ones(()), 0))
    return state[0], state[-1]


@partial(jax.jit, static_argnums=2)
def jax_fits(starts, gammas, chunk):
    """All curves, chunk after chunk."""
    return jax.lax.map(lambda curve: jax_fit(*curve), (starts, gammas), batch_size=chunk)


# --- JAX: Newton with a dense Hessian, mapped over all -----------------------------------------------------------------

NEWTON_CURVES = 1000  # how many curves it is timed on
NEWTON_CHUNK = 100  # whose Hessians of 120 x 120 numbers are iterated together


def jax_newton(start, gamma):
    """(H + lambda I) p = -g with H by automatic differentiation, lambda 0 until a step fails; stops as jax_fit does."""
    metric = jnp.asarray(inverse_metric(1.0 / SEGMENTS))

    def place(x):
        return start.at[FREE].set(x.reshape(-1, 2))

    def energy(x):
        return energy_and_gradient(jnp, place(x), gamma)[0]

    hessian = jax.hessian(energy)

    def slope(x):
        g = energy_and_gradient(jnp, place(x), gamma)[1]
        return g[FREE].ravel(), (g * jnp.einsum("cij,jc->ic", metric, g)).sum()

    def going(state):
        _, _, _, norm2, _, iteration = state
        return (norm2 > TOLERANCE**2) & (iteration < MOST_ITERATIONS)

    def step(state):
        x, value, g, norm2, damping, iteration = state
        factor = jax.scipy.linalg.cho_factor(hessian(x) + damping * jnp.eye(x.size))
        p = -jax.scipy.linalg.cho_solve(factor, g)
        trial = energy(x + p)
        taken = trial <= value + 1e-14 * jnp.abs(value)
        x = jnp.where(taken, x + p, x)
        damping = jnp.where(taken, jnp.where(damping > 1e-3, 0.1 * damping, 0.0), jnp.maximum(4.0 * damping, 1.0))
        g, norm2 = slope(x)
        return x, jnp.where(taken, trial, value), g, norm2, damping, iteration + 1

    x = start[FREE].ravel()
    state = jax.lax.while_loop(going, step, (x, energy(x), *slope(x), jnp.zeros(()), 0))
    return place(state[0]), state[-1]


@partial(jax.jit, static_argnums=2)
def jax_newtons(starts, gammas, chunk):
    """All curves, chunk after chunk."""
    return jax.lax.map(lambda curve: jax_newton(*curve), (starts, gammas), batch_size=chunk)


# --- The case -----------------------------------------------------------------------------------------------------


def write_points():
    """Points at unit steps with normal heights, as a file that faircurve reads."""
    heights = 0.2 * np.random.default_rng(SEED).normal(size=(CURVES, POINTS))
    x = np.broadcast_to(np.arange(POINTS, dtype=float), heights.shape)
    ARGUMENTS.data.mkdir(exist_ok=True)
    offsets = np.arange(0, heights.size + 1, POINTS, dtype=np.int64)
    np.savez(ARGUMENTS.data / "fair-points.npz", coords=np.stack([x, heights], -1).reshape(-1, 2), offsets=offsets)


def vertices(name):
    with np.load(ARGUMENTS.data / name) as file:
        return file["coords"].reshape(CURVES, VERTICES, 2)


def median_time(run, runs, warm):
    """Seconds: the median, the fastest and the slowest of several runs, after one that is not counted if `warm`."""
    times = []
    for count in range(runs + warm):
        start = time.perf_counter()
        result = run()
        if count >= warm:
            times.append(time.perf_counter() - start)
    return result, [statistics.median(times), min(times), max(times)]


def main():
    start, ours = vertices("fair-start.npz"), vertices("fair-faircurve.npz")
    edges = np.sqrt((np.diff(start, axis=1) ** 2).sum(-1))
    gammas = 2.0 / edges.mean(-1) ** 3

    on_device = [jnp.asarray(a) for a in (start, gammas)]
    (by_jax, jax_iterations), jax_times = median_time(
        lambda: jax.block_until_ready(jax_fits(*on_device, CHUNK)), ARGUMENTS.runs, warm=True
    )
    by_jax, jax_iterations = np.asarray(by_jax), np.asarray(jax_iterations)
    few = [a[:NEWTON_CURVES] for a in on_device]
    (by_newton, newton_iterations), newton_times = median_time(
        lambda: jax.block_until_ready(jax_newtons(*few, NEWTON_CHUNK)), ARGUMENTS.runs, warm=True
    )
    by_newton, newton_iterations = np.asarray(by_newton), np.asarray(newton_iterations)
    # A loop of seconds does not change by a run before it; every run is counted.
    found, scipy_times = median_time(
        lambda: [scipy_fit(start[i], gammas[i]) for i in range(SCIPY_CURVES)], ARGUMENTS.runs, warm=False
    )
    by_scipy, scipy_iterations = np.stack([f for f, _ in found]), np.array([n for _, n in found])

    peers = {"faircurve": ours, "scipy": by_scipy, "jax": by_jax, "jax-newton": by_newton}
    reached = {peer: energy_and_gradient(np, f, gammas[: len(f)])[0] for peer, f in peers.items()}
    lowest = np.minimum(reached["faircurve"], reached["jax"])
    lowest[:NEWTON_CURVES] = np.minimum(lowest[:NEWTON_CURVES], reached["jax-newton"])
    lowest[:SCIPY_CURVES] = np.minimum(lowest[:SCIPY_CURVES], reached["scipy"])

    def energies(peer):
        f = peers[peer]
        excess = (reached[peer] - lowest[: len(f)]) / lowest[: len(f)]
        line = {"energy": energy_and_gradient(np, f, gammas[: len(f)], 0.0)[0].mean()}
        return line | {"excess": [float(np.median(excess)), float(excess.max())], "short": int((excess > 1e-6).sum())}

    if ARGUMENTS.faircurve:
        line = json.loads(ARGUMENTS.faircurve.read_text(encoding="utf8"))
        print(json.dumps(line | energies("faircurve")), flush=True)
    for peer, times, iterations, threads in [
        ("scipy", scipy_times, scipy_iterations, 1),
        ("jax", jax_times, jax_iterations, THREADS),
        ("jax-newton", newton_times, newton_iterations, THREADS),
    ]:
        timed = len(peers[peer])
        micro = [round(1e6 * t / timed, 4) for t in times]
        versions = {"python": platform.python_version(), "numpy": np.__version__}
        versions |= {"scipy": scipy.__version__} if peer == "scipy" else {"jax": jax.__version__}
        line = {"case": CASE, "peer": peer, "versions": versions, "threads": threads, "curves": CURVES}
        line |= {"points": CURVES * POINTS, "us_per_curve": micro[0], "timed_curves": timed, "runs": ARGUMENTS.runs}
        line |= {"spread": micro[1:], "load": round(os.getloadavg()[0], 1)}
        line |= {"iterations": [int(np.median(iterations)), int(iterations.max())]}
        print(json.dumps(line | energies(peer)), flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--data", type=Path, default=Path(__file__).parent.parent / "data")
    parser.add_argument("--write-points", action="store_true", help="write fair-points.npz and time nothing")
    parser.add_argument("--faircurve", type=Path, help="the line of peer_fair")
    parser.add_argument("--ftol", type=float, default=1e-12, help="SciPy's")
    ARGUMENTS = parser.parse_args()
    if ARGUMENTS.write_points:
        write_points()
    else:
        main()
