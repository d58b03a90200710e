"""The methods: what is fitted, with which options."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypedDict, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from . import _core
from . import _times
from ._channels import fitted, values_of
from ._arrays import ArrayT, Floats, Lines, Pair, Ragged, flags_per_point, floats, per_curve, per_point, ragged, split, vectors_per_point
from ._energy import Energy, bending, energy_of, geodesic_bending, tautness
from ._fit import Fit, warn_of_degrees
from ._surfaces import Surface, made
from ._times import Clock

if TYPE_CHECKING:
    from typing_extensions import Unpack

#: How far apart ends are, as a part of a curve's size, that closed="auto" takes for one point.
_SAME = 1e-12

_PARAMETRISATIONS = ("auto", "chord", "centripetal", "uniform", "given")
Parametrisation: TypeAlias = Literal["auto", "chord", "centripetal", "uniform", "given"]
Precision: TypeAlias = Literal["auto", "f32", "f64"]
Closed: TypeAlias = bool | Literal["auto"] | Sequence[int] | NDArray[Any] | None

#: Curves of another library, such as a GeoSeries, that come out as the kind they came in.
Kind = TypeVar("Kind")


class _Device(TypedDict, total=False):
    """What ``fit`` of every method takes; checkers of types read it in overloads."""

    closed: Closed
    device: str
    precision: Precision


class _OfGeodesic(_Device, total=False):
    t: Any


class _OfSmooth(_Device, total=False):
    tangents: Any
    exponents: Any


class _OfNatural(_OfGeodesic, total=False):
    tangents: Any
    topology: bool | None


class _OfSmoothing(_OfNatural, total=False):
    weights: Any
    pinned: Any


class _OfFair(_OfSmoothing, total=False):
    curvatures: Any
    largest_curvatures: Any
    corridors: Any
    widths: Any


def _batch(curves: Ragged[Any], *, closed: Any, topology: bool | None = False, t: Any = None, **columns: Any) -> tuple[_core.Batch, Clock | None]:
    """The batch with what is given of its points, and what its parameters stand for."""
    given: dict[str, Any] = {}
    if isinstance(closed, str):
        if closed != "auto":
            raise ValueError(f'closed is "{closed}"; True, False, "auto" and one flag a curve are possible')
        given["auto_closed"] = True
    elif closed is not None:
        given["closed"] = per_curve(closed, curves, "closed").tolist()
    elif curves.closed is not None:
        given["closed"] = curves.closed.tolist()
    clock = curves.clock
    if t is not None:
        given["t"], clock = _times.times(t, curves)
    elif curves.t is not None:
        given["t"] = curves.t
    for name, values in columns.items():
        if values is None:
            continue
        if name in ("tangents", "curvatures", "widths"):
            given[name] = vectors_per_point(values, curves, name)
        elif name in ("pinned", "known"):
            given[name] = flags_per_point(values, curves, name).tolist()
        else:
            given[name] = per_point(values, curves, name)
    coords = _met(curves) if "auto_closed" in given else curves.coords
    given.update(topology=bool(topology), degrees=curves.degrees, metres=curves.metres)
    return _core.Batch(coords, curves.offsets, **given), clock


def _met(curves: Ragged[Any]) -> Floats:
    """The points, where ends that are nearly the same are the same: sin(2π) is not 0."""
    some = np.flatnonzero(curves.counts > 3)
    first, last = curves.offsets[some], curves.offsets[some + 1] - 1
    gaps = np.abs(curves.coords[last] - curves.coords[first]).max(axis=1, initial=0.0)
    near = np.flatnonzero((gaps > 0) & (gaps <= 1e-9 * np.abs(curves.coords[first]).max(axis=1, initial=1.0)))
    if not near.size:
        return curves.coords
    coords = curves.coords.copy()
    for k in near:
        size = np.ptp(coords[first[k] : last[k]], axis=0).max()
        if gaps[k] <= _SAME * size:
            coords[last[k]] = coords[first[k]]
    return coords


def _recipe(method: Any, **options: Any) -> tuple[Any, dict[str, Any]]:
    """How a fit is made again."""
    return method, {name: value for name, value in options.items() if value is not None}


def _number(name: str, value: Any, *, least: float = 0.0, above: bool = True) -> None:
    """Raises for an option that is no number, or not in its range."""
    if value is None:
        return
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        kind = f"an array of the shape {np.shape(value)}" if np.ndim(value) else repr(value)
        raise TypeError(f"{name} is {kind}; it must be a number")
    if not (value > least if above else value >= least):
        raise ValueError(f"{name} is {value}; it must be {'more than' if above else 'at least'} {least:g}")


def _whole(name: str, value: Any, least: int = 1) -> None:
    """Raises for an option that is no whole number, or too small."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"{name} is {value!r}; it must be a whole number")
    if value < least:
        raise ValueError(f"{name} is {value}; it must be at least {least}")


def _numbers(name: str, values: Any, above: bool = True, nan: bool = False) -> tuple[float, ...]:
    """The numbers of curves as a tuple, which can be compared. Raises for one that :func:`_number` refuses, but for NaN where that is none."""
    found = floats(values, name).reshape(-1).tolist()
    for i, value in enumerate(found):
        if not (nan and value != value):
            _number(f"{name}[{i}]", value, above=above)
    return tuple(found)


def _check_count(name: str, given: Sequence[Any], curves: Ragged[Any], what: str = "numbers") -> None:
    """Raises where an option of each curve is not one per curve."""
    if len(given) != len(curves):
        raise ValueError(f"{name} has {len(given)} {what} for {len(curves)} curves: give one per curve")


def _check_each(name: str, given: Sequence[float], curves: Ragged[Any], shares: bool, surface: Any) -> None:
    """Raises where an amount of each curve is not one per curve, or where curves have one for all."""
    _check_count(name, given, curves)
    if shares or surface is not None:
        where = "with borders that curves share: give topology=False" if shares else "in a surface: give one number"
        raise ValueError(f"{name} of each curve is not possible {where}")


def _distance(name: str, value: Any) -> None:
    """Raises for a distance that is neither a positive number nor a part such as "2%"."""
    if not isinstance(value, str):
        _number(name, value)
    elif not any(digit in value for digit in "123456789") or "-" in value.split("e")[0]:
        raise ValueError(f"{name} is {value!r}; it must be a positive number, or a part such as '2%'")


def _word(name: str, value: Any, words: tuple[str, ...]) -> None:
    if value not in words:
        raise ValueError(f"{name} is {value!r}; {', '.join(words)} are possible")


def _places(device: Any, precision: Any) -> None:
    for name, value in (("device", device), ("precision", precision)):
        if not isinstance(value, str):
            raise TypeError(f"{name} is {value!r}; it must be a word such as 'auto'")


def _shares(topology: bool | None, curves: Ragged[Any], closed: Any) -> bool:
    """Whether borders that polygons share are found: by default where rows of a GeoSeries are polygons."""
    return curves.polygons and closed is None if topology is None else topology


class Method:
    """What :class:`Natural`, :class:`Smoothing`, :class:`Fair`, :class:`Smooth` and :class:`Geodesic` are: something with a ``fit``."""

    fit: Callable[..., Fit[Any]]


@dataclass(frozen=True)
class Natural(Method):
    """Cubic splines through every point: the least ∫|p″|² dt.

    Parameters
    ----------
    ends : {"auto", "natural", "clamped"}
        Clamped where a tangent is given, else natural (p″ = 0). Closed curves are periodic.
    parametrisation : {"auto", "chord", "centripetal", "uniform", "given"}
        Where no ``t`` is given, "auto" is centripetal, and with tangents chord lengths. The last parameter of both is the length of
        the points' polygon, and "uniform" ones are 0, 1, 2 …: ``fit.knots`` has all.
    preserve_shape : bool
        Whether planar curves turn only to the side to which their points turn. Splines that do not are replaced by the C¹ cubic
        splines of least ∫|p″|² dt that do; ``report()`` has the knots held, and the cost in energy.
    surface : str, HeightField or Mesh, optional
        The surface that curves lie in, as in :class:`Fair`, such as ``"wgs84"``. They are those of the least covariant
        acceleration; in a sphere Riemannian cubics. Of ``tangents`` the part along the surface counts. On a globe they are degrees
        of longitude and latitude by the unit of t. ``preserve_shape`` is not kept.
    off_surface : float, optional
        The largest distance of a point from the surface, onto which it is moved. By default a thousandth of the curve's size.

    Examples
    --------
    >>> import numpy as np, faircurve as fc
    >>> curves = np.random.default_rng(1).normal(size=(1000, 10, 2))
    >>> fc.Natural().fit(curves).sample(80).shape
    (1000, 80, 2)
    """

    ends: Literal["auto", "natural", "clamped"] = "auto"
    parametrisation: Parametrisation = "auto"
    preserve_shape: bool = False
    surface: Surface | None = None
    off_surface: float | None = None

    def __post_init__(self) -> None:
        _word("ends", self.ends, ("auto", "natural", "clamped"))
        _word("parametrisation", self.parametrisation, _PARAMETRISATIONS)
        _number("off_surface", self.off_surface)

    @overload
    def fit(self, curves: NDArray[Any], **options: Unpack[_OfNatural]) -> Fit[Floats]: ...
    @overload
    def fit(self, curves: tuple[NDArray[Any], NDArray[Any]], **options: Unpack[_OfNatural]) -> Fit[Pair]: ...  # type: ignore[overload-overlap]
    @overload
    def fit(self, curves: Ragged[ArrayT], **options: Unpack[_OfNatural]) -> Fit[ArrayT]: ...
    @overload
    def fit(self, curves: Lines, **options: Unpack[_OfNatural]) -> Fit[list[Floats]]: ...
    @overload
    def fit(self, curves: Kind, **options: Unpack[_OfNatural]) -> Fit[Kind]: ...
    def fit(self, curves: Any, *, t: Any = None, closed: Closed = None, tangents: Any = None, topology: bool | None = None, device: str = "auto", precision: Precision = "auto") -> Fit[Any]:
        """Fits every curve.

        Parameters
        ----------
        curves
            Any batch: see :func:`faircurve.ragged`.
        t : optional
            Parameters of the points, increasing along each curve: shaped as the curves are, or one list for all. Numbers, or
            dates (``datetime64``, pandas with a zone or without, pyarrow), which are seconds for derivatives; by default the M of
            geometries that have it.
        closed : bool, "auto" or (B,) flags
            Which curves are closed; "auto" closes those whose last point repeats their first, to 1e-12 of their size. Geometries are
            read so.
        tangents : optional
            A vector a point (units of the input by those of t), NaN where there is none. At ends only.
        topology : bool, optional
            Whether borders that curves share are found, fitted once and stay shared, and are drawn tighter where they would cross
            in samples. By default of polygons of a GeoSeries or GeoDataFrame. A junction of three borders stays where it is.
        device : {"auto", "cpu", "gpu", "gpu:N", "pci:0000:65:00.0"}
            What does the work; "auto" is a GPU where it is sooner. :func:`faircurve.adapters` lists the GPUs.
        precision : {"auto", "f32", "f64"}
            Of a GPU's arithmetic.

        Returns
        -------
        Fit

        Raises
        ------
        ValueError
            Arguments that make no sense. A bad curve is no error: see ``Fit.status``.
        RuntimeError
            A GPU that was asked for and is not there.
        """
        if (values := values_of(curves, t)) is not None:
            return fitted(self, *values, {"t": t, "closed": closed, "tangents": tangents, "topology": topology, "device": device, "precision": precision})
        given = ragged(curves)
        _places(device, precision)
        shares = _shares(topology, given, closed) and self.surface is None
        batch, clock = _batch(given, closed=closed, t=t, tangents=tangents, topology=shares)
        if self.surface is None:
            fit = _core.natural(batch, self.ends, self.parametrisation, self.preserve_shape, device, precision)
        elif self.preserve_shape:
            raise ValueError("splines in a surface keep no shape: leave preserve_shape out")
        else:
            fit = _core.in_surface(batch, made(self.surface), self.off_surface, self.ends, None, False, self.parametrisation, device, precision)
        recipe = _recipe(self, t=t, closed=closed, tangents=tangents, topology=shares, device=device, precision=precision)
        return Fit(fit, given, fit.dimension, clock, recipe)


@dataclass(frozen=True)
class Smoothing(Method):
    """Smoothing splines near the points. Give one of the five amounts.

    Parameters
    ----------
    lam : float, (B,) array or "gcv"
        λ of ∫|p″|² dt · λ + Σ w |p(t) − q|², 0 or more; larger is smoother. As in ``scipy.interpolate.make_smoothing_spline``. "gcv"
        chooses one for each curve by generalised cross-validation of its weighted residuals. SciPy without ``lam`` takes unweighted ones,
        one coordinate at a time.
    deviation : float, (B,) array or str
        The smoothest curve of this kind that moves no point by more than this: in units of the input, or a part of each
        curve's size (the diagonal of the box around its points), such as ``"2%"``.
    tube : float, (B,) array or str
        The curve of least bending within this distance of every point.
    s : float or (B,) array, optional
        The smoothest curve whose Σ w |p(t) − q|² is at most this, as in ``scipy.interpolate.splprep``, where w is the square of the weight.
        Found by bisection, in some 45 fits of all curves.
    within : float or str
        The same within this distance of the whole polygon, and the polygon within it of the curve: for maps and drawings. Long
        straight lines stay straight, and closed curves keep their area. Lengths such as ``"2km"`` are for geometries whose CRS has
        a unit; in degrees they are on the ground, at every latitude.
    corners : {"auto", "straight"} or float, optional
        With ``within`` the corners that stay sharp: "auto" finds them at the scale of the distance, also in noise of half of it;
        "straight" takes those between straight lines; a number is the turn, in degrees, from which on a point is one.
    pin_ends : bool, optional
        Whether the ends of open curves stay where they are. By default they move with ``lam``, as SciPy's do, and else stay.
    parametrisation : {"auto", "chord", "centripetal", "uniform", "given"}
        Where no ``t`` is given, "auto" is chord lengths.
    surface, off_surface
        As in :class:`Natural`. Splines in a surface take ``lam``, ``deviation`` or ``tube``; on a globe distances are in metres.
    units : {"m"}, optional
        "m" takes distances as metres whatever the CRS of geometries is. In degrees curves lie on the ellipsoid then, as with
        ``surface="wgs84"``, and those ``within`` a distance are measured on the ground.

    Examples
    --------
    >>> import numpy as np, faircurve as fc
    >>> x = np.linspace(0, 6, 50)
    >>> noise = 0.1 * np.random.default_rng(1).normal(size=50)
    >>> fit = fc.Smoothing(lam=0.1).fit(np.stack([x, np.sin(x) + noise], axis=1)[None])
    >>> bool(fit.report()["max_deviation"][0] < 0.3)
    True
    """

    lam: Any = None
    deviation: Any = None
    tube: Any = None
    s: Any = None
    within: float | str | None = None
    corners: Literal["auto", "straight"] | float | None = None
    pin_ends: bool | None = None
    parametrisation: Parametrisation = "auto"
    surface: Surface | None = None
    off_surface: float | None = None
    units: Literal["m"] | None = None

    def _amounts(self) -> dict[str, Any]:
        """The amounts that were given, by their names."""
        amounts = {"lam": self.lam, "deviation": self.deviation, "tube": self.tube, "s": self.s, "within": self.within}
        return {name: value for name, value in amounts.items() if value is not None}

    def __post_init__(self) -> None:
        asked = list(self._amounts())
        if len(asked) != 1:
            raise TypeError(f"give one of lam, deviation, tube, s and within, as in Smoothing(lam=0.1), and not {' and '.join(asked) or 'none'}")
        name, amount = asked[0], self._amounts()[asked[0]]
        if not isinstance(amount, str) and np.ndim(amount) == 1 and name != "within":
            object.__setattr__(self, name, _numbers(name, amount, above=name != "lam"))
        elif name == "s":
            _number(name, amount)
        elif name != "lam":
            _distance(name, amount)
        elif not isinstance(amount, str):
            _number("lam", amount, above=False)
        elif amount != "gcv":
            raise ValueError(f"lam is {amount!r}; it must be a number of 0 or more, or 'gcv'")
        if self.corners is not None and self.within is None:
            raise ValueError(f"corners go with within, and not with {asked[0]}")
        if isinstance(self.corners, str):
            _word("corners", self.corners, ("auto", "straight"))
        else:
            _number("corners", self.corners, above=False)
        _word("parametrisation", self.parametrisation, _PARAMETRISATIONS)
        _number("off_surface", self.off_surface)
        if self.units is not None:
            _word("units", self.units, ("m",))

    @overload
    def fit(self, curves: NDArray[Any], **options: Unpack[_OfSmoothing]) -> Fit[Floats]: ...
    @overload
    def fit(self, curves: tuple[NDArray[Any], NDArray[Any]], **options: Unpack[_OfSmoothing]) -> Fit[Pair]: ...  # type: ignore[overload-overlap]
    @overload
    def fit(self, curves: Ragged[ArrayT], **options: Unpack[_OfSmoothing]) -> Fit[ArrayT]: ...
    @overload
    def fit(self, curves: Lines, **options: Unpack[_OfSmoothing]) -> Fit[list[Floats]]: ...
    @overload
    def fit(self, curves: Kind, **options: Unpack[_OfSmoothing]) -> Fit[Kind]: ...
    def fit(self, curves: Any, *, t: Any = None, closed: Closed = None, tangents: Any = None, weights: Any = None, pinned: Any = None, topology: bool | None = None, device: str = "auto", precision: Precision = "auto") -> Fit[Any]:
        """Fits every curve.

        Parameters
        ----------
        curves
            Any batch: see :func:`faircurve.ragged`.
        t : optional
            Parameters of the points, increasing along each curve: numbers or dates, shaped as the curves are, or one list for all.
        closed : bool, "auto" or (B,) flags, optional
            Which curves are closed; by default rings of geometries alone. "auto" closes those whose last point repeats their first.
        tangents : optional
            A vector per point (units of the input by those of t), NaN where there is none. Met in a surface alone, at ends that stay.
        weights : optional
            Positive numbers, one per point, 1 by default.
        pinned : optional
            Flags of points that stay, one per point. By default none, and the ends of open curves as ``pin_ends`` says.
        topology : bool, optional
            Whether borders that curves share are found and stay shared. By default of polygons of a GeoSeries or GeoDataFrame.
        device : {"auto", "cpu", "gpu", "gpu:N", "pci:0000:65:00.0"}
            What does the work; "auto", the default, is a GPU where it is sooner.
        precision : {"auto", "f32", "f64"}
            Of a GPU's arithmetic.

        Returns
        -------
        Fit
            Of the curves in their order.

        Raises
        ------
        ValueError
            Arguments that make no sense. A bad curve is no error: see ``Fit.status``.
        RuntimeError
            A GPU that was asked for and is not there.

        Examples
        --------
        >>> import numpy as np, faircurve as fc
        >>> curves = np.random.default_rng(0).normal(size=(100, 12, 2)).cumsum(axis=1)
        >>> fit = fc.Smoothing(lam=0.1).fit(curves, weights=np.ones((100, 12)))
        >>> fit.sample(50).shape
        (100, 50, 2)
        """
        ((name, value),) = self._amounts().items()
        corners = "none" if self.corners is None else str(self.corners)
        pin_ends = self.lam is None if self.pin_ends is None else self.pin_ends
        if (values := values_of(curves, t)) is not None:
            return fitted(self, *values, {"t": t, "closed": closed, "tangents": tangents, "weights": weights, "pinned": pinned, "topology": topology, "device": device, "precision": precision})
        given = ragged(curves)
        _places(device, precision)
        if self.units is not None or self.s is not None:
            options = {"t": t, "closed": closed, "weights": weights, "pinned": pinned, "topology": topology, "device": device, "precision": precision}
            method = self._of_residuals(given, options) if self.units is None else self._in_metres(given)
            return method.fit(given, tangents=tangents, **options)
        if name != "lam" and not isinstance(value, str):
            warn_of_degrees(given, (self,), name)
        shares = _shares(topology, given, closed) and self.surface is None
        each = isinstance(value, tuple)
        if each:
            _check_each(name, value, given, shares, self.surface)
        batch, clock = _batch(given, closed=closed, t=t, tangents=tangents, weights=weights, pinned=pinned, topology=shares)
        if self.surface is None:
            fit = _core.smoothing(batch, name, list(value) if each else str(value), corners, pin_ends, self.parametrisation, device, precision)
        elif self.within is not None:
            raise ValueError("smoothing splines in a surface take lam, deviation or tube, and not within")
        else:
            amount = (name, str(value))
            fit = _core.in_surface(batch, made(self.surface), self.off_surface, "auto", amount, pin_ends, self.parametrisation, device, precision)
        recipe = _recipe(
            self, t=t, closed=closed, tangents=tangents, weights=weights, pinned=pinned, topology=shares, device=device, precision=precision
        )
        return Fit(fit, given, fit.dimension, clock, recipe)

    def _of_residuals(self, curves: Ragged[Any], options: dict[str, Any]) -> Smoothing:
        """The method with the largest λ of each curve that keeps its sum of squares."""
        if self.surface is not None:
            raise ValueError("s is of curves in the plane or in space: give lam, deviation or tube in a surface")
        if isinstance(self.s, tuple):
            _check_count("s", self.s, curves)
        weights = np.ones(len(curves.coords)) if options["weights"] is None else per_point(options["weights"], curves, "weights").copy()
        through = replace(self, s=None, lam=0.0).fit(curves, **options)._fit
        knots, ends = through.knots()
        own = split(knots, ends)
        places = np.concatenate([knots[:0], *(_places_of(one, points) for one, points in zip(own, split(curves.coords, curves.offsets)))])
        # A ring whose last point repeats its first has it once.
        weights[curves.offsets[1:][through.batch.closed & (np.diff(ends) == curves.counts)] - 1] = 0.0
        sizes = np.array([max(one[-1] - one[0], 1e-100) ** 3 if len(one) else 1.0 for one in own])
        low, high = np.full(len(own), -24.0), np.full(len(own), 9.0)
        # To 1e-12 of the exponent.
        for _ in range(45):
            middle = 0.5 * (low + high)
            fit = replace(self, s=None, lam=sizes * 10**middle).fit(curves, **options)._fit
            values = fit.evaluate(places, curves.offsets, 0).reshape(len(places), -1)
            squares = np.append(weights * ((values - curves.coords) ** 2).sum(axis=1), 0.0)
            sums = np.add.reduceat(squares, curves.offsets[:-1]) * (curves.counts > 0)
            low, high = np.where(sums > self.s, low, middle), np.where(sums > self.s, middle, high)
        return replace(self, s=None, lam=sizes * 10**low)

    def _in_metres(self, curves: Ragged[Any]) -> Smoothing:
        """The method for these curves whose distances are metres."""
        if curves.degrees:
            if self.within is None:
                return replace(self, units=None, surface=self.surface or "wgs84")
            return replace(self, units=None, within=self.within if isinstance(self.within, str) else f"{self.within}m")
        if (unit := curves.metres) is None:
            raise ValueError('units is "m", and the curves have no CRS: set one, or give distances in the unit of the points')
        distances = {name: getattr(self, name) for name in ("deviation", "tube", "within")}
        return replace(self, units=None, **{name: np.divide(value, unit) for name, value in distances.items() if value is not None and not isinstance(value, str)})


@dataclass(frozen=True)
class Fair(Method):
    """Discrete fair curves: the least of an energy of your choice, through the points or near them (Renka 2006).

    Parameters
    ----------
    energy : Energy or dict, optional
        Such as ``bending(2) + 0.1 * length()`` or ``{"bending": 1, "length": 0.1}``. By default ``bending() + tautness()``,
        which has a least curve for every list of points, in any unit.
    per_span : int
        Edges between data points.
    spacing : float, optional
        The longest edge, in place of ``per_span`` (units of the input).
    pins : {"all", "ends", "none"}, optional
        Which points stay. By default all; with ``deviation`` or an attachment the ends.
    deviation : float, (B,) array or str, optional
        The fairest of all curves that pass within this distance of every point: in units of the input, or a part of each
        curve's size (the diagonal of the box around its points), such as ``"2%"``. In a surface one number for all.
    max_curvature : float or (B,) array, optional
        The largest curvature, for all curves or for each, in 1/length: 1 over the smallest turning radius. A curve for which none is found that keeps its
        limits is ``infeasible``. ``report()`` has the violation, the vertices held, the cost in energy and the stretch. With
        ``energy={"length": 1}`` alone planar curves are the shortest ones of that curvature: Dubins' paths.
    max_curvature_rate : float, optional
        The largest change of the curvature in a unit of length (1/length²), for wheels that turn at a finite speed.
    max_climb : float, optional
        The largest slope of spatial curves: the change of z by the length in x and y.
    preserve_shape : bool
        Whether planar curves turn only to the side to which their points turn. Spatial curves twist only to that side; the
        energy must hold variation or torsion.
    monotone : str or array_like, optional
        A direction in which no curve goes back between two points, ``"x"``, ``"y"``, ``"z"`` or a vector, or several,
        perpendicular to each other: ``"xy"`` or a row each.
    corridor : float or (B,) array, optional
        Curves stay within this distance of the chords between their points (units of the input).
    keep_in, keep_out : array_like, optional
        Discs, or balls, that all curves stay within, or out of: a row each, the centre and the radius.
    obstacles : list of array_like, optional
        Polygons that planar curves stay out of, edges included: corners of two coordinates each, or shapely polygons; or a list of
        them for each curve. Curves go the shortest way around.
    clearance : float, optional
        The distance to ``obstacles`` and ``keep_out`` (units of the input).
    half_planes : array_like, optional
        Half-planes, or half-spaces, that all curves stay in: a row each, the vector n and the number b of n·f <= b.
    max_stretch : float, optional
        The longest curve, as a multiple of the length of its points' polygon, more than 1.
    preserve_area : bool
        Whether planar curves enclose the area that the polygon of their points does; an open one with the chord between its ends.
    no_crossing : bool
        Whether planar curves may not cross each other: contour lines, lanes of a road. Pairs whose points' polygons cross or touch
        are left out. ``report()`` has the ``neighbours`` that each is kept from, and how many are ``touching``.
    surface : str, HeightField or Mesh, optional
        The surface that curves lie in: ``"sphere"``, ``"sphere:R"`` or ``"wgs84"``, with longitudes and latitudes in degrees for
        points, heights beside them if there are any, and metres for lengths, or ``"ellipsoid:a,b,c"``, ``"spheroid:a,b"``, ``"torus:R,r"``, ``"cylinder:R"``,
        ``"cone:degrees"``, ``"grid:FILE,DX,DY,X0,Y0"`` or ``"mesh:FILE.obj"`` with points in space. The energy is then ``geodesic_bending() + tautness()`` by default.
    off_surface : float, optional
        The largest distance of a point from the surface, onto which it is moved. By default a thousandth of the curve's size.
    corners : float, optional
        Points where the input turns by more than this angle (degrees) stay corners.
    solver : {"newton", "sobolev"}
        How curves descend to the minimum.
    tolerance : float
        Size of the gradient at which a curve of size 1 has converged.
    max_iterations : int
        Iterations at most.
    starts : int
        Descents a curve, of which the cheapest is kept: from the spline, from circles through neighbouring points, from the
        polygon rounded, then at random. ``report()["gain"]`` is the part of the energy that they saved.
    seed : int
        Of the starts at random.

    Examples
    --------
    >>> import faircurve as fc
    >>> fc.Fair().fit([[(0, 0), (2, 1), (3, 0)]]).status.tolist()
    ['converged']
    """

    energy: Energy | Mapping[str, float] | None = None
    per_span: int = 16
    spacing: float | None = None
    pins: Literal["all", "ends", "none"] | None = None
    deviation: Any = None
    max_curvature: Any = None
    max_curvature_rate: float | None = None
    max_climb: float | None = None
    preserve_shape: bool = False
    monotone: Any = None
    corridor: Any = None
    keep_in: Any = None
    keep_out: Any = None
    obstacles: Any = None
    clearance: float | None = None
    half_planes: Any = None
    max_stretch: float | None = None
    preserve_area: bool = False
    no_crossing: bool = False
    surface: Surface | None = None
    off_surface: float | None = None
    corners: float | None = None
    solver: Literal["newton", "sobolev"] = "newton"
    tolerance: float = 1e-8
    max_iterations: int = 500
    starts: int = 1
    seed: int = 0

    def __post_init__(self) -> None:
        # As numbers, arrays can be compared.
        for name in ("monotone", "keep_in", "keep_out", "half_planes"):
            value = getattr(self, name)
            if value is not None and not isinstance(value, str):
                object.__setattr__(self, name, _tuples(np.asarray(value, float)))
        for name, check in (("max_curvature", _number), ("corridor", _number), ("deviation", _distance)):
            value = getattr(self, name)
            if value is None or np.ndim(value) == 0:
                check(name, value)
            else:
                object.__setattr__(self, name, _numbers(name, value, nan=name != "deviation"))
        for name in ("spacing", "max_curvature_rate", "max_climb", "clearance", "off_surface", "tolerance"):
            _number(name, getattr(self, name))
        _number("max_stretch", self.max_stretch, least=1.0)
        _number("corners", self.corners, above=False)
        _whole("per_span", self.per_span)
        _whole("max_iterations", self.max_iterations)
        _whole("starts", self.starts)
        _whole("seed", self.seed, 0)
        if self.pins is not None:
            _word("pins", self.pins, ("all", "ends", "none"))
        _word("solver", self.solver, ("newton", "sobolev"))

    @overload
    def fit(self, curves: NDArray[Any], **options: Unpack[_OfFair]) -> Fit[Floats]: ...
    @overload
    def fit(self, curves: tuple[NDArray[Any], NDArray[Any]], **options: Unpack[_OfFair]) -> Fit[Pair]: ...  # type: ignore[overload-overlap]
    @overload
    def fit(self, curves: Ragged[ArrayT], **options: Unpack[_OfFair]) -> Fit[ArrayT]: ...
    @overload
    def fit(self, curves: Lines, **options: Unpack[_OfFair]) -> Fit[list[Floats]]: ...
    @overload
    def fit(self, curves: Kind, **options: Unpack[_OfFair]) -> Fit[Kind]: ...
    def fit(self, curves: Any, *, t: Any = None, closed: Closed = None, tangents: Any = None, curvatures: Any = None, weights: Any = None, pinned: Any = None, largest_curvatures: Any = None, corridors: Any = None, widths: Any = None, topology: bool | None = None, device: str = "auto", precision: Precision = "auto") -> Fit[Any]:
        """Fits every curve.

        Parameters
        ----------
        curves
            Any batch: see :func:`faircurve.ragged`.
        t : optional
            Parameters of the points, increasing along each curve: numbers or dates, shaped as the curves are, or one list for all.
        closed : bool, "auto" or (B,) flags, optional
            Which curves are closed; by default rings of geometries alone. "auto" closes those whose last point repeats their first.
        tangents : optional
            A vector per point that the curve runs along there, NaN where there is none. Its length means nothing.
        curvatures : optional
            A vector per point, the second derivative by arc length (1/length), NaN where there is none; the energy must hold variation.
        weights : optional
            Positive numbers of an attachment, one per point, 1 by default.
        pinned : optional
            Flags of points that stay, one per point; by default as ``pins`` says.
        largest_curvatures : optional
            Bounds of the span that begins at each point (1/length), NaN for none.
        corridors : optional
            Half-widths about the chord that begins at each point (units of the input), NaN for none.
        widths : optional
            Half-widths to the left and to the right of each planar point (units of the input), a row each.
        topology : bool, optional
            Whether borders that curves share are found and stay shared. By default of polygons of a GeoSeries or GeoDataFrame.
        device : {"auto", "cpu", "gpu", "gpu:N", "pci:0000:65:00.0"}
            What does the work; "auto", the default, is a GPU where it is sooner.
        precision : {"auto", "f32", "f64"}
            Of a GPU's arithmetic.

        Returns
        -------
        Fit
            Of the curves in their order.

        Raises
        ------
        ValueError
            Arguments that make no sense. A bad curve is no error: see ``Fit.status``.
        RuntimeError
            A GPU that was asked for and is not there.

        Examples
        --------
        >>> import numpy as np, faircurve as fc
        >>> lanes = np.random.default_rng(0).normal(size=(20, 5, 2)) * 0.3 + 3 * np.arange(5)[:, None]
        >>> ends = np.full(lanes.shape, np.nan)
        >>> ends[:, 0] = [1, 1]
        >>> fit = fc.Fair(per_span=8).fit(lanes, tangents=ends)
        >>> fit.sample(33).shape
        (20, 33, 2)
        """
        default = (bending() if self.surface is None else geodesic_bending()) + tautness()
        energy = default if self.energy is None else energy_of(self.energy)
        near = self.deviation is not None or energy.has("attachment")
        pins = self.pins or ("ends" if near else "all")
        given = ragged(curves)
        deviation = self.deviation if self.deviation is None or isinstance(self.deviation, tuple) else str(self.deviation)
        _places(device, precision)
        for name, value in (("spacing", self.spacing), ("deviation", self.deviation), ("corridor", self.corridor), ("clearance", self.clearance)):
            if value is not None and not isinstance(value, str):
                warn_of_degrees(given, (self,), name)
        own = {"t": t, "closed": closed, "tangents": tangents, "curvatures": curvatures, "weights": weights, "pinned": pinned, "largest_curvatures": largest_curvatures, "corridors": corridors, "widths": widths}
        own["topology"] = _shares(topology, given, closed) and self.surface is None and not self._is_limited()
        if isinstance(deviation, tuple):
            _check_each("deviation", deviation, given, own["topology"], self.surface)
        spans = {"largest_curvatures": self._of_spans("max_curvature", largest_curvatures, given), "corridors": self._of_spans("corridor", corridors, given)}
        batch, clock = _batch(given, **{**own, **spans})
        surface = None if self.surface is None else made(self.surface)
        fit = _core.fair(
            batch, list(energy.terms), self.per_span, self.spacing, pins, deviation,
            self._limits(given), surface, self.off_surface, self.corners, self.solver, self.tolerance, self.max_iterations, self.starts, self.seed, device, precision,
        )  # fmt: skip
        return Fit(fit, given, fit.dimension, clock, _recipe(self, **own, device=device, precision=precision))

    def _is_limited(self) -> bool:
        """Whether limits are asked for, which borders of maps do not keep."""
        limits = (self.max_curvature, self.max_curvature_rate, self.max_climb, self.monotone, self.corridor, self.keep_in, self.keep_out)
        others = (self.obstacles, self.half_planes, self.max_stretch)
        return any(limit is not None for limit in (*limits, *others)) or self.preserve_shape or self.no_crossing

    def _of_spans(self, name: str, column: Any, curves: Ragged[Any]) -> Any:
        """The limits of single spans, with the limits of curves."""
        each = getattr(self, name)
        if not isinstance(each, tuple):
            return column
        _check_count(name, each, curves)
        of_points = np.repeat(np.array(each), curves.counts)
        if column is not None:
            of_points = np.fmin(of_points, per_point(column, curves, name))
        return [of_points[a:b] for a, b in zip(curves.offsets[:-1], curves.offsets[1:])]

    def _limits(self, curves: Ragged[Any]) -> dict[str, object]:
        """The limits, with vectors of three coordinates."""
        dimension = curves.coords.shape[1]
        monotone = _directions(self.monotone, dimension)
        regions = {
            "half_spaces": _regions(self.half_planes, dimension, "half_planes"),
            "keep_in": _regions(self.keep_in, dimension, "keep_in"),
            "keep_out": _regions(self.keep_out, dimension, "keep_out"),
            "obstacles": self._obstacles(curves),
            "clearance": self.clearance,
        }
        bounds = {name: getattr(self, name) for name in ("max_curvature", "max_curvature_rate", "max_climb", "corridor", "max_stretch")}
        bounds = {name: None if isinstance(value, tuple) else value for name, value in bounds.items()}
        return {**bounds, **regions, "preserve_shape": self.preserve_shape, "monotone": monotone, "preserve_area": self.preserve_area, "no_crossing": self.no_crossing}

    def _obstacles(self, curves: Ragged[Any]) -> list[tuple[list[list[float]], int | None]]:
        """The rings of all polygons, each with the curve that it is an obstacle of, or None for all."""
        given = [] if self.obstacles is None else list(self.obstacles)
        if all(map(_is_polygon, given)):
            return [(ring, None) for polygon in given for ring in _rings(polygon)]
        _check_count("obstacles", given, curves, "lists")
        return [(ring, i) for i, own in enumerate(given) for polygon in own for ring in _rings(polygon)]


def _is_polygon(given: Any) -> bool:
    """Whether it is one polygon, of shapely or by its corners, and not a list of them."""
    return hasattr(given, "geom_type") or (len(given) > 0 and not hasattr(given[0], "geom_type") and np.ndim(given[0]) < 2)


def _directions(monotone: Any, dimension: int) -> list[list[float]]:
    """The directions of axes by their letters, of a vector, or of rows."""
    if monotone is None:
        return []
    if isinstance(monotone, str):
        if not monotone or not set(monotone) <= set("xyz"):
            raise ValueError(f"monotone is {monotone!r}; axes are 'x', 'y', 'z' or some of them, such as 'xy'")
        return [[float(axis == other) for other in "xyz"] for axis in monotone]
    return [_vector(row, dimension, "monotone") for row in np.atleast_2d(np.asarray(monotone, dtype=float))]


def _places_of(knots: Floats, points: Floats) -> Floats:
    """The parameter of each point; points that repeat one share its knot."""
    if len(knots) - len(points) in (0, 1):
        return knots[: len(points)]
    entries = np.cumsum(np.append(False, (points[1:] != points[:-1]).any(axis=1))[: len(points)])
    if not len(points) or entries[-1] >= len(knots):
        return np.zeros(len(points))
    return np.asarray(knots[entries])


def _tuples(array: Any) -> Any:
    """Nested tuples of an array's numbers."""
    return tuple(_tuples(row) for row in array) if np.ndim(array) else float(array)


def _vector(vector: Any, dimension: int, name: str) -> list[float]:
    """A vector of two or three coordinates as one of three."""
    found = np.asarray(vector, dtype=float)
    if found.shape != (dimension,):
        raise ValueError(f"{name} has the shape {found.shape}; a vector of {dimension} coordinates is needed")
    return [*found.tolist(), *[0.0] * (3 - dimension)]


def _rings(polygon: Any) -> list[list[list[float]]]:
    """The rings of a polygon: of arrays of corners, or of shapely's polygons of any number of parts."""
    rings = [polygon]
    if hasattr(polygon, "geom_type"):
        parts = getattr(polygon, "geoms", [polygon])
        rings = [ring.coords[:-1] for part in parts for ring in (part.exterior, *part.interiors)]
    found = [np.asarray(ring, dtype=float) for ring in rings]
    for ring in found:
        if ring.ndim != 2 or ring.shape[1] != 2:
            raise ValueError(f"obstacles has a polygon of the shape {ring.shape}; corners of 2 coordinates are needed")
    return [ring.tolist() for ring in found]


def _regions(rows: Any, dimension: int, name: str) -> list[tuple[list[float], float]]:
    """Rows of a vector and a number."""
    found = np.atleast_2d(np.asarray([] if rows is None else rows, dtype=float))
    if found.size == 0:
        return []
    if found.ndim != 2 or found.shape[1] != dimension + 1:
        raise ValueError(f"{name} has the shape {found.shape}; rows of {dimension + 1} numbers are needed")
    return [(_vector(row[:-1], dimension, name), float(row[-1])) for row in found]


@dataclass(frozen=True)
class Geodesic(Method):
    """Geodesics of a surface: from point to point, or the closed one to which a closed curve descends.

    Closed geodesics need not be the shortest: those that are not stable are found too. A closed curve's points are no more than
    the start.

    Parameters
    ----------
    surface : str, HeightField or Mesh
        As in :class:`Fair`, such as ``"wgs84"`` or ``"torus:2,1"``.
    per_span : int
        Edges between points. Lengths of the curves are exact to their fourth power.
    off_surface, tolerance, max_iterations
        As in :class:`Fair`.

    Examples
    --------
    >>> import faircurve as fc
    >>> berlin, tokyo = (13.4, 52.5), (139.7, 35.7)
    >>> fit = fc.Geodesic("wgs84", per_span=64).fit([[berlin, tokyo]])
    >>> round(fit.length[0] / 1000)
    8940
    """

    surface: Surface
    per_span: int = 16
    off_surface: float | None = None
    tolerance: float = 1e-8
    max_iterations: int = 500

    @overload
    def fit(self, curves: NDArray[Any], **options: Unpack[_OfGeodesic]) -> Fit[Floats]: ...
    @overload
    def fit(self, curves: tuple[NDArray[Any], NDArray[Any]], **options: Unpack[_OfGeodesic]) -> Fit[Pair]: ...  # type: ignore[overload-overlap]
    @overload
    def fit(self, curves: Ragged[ArrayT], **options: Unpack[_OfGeodesic]) -> Fit[ArrayT]: ...
    @overload
    def fit(self, curves: Lines, **options: Unpack[_OfGeodesic]) -> Fit[list[Floats]]: ...
    @overload
    def fit(self, curves: Kind, **options: Unpack[_OfGeodesic]) -> Fit[Kind]: ...
    def fit(self, curves: Any, *, t: Any = None, closed: Closed = None, device: str = "auto", precision: Precision = "auto") -> Fit[Any]:
        """Fits every curve.

        Parameters
        ----------
        curves
            Any batch: see :func:`faircurve.ragged`.
        t : optional
            Parameters of the points, increasing along each curve: numbers or dates, shaped as the curves are, or one list for all.
        closed : bool, "auto" or (B,) flags, optional
            Which curves are closed; by default rings of geometries alone. "auto" closes those whose last point repeats their first.
        device : {"auto", "cpu", "gpu", "gpu:N", "pci:0000:65:00.0"}
            What does the work; "auto", the default, is a GPU where it is sooner.
        precision : {"auto", "f32", "f64"}
            Of a GPU's arithmetic.

        Returns
        -------
        Fit
            Of the curves in their order.

        Raises
        ------
        ValueError
            Arguments that make no sense. A bad curve is no error: see ``Fit.status``.
        RuntimeError
            A GPU that was asked for and is not there.

        Examples
        --------
        >>> import faircurve as fc
        >>> fit = fc.Geodesic("sphere:1").fit([[(0, 0), (90, 0)]])
        >>> round(float(fit.length[0]), 3)
        1.571
        """
        fair = Fair(
            geodesic_bending(), self.per_span, pins="ends", surface=self.surface, off_surface=self.off_surface, corners=0.0,
            tolerance=self.tolerance, max_iterations=self.max_iterations,
        )  # fmt: skip
        return fair.fit(curves, t=t, closed=closed, device=device, precision=precision)


@dataclass(frozen=True)
class Smooth(Method):
    """Smooth connection functions: the exact planar curves of least ∫|κ|^ν ds through the points (Alon & Bergmann).

    Parameters
    ----------
    exponent : float
        ν > 1. Larger spreads the curvature more evenly.
    tension : float
        τ ≥ 0, without unit; 0 is none. With one, such as 1, every list of points has a curve, of least
        ∫(|κ|^ν + λ) ds with λ = (2(1 − 1/ν)τ/w)^ν by the width w that the data leave the curve. Fitted on the CPU.
    preserve_shape : bool
        Whether curves turn only to the side to which their points turn, without a tension. Curves that do not are replaced by the
        ones of least ∫|κ|^ν ds that do; ``report()`` has the points held, and the cost in energy. Where neighbouring turns are too
        unlike for that, a curve is ``infeasible``.
    start : {"circle", "bisector", "neighbours"}
        Directions that the search starts from.
    starts, seed : int
        Number of searches a curve, of which the cheapest is kept, and what the random ones are drawn from.
    tolerance : float
        Relative decrement at which a curve has converged.
    max_iterations : int
        Iterations at most.

    Examples
    --------
    >>> import faircurve as fc
    >>> fit = fc.Smooth().fit([[(0, 0), (1, 1), (2, 0)]])
    >>> round(float(fit.energy[0]), 3)
    2.427
    """

    exponent: float = 2.0
    tension: float = 0.0
    preserve_shape: bool = False
    start: Literal["circle", "bisector", "neighbours"] = "circle"
    starts: int = 1
    seed: int = 0
    tolerance: float = 1e-10
    max_iterations: int = 200

    @overload
    def fit(self, curves: NDArray[Any], **options: Unpack[_OfSmooth]) -> Fit[Floats]: ...
    @overload
    def fit(self, curves: tuple[NDArray[Any], NDArray[Any]], **options: Unpack[_OfSmooth]) -> Fit[Pair]: ...  # type: ignore[overload-overlap]
    @overload
    def fit(self, curves: Ragged[ArrayT], **options: Unpack[_OfSmooth]) -> Fit[ArrayT]: ...
    @overload
    def fit(self, curves: Lines, **options: Unpack[_OfSmooth]) -> Fit[list[Floats]]: ...
    @overload
    def fit(self, curves: Kind, **options: Unpack[_OfSmooth]) -> Fit[Kind]: ...
    def fit(self, curves: Any, *, closed: Closed = None, tangents: Any = None, exponents: Any = None, device: str = "auto", precision: Precision = "auto") -> Fit[Any]:
        """Fits every curve.

        Parameters
        ----------
        curves
            Any batch: see :func:`faircurve.ragged`.
        closed : bool, "auto" or (B,) flags, optional
            Which curves are closed; by default rings of geometries alone. "auto" closes those whose last point repeats their first.
        tangents : optional
            A vector per point that the curve runs along there, NaN where there is none. Its length means nothing.
        exponents : optional
            The exponent of the span that begins at each point, NaN for the method's.
        device : {"auto", "cpu", "gpu", "gpu:N", "pci:0000:65:00.0"}
            What does the work; "auto", the default, is a GPU where it is sooner.
        precision : {"auto", "f32", "f64"}
            Of a GPU's arithmetic.

        Returns
        -------
        Fit
            Of the curves in their order.

        Raises
        ------
        ValueError
            Arguments that make no sense. A bad curve is no error: see ``Fit.status``.
        RuntimeError
            A GPU that was asked for and is not there.

        Examples
        --------
        >>> import faircurve as fc
        >>> fit = fc.Smooth().fit([[(0, 0), (1, 1), (2, 0)]], exponents=[[3, 3, 3]])
        >>> fit.status.tolist()
        ['converged']
        """
        given = ragged(curves)
        _places(device, precision)
        own = {"closed": closed, "tangents": tangents, "exponents": exponents}
        batch, _ = _batch(given, **own)
        fit = _core.smooth(
            batch,
            self.exponent,
            self.tension,
            self.preserve_shape,
            self.start,
            self.starts,
            self.seed,
            self.tolerance,
            self.max_iterations,
            device,
            precision,
        )
        return Fit(fit, given, fit.dimension, None, _recipe(self, **own, device=device, precision=precision))
