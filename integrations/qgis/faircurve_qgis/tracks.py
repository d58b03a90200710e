"""Smooth tracks in time."""

import csv
import math
import tempfile
from collections import Counter
from pathlib import Path

from qgis.core import (
    QgsFeature,
    QgsFeatureRequest,
    QgsFeatureSink,
    QgsField,
    QgsFields,
    QgsGeometry,
    QgsLineString,
    QgsPoint,
    QgsProcessing,
    QgsProcessingException,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterFeatureSink,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterField,
    QgsProcessingParameterNumber,
    QgsWkbTypes,
)
from qgis.PyQt.QtCore import QDate, QDateTime, Qt, QTime, QVariant

from . import shapes
from .base import ANY_GEOMETRY, Algorithm, metres
from .program import run

#: Fields that hold angles in degrees, by their names.
ANGLES = ("cog", "course", "heading")


class Clock:
    """Dates as seconds since 1970 and back, in the zone of the first. Dates without a zone are taken as they are written."""

    def __init__(self):
        self.first = None

    def seconds(self, value):
        if isinstance(value, QDate):
            value = QDateTime(value, QTime(0, 0))
        if self.first is None:
            self.first = value
        if self.first.timeSpec() == Qt.LocalTime:
            value = QDateTime(value.date(), value.time(), Qt.UTC)
        return value.toMSecsSinceEpoch() / 1000

    def date(self, seconds):
        made = QDateTime.fromMSecsSinceEpoch(round(seconds * 1000), Qt.UTC)
        if self.first.timeSpec() == Qt.LocalTime:
            return QDateTime(made.date(), made.time())
        if self.first.timeSpec() == Qt.OffsetFromUTC:
            return made.toOffsetFromUtc(self.first.offsetFromUtc())
        return made.toTimeZone(self.first.timeZone()) if self.first.timeSpec() == Qt.TimeZone else made


#: Numbers that are left empty or positive.
UNITS = {"WITHIN": "m", "EVERY": "s", "GAP": "s", "MAX_SPEED": "m/s", "STOP_RADIUS": "m", "STOP_DURATION": "s"}


class SmoothTracks(Algorithm):
    NAME, TITLE, TAGS = "smoothtracks", "Smooth tracks in time", "gps,ais,trajectory,track,speed,heading,resample,interpolate"
    SUMMARY = "Smooths tracks of points with times, and samples them with speed and heading."
    HELP = """Smooths tracks in time. Points of a layer that have the same track field are one track, in the order of their times.

The output has points along the smooth tracks, with the track, its part where it is cut, the time, the speed in m/s, the heading in degrees from north and the fields to keep: numbers are interpolated, angles (cog, course, heading) go the short way round, and other values are those of the nearest point. Points at the time of another one, and points without a geometry, a track or a time, are left out and counted. The CRS stays. Layers of longitudes and latitudes are fitted on the ellipsoid WGS84.

Lines of the tracks, if asked for, have M values: seconds since 1970-01-01. Those that cross ±180° run on past it.

<b>Within</b>: no point is missed by more than this, in metres. If it is empty, the noise of every track says how smooth it becomes.
<b>A point every</b>: in seconds. The times are multiples of it within the times of the track. If it is empty, there is a point at every time of the input.
<b>Cut at gaps</b>: tracks are cut where no point follows for as many seconds. The field <i>part</i> counts the pieces.
<b>Largest speed</b>: in m/s. Points that cannot be reached from the others at that speed are left out.
<b>Drop outliers</b>: leaves points out that lie 5 times as far as noise from where the points before and after lead.
<b>Stops</b>: while a track stays within the radius, in metres, for the duration, in seconds, it is held at one place."""

    def initAlgorithm(self, configuration=None):
        any_field, date = QgsProcessingParameterField.Any, QgsProcessingParameterField.DateTime
        seconds, optional = QgsProcessingParameterNumber.Double, {"optional": True}

        def number(name, description):
            return QgsProcessingParameterNumber(name, description, seconds, **optional)

        self.addParameter(QgsProcessingParameterFeatureSource("INPUT", "Points", [QgsProcessing.TypeVectorPoint]))
        self.addParameter(QgsProcessingParameterField("TIME", "Time", None, "INPUT", date))
        self.addParameter(QgsProcessingParameterField("TRACK", "Track", None, "INPUT", any_field, **optional))
        self.addParameter(metres("WITHIN", "Within", **optional))
        self.addParameter(number("EVERY", "A point every (seconds)"))
        self.addParameter(number("GAP", "Cut at gaps longer than (seconds)"))
        self.addParameter(
            QgsProcessingParameterField("KEEP", "Fields to keep", None, "INPUT", any_field, allowMultiple=True, **optional)
        )
        for parameter in (
            number("MAX_SPEED", "Largest speed (m/s)"),
            QgsProcessingParameterBoolean("ROBUST", "Drop outliers", False),
            metres("STOP_RADIUS", "Radius of stops", **optional),
            number("STOP_DURATION", "Duration of stops (seconds)"),
        ):
            parameter.setFlags(parameter.flags() | QgsProcessingParameterDefinition.FlagAdvanced)
            self.addParameter(parameter)
        self.addParameter(QgsProcessingParameterFeatureSink("OUTPUT", "Smooth points", QgsProcessing.TypeVectorPoint))
        lines = QgsProcessingParameterFeatureSink(
            "LINES", "Smooth tracks", QgsProcessing.TypeVectorLine, optional=True, createByDefault=False
        )
        self.addParameter(lines)

    def positive(self, parameters, name, context, unit):
        """A number that is positive; None where there is none."""
        if parameters.get(name) is None:
            return None
        value = self.parameterAsDouble(parameters, name, context)
        if not 0 < value < float("inf"):
            what = self.parameterDefinition(name).description()
            raise QgsProcessingException(f"“{what}” is {value:g} {unit}; it must be more than 0: give a number, or leave it empty.")
        return value

    def arguments(self, parameters, context, crs):
        words = []
        given = {name: self.positive(parameters, name, context, unit) for name, unit in UNITS.items()}
        if given["WITHIN"] is not None:
            words += ["--within", shapes.distance(given["WITHIN"], crs)]
        if given["GAP"] is not None:
            words += ["--gap", repr(given["GAP"])]
        if given["MAX_SPEED"] is not None:
            words += ["--max-speed", repr(given["MAX_SPEED"] * shapes.units_per_metre(crs))]
        if self.parameterAsBool(parameters, "ROBUST", context):
            words += ["--robust"]
        if (given["STOP_RADIUS"] is None) != (given["STOP_DURATION"] is None):
            raise QgsProcessingException("Stops need a “Radius of stops” and a “Duration of stops”: give both, or none.")
        if given["STOP_RADIUS"] is not None:
            words += ["--stops", f"{given['STOP_RADIUS'] * shapes.units_per_metre(crs)!r},{given['STOP_DURATION']!r}"]
        return words + (["--samples", "1"] if given["EVERY"] is None else ["--every", repr(given["EVERY"])])

    def processAlgorithm(self, parameters, context, feedback):
        source = self.parameterAsSource(parameters, "INPUT", context)
        if source is None:
            raise QgsProcessingException(self.invalidSourceError(parameters, "INPUT"))
        if not source.sourceCrs().isValid():
            feedback.pushWarning("The layer has no CRS: distances are in map units.")
        words = self.arguments(parameters, context, source.sourceCrs())
        time = self.parameterAsFields(parameters, "TIME", context)[0]
        by = (self.parameterAsFields(parameters, "TRACK", context) or [None])[0]
        keep = [name for name in self.parameterAsFields(parameters, "KEEP", context) if name not in (time, by)]
        table = _Table(source, time, by, keep)

        point_type, line_type = QgsWkbTypes.Point, QgsWkbTypes.LineStringM
        if table.has_z:
            point_type, line_type = QgsWkbTypes.PointZ, QgsWkbTypes.LineStringZM
        sink, output = self.parameterAsSink(parameters, "OUTPUT", context, table.point_fields, point_type, table.crs)
        if sink is None:
            raise QgsProcessingException(self.invalidSinkError(parameters, "OUTPUT"))
        lines, lines_output = self.parameterAsSink(parameters, "LINES", context, table.line_fields, line_type, table.crs)
        made = {"OUTPUT": output, **({} if lines is None else {"LINES": lines_output})}

        with tempfile.TemporaryDirectory() as folder:
            before, after = "before.csv", "after.csv"
            if not table.write(Path(folder) / before, feedback):
                return made
            command = ["track", before, "-o", after, "--columns", table.columns(), "--carry", table.carried()]
            if not run([*command, "--write", "speed,heading", *words], feedback, folder, share=0.8):
                return made
            table.read(Path(folder) / after, sink, lines, feedback)
        return made


class _Table:
    """The points of a layer as a table, and the layers that its samples become."""

    def __init__(self, source, time, by, keep):
        self.source, self.time, self.by = source, time, by
        self.crs, self.has_z = source.sourceCrs(), QgsWkbTypes.hasZ(source.wkbType())
        self.clock, self.features, self.tracks, self.names = Clock(), [], {}, set()
        given = source.fields()
        self.kept = [given.field(name) for name in keep]
        names = {name.lower() for name in (time, by, *keep) if name}

        def free(name):
            return f"smooth_{name}" if name in names else name

        track = [] if by is None else [QgsField(given.field(by))]
        track.append(QgsField(free("part"), QVariant.String))
        self.point_fields, self.line_fields = QgsFields(), QgsFields()
        numbers = [QgsField(field.name(), QVariant.Double) if field.isNumeric() else QgsField(field) for field in self.kept]
        rates = [QgsField(free(name), QVariant.Double) for name in ("speed", "heading")]
        for field in [*track, QgsField(time, QVariant.DateTime), *rates, *numbers]:
            self.point_fields.append(field)
        for field in [*track, QgsField(free("begin"), QVariant.DateTime), QgsField(free("end"), QVariant.DateTime)]:
            self.line_fields.append(field)

    def columns(self):
        x, y = ("lon", "lat") if shapes.is_geographic(self.crs) else ("x", "y")
        return f"curve=curve,x={x},y={y},t=t" + (",z=z" if self.has_z else "")

    def carried(self):
        numbers = {k: field.name().lower() for k, field in enumerate(self.kept) if field.isNumeric()}
        return ",".join(["row:nearest", *(f"c{k}:angle" if name in ANGLES else f"c{k}" for k, name in numbers.items())])

    def name(self, track):
        """What messages call another track: its value, with a number where that is the text of another value."""
        text = "0" if track is None else str(track)
        name = f"{text} ({len(self.tracks)})" if text in self.names or not text.strip() else text
        self.names.add(name)
        return name

    def write(self, path, feedback):
        """Writes all points that can be used; returns whether there are any, and the run is not cancelled."""
        lacks = Counter()
        with open(path, "w", encoding="utf-8", newline="") as file:
            rows = csv.writer(file)
            rows.writerow([*(one.partition("=")[2] for one in self.columns().split(",")), "row", *(f"c{k}" for k in range(len(self.kept)))])
            for feature in self.source.getFeatures(QgsFeatureRequest(), ANY_GEOMETRY):
                if feedback.isCanceled():
                    return False
                geometry, when = feature.geometry(), feature[self.time]
                track = None if self.by is None else feature[self.by]
                if geometry.isNull() or geometry.isEmpty():
                    lacks["geometry"] += 1
                elif _is_null(when) or not when.isValid():
                    lacks["time"] += 1
                elif self.by is not None and _is_null(track):
                    lacks["track"] += 1
                else:
                    name = self.tracks.get(track) or self.tracks.setdefault(track, self.name(track))
                    kept = ["" if _is_null(feature[f.name()]) or not f.isNumeric() else repr(float(feature[f.name()])) for f in self.kept]
                    for point in geometry.constGet().vertices():
                        place = [repr(point.x()), repr(point.y())]
                        height = [repr(point.z())] if self.has_z else []
                        rows.writerow([name, *place, repr(self.clock.seconds(when)), *height, len(self.features), *kept])
                    self.features.append(feature)
        for what, count in lacks.items():
            feedback.pushWarning(f"{count} {'point is' if count == 1 else 'points are'} left out, without a {what}.")
        feedback.setProgress(10)
        return bool(self.features)

    def read(self, path, sink, lines, feedback):
        """Writes samples to the layers."""
        metres_per_unit = 1 / shapes.units_per_metre(self.crs)
        pieces = {}
        with open(path, encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                if feedback.isCanceled():
                    return
                nearest, seconds = self.features[int(row["row"])], float(row["t"])
                name = self.tracks[None if self.by is None else nearest[self.by]]
                part = row["curve"][len(name) + 1 :] or None
                place = [float(row[axis]) for axis in ("xyz" if self.has_z else "xy")]
                point = QgsFeature(self.point_fields)
                point.setGeometry(QgsGeometry(QgsPoint(*place)))
                track = ([] if self.by is None else [nearest[self.by]]) + [part]
                speed, heading = _number(row["speed"]), _number(row["heading"])
                values = [
                    _number(row[f"c{k}"]) if field.isNumeric() else nearest[field.name()] for k, field in enumerate(self.kept)
                ]
                point.setAttributes(
                    [*track, self.clock.date(seconds), None if speed is None else speed * metres_per_unit, heading, *values]
                )
                sink.addFeature(point, QgsFeatureSink.FastInsert)
                pieces.setdefault(row["curve"], (track, []))[1].append((place, seconds))
        feedback.setProgress(100)
        if lines is None:
            return
        for track, samples in pieces.values():
            line = QgsFeature(self.line_fields)
            if len(samples) > 1:
                line.setGeometry(QgsGeometry(QgsLineString(self._vertices(samples))))
            line.setAttributes([*track, self.clock.date(samples[0][1]), self.clock.date(samples[-1][1])])
            lines.addFeature(line, QgsFeatureSink.FastInsert)


    def _vertices(self, samples):
        """Samples with M. Longitudes run on past ±180°, where a line would go back round the Earth."""
        made, before = [], None
        for (x, *rest), seconds in samples:
            if before is not None and shapes.is_geographic(self.crs):
                x += 360 * round((before - x) / 360)
            made.append(QgsPoint(x, *rest, m=seconds))
            before = x
        return made


def _is_null(value):
    return value is None or isinstance(value, QVariant) and value.isNull()


def _number(text):
    return float(text) if text and math.isfinite(float(text)) else None
