"""How many corners of known outlines `faircurve fit --within D --corners auto` finds, misses and invents.

D is 1 here. The outlines are polygons and arcs, round curves without corners, and glyphs of DejaVu, in random rotations. They are
sampled with noise of 0, D/4 and D/2, and traced from bitmaps with pixels of D/2 and D. A corner of the result is a joint of Béziers
with a turn. It is found if it is within 2 D of a true corner, which turns by more than 43 degrees. Corners down to 12 degrees, or
nearer than 4 D to another, count neither as missed nor as invented. The program takes less than D for closed curves that are less
than 3.3 D wide, so that noise and pixels are larger there. With the package potracer its corners are in the table, too.

usage: corners.py [--program target/release/faircurve] [--quick]     after `cargo build --release`
"""

import argparse
import importlib.util
import shutil
import subprocess
import tempfile
from itertools import product
from math import acos, comb, pi
from pathlib import Path

import numpy as np

TextPath = importlib.util.find_spec("matplotlib") and importlib.import_module("matplotlib.textpath").TextPath
potrace = importlib.util.find_spec("potrace") and importlib.import_module("potrace")

SEED, SIZES, SPACINGS = 7, (30, 60, 200), (0.3, 1.0, 2.0, None)  # in D; without a spacing lines have their ends alone
NOISES, PIXELS = {"no noise": 0.0, "D/4": 0.25, "D/2": 0.5}, {"D/2": 0.5, "D": 1.0}
NEAR, APART = 2.0, 4.0  # A corner is found within this, and true corners are this far apart along the outline.
TURN, TRUE_TURN, LEAST_TURN = np.radians((17, 43, 12))  # of corners of the result, of true corners, and of those that do not count
STAR, HEXAGON = np.tile((0.5, 0.2), 5) * np.exp(0.2j * pi * np.arange(10)), 0.5 * np.exp(1j * pi / 3 * np.arange(6))
UTAH, L = (0, 0.9, 1 + 0.25j, 1 + 0.8j, 0.55 + 0.8j, 0.55 + 1j, 1j), (0, 1, 1 + 0.3j, 0.3 + 0.3j, 0.3 + 1j, 1j)
# A contour is a list of pieces, which share their ends. A piece is an array of points, as complex numbers.


def arc(radius, start, end):
    return radius * np.exp(1j * np.linspace(start, end, max(8, int(abs(end - start) * 64))))


def bezier(points, count=64):
    t, degree = np.linspace(0, 1, count), len(points) - 1
    return sum(comb(degree, k) * t**k * (1 - t) ** (degree - k) * point for k, point in enumerate(points))


def rectangle(width, height, radii):
    corners, pieces = (width, width + 1j * height, 1j * height, 0), []
    for k, (corner, radius) in enumerate(zip(corners, radii)):
        pieces.append(np.array([corners[k - 1] + radii[k - 1] * 1j**k, corner - radius * 1j**k]))
        pieces += [corner + radius * 1j**k * (1j - 1) + arc(radius, (k - 1) * pi / 2, k * pi / 2)] if radius else []
    return pieces


def shapes(size):
    heart = [bezier((-0.5j, -0.25 - 0.25j, -0.5, -0.5 + 0.2j)), bezier((-0.5 + 0.2j, -0.5 + 0.5j, -0.05 + 0.5j, 0.2j))]
    drop, moon, touch = acos(3 / 7), acos(0.25), 0.3 * np.exp(1j * acos(3 / 7))
    polygons = ((0, 1, 1 + 1j, 1j), (0, 1, 0.35 + 0.8j), L, UTAH, STAR, HEXAGON)
    contours = [list(np.stack([points, np.roll(points, -1)], axis=1).astype(complex)) for points in polygons]
    contours += [rectangle(1, 0.7, (0, 0, 0, 8 / size)), [np.array((0.5j, -0.5j)), arc(0.5, -pi / 2, pi / 2)]]
    contours += [heart + [-piece[::-1].conj() for piece in heart[::-1]]]
    contours += [[arc(0.3, drop, 2 * pi - drop), np.array((touch.conj(), 0.7)), np.array((0.7, touch))]]
    contours += [[arc(0.5, moon, 2 * pi - moon), 0.25 + arc(0.5, pi + moon, pi - moon)]]
    return [[[size * piece for piece in contour]] for contour in contours]


def round_curves(size, rng):
    angles, frequencies = np.linspace(0, 2 * pi, 6000), np.arange(3, 3 * size)
    circle = 0.5 * size * np.exp(1j * angles)
    pieces = [max(1, 48 / size) * (circle.real + 0.5j * circle.imag), (1 + 0.12 * np.sin((4 if size < 100 else 8) * angles)) * circle]
    for roughness in (0.5, 0.9):  # Coasts have waves of all lengths. No point is farther than this from a circle.
        phases = zip(frequencies, rng.uniform(0, 2 * pi, len(frequencies)))
        rough = sum(k**-1.2 * np.cos(k * angles + phase) for k, phase in phases)
        pieces.append((1 + 2 * roughness / size * rough / np.abs(rough).max()) * circle)
    return [[rectangle(size, 0.7 * size, (8,) * 4)]] + [[[piece]] for piece in pieces]


def glyph(font, letter, size):
    contours = []
    for points, code in TextPath((0, 0), letter, size=size, prop=font).iter_segments(simplify=False):
        points = points[::2] + 1j * points[1::2]
        if code == TextPath.MOVETO:
            contours.append([])
            start = last = points
        last = np.concatenate([last[-1:], start if code == TextPath.CLOSEPOLY else points])
        if np.abs(last - last[0]).max() > 1e-9 * size:
            contours[-1].append(last if len(last) == 2 else bezier(last, 24))
    return [contour for contour in contours if len(contour) > 1]


def true_corners(outline):
    """The corners that count, and those that do not."""
    corners = {True: [], False: []}
    for contour in outline:
        ends = np.cumsum([0] + [np.abs(np.diff(piece)).sum() for piece in contour])
        turns = np.abs([np.angle((b[1] - b[0]) / (a[-1] - a[-2])) for a, b in zip(contour[-1:] + contour, contour)])
        own = np.flatnonzero(turns > LEAST_TURN)
        for k in own:
            away = np.abs(ends[k] - ends[own[own != k]])
            is_apart = np.minimum(away, ends[-1] - away).min(initial=np.inf) >= APART
            corners[bool(is_apart and turns[k] > TRUE_TURN)].append(contour[k][0])
    return np.array(corners[True]), np.array(corners[False])


def sampled(contour, spacing):
    points = []
    for piece in contour:
        s = np.r_[0, np.cumsum(np.abs(np.diff(piece)))]
        count = max(1, round(s[-1] / spacing)) if spacing else 1 if len(piece) == 2 else len(piece) // 3
        points.append(np.interp(np.linspace(0, s[-1], count, endpoint=False), s, piece))
    return np.concatenate(points)


def bitmap(outline, pixel):
    """The pixels with centres inside, and the corner of the first one."""
    contours = [sampled(contour, pixel / 3) / pixel for contour in outline]
    ends = np.concatenate([np.stack([points, np.roll(points, -1)]) for points in contours], axis=1)
    first = np.floor(ends.real.min()) - 1 + 1j * (np.floor(ends.imag.min()) - 1)
    ends -= first + 0.5 + 0.5j
    counts = np.zeros((int(ends.imag.max()) + 3, int(ends.real.max()) + 3), int)
    a, b = ends[:, np.ceil(ends[0].imag) != np.ceil(ends[1].imag)]  # A short edge crosses one row of centres at most.
    rows = np.floor(np.maximum(a.imag, b.imag)).astype(int)
    x = a.real + (rows - a.imag) / (b.imag - a.imag) * (b.real - a.real)
    np.add.at(counts, (rows, np.ceil(x).astype(int)), 1)
    return np.cumsum(counts, axis=1) % 2 == 1, first * pixel


def traced(pixels):
    """The turns of the outlines of pixels, which are on their left. Pixels that touch at a corner alone stay apart."""
    up, right = np.diff(pixels.astype(int), axis=0), np.diff(pixels.astype(int), axis=1)
    sides = ((up > 0, 1j, 1), (up < 0, 1 + 1j, -1), (right < 0, 1, 1j), (right > 0, 1 + 1j, -1j))
    edges = {(complex(x, y) + start, step): False for which, start, step in sides for y, x in np.argwhere(which).tolist()}
    for point, step in edges:
        contour = []
        while not edges[point, step]:
            edges[point, step] = True
            point, last = point + step, step
            step = next(last * turn for turn in (1j, 1, -1j) if (point, last * turn) in edges)
            contour += [point] * (step != last)
        if np.abs(np.diff(contour)).sum() > 8:  # no speck
            yield np.array(contour)


def cases(quick, rng):
    """A class, a column, an outline, its curves, and the corners of potrace."""
    outlines = [(f"shapes of {size} D", outline) for size in SIZES for outline in shapes(size)]
    outlines += [("round curves", outline) for size in SIZES for outline in round_curves(size, rng)]
    outlines += [("round curves", [[arc(radius, 0, 2 * pi)]]) for radius in (6, 10, 30, 100)]
    glyphs = list(product(("DejaVu Sans", "DejaVu Serif"), "ABDEKMRSaegkqt&258"))[:: 4 if quick else 1] if TextPath else []
    outlines += [(f"glyphs of {size} D", glyph(*which, size)) for size in SIZES for which in glyphs]
    for kind, outline in outlines:
        is_glyph = kind.startswith("glyphs")
        for angle in rng.uniform(0, 2 * pi, 1 if is_glyph or quick else 2):
            turned = [[piece * np.exp(1j * angle) for piece in contour] for contour in outline]
            for spacing, (name, noise) in product(SPACINGS, NOISES.items()):
                if not is_glyph or spacing in (0.3, 1.0) or not spacing and not noise:  # Details of glyphs are finer than 2 D.
                    curves = [sampled(contour, spacing) for contour in turned]
                    moves = [np.sqrt(rng.random(len(curve))) * np.exp(2j * pi * rng.random(len(curve))) for curve in curves]
                    yield kind, name, turned, [curve + noise * move for curve, move in zip(curves, moves)], []
            for name, pixel in PIXELS.items():
                pixels, first = bitmap(turned, pixel)
                yield kind, f"pixels {name}", turned, [first + pixel * curve for curve in traced(pixels)], []
                if potrace:
                    paths = potrace.Bitmap(~pixels).trace(turdsize=0, alphamax=1.0, opticurve=False)
                    corners = [complex(part.c.x, part.c.y) for path in paths for part in path.segments if part.is_corner]
                    yield kind, f"potrace {name}", turned, [], first + pixel * np.array(corners)


def fitted(program, curves):
    """The corners of each curve that the program fits."""
    with tempfile.TemporaryDirectory() as folder:
        given, result = Path(folder) / "given.csv", Path(folder) / "result.csv"
        rows = (f"{k},{point.real:.6f},{point.imag:.6f},1\n" for k, curve in enumerate(curves) for point in curve.tolist())
        given.write_text("curve,x,y,closed\n" + "".join(rows))
        options = "--within 1 --corners auto --as bezier --device cpu -q"
        if subprocess.run([program, "fit", given, "-o", result, *options.split()]).returncode:
            raise SystemExit(f"{program} has failed.")
        k, x, y = np.loadtxt(result, delimiter=",", skiprows=1, usecols=(0, 1, 2), unpack=True)
    for points in np.split(x + 1j * y, np.searchsorted(k, np.arange(1, len(curves)))):
        points = points[: len(points) // 3 * 3].reshape(-1, 3)  # The last point may repeat the first.
        turns = np.angle((points[:, 1] - points[:, 0]) * (points[:, 0] - np.roll(points[:, 2], 1)).conj())
        yield points[np.abs(turns) > TURN, 0]


def scored(found, true, ignored):
    """How many corners are found, missed and invented, and the distances of those found."""
    distances = []
    for corner in true:
        away = np.abs(found - corner)
        if away.min(initial=np.inf) <= NEAR:
            distances.append(away.min())
            found = np.delete(found, away.argmin())
    invented = (np.abs(found[:, None] - ignored).min(axis=1, initial=np.inf) > NEAR).sum()
    return np.array([len(distances), len(true) - len(distances), invented]), distances


built = Path(__file__).resolve().parents[1] / "target" / "release" / "faircurve"
parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--program", default=shutil.which(built) or "faircurve", help="default: target/release/faircurve, or that on PATH")
parser.add_argument("--quick", action="store_true", help="one rotation, and a quarter of the glyphs")
arguments = parser.parse_args()
if not shutil.which(arguments.program):
    raise SystemExit(f"There is no program {arguments.program}: `cargo build --release` builds it, or --program names it.")
if not TextPath:
    print("Glyphs are left out, for matplotlib is missing: `pip install matplotlib`.")
tried = list(cases(arguments.quick, np.random.default_rng(SEED)))
corners = fitted(shutil.which(arguments.program), [curve for case in tried for curve in case[3]])
tallies, distances = {}, {}
for kind, column, outline, curves, at_potrace in tried:
    counts, away = scored(np.concatenate([at_potrace, *(next(corners) for _ in curves)]), *true_corners(outline))
    distances.setdefault(column, []).extend(away)
    for row in (kind, "all"):
        tallies[row, column] = tallies.get((row, column), 0) + counts
row = lambda title, cells: print("| " + " | ".join([title, *cells]) + " |")
row("found/missed/invented", distances)
row("---", ["---"] * len(distances))
for kind in dict.fromkeys([case[0] for case in tried] + ["all"]):
    row(kind, ["/".join(map(str, tallies[kind, column])) for column in distances])
for title, part in (("median", 0.5), ("95 %", 0.95)):
    row(f"distance in D, {title}", [f"{np.quantile(away, part):.2f}" for away in distances.values()])
found, missed, invented = sum(tallies["all", column] for column in distances if "potrace" not in column)
print(f"{missed} of {found + missed} corners are missed, and {invented} are invented.")
