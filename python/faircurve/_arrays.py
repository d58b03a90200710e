"""Curves as people bring them, as flat coordinates and offsets, and back again.

Curve ``i`` has the rows ``offsets[i]:offsets[i + 1]`` of ``coords``. Nothing is copied where the coordinates already lie
one after the other as 64-bit floats. Libraries beside numpy are found by what is brought, and never imported first.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeAlias, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Offsets = NDArray[np.int64]

#: Curves as lists of points.
Lines: TypeAlias = Sequence[NDArray[Any]] | Sequence[Sequence[Sequence[float]]] | Sequence[Sequence[NDArray[Any]]]

#: The kind of thing that samples come out as: the one that the curves came in as.
ArrayT = TypeVar("ArrayT")

Pair: TypeAlias = tuple[Floats, Offsets]


@dataclass(frozen=True)
class Ragged(Generic[ArrayT]):
    """Curves of any lengths.

    Attributes
    ----------
    coords : (N, d) array
        The points of all curves.
    offsets : (B + 1,) array
        Where each curve begins and ends.
    back : callable
        Makes the kind of thing that was brought from other coordinates and offsets.
    closed : (B,) array, optional
        Which curves are closed, where the kind says so.
    rows : (B,) array, optional
        The row of each curve: of a geometry with several parts or rings, all have its row. By default each has its own.
    index : optional
        The labels of rows: the index of a GeoSeries or GeoDataFrame.
    t : (N,) array, optional
        Parameters of the points, where the kind has them, and their ``clock``.
    degrees : bool
        Whether coordinates are degrees of a geographic CRS.
    """

    coords: Floats
    offsets: Offsets
    #: Makes what was brought from coordinates, offsets and which curves are closed.
    back: Callable[[Floats, Offsets, NDArray[np.bool_]], ArrayT]
    closed: NDArray[np.bool_] | None = None
    rows: NDArray[np.int64] | None = None
    index: Any = None
    t: Floats | None = None
    clock: Any = None
    degrees: bool = False
    #: The unit of coordinates, such as "metre", where a CRS says so.
    unit: str | None = None
    #: Whether all curves are rings of polygons of a table's rows, which may share borders.
    polygons: bool = False
    #: The table that the curves were read from, the number of its rows, and the row of every point.
    table: Any = None
    order: Any = None
    #: Whether values of points may come flat, as the points themselves did.
    flat: bool = False

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @property
    def counts(self) -> NDArray[np.int64]:
        return np.diff(self.offsets)


def offsets_of(counts: Sequence[int] | NDArray[Any]) -> Offsets:
    """Offsets from the numbers of points."""
    offsets = np.zeros(len(counts) + 1, np.int64)
    np.cumsum(counts, out=offsets[1:])
    return offsets


def floats(values: Any, what: str) -> Floats:
    """Values as 64-bit floats one after the other; the same memory where they are. Masked ones and ``pandas.NA`` are NaN."""
    if isinstance(values, np.ma.MaskedArray):
        values = np.ma.filled(values.astype(np.float64), np.nan)
    elif type(values).__module__.partition(".")[0] == "pandas" and hasattr(values, "to_numpy"):
        try:
            values = values.to_numpy(np.float64, na_value=np.nan)
        except (TypeError, ValueError):
            values = values.to_numpy()
    kind = getattr(values, "dtype", np.asarray(values).dtype if isinstance(values, (list, tuple)) and _is_regular(values) else None)
    if isinstance(kind, np.dtype) and kind.kind not in "biufO":
        raise TypeError(f"{what} must be numbers, and not {kind}")
    try:
        return np.ascontiguousarray(values, np.float64)
    except (TypeError, ValueError) as error:
        array = np.asarray(values, dtype=object) if _is_regular(values) else None
        missing = [type(one).__name__ in ("NAType", "NaTType") for one in array.flat] if array is not None else []
        if array is not None and any(missing):
            known = [np.nan if is_missing else one for one, is_missing in zip(array.flat, missing)]
            return floats(np.array(known, dtype=object).reshape(array.shape), what)
        raise TypeError(f"{what} must be numbers: {error}") from None


def _is_regular(values: Any) -> bool:
    """Whether nested lists make an array."""
    try:
        np.asarray(values)
    except ValueError:
        return False
    return True


def split(coords: NDArray[Any], offsets: Offsets) -> list[NDArray[Any]]:
    """The curves one by one, as views."""
    return [coords[a:b] for a, b in zip(offsets[:-1].tolist(), offsets[1:].tolist())]


@overload
def ragged(curves: NDArray[Any]) -> Ragged[Floats]: ...
@overload
def ragged(curves: tuple[NDArray[Any], NDArray[Any]]) -> Ragged[Pair]: ...  # type: ignore[overload-overlap]
@overload
def ragged(curves: Ragged[ArrayT]) -> Ragged[ArrayT]: ...
@overload
def ragged(curves: Lines) -> Ragged[list[Floats]]: ...
@overload
def ragged(curves: ArrayT) -> Ragged[ArrayT]: ...
def ragged(curves: Any) -> Ragged[Any]:
    """Any batch of curves as coordinates and offsets.

    Parameters
    ----------
    curves
        - an array of shape (B, n, d), d = 2 or 3;
        - a list of arrays of shape (n_i, d);
        - a pair of coordinates of shape (N, d) and offsets of shape (B + 1,);
        - a GeoSeries, a GeoDataFrame, or a list of shapely geometries: lines, rings, polygons and multi-parts;
        - a pyarrow array of lists of points: fixed-size lists or structs x, y (and z), as in GeoArrow, or plain lists;
        - an awkward array of shape B * var * d;
        - nibabel's ArraySequence.

    Raises
    ------
    TypeError
        For anything else.
    ValueError
        For arrays of other shapes.
    """
    if isinstance(curves, Ragged):
        return curves
    kind = type(curves)
    module = kind.__module__.partition(".")[0]
    if module == "geopandas" or "shapely" in sys.modules and _is_shapely(curves):
        from . import _geometries

        return _geometries.ragged(curves)
    if module == "pyarrow":
        from . import _arrow

        return _arrow.ragged(curves)
    if module == "awkward":
        return _of_awkward(curves)
    if module == "nibabel":
        return _of_sequence(curves)
    if isinstance(curves, np.ndarray) and curves.dtype != object:
        return _of_array(curves)
    if isinstance(curves, tuple) and len(curves) == 2 and np.ndim(curves[0]) == 2 and np.ndim(curves[1]) == 1:
        return _of_pair(*curves)
    if isinstance(curves, (list, tuple, np.ndarray)):
        return _of_list(curves)
    raise TypeError(
        f"curves are a {kind.__name__}: give an array (B, n, d), a list of arrays (n, d), a pair (coords, offsets), or "
        "lists of pyarrow, awkward, shapely or nibabel"
    )


def chosen(which: Any, count: int) -> list[int]:
    """The numbers of some of a count of curves: of one number, a slice, numbers or flags."""
    if isinstance(which, (int, np.integer)):
        if not -count <= which < count:
            raise IndexError(f"there is no curve {which} of {count}")
        return [int(which) % count]
    if isinstance(which, slice):
        return list(range(count))[which]
    flags = np.asarray(which)
    numbers: list[int] = np.arange(count)[flags if flags.size else flags.astype(np.int64)].tolist()
    return numbers


def _is_shapely(curves: Any) -> bool:
    first = curves
    if isinstance(curves, (list, tuple, np.ndarray)) and len(curves) > 0:
        first = next((one for one in curves if one is not None), None)
    return type(first).__module__.partition(".")[0] == "shapely"


def _of_array(array: NDArray[Any]) -> Ragged[Any]:
    if array.ndim != 3:
        remedy = "; one curve of shape (n, d) is curves[None]" if array.ndim == 2 else ""
        raise ValueError(f"an array of curves has the shape (B, n, d), not {array.shape}{remedy}")
    count, points, dimension = array.shape
    coords = floats(array, "coordinates").reshape(count * points, dimension)

    return Ragged(coords, np.arange(count + 1, dtype=np.int64) * points, _array_back)


def _array_back(coords: Floats, offsets: Offsets, closed: NDArray[np.bool_]) -> Any:
    counts = np.diff(offsets)
    if (counts == counts[:1]).all():
        return coords.reshape(len(counts), int(counts[0]) if len(counts) else 0, coords.shape[1])
    return split(coords, offsets)


def _pair_back(coords: Floats, offsets: Offsets, closed: NDArray[np.bool_]) -> Any:
    return coords, offsets


def _list_back(coords: Floats, offsets: Offsets, closed: NDArray[np.bool_]) -> Any:
    return split(coords, offsets)


def _numbers_back(coords: Floats, offsets: Offsets, closed: NDArray[np.bool_]) -> Any:
    return _array_back(coords, offsets, closed)[..., 0]


def _lists_of_numbers_back(coords: Floats, offsets: Offsets, closed: NDArray[np.bool_]) -> Any:
    return split(coords[:, 0], offsets)


def _of_pair(coords: Any, offsets: Any) -> Ragged[Any]:
    offsets = np.ascontiguousarray(offsets)
    if not np.issubdtype(offsets.dtype, np.integer):
        raise TypeError(f"offsets are whole numbers, not {offsets.dtype}")
    points = floats(coords, "coordinates")
    return Ragged(points, offsets.astype(np.int64, copy=False), _pair_back, flat=True)


def _of_list(curves: Sequence[Any] | NDArray[Any]) -> Ragged[Any]:
    arrays = [floats(curve, f"the points of curve {i}") for i, curve in enumerate(curves)]
    dimensions = {array.shape[1] for array in arrays if array.ndim == 2 and array.size > 0}
    dimension = dimensions.pop() if dimensions else 2
    for i, array in enumerate(arrays):
        if array.size == 0:
            arrays[i] = array.reshape(0, dimension)
        elif array.ndim != 2 or array.shape[1] != dimension:
            raise ValueError(f"curve {i} has the shape {array.shape}; it must be (n, {dimension}), as those before it")
    coords = np.concatenate(arrays) if arrays else np.zeros((0, dimension))
    return Ragged(coords, offsets_of([len(array) for array in arrays]), _list_back)


def _of_awkward(curves: Any) -> Ragged[Any]:
    import awkward as ak

    counts = ak.to_numpy(ak.num(curves, axis=1))
    coords = floats(ak.to_numpy(ak.flatten(curves, axis=1)), "coordinates")

    return Ragged(coords, offsets_of(counts), _awkward_back)


def _awkward_back(coords: Floats, offsets: Offsets, closed: NDArray[np.bool_]) -> Any:
    import awkward as ak

    return ak.unflatten(ak.from_numpy(coords), np.diff(offsets))


def _sequence_back(coords: Floats, offsets: Offsets, closed: NDArray[np.bool_]) -> Any:
    from nibabel.streamlines.array_sequence import ArraySequence

    sequence = ArraySequence()
    sequence._data = coords
    sequence._offsets, sequence._lengths = offsets[:-1].copy(), np.diff(offsets)
    return sequence


def _of_sequence(curves: Any) -> Ragged[Any]:
    begins, counts = np.asarray(curves._offsets, np.int64), np.asarray(curves._lengths, np.int64)
    data = curves._data
    offsets = offsets_of(counts)
    if not np.array_equal(begins, offsets[:-1]) or offsets[-1] != len(data):
        # A selection: its rows lie apart.
        data = curves.copy()._data

    return Ragged(floats(data, "coordinates"), offsets, _sequence_back)


def per_point(values: Any, curves: Ragged[Any], what: str, converted: Callable[[Any, str], Floats] = floats) -> Floats:
    """A number for every point: one list per curve, shaped as the curves are; or one list for curves of equal length.

    Parameters
    ----------
    converted : callable
        Makes floats of what is brought, and raises for what it cannot read.
    """
    counts = curves.counts
    if type(values).__module__.startswith("pandas") and len(values) > 0 and np.ndim(values.iloc[0] if hasattr(values, "iloc") else 0) > 0:
        values = values.tolist()
    module = type(values).__module__.partition(".")[0]
    if module in ("pyarrow", "awkward"):
        flat, own = _lists_of(values, what, module, converted)
        _expect_counts(own, counts, what)
        return flat
    if isinstance(values, (list, tuple)) or isinstance(values, np.ndarray) and values.dtype == object:
        if len(values) > 0 and np.ndim(values[0]) > 0:
            lists = [converted(one, f"{what} of curve {i}").reshape(-1) for i, one in enumerate(values)]
            _expect_counts(np.array([len(one) for one in lists]), counts, what)
            return np.concatenate(lists)
    array = converted(values, what)
    if array.ndim > 1:
        if array.ndim != 2 or array.shape[0] != len(counts) or not (counts == array.shape[1]).all():
            shape = f"({len(counts)}, {counts[0]})" if len(counts) and (counts == counts[0]).all() else "one list per curve"
            raise ValueError(f"{what} has the shape {array.shape}; it must be as the points are: {shape}")
        return array.reshape(-1)
    if curves.order is not None and array.size == curves.table.rows:
        # In the order of the table.
        return np.asarray(array.reshape(-1)[curves.order])
    if curves.flat and array.size == int(curves.offsets[-1]):
        return array.reshape(-1)
    if len(counts) > 0 and (counts == array.size).all():
        if len(counts) == array.size > 1 and what != "t":
            raise ValueError(
                f"{what} has {array.size} numbers for {len(counts)} curves of as many points: give one number per point, of the shape "
                f"({len(counts)}, {array.size}), as numpy.broadcast_to makes it"
            )
        return np.tile(array.reshape(-1), len(counts))
    if array.size == 0 and not counts.any():
        return array.reshape(-1)
    raise ValueError(f"{what} has {array.size} numbers, and the curves have {_several(counts)}: give one list per curve")


def _lists_of(values: Any, what: str, module: str, converted: Callable[[Any, str], Floats]) -> tuple[Floats, NDArray[Any]]:
    """The numbers of lists of pyarrow or awkward, and how many each list has."""
    if module == "pyarrow":
        from . import _arrow

        flat, counts = _arrow.lists_of_numbers(values)
        return converted(flat, what).reshape(-1), counts
    import awkward as ak

    return converted(ak.to_numpy(ak.ravel(values)), what).reshape(-1), ak.to_numpy(ak.num(values, axis=1))


def _several(counts: NDArray[Any]) -> str:
    own = np.unique(counts)
    return f"{own[0]} points" if len(own) == 1 else f"{own[0]} to {own[-1]} points" if len(own) else "no points"


def _expect_counts(own: NDArray[Any], counts: NDArray[Any], what: str) -> None:
    """Whether there is a list for every curve, with one number per point."""
    if len(own) != len(counts):
        raise ValueError(f"{what} has lists for {len(own)} curves; there are {len(counts)}")
    other = np.flatnonzero(own != counts)
    if len(other):
        i = int(other[0])
        raise ValueError(f"{what} has {own[i]} numbers for the {counts[i]} points of curve {i}: give one per point")


def vectors_per_point(values: Any, curves: Ragged[Any], what: str) -> Floats:
    """A vector for every point; rows of NaN have none."""
    if isinstance(values, np.ndarray) and values.ndim == 2:
        coords = floats(values, what)
        if not (curves.flat or len(curves) == 1) or len(coords) != len(curves.coords):
            raise ValueError(f"{what} has the shape {coords.shape}; it must be as the points are: one list of vectors per curve")
        return coords
    given = ragged(values)
    _expect_counts(given.counts, curves.counts, what)
    if given.coords.shape[1] != (2 if what == "widths" else curves.coords.shape[1]):
        raise ValueError(f"{what} has vectors of {given.coords.shape[1]} numbers for points of {curves.coords.shape[1]}")
    return given.coords


def flags(values: Any, what: str) -> NDArray[np.bool_]:
    """True and False, or 1 and 0."""
    array = np.asarray(values)
    if array.dtype.kind not in "biu" or not np.isin(array, (0, 1)).all():
        raise TypeError(f"{what} holds {array.dtype if array.dtype.kind != 'f' else 'numbers'}; its flags are True or False")
    return array.astype(bool)


def flags_per_point(values: Any, curves: Ragged[Any], what: str) -> NDArray[np.bool_]:
    """A flag for every point."""
    converted = lambda one, what: flags(one, what).astype(np.float64)  # noqa: E731
    return per_point(values, curves, what, converted).astype(bool)


def per_curve(values: Any, curves: Ragged[Any], what: str) -> NDArray[np.bool_]:
    """A flag for every curve, from one for all or one for each."""
    own = flags(values, what)
    if own.ndim == 0:
        return np.full(len(curves), bool(own))
    if own.shape != (len(curves),):
        raise ValueError(f"{what}: {own.size} flags for {len(curves)} curves: give one per curve")
    return own
