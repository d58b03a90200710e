"""``FairBatch``: fits as a function of tables, for engines that spread tables over machines."""

from __future__ import annotations

import re
from typing import Any

#: The columns of the report, with the words of their types in pyarrow.
# Signed: Spark has no unsigned numbers.
_REPORT = {"status": "string", "message": "string", "energy": "float64", "iterations": "int32", "max_deviation": "float64"}


#: The number of a curve in its part of a table, which is nobody's number.
_OWN_NUMBER = re.compile(r"^curve \d+(, |: )")


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
    t : str, optional
        A column of lists of parameters.
    samples : dict
        How curves are sampled: the arguments of :meth:`Fit.sample`, such as ``{"count": 64}``.
    out : str
        The column that is added for the samples, which takes the place of one of the same name.
    report : bool
        Whether status, message, energy, iterations and max_deviation are added too.
    closed : bool or "auto", optional
        Which curves are closed.
    device, precision : str
        As of :meth:`Natural.fit`.

    Examples
    --------
    >>> import pyarrow as pa, faircurve as fc
    >>> table = pa.table({"name": ["a"], "points": pa.array([[[0, 0], [1, 1], [2, 0]]], pa.list_(pa.list_(pa.float64(), 2)))})
    >>> made = fc.FairBatch(fc.Natural(), samples={"count": 5})(table)
    >>> made.column_names[:4], len(made["points"][0])
    (['name', 'points', 'status', 'message'], 5)
    """

    def __init__(
        self,
        method: Any,
        points: str = "points",
        *,
        t: str | None = None,
        samples: dict[str, Any] | None = None,
        out: str | None = None,
        report: bool = True,
        closed: Any = None,
        device: str = "auto",
        precision: str = "auto",
    ) -> None:
        self.method, self.points, self.t, self.closed = method, points, t, closed
        self.samples = samples if samples is not None else {"per_span": 16}
        self.out, self.report = out or points, report
        self.device, self.precision = device, precision

    def __call__(self, table: Any) -> Any:
        """The table (or record batch) with the samples, and with what came of each curve."""
        import pyarrow as pa

        table = pa.Table.from_batches([table]) if isinstance(table, pa.RecordBatch) else table
        for column in filter(None, (self.points, self.t)):
            if column not in table.column_names:
                raise ValueError(f'there is no column "{column}": the table has {", ".join(table.column_names)}')
        curves = table[self.points].combine_chunks()
        options: dict[str, Any] = {"device": self.device, "precision": self.precision, "closed": self.closed}
        if self.t is not None:
            options["t"] = table[self.t].combine_chunks()
        fit = self.method.fit(curves, **options)
        table = _with_column(table, self.out, fit.sample(**self.samples))
        if self.report:
            columns = fit.report()
            for name, kind in _REPORT.items():
                values = columns[name]
                if name == "message":
                    values = [None if text is None else _OWN_NUMBER.sub("", text) for text in values]
                table = _with_column(table, name, pa.array(values, kind))
        return table

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


def _with_column(table: Any, name: str, column: Any) -> Any:
    if name in table.column_names:
        return table.set_column(table.column_names.index(name), name, column)
    return table.append_column(name, column)

