"""Dates and times of day as parameters: seconds for the curves, and what was brought for people."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import Floats, Ragged, floats, per_point

#: Units of a second, and how many a second has. Coarser ones are whole seconds.
_PER_SECOND = {"ms": 10**3, "us": 10**6, "ns": 10**9, "ps": 10**12, "fs": 10**15, "as": 10**18}


@dataclass(frozen=True)
class Clock:
    """What seconds stand for: dates with a zone or without, or spans of time."""

    unit: str
    zone: Any = None
    span: bool = False

    def back(self, seconds: Floats) -> Any:
        """Seconds as ``datetime64`` or ``timedelta64`` of the unit; with a zone as pandas' ``DatetimeIndex``."""
        per = _PER_SECOND.get(self.unit, 1)
        known = np.isfinite(seconds)
        whole = np.floor(np.where(known, seconds, 0.0))
        ticks = whole.astype(np.int64) * per + np.rint((np.where(known, seconds, 0.0) - whole) * per).astype(np.int64)
        kind = "m" if self.span else "M"
        own = self.unit if self.unit in _PER_SECOND else "s"
        dates = np.where(known, ticks.view(f"{kind}8[{own}]"), np.array("NaT", f"{kind}8[{own}]"))
        dates = dates.astype(f"{kind}8[{self.unit}]")
        if self.zone is None:
            return dates
        import pandas as pd

        return pd.DatetimeIndex(dates).tz_localize("UTC").tz_convert(self.zone)


def seconds_of(values: Any, what: str) -> tuple[Floats, Clock | None]:
    """Dates, or spans of time, as seconds since 1970, with their clock; numbers as they are. NaT is NaN."""
    zone = None
    if type(values).__module__.partition(".")[0] == "pandas":
        own = getattr(values, "dt", values)
        zone = getattr(own, "tz", None)
        values = (own.tz_convert(None) if zone is not None else values).to_numpy()
    array = np.asarray(values)
    if array.dtype == object and array.size > 0 and isinstance(array.flat[0], datetime.datetime):
        zone = array.flat[0].tzinfo
        if any((one.tzinfo is None) != (zone is None) for one in array.flat):
            raise ValueError(f"{what} has dates with a zone and without")
        utc = [one if zone is None else one.astimezone(datetime.timezone.utc).replace(tzinfo=None) for one in array.flat]
        array = np.array(utc, "M8[us]").reshape(array.shape)
    if array.dtype.kind not in "mM":
        return floats(values, what), None
    unit, steps = np.datetime_data(array.dtype)
    if unit == "generic":
        raise ValueError(f"{what} holds NaT alone")
    exact = array.astype(f"{array.dtype.kind}8[{unit if unit in _PER_SECOND else 's'}]")
    per = _PER_SECOND.get(unit, 1)
    whole, rest = np.divmod(exact.view(np.int64), per)
    seconds = np.where(np.isnat(array), np.nan, whole + rest / per)
    return np.ascontiguousarray(seconds, np.float64), Clock(unit if steps == 1 else "s", zone, array.dtype.kind == "m")


def times(values: Any, curves: Ragged) -> tuple[Floats, Clock | None]:
    """The parameters of all points, and their clock if they are dates."""
    clocks: list[Clock | None] = []

    def converted(one: Any, what: str) -> Floats:
        seconds, clock = seconds_of(one, what)
        clocks.append(clock)
        return seconds

    flat = per_point(values, curves, "t", converted)
    first = clocks[0] if clocks else None
    for clock in clocks:
        if (clock is None) != (first is None) or first is not None and clock is not None and clock.span != first.span:
            raise ValueError("t has dates for some curves and numbers for others: give one kind")
        if first is not None and clock is not None and (clock.zone is None) != (first.zone is None):
            raise ValueError("t has dates with a zone for some curves and without for others: give one kind")
    units = [clock.unit for clock in clocks if clock is not None]
    order = ["D", "h", "m", "s", *_PER_SECOND]
    finest = max(units, key=lambda unit: order.index(unit) if unit in order else 0, default="s")
    return flat, None if first is None else Clock(finest, first.zone, first.span)


def parameters(values: Any, clock: Clock | None, what: str = "u") -> Floats:
    """Parameters that a fit is asked at: dates of any unit where it has dates; numbers are seconds then."""
    seconds, own = seconds_of(values, what)
    if own is None:
        return seconds
    if clock is None or clock.span != own.span:
        kind = "numbers" if clock is None else "spans of time" if clock.span else "dates"
        raise TypeError(f"{what} holds {'spans of time' if own.span else 'dates'}, and the parameters of the fit are {kind}")
    if (clock.zone is None) != (own.zone is None):
        raise TypeError(f"{what} has {'no' if own.zone is None else 'a'} zone, and the times of the fit have {'one' if own.zone is None else 'none'}")
    return seconds


def step_of(every: Any, clock: Clock | None) -> float:
    """A step in time, such as ``"1h"``, a ``timedelta`` or a number, as seconds or units of the parameter."""
    if isinstance(every, (str, datetime.timedelta)) or isinstance(every, np.timedelta64):
        if clock is None:
            raise TypeError(f"a step of {every} is one in time, and the parameters of the fit are numbers")
        if isinstance(every, str):
            import pandas as pd

            every = pd.Timedelta(every)
        step = every / (np.timedelta64(1, "s") if isinstance(every, np.timedelta64) else datetime.timedelta(seconds=1))
    else:
        step = float(every)
    if not step > 0 or not np.isfinite(step):
        raise ValueError(f"a step is {every}; it must be positive")
    return float(step)


def grid(first: float, last: float, step: float) -> NDArray[np.float64]:
    """The multiples of a step from one time to another."""
    return step * np.arange(np.ceil(first / step - 1e-9), np.floor(last / step + 1e-9) + 1) + 0.0
