"""The provider, and the plugin that registers it."""

from pathlib import Path

from qgis.core import QgsApplication, QgsProcessingProvider
from qgis.PyQt.QtGui import QIcon

from .borders import SmoothBorders
from .curves import FairCurves
from .tracks import SmoothTracks

ICON = str(Path(__file__).with_name("icon.svg"))


class FaircurveProvider(QgsProcessingProvider):
    def id(self):
        return "faircurve"

    def name(self):
        return "faircurve"

    def longName(self):
        return "faircurve: fair curves"

    def icon(self):
        return QIcon(ICON)

    def svgIconPath(self):
        return ICON

    def loadAlgorithms(self):
        for algorithm in (SmoothBorders, SmoothTracks, FairCurves):
            self.addAlgorithm(algorithm())


class FaircurvePlugin:
    def __init__(self):
        self.provider = None

    def initProcessing(self):
        """What `qgis_process` calls in place of `initGui`."""
        self.provider = FaircurveProvider()
        QgsApplication.processingRegistry().addProvider(self.provider)

    def initGui(self):
        self.initProcessing()

    def unload(self):
        QgsApplication.processingRegistry().removeProvider(self.provider)
