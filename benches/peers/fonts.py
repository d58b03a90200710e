"""Takes the outlines of a font through `faircurve bezier --simplify`, makes a font of them, and measures what became of them.

    python benches/peers/fonts.py FONT.ttf [--glyphs 3000] [--first 4E00] [--tolerance T] [--free] [--program PATH] [--keep FOLDER]

It needs fonttools and shapely. The drawing has a path a glyph, in units of the font, the new font has cubics (CFF), which is opened
again. Deviations are sampled both ways, from points along a glyph to the chords of the other outline, which are a hundredth of a unit
from it at most, and boxes are those around such chords. The drawing has fractions of a unit, the font has whole ones.
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile
import time
from xml.etree import ElementTree

import numpy as np
import shapely
from fontTools.fontBuilder import FontBuilder
from fontTools.pens.recordingPen import DecomposingRecordingPen, RecordingPen
from fontTools.pens.svgPathPen import SVGPathPen
from fontTools.pens.t2CharStringPen import T2CharStringPen
from fontTools.svgLib.path import parse_path
from fontTools.ttLib import TTFont

FLATNESS = 0.01


def glyphs_of(font, first: str | None, most: int | None) -> list:
    """The names of glyphs with outlines, those of code points from the first on, or all."""
    order = font.getGlyphOrder()
    if first:
        table = font.getBestCmap()
        order = dict.fromkeys(table[code] for code in sorted(table) if code >= int(first, 16))
    outlines = font.getGlyphSet()
    found = []
    for name in order:
        if len(found) == most:
            break
        if name != ".notdef" and recorded(outlines, name).value:
            found.append(name)
    return found


def recorded(outlines, name: str) -> DecomposingRecordingPen:
    """What a glyph draws, without components."""
    pen = DecomposingRecordingPen(outlines)
    outlines[name].draw(pen)
    return pen


def drawn(path: pathlib.Path) -> dict:
    """What the paths of a drawing draw, by their names."""
    found = {}
    for element in ElementTree.parse(path).getroot().iter():
        if element.tag.endswith("path"):
            found[element.get("id")] = pen = RecordingPen()
            parse_path(element.get("d"), pen)
    return found


def pieces(pen) -> tuple:
    """The segments of outlines as control points of cubics, and how many of them are curves."""
    found, curves, start, here = [], 0, None, None
    for verb, points in pen.value:
        points = [np.array(point, float) for point in points]
        if verb == "moveTo":
            start = here = points[0]
        elif verb in ("closePath", "endPath"):
            if np.abs(here - start).max() > FLATNESS:
                found.append(line(here, start))
            here = start
        elif verb == "lineTo":
            found.append(line(here, points[0]))
        elif verb == "curveTo":
            found.append(np.array([here, *points]))
            curves += 1
        else:
            # Between two handles of TrueType lies their middle.
            for number, handle in enumerate(points[:-1]):
                end = points[-1] if number == len(points) - 2 else (handle + points[number + 1]) / 2
                found.append(np.array([here, (here + 2 * handle) / 3, (2 * handle + end) / 3, end]))
                curves += 1
                here = end
        here = points[-1] if points else here
    return found, curves


def line(start, end):
    """A line as a cubic."""
    return np.array([start, start + (end - start) / 3, start + 2 * (end - start) / 3, end])


def flat(cubics: list):
    """Edges along cubics."""
    edges = []
    for cubic in cubics:
        bend = np.hypot(*np.diff(cubic, 2, axis=0).T).max()
        t = np.linspace(0, 1, max(4, int(np.ceil(np.sqrt(0.75 * bend / FLATNESS)))) + 1)[:, None]
        s = 1 - t
        points = s**3 * cubic[0] + 3 * s * s * t * cubic[1] + 3 * s * t * t * cubic[2] + t**3 * cubic[3]
        edges.append(np.stack([points[:-1], points[1:]], 1))
    return np.concatenate(edges)


def deviation(one, other) -> float:
    """The largest distance of a point on one outline's edges from the other one's, and of the other one's from this."""
    most = 0.0
    for own, others in ((one, other), (other, one)):
        tree = shapely.STRtree(shapely.linestrings(others))
        _, lengths = tree.query_nearest(shapely.points(own[:, 0]), return_distance=True, all_matches=False)
        most = max(most, lengths.max())
    return float(most)


def box(edges):
    """The box around edges. Single points, which fonts have as anchors, are outside."""
    return np.concatenate([edges.min((0, 1)), edges.max((0, 1))])


def make_font(path: pathlib.Path, font, outlines: dict) -> None:
    """An OTF of outlines with the widths and the characters of a font."""
    order = [".notdef", *outlines]
    units, widths = font["head"].unitsPerEm, font["hmtx"]
    strings = {}
    for name in order:
        pen = T2CharStringPen(widths[name][0], None)
        if name in outlines:
            outlines[name].replay(pen)
        strings[name] = pen.getCharString()
    builder = FontBuilder(units, isTTF=False)
    builder.setupGlyphOrder(order)
    builder.setupCharacterMap({code: name for code, name in font.getBestCmap().items() if name in outlines})
    builder.setupCFF("Fewer", {}, strings, {})
    builder.setupHorizontalMetrics({name: widths[name] for name in order})
    builder.setupHorizontalHeader(ascent=font["hhea"].ascent, descent=font["hhea"].descent)
    builder.setupNameTable({"familyName": "Fewer", "styleName": "Regular"})
    builder.setupOS2()
    builder.setupPost()
    builder.save(path)


def compare(given: dict, new: dict) -> dict:
    """What became of outlines."""
    before, after = ({name: pieces(pen) for name, pen in own.items()} for own in (given, new))
    missing = [name for name in before if before[name][0] and not after.get(name, ([],))[0]]
    edges = {name: (flat(before[name][0]), flat(after[name][0])) for name in after if before[name][0] and after[name][0]}
    far = {name: deviation(*both) for name, both in edges.items()}
    boxes = {name: np.abs(box(one) - box(other)).max() for name, (one, other) in edges.items()}
    worst = max(far, key=far.get)
    segments = [sum(len(own[name][0]) for name in own) for own in (before, after)]
    curves = [sum(own[name][1] for name in own) for own in (before, after)]
    return {
        "glyphs": len(far),
        "missing": len(missing),
        "segments": f"{segments[0]:,} to {segments[1]:,}",
        "curves of these": f"{curves[0]:,} to {curves[1]:,}",
        "deviation": f"{far[worst]:.3f} in {worst}, median {np.median(list(far.values())):.3f}",
        "boxes within 1": f"{sum(b <= 1 for b in boxes.values()):,}",
        "farthest box": f"{max(boxes.values()):.2f} in {max(boxes, key=boxes.get)}",
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("font", type=pathlib.Path)
    parser.add_argument("--glyphs", type=int, help="how many, else all")
    parser.add_argument("--first", help="the first code point, such as 4E00")
    parser.add_argument("--tolerance", type=float, help="in units of the font, else 1/2048 em")
    parser.add_argument("--free", action="store_true", help="leaves out --extremes")
    parser.add_argument("--program", default="target/release/faircurve")
    parser.add_argument("--keep", type=pathlib.Path, help="a folder for the drawings and the font")
    given = parser.parse_args()
    # Collections have more than one font.
    font = TTFont(given.font, fontNumber=0)
    tolerance = given.tolerance or font["head"].unitsPerEm / 2048
    outlines = font.getGlyphSet()
    with tempfile.TemporaryDirectory() as folder:
        folder = given.keep or pathlib.Path(folder)
        folder.mkdir(exist_ok=True)
        with (folder / "glyphs.svg").open("w") as svg:
            svg.write('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 2048 2048">\n')
            for name in glyphs_of(font, given.first, given.glyphs):
                pen = SVGPathPen(outlines)
                outlines[name].draw(pen)
                svg.write(f'<path id="{name}" d="{pen.getCommands()}"/>\n')
            svg.write("</svg>\n")
        command = [given.program, "bezier", str(folder / "glyphs.svg"), "-o", str(folder / "fewer.svg"), "--simplify"]
        command += ["--tolerance", f"{tolerance:g}", "-q", "--force", *([] if given.free else ["--extremes"])]
        start = time.perf_counter()
        done = subprocess.run(command, capture_output=True, text=True)
        seconds = time.perf_counter() - start
        if done.returncode not in (0, 1):
            sys.exit(done.stderr.strip().splitlines()[-1])
        before, fewer = drawn(folder / "glyphs.svg"), drawn(folder / "fewer.svg")
        make_font(folder / "new.otf", font, fewer)
        opened = TTFont(folder / "new.otf")
        again = {name: recorded(opened.getGlyphSet(), name) for name in opened.getGlyphOrder() if name in fewer}
        how = "" if given.free else ", joints at extremes"
        print(f"{given.font.name}, T = {tolerance:g} of {font['head'].unitsPerEm}{how}: {seconds:.1f} s, exit status {done.returncode}")
        for name, new in (("drawing", fewer), ("font", again)):
            print(f"  {name:10}", ", ".join(f"{key} {value}" for key, value in compare(before, new).items()), flush=True)


if __name__ == "__main__":
    main()
