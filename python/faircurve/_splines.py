"""``CubicSplineBatch``: SciPy's ``CubicSpline`` for thousands of curves at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._arrays import Floats, Offsets, chosen, floats, offsets_of, split

Extrapolate: TypeAlias = bool | Literal["periodic"]


class PPolyBatch:
    """Piecewise polynomials, one a curve: what :class:`CubicSplineBatch` and its derivatives are.

    Curves with as many knots are answered by one array, whose first axis is the curve; others by a list.
    """

    _made: tuple[Any, ...]

    def __init__(self, pieces: _core.Piecewise, x: Floats, offsets: Offsets, inner: tuple[int, ...], equal: bool, extrapolate: Extrapolate, axis: int = 0) -> None:
        self._pieces, self._flat, self._offsets = pieces, x, offsets
        self._inner, self._equal = inner, equal
        #: How values outside the knots are found, unless a call says so.
        self.extrapolate: Extrapolate = extrapolate
        #: The axis of a curve's values along which its parameters run.
        self.axis: int = axis

    def __len__(self) -> int:
        return len(self._offsets) - 1

    def __reduce__(self) -> tuple[Any, ...]:
        return _made_again, self._made, {"extrapolate": self.extrapolate}

    def __getitem__(self, which: int | slice | Sequence[int] | NDArray[Any]) -> PPolyBatch:
        """The splines of some of the curves.

        Parameters
        ----------
        which : int, slice, numbers or flags
            Curves, in the order of the result.

        Returns
        -------
        PPolyBatch
            A batch too, of one curve for a number.

        Raises
        ------
        IndexError
            A number that no curve has.

        Examples
        --------
        >>> import numpy as np, faircurve as fc
        >>> splines = fc.CubicSplineBatch(np.arange(6.0), np.random.default_rng(0).normal(size=(1000, 6)))
        >>> len(splines[3]), len(splines[:10]), splines[[5, 3]](0.5).shape
        (1, 10, (2,))
        """
        of, nu = self._made
        chosen: PPolyBatch = of[which].derivative(nu)
        chosen.extrapolate = self.extrapolate
        return chosen

    def __iter__(self) -> Iterator[PPolyBatch]:
        return (self[k] for k in range(len(self)))

    def to_ppoly(self) -> list[Any]:
        """The curves as ``scipy.interpolate.PPoly``, exact: a list.

        Examples
        --------
        >>> import numpy as np, faircurve as fc
        >>> splines = fc.CubicSplineBatch(np.arange(6.0), np.arange(12.0).reshape(2, 6))
        >>> float(splines.to_ppoly()[1](2.5))
        8.5
        """
        from scipy.interpolate import PPoly

        return [PPoly.construct_fast(c, x, self.extrapolate, self.axis) for c, x in zip(self.c, self.x)]

    def __deepcopy__(self, memo: Any) -> PPolyBatch:
        # Nothing of it changes.
        return self

    def __repr__(self) -> str:
        words, counts = np.unique(self.status.astype(str), return_counts=True)
        statuses = ", ".join(f"{count} {word}" for word, count in zip(words, counts))
        return f"<faircurve.{type(self).__name__}: {len(self)} curves ({statuses})>"

    @property
    def x(self) -> Any:
        """The knots.

        Returns
        -------
        (B, n) array
            Or a list of B arrays, where curves differ in their number.
        """
        return self._flat.reshape(len(self), -1) if self._equal else split(self._flat, self._offsets)

    @property
    def c(self) -> Any:
        """The coefficients of each span's polynomial, of powers of u − x, the highest first: ``c[i]`` is SciPy's ``c`` of curve i.

        Returns
        -------
        (B, k, n − 1, …) array
            Or a list of B arrays, where curves differ in their number of knots. k is 4 for cubics.
        """
        order, size = self._pieces.order, int(np.prod(self._inner))
        spans = np.maximum(np.diff(self._offsets) - 1, 0)
        rows = self._pieces.coefficients().reshape(-1, order, size)
        if self._equal:
            shaped = rows.reshape(len(self), -1, order, *self._inner)
            return np.ascontiguousarray(np.moveaxis(shaped, 1, 2))
        return [np.moveaxis(one.reshape(-1, order, *self._inner), 0, 1) for one in split(rows, offsets_of(spans))]

    @property
    def status(self) -> NDArray[Any]:
        """``"converged"`` or ``"invalid"``, one a curve. All values of an invalid curve are NaN."""
        return np.array(self._pieces.status, dtype=object)

    @property
    def messages(self) -> list[str | None]:
        """Why a curve is invalid."""
        return self._pieces.messages

    def _word(self, extrapolate: Extrapolate | None) -> str:
        given = self.extrapolate if extrapolate is None else extrapolate
        return "periodic" if given == "periodic" else "yes" if given else "no"

    def __call__(self, x: Any, nu: int = 0, extrapolate: Extrapolate | None = None) -> Any:
        """Values, or derivatives of order ``nu``.

        Parameters
        ----------
        x : array of any shape, (B, m) array, or list of B arrays
            One array for all curves; a list of arrays, or a two-dimensional array with a row for each curve, where every
            curve has parameters of its own.
        nu : int
            Order of the derivative; negative for antiderivatives. By default 0.
        extrapolate : bool or "periodic", optional
            By default what the splines were made with.

        Returns
        -------
        (B, m, …) array, or a list of arrays (m_i, …)
            Where ``axis`` is not 0, m stands there among the axes of a curve's values, as in SciPy.

        Raises
        ------
        ValueError
            Lists for another number of curves.

        Examples
        --------
        >>> import numpy as np, faircurve as fc
        >>> splines = fc.CubicSplineBatch(np.arange(4.0), [[0.0, 1, 4, 9], [0.0, 1, 8, 27]])
        >>> splines([0.5, 2.5]).round(9).tolist(), splines(2.0, 1).round(9).tolist()
        ([[0.25, 6.25], [0.125, 15.625]], [4.0, 12.0])
        """
        word = self._word(extrapolate)
        if nu < 0:
            return self.antiderivative(-nu)(x, extrapolate=extrapolate)
        own = isinstance(x, (list, tuple)) and len(x) > 0 and np.ndim(x[0]) > 0
        if own or (isinstance(x, np.ndarray) and (x.ndim == 2 or x.dtype == object)):
            if len(x) != len(self):
                raise ValueError(f"{len(x)} lists of x for {len(self)} curves: give one a curve, or one for all")
            if isinstance(x, np.ndarray) and x.ndim == 2:
                ends = np.arange(len(x) + 1, dtype=np.int64) * x.shape[1]
                values = self._pieces.evaluate(floats(x, "x").reshape(-1), ends, nu, word)
                return self._turned(values.reshape(*x.shape, *self._inner), 1, 1)
            lists = [floats(one, "x").reshape(-1) for one in x]
            ends = offsets_of([len(one) for one in lists])
            flat = np.concatenate(lists) if lists else np.zeros(0)
            return [self._turned(one, 0, 1) for one in split(self._pieces.evaluate(flat, ends, nu, word).reshape(-1, *self._inner), ends)]
        shared = floats(x, "x")
        values = self._pieces.evaluate(shared.reshape(-1), None, nu, word)
        return self._turned(values.reshape(len(self), *np.shape(x), *self._inner), 1, np.ndim(x))

    def _turned(self, values: Floats, start: int, count: int) -> Floats:
        """Values with their ``count`` axes of parameters, which begin at ``start``, where ``axis`` says."""
        if self.axis == 0:
            return values
        return np.moveaxis(values, range(start, start + count), range(start + self.axis, start + self.axis + count))

    def _of(self, pieces: _core.Piecewise, nu: int) -> PPolyBatch:
        made = PPolyBatch(pieces, self._flat, self._offsets, self._inner, self._equal, self.extrapolate, self.axis)
        made._made = (self, nu)
        return made

    def derivative(self, nu: int = 1) -> PPolyBatch:
        """The derivatives of order ``nu``.

        Parameters
        ----------
        nu : int
            The order, 1 by default; negative for antiderivatives.

        Returns
        -------
        PPolyBatch

        Examples
        --------
        >>> import numpy as np, faircurve as fc
        >>> fc.CubicSplineBatch(np.arange(4.0), [[0.0, 1, 4, 9]]).derivative()(2.0).round(9).tolist()
        [4.0]
        """
        return self._of(self._pieces.derivative(nu), nu) if nu >= 0 else self.antiderivative(-nu)

    def antiderivative(self, nu: int = 1) -> PPolyBatch:
        """The integrals of order ``nu`` from the first knot on.

        Parameters
        ----------
        nu : int
            The order, 1 by default; negative for derivatives.

        Returns
        -------
        PPolyBatch

        Examples
        --------
        >>> import numpy as np, faircurve as fc
        >>> fc.CubicSplineBatch(np.arange(4.0), [[0.0, 1, 4, 9]]).antiderivative()(3.0).tolist()
        [9.0]
        """
        if nu <= 0:
            return self.derivative(-nu)
        made = self._of(self._pieces.antiderivative(nu), -nu)
        # As in SciPy: an integral of something periodic is not.
        if self.extrapolate == "periodic":
            made.extrapolate = False
        return made

    def integrate(self, a: Any, b: Any, extrapolate: Extrapolate | None = None) -> Floats:
        """∫ from ``a`` to ``b`` of every curve.

        Parameters
        ----------
        a, b : float or (B,) array
            Ends, for all curves or for each.
        extrapolate : bool or "periodic", optional
            By default what the splines were made with.

        Returns
        -------
        (B, …) array

        Raises
        ------
        ValueError
            Ends for another number of curves.

        Examples
        --------
        >>> import numpy as np, faircurve as fc
        >>> splines = fc.CubicSplineBatch(np.arange(4.0), [[0.0, 1, 4, 9], [0.0, 1, 8, 27]])
        >>> splines.integrate(0, 3).tolist(), splines.integrate(0, [3, 2]).tolist()
        ([9.0, 20.25], [9.0, 4.0])
        """
        word = self._word(extrapolate)
        if np.ndim(a) == 0 and np.ndim(b) == 0:
            return self._pieces.integrate(float(a), float(b), word).reshape(len(self), *self._inner)
        ends = []
        for name, values in (("a", a), ("b", b)):
            own = floats(values, name)
            if np.ndim(values) != 0 and own.shape != (len(self),):
                raise ValueError(f"{name} has the shape {own.shape} for {len(self)} curves: give one number, or one per curve")
            ends.append(np.broadcast_to(own.reshape(-1), len(self)))
        whole, rows = self._pieces.antiderivative(1), np.arange(len(self) + 1, dtype=np.int64)

        def until(x: Floats) -> Floats:
            return whole.evaluate(np.ascontiguousarray(x), rows, 0, "yes" if word == "periodic" else word).reshape(len(self), -1)

        if word != "periodic":
            values = until(ends[1]) - until(ends[0])
        else:
            first, last = self._flat[self._offsets[:-1]], self._flat[self._offsets[1:] - 1]
            period = until(last)
            turns = [np.floor_divide(x - first, last - first) for x in ends]
            start, end = (until(x - turn * (last - first)) + turn[:, None] * period for x, turn in zip(ends, turns))
            values = end - start
        return values.reshape(len(self), *self._inner)

    def solve(self, y: float = 0.0, extrapolate: Extrapolate | None = None) -> Any:
        """Where the curves have the value ``y``.

        Parameters
        ----------
        y : float
            The value, 0 by default.
        extrapolate : bool or "periodic", optional
            By default what the splines were made with.

        Returns
        -------
        list of arrays
            Parameters in increasing order; where a curve has several values, an object array of arrays per curve. Where a curve
            has the value in a whole span, its first end and NaN, as in SciPy.

        Examples
        --------
        >>> import numpy as np, faircurve as fc
        >>> fc.CubicSplineBatch(np.arange(4.0), [[0.0, 1, 4, 9]]).solve(4, extrapolate=False)[0].round(9).tolist()
        [2.0]
        """
        flat, ends = self._pieces.solve(float(y), self._word(extrapolate))
        lists = split(flat, ends)
        if not self._inner:
            return lists
        size = int(np.prod(self._inner))
        answers = []
        for i in range(len(self)):
            own = np.empty(size, dtype=object)
            own[:] = [lists[i * size + k] for k in range(size)] if size != 1 else [lists[i]]
            answers.append(own.reshape(self._inner))
        return answers

    def roots(self, extrapolate: Extrapolate | None = None) -> Any:
        """Where the curves are 0, as :meth:`solve` has it for ``y`` = 0.

        Examples
        --------
        >>> import numpy as np, faircurve as fc
        >>> fc.CubicSplineBatch(np.arange(4.0), [[-1.0, 0, 3, 8]]).roots(extrapolate=False)[0].round(9).tolist()
        [1.0]
        """
        return self.solve(0.0, extrapolate)


def _made_again(of: Any, *how: Any) -> Any:
    """A pickled spline, from what it was made of; a derivative from its spline and its order."""
    if isinstance(of, PPolyBatch):
        return of.derivative(how[0])
    arguments, options = how
    return of(*arguments, **options)


class CubicSplineBatch(PPolyBatch):
    """Cubic splines through values, a curve each: a drop-in for a loop of ``scipy.interpolate.CubicSpline``.

    Parameters
    ----------
    x : (n,) array, (B, n) array, or a list of B arrays
        Knots, strictly increasing: the same for all curves, or each curve's own.
    y : (B, n, …) array, or a list of arrays (n_i, …)
        Values.
    bc_type : str or pair
        "not-a-knot", "natural", "clamped", "periodic", or a condition for each end: "not-a-knot", "natural", "clamped",
        or (order, value) of the first or second derivative, whose value is one for all or of the shape (B, …).
    extrapolate : bool or "periodic", optional
        By default "periodic" for periodic splines, else True.
    axis : int
        The axis of each curve's values along which its knots run, 0 by default: of an array y it is the one after the first.
    device : {"auto", "cpu", "gpu", "gpu:N"}
        What solves for the derivatives at the knots.

    Notes
    -----
    The equations are SciPy's. Values, derivatives, integrals and roots between the knots agree to 1e-12 of the largest; far
    beyond the knots roots of both are up to 1e-11 from the exact ones, since the last span's cubic term is rounded. A curve that
    has no spline (knots that do not increase, values that are not numbers) is ``"invalid"`` in ``status``, and NaN.

    Examples
    --------
    >>> import numpy as np, faircurve as fc
    >>> x = np.arange(6.0)
    >>> splines = fc.CubicSplineBatch(x, np.sin(x + np.arange(1000)[:, None]))
    >>> splines([0.5, 1.5]).shape, splines(0.0, 1).shape
    ((1000, 2), (1000,))
    >>> splines.integrate(0, 5).shape, splines.c.shape
    ((1000,), (1000, 4, 5))
    """

    def __init__(self, x: Any, y: Any, bc_type: Any = "not-a-knot", extrapolate: Extrapolate | None = None, *, axis: int = 0, device: str = "auto", precision: Literal["auto", "f32", "f64"] = "auto") -> None:
        equal = isinstance(y, np.ndarray) and y.dtype != object
        flat, counts, inner, along = _values(y, equal, axis)
        offsets = offsets_of(counts)
        knots = _knots(x, counts)
        periodic = isinstance(bc_type, str) and bc_type == "periodic"
        start, end = (None, None) if periodic else _conditions(bc_type, len(counts), inner)
        columns = max(1, int(np.prod(inner)))
        pieces = _core.Piecewise(knots, offsets, flat, columns, periodic, start, end, device, precision)
        if extrapolate is None:
            extrapolate = "periodic" if periodic else True
        super().__init__(pieces, knots, offsets, inner, equal, extrapolate, along)
        self._made: Any = (CubicSplineBatch, (x, y, bc_type, extrapolate), {"axis": axis, "device": device, "precision": precision})

    def __getitem__(self, which: int | slice | Sequence[int] | NDArray[Any]) -> CubicSplineBatch:
        numbers = chosen(which, len(self))
        _, (_, y, bc_type, _), options = self._made
        knots = split(self._flat, self._offsets)
        if not isinstance(bc_type, str):
            bc_type = tuple(end if isinstance(end, str) else (end[0], np.broadcast_to(end[1], (len(self), *self._inner))[numbers]) for end in bc_type)
        x = [knots[k] for k in numbers]
        if self._equal:
            return CubicSplineBatch(np.reshape(x, (len(x), -1)), y[numbers], bc_type, self.extrapolate, **options)
        return CubicSplineBatch(x, [y[k] for k in numbers], bc_type, self.extrapolate, **options)

    __getitem__.__doc__ = PPolyBatch.__getitem__.__doc__


def _values(y: Any, equal: bool, axis: int) -> tuple[Floats, list[int], tuple[int, ...], int]:
    """The values of all curves, one after the other; the numbers of their knots; the shape of a value; the axis of knots."""
    wrong = "y has a row of values for each curve: its shape is (B, n, …)"
    values = [floats(y, "y")] if equal else [floats(one, f"y of curve {i}") for i, one in enumerate(y)]
    if any(one.ndim == (1 if equal else 0) for one in values):
        raise ValueError(wrong)
    dimensions = values[0].ndim - equal if values else 1
    if not -dimensions <= axis < dimensions:
        raise ValueError(f"axis is {axis}; the values of a curve have {dimensions} axes")
    along = axis % dimensions
    values = [np.ascontiguousarray(np.moveaxis(one, along + equal, int(equal))) for one in values]
    if equal:
        return values[0].reshape(-1), [values[0].shape[1]] * len(values[0]), values[0].shape[2:], along
    inner = values[0].shape[1:] if values else ()
    for i, one in enumerate(values):
        if one.shape[1:] != inner:
            raise ValueError(f"the values of curve {i} have the shape {one.shape[1:]}, those before it {inner}")
    flat = np.concatenate([one.reshape(-1) for one in values]) if values else np.zeros(0)
    return flat, [len(one) for one in values], inner, along


def _knots(x: Any, counts: list[int]) -> Floats:
    """The knots of all curves, one after the other."""
    if isinstance(x, np.ndarray) and x.dtype != object and x.ndim == 2 and x.shape == (len(counts), *counts[:1]):
        return floats(x, "x").reshape(-1)
    shared = not (isinstance(x, (list, tuple)) and len(x) > 0 and np.ndim(x[0]) > 0) and np.ndim(x) == 1
    lists = [floats(x, "x")] * len(counts) if shared else [floats(one, f"x of curve {i}") for i, one in enumerate(x)]
    if len(lists) != len(counts):
        raise ValueError(f"knots of {len(lists)} curves for values of {len(counts)}")
    for i, (one, count) in enumerate(zip(lists, counts)):
        if one.shape != (count,):
            raise ValueError(f"curve {i} has knots of the shape {one.shape} for {count} values")
    return np.concatenate(lists) if lists else np.zeros(0)


def _conditions(bc_type: Any, count: int, inner: tuple[int, ...]) -> list[Any]:
    ends: Sequence[Any] = (bc_type, bc_type) if isinstance(bc_type, str) else bc_type
    if len(ends) != 2:
        raise ValueError("bc_type is one word, or a condition for each of the two ends")
    made: list[Any] = []
    for end in ends:
        if isinstance(end, str):
            words: dict[str, Any] = {"not-a-knot": None, "clamped": (1, 0.0), "natural": (2, 0.0)}
            if end not in words:
                raise ValueError(f'bc_type is "{end}"; not-a-knot, natural, clamped, periodic and (order, value) are possible')
            end = words[end]
        if end is not None:
            order, value = end
            try:
                full = np.broadcast_to(floats(value, "a derivative at an end"), (count, *inner))
            except ValueError:
                raise ValueError(f"a derivative at an end has the shape {np.shape(value)}; it must be {(count, *inner)}") from None
            end = (int(order), np.ascontiguousarray(full).reshape(-1))
        made.append(end)
    return made
