"""Borders and coasts of countries (npm world-atlas TopoJSON, ISC; Natural Earth, public domain), 2-D degrees.

Every shared arc comes out once, as a GeoJSON LineString and as a curve of the NPZ; a closed arc repeats its first
point at its end in both.

usage: countries.py COUNTRIES.json OUT.geojson OUT.npz
"""

import json
import sys
from pathlib import Path

import numpy as np
from ragged import save

source, geojson, npz = sys.argv[1:]
topology = json.loads(Path(source).read_text(encoding="utf8"))
scale, translate = np.asarray(topology["transform"]["scale"]), np.asarray(topology["transform"]["translate"])
# Arcs are stored as steps on an integer grid; four decimals of a degree (11 m) keep all that the grid holds.
arcs = [np.round(np.cumsum(np.asarray(arc), axis=0) * scale + translate, 4) for arc in topology["arcs"]]
features = [
    {
        "type": "Feature",
        "properties": {"arc": i, "closed": bool((arc[0] == arc[-1]).all())},
        "geometry": {"type": "LineString", "coordinates": arc.tolist()},
    }
    for i, arc in enumerate(arcs)
]
collection = {"type": "FeatureCollection", "features": features}
Path(geojson).write_text(json.dumps(collection, separators=(",", ":")), encoding="utf8")
save(npz, arcs)
