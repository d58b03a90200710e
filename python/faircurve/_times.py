"""Dates and times of day as parameters: seconds for the curves, and what was brought for people."""

from __future__ import annotations

import datetime
import re
import zoneinfo
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import Floats, Ragged, floats, per_point

#: Units of a second, and how many a second has. Coarser ones are whole seconds.
_PER_SECOND = {"ms": 10**3, "us": 10**6, "ns": 10**9, "ps": 10**12, "fs": 10**15, "as": 10**18}


#: Seconds of the units of steps, as pandas and polars call them.
_STEPS = {unit: seconds for units, seconds in (
    ("W w weeks week", 604800.0), ("D d days day", 86400.0), ("h H hours hour hr", 3600.0), ("min m T minutes minute", 60.0),
    ("s S seconds second sec", 1.0), ("ms milliseconds", 1e-3), ("us microseconds", 1e-6), ("ns nanoseconds", 1e-9),
) for unit in units.split()}  # fmt: skip


@dataclass(frozen=True)
class Clock:
    """What seconds stand for: dates with a zone or without, or spans of time. They are counted from ``origin``, in whole seconds
    since 1970, so that they keep their digits."""

    unit: str
    zone: Any = None
    span: bool = False
    origin: int = 0

    def plain(self, seconds: Floats, exact: bool = False) -> Any:
        """Seconds as ``datetime64`` or ``timedelta64`` of the unit, of microseconds at least if they are not ``exact``; of a zone in UTC."""
        unit = self.unit if exact or self.unit in ("us", "ns", "ps", "fs", "as") else "us"
        own = unit if unit in _PER_SECOND else "s"
        per = _PER_SECOND.get(own, 1)
        known = np.isfinite(seconds)
        whole = np.floor(np.where(known, seconds, 0.0))
        ticks = (whole.astype(np.int64) + self.origin) * per + np.rint((np.where(known, seconds, 0.0) - whole) * per).astype(np.int64)
        kind = "m" if self.span else "M"
        dates = np.where(known, ticks.view(f"{kind}8[{own}]"), np.array("NaT", f"{kind}8[{own}]"))
        return dates.astype(f"{kind}8[{unit}]")

    def back(self, seconds: Floats, exact: bool = False) -> Any:
        """Seconds as :meth:`plain` has them; with a zone as pandas' ``DatetimeIndex``."""
        dates = self.plain(seconds, exact)
        if self.zone is None:
            return dates
        import pandas as pd

        return pd.DatetimeIndex(dates).tz_localize("UTC").tz_convert(self.zone)


def _of_objects(array: NDArray[Any], what: str) -> tuple[NDArray[Any], Any]:
    """Dates and spans of Python and pandas as ``datetime64`` or ``timedelta64``, and their zone; other objects as they are."""
    known = [one for one in array.flat if one is not None and one == one and type(one).__name__ not in ("NAType", "NaTType")]
    if not known or not isinstance(known[0], (datetime.date, datetime.timedelta)):
        return array, None
    span = isinstance(known[0], datetime.timedelta)
    zones = {getattr(one, "tzinfo", None) is not None for one in known}
    if len(zones) > 1:
        raise ValueError(f"{what} has dates with a zone and without")
    zone = getattr(known[0], "tzinfo", None)

    def exact(one: Any) -> Any:
        if one is None or one != one or type(one).__name__ in ("NAType", "NaTType"):
            return np.timedelta64("NaT") if span else np.datetime64("NaT")
        own = one if zone is None else one.astimezone(datetime.timezone.utc).replace(tzinfo=None)
        return own.to_numpy() if hasattr(own, "to_numpy") else (np.timedelta64(own) if span else np.datetime64(own))

    made = np.array([exact(one) for one in array.flat])
    return made.reshape(array.shape), zone


def seconds_of(values: Any, what: str, clock: Clock | None = None) -> tuple[Floats, Clock | None]:
    """Dates, or spans of time, as seconds since the origin of a clock, by default the first date, with their own clock.
    Numbers stay as they are. NaT is NaN."""
    zone = None
    if type(values).__module__.partition(".")[0] == "pandas":
        own = getattr(values, "dt", values)
        zone = getattr(own, "tz", None)
        values = (own.tz_convert(None) if zone is not None else values).to_numpy()
    if type(values).__module__.partition(".")[0] == "polars":
        zone, values = getattr(values.dtype, "time_zone", None), values.to_numpy()
    if isinstance(values, np.ma.MaskedArray) and values.dtype.kind in "mM":
        values = np.where(np.ma.getmaskarray(values), np.array("NaT", values.dtype), values.data)
    array = np.asarray(values) if not isinstance(values, np.ma.MaskedArray) else values
    if array.dtype == object:
        array, zone = _of_objects(array, what)
    if array.dtype.kind not in "mM":
        return floats(values, what), None
    unit, steps = np.datetime_data(array.dtype)
    if unit == "generic":
        raise ValueError(f"{what} holds NaT alone")
    own_unit = unit if unit in _PER_SECOND else "s"
    whole, rest = np.divmod(array.astype(f"{array.dtype.kind}8[{own_unit}]").view(np.int64), _PER_SECOND.get(unit, 1))
    known, span = ~np.isnat(array), array.dtype.kind == "m"
    origin = clock.origin if clock is not None else 0 if span or not known.any() else int(whole[known].flat[0])
    seconds = np.where(known, (whole - origin) + rest / _PER_SECOND.get(unit, 1), np.nan)
    return np.ascontiguousarray(seconds, np.float64), Clock(unit if steps == 1 else own_unit, zone, span, origin)


def times(values: Any, curves: Ragged[Any]) -> tuple[Floats, Clock | None]:
    """The parameters of all points, and their clock if they are dates."""
    clocks: list[Clock | None] = []

    def converted(one: Any, what: str) -> Floats:
        first = next((clock for clock in clocks if clock is not None), None)
        seconds, clock = seconds_of(one, what, first)
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
    return flat, None if first is None else Clock(finest, first.zone, first.span, first.origin)


def parameters(values: Any, clock: Clock | None, what: str = "u") -> Floats:
    """Parameters that a fit is asked at: dates of any unit where it has dates; numbers are seconds since 1970 then."""
    seconds, own = seconds_of(values, what, clock)
    if own is None:
        return seconds if clock is None else seconds - clock.origin
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
            parts = re.findall(r"(\d*\.?\d*)\s*([a-zA-Z]+)", every)
            known = parts and "".join(a + b for a, b in parts) == re.sub(r"[\s,]", "", every) and all(unit in _STEPS for _, unit in parts)
            if not known:
                raise ValueError(f"times is {every!r}, which is no step such as '1h', '90s' or '1h30min'")
            return step_of(sum(float(number or 1) * _STEPS[unit] for number, unit in parts), None)
        step = every / (np.timedelta64(1, "s") if isinstance(every, np.timedelta64) else datetime.timedelta(seconds=1))
    else:
        step = float(every)
    if not step > 0 or not np.isfinite(step):
        raise ValueError(f"a step is {every}; it must be positive")
    return float(step)


def days_of(every: Any, clock: Clock | None) -> int:
    """How many whole days a step is, where days are those of a zone, which may have 23 or 25 hours; 0 where it is none."""
    if clock is None or clock.zone is None or clock.span or not isinstance(every, str):
        return 0
    found = re.fullmatch(r"\s*(\d*)\s*(D|d|day|days)\s*", every)
    return int(found[1] or 1) if found else 0


def midnights(first: float, last: float, days: int, clock: Clock) -> NDArray[np.float64]:
    """The midnights of a zone from one time to another, every so many days since 1970."""
    if not (np.isfinite(first) and np.isfinite(last)):
        return np.zeros(0)
    zone = zoneinfo.ZoneInfo(clock.zone) if isinstance(clock.zone, str) else clock.zone
    utc, epoch = datetime.timezone.utc, datetime.date(1970, 1, 1).toordinal()
    ordinal = datetime.datetime.fromtimestamp(clock.origin + int(np.floor(first)), zone).toordinal() - epoch
    found: list[float] = []
    for day in range(ordinal - ordinal % days, ordinal + int((last - first) / 86400) + 3, days):
        midnight = datetime.datetime.fromordinal(day + epoch).replace(tzinfo=zone).astimezone(utc)
        found.append(midnight.timestamp() - clock.origin)
    times = np.array(found)
    return times[(times >= first) & (times <= last)]


def grid(first: float, last: float, step: float, origin: int = 0) -> NDArray[np.float64]:
    """The multiples of a step from one time to another, of seconds that are counted from an origin."""
    if not (np.isfinite(first) and np.isfinite(last)):
        return np.zeros(0)
    rest = float(np.mod(float(origin), step))
    return step * np.arange(np.ceil((first + rest) / step - 1e-9), np.floor((last + rest) / step + 1e-9) + 1) - rest + 0.0
