"""Times Laplacian subdivision of grids in SciPy: the sparse 5 x 5 rule as a convolution, the exact rule by cosine transforms and by sparse LU.

The rule's interior mask and faircurve's surfaces are read from the file that `peer_laplacian` writes; SciPy's surfaces are compared with them, those of the
sparse rule away from borders, where faircurve has rules of its own and SciPy mirrors the grid. All in f64, one thread (SciPy has no more here, but
`dctn`, which gets all). Written as by people who have such grids:

* `scipy-convolve`: zeros put between the points, then `ndimage.convolve`;
* `scipy-polyphase`: four `ndimage.correlate` of the old points, one for each parity of row and column: no product with zeros;
* `scipy-oaconvolve`: zeros put between, then `signal.oaconvolve`;
* `scipy-dctn` (exact rule): `fft.dctn` of type 1, the quotient of eigenvalues, `fft.idctn`;
* `scipy-splu` (exact rule): the energy matrix, one point fixed, factorised by `sparse.linalg.splu` and solved; in each run anew.

One JSON line a case and peer, as natural.py prints them; a "curve" is a grid, "points" are those made. With --write-input the grids are written:
laplacian-large.npz, laplacian-small.npz.

usage: laplacian.py [--runs 3] [--data benches/data] [--write-input | --faircurve benches/data/laplacian-faircurve.npz]
"""

import argparse
import json
import os
import platform
import statistics
import time
from pathlib import Path

import numpy as np
import scipy
from scipy import fft, ndimage, signal, sparse

SEED = 7
SHAPES = {"large": (1, 1025, 1025), "small": (10_000, 9, 9)}
CASES = {
    "sparse": "laplacian 5x5, 1025x1025, 1 round",
    "batch": "laplacian 5x5, 10000 of 9x9, 3 rounds",
    "exact": "laplacian exact, 257x257, 1 round",
}


def upsampled(p):
    fine = np.zeros((p.shape[0], 2 * p.shape[1] - 1, 2 * p.shape[2] - 1))
    fine[:, ::2, ::2] = p
    return fine


def convolve(p, mask):
    return ndimage.convolve(upsampled(p), mask[None], mode="mirror")


def oaconvolve(p, mask):
    return signal.oaconvolve(upsampled(p), mask[None], mode="same", axes=(1, 2))


def polyphase(p, mask):
    fine = np.empty((p.shape[0], 2 * p.shape[1] - 1, 2 * p.shape[2] - 1))
    for i in (0, 1):
        for j in (0, 1):
            # Odd points look at the old ones before and after.
            phase = ndimage.correlate(p, mask[None, i::2, j::2], mode="mirror", origin=(0, -i, -j))
            fine[:, i::2, j::2] = phase[:, : p.shape[1] - i, : p.shape[2] - j]
    return fine


def dctn(p, _):
    n, m = p.shape[1] - 1, p.shape[2] - 1
    coarse = fft.dctn(p, type=1, axes=(1, 2), workers=-1)
    fold = lambda n: np.r_[0 : n + 1, n - 1 : -1 : -1]
    eigen = lambda n: 2 - 2 * np.cos(np.pi * np.arange(2 * n + 1) / (2 * n))
    fine = eigen(n)[:, None] + eigen(m)[None]
    spread = (eigen(n) * (4 - eigen(n)))[:, None] + (eigen(m) * (4 - eigen(m)))[None]
    fine[0, 0] = 1
    ratio = spread / fine
    ratio[0, 0] = 4
    return fft.idctn(coarse[:, fold(n)][:, :, fold(m)] * ratio, type=1, axes=(1, 2), workers=-1)


def energy(n, m):
    k = lambda n: sparse.diags([np.r_[1, 2 * np.ones(n - 1), 1], -np.ones(n), -np.ones(n)], [0, 1, -1])
    w = lambda n: sparse.diags(np.r_[0.5, np.ones(n - 1), 0.5])
    return (sparse.kron(k(n), w(m)) + sparse.kron(w(n), k(m))).tocsc()


def splu(p, _):
    n, m = p.shape[1] - 1, p.shape[2] - 1
    right = upsampled((energy(n, m) @ p[0].ravel()).reshape(1, n + 1, m + 1)).ravel()
    fine = np.zeros_like(right)
    fine[1:] = sparse.linalg.splu(energy(2 * n, 2 * m)[1:, 1:], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(right[1:])
    fine = fine.reshape(2 * n + 1, 2 * m + 1)
    mean = lambda p: (np.r_[0.5, np.ones(p.shape[0] - 2), 0.5] @ p @ np.r_[0.5, np.ones(p.shape[1] - 2), 0.5]) / ((p.shape[0] - 1) * (p.shape[1] - 1))
    return (fine + mean(p[0]) - mean(fine))[None]


def rounds(subdivide, count):
    def work(p, mask):
        for _ in range(count):
            p = subdivide(p, mask)
        return p

    return work


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--data", type=Path, default=Path("benches/data"))
    parser.add_argument("--write-input", action="store_true")
    parser.add_argument("--faircurve", type=Path, default=Path("benches/data/laplacian-faircurve.npz"))
    arguments = parser.parse_args()
    rng = np.random.default_rng(SEED)
    grids = {name: rng.uniform(-1, 1, shape) for name, shape in SHAPES.items()}
    if arguments.write_input:
        for name, grid in grids.items():
            np.savez(arguments.data / f"laplacian-{name}.npz", grids=grid)
        return
    ours = np.load(arguments.faircurve)
    mask = ours["mask"]
    large, small = grids["large"], grids["small"]
    jobs = [("sparse", f"scipy-{f.__name__}", large, f, 16) for f in (convolve, polyphase, oaconvolve)]
    jobs += [("batch", f"scipy-{f.__name__}", small, rounds(f, 3), 28) for f in (convolve, polyphase)]
    jobs += [("exact", f"scipy-{f.__name__}", large[:, :257, :257], f, 0) for f in (dctn, splu)]
    for kind, peer, grid, work, border in jobs:
        fine = work(grid, mask)
        inner = slice(border, -border or None)
        worst = np.abs(fine - ours[kind])[:, inner, inner].max()
        times = []
        for run in range(arguments.runs + 1):
            start = time.perf_counter()
            work(grid, mask)
            if run:
                times.append(1e6 * (time.perf_counter() - start) / len(grid))
        line = {
            "case": CASES[kind],
            "peer": peer,
            "versions": {"python": platform.python_version(), "numpy": np.__version__, "scipy": scipy.__version__},
            "threads": os.cpu_count() if peer == "scipy-dctn" else 1,
            "curves": len(grid),
            "points": fine.size,
            "us_per_curve": statistics.median(times),
            "timed_curves": len(grid),
            "runs": arguments.runs,
            "spread": [min(times), max(times)],
            "load": os.getloadavg()[0],
            "worst_difference": worst,
        }
        print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
