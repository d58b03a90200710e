"""Fibre tracts of a brain: smoothed within a millimetre, 20 points each at equal arc lengths, back into TRK.

usage: python tracts.py [PICTURE.png]      needs nibabel and matplotlib
"""

import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import nibabel as nib
import numpy as np
from nibabel.streamlines.tractogram import Tractogram

import faircurve as fc

DATA = Path(__file__).parents[2] / "examples" / "data" / "tracts.trk"

tracts = nib.streamlines.load(DATA)
fit = fc.Smoothing(deviation=1.0).fit(tracts.streamlines)
smooth = fit.sample(points=20)
print(fit)
print(f"lengths of {fit.length.min():.0f} to {fit.length.max():.0f} mm, radii of curvature down to {1 / fit.max_curvature.max():.1f} mm")

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "smooth.trk"
    nib.streamlines.save(Tractogram(smooth, affine_to_rasmm=np.eye(4)), path, header=tracts.header)
    again = nib.streamlines.load(path).streamlines
    print(f"{len(again)} streamlines of {len(again[0])} points are read back")

figure = plt.figure(figsize=(8, 7))
axes = figure.add_subplot(projection="3d")
for before, after in zip(tracts.streamlines, smooth):
    axes.plot(*before.T, color="0.8", linewidth=2)
    axes.plot(*after.T, color="tab:red", linewidth=0.8)
axes.set(xlabel="x (mm)", ylabel="y (mm)", zlabel="z (mm)", title="Streamlines, and 20 points of each")
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "tracts.png", dpi=120)
