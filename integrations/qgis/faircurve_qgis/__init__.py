"""Fair curves for QGIS: a provider of processing algorithms."""


def classFactory(iface):
    """What QGIS calls to load the plugin."""
    from .provider import FaircurvePlugin

    return FaircurvePlugin()
