"""Solves the batches of tridiagonal systems that benches/gpu.rs solves, by what a CUDA card has: cuSPARSE, JAX and PyTorch.

Every system is that of a natural cubic spline with uneven knots, lambda_k x_(k-1) + 2 x_k + (1 - lambda_k) x_(k+1) = r_k
with lambda_k the fractional part of 0.618… k and r_k that of 0.755… k, rounded to f32. `error` is the largest error of all unknowns
over the largest unknown, against a solution in f64 of the same numbers.

* cuSPARSE: gtsv2StridedBatch by ctypes, with arrays on the card, timed by the card's own events. It overwrites its right-hand
  sides, so that every run begins with a copy that is not timed.
* JAX: jit(vmap(lax.linalg.tridiagonal_solve)), whole calls, arrays on the card.
* PyTorch: torch.linalg.solve of dense matrices, for systems of up to 64 unknowns, whole calls, arrays on the card.

A Markdown table. A peer whose libraries are not found, or that fails, is named with the reason, and the others run.

usage: tridiagonal.py [--rows 1048576] [--runs 7] [--jax-on-cpu]
"""

import argparse
import ctypes
import importlib.util
import statistics
import sysconfig
import time
from pathlib import Path

import numpy as np

LENGTHS = (16, 64, 256, 1024)
LONGEST_DENSE = 64  # a dense matrix a system; of 2^20 rows these are 256 MB in f32


def systems(rows, n):
    """Bands and right-hand sides of rows / n systems, (systems, n) in f32."""
    count = rows // n
    k = np.arange(count * n)
    lower = (0.618_033_988_749_894_9 * k % 1.0).astype(np.float32).reshape(count, n)
    rhs = (0.754_877_666_246_692_8 * k % 1.0).astype(np.float32).reshape(count, n)
    upper = np.float32(1.0) - lower
    lower[:, 0] = 0.0
    upper[:, -1] = 0.0
    return lower, np.full_like(lower, 2.0), upper, rhs


def solve(lower, diagonal, upper, rhs):
    """By elimination without pivoting, which these matrices do not need, all systems at once."""
    lower, diagonal, upper, x = (band.astype(float).T.copy() for band in (lower, diagonal, upper, rhs))
    for i in range(1, len(x)):
        factor = lower[i] / diagonal[i - 1]
        diagonal[i] -= factor * upper[i - 1]
        x[i] -= factor * x[i - 1]
    x[-1] /= diagonal[-1]
    for i in range(len(x) - 2, -1, -1):
        x[i] = (x[i] - upper[i] * x[i + 1]) / diagonal[i]
    return x.T


# --- cuSPARSE, by ctypes ------------------------------------------------------------------------------------------


def load(name):
    """A library of CUDA: from Python packages (nvidia-…, which JAX and PyTorch bring), a toolkit, or where the system looks."""
    places = [Path(sysconfig.get_path("purelib")).glob(f"nvidia/*/lib/lib{name}.so*")]
    places += [Path("/usr/local").glob(f"cuda*/lib64/lib{name}.so*"), Path("/usr/lib").glob(f"*/lib{name}.so*")]
    candidates = [str(path) for place in places for path in sorted(place)]
    for path in [*candidates, f"lib{name}.so"]:
        try:
            return ctypes.CDLL(path, mode=ctypes.RTLD_GLOBAL)
        except OSError:
            continue
    raise OSError(f"lib{name}.so is not here")


class Cuda:
    """What is needed of the runtime: arrays on the card and their times."""

    def __init__(self):
        self.library = load("cudart")

    def call(self, name, *arguments):
        status = getattr(self.library, name)(*arguments)
        if status != 0:
            raise RuntimeError(f"{name} says {status}")

    def array(self, size):
        pointer = ctypes.c_void_p()
        self.call("cudaMalloc", ctypes.byref(pointer), ctypes.c_size_t(max(size, 1)))
        return pointer

    def copy(self, to, source, size, kind):
        self.call("cudaMemcpy", to, source, ctypes.c_size_t(size), ctypes.c_int(kind))

    def upload(self, numbers):
        pointer = self.array(numbers.nbytes)
        self.copy(pointer, numbers.ctypes.data_as(ctypes.c_void_p), numbers.nbytes, 1)
        return pointer

    def seconds(self, run):
        """Of one run, by two events on the default stream."""
        events = [ctypes.c_void_p(), ctypes.c_void_p()]
        for event in events:
            self.call("cudaEventCreate", ctypes.byref(event))
        self.call("cudaEventRecord", events[0], None)
        run()
        self.call("cudaEventRecord", events[1], None)
        self.call("cudaEventSynchronize", events[1])
        milliseconds = ctypes.c_float()
        self.call("cudaEventElapsedTime", ctypes.byref(milliseconds), *events)
        for event in events:
            self.call("cudaEventDestroy", event)
        return 1e-3 * milliseconds.value


def cusparse():
    """gtsv2StridedBatch: (solver of systems of a type) -> x and times."""
    cuda = Cuda()
    try:
        load("nvJitLink")  # which cuSPARSE 12 needs and packages keep in another folder
    except OSError:
        pass
    library = load("cusparse")

    def call(name, *arguments):
        status = getattr(library, name)(*arguments)
        if status != 0:
            raise RuntimeError(f"{name} says {status}")

    handle = ctypes.c_void_p()
    call("cusparseCreate", ctypes.byref(handle))

    def run(bands, dtype, runs):
        *matrix, rhs = (np.ascontiguousarray(band, dtype) for band in bands)
        count, n = rhs.shape
        letter = "S" if dtype == np.float32 else "D"
        matrix = [cuda.upload(band) for band in matrix]
        kept, x = cuda.upload(rhs), cuda.array(rhs.nbytes)
        shape = (ctypes.c_int(count), ctypes.c_int(n))
        size = ctypes.c_size_t()
        name = f"cusparse{letter}gtsv2StridedBatch"
        call(f"{name}_bufferSizeExt", handle, ctypes.c_int(n), *matrix, x, *shape, ctypes.byref(size))
        buffer = cuda.array(size.value)
        times = []
        for _ in range(runs + 1):
            cuda.copy(x, kept, rhs.nbytes, 3)
            times.append(cuda.seconds(lambda: call(name, handle, ctypes.c_int(n), *matrix, x, *shape, buffer)))
        found = np.empty_like(rhs)
        cuda.copy(found.ctypes.data_as(ctypes.c_void_p), x, rhs.nbytes, 2)
        for pointer in [*matrix, kept, x, buffer]:
            cuda.call("cudaFree", pointer)
        return found, times[1:]

    return run


# --- JAX and PyTorch -----------------------------------------------------------------------------------------------


def whole_calls(run, runs):
    """The result, and seconds of each call after one that compiles."""
    times = []
    for _ in range(runs + 1):
        start = time.perf_counter()
        result = run()
        times.append(time.perf_counter() - start)
    return result, times[1:]


def jax_solver():
    if importlib.util.find_spec("jax") is None:
        raise OSError("the package jax is not here")
    import jax

    jax.config.update("jax_enable_x64", True)
    if jax.default_backend() == "cpu" and not ARGUMENTS.jax_on_cpu:
        raise OSError("this JAX has no card")

    @jax.jit
    @jax.vmap
    def one(lower, diagonal, upper, rhs):
        return jax.lax.linalg.tridiagonal_solve(lower, diagonal, upper, rhs[:, None])[:, 0]

    def run(bands, dtype, runs):
        arrays = [jax.device_put(band.astype(dtype)) for band in bands]
        x, times = whole_calls(lambda: jax.block_until_ready(one(*arrays)), runs)
        return np.asarray(x), times

    return run


def torch_solver():
    if importlib.util.find_spec("torch") is None:
        raise OSError("the package torch is not here")
    import torch

    if not torch.cuda.is_available():
        raise OSError("this PyTorch has no card")

    def run(bands, dtype, runs):
        if bands[0].shape[1] > LONGEST_DENSE:
            return None
        lower, diagonal, upper, rhs = (torch.from_numpy(band.astype(dtype)).cuda() for band in bands)
        dense = torch.diag_embed(diagonal) + torch.diag_embed(lower[:, 1:], -1) + torch.diag_embed(upper[:, :-1], 1)

        def run_once():
            x = torch.linalg.solve(dense, rhs[..., None])[..., 0]
            torch.cuda.synchronize()
            return x

        x, times = whole_calls(run_once, runs)
        return x.cpu().numpy(), times

    return run


def main():
    found, missing = {}, []
    for name, open_peer in {"cuSPARSE": cusparse, "JAX": jax_solver, "PyTorch, dense": torch_solver}.items():
        try:
            found[name] = open_peer()
        except (OSError, RuntimeError, ImportError) as error:
            missing.append(f"{name}: not measured, {error}.")
    print("| peer | type | n | systems | M rows/s | error |")
    print("|---|---|---|---|---|---|")
    for n in LENGTHS:
        bands = systems(ARGUMENTS.rows, n)
        true = solve(*bands)
        for name, run in list(found.items()):
            for dtype in (np.float32, np.float64):
                try:
                    result = run(bands, dtype, ARGUMENTS.runs)
                except Exception as error:  # a peer that fails must not end the others
                    missing.append(f"{name}: failed at n = {n}, {error}.")
                    del found[name]
                    break
                if result is None:
                    continue
                x, times = result
                worst = np.abs(x - true).max() / np.abs(true).max()
                rate = 1e-6 * bands[0].size / statistics.median(times)
                print(f"| {name} | {np.dtype(dtype).name} | {n} | {len(x)} | {rate:.1f} | {worst:.1e} |", flush=True)
    print("\n".join(["", *missing]))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rows", type=int, default=1 << 20)
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--jax-on-cpu", action="store_true", help="time JAX where it has no card, too")
    ARGUMENTS = parser.parse_args()
    main()
