"""Borders in GeoPandas: geometries in, geometries out, with their index, their columns and their CRS.

usage: python borders.py [PICTURE.png]      needs geopandas and matplotlib
"""

import sys
from pathlib import Path

import geopandas as gpd
import matplotlib.pyplot as plt

import faircurve as fc

DATA = Path(__file__).parents[2] / "examples" / "data" / "countries-110m.geojson"

borders = gpd.read_file(DATA)
fit = fc.Natural().fit(borders)
smooth = fit.sample(per_span=8)
borders["length"], borders["status"] = fit.length, fit.status
print(fit)
print(borders.nlargest(3, "length")[["length", "status"]])

figure, axes = plt.subplots(figsize=(9, 7))
borders.plot(ax=axes, color="0.75", linewidth=2.5)
smooth.plot(ax=axes, color="tab:blue", linewidth=0.9)
axes.set(xlim=(-12, 32), ylim=(34, 62), title="Borders of Europe, and splines through their points")
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "borders.png", dpi=120)
