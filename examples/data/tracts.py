"""Streamlines of a made-up bundle: arcs that fan out, with noise, some 20 to 60 points each.

    pip install nibabel
    python examples/data/tracts.py

writes tracts.trk beside this file.
"""

import os

import nibabel
import numpy
from nibabel.streamlines import Field, Tractogram, TrkFile

os.chdir(os.path.dirname(os.path.abspath(__file__)))
random = numpy.random.default_rng(7)
lines, anisotropy = [], []
for fan in numpy.linspace(-1, 1, 60):
    count = int(random.integers(20, 60))
    s = numpy.linspace(0, numpy.pi, count)
    height = 30 + 8 * random.random()
    arc = numpy.stack([35 * numpy.cos(s), 25 * fan * numpy.sin(s) ** 2, height * numpy.sin(s) * (1 - 0.2 * fan**2)], 1)
    lines.append((arc + random.normal(scale=0.4, size=arc.shape)).astype("f4"))
    anisotropy.append((0.4 + 0.3 * numpy.sin(s) + random.normal(scale=0.02, size=count)).astype("f4")[:, None])
tractogram = Tractogram(
    lines,
    data_per_point={"fa": anisotropy},
    data_per_streamline={"bundle": numpy.repeat([1, 2], 30).astype("f4")[:, None]},
    affine_to_rasmm=numpy.eye(4),
)
header = {
    Field.VOXEL_TO_RASMM: numpy.array([[-2, 0, 0, 90], [0, 2, 0, -126], [0, 0, 2, -72], [0, 0, 0, 1]], "f4"),
    Field.VOXEL_SIZES: (2, 2, 2),
    Field.DIMENSIONS: (91, 109, 91),
    Field.VOXEL_ORDER: "LAS",
}
TrkFile(tractogram, header).save("tracts.trk")
