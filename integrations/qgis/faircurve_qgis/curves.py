"""Fair curves."""

from qgis.core import (
    QgsProcessingException,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterNumber,
)

from . import shapes
from .base import LayerAlgorithm, metres

METHODS = {
    "natural": "Natural: cubic splines through every vertex",
    "fair": "Fair: least bending and tautness, through every vertex or near them",
    "scf": "Smooth connection functions: the roundest curves through every vertex",
    "smoothing": "Smoothing: the smoothest splines near the vertices",
}


class FairCurves(LayerAlgorithm):
    NAME, TITLE, TAGS = "faircurves", "Fair curves", "smooth,spline,curve,interpolate,bezier,natural"
    SUMMARY = "Draws smooth curves through the vertices of lines and polygons, or near them."
    OUTPUT = "Fair curves"
    DISTANCES = ("DEVIATION",)
    HELP = """Draws a smooth curve through the vertices of every line and ring. Borders that polygons share stay shared.

Attributes, the order of features, the CRS and features without a geometry stay as they are. A line that has no curve stays as it is, and is listed. Arcs become lines, and M values are dropped. Layers of longitudes and latitudes are fitted on the ellipsoid WGS84.

<b>Method</b>: natural cubic splines, fair curves of least bending and tautness, smooth connection functions (the exact planar curves of least bending, for projected layers) or smoothing splines.
<b>Deviation</b>: no vertex is missed by more than this, in metres. Smoothing needs it, fair curves take it, and the other methods go through every vertex.
<b>Segments per span</b>: how many segments are written from vertex to vertex.
<b>Tension</b>: of smooth connection functions. With 0 they are as round as can be, and may not exist. 1 keeps them from loops, and larger numbers make them tighter."""

    def add_options(self):
        self.addParameter(QgsProcessingParameterEnum("METHOD", "Method", list(METHODS.values()), defaultValue=0))
        self.addParameter(metres("DEVIATION", "Deviation", optional=True))
        self.addParameter(
            QgsProcessingParameterNumber("PER_SPAN", "Segments per span", defaultValue=16, minValue=1, maxValue=1000)
        )
        tension = QgsProcessingParameterNumber(
            "TENSION", "Tension", QgsProcessingParameterNumber.Double, defaultValue=1, minValue=0, maxValue=100
        )
        tension.setFlags(tension.flags() | QgsProcessingParameterDefinition.FlagAdvanced)
        self.addParameter(tension)

    def arguments(self, parameters, context, crs):
        method = list(METHODS)[self.parameterAsEnum(parameters, "METHOD", context)]
        words = ["fit", "--method", method, "--samples", str(self.parameterAsInt(parameters, "PER_SPAN", context))]
        given = parameters.get("DEVIATION") is not None
        if method == "smoothing" and not given:
            raise QgsProcessingException("Smoothing needs a “Deviation”: give a distance such as 50 m.")
        if method in ("natural", "scf") and given:
            raise QgsProcessingException(
                f"“Deviation” is given, and curves of the method {method} go through every vertex: leave it empty, or take Fair or Smoothing."
            )
        if given:
            words += ["--deviation", shapes.distance(self.parameterAsDouble(parameters, "DEVIATION", context), crs)]
        if shapes.is_geographic(crs):
            if method == "scf":
                raise QgsProcessingException(
                    f"Smooth connection functions are planar, and {crs.authid()} has longitudes and latitudes: reproject the layer, or take another method."
                )
            words += ["--surface", "wgs84"]
        if method == "scf":
            words += ["--tension", repr(self.parameterAsDouble(parameters, "TENSION", context))]
        return words
