"""What the algorithms for lines and polygons have in common: new geometries, and everything else as it was."""

import tempfile
from pathlib import Path

from qgis.core import (
    QgsFeatureRequest,
    QgsFeatureSink,
    QgsProcessing,
    QgsProcessingAlgorithm,
    QgsProcessingException,
    QgsProcessingFeatureSource,
    QgsProcessingParameterDistance,
    QgsProcessingParameterFeatureSink,
    QgsProcessingParameterFeatureSource,
    QgsUnitTypes,
)

from . import shapes
from .program import run

#: Features are read whatever their geometries are: the fit copes with invalid ones.
ANY_GEOMETRY = QgsProcessingFeatureSource.FlagSkipGeometryValidityChecks


def metres(name, description, **options):
    """A parameter in metres, which the dialog also takes in other units."""
    parameter = QgsProcessingParameterDistance(name, description, **options)
    parameter.setDefaultUnit(QgsUnitTypes.DistanceMeters)
    return parameter


def not_positive(algorithm, parameters, context, *names):
    """A sentence for the first distance that is given and not positive, else an empty text."""
    for name in names:
        if parameters.get(name) is None and algorithm.parameterDefinition(name).defaultValue() is None:
            continue
        value = algorithm.parameterAsDouble(parameters, name, context)
        if not 0 < value < float("inf"):
            what = algorithm.parameterDefinition(name).description()
            return f"“{what}” is {value:g} m; it must be more than 0: give a distance such as 50 m."
    return ""


class Algorithm(QgsProcessingAlgorithm):
    """An algorithm named and described by its class: NAME, TITLE, SUMMARY, HELP, TAGS and DISTANCES."""

    DISTANCES = ()

    def createInstance(self):
        return type(self)()

    def name(self):
        return self.NAME

    def displayName(self):
        return self.TITLE

    def shortDescription(self):
        return self.SUMMARY

    def shortHelpString(self):
        return self.HELP

    def tags(self):
        return self.TAGS.split(",")

    def icon(self):
        return self.provider().icon()

    def svgIconPath(self):
        return self.provider().svgIconPath()

    def checkParameterValues(self, parameters, context):
        well, sentence = super().checkParameterValues(parameters, context)
        if well:
            sentence = not_positive(self, parameters, context, *self.DISTANCES)
        return not sentence, sentence


class LayerAlgorithm(Algorithm):
    """Lines and polygons in, the same features with new geometries out."""

    def initAlgorithm(self, configuration=None):
        types = [QgsProcessing.TypeVectorPolygon, QgsProcessing.TypeVectorLine]
        self.addParameter(QgsProcessingParameterFeatureSource("INPUT", "Lines or polygons", types))
        self.add_options()
        self.addParameter(QgsProcessingParameterFeatureSink("OUTPUT", self.OUTPUT))

    def arguments(self, parameters, context, crs):
        """The subcommand of the program and its options."""
        raise NotImplementedError

    def processAlgorithm(self, parameters, context, feedback):
        # Raised here, too: a script may leave the check of parameters out.
        sentence = not_positive(self, parameters, context, *self.DISTANCES)
        source = self.parameterAsSource(parameters, "INPUT", context)
        if source is None:
            raise QgsProcessingException(self.invalidSourceError(parameters, "INPUT"))
        if sentence:
            raise QgsProcessingException(sentence)
        crs = source.sourceCrs()
        if not crs.isValid():
            feedback.pushWarning("The layer has no CRS: distances are in map units.")
        command, *options = self.arguments(parameters, context, crs)
        sink, output = self.parameterAsSink(
            parameters, "OUTPUT", context, source.fields(), shapes.kind(source.wkbType()), crs
        )
        if sink is None:
            raise QgsProcessingException(self.invalidSinkError(parameters, "OUTPUT"))

        features, given = [], {}
        for feature in source.getFeatures(QgsFeatureRequest(), ANY_GEOMETRY):
            if feedback.isCanceled():
                return {}
            geometry = shapes.to_json(feature.geometry())
            if geometry is not None:
                given[len(features)] = geometry
            features.append(feature)
        feedback.setProgress(10)
        made = {}
        if given:
            with tempfile.TemporaryDirectory() as folder:
                before, after = "before.geojson", "after.geojson"
                shapes.write(Path(folder) / before, given, crs)
                if not run([command, before, "-o", after, "--antimeridian", "keep", *options], feedback, folder, share=0.8):
                    return {}
                made = shapes.read(Path(folder) / after)
        for number, feature in enumerate(features):
            if feedback.isCanceled():
                return {}
            if made.get(number) is not None:
                feature.setGeometry(shapes.from_json(made[number]))
            sink.addFeature(feature, QgsFeatureSink.FastInsert)
        feedback.setProgress(100)
        return {"OUTPUT": output}
