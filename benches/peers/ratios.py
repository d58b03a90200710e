"""Prints, for every case of a file of JSON lines, each peer's time a curve and its ratio to faircurve's.

usage: ratios.py LINES.jsonl
"""

import json
import sys
from pathlib import Path

lines = [json.loads(line) for line in Path(sys.argv[1]).read_text(encoding="utf8").splitlines()]
ours = {line["case"]: line["us_per_curve"] for line in lines if line["peer"] == "faircurve"}
print(f"{'case':50}{'peer':22}{'µs a curve':>12}{'fastest':>10}{'slowest':>10}{'threads':>9}{'load':>6}{'times faircurve':>17}")
for line in lines:
    time, (fastest, slowest) = line["us_per_curve"], line["spread"]
    case, peer, threads, load = line["case"], line["peer"], line["threads"], line["load"] or 0.0
    row = f"{case:50}{peer:22}{time:12.3f}{fastest:10.3f}{slowest:10.3f}{threads:9}{load:6.1f}"
    print(row + f"{time / ours[case]:17.1f}" if case in ours else row)
