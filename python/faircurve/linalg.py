"""Batched tridiagonal systems, open and cyclic, solved by cyclic reduction."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _core
from ._arrays import Floats, floats

__all__ = ["solve_tridiagonal"]


def solve_tridiagonal(lower: Any, diagonal: Any, upper: Any, rhs: Any, *, cyclic: bool = False, device: str = "auto", precision: str = "auto") -> Floats:
    """Solves B tridiagonal systems of n rows at once.

    Row k is ``lower[k] x[k-1] + diagonal[k] x[k] + upper[k] x[k+1] = rhs[k]``. ``lower[0]`` and ``upper[n-1]`` count in
    cyclic systems only, where they stand in the corners.

    Parameters
    ----------
    lower, diagonal, upper : (B, n) arrays, or (n,) arrays for one system
    rhs : (B, n) or (B, n, k) array; (n,) or (n, k) for one system

    Returns
    -------
    x, shaped as rhs. Systems that are singular are NaN.

    Examples
    --------
    >>> from faircurve import linalg
    >>> linalg.solve_tridiagonal([0, -1, -1], [2, 2, 2], [-1, -1, 0], [1, 1, 1]).round(12).tolist()
    [1.5, 2.0, 1.5]
    """
    bands = [floats(band, "bands") for band in (lower, diagonal, upper)]
    right = floats(rhs, "rhs")
    shape = bands[1].shape
    if any(band.shape != shape for band in bands) or len(shape) not in (1, 2) or right.shape[: len(shape)] != shape:
        shapes = ", ".join(str(array.shape) for array in (*bands, right))
        raise ValueError(f"lower, diagonal and upper have one shape, and rhs begins with it: not {shapes}")
    count, rows = shape if len(shape) == 2 else (1, *shape)
    columns = right.shape[len(shape)] if right.ndim > len(shape) else 1
    offsets = np.arange(count + 1, dtype=np.int64) * rows
    x, statuses = _core.solve_tridiagonal(
        bands[0].reshape(-1), bands[1].reshape(-1), bands[2].reshape(-1), right.reshape(-1), columns, offsets, cyclic, device, precision
    )
    x = x.reshape(count, rows * columns)
    x[[status != "converged" for status in statuses]] = np.nan
    return x.reshape(right.shape)
