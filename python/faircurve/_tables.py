"""Curves of tables: tracks by rows of points, and ``FairBatch``, fits as a function of tables."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core, _times
from ._arrays import Floats, Ragged, floats, offsets_of, split, _list_back
from ._times import Clock

#: The columns of the report, with the words of their types in pyarrow.
# Signed: Spark has no unsigned numbers.
_REPORT = {"status": "string", "message": "string", "energy": "float64", "iterations": "int32", "max_deviation": "float64"}


#: The number of a curve in its part of a table, which is nobody's number.
_OWN_NUMBER = re.compile(r"^curve \d+(, |: )")


#: Names of longitudes and latitudes.
_DEGREES = ({"lon", "long", "lng", "longitude"}, {"lat", "latitude"})


@dataclass(frozen=True)
class _Table:
    """Tracks of a table: its columns in the order of points."""

    kind: str
    by: str | None
    names: list[Any]
    coords: tuple[str, ...]
    t: str | None
    seconds: Floats | None
    clock: Clock | None
    offsets: NDArray[np.int64]
    carry: dict[str, NDArray[Any]]

    def at(self, fit: Any, times: Any) -> Any:
        """See :meth:`Fit.at`."""
        knots = split(*fit._fit.knots())
        if isinstance(times, (str, int, float, np.timedelta64)) or hasattr(times, "total_seconds"):
            step = _times.step_of(times, self.clock)
            own = [_times.grid(k[0], k[-1], step) if len(k) else np.zeros(0) for k in knots]
        else:
            asked = np.sort(_times.parameters(times, self.clock, "times").reshape(-1))
            own = [asked[(asked >= k[0]) & (asked <= k[-1])] if len(k) else asked[:0] for k in knots]
        counts = [len(one) for one in own]
        flat, ends = np.concatenate(own) if own else np.zeros(0), offsets_of(counts)
        places, rates = (fit._fit.evaluate(flat, ends, nu).reshape(len(flat), -1) for nu in (0, 1))
        columns: dict[str, Any] = {}
        if self.by is not None:
            columns[self.by] = np.repeat(np.array(self.names, dtype=np.asarray(self.names).dtype), counts)
        columns[self.t or "t"] = flat if self.clock is None else self.clock.back(flat)
        degrees = self.is_in_degrees()
        for k, name in enumerate(self.coords):
            columns[name] = (places[:, k] + 180) % 360 - 180 if degrees and k == 0 else places[:, k]
        if degrees:
            rates[:, :2] *= _metres_per_degree(places[:, 1])
        columns["speed"] = np.sqrt((rates**2).sum(axis=1))
        columns["heading"] = np.degrees(np.arctan2(rates[:, 0], rates[:, 1])) % 360
        for name, values in self.carry.items():
            columns[name] = self._between(values, own)
        if self.kind == "polars":
            import polars

            return polars.DataFrame(columns)
        import pandas as pd

        return pd.DataFrame(columns)

    def is_in_degrees(self) -> bool:
        """Whether coordinates are longitudes and latitudes, by their names."""
        return all(name.lower() in words for name, words in zip(self.coords, _DEGREES))

    def _between(self, values: NDArray[Any], own: list[Floats]) -> Any:
        """A column at times: numbers in proportion to the time, others of the nearer point."""
        made = []
        for i, at in enumerate(own):
            a, b = int(self.offsets[i]), int(self.offsets[i + 1])
            t = self.seconds[a:b] if self.seconds is not None else np.arange(b - a, dtype=float)
            mine = values[a:b]
            if values.dtype.kind in "biuf" and values.dtype.kind != "b":
                made.append(np.interp(at, t, mine.astype(float)) if b > a else at)
                continue
            after = np.clip(np.searchsorted(t, at), 1, max(1, b - a - 1))
            before = after - 1
            made.append(mine[np.where(at - t[before] <= t[np.minimum(after, b - a - 1)] - at, before, np.minimum(after, b - a - 1))])
        return np.concatenate(made) if made else values[:0]


def _metres_per_degree(latitude: Floats) -> Floats:
    """Metres of a degree of longitude and of latitude on WGS84, a row each."""
    a, e2 = 6378137.0, 0.0066943799901413165
    sine, cosine = np.sin(np.radians(latitude)), np.cos(np.radians(latitude))
    root = np.sqrt(1 - e2 * sine**2)
    return np.radians(np.stack([a / root * cosine, a * (1 - e2) / root**3], axis=1))


def from_dataframe(table: Any, *, by: str | None = None, coords: Sequence[str] = ("x", "y"), t: str | None = None, carry: Sequence[str] = ()) -> Ragged:
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
        Columns that :meth:`Fit.at` interpolates.

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
    if len(coords) not in (2, 3):
        raise ValueError(f"coords has {len(coords)} columns; 2 or 3 are possible")
    wanted = [name for name in (by, *coords, t, *carry) if name is not None]
    missing = [name for name in wanted if name not in table.columns]
    if missing:
        raise ValueError(f'there is no column "{missing[0]}": the table has {", ".join(map(str, table.columns))}')
    n = len(table)
    if by is None:
        names, labels = [None], np.zeros(n, np.int64)
    else:
        keys = np.asarray(table[by].to_numpy())
        known = ~_is_missing(keys)
        found, first, inverse = np.unique(keys[known], return_index=True, return_inverse=True)
        place = np.empty(len(found), np.int64)
        place[np.argsort(first)] = np.arange(len(found))
        labels = np.full(n, -1, np.int64)
        labels[known] = place[inverse]
        names = found[np.argsort(first)].tolist()
    seconds, clock = (None, None) if t is None else _times.seconds_of(table[t] if kind != "polars" else table[t].to_numpy(), f'column "{t}"')
    if kind == "polars" and clock is not None and getattr(table[t].dtype, "time_zone", None):
        clock = Clock(clock.unit, table[t].dtype.time_zone, clock.span)
    order = np.lexsort((labels,) if seconds is None else (seconds, labels))
    order = order[labels[order] >= 0]
    counts = np.bincount(labels[order], minlength=len(names))
    columns = [floats(table[name].to_numpy(), f'column "{name}"')[order] for name in coords]
    own = None if seconds is None else seconds[order]
    offsets = offsets_of(counts)
    made = _Table(
        kind, by, names, tuple(coords), t, own, clock, offsets, {name: np.asarray(table[name].to_numpy())[order] for name in carry}
    )
    return Ragged(np.stack(columns, axis=1), offsets, _list_back, t=own, clock=clock, degrees=made.is_in_degrees(), table=made)


def _is_missing(keys: NDArray[Any]) -> NDArray[np.bool_]:
    return np.array([key is None or key != key for key in keys.tolist()], bool) if keys.dtype.kind in "Of" else np.zeros(len(keys), bool)


class FairBatch:
    """A fit as a function of tables: rows are curves, and so are the rows that come out.

    Dask, Ray, Spark and Daft call it with the parts of a large table. It can be pickled. Its device is opened in the process
    that calls it, once.

    Parameters
    ----------
    method
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
        method: Any,
        points: str = "points",
        *,
        t: str | None = None,
        weights: str | None = None,
        tangents: str | None = None,
        pinned: str | None = None,
        samples: dict[str, Any] | None = None,
        prefix: str = "fair_",
        report: bool = True,
        closed: Any = None,
        device: str = "auto",
        precision: str = "auto",
    ) -> None:
        if not callable(getattr(method, "fit", None)):
            raise TypeError(f"method is {method!r}; it must have a fit, as Natural() has")
        self.method, self.points, self.closed = method, points, closed
        self.columns = {"t": t, "weights": weights, "tangents": tangents, "pinned": pinned}
        self.samples = samples if samples is not None else {"per_span": 16}
        known = ("count", "per_span", "points", "spacing", "tolerance")
        if len(self.samples) != 1 or next(iter(self.samples)) not in known:
            raise ValueError(f"samples is {self.samples!r}; it must be one of {', '.join(known)}, as in {{'count': 64}}")
        self.prefix, self.report = prefix, report
        self.device, self.precision = device, precision

    def _device(self) -> str:
        if self.device != "auto":
            return self.device
        software = ("llvmpipe", "lavapipe", "swiftshader", "basic render")
        real = [name for name, *_ in _core.adapters() if not any(word in name.lower() for word in software)]
        return "gpu" if real else "cpu"

    def __call__(self, table: Any) -> Any:
        """The table (or record batch) with the samples, and with what came of each curve."""
        import pyarrow as pa

        table = pa.Table.from_batches([table]) if isinstance(table, pa.RecordBatch) else table
        given = {name: column for name, column in self.columns.items() if column is not None}
        for column in (self.points, *given.values()):
            if column not in table.column_names:
                raise ValueError(f'there is no column "{column}": the table has {", ".join(table.column_names)}')
        curves = table[self.points].combine_chunks()
        options: dict[str, Any] = {"device": self._device(), "precision": self.precision, "closed": self.closed}
        options.update({name: table[column].combine_chunks() for name, column in given.items()})
        fit = self.method.fit(curves, **options)
        samples, t = fit.sample(**self.samples, return_t=True)
        table = self._with(table, "points", samples)
        if "t" in given:
            kind = table[given["t"]].type
            table = self._with(table, "t", pa.array([list(one) for one in t], kind if pa.types.is_list(kind) else None))
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
