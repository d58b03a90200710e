"""Smooth borders."""

from qgis.core import QgsProcessingParameterDefinition, QgsProcessingParameterEnum

from . import shapes
from .base import LayerAlgorithm, metres

CORNERS = {
    "straight": "Between long straight lines, as surveyed borders have them",
    "auto": "At the scale of the distance, also in noise of half of it",
}
WHICH = {"": "All borders", "coast": "Borders of one polygon alone", "shared": "Borders between two polygons"}


class SmoothBorders(LayerAlgorithm):
    NAME, TITLE, TAGS = "smoothborders", "Smooth borders", "smooth,generalise,generalize,simplify,topology,coverage,coast,boundaries"
    SUMMARY = "Smooths polygons and lines within a distance. Borders that polygons share stay shared."
    OUTPUT = "Smooth borders"
    DISTANCES = ("WITHIN", "TOLERANCE", "SNAP")
    HELP = """Smooths polygons and lines. The new borders lie within the distance of the old ones everywhere, and the old ones within it of the new ones.

Borders that polygons share are smoothed once, so that neighbours neither overlap nor part. Junctions stay in place. Rings keep their area, long straight lines stay straight, and corners between them stay sharp. Smooth borders that would cross are drawn tighter until they do not. As few points are written as the distance allows.

Attributes, the order of features, the CRS and features without a geometry stay as they are. Arcs become lines, and M values are dropped.

<b>Within</b>: in metres. In layers of longitudes and latitudes it holds on the ground, at every latitude, and in others in the plane of their CRS. Where the CRS is unknown it is in map units.
<b>Corners to keep</b>: points where the smooth border may turn sharply.
<b>Borders to smooth</b>: the others keep their coordinates.
<b>Tolerance of points</b>: the part of the distance, in metres, that lines between the written points may take. A smaller one gives rounder lines and more points. By default it is a quarter of the distance, or less where few points are enough.
<b>Snap</b>: points within this distance, in metres, count as one. By default only equal points are shared."""

    def add_options(self):
        self.addParameter(metres("WITHIN", "Within", defaultValue=1000.0))
        self.addParameter(QgsProcessingParameterEnum("CORNERS", "Corners to keep", list(CORNERS.values()), defaultValue=0))
        self.addParameter(QgsProcessingParameterEnum("ONLY", "Borders to smooth", list(WHICH.values()), defaultValue=0))
        for name, description in (("TOLERANCE", "Tolerance of points"), ("SNAP", "Snap")):
            parameter = metres(name, description, optional=True)
            parameter.setFlags(parameter.flags() | QgsProcessingParameterDefinition.FlagAdvanced)
            self.addParameter(parameter)

    def arguments(self, parameters, context, crs):
        within = self.parameterAsDouble(parameters, "WITHIN", context)
        words = ["map", "--within", shapes.distance(within, crs)]
        words += ["--corners", list(CORNERS)[self.parameterAsEnum(parameters, "CORNERS", context)]]
        which = list(WHICH)[self.parameterAsEnum(parameters, "ONLY", context)]
        if which:
            words += ["--only", which]
        if parameters.get("TOLERANCE") is not None:
            words += ["--tolerance", shapes.distance(self.parameterAsDouble(parameters, "TOLERANCE", context), crs)]
        if parameters.get("SNAP") is not None:
            snap = self.parameterAsDouble(parameters, "SNAP", context)
            # A degree of latitude has 111,195 m or more on a sphere as large as the Earth.
            words += ["--snap", repr(snap / 111195) if shapes.is_geographic(crs) else shapes.distance(snap, crs)]
        return words
