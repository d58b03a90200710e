"""Laplacian-spline surfaces (Weimer & Warren): grids refined to the least Dirichlet energy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from . import _core
from ._arrays import floats

__all__ = ["subdivide"]


def subdivide(grids: Any, rounds: int = 3, *, support: int | None = None, linear: bool = False, device: str = "auto", precision: str = "auto") -> Any:
    """Grids of control points with a point between any two, ``rounds`` times.

    Parameters
    ----------
    grids
        An array (B, rows, columns) or (B, rows, columns, d), or a list of arrays (rows, columns) or (rows, columns, d).
    rounds : int
        m rows become 2^rounds (m − 1) + 1.
    support : {3, 5, 7, 9, 11}, optional
        Sparse masks of so many points across, the nearest to the exact rule: a new point depends on its neighbours alone. By
        default the exact rule, where every point depends on all others.
    linear : bool
        Sparse masks that keep planes, at borders too; otherwise constants alone.

    Returns
    -------
    What came in, refined. A grid that cannot be refined is all NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from faircurve import laplacian
    >>> laplacian.subdivide(np.ones((2, 3, 4)), rounds=2).shape
    (2, 9, 13)
    """
    if linear and support is None:
        raise ValueError("linear belongs to sparse rules: give a support, such as 5, or leave it out")
    one = isinstance(grids, np.ndarray) and grids.dtype != object
    arrays: Sequence[Any] = [floats(grid, f"grid {i}") for i, grid in enumerate(grids)]
    if not arrays:
        return grids
    flat = arrays[0].ndim == 2
    for i, array in enumerate(arrays):
        if array.ndim != (2 if flat else 3) or (not flat and array.shape[2] != arrays[0].shape[2]):
            raise ValueError(f"grid {i} has the shape {array.shape}; grids are (rows, columns) or (rows, columns, d), all alike")
    dimension = 1 if flat else arrays[0].shape[2]
    values = np.concatenate([array.reshape(-1) for array in arrays])
    shapes = [array.shape[:2] for array in arrays]
    made, new, statuses = _core.subdivide(dimension, shapes, values, rounds, support, linear, device, precision)
    refined, at = [], 0
    for (rows, columns), status in zip(new, statuses):
        size = rows * columns * dimension
        grid = made[at : at + size].reshape((rows, columns) if flat else (rows, columns, dimension))
        refined.append(grid if status == "converged" else np.full_like(grid, np.nan))
        at += size
    return np.stack(refined) if one else refined
