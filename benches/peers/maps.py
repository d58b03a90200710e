"""Smooths a map by `faircurve map` and by mapshaper, and compares what comes out.

    python benches/peers/maps.py MAP.topojson 1km [--program PATH] [--mapshaper PATH]

shapely judges in a metric of its own for each polygon: kilometres east and north of its middle. Distances are Hausdorff distances of
rings, both ways, with points on every hundredth of an edge. Features with other numbers of polygons are not judged.
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
import shapely
from shapely.geometry import shape

DEGREE = 111.195


def features(path: pathlib.Path) -> dict:
    """The geometries by name and number, since peers leave out features of which nothing is left."""
    found = {}
    for feature in json.loads(path.read_text())["features"]:
        name = (feature.get("id"), (feature["properties"] or {}).get("name"))
        number = sum(key[:2] == name for key in found)
        if feature["geometry"]:
            found[*name, number] = shape(feature["geometry"])
    return found


def polygons(geometry) -> list:
    """The polygons of a geometry, none for points and lines."""
    if geometry.geom_type == "Polygon":
        return [geometry]
    return [part for part in getattr(geometry, "geoms", []) if part.geom_type == "Polygon"]


def on_the_ground(polygon, middle):
    """A polygon in kilometres east and north of a place."""
    share = math.cos(math.radians(middle[1]))
    return shapely.transform(polygon, lambda p: (p - middle) * DEGREE * np.array([share, 1.0]))


def judge(given: dict, smooth: dict, distance: float) -> dict:
    """What became of a map, with a distance in kilometres."""
    far, areas, left_out = [], [], 0
    for name, before in given.items():
        pairs = polygons(before), polygons(smooth[name]) if name in smooth else []
        if len(pairs[0]) != len(pairs[1]):
            left_out += 1
            continue
        middles = np.array([part.centroid.coords[0] for part in pairs[1]])
        for a in pairs[0]:
            # Peers sort the polygons of a feature.
            b = pairs[1][np.argmin(np.hypot(*(middles - a.centroid.coords[0]).T))]
            west, south, east, north = a.bounds
            middle = np.array([(west + east) / 2, (south + north) / 2])
            # A local metric says nothing of what spans a hemisphere.
            if a.area == 0 or north - south > 20 or abs(middle[1]) > 80:
                continue
            a, b = on_the_ground(a, middle), on_the_ground(b, middle)
            far.append(shapely.hausdorff_distance(a.exterior, b.exterior, densify=0.01) / distance)
            areas.append(abs(b.area / a.area - 1))
    both = [[g for g in own.values() if polygons(g)] for own in (smooth, given)]
    invalid = [sum(not g.is_valid for g in own) for own in both]
    torn = [sum(not edge.is_empty for edge in shapely.coverage_invalid_edges(own)) for own in both]
    return {
        "polygons": len(far),
        "features that lost a part": left_out,
        "invalid": f"{invalid[0]} (was {invalid[1]})",
        "torn": f"{torn[0]} (was {torn[1]})",
        "farthest/D": f"{max(far):.2f}",
        "over 1.05 D": sum(f > 1.05 for f in far),
        "area over 0.1 %": sum(a > 1e-3 for a in areas),
        "area, median": f"{np.median(areas):.1e}",
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("map", type=pathlib.Path)
    parser.add_argument("distance", help="such as 1km")
    parser.add_argument("--program", default="target/release/faircurve")
    parser.add_argument("--mapshaper", default="mapshaper", help="npm install mapshaper has it")
    given = parser.parse_args()
    kilometres = float(given.distance.removesuffix("km"))
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        source = folder / "in.topojson"
        source.write_bytes(given.map.read_bytes())
        plain = folder / "in.geojson"
        keep = ["--samples", "1", "--crossings", "ignore", "-q"]
        subprocess.run([given.program, "fit", str(source), "-o", str(plain), *keep], check=True)
        shaper = [given.mapshaper, str(source)]
        commands = {
            "faircurve map": lambda out: [given.program, "map", str(source), "-o", out, "--within", given.distance, "-q", "--force"],
            "mapshaper -smooth": lambda out: [*shaper, "-smooth", given.distance, "-o", "force", out],
            "mapshaper -simplify": lambda out: [*shaper, "-simplify", f"interval={1000 * kilometres}", "-o", "force", out],
        }
        before = features(plain)
        print(f"{given.map.name}, D = {given.distance}: {source.stat().st_size:,} bytes")
        for name, command in commands.items():
            start = time.perf_counter()
            done = subprocess.run(command(str(folder / "out.topojson")), capture_output=True, text=True)
            seconds = time.perf_counter() - start
            if done.returncode not in (0, 1):
                sys.exit(f"{name}: {done.stderr.strip().splitlines()[-1]}")
            # Both are read by one reader.
            after = folder / "out.geojson"
            subprocess.run([given.program, "fit", str(folder / "out.topojson"), "-o", str(after), *keep, "--force"], check=True)
            size = (folder / "out.topojson").stat().st_size / source.stat().st_size
            rows = judge(before, features(after), kilometres)
            told = {"seconds": f"{seconds:.1f}", "size": f"{size:.2f}", **rows}
            print(f"  {name:20}", ", ".join(f"{key} {value}" for key, value in told.items()))


main()
