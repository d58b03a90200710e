"""Smooths a map by `faircurve map`, mapshaper, smoothify and geolibre, and compares what comes out.

    python benches/peers/maps.py MAP.topojson 1km [--program PATH] [--mapshaper PATH] [--geolibre PATH]
    python benches/peers/maps.py raster 100m

shapely judges in a local metric for each polygon: kilometres east and north of its middle. Distances are Hausdorff distances of
rings, both ways, a hundredth of D too small at most. Features with other numbers of polygons are not judged. Overlaps are pairs of
features, gaps are holes of all features together; those smaller than a square of D/100 are not counted. Sizes are those of TopoJSON where
a peer writes it, else of GeoJSON with as many digits for both, as shares of the input's; points are counted in GeoJSON. Every peer takes
D as the length that it asks for, and geolibre three times that, as its window is longer than what it moves. smoothify and geolibre know
no longitudes: a kilometre is as many degrees to them as on a meridian. Their seconds are without files and compilation. A map of
100,000 points takes 15 minutes, nearly all of them for overlaps and gaps of smoothify's and geolibre's two million points.

`raster` is a map of land cover as rasters give them: 300 by 300 cells of 100 m in six classes, borders along cells, planar metres.
"""

import argparse
import functools
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import warnings

import numpy as np
import shapely
from shapely.geometry import mapping, shape

DEGREE = 111.195
AS_IT_IS = ["--samples", "1", "--crossings", "ignore", "--antimeridian", "keep", "-q", "--force"]
CELLS, CELL, CLASSES = 300, 100.0, 6


def raster() -> list:
    """Polygons of connected cells of one class, with points at junctions and where borders turn."""
    noise = np.fft.fft2(np.random.default_rng(7).normal(size=(CELLS, CELLS)))
    waves = np.hypot(*np.meshgrid(np.fft.fftfreq(CELLS), np.fft.fftfreq(CELLS)))
    wide, narrow = (cells * np.fft.ifft2(noise * np.exp(-2 * (np.pi * cells * waves) ** 2)).real for cells in (8, 2))
    field = wide + 0.3 * narrow
    classes = np.digitize(field, np.quantile(field, np.arange(1, CLASSES) / CLASSES))
    patches = []
    for number in range(CLASSES):
        row, column = np.nonzero(classes == number)
        cells = shapely.box(CELL * column, CELL * row, CELL * (column + 1), CELL * (row + 1))
        patches += list(shapely.get_parts(shapely.coverage_union_all(cells)))
    return list(shapely.coverage_simplify(patches, 0))


def features(path: pathlib.Path) -> dict:
    """The geometries by name and number, since peers leave out features of which nothing is left."""
    found = {}
    for feature in json.loads(path.read_text())["features"]:
        name = (feature.get("id"), (feature["properties"] or {}).get("name"))
        number = sum(key[:2] == name for key in found) if name != (None, None) else len(found)
        if feature["geometry"]:
            found[*name, number] = shape(feature["geometry"])
    return found


def write(path: pathlib.Path, geometries, digits: int) -> None:
    """A GeoJSON file of rounded coordinates, with the number of each geometry."""
    rows = []
    for row, geometry in enumerate(geometries):
        rounded = shapely.transform(geometry, lambda p: np.round(p, digits))
        rows.append({"type": "Feature", "id": row, "properties": {"row": row}, "geometry": mapping(rounded)})
    path.write_text(json.dumps({"type": "FeatureCollection", "features": rows}, separators=(",", ":")))


def polygons(geometry) -> list:
    """The polygons of a geometry, none for points and lines."""
    if geometry.geom_type == "Polygon":
        return [] if geometry.is_empty else [geometry]
    return [part for part in getattr(geometry, "geoms", []) if part.geom_type == "Polygon" and not part.is_empty]


def on_the_ground(polygon, middle, planar: bool):
    """A polygon in kilometres east and north of a place."""
    scale = np.full(2, 1e-3) if planar else DEGREE * np.array([math.cos(math.radians(middle[1])), 1.0])
    return shapely.transform(polygon, lambda p: (p - middle) * scale)


def farthest(a, b, distance: float) -> float:
    """The Hausdorff distance of two rings, at most a hundredth of D too small: edges are halved where more may be found."""
    most = 0.0
    for ring, other in ((a, b), (b, a)):
        p, q = shapely.get_coordinates(ring), shapely.get_coordinates(other)
        tree = shapely.STRtree(shapely.linestrings(np.stack([q[:-1], q[1:]], 1)))
        far = lambda points: tree.query_nearest(shapely.points(points), return_distance=True, all_matches=False)[1]
        own = far(p)
        edges, ends = np.stack([p[:-1], p[1:]], 1), np.stack([own[:-1], own[1:]], 1)
        most = max(most, own.max())
        while len(edges):
            # A distance grows no faster than the way.
            bounds = (ends.sum(1) + np.hypot(*(edges[:, 1] - edges[:, 0]).T)) / 2
            keep = bounds > most + distance / 100
            edges, ends = edges[keep], ends[keep]
            if len(edges):
                middles = edges.mean(1)
                own = far(middles)
                most = max(most, own.max())
                edges = np.concatenate([np.stack([edges[:, 0], middles], 1), np.stack([middles, edges[:, 1]], 1)])
                ends = np.concatenate([np.stack([ends[:, 0], own], 1), np.stack([own, ends[:, 1]], 1)])
    return float(most)


def torn(features: dict, distance: float, planar: bool) -> dict:
    """How many features are no valid polygons, have edges that tear, overlap in pairs, and how many holes all together have."""
    own = [geometry for geometry in features.values() if polygons(geometry)]
    edges = shapely.coverage_invalid_edges(own)
    least = (distance * 1e-2 * (1e3 if planar else 1 / DEGREE)) ** 2
    valid = [geometry if geometry.is_valid else shapely.make_valid(geometry) for geometry in own]
    one, other = shapely.STRtree(valid).query(valid, predicate="intersects")
    one, other = one[one < other], other[one < other]
    common = shapely.area(shapely.intersection(np.take(valid, one), np.take(valid, other)))
    holes = [hole for part in shapely.get_parts(shapely.union_all(valid)) for hole in getattr(part, "interiors", [])]
    return {
        "invalid": sum(not geometry.is_valid for geometry in own),
        "torn": sum(not edge.is_empty for edge in edges),
        "overlaps": int((common > least).sum()),
        "gaps": sum(shapely.Polygon(hole).area > least for hole in holes),
    }


def judge(given: dict, smooth: dict, distance: float, planar: bool, torn_before: dict) -> dict:
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
            if a.area == 0 or not planar and (north - south > 20 or abs(middle[1]) > 80):
                continue
            a, b = on_the_ground(a, middle, planar), on_the_ground(b, middle, planar)
            far.append(farthest(a.exterior, b.exterior, distance) / distance)
            areas.append(abs(b.area / a.area - 1))
    points = [sum(shapely.get_num_coordinates(g) for g in own.values()) for own in (smooth, given)]
    whole = torn(smooth, distance, planar)
    return {
        "points": f"{points[0] / points[1]:.2f}",
        "polygons": len(far),
        "features that lost a part": left_out,
        **{name: f"{whole[name]} (was {torn_before[name]})" for name in whole},
        "farthest/D": f"{max(far):.2f}",
        "over 1.05 D": int(sum(f > 1.05 for f in far)),
        "area over 0.1 %": sum(a > 1e-3 for a in areas),
        "area, median": f"{np.median(areas):.1e}",
    }


def by_command(command: list, out: str, program: str, folder: pathlib.Path):
    """The map that a command writes as TopoJSON, and the seconds it took."""
    start = time.perf_counter()
    done = subprocess.run([*command, out], capture_output=True, text=True)
    seconds = time.perf_counter() - start
    if done.returncode not in (0, 1):
        sys.exit(f"{command[0]}: {done.stderr.strip().splitlines()[-1]}")
    # All are read by one reader.
    subprocess.run([program, "fit", out, "-o", str(folder / "out.geojson"), *AS_IT_IS], check=True)
    return features(folder / "out.geojson"), seconds


def by_smoothify(before: dict, length: float):
    """Every feature by itself, on all cores."""
    import geopandas
    from smoothify import smoothify

    frame = geopandas.GeoDataFrame({"row": range(len(before))}, geometry=list(before.values()))
    start = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        smooth = smoothify(frame, segment_length=length, merge_collection=False)
    seconds = time.perf_counter() - start
    # It sorts the rows in another way.
    names = list(before)
    return {names[row]: geometry for row, geometry in zip(smooth["row"], smooth.geometry, strict=True)}, seconds


def by_geolibre(before: dict, length: float, folder: pathlib.Path, runtime: str | None):
    """Borders smoothed once for both sides."""
    import geolibre_wasm

    # The first call compiles.
    geolibre_wasm.list_tools(wasm_path=runtime)
    write(folder / "rows.geojson", before.values(), 9)
    start = time.perf_counter()
    done = geolibre_wasm.run_tool(
        "smooth_shared_edges",
        args=["--input=work/in.geojson", "--output=work/out.geojson", "--algorithm=paek", f"--tolerance={length}"],
        input={"in.geojson": folder / "rows.geojson"},
        wasm_path=runtime,
    )
    seconds = time.perf_counter() - start
    if done.exit_code:
        raise OSError(done.stdout[-1])
    smooth = json.loads(done.files["out.geojson"])["features"]
    names = list(before)
    return {names[f["properties"]["row"]]: shape(f["geometry"]) for f in smooth if f["geometry"]}, seconds


def results(given, planar: bool, source: pathlib.Path, before: dict, folder: pathlib.Path):
    """A name, a way to get a map and a file of TopoJSON for each peer, if it writes one."""
    kilometres = kilometres_of(given.distance)
    length = 1000 * kilometres if planar else kilometres / DEGREE
    # Planar files have no unit.
    within = f"{length:g}" if planar else given.distance
    run = functools.partial(by_command, out=str(folder / "out.topojson"), program=given.program, folder=folder)
    shaper = [given.mapshaper, str(source)]
    yield "faircurve map", lambda: run([given.program, "map", str(source), "--within", within, "-q", "--force", "-o"]), True
    yield "mapshaper -smooth", lambda: run([*shaper, "-smooth", within, "-o", "force"]), True
    yield "mapshaper -simplify", lambda: run([*shaper, "-simplify", f"interval={1000 * kilometres}", "-o", "force"]), True
    yield "smoothify", lambda: by_smoothify(before, length), False
    yield "geolibre", lambda: by_geolibre(before, 3 * length, folder, given.geolibre), False


def kilometres_of(distance: str) -> float:
    """A distance in kilometres of a text such as 1km or 100m."""
    return float(distance.removesuffix("km")) if distance.endswith("km") else float(distance.removesuffix("m")) / 1000


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("map", help="a TopoJSON file, or raster")
    parser.add_argument("distance", help="such as 1km or 100m")
    parser.add_argument("--program", default="target/release/faircurve")
    parser.add_argument("--mapshaper", default="mapshaper", help="npm install mapshaper has it")
    parser.add_argument("--geolibre", default=os.environ.get("GEOLIBRE_WASM"), help="geolibre-cli.wasm; npm install geolibre-wasm has it")
    parser.add_argument("--keep", type=pathlib.Path, help="a folder for the maps, as GeoJSON")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        source, plain = folder / "in.topojson", folder / "in.geojson"
        planar = given.map == "raster"
        digits = 2 if planar else 6
        if planar:
            write(folder / "raster.geojson", raster(), digits)
            subprocess.run([given.program, "fit", str(folder / "raster.geojson"), "-o", str(source), *AS_IT_IS], check=True)
        else:
            source.write_bytes(pathlib.Path(given.map).read_bytes())
        subprocess.run([given.program, "fit", str(source), "-o", str(plain), *AS_IT_IS], check=True)
        before = features(plain)
        torn_before = torn(before, kilometres_of(given.distance), planar)
        print(f"{pathlib.Path(given.map).name}, D = {given.distance}: {source.stat().st_size:,} bytes, {len(before):,} features")
        for name, work, topology in results(given, planar, source, before, folder):
            try:
                smooth, seconds = work()
            except (ImportError, OSError) as reason:
                print(f"  {name:20} is left out: {reason}")
                continue
            sizes = []
            for own in (smooth, before):
                write(folder / "own.geojson", own.values(), digits)
                sizes.append((folder / "own.geojson").stat().st_size)
                if own is smooth and given.keep:
                    given.keep.mkdir(exist_ok=True)
                    (given.keep / f"{name.replace(' ', '_')}.geojson").write_bytes((folder / "own.geojson").read_bytes())
            if topology:
                sizes = [path.stat().st_size for path in (folder / "out.topojson", source)]
            told = {"seconds": f"{seconds:.1f}", "size": f"{sizes[0] / sizes[1]:.2f}"}
            told |= judge(before, smooth, kilometres_of(given.distance), planar, torn_before)
            print(f"  {name:20}", ", ".join(f"{key} {value}" for key, value in told.items()), flush=True)


if __name__ == "__main__":
    main()
