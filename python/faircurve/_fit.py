"""Fitted curves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._arrays import Floats, Offsets, Ragged, floats, offsets_of, split


class Fit:
    """Fitted curves, as many as were given, in their order.

    A curve that cannot be fitted has a status and a message, and its values are those of its input as a polyline.
    Parameters are the ``t`` that was given, else sums of chord lengths (arc lengths for :class:`Smooth`).
    """

    def __init__(self, fit: _core.Fit, curves: Ragged, dimension: int) -> None:
        self._fit = fit
        self._curves = curves
        self._dimension = dimension

    # --- what came of it ---

    def report(self) -> dict[str, Any]:
        """One entry a curve in every column: status, message, energy, iterations, gradient_norm, max_deviation, smoothing, gain,
        loops, and, of fair curves with limits, violation, active, cost, stretch, neighbours and touching.

        ``pandas.DataFrame(fit.report())`` is a table. ``max_deviation`` is the largest distance of the curve from its
        points, ``smoothing`` the λ of smoothing splines (NaN for others), ``gain`` the part of the energy that further ``starts`` of
        fair curves saved (NaN for one start), ``loops`` how many times as long as their points' polygon fair curves with
        loops are (NaN for others), ``energy`` in units of the input.
        """
        columns = dict(self._fit.report())
        columns["status"] = np.array(columns["status"], dtype=object)
        columns["message"] = np.array(columns["message"], dtype=object)
        return columns

    @property
    def status(self) -> NDArray[Any]:
        """``"converged"``, or why not: one word a curve."""
        return np.asarray(self.report()["status"])

    @property
    def messages(self) -> list[str | None]:
        """A sentence for every curve with something to say."""
        return list(self.report()["message"])

    @property
    def energy(self) -> Floats:
        """The energy of every curve, in units of the input."""
        return np.asarray(self.report()["energy"])

    @property
    def device(self) -> str:
        """What did the work."""
        return self._fit.device

    # --- values ---

    def __call__(self, u: Any, nu: int = 0) -> Any:
        """Points of the curves at parameters, or derivatives.

        Parameters
        ----------
        u : float, (m,) array, or a list of B arrays
            Parameters, the same for all curves or each curve's own. Beyond a curve's ends its ends are taken.
        nu : int
            Order of the derivative by the parameter.

        Returns
        -------
        (B, m, d) array, (B, d) for one parameter, or a list of arrays (m_i, d)

        Examples
        --------
        >>> import faircurve as fc
        >>> fit = fc.Natural().fit([[(0, 0), (1, 1), (2, 0)]], t=[[0, 1, 2]])
        >>> fit([0, 0.5, 1])[0].tolist()
        [[0.0, 0.0], [0.5, 0.6875], [1.0, 1.0]]
        >>> fit(1, nu=1)[0].tolist()
        [1.0, 0.0]
        """
        if nu < 0:
            raise ValueError(f"nu is {nu}; orders of derivatives are 0 or more")
        flat, offsets, shape = self._parameters(u)
        return self._shaped(self._fit.evaluate(flat, offsets, nu), shape, (self._dimension,))

    def curvature(self, u: Any) -> Any:
        """Curvatures (1/length) at parameters; in the plane positive to the left. Shapes are those of a call, without d."""
        flat, offsets, shape = self._parameters(u)
        return self._shaped(self._fit.curvature(flat, offsets), shape, ())

    def _parameters(self, u: Any) -> tuple[Floats, Offsets | None, Any]:
        ragged = isinstance(u, (list, tuple)) and len(u) > 0 and np.ndim(u[0]) > 0
        if ragged or isinstance(u, np.ndarray) and (u.ndim == 2 or u.dtype == object):
            if len(u) != len(self):
                raise ValueError(f"{len(u)} lists of parameters for {len(self)} curves: give one list a curve, or one for all")
            lists = [floats(one, "parameters").reshape(-1) for one in u]
            offsets = offsets_of([len(one) for one in lists])
            flat = np.concatenate(lists) if lists else np.zeros(0)
            return flat, offsets, (offsets if not isinstance(u, np.ndarray) else (len(self), -1))
        shared = floats(u, "parameters")
        return shared.reshape(-1), None, (len(self), *shared.shape) if np.ndim(u) > 0 else (len(self),)

    def _shaped(self, values: Floats, shape: Any, inner: tuple[int, ...]) -> Any:
        if isinstance(shape, np.ndarray):
            return split(values.reshape(-1, *inner), shape)
        if -1 in shape:
            shape = (shape[0], values.size // max(1, shape[0] * int(np.prod(inner))))
        return values.reshape(*shape, *inner)

    def sample(self, count: int | None = None, *, per_span: int | None = None, points: int | None = None, spacing: float | None = None, tolerance: float | None = None, out: Floats | None = None) -> Any:
        """Points along the curves, as the kind of thing that was fitted.

        Parameters
        ----------
        count : int
            So many samples of each curve, evenly in the parameter.
        per_span : int
            So many segments between data points. The default, with 16.
        points : int
            So many samples of each curve at equal arc lengths.
        spacing : float
            Samples at equal arc lengths, at most this far apart.
        tolerance : float
            As few samples as keep within this distance of the curve, and the curve within it of them.
        out : array
            Memory for the samples, C-contiguous float64 of any shape with as many numbers. Memory that is kept saves most
            of the time that new memory takes.

        Returns
        -------
        What came in, arrays over the memory of `out` if it is given: an array (B, m, d), a list of arrays, a GeoSeries, a pyarrow array, …
        A closed curve has every sample once; rings of shapely repeat the first at their end.
        """
        given = [("count", count), ("per_span", per_span), ("points", points), ("spacing", spacing), ("tolerance", tolerance)]
        asked = [(how, value) for how, value in given if value is not None]
        if len(asked) > 1:
            raise TypeError(f"samples are taken one way: {' or '.join(how for how, _ in asked)}")
        how, value = asked[0] if asked else ("per_span", 16)
        if not value > 0:
            raise ValueError(f"{how} is {value}; it must be positive")
        flat = None if out is None else _writable(out)
        coords, offsets = self._fit.sample(how, float(value), flat)
        return self._curves.back(coords.reshape(-1, self._dimension), offsets, self._closed())

    @property
    def length(self) -> Floats:
        """Arc lengths, to a relative error of 1e-9."""
        return self._fit.lengths()

    @property
    def max_curvature(self) -> Floats:
        """Largest curvatures (1/length), infinite at cusps."""
        return self._fit.max_curvatures()

    @property
    def knots(self) -> list[Floats]:
        """The parameters of each curve's knots; a closed curve has the one more at which it meets its first point again."""
        t, offsets = self._fit.knots()
        return split(t, offsets)

    def to_bezier(self, tolerance: float | None = None) -> list[Floats]:
        """The curves as cubic Béziers: an array (k, 4, d) each, exact for splines.

        Parameters
        ----------
        tolerance : float, optional
            Largest distance between both curves, units of the input. By default 1e-6 of each curve's size.
        """
        if tolerance is None:
            sizes = [np.ptp(one, axis=0).max() if len(one) else 0.0 for one in split(self._curves.coords, self._curves.offsets)]
            tolerances = 1e-6 * np.nan_to_num(np.maximum(np.array(sizes, float), 1e-300), nan=1.0)
        else:
            if not tolerance > 0:
                raise ValueError(f"tolerance is {tolerance}; it must be positive")
            tolerances = np.full(len(self), float(tolerance))
        coords, offsets = self._fit.beziers(tolerances)
        chains = split(coords.reshape(-1, self._dimension), offsets)
        return [_pieces(chain, ring) for chain, ring in zip(chains, self._closed().tolist())]

    # --- some of them, and pictures ---

    def __len__(self) -> int:
        return len(self._fit)

    def __getitem__(self, which: int | slice | Sequence[int] | NDArray[Any]) -> Fit:
        """The fit of some of the curves: a number, a slice, numbers or flags."""
        if isinstance(which, (int, np.integer)):
            number = int(which) + (len(self) if which < 0 else 0)
            if not 0 <= number < len(self):
                raise IndexError(f"there is no curve {which} of {len(self)}")
            numbers = [number]
        else:
            numbers = np.arange(len(self))[which if isinstance(which, slice) else np.asarray(which)].tolist()
        lines = split(self._curves.coords, self._curves.offsets)
        closed = self._curves.closed
        chosen = Ragged(
            np.concatenate([lines[k] for k in numbers]) if numbers else self._curves.coords[:0],
            offsets_of([len(lines[k]) for k in numbers]),
            lambda coords, offsets, closed: split(coords, offsets),
            None if closed is None else closed[numbers],
        )
        return Fit(self._fit.select(numbers), chosen, self._dimension)

    def __iter__(self) -> Iterator[Fit]:
        return (self[k] for k in range(len(self)))

    def _closed(self) -> NDArray[np.bool_]:
        return self._fit.batch.closed

    def to_svg(self, width: float = 800.0, points: bool = True) -> str:
        """The curves and their points as a picture."""
        return self._fit.svg(width, points)

    def _repr_svg_(self) -> str:
        return self.to_svg()

    def __repr__(self) -> str:
        words, counts = np.unique(self.status, return_counts=True)
        statuses = ", ".join(f"{count} {word}" for word, count in zip(words, counts))
        return f"<faircurve.Fit: {len(self)} curves ({statuses}), {self.device}>"

    def plot(self, ax: Any = None, *, points: bool = True, **options: Any) -> Any:
        """Draws the curves with matplotlib; returns the axes.

        ``options`` go to the line collection (``color``, ``linewidth``, …).
        """
        import matplotlib.pyplot as plt
        from matplotlib.collections import LineCollection

        if ax is None:
            ax = plt.gca()
        coords, offsets = self._fit.sample("per_span", 16.0)
        lines = split(coords.reshape(-1, self._dimension)[:, :2], offsets)
        rings = self._closed().tolist()
        ax.add_collection(LineCollection([np.concatenate([l, l[:1]]) if r else l for l, r in zip(lines, rings)], **options))
        if points:
            ax.plot(self._curves.coords[:, 0], self._curves.coords[:, 1], ".", color="0.4", markersize=3)
        ax.autoscale_view()
        ax.set_aspect("equal")
        return ax


def _pieces(chain: Floats, ring: bool) -> Floats:
    """A chain of control points as pieces (k, 4, d)."""
    if ring and len(chain) % 3 == 0:
        chain = np.concatenate([chain, chain[:1]])
    count = max(0, (len(chain) - 1) // 3)
    index = 3 * np.arange(count)[:, None] + np.arange(4)
    return np.asarray(chain[index])


def _writable(out: Floats) -> Floats:
    """The numbers of an array that the caller keeps, flat and not copied."""
    if not isinstance(out, np.ndarray) or out.dtype != np.float64 or not out.flags.c_contiguous or not out.flags.writeable:
        raise ValueError("out must be a writable, C-contiguous array of float64")
    return out.reshape(-1)
