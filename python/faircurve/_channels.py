"""Values of one number or of more than three, by methods that are linear: two at a time, each beside its parameter."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from . import _times
from ._arrays import Floats, Offsets, Ragged, _array_back, _list_back, _lists_of_numbers_back, _numbers_back, floats, offsets_of, per_point, split, vectors_per_point
from ._fit import Fit


def values_of(curves: Any, t: Any) -> tuple[Ragged[Any], bool] | None:
    """Values of other than two or three numbers, and whether they are plain numbers; None for points.

    They need ``t``: arrays of points with their axes in another order would pass for values.
    """
    if isinstance(curves, Ragged) and curves.coords.shape[1] not in (2, 3) and (t is not None or curves.t is not None):
        return curves, curves.back in (_numbers_back, _lists_of_numbers_back)
    if t is None:
        return None
    if isinstance(curves, np.ndarray) and curves.dtype != object and curves.ndim in (2, 3):
        plain = curves.ndim == 2
        if not plain and curves.shape[2] in (2, 3):
            return None
        count, points = curves.shape[:2]
        flat = floats(curves, "values").reshape(count * points, -1)
        return Ragged(flat, np.arange(count + 1, dtype=np.int64) * points, _numbers_back if plain else _array_back), plain
    if isinstance(curves, (list, tuple)) and curves and all(isinstance(one, np.ndarray) for one in curves) and len({one.ndim for one in curves}) == 1:
        plain = curves[0].ndim == 1
        if not plain and (curves[0].ndim != 2 or curves[0].shape[1] in (2, 3)) or len({one.shape[1:] for one in curves}) > 1:
            return None
        lists = [floats(one, f"the values of curve {i}") for i, one in enumerate(curves)]
        flat = np.concatenate(lists).reshape(sum(map(len, lists)), -1)
        return Ragged(flat, offsets_of([len(one) for one in lists]), _lists_of_numbers_back if plain else _list_back), plain
    return None


def fitted(method: Any, values: Ragged[Any], plain: bool, options: dict[str, Any]) -> Fit[Any]:
    """The fit of values, from fits of points (t, value, value)."""
    kind = type(method).__name__
    unfit = [name for name in ("preserve_shape", "surface", "deviation", "tube", "within") if getattr(method, name, None) not in (None, False)]
    if isinstance(getattr(method, "lam", None), str):
        unfit.append("lam='gcv'")
    width = values.coords.shape[1]
    if unfit:
        raise ValueError(f"{kind} with {unfit[0]} is of points of 2 or 3 coordinates, and values have {width}: fit Natural() or Smoothing(lam=0.1), which are linear")
    if options.get("closed") is not None and np.any(np.asarray(options["closed"]) != False):  # noqa: E712
        raise ValueError(f"closed is of points of 2 or 3 coordinates, and values have {width}: CubicSplineBatch(t, values, 'periodic') takes them")
    if method.parametrisation not in ("auto", "given"):
        raise ValueError(f"parametrisation is {method.parametrisation!r}, and values of {width} numbers have the parameters t: leave it out")
    given: Any = values.t
    t, clock = (given, values.clock) if options.get("t") is None else _times.times(options["t"], values)
    tangents = None if options.get("tangents") is None else vectors_per_point(options["tangents"], values, "tangents")
    others = {name: value for name, value in options.items() if name not in ("t", "tangents", "closed", "topology") and value is not None}
    if "weights" in others:
        others["weights"] = split(per_point(others["weights"], values, "weights"), values.offsets)
    fits = []
    for k in range(0, width, 2):
        columns = values.coords[:, k : k + 2]
        points = replace(values, coords=np.column_stack([t, columns]), back=_list_back, t=t, clock=None)
        if tangents is not None:
            slopes = np.column_stack([np.where(np.isnan(tangents[:, k]), np.nan, 1.0), tangents[:, k : k + 2]])
            others["tangents"] = split(slopes, values.offsets)
        fits.append(replace(method, parametrisation="given").fit(points, **others)._fit)
    recipe = (method, {name: value for name, value in options.items() if value is not None})
    return Fit(_Joined(fits, values, t), values, width, clock, recipe, plain=plain)


class _Joined:
    """Fits of some numbers of each value as one, with what ``_core.Fit`` answers."""

    def __init__(self, fits: list[Any], values: Ragged[Any], t: Floats) -> None:
        self._fits, self._values, self._t = fits, values, t
        self.dimension = values.coords.shape[1]

    def __len__(self) -> int:
        return len(self._fits[0])

    def __getattr__(self, name: str) -> Any:
        if name in ("curvature", "lengths", "max_curvatures", "svg"):
            raise TypeError(f"lengths, curvatures and pictures are of points of 2 or 3 coordinates, and values have {self.dimension}")
        if name in ("batch", "device", "knots", "sample_parameters"):
            return getattr(self._fits[0], name)
        raise AttributeError(name)

    def _together(self, parts: list[Floats]) -> Floats:
        return np.ascontiguousarray(np.concatenate([part.reshape(-1, fit.dimension)[:, 1:] for part, fit in zip(parts, self._fits)], axis=1)).reshape(-1)

    def evaluate(self, u: Floats, offsets: Offsets | None, nu: int) -> Floats:
        return self._together([fit.evaluate(u, offsets, nu) for fit in self._fits])

    def beziers(self, tolerances: Floats) -> tuple[Floats, Offsets]:
        parts = [fit.beziers(tolerances) for fit in self._fits]
        return self._together([part for part, _ in parts]), parts[0][1]

    def sample(self, how: str, value: float, out: Floats | None = None) -> tuple[Floats, Offsets]:
        if how not in ("count", "per_span"):
            raise TypeError(f"lengths are of points of 2 or 3 coordinates, and values have {self.dimension}: take samples by count or per_span")
        parts = [fit.sample(how, value) for fit in self._fits]
        made = self._together([part for part, _ in parts])
        if out is not None:
            if out.size != made.size:
                raise ValueError(f"out has {out.size} numbers; the samples have {made.size}")
            out[:] = made
        return made if out is None else out, parts[0][1]

    def report(self) -> dict[str, Any]:
        """The report of the first that did not converge, energies of all, and the largest deviation from the values."""
        reports = [fit.report() for fit in self._fits]
        columns = dict(reports[0])
        for name in ("status", "message"):
            worst = [next((r for r in reports if r["status"][i] != "converged"), reports[0]) for i in range(len(self))]
            columns[name] = [report[name][i] for i, report in enumerate(worst)]
        columns["energy"] = np.sum([report["energy"] for report in reports], axis=0)
        off = np.linalg.norm(self.evaluate(self._t, self._values.offsets, 0).reshape(self._values.coords.shape) - self._values.coords, axis=1)
        columns["max_deviation"] = np.array([one.max(initial=0.0) for one in split(off, self._values.offsets)])
        return columns

    def select(self, numbers: list[int]) -> Any:
        values, ends = self._values, [(int(self._values.offsets[k]), int(self._values.offsets[k + 1])) for k in numbers]
        rows = np.concatenate([np.arange(a, b) for a, b in ends] or [np.zeros(0, np.int64)])
        some = replace(values, coords=values.coords[rows], offsets=offsets_of([b - a for a, b in ends]))
        return _Joined([fit.select(numbers) for fit in self._fits], some, self._t[rows])

