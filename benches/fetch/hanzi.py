"""Stroke medians of 9,574 Chinese characters (npm hanzi-writer-data, Arphic Public License), 2-D, 2 to 38 points.

usage: hanzi.py UNPACKED_PACKAGE OUT.npz
"""

import json
import sys
from pathlib import Path

import numpy as np
from ragged import save

source, out = sys.argv[1:]
curves = []
for path in sorted(Path(source).glob("*.json")):
    if path.name not in ("package.json", "all.json"):
        character = json.loads(path.read_text(encoding="utf8"))
        curves += [np.asarray(median, dtype=np.float64) for median in character["medians"]]
save(out, curves)
