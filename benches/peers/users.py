"""Splines of many curves beside what Python has: SciPy, interpax and csaps, times and memory in one run.

usage: users.py [RUNS]      needs faircurve, scipy, interpax and csaps

Every library runs in a separate process, one after the other. A time covers the fit of all curves and the values at 80 parameters
of each, the median of RUNS (5 by default; loops run once over 500 curves, and compiled ones are warm); memory is what the process has more while it keeps the fit than before.
"""

import gc
import importlib.metadata
import json
import platform
import resource
import subprocess
import sys
import time

import numpy as np

SAMPLES = 80
#: Curves of a loop, whose time per curve stands for all.
LOOPED = 500
CASES = {
    "natural, 20,000 × 10": (20_000, 10, "natural"),
    "natural, 1,000 × 100": (1_000, 100, "natural"),
    "smoothing, λ = 0.1, 20,000 × 10": (20_000, 10, "lam"),
    "smoothing, λ = 0.1, 1,000 × 100": (1_000, 100, "lam"),
    "smoothing, λ by gcv, 1,000 × 50": (1_000, 50, "gcv"),
    "fair, 7,000 × 10": (7_000, 10, "fair"),
}
PEERS = {"natural": ("faircurve", "scipy", "interpax", "csaps"), "lam": ("faircurve", "scipy", "csaps"), "gcv": ("faircurve", "scipy"), "fair": ("faircurve",)}


def data(curves, points):
    random = np.random.default_rng(points)
    t = np.cumsum(random.uniform(0.2, 1.8, (curves, points)), axis=1)
    return t, random.normal(size=(curves, points, 2)).cumsum(axis=1), np.linspace(t[:, 0], t[:, -1], SAMPLES, axis=1)


def of_faircurve(kind, t, y, u):
    import faircurve as fc

    method = {"natural": fc.Natural(), "lam": fc.Smoothing(lam=0.1), "gcv": fc.Smoothing(lam="gcv"), "fair": fc.Fair()}[kind]
    return lambda: method.fit(y, t=t, device="cpu"), lambda fit: fit.sample(SAMPLES)


def of_scipy(kind, t, y, u):
    from scipy.interpolate import CubicSpline, make_smoothing_spline

    make = {
        "natural": lambda x, v: CubicSpline(x, v, bc_type="natural"),
        "lam": lambda x, v: make_smoothing_spline(x, v, lam=0.1),
        # Without λ one coordinate at a time.
        "gcv": lambda x, v: [make_smoothing_spline(x, w) for w in v.T],
    }[kind]
    value = (lambda s, at: np.stack([one(at) for one in s], axis=1)) if kind == "gcv" else (lambda s, at: s(at))
    return lambda: [make(x, v) for x, v in zip(t, y)], lambda fits: np.stack([value(s, at) for s, at in zip(fits, u)])


def of_csaps(kind, t, y, u):
    from csaps import CubicSmoothingSpline

    smooth = 1.0 if kind == "natural" else 1 / (1 + 0.1)
    return (
        lambda: [CubicSmoothingSpline(x, v.T, smooth=smooth) for x, v in zip(t, y)],
        lambda fits: np.stack([s(at).T for s, at in zip(fits, u)]),
    )


def of_interpax(kind, t, y, u):
    import jax

    jax.config.update("jax_enable_x64", True)
    from interpax import CubicSpline

    t, y, u = (jax.device_put(one) for one in (t, y, u))
    fit = jax.jit(jax.vmap(lambda x, v: CubicSpline(x, v, bc_type="natural", check=False)))
    values = jax.jit(jax.vmap(lambda s, at: s(at)))
    return lambda: jax.block_until_ready(fit(t, y)), lambda made: np.asarray(values(made, u))


def resident():
    gc.collect()
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize()


def measure(name, peer, runs, path):
    curves, points, kind = CASES[name]
    t, y, u = data(curves, points)
    if peer in ("scipy", "csaps"):
        curves = min(curves, LOOPED)
        t, y, u = t[:curves], y[:curves], u[:curves]
    made = globals()[f"of_{peer}"]
    # Warm: imports, pools of threads, and for compilers all shapes.
    few = curves if peer == "interpax" else 50
    fit, values = made(kind, t[:few], y[:few], u[:few])
    values(fit())
    fit, values = made(kind, t, y, u)
    before = resident()
    kept = fit()
    memory = resident() - before
    np.save(path, values(kept))
    del kept
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        values(fit())
        times.append(time.perf_counter() - start)
    print(json.dumps({"us": 1e6 * float(np.median(times)) / curves, "bytes": memory / curves, "input": (t.nbytes + y.nbytes) / curves}))


def main():
    import tempfile

    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    with open("/proc/cpuinfo") as file:
        cpu = next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("numpy", "scipy", "interpax", "jax", "csaps"))
    print(f"{cpu}, Python {platform.python_version()}, {versions}\n")
    print("| case | library | µs a curve | times faircurve | bytes a curve kept | times its input | largest difference |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name, (_, _, kind) in CASES.items():
            own = None
            for peer in PEERS[kind]:
                path = f"{folder}/{peer}.npy"
                count = runs if peer in ("faircurve", "interpax") else 1
                done = subprocess.run([sys.executable, __file__, "--measure", name, peer, str(count), path], capture_output=True, text=True)
                if done.returncode:
                    print(f"| {name} | {peer} | failed: {done.stderr.strip().splitlines()[-1]} | | | | |", flush=True)
                    continue
                found = json.loads(done.stdout)
                values = np.load(path)
                own = own or (found["us"], values)
                error = np.abs(values - own[1][: len(values)]).max() / np.abs(values).max()
                print(
                    f"| {name} | {peer} | {found['us']:.3g} | {found['us'] / own[0]:.3g} | {found['bytes']:.0f} | "
                    f"{found['bytes'] / found['input']:.2g} | {'' if peer == 'faircurve' else f'{error:.0e}'} |",
                    flush=True,
                )


if __name__ == "__main__":
    if sys.argv[1:2] == ["--measure"]:
        case, library, count, path = sys.argv[2:]
        measure(case, library, int(count), path)
    else:
        main()
