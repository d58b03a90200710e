"""Fitted curves."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Iterator, Sequence
from os import PathLike
from typing import Any, Generic, Literal, TypeAlias, get_args, overload

import numpy as np
from numpy.typing import NDArray

from . import _core
from . import _times
from ._arrays import ArrayT, Floats, Offsets, Pair, Ragged, _array_back, _list_back, _lists_of_numbers_back, _numbers_back, _pair_back, chosen, offsets_of, split
from ._running import give_back
from ._times import Clock


#: The most curves of the picture in a notebook.
PICTURED = 500

Status: TypeAlias = Literal["converged", "not_converged", "unbounded", "no_minimiser", "not_unique", "infeasible", "degenerate", "invalid"]

By: TypeAlias = Literal["parameter", "length", "span"]
Outside: TypeAlias = Literal["ends", "nan", "periodic", "raise", "extrapolate"]

#: The words of ``Fit.status``.
STATUSES: tuple[Status, ...] = get_args(Status)

#: How samples are counted, by the word of ``by``.
_BY = {"parameter": "count", "length": "points", "span": "per_span"}


#: Coordinates of a fit that is large enough for freed memory to be given back.
_LARGE = 1 << 17


class Fit(Generic[ArrayT]):
    """Fitted curves, as many as were given, in their order.

    A curve that cannot be fitted has a status and a message, and its values are those of its input as a polyline.
    Parameters are the ``t`` that was given, dates among them. Else they begin with 0 and end with the length of the points'
    polygon (arc length for :class:`Smooth`); inner points have the ones of the method's ``parametrisation``, and "uniform" ones
    are 0, 1, 2 …

    What there is of each curve, such as ``status`` and ``length``, is an array, and for a GeoSeries or GeoDataFrame a Series with
    the index of the rows of curves: it aligns with the frame where every row has one curve, and pandas refuses it where rows have
    several. ``rows`` has the row of each curve, and ``to_frame`` one row a feature.

    A fit that was pickled is made again, from its points and its method.
    """

    def __init__(self, fit: Any, curves: Ragged[ArrayT], dimension: int, clock: Clock | None = None, recipe: Any = None, *, plain: bool = False) -> None:
        self._fit: _core.Fit = fit
        #: The shape of a value: nothing where values are plain numbers.
        self._inner: tuple[int, ...] = () if plain else (dimension,)
        self._curves = curves
        self._dimension = dimension
        self._clock = clock
        #: The method, and what it was asked with.
        self._recipe = recipe
        if curves.coords.size > _LARGE:
            give_back()

    def __reduce__(self) -> tuple[Any, ...]:
        if isinstance(self._recipe, _Selection):
            return _selected_again, (self._recipe.whole, self._recipe.numbers)
        method, options = self._recipe
        if "CPU" in self.device:
            options = {**options, "device": "cpu"}
        return _fitted_again, (method, self._curves, options, self.device)

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the fit to a file that :func:`faircurve.load` reads: NPZ, with the points, what was given of them, and the method.

        Labels of pandas are written by pyarrow.

        Parameters
        ----------
        path : str or path
            The file. One that exists is replaced.

        Raises
        ------
        TypeError
            For something that is neither numbers nor words nor a table, such as a surface of a program's own.

        Examples
        --------
        >>> import os, tempfile, faircurve as fc
        >>> fit = fc.Smoothing(lam=0.1).fit([[(0, 0), (1, 1), (2, 0)]], t=[[0, 1, 3]])
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     fit.save(os.path.join(folder, "curves.npz"))
        ...     fc.load(os.path.join(folder, "curves.npz")).knots[0].tolist()
        [0.0, 1.0, 3.0]
        """
        from . import _saved

        _saved.save(self, path)

    def __copy__(self) -> Fit[ArrayT]:
        return self

    def __deepcopy__(self, memo: Any) -> Fit[ArrayT]:
        # Nothing of it changes.
        return self

    # --- what came of it ---

    @property
    def rows(self) -> NDArray[np.int64]:
        """The row of each curve in what was given: of a geometry with parts or rings all have its row."""
        rows = self._curves.rows
        return np.arange(len(self)) if rows is None else rows

    def _of_curves(self, values: Any) -> Any:
        """Values of curves: a Series with the labels of their rows where rows have labels."""
        index = self._curves.index
        if index is None:
            return values
        import pandas as pd

        if not index.is_unique and not np.array_equal(self.rows, np.arange(len(index))):
            raise ValueError("labels of rows repeat, and rows have several curves or none: give the frame another index, or use to_frame()")
        return pd.Series(values, index=index.take(self.rows), dtype=object if isinstance(values, list) else None)

    @functools.cached_property
    def _report(self) -> dict[str, Any]:
        columns = dict(self._fit.report())
        columns["message"] = [None if text is None else in_python(text) for text in columns["message"]]
        for name in ("status", "message"):
            words = np.empty(len(columns[name]), dtype=object)
            words[:] = columns[name]
            columns[name] = words
        return columns

    def report(self) -> dict[str, Any]:
        """The report as columns of one entry per curve: status, message, energy, iterations, gradient_norm, max_deviation, smoothing,
        gain, loops, and, of fair curves with limits, violation, active, cost, stretch, neighbours and touching.

        ``pandas.DataFrame(fit.report())`` is a table. ``max_deviation`` is the largest distance of the curve from its
        points, ``smoothing`` the λ of smoothing splines (NaN for others), ``gain`` the part of the energy that further ``starts`` of
        fair curves saved (NaN for one start), ``loops`` how many times as long as their points' polygon fair curves with
        loops are (NaN for others), ``energy`` in units of the input.
        """
        return {name: self._of_curves(values.copy()) for name, values in self._report.items()}

    def to_frame(self, per: Literal["row", "curve"] = "row") -> Any:
        """A data frame of the report, lengths and largest curvatures.

        Parameters
        ----------
        per : {"row", "curve"}
            A row for each row of what was given, with its labels: the status and the message of the first curve that did not
            converge, sums of energy, iterations and length, the largest of the rest. Rows without a curve are missing. Or a row for each
            curve, with the column ``row``.
        """
        import pandas as pd

        if per not in ("row", "curve"):
            raise ValueError(f"per is {per!r}; 'row' and 'curve' are possible")
        warn_of_degrees(self._curves, self._recipe, "to_frame")
        frame = pd.DataFrame({**self._report, "length": self._length, "max_curvature": self._max_curvature})
        index = self._curves.index
        if per == "curve":
            frame.insert(0, "row", self.rows)
            return frame if index is None else frame.set_index(index.take(self.rows))
        # Of a row's curves the one with the worst status comes first.
        frame["row"] = self.rows
        order = np.argsort((self._report["status"] != "converged") * -1, kind="stable")
        rows = frame.groupby("row")
        made = frame.iloc[order].groupby("row")[["status", "message"]].first()
        for name in frame.columns.drop(["row", "status", "message"]):
            made[name] = rows[name].sum(min_count=1) if name in ("energy", "iterations", "length") else rows[name].max()
        made["iterations"] = made["iterations"].astype("Int64")
        return made if index is None else made.reindex(np.arange(len(index))).set_index(index)

    @property
    def status(self) -> Any:
        """One word per curve: ``"converged"``, or why not: ``"not_converged"``, ``"unbounded"``, ``"no_minimiser"``, ``"not_unique"``,
        ``"infeasible"``, ``"degenerate"`` or ``"invalid"``.

        Returns
        -------
        (B,) array of str, or Series
            With the labels of their rows where curves have labels.

        Examples
        --------
        >>> import faircurve as fc
        >>> fc.Natural().fit([[(0, 0), (1, 1)], [(2, 2), (2, 2)]]).status.tolist()
        ['converged', 'degenerate']
        """
        return self._of_curves(self._report["status"].copy())

    @property
    def messages(self) -> Any:
        """A sentence for every curve with something to say, which names the point, the value and the remedy; None for others.

        Returns
        -------
        list, or Series
            With the labels of their rows where curves have labels.
        """
        return self._of_curves(list(self._report["message"]))

    @property
    def energy(self) -> Any:
        """The energy that a curve's method minimises, in units of the input: ∫|p″|² dt of splines, the weighted sum of :class:`Fair`.

        Returns
        -------
        (B,) array, or Series
            NaN for curves that were not fitted, infinite on overflow.
        """
        return self._of_curves(self._report["energy"].copy())

    @property
    def device(self) -> str:
        """What did the work."""
        return self._fit.device

    # --- values ---

    @overload
    def __call__(self, u: Sequence[Sequence[Any]] | Sequence[NDArray[Any]], nu: int = 0, outside: Outside | None = None) -> list[Floats]: ...  # pyright: ignore[reportOverlappingOverload]
    @overload
    def __call__(self, u: Any, nu: int = 0, outside: Outside | None = None) -> Floats: ...
    def __call__(self, u: Any, nu: int = 0, outside: Outside | None = None) -> Any:
        """Points of the curves at parameters, or derivatives.

        Parameters
        ----------
        u : float, (m,) array, or a list of B arrays
            Parameters, the same for all curves or each curve's own: numbers, or dates of any unit where ``t`` was dates.
        nu : int
            Order of the derivative by the parameter, for dates by seconds.
        outside : {"ends", "nan", "periodic", "raise", "extrapolate"}, optional
            What is beyond a curve's ends: its ends, NaN, an error, or the cubic of a spline's last span, as in SciPy. By default
            the ends; closed curves are periodic, and no other.

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
        if outside == "extrapolate":
            return self._extrapolated(*self._parameters(u), nu)
        flat, offsets, shape = self._within(*self._parameters(u), outside)
        return self._shaped(self._fit.evaluate(flat, offsets, nu), shape, self._inner)

    def _extrapolated(self, flat: Floats, offsets: Offsets | None, shape: Any, nu: int) -> Any:
        """Values where the cubics of the first and the last span go on: Taylor's series about the ends."""
        method = self._recipe[0]
        if type(method).__name__ not in ("Natural", "Smoothing") or method.surface is not None:
            raise TypeError(f"extrapolate is of splines, and curves of {type(method).__name__} end where their points end: take outside='nan'")
        flat, offsets, shape = self._within(flat, offsets, shape, None) if self._closed().any() else (flat, offsets, shape)
        counts = np.full(len(self), flat.size) if offsets is None else np.diff(offsets)
        own = np.tile(flat, len(self)) if offsets is None else flat
        first, last = (np.repeat(ends, counts) for ends in self._ends)
        inside = np.where(self._closed()[np.repeat(np.arange(len(self)), counts)], own, np.clip(own, first, last))
        beyond, places, factor = (own - inside)[:, None], offsets_of(counts), 1.0
        values = np.zeros((len(own), self._dimension))
        for k in range(nu, 4):
            terms = self._fit.evaluate(inside, places, k).reshape(values.shape) * factor
            values += np.where(beyond == 0, terms if k == nu else 0.0, terms * beyond ** (k - nu))
            factor /= k - nu + 1
        return self._shaped(values.reshape(-1), places if isinstance(shape, np.ndarray) else shape, self._inner)

    def derivative(self, nu: int = 1) -> Derivative:
        """The derivatives by the parameter, as a function of it.

        Parameters
        ----------
        nu : int
            The order, 1 by default.

        Returns
        -------
        Derivative
            Called as a fit is: ``fit.derivative()(u)`` is ``fit(u, nu=1)``.

        Raises
        ------
        ValueError
            An order below 0.

        Examples
        --------
        >>> import faircurve as fc
        >>> slope = fc.Natural().fit([[(0, 0), (1, 1), (2, 0)]], t=[[0, 1, 2]]).derivative()
        >>> slope(1)[0].tolist(), slope.derivative()(1)[0].tolist()
        ([1.0, 0.0], [0.0, -3.0])
        """
        if nu < 0:
            raise ValueError(f"nu is {nu}; orders of derivatives are 0 or more, and integrate has integrals")
        return Derivative(self, nu)

    def integrate(self, a: Any = None, b: Any = None) -> Floats:
        """∫ p dt from ``a`` to ``b`` for every curve: exact for splines, to about 1e-6 of a curve's size for others.

        Parameters
        ----------
        a, b : float, date, or (B,) array, optional
            Parameters, for all curves or for each. By default the ends of each curve.

        Returns
        -------
        (B, d) array
            Units of the input times those of the parameter, for dates seconds. NaN where a curve is invalid.

        Raises
        ------
        ValueError
            Parameters beyond a curve's ends, or for another number of curves.

        Examples
        --------
        >>> import faircurve as fc
        >>> fit = fc.Natural().fit([[(0, 0), (1, 1), (2, 0)]], t=[[0, 1, 2]])
        >>> fit.integrate()[0].tolist(), fit.integrate(0, 1)[0].tolist()
        ([2.0, 1.25], [0.5, 0.625])
        """
        t, offsets = self._fit.knots()
        ends = []
        for name, given, default in (("a", a, self._ends[0]), ("b", b, self._ends[1])):
            own = default if given is None else _times.parameters(given, self._clock, name)
            if own.size not in (1, len(self)):
                raise ValueError(f"{name} has {own.size} parameters for {len(self)} curves: give one, or one per curve")
            ends.append(np.broadcast_to(own.reshape(-1), len(self)))
            out = (ends[-1] < self._ends[0]) | (ends[-1] > self._ends[1])
            if out.any():
                k = int(np.argmax(out))
                asked, first, last = self._dated(np.array([ends[-1][k], self._ends[0][k], self._ends[1][k]]))
                raise ValueError(f"{name} is {asked}, outside curve {k}, which goes from {first} to {last}")
        low, high = np.minimum(*ends), np.maximum(*ends)
        method = self._recipe[0]
        is_cubic = type(method).__name__ in ("Natural", "Smoothing") and method.surface is None
        parts = 1 if is_cubic else getattr(method, "per_span", 16)
        nodes, weights = np.polynomial.legendre.leggauss(2 if is_cubic else 4)
        curve = np.repeat(np.arange(len(self)), np.diff(offsets))
        spans = np.flatnonzero(curve[:-1] == curve[1:])
        # Vertices of fair curves part their spans evenly.
        marks = t[spans, None] + np.diff(t)[spans, None] * np.linspace(0, 1, parts + 1)
        clipped = np.clip(marks, low[curve[spans], None], high[curve[spans], None])
        start, width = clipped[:, :-1, None], np.diff(clipped)[:, :, None]
        places = start + width * (nodes + 1) / 2
        counts = np.bincount(curve[spans], minlength=len(self)) * parts * len(nodes)
        values = self._fit.evaluate(places.reshape(-1), offsets_of(counts), 0).reshape(len(spans), parts, len(nodes), self._dimension)
        made = np.zeros((len(self), self._dimension))
        np.add.at(made, curve[spans], (values * weights[:, None] * width[..., None] / 2).sum(axis=(1, 2)))
        made[np.isin(self._report["status"], ("invalid",))] = np.nan
        return np.where((ends[0] <= ends[1])[:, None], made, -made).reshape(len(self), *self._inner)

    @overload
    def curvature(self, u: Sequence[Sequence[Any]] | Sequence[NDArray[Any]]) -> list[Floats]: ...  # pyright: ignore[reportOverlappingOverload]
    @overload
    def curvature(self, u: Any) -> Floats: ...
    def curvature(self, u: Any) -> Any:
        """Curvatures at parameters.

        Parameters
        ----------
        u : float, (m,) array, or a list of B arrays
            Parameters, as of a call.

        Returns
        -------
        (B, m) array, (B,) for one parameter, or a list of arrays (m_i,)
            1/length; in the plane positive to the left, in space at least 0.

        Examples
        --------
        >>> import numpy as np, faircurve as fc
        >>> angles = np.arange(24) * np.pi / 12
        >>> ring = fc.Natural().fit(2 * np.stack([np.cos(angles), np.sin(angles)], axis=1)[None], closed=True)
        >>> ring.curvature([0.0, 1.0]).round(2).tolist()
        [[0.5, 0.5]]
        """
        flat, offsets, shape = self._within(*self._parameters(u), None)
        return self._shaped(self._fit.curvature(flat, offsets), shape, ())

    @functools.cached_property
    def _ends(self) -> tuple[Floats, Floats]:
        """The first and the last parameter of every curve; NaN without points."""
        t, offsets = self._fit.knots()
        padded, some = np.append(t, np.nan), np.diff(offsets) > 0
        return (np.where(some, padded[np.minimum(offsets[:-1], len(t))], np.nan), np.where(some, padded[offsets[1:] - 1], np.nan))

    def _within(self, flat: Floats, offsets: Offsets | None, shape: Any, outside: str | None) -> tuple[Floats, Offsets | None, Any]:
        """Parameters of which those beyond the ends are as asked for."""
        if outside not in (None, "ends", "nan", "periodic", "raise"):
            raise ValueError(f"outside is {outside!r}; ends, nan, periodic, raise, extrapolate are possible")
        first, last = self._ends
        closed = self._closed()
        if outside == "ends" or len(self) == 0 or flat.size == 0 or outside is None and not closed.any():
            return flat, offsets, shape
        if outside == "periodic" and not closed.all():
            raise ValueError(f"curve {int(np.argmin(closed))} is open, and periodic is of closed curves")
        if not ((flat < np.nanmax(first)) | (flat > np.nanmin(last))).any():
            return flat, offsets, shape
        counts = np.full(len(self), flat.size) if offsets is None else np.diff(offsets)
        curve = np.repeat(np.arange(len(self)), counts)
        own = np.tile(flat, len(self)) if offsets is None else flat.copy()
        a, b = first[curve], last[curve]
        beyond = (own < a) | (own > b)
        if outside == "raise" and beyond.any():
            k = int(np.argmax(beyond))
            asked, start, end = self._dated(np.array([own[k], a[k], b[k]]))
            raise ValueError(f"the parameter {asked} is outside curve {curve[k]}, which goes from {start} to {end}")
        if outside == "nan":
            own[beyond] = np.nan
        else:
            turns = beyond & closed[curve]
            own[turns] = a[turns] + np.mod(own[turns] - a[turns], b[turns] - a[turns])
        ends = offsets_of(counts)
        return own, ends, shape

    def _parameters(self, u: Any) -> tuple[Floats, Offsets | None, Any]:
        ragged = isinstance(u, (list, tuple)) and len(u) > 0 and np.ndim(u[0]) > 0
        if ragged or isinstance(u, np.ndarray) and (u.ndim == 2 or u.dtype == object):
            if len(u) != len(self):
                raise ValueError(f"{len(u)} lists of parameters for {len(self)} curves: give one list a curve, or one for all")
            lists = [_times.parameters(one, self._clock).reshape(-1) for one in u]
            offsets = offsets_of([len(one) for one in lists])
            flat = np.concatenate(lists) if lists else np.zeros(0)
            return flat, offsets, (offsets if not isinstance(u, np.ndarray) else (len(self), -1))
        shared = _times.parameters(u, self._clock)
        return shared.reshape(-1), None, (len(self), *shared.shape) if np.ndim(u) > 0 else (len(self),)

    def _shaped(self, values: Floats, shape: Any, inner: tuple[int, ...]) -> Any:
        if isinstance(shape, np.ndarray):
            return split(values.reshape(-1, *inner), shape)
        if -1 in shape:
            shape = (shape[0], values.size // max(1, shape[0] * int(np.prod(inner))))
        return values.reshape(*shape, *inner)

    @overload
    def sample(self, count: int | None = None, *, by: By = "parameter", per_span: int | None = None, points: int | None = None, spacing: float | None = None, tolerance: float | None = None, out: Floats | None = None, return_t: Literal[False] = False) -> ArrayT: ...
    @overload
    def sample(self, count: int | None = None, *, by: By = "parameter", per_span: int | None = None, points: int | None = None, spacing: float | None = None, tolerance: float | None = None, out: Floats | None = None, return_t: Literal[True]) -> tuple[ArrayT, list[Any]]: ...
    def sample(self, count: int | None = None, *, by: By = "parameter", per_span: int | None = None, points: int | None = None, spacing: float | None = None, tolerance: float | None = None, out: Floats | None = None, return_t: bool = False) -> Any:
        """Points along the curves, as the kind of thing that was fitted.

        Parameters
        ----------
        count : int
            Number of samples of each curve, or of segments of each span where ``by`` is "span".
        by : {"parameter", "length", "span"}
            Whether ``count`` samples are taken evenly in the parameter or at equal arc lengths, or are ``count`` segments between
            two data points.
        per_span : int
            Number of segments between data points. The default, with 16. The same as ``by="span"``.
        points : int
            Number of samples of each curve at equal arc lengths. The same as ``by="length"``.
        spacing : float
            Samples at equal arc lengths, at most this far apart (units of the input).
        tolerance : float
            As few samples as keep within this distance of the curve, and the curve within it of them (units of the input).
        out : array
            Memory for the samples, C-contiguous float64 of any shape with as many numbers. Memory that is kept saves most
            of the time that new memory takes.
        return_t : bool
            Whether the parameters of the samples are returned, too: a list of arrays.

        Returns
        -------
        What came in, arrays over the memory of `out` if it is given: an array (B, m, d), a list of arrays, a GeoSeries, a pyarrow array, …
        A closed curve has every sample once; rings of shapely repeat the first at their end. An array has a row for each
        curve: rows with fewer samples than others end with NaN, and a curve that has no fit has as many samples of its polyline.

        Raises
        ------
        TypeError
            More than one way to take samples, or an amount that is no number.
        ValueError
            An amount that is not positive or not whole, or memory of another size.

        Examples
        --------
        >>> import numpy as np, faircurve as fc
        >>> fit = fc.Natural().fit(np.random.default_rng(0).normal(size=(100, 10, 2)))
        >>> fit.sample(80).shape, fit.sample(80, by="length").shape, fit.sample(8, by="span").shape
        ((100, 80, 2), (100, 80, 2), (100, 73, 2))
        """
        if by not in _BY:
            raise ValueError(f"by is {by!r}; {', '.join(_BY)} are possible")
        if by != "parameter" and count is None:
            raise TypeError(f"by={by!r} needs a number of samples, as in sample(64, by={by!r})")
        given = [(_BY[by], count), ("per_span", per_span), ("points", points), ("spacing", spacing), ("tolerance", tolerance)]
        asked = [(how, value) for how, value in given if value is not None]
        if len(asked) > 1:
            raise TypeError(f"samples are taken one way: {' or '.join(how for how, _ in asked)}")
        how, value = asked[0] if asked else ("per_span", 16)
        if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
            raise TypeError(f"{how} is {value!r}; it must be a number")
        if not value > 0:
            raise ValueError(f"{how} is {value}; it must be positive")
        if how in ("count", "per_span", "points") and value != int(value):
            raise ValueError(f"{how} is {value}; it must be a whole number")
        if how in ("spacing", "tolerance"):
            warn_of_degrees(self._curves, self._recipe, how)
        flat = None if out is None else _writable(out)
        is_array = self._curves.back in (_array_back, _numbers_back)
        try:
            coords, offsets = self._fit.sample(how, float(value), flat)
        except ValueError:
            # An array has rows for samples that curves without a fit do not have.
            if flat is None or not is_array:
                raise
            coords, offsets = self._fit.sample(how, float(value))
            if self._as_array(how, int(value), coords, offsets).size != flat.size:
                raise
        made: Any = self._as_array(how, int(value), coords, offsets) if is_array else self._curves.back(coords.reshape(-1, self._dimension), offsets, self._closed())
        if is_array and flat is not None and not np.shares_memory(made, flat):
            flat[:] = made.reshape(-1)
            made = flat.reshape(made.shape)
        if is_array and not self._inner:
            made = made[..., 0]
        if not return_t:
            return made
        t = split(self._fit.sample_parameters(how, float(value)), offsets)
        return made, [self._dated(one) for one in t]

    def _as_array(self, how: str, value: int, coords: Floats, offsets: Offsets) -> Floats:
        """Samples as one array: see :meth:`sample`."""
        counts, lines = np.diff(offsets), coords.reshape(-1, self._dimension)
        width = value if how in ("count", "points") else int(counts.max(initial=0))
        if (counts == width).all():
            return lines.reshape(len(self), width, self._dimension)
        bad = np.isin(self._report["status"], ("degenerate", "invalid"))
        if how == "per_span" and not bad.all():
            width = int(counts[~bad].max())
        made = np.full((len(self), width, self._dimension), np.nan)
        rows = np.repeat(np.arange(len(self)), counts)
        column = np.arange(len(lines)) - np.repeat(offsets[:-1], counts)
        whole = (counts[rows] <= width) & ~(bad[rows] & (how not in ("spacing", "tolerance")))
        made[rows[whole], column[whole]] = lines[whole]
        if how not in ("spacing", "tolerance") and bad.any():
            numbers = np.flatnonzero(bad)
            first, last = self._ends
            u = np.linspace(first[numbers], last[numbers], width, axis=1)
            values = self._fit.select(numbers.tolist()).evaluate(u.reshape(-1), np.arange(len(numbers) + 1) * width, 0)
            made[numbers] = values.reshape(-1, width, self._dimension)
        return made

    def _dated(self, seconds: Floats, exact: bool = False) -> Any:
        return seconds if self._clock is None else self._clock.back(seconds, exact)

    def at(self, times: Any) -> Any:
        """Tracks at times, as a table of the kind that :func:`from_dataframe` was given: pandas or polars.

        Parameters
        ----------
        times : str, timedelta, number, or array
            A step, such as ``"1h"``: its multiples between the first and the last time of each track; days such as ``"1D"`` begin
            at the midnights of the zone. Or times, the same for all; those beyond a track's ends are left out.

        Returns
        -------
        A row for each track and time: the columns of tracks, times and coordinates as they were called; ``speed``, in metres by a
        second for longitudes and latitudes, else in units of the coordinates by one of the time; ``heading``, in degrees from north
        (y) to the right; and the columns that are carried, numbers in proportion to the time, others from the nearer point.

        Examples
        --------
        >>> import pandas as pd, faircurve as fc
        >>> table = pd.DataFrame({"id": ["a"] * 3, "x": [0.0, 1, 2], "y": [0.0, 1, 0], "t": [0.0, 10, 20]})
        >>> fit = fc.Natural().fit(fc.from_dataframe(table, by="id", coords=("x", "y"), t="t"))
        >>> fit.at(5)["t"].tolist()
        [0.0, 5.0, 10.0, 15.0, 20.0]
        """
        table = self._curves.table
        if table is None:
            raise TypeError("times are of tracks of a table: make curves by faircurve.from_dataframe(table, by=…, coords=…, t=…)")
        return table.at(self, times)


    @functools.cached_property
    def _length(self) -> Floats:
        return self._fit.lengths()

    @functools.cached_property
    def _max_curvature(self) -> Floats:
        return self._fit.max_curvatures()

    @property
    def length(self) -> Any:
        """Arc lengths, to a relative error of 1e-9.

        Returns
        -------
        (B,) array, or Series
            In units of the input, in a surface of longitudes and latitudes in metres. 0 for curves without a span.

        Warns
        -----
        UserWarning
            Points are in degrees, and no surface was given.

        Examples
        --------
        >>> import faircurve as fc
        >>> fc.Natural().fit([[(0, 0), (3, 4)]]).length.tolist()
        [5.0]
        """
        warn_of_degrees(self._curves, self._recipe, "length")
        return self._of_curves(self._length.copy())

    @property
    def max_curvature(self) -> Any:
        """Largest curvatures (1/length).

        Returns
        -------
        (B,) array, or Series
            0 for straight lines, infinite at cusps.

        Warns
        -----
        UserWarning
            Points are in degrees, and no surface was given.
        """
        warn_of_degrees(self._curves, self._recipe, "max_curvature")
        return self._of_curves(self._max_curvature.copy())

    @property
    def knots(self) -> list[Any]:
        """The parameters of each curve's knots.

        Returns
        -------
        list of (n,) arrays
            Dates where ``t`` was dates. A closed curve has one more, at which it meets its first point again.

        Examples
        --------
        >>> import faircurve as fc
        >>> fc.Natural(parametrisation="chord").fit([[(0, 0), (3, 4), (3, 5)]]).knots[0].tolist()
        [0.0, 5.0, 6.0]
        """
        t, offsets = self._fit.knots()
        return [self._dated(one, exact=True) for one in split(t, offsets)]

    def to_bezier(self, tolerance: float | None = None) -> list[Floats]:
        """The curves as cubic Béziers, exact for splines.

        Parameters
        ----------
        tolerance : float, optional
            Largest distance between both curves, units of the input. By default 1e-6 of each curve's size. Curves that are no splines
            take the longer the smaller it is: fair curves some 10 ms each by default.

        Returns
        -------
        list of (k, 4, d) arrays
            The control points of the k cubics of each curve.

        Raises
        ------
        ValueError
            A tolerance that is not positive.

        Examples
        --------
        >>> import faircurve as fc
        >>> fc.Natural().fit([[(0, 0), (3, 0)]]).to_bezier()[0].tolist()
        [[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]]
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

    def to_ppoly(self) -> list[Any]:
        """Splines as ``scipy.interpolate.PPoly``, one per curve, with antiderivatives, roots and extrapolation. Dates are seconds.

        Values agree with those of the fit to rounding; those of :meth:`to_bpoly` are the cubics themselves.

        Raises
        ------
        TypeError
            For curves that are no cubic between two points, such as :class:`Fair` and :class:`Smooth` make.

        Examples
        --------
        >>> import faircurve as fc
        >>> fit = fc.Natural().fit([[(0, 0), (1, 1), (2, 0)]], t=[[0, 1, 2]])
        >>> fit.to_ppoly()[0](0.5).tolist()
        [0.5, 0.6875]
        """
        from scipy.interpolate import PPoly

        return [PPoly.from_bernstein_basis(one) for one in self.to_bpoly()]

    def to_bpoly(self) -> list[Any]:
        """Splines as ``scipy.interpolate.BPoly``, one per curve, exact, with antiderivatives, roots and extrapolation. Dates are seconds.

        Raises
        ------
        TypeError
            For curves that are no cubic between two points, such as :class:`Fair` and :class:`Smooth` make.

        Examples
        --------
        >>> import faircurve as fc
        >>> fit = fc.Natural().fit([[(0, 0), (1, 1), (2, 0)]], t=[[0, 1, 2]])
        >>> fit.to_bpoly()[0](0.5).tolist()
        [0.5, 0.6875]
        """
        from scipy.interpolate import BPoly

        knots = split(*self._fit.knots())
        made = []
        for i, (pieces, own) in enumerate(zip(self.to_bezier(), knots)):
            if len(pieces) != len(own) - 1:
                raise TypeError(f"curve {i} is no cubic between two points: curves of Natural and Smoothing(lam, deviation, tube) are")
            made.append(BPoly(np.ascontiguousarray(pieces.transpose(1, 0, 2)), own))
        return made

    # --- some of them, and pictures ---

    def __len__(self) -> int:
        return len(self._fit)

    @overload
    def __getitem__(self: Fit[Floats], which: int | slice | Sequence[int] | NDArray[Any]) -> Fit[Floats]: ...  # type: ignore[overload-overlap]
    @overload
    def __getitem__(self: Fit[Pair], which: int | slice | Sequence[int] | NDArray[Any]) -> Fit[Pair]: ...  # type: ignore[overload-overlap]
    @overload
    def __getitem__(self, which: int | slice | Sequence[int] | NDArray[Any]) -> Fit[list[Floats]]: ...
    def __getitem__(self, which: int | slice | Sequence[int] | NDArray[Any]) -> Fit[Any]:
        """The fit of some of the curves.

        Parameters
        ----------
        which : int, slice, numbers or flags
            Curves, in the order of the result.

        Returns
        -------
        Fit
            Its samples are an array or a pair where the curves came as one, and else a list of arrays.

        Raises
        ------
        IndexError
            A number that no curve has.

        Examples
        --------
        >>> import numpy as np, faircurve as fc
        >>> fit = fc.Natural().fit(np.random.default_rng(0).normal(size=(100, 10, 2)))
        >>> fit[3].sample(8).shape, fit[fit.status == "converged"].sample(8).shape
        ((1, 8, 2), (100, 8, 2))
        """
        numbers = chosen(which, len(self))
        curves = self._curves
        ends = [(int(curves.offsets[k]), int(curves.offsets[k + 1])) for k in numbers]
        some: Ragged[Any] = Ragged(
            np.concatenate([curves.coords[a:b] for a, b in ends]) if ends else curves.coords[:0],
            offsets_of([b - a for a, b in ends]),
            curves.back if curves.back in (_array_back, _pair_back, _numbers_back, _lists_of_numbers_back) else _list_back,
            None if curves.closed is None else curves.closed[numbers],
            rows=None if curves.rows is None else curves.rows[numbers],
            index=curves.index,
            t=None if curves.t is None else np.concatenate([curves.t[a:b] for a, b in ends] or [curves.t[:0]]),
            clock=curves.clock,
            degrees=curves.degrees,
            metres=curves.metres,
            table=None if curves.table is None else curves.table.of(numbers),
        )
        recipe: Any = _Selection(self, numbers)
        method, options = self._recipe
        is_alone = not options.get("topology") and not getattr(method, "no_crossing", False)
        if is_alone and all(name in ("topology", "device", "precision") or name == "closed" and np.ndim(value) == 0 for name, value in options.items()):
            # Nothing of the others takes part.
            if not any(isinstance(getattr(method, name, None), tuple) for name in ("max_curvature", "corridor")):
                recipe = (method, options)
        return Fit(self._fit.select(numbers), some, self._dimension, self._clock, recipe, plain=not self._inner)

    def __iter__(self) -> Iterator[Fit[Any]]:
        return (self[k] for k in range(len(self)))

    def _closed(self) -> NDArray[np.bool_]:
        return self._fit.batch.closed

    def to_svg(self, width: float = 800.0, points: bool = True) -> str:
        """The curves and their points as a picture.

        Parameters
        ----------
        width : float
            Pixels, 800 by default.
        points : bool
            Whether points are drawn too, as they are by default.

        Returns
        -------
        str
            An SVG file.

        Examples
        --------
        >>> import faircurve as fc
        >>> fc.Natural().fit([[(0, 0), (1, 1), (2, 0)]]).to_svg()[:4]
        '<svg'
        """
        return self._fit.svg(width, points)

    def _repr_svg_(self) -> str:
        """A picture for notebooks, of the first curves if they are many."""
        return (self if len(self) <= PICTURED else self[:PICTURED]).to_svg()

    def __repr__(self) -> str:
        words, counts = np.unique(self._report["status"].astype(str), return_counts=True)
        statuses = ", ".join(f"{count} {word}" for word, count in zip(words, counts))
        return f"<faircurve.Fit: {len(self)} curves ({statuses}), {self.device}>"

    def plot(self, ax: Any = None, *, points: bool = True, **options: Any) -> Any:
        """Draws the curves with matplotlib, by 16 samples per span.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            By default the current axes, or for curves in space new ones.
        points : bool
            Whether the points are drawn, too.
        **options
            Of the line collection, such as ``color`` and ``linewidth``.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.

        Warns
        -----
        UserWarning
            Curves in space on planar axes.
        """
        import matplotlib.pyplot as plt
        from matplotlib.collections import LineCollection

        if ax is None:
            ax = plt.figure().add_subplot(projection="3d") if self._dimension == 3 else plt.gca()
        in_space = ax.name == "3d" and self._dimension == 3
        if self._dimension == 3 and not in_space:
            warnings.warn("curves in space are drawn without their third coordinate: give axes with projection='3d'", stacklevel=2)
        coords, offsets = self._fit.sample("per_span", 16.0)
        width = 3 if in_space else 2
        lines = split(coords.reshape(-1, self._dimension)[:, :width], offsets)
        rings = self._closed().tolist()
        lines = [np.concatenate([l, l[:1]]) if r else l for l, r in zip(lines, rings)]
        if in_space:
            from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]

            ax.add_collection3d(Line3DCollection(lines, **options))
        else:
            ax.add_collection(LineCollection(lines, **options))
        if points:
            ax.plot(*self._curves.coords[:, :width].T, ".", color="0.4", markersize=3)
        if not in_space:
            ax.autoscale_view()
            ax.set_aspect("equal")
        return ax


class Derivative:
    """Derivatives of a fit, as a function of the parameter: see :meth:`Fit.derivative`."""

    def __init__(self, fit: Fit[Any], nu: int) -> None:
        self._fit: Fit[Any] = fit
        #: The order.
        self.nu: int = nu

    def __call__(self, u: Any, nu: int = 0, outside: Outside | None = None) -> Any:
        """Values at parameters, or their derivatives of order ``nu``, as of :meth:`Fit.__call__`."""
        return self._fit(u, self.nu + nu, outside)

    def derivative(self, nu: int = 1) -> Derivative:
        """The derivatives of order ``nu`` of these."""
        return self._fit.derivative(self.nu + nu)

    def __repr__(self) -> str:
        return f"<derivative {self.nu} of {self._fit!r}>"


#: What Rust's names are in Python.
_NAMES = (
    (" (`ReadOptions::sorted`)", ""),
    ("`spline::Smoothing`", "Smoothing"),
    ("`Parametrisation::", "parametrisation `"),
)


def in_python(text: str) -> str:
    """A sentence of the library with the names that Python has."""
    for rust, own in _NAMES:
        text = text.replace(rust, own)
    return text


class _Selection:
    """Some curves of a fit, as its recipe."""

    def __init__(self, whole: Fit[Any], numbers: list[int]) -> None:
        self.whole, self.numbers = whole, numbers

    def __getitem__(self, k: int) -> Any:
        return self.whole._recipe[k]


def _selected_again(whole: Fit[Any], numbers: list[int]) -> Fit[Any]:
    return whole[numbers]


def _fitted_again(method: Any, curves: Ragged[Any], options: dict[str, Any], device: str) -> Fit[Any]:
    """A fit that `device` made: again, on the CPU where there is no such GPU. A warning tells of another kind of device."""
    on_cpu = "CPU" in device
    try:
        fit: Fit[Any] = method.fit(curves, **options)
    except RuntimeError:
        if on_cpu:
            raise
        fit = method.fit(curves, **{**options, "device": "cpu", "precision": "auto"})
    if on_cpu != ("CPU" in fit.device):
        sentence = f"the fit was made on {device}; made again on {fit.device} its curves differ in their last digits"
        warnings.warn(sentence, UserWarning, stacklevel=2)
    return fit


def warn_of_degrees(curves: Ragged[Any], recipe: Any, what: str) -> None:
    """Warns, as GeoPandas does, where a length is one in degrees."""
    method = recipe[0] if recipe else None
    if curves.degrees and getattr(method, "surface", None) is None:
        warnings.warn(
            f"Geometry is in a geographic CRS. Results from '{what}' are likely incorrect, since they are in degrees. Use "
            "'GeoSeries.to_crs()' to re-project geometries to a projected CRS before this operation, or surface='wgs84' for metres.",
            UserWarning,
            stacklevel=3,
        )


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
