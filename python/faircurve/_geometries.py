"""Lines, rings and polygons of shapely and GeoPandas."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from ._arrays import Floats, Offsets, Ragged, floats, offsets_of


def ragged(geometries: Any) -> Ragged:
    """The lines and rings of geometries. Rings are closed."""
    frame = geometries
    series = geometries.geometry if hasattr(geometries, "geometry") and hasattr(geometries, "crs") else None
    single = isinstance(geometries, shapely.Geometry)
    given = np.asarray([geometries] if single else (series if series is not None else geometries), object)
    lines: list[Any] = []
    #: What is made of so many of the next lines.
    plan: list[Any] = []

    def take(geometry: Any) -> Any:
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
                return (geometry.geom_type, [take(part) for part in geometry.geoms])
            case other:
                raise TypeError(f"a {other} is no curve: give lines, rings and polygons")

    plan = [take(geometry) for geometry in given]
    dimension = 3 if any(line.has_z for line in lines) else 2
    arrays = [shapely.get_coordinates(line, include_z=dimension == 3) for line in lines]
    closed = np.array([line.geom_type == "LinearRing" for line in lines], bool)
    coords = floats(np.concatenate(arrays), "coordinates") if arrays else np.zeros((0, dimension))

    def back(coords: Floats, offsets: Offsets, closed: Any) -> Any:
        rows = iter(zip(offsets[:-1].tolist(), offsets[1:].tolist(), closed.tolist()))

        def line() -> Floats:
            a, b, ring = next(rows)
            return np.concatenate([coords[a:b], coords[a : a + 1]]) if ring else coords[a:b]

        def make(step: Any) -> Any:
            match step:
                case "LineString":
                    return shapely.LineString(line())
                case "LinearRing":
                    return shapely.LinearRing(line())
                case ("Polygon", int(count)):
                    shell, *holes = [line() for _ in range(count)]
                    return shapely.Polygon(shell, holes)
                case ("MultiLineString", list(parts)):
                    return shapely.MultiLineString([make(part) for part in parts])
                case ("MultiPolygon", list(parts)):
                    return shapely.MultiPolygon([make(part) for part in parts])
                case other:
                    return other

        made = [make(step) for step in plan]
        if single:
            return made[0]
        if series is not None:
            new = type(series)(made, index=series.index, crs=series.crs, name=series.name)
            return new if frame is series or not hasattr(frame, "set_geometry") else frame.set_geometry(new)
        return made

    return Ragged(coords, offsets_of([len(array) for array in arrays]), back, closed)
