"""Curves as people bring them, as flat coordinates and offsets, and back again.

Curve ``i`` has the rows ``offsets[i]:offsets[i + 1]`` of ``coords``. Nothing is copied where the coordinates already lie
one after the other as 64-bit floats. Libraries beside numpy are found by what is brought, and never imported first.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Offsets = NDArray[np.int64]

#: Makes what was brought from coordinates, offsets and which curves are closed.
Back = Callable[[Floats, Offsets, NDArray[np.bool_]], Any]


@dataclass(frozen=True)
class Ragged:
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
    """

    coords: Floats
    offsets: Offsets
    back: Back
    closed: NDArray[np.bool_] | None = None

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
    """Values as 64-bit floats one after the other; the same memory where they are."""
    try:
        array = np.ascontiguousarray(values, np.float64)
    except (TypeError, ValueError) as error:
        raise TypeError(f"{what} must be numbers: {error}") from None
    return array


def split(coords: Floats, offsets: Offsets) -> list[Floats]:
    """The curves one by one, as views."""
    return [coords[a:b] for a, b in zip(offsets[:-1].tolist(), offsets[1:].tolist())]


def ragged(curves: Any) -> Ragged:
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


def _is_shapely(curves: Any) -> bool:
    first = curves
    if isinstance(curves, (list, tuple, np.ndarray)) and len(curves) > 0:
        first = next((one for one in curves if one is not None), None)
    return type(first).__module__.partition(".")[0] == "shapely"


def _of_array(array: NDArray[Any]) -> Ragged:
    if array.ndim != 3:
        remedy = "; one curve of shape (n, d) is curves[None]" if array.ndim == 2 else ""
        raise ValueError(f"an array of curves has the shape (B, n, d), not {array.shape}{remedy}")
    count, points, dimension = array.shape
    coords = floats(array, "coordinates").reshape(count * points, dimension)

    def back(coords: Floats, offsets: Offsets, closed: NDArray[np.bool_]) -> Any:
        counts = np.diff(offsets)
        if len(counts) > 0 and (counts == counts[0]).all():
            return coords.reshape(len(counts), int(counts[0]), coords.shape[1])
        return split(coords, offsets)

    return Ragged(coords, np.arange(count + 1, dtype=np.int64) * points, back)


def _of_pair(coords: Any, offsets: Any) -> Ragged:
    offsets = np.ascontiguousarray(offsets)
    if not np.issubdtype(offsets.dtype, np.integer):
        raise TypeError(f"offsets are whole numbers, not {offsets.dtype}")
    return Ragged(
        floats(coords, "coordinates"), offsets.astype(np.int64, copy=False), lambda coords, offsets, closed: (coords, offsets)
    )


def _of_list(curves: Sequence[Any] | NDArray[Any]) -> Ragged:
    arrays = [floats(curve, f"the points of curve {i}") for i, curve in enumerate(curves)]
    dimensions = {array.shape[1] for array in arrays if array.ndim == 2 and array.size > 0}
    dimension = dimensions.pop() if dimensions else 2
    for i, array in enumerate(arrays):
        if array.size == 0:
            arrays[i] = array.reshape(0, dimension)
        elif array.ndim != 2 or array.shape[1] != dimension:
            raise ValueError(f"curve {i} has the shape {array.shape}; it must be (n, {dimension}), as those before it")
    coords = np.concatenate(arrays) if arrays else np.zeros((0, dimension))
    back: Back = lambda coords, offsets, closed: split(coords, offsets)
    return Ragged(coords, offsets_of([len(array) for array in arrays]), back)


def _of_awkward(curves: Any) -> Ragged:
    import awkward as ak

    counts = ak.to_numpy(ak.num(curves, axis=1))
    coords = floats(ak.to_numpy(ak.flatten(curves, axis=1)), "coordinates")

    def back(coords: Floats, offsets: Offsets, closed: NDArray[np.bool_]) -> Any:
        return ak.unflatten(ak.from_numpy(coords), np.diff(offsets))

    return Ragged(coords, offsets_of(counts), back)


def _of_sequence(curves: Any) -> Ragged:
    from nibabel.streamlines import ArraySequence

    begins, counts = np.asarray(curves._offsets, np.int64), np.asarray(curves._lengths, np.int64)
    data = curves._data
    offsets = offsets_of(counts)
    if not np.array_equal(begins, offsets[:-1]) or offsets[-1] != len(data):
        # A selection: its rows lie apart.
        data = curves.copy()._data

    def back(coords: Floats, offsets: Offsets, closed: NDArray[np.bool_]) -> Any:
        sequence = ArraySequence()
        sequence._data = coords
        sequence._offsets, sequence._lengths = offsets[:-1].copy(), np.diff(offsets)
        return sequence

    return Ragged(floats(data, "coordinates"), offsets, back)


def per_point(values: Any, curves: Ragged, what: str) -> Floats:
    """A number for every point: as curves are given, or one list for curves of equal length."""
    total = int(curves.offsets[-1])
    module = type(values).__module__.partition(".")[0]
    if module == "pyarrow":
        from . import _arrow

        flat = floats(_arrow.numbers(values), what)
    elif module == "awkward":
        import awkward as ak

        flat = floats(ak.to_numpy(ak.flatten(values, axis=None)), what)
    elif isinstance(values, np.ndarray) and values.dtype != object:
        flat = floats(values, what).reshape(-1)
    elif len(values) > 0 and np.ndim(values[0]) > 0:
        flat = np.concatenate([floats(one, what) for one in values])
    else:
        flat = floats(values, what)
    counts = curves.counts
    if flat.size != total and len(counts) > 0 and (counts == flat.size).all():
        flat = np.tile(flat, len(counts))
    if flat.size != total:
        raise ValueError(f"{what}: {flat.size} numbers for {total} points: give one a point")
    return flat


def vectors_per_point(values: Any, curves: Ragged, what: str) -> Floats:
    """A vector for every point; rows of NaN have none."""
    given = ragged(values) if not (isinstance(values, np.ndarray) and values.ndim == 2) else None
    coords = floats(values, what) if given is None else given.coords
    if coords.shape != curves.coords.shape:
        raise ValueError(f"{what} have the shape {coords.shape}; it must be that of the points, {curves.coords.shape}")
    return coords


def per_curve(values: Any, curves: Ragged, what: str) -> NDArray[np.bool_]:
    """A flag for every curve, from one for all or one for each."""
    flags = np.asarray(values, bool)
    if flags.ndim == 0:
        return np.full(len(curves), bool(flags))
    if flags.shape != (len(curves),):
        raise ValueError(f"{what}: {flags.size} flags for {len(curves)} curves: give one a curve")
    return flags
