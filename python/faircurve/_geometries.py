"""Lines, rings and polygons of shapely and GeoPandas."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import shapely

from ._arrays import Floats, Offsets, Ragged, floats, offsets_of

#: What a geometry was made of: nothing, one line, or the kind and its parts.
_Plan = Any


def ragged(geometries: Any) -> Ragged[Any]:
    """The lines and rings of geometries. Rings are closed, and so are lines whose last point repeats their first."""
    frame = geometries
    series = geometries.geometry if hasattr(geometries, "geometry") and hasattr(geometries, "crs") else None
    single = isinstance(geometries, shapely.Geometry)
    given = np.asarray([geometries] if single else (series if series is not None else geometries), object)
    lines: list[Any] = []
    rows: list[int] = []
    plan = []
    for row, geometry in enumerate(given):
        plan.append(_take(geometry, lines))
        rows.extend([row] * (len(lines) - len(rows)))
    has_z = shapely.has_z(lines) if lines else np.zeros(0, bool)
    if has_z.any() and not has_z.all():
        flat, high = rows[int(np.argmin(has_z))], rows[int(np.argmax(has_z))]
        raise ValueError(
            f"row {high} has heights and row {flat} has none: make all of one kind, by shapely.force_2d or shapely.force_3d"
        )
    dimension = 3 if has_z.any() else 2
    coords, at = shapely.get_coordinates(lines, include_z=dimension == 3, return_index=True)
    closed = np.array([line.is_ring or line.is_closed and len(line.coords) > 3 for line in lines], bool)
    crs = getattr(series, "crs", None)
    return Ragged(
        floats(coords, "coordinates").reshape(-1, dimension),
        offsets_of(np.bincount(at, minlength=len(lines))),
        partial(_back, plan, single, series, frame),
        closed,
        rows=np.array(rows, np.int64),
        index=None if series is None else series.index,
        t=_measures(lines),
        degrees=crs is not None and crs.is_geographic,
        unit=None if crs is None else crs.axis_info[0].unit_name,
        polygons=series is not None and len(lines) > 0 and all("Polygon" in one.geom_type for one in given if one is not None),
    )


def _measures(lines: list[Any]) -> Floats | None:
    """M of all points, where lines have it: the times of trajectories."""
    if not lines or not hasattr(shapely, "has_m") or not shapely.has_m(lines).all():
        return None
    return floats(shapely.get_coordinates(lines, include_m=True)[:, -1], "m")


def _take(geometry: Any, lines: list[Any]) -> _Plan:
    if geometry is None or geometry.is_empty:
        return geometry
    match geometry.geom_type:
        case "LineString" | "LinearRing":
            lines.append(geometry)
            return geometry.geom_type
        case "Polygon":
            rings = [geometry.exterior, *geometry.interiors]
            lines.extend(rings)
            return ("Polygon", len(rings))
        case "MultiLineString" | "MultiPolygon":
            return (geometry.geom_type, [_take(part, lines) for part in geometry.geoms])
        case other:
            raise TypeError(f"a {other} is no curve: give lines, rings and polygons")


def _line(rows: Iterator[tuple[int, int, bool]], coords: Floats) -> Floats:
    a, b, ring = next(rows)
    return np.concatenate([coords[a:b], coords[a : a + 1]]) if ring else coords[a:b]


def _make(step: _Plan, rows: Iterator[tuple[int, int, bool]], coords: Floats) -> Any:
    match step:
        case "LineString":
            return shapely.LineString(_line(rows, coords))
        case "LinearRing":
            return shapely.LinearRing(_line(rows, coords))
        case ("Polygon", int(count)):
            shell, *holes = [_line(rows, coords) for _ in range(count)]
            return shapely.Polygon(shell, holes)
        case ("MultiLineString", list(parts)):
            return shapely.MultiLineString([_make(part, rows, coords) for part in parts])
        case ("MultiPolygon", list(parts)):
            return shapely.MultiPolygon([_make(part, rows, coords) for part in parts])
        case other:
            return other


def _back(plan: list[_Plan], single: bool, series: Any, frame: Any, coords: Floats, offsets: Offsets, closed: Any) -> Any:
    rows = iter(zip(offsets[:-1].tolist(), offsets[1:].tolist(), closed.tolist()))
    made = [_make(step, rows, coords) for step in plan]
    if single:
        return made[0]
    if series is not None:
        new = type(series)(made, index=series.index, crs=series.crs, name=series.name)
        return new if frame is series or not hasattr(frame, "set_geometry") else frame.set_geometry(new)
    return made
