"""Curves of tables: tracks by rows of points, and ``FairBatch``, fits as a function of tables."""

from __future__ import annotations

import functools
import inspect
import numbers
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core, _times
from ._arrays import Floats, Ragged, floats, offsets_of, split, _list_back
from ._methods import Closed, Method, Precision
from ._times import Clock

#: The columns of the report, with the words of their types in pyarrow.
# Signed: Spark has no unsigned numbers.
_REPORT = {"status": "string", "message": "string", "energy": "float64", "iterations": "int32", "max_deviation": "float64"}


#: The number of a curve in its part of a table, which is nobody's number.
_OWN_NUMBER = re.compile(r"^curve \d+(, |: )")


#: Names of columns that are angles in degrees.
_ANGLES = ("cog", "course")

#: Names of longitudes and latitudes.
_DEGREES = ({"lon", "long", "lng", "longitude"}, {"lat", "latitude"})


@dataclass(frozen=True)
class _Table:
    """Tracks of a table: its columns in the order of points."""

    kind: str
    rows: int
    by: str | None
    names: Any
    coords: tuple[str, ...]
    t: str | None
    seconds: Floats | None
    clock: Clock | None
    offsets: NDArray[np.int64]
    carry: dict[str, NDArray[Any]]

    def at(self, fit: Any, times: Any) -> Any:
        """See :meth:`Fit.at`."""
        knots = split(*fit._fit.knots())
        of_tracks = [] if self.seconds is None else split(self.seconds, self.offsets)
        for given, k in zip(of_tracks, knots):
            if len(given) == len(k) and not np.array_equal(given, k, equal_nan=True):
                raise TypeError(f'the parameters of the fit are not the times of column "{self.t}": leave t out, and take a method in time')
        if isinstance(times, (str, numbers.Number, np.timedelta64)) or hasattr(times, "total_seconds"):
            step, origin = _times.step_of(times, self.clock), 0 if self.clock is None else self.clock.origin
            if (days := _times.days_of(times, self.clock)) and self.clock is not None:
                own = [_times.midnights(k[0], k[-1], days, self.clock) if len(k) else np.zeros(0) for k in knots]
            else:
                own = [_times.grid(k[0], k[-1], step, origin) if len(k) else np.zeros(0) for k in knots]
        else:
            asked = np.sort(_times.parameters(times, self.clock, "times").reshape(-1))
            own = [asked[(asked >= k[0]) & (asked <= k[-1])] if len(k) else asked[:0] for k in knots]
        counts = [len(one) for one in own]
        flat, ends = np.concatenate(own) if own else np.zeros(0), offsets_of(counts)
        places, rates = (fit._fit.evaluate(flat, ends, nu).reshape(len(flat), fit._dimension) for nu in (0, 1))
        columns: dict[str, Any] = {}
        if self.by is not None:
            which = np.repeat(np.arange(len(counts)), counts)
            columns[self.by] = self.names.take(which) if hasattr(self.names, "take") else self.names.gather(which)
        columns[self.t or "t"] = flat if self.clock is None else self._dated(flat, self.clock)
        degrees = self.is_in_degrees()
        for axis, name in enumerate(self.coords):
            columns[name] = (places[:, axis] + 180) % 360 - 180 if degrees and axis == 0 else places[:, axis]
        if degrees:
            rates[:, :2] *= _metres_per_degree(places[:, 1])
        columns["speed"] = np.sqrt((rates**2).sum(axis=1))
        columns["heading"] = np.degrees(np.arctan2(rates[:, 0], rates[:, 1])) % 360
        for name, values in self.carry.items():
            columns[name] = self._between(values, str(name).lower() in _ANGLES, own, knots)
        if self.kind == "polars":
            import polars

            return polars.DataFrame(columns)
        import pandas as pd

        return pd.DataFrame(columns)

    def _dated(self, seconds: Floats, clock: Clock) -> Any:
        """Times as the table has them."""
        if self.kind != "polars" or clock.zone is None:
            return clock.back(seconds)
        import polars

        dates = clock.plain(seconds)
        return polars.Series(dates.astype(f"M8[{'ns' if clock.unit in ('ns', 'ps', 'fs', 'as') else 'us'}]")).dt.replace_time_zone("UTC").dt.convert_time_zone(str(clock.zone))

    def of(self, tracks: list[int]) -> _Table:
        """Some of the tracks."""
        ends = [(int(self.offsets[i]), int(self.offsets[i + 1])) for i in tracks]
        points = np.concatenate([np.arange(a, b) for a, b in ends] or [np.zeros(0, np.int64)])
        carry = {name: values[points] for name, values in self.carry.items()}
        seconds = None if self.seconds is None else self.seconds[points]
        names = self.names.take(tracks) if hasattr(self.names, "take") else self.names.gather(tracks)
        return replace(self, names=names, seconds=seconds, offsets=offsets_of([b - a for a, b in ends]), carry=carry)

    def is_in_degrees(self) -> bool:
        """Whether coordinates are longitudes and latitudes, by their names."""
        return all(str(name).lower() in words for name, words in zip(self.coords, _DEGREES))

    def _between(self, values: NDArray[Any], is_angle: bool, own: list[Floats], knots: list[Floats]) -> Any:
        """A column at times: numbers in proportion to the time, angles the short way round, others from the nearer point."""
        made = []
        for i, at in enumerate(own):
            a, b = int(self.offsets[i]), int(self.offsets[i + 1])
            t = self.seconds[a:b] if self.seconds is not None else knots[i][: b - a]
            mine = values[a : a + len(t)]
            if len(t) < 2:
                made.append(mine[np.zeros(len(at), np.int64)])
            elif values.dtype.kind not in "iuf":
                after = np.clip(np.searchsorted(t, at), 1, len(t) - 1)
                made.append(mine[after - (at - t[after - 1] <= t[after] - at)])
            elif is_angle:
                made.append(np.interp(at, t, np.unwrap(mine.astype(float), period=360)) % 360)
            else:
                made.append(np.interp(at, t, mine.astype(float)))
        return np.concatenate(made) if made else values[:0]


def _metres_per_degree(latitude: Floats) -> Floats:
    """Metres of a degree of longitude and of latitude on WGS84, a row each."""
    a, e2 = 6378137.0, 0.0066943799901413165
    sine, cosine = np.sin(np.radians(latitude)), np.cos(np.radians(latitude))
    root = np.sqrt(1 - e2 * sine**2)
    return np.radians(np.stack([a / root * cosine, a * (1 - e2) / root**3], axis=1))


def from_dataframe(table: Any, *, by: str | None = None, coords: Sequence[str] = ("x", "y"), t: str | None = None, carry: Sequence[str] = ()) -> Ragged[list[Floats]]:
    """Tracks of a table whose rows are points, for the ``fit`` of every method.

    Parameters
    ----------
    table : pandas.DataFrame or polars.DataFrame
        Points, in any order if there are times.
    by : str, optional
        The column that says which track a point belongs to. Without it all are one track. Tracks come in the order in which they
        first appear. Rows without a value belong to none.
    coords : sequence of str
        Two or three columns of coordinates. Where they are called ``lon`` and ``lat``, speeds are in metres by a second.
    t : str, optional
        A column of times, dates or numbers, by which points of a track are sorted.
    carry : sequence of str
        Columns that :meth:`Fit.at` interpolates. Those called ``cog`` or ``course`` are angles in degrees.

    Examples
    --------
    >>> import pandas as pd, faircurve as fc
    >>> times = pd.date_range("2024-03-28 06:00", periods=4, freq="30min", tz="UTC")
    >>> table = pd.DataFrame({"ship": "a", "lon": [4.0, 4.1, 4.2, 4.3], "lat": [52.0, 52.1, 52.1, 52.2], "when": times, "sog": [9.0, 9, 8, 8]})
    >>> tracks = fc.from_dataframe(table, by="ship", coords=("lon", "lat"), t="when", carry=["sog"])
    >>> hourly = fc.Natural(surface="wgs84").fit(tracks).at("1h")
    >>> hourly[["when", "sog"]].values.tolist()[0]
    [Timestamp('2024-03-28 06:00:00+0000', tz='UTC'), 9.0]
    """
    kind = type(table).__module__.partition(".")[0]
    if kind not in ("pandas", "polars", "geopandas"):
        raise TypeError(f"a table is a data frame of pandas or polars, and not a {type(table).__name__}")
    for what, names in (("coords", coords), ("carry", carry)):
        if isinstance(names, str):
            raise TypeError(f'{what} is "{names}"; it must be a list of columns')
    if len(coords) not in (2, 3):
        raise ValueError(f"coords has {len(coords)} columns; 2 or 3 are possible")
    if isinstance(by, (list, tuple)):
        raise TypeError(f"by is {by!r}; it must be one column")
    taken = [name for name in (by, *coords, t, "speed", "heading") if name is not None]
    twice = next((name for k, name in enumerate(carry) if name in taken or name in list(carry)[:k]), None)
    if twice is not None:
        raise ValueError(f'carry has "{twice}", which comes out anyway: leave it out, or call the column by another name')
    wanted = [name for name in (by, *coords, t, *carry) if name is not None]
    missing = [name for name in wanted if name not in table.columns]
    if missing:
        raise ValueError(f'there is no column "{missing[0]}": the table has {", ".join(map(str, table.columns))}')
    n = len(table)
    labels, names = _labels(table, by, kind)
    seconds, clock = (None, None) if t is None else _times.seconds_of(table[t], f'column "{t}"')
    order = np.lexsort((labels,) if seconds is None else (seconds, labels))
    order = order[labels[order] >= 0]
    counts = np.bincount(labels[order], minlength=len(names))
    columns = [floats(table[name].to_numpy(), f'column "{name}"')[order] for name in coords]
    own = None if seconds is None else seconds[order]
    offsets = offsets_of(counts)
    made = _Table(
        kind, n, by, names, tuple(coords), t, own, clock, offsets, {name: np.asarray(table[name].to_numpy())[order] for name in carry}
    )
    return Ragged(np.stack(columns, axis=1), offsets, _list_back, t=own, clock=clock, degrees=made.is_in_degrees(), unit="degree" if made.is_in_degrees() else None, table=made, order=order)


def _labels(table: Any, by: str | None, kind: str) -> tuple[NDArray[np.int64], Any]:
    """The track of every row, −1 for none, and the names of tracks in the order in which they first appear."""
    if by is None:
        return np.zeros(len(table), np.int64), np.array([None])
    if kind == "polars":
        import polars

        names = table[by].drop_nulls().unique(maintain_order=True)
        places = polars.DataFrame({by: names, "_place": np.arange(len(names))})
        found = table.select(by).join(places, on=by, how="left", maintain_order="left")["_place"]
        return found.fill_null(-1).to_numpy().astype(np.int64), names
    import pandas as pd

    codes, names = pd.factorize(table[by])
    return codes.astype(np.int64), names


def _times_of_samples(t: list[Any], kind: Any) -> Any:
    """The parameters of samples as lists: times in microseconds or finer where points have times, else numbers."""
    import pyarrow as pa

    given = kind.value_type
    plain = [one.tz_convert(None).to_numpy() if hasattr(one, "tz_convert") else one for one in t]
    values = np.concatenate(plain) if plain else np.zeros(0)
    if pa.types.is_timestamp(given) or pa.types.is_duration(given):
        unit = given.unit if given.unit == "ns" else "us"
        own = pa.timestamp(unit, given.tz) if pa.types.is_timestamp(given) else pa.duration(unit)
        letter = "M" if pa.types.is_timestamp(given) else "m"
        flat = pa.array(values.astype(f"{letter}8[{unit}]").view(np.int64), pa.int64()).cast(own)
    elif pa.types.is_date(given):
        flat = pa.array(values.astype("M8[us]").view(np.int64), pa.int64()).cast(pa.timestamp("us"))
    else:
        flat = pa.array(values.astype(np.float64))
    large = pa.types.is_large_list(kind)
    ends = pa.array(offsets_of([len(one) for one in t]), pa.int64() if large else pa.int32())
    return (pa.LargeListArray if large else pa.ListArray).from_arrays(ends, flat)


@functools.cache
def _device() -> str:
    """The device for all parts of a table in this process: a GPU if there is one that is no software."""
    software = ("llvmpipe", "lavapipe", "swiftshader", "basic render")
    real = [name for name, *_ in _core.adapters() if not any(word in name.lower() for word in software)]
    return "gpu" if real else "cpu"


class FairBatch:
    """A fit as a function of tables: rows are curves, and so are the rows that come out.

    Dask, Ray, Spark and Daft call it with the parts of a large table. It can be pickled. Its device is opened in the process
    that calls it, once.

    Parameters
    ----------
    method : Method
        Such as ``Natural()`` or ``Fair({"bending": 1, "length": 0.1}, deviation=0.1)``.
    points : str
        The column of curves: lists of points, fixed-size lists or structs of numbers, as in GeoArrow.
    t, weights, tangents, pinned : str, optional
        Columns of lists of what the method takes of points.
    samples : dict
        How curves are sampled: the arguments of :meth:`Fit.sample`, such as ``{"count": 64}``.
    prefix : str
        What the names of all columns begin with that are added: points, t (the parameters of samples, where ``t`` is given), status,
        message, energy, iterations and max_deviation. No column of the table is replaced.
    report : bool
        Whether what came of each curve is added too.
    closed : bool or "auto", optional
        Which curves are closed.
    device, precision : str
        As of :meth:`Natural.fit`. The device is chosen once for all parts: "auto" is a GPU if there is one that is no software.

    Examples
    --------
    >>> import pyarrow as pa, faircurve as fc
    >>> table = pa.table({"name": ["a"], "points": pa.array([[[0, 0], [1, 1], [2, 0]]], pa.list_(pa.list_(pa.float64(), 2)))})
    >>> made = fc.FairBatch(fc.Natural(), samples={"count": 5})(table)
    >>> made.column_names[:4], len(made["fair_points"][0])
    (['name', 'points', 'fair_points', 'fair_status'], 5)
    """

    def __init__(
        self,
        method: Method,
        points: str = "points",
        *,
        t: str | None = None,
        weights: str | None = None,
        tangents: str | None = None,
        pinned: str | None = None,
        samples: Mapping[str, float] | None = None,
        prefix: str = "fair_",
        report: bool = True,
        closed: Closed = None,
        device: str = "auto",
        precision: Precision = "auto",
    ) -> None:
        if not callable(getattr(method, "fit", None)):
            raise TypeError(f"method is {method!r}; it must have a fit, as Natural() has")
        self.method: Method = method
        self.points: str = points
        self.closed: Closed = closed
        self.columns: dict[str, str | None] = {"t": t, "weights": weights, "tangents": tangents, "pinned": pinned}
        self.samples: Mapping[str, float] = samples if samples is not None else {"per_span": 16}
        known = ("count", "per_span", "points", "spacing", "tolerance")
        if len(self.samples) != 1 or next(iter(self.samples)) not in known:
            raise ValueError(f"samples is {self.samples!r}; it must be one of {', '.join(known)}, as in {{'count': 64}}")
        amount = next(iter(self.samples.values()))
        if not isinstance(amount, numbers.Number) or not amount > 0:
            raise ValueError(f"samples is {self.samples!r}; its number must be positive")
        arguments = inspect.signature(method.fit).parameters
        other = next((name for name, column in self.columns.items() if column is not None and name not in arguments), None)
        if other is not None:
            raise TypeError(f"{other} is no argument of {type(method).__name__}.fit: leave it out")
        self.prefix: str = prefix
        self.report: bool = report
        self.device: str = device
        self.precision: Precision = precision

    def __call__(self, table: Any) -> Any:
        """The table (or record batch) with the samples, and with what came of each curve."""
        import pyarrow as pa

        table = pa.Table.from_batches([table]) if isinstance(table, pa.RecordBatch) else table
        if not isinstance(table, pa.Table):
            raise TypeError(f"a part of a table is a pyarrow Table or RecordBatch, and not a {type(table).__name__}")
        given = {name: column for name, column in self.columns.items() if column is not None}
        for column in (self.points, *given.values()):
            if column not in table.column_names:
                raise ValueError(f'there is no column "{column}": the table has {", ".join(table.column_names)}')
        curves = table[self.points].combine_chunks()
        options: dict[str, Any] = {"device": _device() if self.device == "auto" else self.device, "precision": self.precision, "closed": self.closed}
        # Where one list is null all are, and the curve is invalid.
        lists = {name: table[column].combine_chunks() for name, column in given.items()}
        if any(column.null_count for column in (curves, *lists.values())):
            from pyarrow import compute as _compute

            compute: Any = _compute

            missing = functools.reduce(compute.or_, [column.is_null() for column in (curves, *lists.values())])
            curves = compute.if_else(missing, pa.scalar(None, curves.type), curves)
            lists = {name: compute.if_else(missing, pa.scalar(None, column.type), column) for name, column in lists.items()}
        options.update(lists)
        fit = self.method.fit(curves, **options)
        amount: dict[str, Any] = dict(self.samples)
        if "t" in given:
            samples, t = fit.sample(**amount, return_t=True)
            table = self._with(table, "points", samples)
            table = self._with(table, "t", _times_of_samples(t, table[given["t"]].type))
        else:
            table = self._with(table, "points", fit.sample(**amount))
        if self.report:
            columns = fit.report()
            for name, kind in _REPORT.items():
                values = columns[name]
                if name == "message":
                    values = [None if text is None else _OWN_NUMBER.sub("", text) for text in values]
                table = self._with(table, name, pa.array(values, kind))
        return table

    def _with(self, table: Any, name: str, column: Any) -> Any:
        if self.prefix + name in table.column_names:
            raise ValueError(f'the table has a column "{self.prefix + name}" already: give another prefix than {self.prefix!r}')
        return table.append_column(self.prefix + name, column)

    def schema(self, given: Any) -> Any:
        """The schema of what comes out of tables of a schema."""
        return self(given.empty_table()).schema

    def pandas(self, frame: Any) -> Any:
        """The same for a data frame whose columns are pyarrow's (``pandas.ArrowDtype``)."""
        import pandas as pd
        import pyarrow as pa

        made = self(pa.Table.from_pandas(frame, preserve_index=False))
        out = made.to_pandas(types_mapper=pd.ArrowDtype)
        out.index = frame.index
        return out
