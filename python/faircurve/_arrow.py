"""Lists of points in pyarrow, as GeoArrow lays them out: interleaved (fixed-size lists) or separated (structs).

Points may be plain lists, too, as Spark and Parquet have them.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pyarrow as pa

from ._arrays import Floats, Offsets, Ragged, floats


def _array(values: Any) -> Any:
    return values.combine_chunks() if isinstance(values, pa.ChunkedArray) else values


def _is_list(kind: Any) -> bool:
    return bool(pa.types.is_list(kind) or pa.types.is_large_list(kind))


def _lists(values: Any) -> tuple[Any, Offsets]:
    """The items of lists, and offsets among them. A list that is null is empty."""
    array = _array(values)
    if not _is_list(array.type):
        raise TypeError(f"a pyarrow array of curves holds lists of points, not {array.type}")
    if array.null_count:
        # What lies under a null is nobody's.
        array = array.fill_null([]) if hasattr(array, "fill_null") else array
    offsets = array.offsets.to_numpy(zero_copy_only=False).astype(np.int64)
    items = array.values.slice(offsets[0], offsets[-1] - offsets[0])
    return items, offsets - offsets[0]


def lists_of_numbers(values: Any) -> tuple[Any, Any]:
    """The numbers or times of lists, and how many each list has; a null is NaN."""
    array = _array(values)
    if not _is_list(array.type):
        raise TypeError(f"a pyarrow array of numbers per curve holds lists, not {array.type}")
    items, offsets = _lists(array)
    numbers = items.to_numpy(zero_copy_only=False)
    if pa.types.is_timestamp(items.type) and items.type.tz is not None:
        import pandas as pd

        numbers = pd.DatetimeIndex(numbers).tz_localize("UTC").tz_convert(items.type.tz)
    return numbers, np.diff(offsets)


#: Names of the coordinates of points in structs, in their order.
_NAMES = (("x", "lon", "long", "lng", "longitude"), ("y", "lat", "latitude"), ("z", "alt", "altitude", "ele", "elevation", "height"))


def _fields(names: list[str]) -> list[int]:
    """The fields of a struct that are x, y and z."""
    found = [[k for k, name in enumerate(names) if name.lower() in words] for words in _NAMES]
    other = [name for name in names if not any(name.lower() in words for words in _NAMES)]
    if other or any(len(own) > 1 for own in found) or not found[0] or not found[1]:
        raise ValueError(f"points have the fields {', '.join(names)}; they must be x, y and perhaps z, or lon, lat and perhaps alt")
    return [own[0] for own in found if own]


def ragged(curves: Any) -> Ragged[Any]:
    """The points of lists of points."""
    given = _array(curves)
    if not isinstance(given, pa.Array):
        raise TypeError(f"curves are a pyarrow {type(curves).__name__}: give its column of lists of points")
    if given.null_count:
        given = pa.array([[] if one is None else one for one in given.to_pylist()], given.type)
        nulls = ~np.asarray(_array(curves).is_valid())
    else:
        nulls = None
    items, offsets = _lists(given)
    kind = items.type
    if pa.types.is_struct(kind):
        names = [kind.field(k).name for k in range(kind.num_fields)]
        fields = _fields(names)
        columns = [items.field(k).to_numpy(zero_copy_only=False) for k in fields]
        coords = floats(np.stack(columns, axis=1), "coordinates")
    elif pa.types.is_fixed_size_list(kind):
        width = kind.list_size
        flat = items.values.slice(items.offset * width, len(items) * width)
        coords = floats(flat.to_numpy(zero_copy_only=False), "coordinates").reshape(len(items), width)
        names, fields = [], []
    elif _is_list(kind):
        flat, ends = _lists(items)
        width = _common_width(np.diff(ends), offsets)
        coords = floats(flat.to_numpy(zero_copy_only=False), "coordinates").reshape(len(items), width)
        names, fields = [], []
    else:
        raise TypeError(f"points are lists or structs of numbers in pyarrow, not {kind}")

    if items.null_count:
        coords = coords.copy()
        coords[~np.asarray(items.is_valid())] = np.nan
    back = partial(_back, names, fields, kind, given.type, nulls)
    return Ragged(coords, offsets, back)


def _back(
    names: list[str], fields: list[int], kind: Any, type_of_lists: Any, nulls: Any, coords: Floats, offsets: Offsets, closed: Any
) -> Any:
    if names:
        order = [fields.index(k) for k in range(len(names))]
        columns = [_numbers(coords[:, k], kind.field(names[i]).type) for i, k in enumerate(order)]
        points = pa.StructArray.from_arrays(columns, names=names)
    elif _is_list(kind):
        ends = np.arange(len(coords) + 1, dtype=np.int64) * coords.shape[1]
        points = _lists_of(_numbers(coords.reshape(-1), kind.value_type), ends, kind)
    else:
        points = pa.FixedSizeListArray.from_arrays(_numbers(coords.reshape(-1), kind.value_type), coords.shape[1])
    return _lists_of(points, offsets, type_of_lists, nulls)


def _numbers(values: Any, kind: Any) -> Any:
    """Coordinates, with 32 or 16 bits where the points had as many."""
    is_short = pa.types.is_float32(kind) or pa.types.is_float16(kind)
    return pa.array(np.ascontiguousarray(values, kind.to_pandas_dtype() if is_short else np.float64))


def _common_width(widths: Any, offsets: Offsets) -> int:
    """How many numbers a point has; 2 where there is no point."""
    width = int(widths[0]) if len(widths) else 2
    other = np.flatnonzero(widths != width)
    if len(other):
        curve = int(np.searchsorted(offsets, other[0], side="right")) - 1
        raise ValueError(
            f"curve {curve} has a point of {widths[other[0]]} numbers, and the first point has {width}: points are all of 2 "
            "numbers or all of 3"
        )
    return width


def _lists_of(items: Any, offsets: Offsets, kind: Any, nulls: Any = None) -> Any:
    """Lists of items, large or not as the type says, null where asked for."""
    large = pa.types.is_large_list(kind)
    mask = None if nulls is None else np.append(nulls, False)
    ends = pa.array(offsets, pa.int64() if large else pa.int32(), mask=mask)
    return (pa.LargeListArray if large else pa.ListArray).from_arrays(ends, items)
