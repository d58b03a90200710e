"""Fibre tracts of the brain (PyPI dipy, BSD-3: tracks300.trk and minimal_bundles.zip), 3-D millimetres.

usage: tracts.py UNPACKED_WHEEL OUT.npz
"""

import io
import sys
import zipfile
from pathlib import Path

import nibabel
import numpy as np
from ragged import save

source, out = sys.argv[1:]
files = Path(source) / "dipy" / "data" / "files"


def streamlines(file):
    return [np.asarray(line, dtype=np.float64) for line in nibabel.streamlines.load(file).streamlines]


curves = streamlines(files / "tracks300.trk")
with zipfile.ZipFile(files / "minimal_bundles.zip") as bundles:
    for name in sorted(bundles.namelist()):
        if name.endswith(".trk"):
            curves += streamlines(io.BytesIO(bundles.read(name)))
save(out, curves)
