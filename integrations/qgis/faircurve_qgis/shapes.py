"""Geometries as coordinates of GeoJSON with all their digits, and back; distances of a layer."""

import json

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsGeometry,
    QgsLineString,
    QgsMultiLineString,
    QgsMultiPolygon,
    QgsPoint,
    QgsPolygon,
    QgsUnitTypes,
    QgsWkbTypes,
)

PARTS = {"MultiLineString": "LineString", "MultiPolygon": "Polygon"}
MULTI = {"MultiLineString": QgsMultiLineString, "MultiPolygon": QgsMultiPolygon}


def kind(layer_type):
    """The type of output: no arcs, no M."""
    return QgsWkbTypes.dropM(QgsWkbTypes.linearType(layer_type))


def _positions(line, has_z):
    return [[p.x(), p.y(), p.z()] if has_z else [p.x(), p.y()] for p in line.points()]


def _coordinates(shape, name, has_z):
    if name == "LineString":
        return _positions(shape, has_z)
    if name == "Polygon":
        if shape.exteriorRing() is None:
            return []
        rings = [shape.exteriorRing(), *(shape.interiorRing(k) for k in range(shape.numInteriorRings()))]
        return [_positions(ring, has_z) for ring in rings]
    return [_coordinates(shape.geometryN(k), PARTS[name], has_z) for k in range(shape.numGeometries())]


def to_json(geometry):
    """A line, polygon or multi-part as an object of GeoJSON; None where it is null, empty or of another kind."""
    if geometry.isNull() or geometry.isEmpty():
        return None
    shape = geometry.constGet()
    if QgsWkbTypes.isCurvedType(shape.wkbType()):
        shape = shape.segmentize()
    name = QgsWkbTypes.displayString(QgsWkbTypes.flatType(shape.wkbType()))
    if name not in ("LineString", "Polygon", *PARTS):
        return None
    return {"type": name, "coordinates": _coordinates(shape, name, shape.is3D())}


def _line(positions):
    return QgsLineString([QgsPoint(*position) for position in positions])


def _shape(name, coordinates):
    if name == "LineString":
        return _line(coordinates)
    if name == "Polygon":
        polygon = QgsPolygon()
        for k, ring in enumerate(coordinates):
            (polygon.addInteriorRing if k else polygon.setExteriorRing)(_line(ring))
        return polygon
    whole = MULTI[name]()
    for part in coordinates:
        whole.addGeometry(_shape(PARTS[name], part))
    return whole


def from_json(one):
    """A geometry of GeoJSON."""
    return QgsGeometry(_shape(one["type"], one["coordinates"]))


def is_geographic(crs):
    """Whether coordinates are longitudes and latitudes in degrees."""
    return crs.isValid() and crs.isGeographic() and crs.mapUnits() == QgsUnitTypes.DistanceDegrees


def units_per_metre(crs):
    """Units of a layer in a metre; 1 where its units are unknown or degrees, whose distances are in metres on the ground."""
    if not crs.isValid() or is_geographic(crs) or crs.mapUnits() == QgsUnitTypes.DistanceUnknownUnit:
        return 1.0
    return QgsUnitTypes.fromUnitToUnitFactor(QgsUnitTypes.DistanceMeters, crs.mapUnits())


def distance(metres, crs):
    """A distance as the program takes it: on the ground in metres, else in units of the layer."""
    return f"{metres!r}m" if is_geographic(crs) else repr(metres * units_per_metre(crs))


def write(path, features, crs):
    """Writes geometries, by the number of their feature, as GeoJSON."""
    plain = {} if is_geographic(crs) else {"crs": {"type": "name", "properties": {"name": "map units"}}}
    collection = {
        "type": "FeatureCollection",
        **plain,
        "features": [
            {"type": "Feature", "id": number, "properties": {"name": f"feature {number}"}, "geometry": geometry}
            for number, geometry in features.items()
        ],
    }
    with open(path, "w", encoding="utf-8") as file:
        json.dump(collection, file, allow_nan=False)


def read(path):
    """The geometries of a file of GeoJSON, by the number of their feature."""
    with open(path, encoding="utf-8") as file:
        return {one["id"]: one["geometry"] for one in json.load(file)["features"]}
