"""Streamlines as nibabel writes them, in two orders of voxels, and where nibabel finds them.

    pip install nibabel
    python tests/data/tracts.py

writes tracts_las.trk, tracts_als.trk, tracts.tck and tracts.csv beside this file.
"""

import os

import nibabel
import numpy
from nibabel.streamlines import Field, Tractogram, TrkFile

os.chdir(os.path.dirname(os.path.abspath(__file__)))
random = numpy.random.default_rng(3)
lines = [numpy.cumsum(random.normal(size=(n, 3)), 0).astype("f4") * 2 for n in (6, 2, 9, 1, 5)]
tractogram = Tractogram(
    lines,
    data_per_point={
        "fa": [random.random((len(line), 1)).astype("f4") for line in lines],
        "rgb": [random.random((len(line), 3)).astype("f4") for line in lines],
    },
    data_per_streamline={"bundle": numpy.arange(5, dtype="f4")[:, None], "weight": random.random((5, 2)).astype("f4")},
    affine_to_rasmm=numpy.eye(4),
)
affine = numpy.array([[-1.9, 0.3, 0.1, 40], [0.3, 2.0, 0.2, -30], [-0.1, -0.2, 2.5, 10], [0, 0, 0, 1.0]])
for order in ("LAS", "ALS"):
    header = {
        Field.VOXEL_TO_RASMM: affine.astype("f4"),
        Field.VOXEL_SIZES: numpy.sqrt((affine[:3, :3] ** 2).sum(0)).astype("f4"),
        Field.DIMENSIONS: (91, 109, 75),
        Field.VOXEL_ORDER: order,
    }
    TrkFile(tractogram, header).save(f"tracts_{order.lower()}.trk")
nibabel.streamlines.save(Tractogram(lines, affine_to_rasmm=numpy.eye(4)), "tracts.tck")

found = nibabel.streamlines.load("tracts_als.trk").tractogram
with open("tracts.csv", "w") as rows:
    rows.write("curve,x,y,z,fa,rgb_1,rgb_2,rgb_3,bundle,weight_1,weight_2\n")
    for i, line in enumerate(found.streamlines):
        for k, point in enumerate(line):
            of_point = [*point, *found.data_per_point["fa"][i][k], *found.data_per_point["rgb"][i][k]]
            of_line = [*found.data_per_streamline["bundle"][i], *found.data_per_streamline["weight"][i]]
            rows.write(",".join([str(i)] + [repr(float(x)) for x in of_point + of_line]) + "\n")
