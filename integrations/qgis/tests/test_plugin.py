"""The plugin in a QGIS without a window."""

import math
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path
from unittest import mock

from qgis.core import (
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsGeometry,
    QgsMapRendererParallelJob,
    QgsMapSettings,
    QgsPointXY,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsProject,
    QgsSymbol,
    QgsVectorFileWriter,
    QgsVectorLayer,
    QgsWkbTypes,
)
from qgis.PyQt.QtCore import QDate, QDateTime, QSize, Qt, QTime
from qgis.PyQt.QtGui import QColor

DATA = Path(__file__).parents[3] / "examples/data"

app = QgsApplication([], False)
app.initQgis()

import processing  # noqa: E402
from processing.core.Processing import Processing  # noqa: E402

Processing.initialize()
import faircurve_qgis  # noqa: E402
import faircurve_qgis.program  # noqa: E402

plugin = faircurve_qgis.classFactory(None)
plugin.initProcessing()


class Feedback(QgsProcessingFeedback):
    """Keeps what is said, and is cancelled at a sign."""

    def __init__(self, cancel_at=""):
        super().__init__(False)
        self.said, self.cancel_at = [], cancel_at

    def _say(self, text):
        self.said.append(text)
        if self.cancel_at and self.cancel_at in text:
            self.cancel()

    def pushInfo(self, text):
        self._say(text)

    def setProgressText(self, text):
        self._say(text)

    def pushWarning(self, text):
        self._say(text)

    def reportError(self, text, fatalError=False):
        self._say(text)


def run(name, feedback=None, **parameters):
    options = {"OUTPUT": "TEMPORARY_OUTPUT", **parameters}
    return processing.run(f"faircurve:{name}", options, feedback=feedback or Feedback())["OUTPUT"]


def layer(kind, crs, geometries, fields="id:integer,name:string", attributes=None):
    made = QgsVectorLayer(f"{kind}?crs={crs}&" + "&".join(f"field={field}" for field in fields.split(",")), "given", "memory")
    features = []
    for k, geometry in enumerate(geometries):
        feature = QgsFeature(made.fields())
        feature.setAttributes(attributes[k] if attributes else [k, f"n {k}"])
        if geometry is not None:
            feature.setGeometry(QgsGeometry.fromWkt(geometry))
        features.append(feature)
    added, _ = made.dataProvider().addFeatures(features)
    assert added
    made.updateExtents()
    return made


def noisy_cells(count=5, size=1000.0, origin=(500000.0, 5600000.0)):
    """A coverage of count × count cells whose borders have noise; neighbours have equal points."""
    rng = random.Random(7)
    borders = {}

    def border(a, b):
        if (b, a) in borders:
            return borders[b, a][::-1]
        if (a, b) not in borders:
            steps = 20
            points = [
                tuple(p + (q - p) * k / steps + (rng.gauss(0, 0.012) if 0 < k < steps else 0) for p, q in zip(a, b))
                for k in range(steps + 1)
            ]
            borders[a, b] = points
        return borders[a, b]

    cells = []
    for i in range(count):
        for j in range(count):
            corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            ring = [p for a, b in zip(corners, corners[1:] + corners[:1]) for p in border(a, b)[:-1]]
            text = ", ".join(f"{origin[0] + size * x!r} {origin[1] + size * y!r}" for x, y in ring + ring[:1])
            cells.append(f"Polygon (({text}))")
    return cells


def world():
    """The countries of the world. TopoJSON says nothing of a CRS."""
    made = QgsVectorLayer(f"{DATA / 'world-110m.topojson'}|layername=countries", "world", "ogr")
    made.setCrs(QgsCoordinateReferenceSystem("EPSG:4326"))
    return made


def geometries(made):
    return [feature.geometry() for feature in made.getFeatures()]


def overlap(shapes):
    return sum(shape.area() for shape in shapes) - QgsGeometry.unaryUnion(shapes).area()


def holes(shapes):
    union = QgsGeometry.unaryUnion(shapes)
    return sum(len(polygon) - 1 for polygon in (union.asMultiPolygon() if union.isMultipart() else [union.asPolygon()]))


def picture(name, before, after, extent=None):
    """Draws a layer over another one if pictures are asked for."""
    folder = os.environ.get("FAIRCURVE_PICTURES")
    if not folder:
        return
    Path(folder).mkdir(parents=True, exist_ok=True)
    for drawn, colour, width in ((before, "#d1495b", 0.3), (after, "#174a7c", 0.5)):
        symbol = QgsSymbol.defaultSymbol(drawn.geometryType())
        symbol.setColor(QColor(0, 0, 0, 0) if drawn.geometryType() == QgsWkbTypes.PolygonGeometry else QColor(colour))
        part = symbol.symbolLayer(0)
        if drawn.geometryType() != QgsWkbTypes.LineGeometry:
            part.setStrokeColor(QColor(colour))
        for set_width in ("setStrokeWidth", "setWidth"):
            if drawn.geometryType() != QgsWkbTypes.PointGeometry and hasattr(part, set_width):
                getattr(part, set_width)(width)
        if drawn.geometryType() == QgsWkbTypes.PointGeometry:
            symbol.setSize(1.2)
        drawn.renderer().setSymbol(symbol)
    settings = QgsMapSettings()
    settings.setLayers([after, before])
    settings.setDestinationCrs(before.crs())
    settings.setBackgroundColor(QColor("white"))
    settings.setOutputSize(QSize(1200, 900))
    settings.setExtent(extent or before.extent())
    job = QgsMapRendererParallelJob(settings)
    job.start()
    job.waitForFinished()
    job.renderedImage().save(str(Path(folder) / f"{name}.png"))


class Borders(unittest.TestCase):
    def assertSame(self, given, made):
        self.assertEqual(made.crs(), given.crs())
        self.assertEqual([f.name() for f in made.fields()], [f.name() for f in given.fields()])
        self.assertEqual([f.attributes() for f in made.getFeatures()], [f.attributes() for f in given.getFeatures()])
        self.assertEqual(made.wkbType(), given.wkbType())

    def test_neighbours_share_their_smooth_borders(self):
        given = layer("Polygon", "EPSG:25832", noisy_cells())
        made = run("smoothborders", INPUT=given, WITHIN=60)
        self.assertSame(given, made)
        before, after = geometries(given), geometries(made)
        self.assertTrue(all(shape.isGeosValid() for shape in after))
        self.assertLess(overlap(after), 1e-6 * 25e6)
        self.assertEqual(holes(after), holes(before))
        for old, new in zip(before, after):
            self.assertNotEqual(old.asWkt(), new.asWkt())
            self.assertLessEqual(new.hausdorffDistance(old), 60)
            self.assertAlmostEqual(new.area() / old.area(), 1, delta=0.02)
        length = lambda shapes: sum(shape.length() for shape in shapes)  # noqa: E731
        self.assertLess(length(after), 0.99 * length(before))
        picture("cells", given, made)

    def test_the_world_stays_valid_in_degrees(self):
        given = world()
        made = run("smoothborders", INPUT=given, WITHIN=50000)
        self.assertSame(given, made)
        before, after = geometries(given), geometries(made)
        self.assertEqual(len(after), 177)
        for old, new in zip(before, after):
            self.assertTrue(new.isGeosValid() or not old.isGeosValid(), new.asWkt(3)[:200])
        self.assertLess(overlap(after), overlap(before) + 1e-6)
        # 50 km are 0.45 degrees of latitude.
        self.assertLess(max(new.boundingBox().yMaximum() - old.boundingBox().yMaximum() for old, new in zip(before, after)), 0.46)
        rounder = run("smoothborders", INPUT=given, WITHIN=50000, TOLERANCE=2000)
        points = lambda drawn: sum(len(list(shape.vertices())) for shape in geometries(drawn))  # noqa: E731
        self.assertGreater(points(rounder), 1.5 * points(made))
        picture("world", given, rounder, QgsGeometry.fromWkt("Polygon ((-12 34, 32 34, 32 60, -12 60, -12 34))").boundingBox())

    def test_metres_become_feet(self):
        # EPSG:2263 is in US survey feet.
        cells = noisy_cells(2, 3000.0, (980000.0, 190000.0))
        feet, metres = layer("Polygon", "EPSG:2263", cells), layer("Polygon", "EPSG:25832", cells)
        one = geometries(run("smoothborders", INPUT=feet, WITHIN=60))
        other = geometries(run("smoothborders", INPUT=metres, WITHIN=60 * 3937 / 1200))
        for a, b in zip(one, other):
            self.assertLess(a.hausdorffDistance(b), 0.1)

    def test_without_a_crs_distances_are_in_map_units(self):
        # Coordinates as small as degrees are.
        given = layer("Polygon", "", noisy_cells(3, 10.0, (0.0, 0.0)))
        feedback = Feedback()
        made = run("smoothborders", feedback, INPUT=given, WITHIN=0.6)
        self.assertIn("The layer has no CRS: distances are in map units.", feedback.said)
        for old, new in zip(geometries(given), geometries(made)):
            self.assertLessEqual(new.hausdorffDistance(old), 0.6)
            self.assertNotEqual(old.asWkt(), new.asWkt())

    def test_features_without_a_geometry_stay(self):
        wave = "LineString ({})".format(", ".join(f"{k} {math.sin(k) + k % 2}" for k in range(40)))
        given = layer("LineString", "EPSG:25832", [None, wave, "LineString EMPTY", "LineString (1 1, 1 1)", None])
        made = run("smoothborders", INPUT=given, WITHIN=1)
        self.assertSame(given, made)
        shapes = geometries(made)
        self.assertTrue(shapes[0].isNull() and shapes[4].isNull())
        self.assertTrue(shapes[2].isEmpty())
        self.assertNotEqual(shapes[1].asWkt(), wave)

    def test_heights_parts_holes_and_arcs(self):
        ring = "0 0 5, 10 1 5, 20 0 6, 30 2 5, 40 0 5, 41 20 5, 40 40 7, 20 42 5, 0 40 5, -2 20 5, 0 0 5"
        hole = "10 10 5, 12 20 5, 10 30 5, 20 28 5, 30 30 5, 28 20 5, 30 10 5, 20 12 5, 10 10 5"
        given = layer("MultiPolygonZ", "EPSG:25832", [f"MultiPolygonZ ((({ring}), ({hole})), ((100 0 1, 120 3 1, 110 20 1, 100 0 1)))"])
        made = run("smoothborders", INPUT=given, WITHIN=1)
        self.assertSame(given, made)
        shape = geometries(made)[0]
        self.assertEqual([len(polygon) for polygon in shape.asMultiPolygon()], [2, 1])
        self.assertTrue(all(0.9 < vertex.z() < 7.1 for vertex in shape.vertices()))
        arcs = layer("CompoundCurveM", "EPSG:25832", ["CompoundCurveM (CircularStringM (0 0 1, 10 10 1, 20 0 1))"])
        made = run("smoothborders", INPUT=arcs, WITHIN=1)
        self.assertEqual(made.wkbType(), QgsWkbTypes.LineString)
        self.assertGreater(geometries(made)[0].boundingBox().yMaximum(), 9)

    def test_only_selected_features_are_taken(self):
        from qgis.core import QgsProcessingFeatureSourceDefinition

        given = layer("Polygon", "EPSG:25832", noisy_cells(2))
        given.selectByIds([2, 4])
        QgsProject.instance().addMapLayer(given)
        made = run("smoothborders", INPUT=QgsProcessingFeatureSourceDefinition(given.id(), True), WITHIN=60)
        self.assertEqual({f["id"] for f in made.getFeatures()}, {1, 3})

    def test_an_empty_layer_stays_empty(self):
        for name, extra in (("smoothborders", {"WITHIN": 10}), ("faircurves", {})):
            made = run(name, INPUT=layer("Polygon", "EPSG:4326", []), **extra)
            self.assertEqual(made.featureCount(), 0)
            self.assertEqual(made.fields().names(), ["id", "name"])

    def test_a_bad_distance_is_a_sentence(self):
        given = layer("Polygon", "EPSG:25832", noisy_cells(1))
        for value in (0, -3):
            with self.assertRaisesRegex(QgsProcessingException, f"“Within” is {value} m; it must be more than 0: give a distance"):
                run("smoothborders", INPUT=given, WITHIN=value)

    def test_a_distance_larger_than_the_map_keeps_the_coverage(self):
        given = layer("Polygon", "EPSG:25832", noisy_cells(3))
        after = geometries(run("smoothborders", INPUT=given, WITHIN=20000))
        self.assertTrue(all(shape.isGeosValid() for shape in after))
        self.assertLess(overlap(after), 1e-6 * 9e6)

    def test_a_run_can_be_cancelled(self):
        given = layer("Polygon", "EPSG:25832", noisy_cells(3))
        feedback = Feedback(cancel_at="fitted on")
        made = processing.run("faircurve:smoothborders", {"INPUT": given, "WITHIN": 60, "OUTPUT": "TEMPORARY_OUTPUT"}, feedback=feedback)
        self.assertNotIn("OUTPUT", made)
        feedback = Feedback()
        feedback.cancel()
        made = processing.run("faircurve:smoothborders", {"INPUT": given, "WITHIN": 60, "OUTPUT": "TEMPORARY_OUTPUT"}, feedback=feedback)
        self.assertNotIn("OUTPUT", made)
        self.assertFalse([line for line in feedback.said if "fitted" in line])

    def test_a_long_run_ends_when_it_is_cancelled(self):
        endless = [sys.executable, "-c", "import sys, time; print('faircurve: fitting, 5 of 1,000 curves, for 10 s', file=sys.stderr, flush=True); time.sleep(60)"]
        feedback, started = Feedback(cancel_at="5 of 1,000"), time.monotonic()
        with mock.patch("faircurve_qgis.program.command", return_value=(endless, None)):
            self.assertFalse(faircurve_qgis.program.run([], feedback, None))
        self.assertLess(time.monotonic() - started, 50)
        self.assertAlmostEqual(feedback.progress(), 0.5)

    def test_a_missing_program_is_a_sentence(self):
        with mock.patch.dict(sys.modules, {"faircurve": None}), mock.patch("shutil.which", return_value=None):
            with self.assertRaisesRegex(QgsProcessingException, "was not found.*pip install faircurve"):
                faircurve_qgis.program.command()


class Curves(unittest.TestCase):
    ZIGZAG = "LineString (0 0, 100 100, 200 0, 300 100, 380 40)"

    def test_curves_go_through_their_vertices(self):
        given = layer("LineString", "EPSG:25832", [self.ZIGZAG, None])
        for method in range(3):
            made = run("faircurves", INPUT=given, METHOD=method, PER_SPAN=8)
            shape, nothing = geometries(made)
            self.assertTrue(nothing.isNull())
            self.assertEqual(len(shape.asPolyline()), 33)
            for x, y in ((0, 0), (100, 100), (200, 0), (300, 100), (380, 40)):
                self.assertLess(shape.distance(QgsGeometry.fromPointXY(QgsPointXY(x, y))), 1e-6)
            picture(f"curves-{method}", given, made)

    def test_a_deviation_is_kept_in_metres_on_the_ground(self):
        noise = random.Random(3)
        points = [(4 + 0.01 * k, 52 + 0.002 * noise.gauss(0, 1)) for k in range(30)]
        given = layer("LineString", "EPSG:4326", ["LineString ({})".format(", ".join(f"{x!r} {y!r}" for x, y in points))])
        for method in (1, 3):
            made = run("faircurves", INPUT=given, METHOD=method, DEVIATION=200)
            shape = geometries(made)[0]
            self.assertEqual(made.crs().authid(), "EPSG:4326")
            misses = [shape.distance(QgsGeometry.fromPointXY(QgsPointXY(x, y))) for x, y in points]
            # A degree has at most 111.7 km, and of longitude 68.7 km here.
            self.assertLessEqual(max(misses), 200 / 68_000)
            self.assertGreater(max(misses), 100 / 112_000)
            self.assertLess(shape.length(), 0.99 * geometries(given)[0].length())

    def test_tension_gives_every_line_a_curve(self):
        given = layer("LineString", "EPSG:25832", ["LineString (0 0, 100 0, 0 1, 100 2)"])
        for tension, converged in ((1, True), (0, False)):
            feedback = Feedback()
            run("faircurves", feedback, INPUT=given, METHOD=2, TENSION=tension)
            self.assertEqual(any("could not be fitted" in line for line in feedback.said), not converged)

    def test_neighbours_share_curves(self):
        for crs, origin, size in (("EPSG:25832", (500000.0, 5600000.0), 1000.0), ("EPSG:4326", (5.0, 45.0), 1.0)):
            given = layer("Polygon", crs, noisy_cells(2, size, origin))
            after = geometries(run("faircurves", INPUT=given, METHOD=0, PER_SPAN=4))
            self.assertTrue(all(shape.isGeosValid() for shape in after))
            self.assertLess(overlap(after), 1e-6 * size**2)
            self.assertEqual(holes(after), 0)

    def test_options_that_do_not_fit_are_sentences(self):
        plane, globe = (layer("LineString", crs, ["LineString (0 0, 1 1, 2 0)"]) for crs in ("EPSG:25832", "EPSG:4326"))
        for given, options, sentence in (
            (plane, {"METHOD": 3}, "Smoothing needs a “Deviation”"),
            (plane, {"METHOD": 0, "DEVIATION": 5}, "go through every vertex: leave it empty"),
            (plane, {"METHOD": 3, "DEVIATION": -1}, "“Deviation” is -1 m; it must be more than 0"),
            (globe, {"METHOD": 2}, "planar, and EPSG:4326 has longitudes and latitudes: reproject"),
        ):
            with self.assertRaisesRegex(QgsProcessingException, sentence):
                run("faircurves", INPUT=given, **options)


START = QDateTime(QDate(2024, 3, 28), QTime(5, 50), Qt.UTC)
FIELDS = "ship:integer,when:datetime,sog:double,cog:double,state:string"


def tracks(crs="EPSG:4326", x0=4.0, y0=52.0, scale=1.0, spec=Qt.UTC):
    """Two ships with noise, mixed rows, and rows without a time, a ship or a place."""
    rng = random.Random(5)
    points, rows = [], []
    for k in range(60):
        for ship in (7, 9):
            when = START.addSecs(180 * k)
            when = QDateTime(when.date(), when.time(), spec) if spec == Qt.LocalTime else when
            # 9 m/s to the north, or to the north-east.
            x, y = (0, 1620 * k) if ship == 7 else (1146 * k, 1146 * k)
            x, y = x0 + (x / 68_680 if scale == 1 else x * scale), y0 + (y / 111_260 if scale == 1 else y * scale)
            noise = 30 / 111_260 if scale == 1 else 30 * scale
            points.append(f"Point ({x + rng.gauss(0, noise)!r} {y + rng.gauss(0, noise)!r})")
            rows.append([ship, when, 9.0 + k, 350.0 + k if k < 10 else k - 10.0, f"s{k // 30}"])
    points[10] = None
    rows[20][1], rows[30][0] = None, None
    return layer("Point", crs, points, FIELDS, rows)


class Tracks(unittest.TestCase):
    def test_tracks_in_degrees_have_speeds_and_headings_on_the_ground(self):
        feedback, given = Feedback(), tracks()
        made = processing.run(
            "faircurve:smoothtracks",
            {
                "INPUT": given, "TIME": "when", "TRACK": "ship", "WITHIN": 150, "EVERY": 600, "KEEP": ["sog", "cog", "state"],
                "OUTPUT": "TEMPORARY_OUTPUT", "LINES": "TEMPORARY_OUTPUT",
            },
            feedback=feedback,
        )  # fmt: skip
        points, lines = made["OUTPUT"], made["LINES"]
        self.assertEqual(points.crs().authid(), "EPSG:4326")
        self.assertEqual(points.fields().names(), ["ship", "part", "when", "speed", "heading", "sog", "cog", "state"])
        for what in ("geometry", "time", "track"):
            self.assertIn(f"1 point is left out, without a {what}.", feedback.said)
        rows = list(points.getFeatures())
        self.assertEqual(sorted({row["ship"] for row in rows}), [7, 9])
        ones = [row for row in rows if row["ship"] == 7]
        self.assertEqual([row["when"].toString("hh:mm") for row in ones[:3]], ["05:50", "06:00", "06:10"])
        self.assertEqual(len(ones), 18)
        self.assertTrue(all(row["when"].timeSpec() == given.getFeature(1)["when"].timeSpec() for row in ones))
        for row in rows:
            self.assertAlmostEqual(row["speed"], 9, delta=0.4)
            off = (row["heading"] - (0 if row["ship"] == 7 else 45) + 180) % 360 - 180
            self.assertLess(abs(off), 3)
            k = START.secsTo(row["when"]) / 180
            self.assertAlmostEqual(row["sog"], 9 + k, delta=1e-6)
            self.assertLess(abs((row["cog"] - (350 + k) + 180) % 360 - 180), 1e-6)
            self.assertEqual(row["state"], f"s{int(k + 0.5) // 30}")
        self.assertEqual(lines.wkbType(), QgsWkbTypes.LineStringM)
        line = next(lines.getFeatures())
        measures = [vertex.m() for vertex in line.geometry().vertices()]
        self.assertEqual(measures[1] - measures[0], 600)
        self.assertEqual(measures[0], START.toSecsSinceEpoch())
        self.assertEqual(line["begin"], ones[0]["when"])
        picture("tracks", given, lines)

    def test_tracks_in_feet_have_speeds_in_metres(self):
        given = tracks("EPSG:2263", 980000.0, 190000.0, 3937 / 1200)
        rows = list(run("smoothtracks", INPUT=given, TIME="when", TRACK="ship", WITHIN=150, MAX_SPEED=30).getFeatures())
        self.assertGreater(len(rows), 110)
        for row in rows:
            self.assertAlmostEqual(row["speed"], 9, delta=0.5)

    def test_gaps_cut_tracks_into_parts(self):
        given = tracks()
        given.dataProvider().deleteFeatures([f.id() for f in given.getFeatures() if f["when"] and 20 <= START.secsTo(f["when"]) / 180 < 40])
        made = run("smoothtracks", INPUT=given, TIME="when", TRACK="ship", GAP=1800, EVERY=600)
        self.assertEqual({(row["ship"], row["part"]) for row in made.getFeatures()}, {(7, "1"), (7, "2"), (9, "1"), (9, "2")})

    def test_names_of_tracks_may_be_any_text(self):
        names = ["A.1", "", " ", "Ærø, \"B\""]
        rows = [[START.addSecs(3600 * hour), name] for name in names for hour in (0, 1, 9, 10)]
        places = [f"Point ({k} {k % 3})" for k in range(len(rows))]
        given = layer("Point", "EPSG:25832", places, "when:datetime,who:string", rows)
        feedback = Feedback()
        made = run("smoothtracks", feedback, INPUT=given, TIME="when", TRACK="who", GAP=7200)
        found = {(row["who"], row["part"]) for row in made.getFeatures()}
        self.assertEqual(found, {(name, part) for name in names for part in ("1", "2")})

    def test_dates_without_a_zone_stay_as_they_are_written(self):
        made = run("smoothtracks", INPUT=tracks(spec=Qt.LocalTime), TIME="when", TRACK="ship", EVERY=3600)
        self.assertEqual({row["when"].toString("hh:mm") for row in made.getFeatures()}, {"06:00", "07:00", "08:00"})

    def test_no_track_field_and_no_times(self):
        given = tracks()
        one = run("smoothtracks", INPUT=given, TIME="when", EVERY=600)
        self.assertEqual(one.fields().names(), ["part", "when", "speed", "heading"])
        given.dataProvider().changeAttributeValues({f.id(): {1: None} for f in given.getFeatures()})
        feedback = Feedback()
        self.assertEqual(run("smoothtracks", feedback, INPUT=given, TIME="when").featureCount(), 0)
        self.assertIn("119 points are left out, without a time.", feedback.said)
        self.assertEqual(run("smoothtracks", INPUT=layer("Point", "EPSG:4326", [], FIELDS), TIME="when").featureCount(), 0)

    def test_bad_numbers_are_sentences(self):
        for options, sentence in (
            ({"WITHIN": -1}, "“Within” is -1 m; it must be more than 0"),
            ({"EVERY": 0}, "is 0 s; it must be more than 0"),
            ({"STOP_RADIUS": 5}, "“Radius of stops” and a “Duration of stops”"),
        ):
            with self.assertRaisesRegex(QgsProcessingException, sentence):
                run("smoothtracks", INPUT=tracks(), TIME="when", **options)

    def test_tracks_across_the_antimeridian(self):
        places = [f"Point ({(x + 180) % 360 - 180} {-17 + 0.2 * (x - 180) ** 2} 3)" for x in (178.2, 179.1, 180.3, 181.2, 182.4)]
        given = layer("PointZ", "EPSG:4326", places, "when:datetime", [[START.addSecs(600 * k)] for k in range(5)])
        options = {"INPUT": given, "TIME": "when", "WITHIN": 500, "EVERY": 200, "OUTPUT": "TEMPORARY_OUTPUT", "LINES": "TEMPORARY_OUTPUT"}
        made = processing.run("faircurve:smoothtracks", options, feedback=Feedback())
        x = [feature.geometry().constGet().x() for feature in made["OUTPUT"].getFeatures()]
        self.assertTrue(all(-180 <= one <= 180 for one in x) and min(x) < -177 and max(x) > 178)
        line = next(made["LINES"].getFeatures()).geometry()
        self.assertEqual(made["LINES"].wkbType(), QgsWkbTypes.LineStringZM)
        self.assertLess(line.boundingBox().width(), 4.3)
        self.assertTrue(all(2.9 < vertex.z() < 3.1 for vertex in line.vertices()))

    def test_names_that_are_taken(self):
        given = layer("Point", "EPSG:25832", ["Point (0 0)", "Point (5 0)", "Point (9 1)"], "when:datetime,speed:integer,part:string",
                      [[START.addSecs(k), k, "p"] for k in range(3)])  # fmt: skip
        made = run("smoothtracks", INPUT=given, TIME="when", KEEP=["speed", "part"])
        self.assertEqual(made.fields().names(), ["smooth_part", "when", "smooth_speed", "heading", "speed", "part"])
        self.assertEqual([row["speed"] for row in made.getFeatures()], [0, 1, 2])


@unittest.skipUnless(shutil.which("qgis_process.bin") or shutil.which("qgis_process"), "qgis_process is not installed")
class Command(unittest.TestCase):
    def test_qgis_process_runs_the_plugin(self):
        process = shutil.which("qgis_process.bin") or shutil.which("qgis_process")
        with tempfile.TemporaryDirectory() as folder:
            environment = {**os.environ, "QGIS_PLUGINPATH": str(Path(__file__).parents[1]), "QGIS_CUSTOM_CONFIG_PATH": folder}

            def call(*words):
                return subprocess.run([process, *words], env=environment, capture_output=True, text=True, check=True).stdout

            call("plugins", "enable", "faircurve_qgis")
            given, output = Path(folder) / "world.gpkg", Path(folder) / "smooth.gpkg"
            QgsVectorFileWriter.writeAsVectorFormatV3(
                world(), str(given), QgsProject.instance().transformContext(), QgsVectorFileWriter.SaveVectorOptions()
            )
            call("run", "faircurve:smoothborders", "--", f"INPUT={given}", "WITHIN=50000", f"OUTPUT={output}")
            made = QgsVectorLayer(str(output), "made", "ogr")
            self.assertEqual((made.featureCount(), made.crs().authid()), (177, "EPSG:4326"))
            self.assertIn("Junctions stay in place", call("help", "faircurve:smoothborders"))


if __name__ == "__main__":
    made = unittest.main(exit=False).result
    sys.stderr.flush()
    # Objects of QGIS may crash when the interpreter ends, in any order.
    os._exit(not made.wasSuccessful())
