"""Fair curves by the thousand: smooth curves through ragged batches of points, on the CPU or on a GPU.

>>> import numpy as np, faircurve as fc
>>> curves = np.random.default_rng(0).normal(size=(1000, 10, 2))
>>> fit = fc.Natural().fit(curves)
>>> fit.sample(64).shape
(1000, 64, 2)
>>> fit([0.0, 0.5]).shape, fit.length.shape
((1000, 2, 2), (1000,))
"""

from . import bezier, laplacian, linalg, scf
from ._arrays import Ragged, ragged
from ._core import __version__, adapters
from ._energy import Energy, attachment, bending, geodesic_bending, length, tautness, tension, torsion, variation
from ._fit import STATUSES, Fit, Status
from ._formula import Expression, ExpressionVector, custom
from ._methods import Fair, Geodesic, Method, Natural, Smooth, Smoothing
from ._running import num_threads, progress, set_num_threads
from ._saved import load
from ._splines import CubicSplineBatch, PPolyBatch
from ._surfaces import HeightField, Mesh
from ._tables import FairBatch, from_dataframe

__all__ = [
    "CubicSplineBatch",
    "Energy",
    "Expression",
    "ExpressionVector",
    "Fair",
    "FairBatch",
    "Fit",
    "Geodesic",
    "HeightField",
    "Mesh",
    "Method",
    "Natural",
    "PPolyBatch",
    "Ragged",
    "STATUSES",
    "Smooth",
    "Smoothing",
    "Status",
    "__version__",
    "adapters",
    "attachment",
    "bending",
    "bezier",
    "custom",
    "from_dataframe",
    "geodesic_bending",
    "laplacian",
    "length",
    "linalg",
    "load",
    "num_threads",
    "progress",
    "ragged",
    "scf",
    "set_num_threads",
    "tautness",
    "tension",
    "torsion",
    "variation",
]
