"""Makes the gallery: runs the program with every command that the page shows, draws what it wrote, and writes the page.

    python docs/gallery.py PROGRAM

Commands run in a folder that is removed, with a copy of examples/data. Pictures go to docs/pictures, the page to docs/gallery.md.
A picture is a file that the program wrote, or is drawn here from such files. One of more than 200 kB becomes PNG.
"""

import csv
import gzip
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Callable

import resvg_py
import svgelements

HERE = Path(__file__).parent
LARGEST = 200_000  # bytes of an SVG
BLUE, ORANGE, GREEN, PURPLE, GREY, INK = "#0072b2", "#d55e00", "#009e73", "#7e57c2", "#b0b0b0", "#222233"
LANDS = ["#e9d8a6", "#a3c9a8", "#f4b6a6", "#b8c4e6", "#f3cf8b", "#cfb7dc", "#9fd0cb"]
VIRIDIS = ["#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725"]
WARM = ["#2b83ba", "#7fc6a4", "#e8e36a", "#fdae61", "#d7191c"]

Point = tuple[float, ...]
Line = list[Point]


# What files hold.


def rows(path: str) -> list[dict[str, str]]:
    """The rows of a CSV file."""
    with gzip.open(path, "rt") if path.endswith(".gz") else open(path) as file:
        return list(csv.DictReader(file))


def curves(path: str, *columns: str, by: str = "curve") -> dict[str, Line]:
    """The columns of a CSV file, curve by curve."""
    found: dict[str, Line] = {}
    for row in rows(path):
        found.setdefault(row[by], []).append(tuple(float(row[name]) for name in columns))
    return found


def shapes(path: str) -> list[tuple[str, str, list[Line]]]:
    """The name, kind and lines of each feature of a GeoJSON file."""
    with gzip.open(path, "rt") if path.endswith(".gz") else open(path) as file:
        features = json.load(file)["features"]
    found = []
    for feature in features:
        geometry = feature["geometry"] or {"type": "", "coordinates": []}
        lines: list[Line] = []

        def take(part: list) -> None:
            if part and isinstance(part[0], (int, float)):
                return
            if part and isinstance(part[0][0], (int, float)):
                lines.append([tuple(place) for place in part])
            else:
                for inner in part:
                    take(inner)

        take(geometry["coordinates"])
        found.append((str((feature.get("properties") or {}).get("name", "")), geometry["type"], lines))
    return found


# Drawing.


def ramp(colours: list[str], share: float) -> str:
    """The colour at a share from 0 to 1."""
    place = min(max(share, 0.0), 1.0) * (len(colours) - 1)
    low = min(int(place), len(colours) - 2)
    mixed = [
        round(int(colours[low][i : i + 2], 16) * (1 - place + low) + int(colours[low + 1][i : i + 2], 16) * (place - low))
        for i in (1, 3, 5)
    ]
    return "#" + "".join(f"{value:02x}" for value in mixed)


class Drawing:
    """An SVG picture of points with y upwards, within a box."""

    def __init__(self, box: tuple[float, float, float, float], width: int = 1000, margin: int = 20, paper: str = "#ffffff"):
        x0, y0, x1, y1 = box
        self.scale = (width - 2 * margin) / (x1 - x0)
        self.height = (y1 - y0) * self.scale + 2 * margin
        self.shift = (margin - x0 * self.scale, margin + y1 * self.scale)
        self.parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {self.height:.0f}" width="{width}" height="{self.height:.0f}" '
            'fill="none" stroke-linecap="round" stroke-linejoin="round" font-family="DejaVu Sans, sans-serif" font-size="16">',
            f'<rect width="100%" height="100%" fill="{paper}"/>',
        ]

    def place(self, point: Point) -> tuple[float, float]:
        return self.shift[0] + point[0] * self.scale, self.shift[1] - point[1] * self.scale

    def data(self, line: Line, closed: bool = False) -> str:
        """Path data to a tenth of a pixel, without what does not move."""
        text, before = [], (0, 0)
        for index, point in enumerate(line):
            now = tuple(round(10 * value) for value in self.place(point))
            if index == 0:
                text.append(f"M{now[0] / 10:g} {now[1] / 10:g}")
            elif now != before:
                text.append(f"l{(now[0] - before[0]) / 10:g} {(now[1] - before[1]) / 10:g}")
            before = now
        return "".join(text) + ("z" if closed else "")

    def line(self, *lines: Line, stroke: str = BLUE, width: float = 2, closed: bool = False, fill: str = "none", more: str = "") -> None:
        text = "".join(self.data(line, closed) for line in lines if len(line) > 1)
        self.parts.append(f'<path d="{text}" stroke="{stroke}" stroke-width="{width}" fill="{fill}" fill-rule="evenodd" {more}/>')

    def ribbon(self, line: Line, values: list[float], colours: list[str], low: float, high: float, width: float = 4, steps: int = 24) -> None:
        """A line in the colours of its values, one path a colour and run."""
        levels = [round(steps * min(max((value - low) / (high - low), 0), 1)) for value in values]
        start = 0
        for index in range(1, len(line)):
            if index == len(line) - 1 or levels[index] != levels[start]:
                self.line(line[start : index + 1], stroke=ramp(colours, levels[start] / steps), width=width)
                start = index

    def dots(self, points: Line, fill: str = INK, radius: float = 3) -> None:
        circles = (f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}"/>' for x, y in map(self.place, points))
        self.parts.append(f'<g fill="{fill}">' + "".join(circles) + "</g>")

    def text(self, point: Point, text: str, fill: str = INK, anchor: str = "start") -> None:
        x, y = self.place(point)
        self.parts.append(f'<text x="{x:.0f}" y="{y:.0f}" fill="{fill}" text-anchor="{anchor}">{text}</text>')

    def key(self, entries: list[tuple[str, str]], x: int = 24, y: int = 34) -> None:
        for index, (colour, text) in enumerate(entries):
            at = y + 24 * index
            self.parts.append(f'<path d="M{x} {at - 5}h26" stroke="{colour}" stroke-width="4"/>')
            self.parts.append(f'<text x="{x + 36}" y="{at}" fill="{INK}">{text}</text>')

    def svg(self) -> str:
        return "\n".join(self.parts) + "\n</svg>\n"


def box(*lines: Line, margin: float = 0.0) -> tuple[float, float, float, float]:
    xs, ys = [p[0] for line in lines for p in line], [p[1] for line in lines for p in line]
    more = margin * max(max(xs) - min(xs), max(ys) - min(ys))
    return min(xs) - more, min(ys) - more, max(xs) + more, max(ys) + more


def within(line: Line, x0: float, y0: float, x1: float, y1: float) -> bool:
    return any(x0 <= p[0] <= x1 and y0 <= p[1] <= y1 for p in line)


def equal_earth(point: Point) -> Point:
    """Šavrič, Patterson and Jenny's projection (2018), which keeps areas."""
    a = (1.340264, -0.081106, 0.000893, 0.003796)
    angle = math.asin(math.sqrt(3) / 2 * math.sin(math.radians(point[1])))
    slope = a[0] + 3 * a[1] * angle**2 + 7 * a[2] * angle**6 + 9 * a[3] * angle**8
    x = 2 * math.sqrt(3) * math.radians(point[0]) * math.cos(angle) / (3 * slope)
    return x, angle * (a[0] + a[1] * angle**2 + a[2] * angle**6 + a[3] * angle**8)


@dataclass
class Globe:
    """The Earth from afar, above a place."""

    lon: float
    lat: float

    def at(self, point: Point) -> tuple[float, float, float]:
        """x, y, and how far the point is in front of the rim."""
        lon, lat, up = math.radians(point[0] - self.lon), math.radians(point[1]), math.radians(self.lat)
        x, y, z = math.cos(lat) * math.sin(lon), math.sin(lat), math.cos(lat) * math.cos(lon)
        return x, y * math.cos(up) - z * math.sin(up), y * math.sin(up) + z * math.cos(up)

    def seen(self, line: Line) -> list[list[int]]:
        """The indices of the points in front, run by run."""
        runs: list[list[int]] = [[]]
        for index, point in enumerate(line):
            if self.at(point)[2] > 0:
                runs[-1].append(index)
            elif runs[-1]:
                runs.append([])
        return [run for run in runs if len(run) > 1]

    def lines(self, line: Line) -> list[Line]:
        return [[self.at(line[i])[:2] for i in run] for run in self.seen(line)]

    def ring(self, line: Line) -> Line:
        """A ring, with what lies behind moved to the rim; nothing if all of it does."""
        places = [self.at(point) for point in line]
        if all(place[2] <= 0 for place in places):
            return []
        # Edges over the rim are divided.
        divided: Line = []
        for index, (start, end) in enumerate(zip(line, line[1:] + line[:1])):
            parts = 8 if (places[index][2] > 0) != (places[(index + 1) % len(line)][2] > 0) and abs(start[0] - end[0]) < 180 else 1
            divided += [(start[0] + (end[0] - start[0]) * k / parts, start[1] + (end[1] - start[1]) * k / parts) for k in range(parts)]
        places = [self.at(point) for point in divided]
        ring: Line = []
        for index, (x, y, z) in enumerate(places):
            if z > 0:
                ring.append((x, y))
                continue
            angle = math.atan2(y, x)
            if places[index - 1][2] <= 0:
                before = math.atan2(*places[index - 1][1::-1])
                way = (angle - before + math.pi) % math.tau - math.pi
                ring += [(math.cos(before + way * k / 8), math.sin(before + way * k / 8)) for k in range(1, 8)]
            ring.append((math.cos(angle), math.sin(angle)))
        return ring

    def draw(self, drawing: Drawing, land: str, fill: str = "#e8dfc8", sea: str = "#dcebf5") -> None:
        rim = [(math.cos(a / 60 * math.pi), math.sin(a / 60 * math.pi)) for a in range(120)]
        drawing.line(rim, fill=sea, stroke="#8aa5b8", width=1.5, closed=True)
        for lon in range(-180, 180, 30):
            drawing.line(*self.lines([(lon, lat) for lat in range(-90, 91, 3)]), stroke="#c3d6e2", width=0.8)
        for lat in range(-60, 61, 30):
            drawing.line(*self.lines([(lon, lat) for lon in range(-180, 181, 3)]), stroke="#c3d6e2", width=0.8)
        for name, _, lines in shapes(land):
            drawing.line(*(self.ring(line) for line in lines), fill=fill, stroke="#ffffff", width=0.8, closed=True)


def colouring(lands: list[tuple[str, str, list[Line]]]) -> list[int]:
    """A colour for each land, another than its neighbours': those that share a vertex."""
    owners: dict[Point, set[int]] = {}
    for index, (_, _, lines) in enumerate(lands):
        for line in lines:
            for point in line:
                owners.setdefault(point, set()).add(index)
    near: list[set[int]] = [set() for _ in lands]
    for shared in owners.values():
        for index in shared:
            near[index] |= shared - {index}
    chosen: list[int] = []
    for index in range(len(lands)):
        taken = {chosen[other] for other in near[index] if other < index}
        free = [(index + k) % len(LANDS) for k in range(len(LANDS)) if (index + k) % len(LANDS) not in taken]
        chosen.append(free[0] if free else 0)
    return chosen


# The pictures that are drawn here.


def world() -> str:
    lands = [land for land in shapes("world.geojson") if land[0]]  # without the layer of all land
    frame = [equal_earth((lon, lat)) for lon, lat in [(-180, y) for y in range(-90, 91, 3)] + [(180, y) for y in range(90, -91, -3)]]
    drawing = Drawing(box(frame), width=1100)
    drawing.line(frame, fill="#dcebf5", stroke="#8aa5b8", width=1, closed=True)
    for (name, kind, lines), colour in zip(lands, colouring(lands)):
        if kind.endswith("Polygon"):
            drawing.line(*([equal_earth(p) for p in line] for line in lines), fill=LANDS[colour], stroke="#ffffff", width=0.8, closed=True)
    return drawing.svg()


def aegean() -> str:
    frame = (19.5, 34.5, 30.2, 41.8)
    flat = math.cos(math.radians(38))
    drawing = Drawing((0, frame[1], 2.06 * (frame[2] - frame[0]) * flat, frame[3]), width=1100)
    for side, (path, colour) in enumerate([("examples/data/countries-50m.geojson.gz", "#777777"), ("smooth.geojson", BLUE)]):
        shift = side * 1.06 * (frame[2] - frame[0]) * flat
        corners = [drawing.place((shift, frame[3])), drawing.place((shift + (frame[2] - frame[0]) * flat, frame[1]))]
        (x0, y0), (x1, y1) = corners
        drawing.parts.append(f'<clipPath id="c{side}"><rect x="{x0}" y="{y0}" width="{x1 - x0}" height="{y1 - y0}"/></clipPath>')
        drawing.parts.append(f'<rect x="{x0}" y="{y0}" width="{x1 - x0}" height="{y1 - y0}" fill="#f4f8fb" stroke="#cccccc"/>')
        lines = [line for _, _, lines in shapes(path) for line in lines if within(line, *frame)]
        moved = [[((p[0] - frame[0]) * flat + shift, p[1]) for p in line if abs(p[0] - 25) < 15 and abs(p[1] - 38) < 12] for line in lines]
        drawing.line(*moved, stroke=colour, width=1.8, more=f'clip-path="url(#c{side})"')
    return drawing.svg()


def coarse() -> str:
    globe = Globe(15, 35)
    drawing = Drawing((-1.02, -1.02, 1.02, 1.02), width=760)
    globe.draw(drawing, "coarse.geojson", fill="#9fcfa4")
    return drawing.svg()


def coast() -> str:
    colours = [ramp(VIRIDIS, share) for share in (0.85, 0.6, 0.35, 0.05)]
    globe = Globe(-42, 72)
    parts = []
    for path in ("d20.geojson", "d50.geojson", "d100.geojson", "d200.geojson"):
        lines = next(lines for name, _, lines in shapes(path) if name == "Greenland")
        parts.append([globe.ring(line) for line in lines])
    drawing = Drawing(box(*parts[0], margin=0.04), width=700, paper="#f4f8fb")
    for lines, colour in zip(parts, colours):
        drawing.line(*lines, stroke=colour, width=2.6, closed=True)
    drawing.key([(colour, f"within {d} km") for colour, d in zip(colours, (20, 50, 100, 200))], x=270, y=420)
    return drawing.svg()


def inner(path: str) -> tuple[str, str]:
    """The view box and the content of an SVG file."""
    text = Path(path).read_text()
    return re.search(r'viewBox="([^"]*)"', text)[1], re.search(r"<svg[^>]*>(.*)</svg>", text, re.S)[1]


def above(*paths: str) -> str:
    """Drawings of one size, one above the other."""
    x, y, width, height = map(float, inner(paths[0])[0].split())
    whole = (1.08 * len(paths) - 0.08) * height
    rows_ = (f'<g transform="translate(0 {1.08 * height * index})">{inner(path)[1]}</g>' for index, path in enumerate(paths))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{x} {y} {width} {whole}" width="1000" height="{1000 * whole / width:.0f}">'
        f'<rect x="{x}" y="{y}" width="100%" height="100%" fill="#fff"/>{"".join(rows_)}</svg>\n'
    )


def traced() -> str:
    return above("examples/data/traced.svg", "clean.svg")


def handles() -> str:
    """The first letters of the sign with their joints and handles, before and after."""
    sides = []
    for path in ("examples/data/lettering.svg", "fewer.svg"):
        letters = re.findall(r'<path id="\w\d"[^>]*?translate\(([-\d.]+) [^>]*? d="([^"]*)"', Path(path).read_text())[:3]
        sides.append([(float(shift), svgelements.Path(data)) for shift, data in letters])
    joints = [(shift + s.end.x, s.end.y) for shift, path in sides[0] for s in path if s.end]
    x0, y0, x1, y1 = box(joints, margin=0.05)
    drawing = Drawing((x0, y0, x0 + 2.05 * (x1 - x0), y1), width=1100)
    for side, letters in enumerate(sides):
        move = lambda p, by: (p.x + by + side * 1.05 * (x1 - x0), p.y)
        for by, path in letters:
            corner = drawing.place((by + side * 1.05 * (x1 - x0), 0))
            placed = path * svgelements.Matrix(drawing.scale, 0, 0, -drawing.scale, *corner)
            drawing.parts.append(f'<path d="{placed.d()}" fill="#dce8f3" stroke="{BLUE}" stroke-width="1.6"/>')
            for s in path:
                for control, end in [(n, m) for n, m in (("control1", "start"), ("control2", "end"), ("control", "start")) if hasattr(s, n)]:
                    drawing.line([move(getattr(s, control), by), move(getattr(s, end), by)], stroke=ORANGE, width=0.9)
                    drawing.dots([move(getattr(s, control), by)], fill=ORANGE, radius=2)
                if s.end:
                    drawing.dots([move(s.end, by)], radius=3.2)
    return drawing.svg()


def octopus() -> str:
    line = curves("octopus.csv", "x", "y")["octopus-58"]
    dots = curves("examples/data/octopus.csv", "x", "y")["octopus-58"]
    drawing = Drawing(box(line, margin=0.04), width=820, paper="#eef6f8")
    drawing.line(line, fill="#c9b3ec", stroke=PURPLE, width=3.5, closed=True)
    drawing.dots(dots, radius=4)
    for x in (45.5, 54.5):
        drawing.dots([(x, 66)], fill="#ffffff", radius=17)
        drawing.dots([(x + 0.5, 65.4)], fill=INK, radius=8)
    return drawing.svg()


def exponents() -> str:
    powers = ["1.5", "2", "4", "20"]
    colours = [ramp(VIRIDIS, share) for share in (0.85, 0.6, 0.35, 0.0)]
    found = [curves(f"nu{power}.csv", "x", "y")["octopus-58"] for power in powers]
    drawing = Drawing(box(*found, margin=0.04), width=900)
    for line, colour in zip(found, colours):
        drawing.line(line, stroke=colour, width=2.6, closed=True)
    drawing.dots(curves("examples/data/octopus.csv", "x", "y")["octopus-58"], radius=4)
    drawing.key([(colour, f"ν = {power}") for colour, power in zip(colours, powers)], x=40, y=60)
    return drawing.svg()


def melted() -> str:
    return above("melted1.svg", "melted3.svg", "melted12.svg")


def storms() -> str:
    globe = Globe(-55, 28)
    drawing = Drawing((-1.02, -1.02, 1.02, 1.02), width=900)
    globe.draw(drawing, "world.geojson")
    for line in curves("storms.csv", "x", "y", "wind").values():
        for run in globe.seen(line):
            drawing.ribbon([globe.at(line[i])[:2] for i in run], [line[i][2] for i in run], WARM, 25, 140, width=1.1, steps=10)
    return drawing.svg()


def storm() -> str:
    fixes = [(float(r["lon"]), float(r["lat"])) for r in rows("examples/data/storms.csv.gz") if r["name"] == "Ivan" and r["year"] == "2004"]
    name = next(r["id"] for r in rows("examples/data/storms.csv.gz") if r["name"] == "Ivan" and r["year"] == "2004")
    line = curves("storms.csv", "x", "y", "speed")[name]
    flat = math.cos(math.radians(25))
    moved = [(p[0] * flat, p[1]) for p in line]
    drawing = Drawing(box(moved, margin=0.06), width=1000, paper="#f4f8fb")
    for _, _, lines in shapes("world.geojson"):
        near = [[(p[0] * flat, p[1]) for p in part] for part in lines if within(part, -110, 0, -20, 50)]
        drawing.line(*near, fill="#e8dfc8", stroke="#ffffff", width=1, closed=True)
    drawing.ribbon(moved, [p[2] / 1000 for p in line], WARM, 5, 45, width=6)
    for step in range(5):
        drawing.key([(ramp(WARM, step / 4), f"{5 + 10 * step} km/h")], x=800, y=60 + 24 * step)
    drawing.dots([(p[0] * flat, p[1]) for p in fixes], radius=2.2)
    return drawing.svg()


def routes() -> str:
    globe = Globe(-30, 42)
    drawing = Drawing((-1.02, -1.02, 1.02, 1.02), width=820)
    globe.draw(drawing, "world.geojson")
    lines = curves("routes.csv", "x", "y")
    for index, line in enumerate(lines.values()):
        drawing.line(*globe.lines(line), stroke=ramp(["#c2185b", ORANGE, PURPLE], index / (len(lines) - 1)), width=2.2)
    ends = [p for line in curves("examples/data/routes.csv", "lon", "lat").values() for p in line]
    drawing.dots([globe.at(p)[:2] for p in ends if globe.at(p)[2] > 0], radius=4)
    return drawing.svg()


def robots() -> str:
    found = curves("robots.csv", "x", "y")
    asked = curves("examples/data/robots.csv", "x", "y")
    drawing = Drawing((-1, -1, 51, 30), width=1000, paper="#fbfaf7")
    with open("examples/data/obstacles.geojson") as file:
        for feature in json.load(file)["features"]:
            geometry, grown = feature["geometry"], 0.5 * 2 * drawing.scale
            if geometry["type"] == "Point":
                x, y = drawing.place(geometry["coordinates"])
                r = feature["properties"]["radius"] * drawing.scale
                drawing.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{r + grown / 2:.1f}" fill="#eee6da"/><circle cx="{x:.1f}" cy="{y:.1f}" r="{r:.1f}" fill="#b7a98f"/>')
            else:
                drawing.line(geometry["coordinates"][0], fill="#eee6da", stroke="#eee6da", width=grown, closed=True)
                drawing.line(geometry["coordinates"][0], fill="#b7a98f", stroke="none", closed=True)
    for (name, line), colour in zip(found.items(), (BLUE, ORANGE, GREEN, PURPLE)):
        drawing.line(asked[name], stroke=colour, width=1, more='stroke-dasharray="2 6"')
        drawing.line(line, stroke=colour, width=4)
        drawing.dots(asked[name], fill=colour, radius=5)
    return drawing.svg()


def race() -> str:
    track = [tuple(float(r[k]) for k in ("x", "y", "corridor_left", "corridor_right")) for r in rows("examples/data/circuit.csv")]
    sides: list[Line] = [[], []]
    for index, (x, y, left, right) in enumerate(track):
        before, after = track[index - 1], track[(index + 1) % len(track)]
        along = math.hypot(after[0] - before[0], after[1] - before[1])
        normal = (-(after[1] - before[1]) / along, (after[0] - before[0]) / along)
        sides[0].append((x + left * normal[0], y + left * normal[1]))
        sides[1].append((x - right * normal[0], y - right * normal[1]))
    line = curves("race.csv", "x", "y", "v")["club"]
    drawing = Drawing(box(*sides, margin=0.03), width=1000, paper="#e5efdc")
    drawing.line(*sides, fill="#d0d0d4", stroke="#ffffff", width=2.5, closed=True)
    speeds = [p[2] for p in line]
    drawing.ribbon(line, speeds, WARM[::-1], min(speeds), max(speeds), width=4.5)
    for step in range(6):
        drawing.key([(ramp(WARM[::-1], step / 5), f"{min(speeds) + (max(speeds) - min(speeds)) * step / 5:.0f} m/s")], x=24, y=34 + 24 * step)
    return drawing.svg()


def dubins() -> str:
    found = curves("park.csv", "x", "y")
    drawing = Drawing(box(*found.values(), margin=0.03), width=1000)
    for index, line in enumerate(found.values()):
        drawing.line(line, stroke=ramp([BLUE, PURPLE, "#c2185b", ORANGE, GREEN, BLUE], index / len(found)), width=2.6)
    drawing.dots([next(iter(found.values()))[0], next(iter(found.values()))[-1]], radius=7)
    return drawing.svg()


def tracts() -> str:
    """The bundle from its side, coloured as usual: left to right red, front to back green, up and down blue."""
    before, after = (curves(path, "x", "y", "z") for path in ("raw.csv", "smooth.csv"))
    lines = [[(p[0], p[2]) for p in line] for line in after.values()]
    x0, y0, x1, y1 = box(*lines, margin=0.03)
    drawing = Drawing((x0, y0, x0 + 2.04 * (x1 - x0), y1), width=1100, paper="#101018")
    for side, found in enumerate((before, after)):
        for line in found.values():
            moved = [(p[0] + side * 1.04 * (x1 - x0), p[2]) for p in line]
            for k in range(0, len(line) - 1, 2):
                end = min(k + 3, len(line))
                d = [abs(line[end - 1][c] - line[k][c]) for c in range(3)]
                size = math.hypot(*d) or 1
                colour = "#" + "".join(f"{round(50 + 205 * value / size):02x}" for value in d)
                drawing.line(moved[k:end], stroke=colour, width=1)
    return drawing.svg()


def from_above(point: Point, tilt: float = 38.0) -> tuple[float, float, float]:
    """x, y and depth of a parallel view."""
    up = math.radians(tilt)
    x, y, z = point
    return x, y * math.sin(up) + z * math.cos(up), -y * math.cos(up) + z * math.sin(up)


def torus() -> str:
    found = curves("torus.csv", "x", "y", "z")
    drawing = Drawing((-4.2, -3.4, 4.2, 3.4), width=900, paper="#fbfaf7")
    around = lambda u, v: ((3 + math.cos(v)) * math.cos(u), (3 + math.cos(v)) * math.sin(u), math.sin(v))
    front = lambda u, v: from_above((math.cos(v) * math.cos(u), math.cos(v) * math.sin(u), math.sin(v)))[2] > 0
    tiles = []
    for i in range(72):
        for k in range(28):
            us, vs = (math.tau * (i + a) / 72 for a in (0, 1, 1, 0)), (math.tau * (k + a) / 28 for a in (0, 0, 1, 1))
            corners = [from_above(around(u, v)) for u, v in zip(us, vs)]
            u, v = math.tau * (i + 0.5) / 72, math.tau * (k + 0.5) / 28
            normal = (math.cos(v) * math.cos(u), math.cos(v) * math.sin(u), math.sin(v))
            if front(u, v):
                light = 0.45 + 0.55 * max(0.0, (-0.35 * normal[0] - 0.25 * normal[1] + 0.9 * normal[2]))
                tiles.append((sum(c[2] for c in corners), [c[:2] for c in corners], ramp(["#5d7488", "#dbe7ef", "#ffffff"], light)))
    for _, corners, colour in sorted(tiles):
        drawing.line(corners, fill=colour, stroke=colour, width=0.6, closed=True)
    def visible(x: float, y: float, z: float) -> bool:
        return front(math.atan2(y, x), math.atan2(z, math.hypot(x, y) - 3))

    for hidden in (True, False):
        for line, colour in zip(found.values(), (BLUE, "#c2185b", GREEN)):
            runs: list[Line] = [[]]
            for point in [*line, line[0]]:
                if visible(*point) != hidden:
                    runs[-1].append(from_above(point)[:2])
                elif runs[-1]:
                    runs.append([])
            drawing.line(*runs, stroke=colour, width=1.2 if hidden else 3.2, more='stroke-opacity="0.25"' if hidden else "")
    return drawing.svg()


def mountain() -> str:
    heights = [[float(v) for v in line.split(",") if v.strip()] for line in Path("examples/data/mountain.csv").read_text().split()]
    dx, dy = 74.5, 92.5
    rows_, columns = len(heights), len(heights[0])
    low, high = min(map(min, heights)), max(map(max, heights))
    drawing = Drawing((0, -(rows_ - 1) * dy, (columns - 1) * dx, 0), width=1000)
    lows = ["#7a9e7e", "#b5c99a", "#e9d8a6", "#c9a27e", "#f2ece4"]
    at = lambda r, c: heights[min(max(r, 0), rows_ - 1)][min(max(c, 0), columns - 1)]

    def light(r: int, c: int) -> float:
        east, north = (at(r, c + 1) - at(r, c - 1)) / 2 / dx, (at(r - 1, c) - at(r + 1, c)) / 2 / dy
        return (0.6 * east - 0.6 * north + 0.75) / math.sqrt(1 + east**2 + north**2)

    lights = [[light(r, c) for c in range(columns)] for r in range(rows_)]

    def between(table: list[list[float]], r: float, c: float) -> float:
        i, k = min(int(r), rows_ - 2), min(int(c), columns - 2)
        above, below = (table[j][k] + (c - k) * (table[j][k + 1] - table[j][k]) for j in (i, i + 1))
        return above + (r - i) * (below - above)

    parts = 4
    wide, tall = (step * drawing.scale / parts + 0.4 for step in (dx, dy))
    for r in range(parts * (rows_ - 1)):
        for c in range(parts * (columns - 1)):
            i, k = (r + 0.5) / parts, (c + 0.5) / parts
            base = ramp(lows, (between(heights, i, k) - low) / (high - low))
            colour = ramp(["#1d2b2a", base, "#ffffff"], 0.15 + 0.45 * between(lights, i, k))
            x, y = drawing.place((c * dx / parts, -r * dy / parts))
            drawing.parts.append(f'<path d="M{x:.1f} {y:.1f}h{wide:.1f}v{tall:.1f}h-{wide:.1f}z" fill="{colour}"/>')
    points = curves("examples/data/path.csv", "x", "y")["path"]
    drawing.line(points, stroke="#333333", width=1.5, more='stroke-dasharray="3 7"')
    for path, colour in (("straight.csv", "#ffffff"), ("over.csv", "#c2185b")):
        drawing.line(curves(path, "x", "y")["path"], stroke="#33333380", width=7)
        drawing.line(curves(path, "x", "y")["path"], stroke=colour, width=4)
    drawing.dots(points, radius=6)
    return drawing.svg()


def contours() -> str:
    found = curves("apart.csv", "x", "y")
    levels = sorted({int(name.split("-")[0]) for name in found})
    drawing = Drawing((0, 0, 12, 8), width=1000, paper="#fbfaf7")
    for name, line in found.items():
        share = levels.index(int(name.split("-")[0])) / max(len(levels) - 1, 1)
        drawing.line(line, stroke=ramp(["#277f8e", "#4ac16d", "#c9a227", "#a0522d"], share), width=2.2 if levels.index(int(name.split("-")[0])) % 5 else 3.4)
    return drawing.svg()


def motion() -> str:
    """The moving picture, over every fifth frame."""
    x, y, width, height = map(float, inner("dance.svg")[0].split())
    ghosts = []
    for curve, colour in zip(json.loads(Path("dance.frames").read_text()), (ORANGE, PURPLE)):
        for frame in curve["frames"][::5]:
            ghosts.append(
                f'<ellipse cx="{frame["x"]:.3f}" cy="{-frame["y"]:.3f}" rx="{0.2 * frame["scale"]:.3f}" ry="{0.14 * frame["scale"]:.3f}" '
                f'transform="rotate({-frame["rotation"]:.1f} {frame["x"]:.3f} {-frame["y"]:.3f})" fill="{colour}" opacity="{0.35 * frame["opacity"]:.2f}"/>'
            )
    x, y, width, height = x - 0.3, y - 0.3, width + 0.6, height + 0.6
    content = inner("dance.svg")[1].replace("stroke:#000", "stroke:#9aa4b2")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{x} {y} {width} {height}" width="900" height="{900 * height / width:.0f}">'
        f'<rect x="{x}" y="{y}" width="100%" height="100%" fill="#fbfaf7"/>{"".join(ghosts)}{content}</svg>\n'
    )


# The gallery.


@dataclass
class Entry:
    """A picture: its file's name, what it shows, the commands that make it, and the file that they write or what draws it."""

    name: str
    title: str
    words: str
    commands: str
    picture: str | Callable[[], str]
    page: str


STORMS = "track examples/data/storms.csv.gz -o storms.csv --columns curve=id,x=lon,y=lat,t=hours --carry wind --within 30km --every 3 --write speed"

ENTRIES = [
    Entry("world", "The world, smooth within 50 km", "177 countries. Neighbours share every point of their borders still.",
          "map examples/data/world-110m.topojson -o world.geojson --within 50km", world, "jobs/maps.md"),
    Entry("aegean", "The Aegean before and after", "Lines at 1:50 million, smooth within 20 km, in points that are 100 m off the curve at most. Islands stay islands.",
          "map examples/data/countries-50m.geojson.gz -o smooth.geojson --within 20km --tolerance 100m", aegean, "jobs/maps.md"),
    Entry("coast", "How far may a coast move?", "Greenland within 20, 50, 100 and 200 km.",
          "\n".join(f"map examples/data/world-110m.topojson -o d{d}.geojson --within {d}km --tolerance 2km" for d in (20, 50, 100, 200)), coast, "jobs/maps.md"),
    Entry("coarse", "A toy globe", "All land within 400 km. No borders cross, and none part.",
          "map examples/data/world-110m.topojson -o coarse.geojson --within 400km", coarse, "jobs/maps.md"),
    Entry("traced", "Traced letters, cleaned", "Above as a scanner leaves them, below as 1,586 points become few cubics, with their corners.",
          "draw examples/data/traced.svg -o clean.svg --within 1", traced, "jobs/drawings.md"),
    Entry("handles", "Fewer Béziers", "Left as drawn, right within 0.2 units: 205 cubics of the whole sign become 133.",
          "bezier examples/data/lettering.svg -o fewer.svg --simplify --tolerance 0.2", handles, "jobs/drawings.md"),
    Entry("octopus", "An octopus in 58 dots", "The roundest curve through its dots: least ∫κ² ds.",
          "fit examples/data/octopus.csv -o octopus.csv --method scf", octopus, "jobs/dots.md"),
    Entry("exponents", "One octopus, four characters", "Curves of least ∫|κ|^ν ds through the same dots. The larger ν, the rounder every turn.",
          "\n".join(f"fit examples/data/octopus.csv -o nu{nu}.csv --method scf --tension 0.3 --exponent {nu}" for nu in ("1.5", "2", "4", "20")),
          exponents, "jobs/dots.md"),
    Entry("comb", "Curvature combs", "Curves of least ∫|κ|⁴ ds, with their curvature as quills.",
          "fit examples/data/dots.csv -o dots.csv --method scf --exponent 4 --comb --picture comb.svg", "comb.svg", "jobs/dots.md"),
    Entry("melted", "Letters that melt", "The same letters without corners, within 1, 3 and 12 units.",
          "\n".join(f"draw examples/data/traced.svg -o melted{d}.svg --within {d} --corners 180" for d in (1, 3, 12)), melted, "jobs/drawings.md"),
    Entry("storms", "Half a century of storms", "654 tracks of the Atlantic, smooth on the ellipsoid. Colours are wind speeds, from blue to red.",
          "map examples/data/world-110m.topojson -o world.geojson --within 50km\n" + STORMS, storms, "jobs/tracks.md"),
    Entry("storm", "Hurricane Ivan", "Dots are fixes, six hours apart. The track of least acceleration within 30 km of them; colours are its speed.",
          "map examples/data/world-110m.topojson -o world.geojson --within 50km\n" + STORMS, storm, "jobs/tracks.md"),
    Entry("routes", "The straightest ways home", "Geodesics of the WGS84 ellipsoid between airports.",
          "map examples/data/world-110m.topojson -o world.geojson --within 50km\n"
          "fit examples/data/routes.csv -o routes.csv --columns x=lon,y=lat --method geodesic --surface wgs84", routes, "jobs/tracks.md"),
    Entry("robots", "Four robots in a yard", "Paths near their points that turn no sharper than 2 m and stay 0.5 m away from everything.",
          "path examples/data/robots.csv -o robots.csv --min-radius 2 --deviation 1 --obstacles examples/data/obstacles.geojson --clearance 0.5",
          robots, "jobs/paths.md"),
    Entry("race", "A race line, and how fast", "The fairest line between the edges of a track, and the fastest drive along it.",
          "path examples/data/circuit.csv -o race.csv --min-radius 5 --deviation 9 --samples 4 --energy bending=1,tautness=0.05 "
          "--speed 40 --lateral 12 --accelerate 5 --brake 10", race, "jobs/paths.md"),
    Entry("dubins", "Sixteen ways into a space", "The shortest paths of a car to one place, for sixteen headings there: Dubins’ paths.",
          "fit examples/data/parking.csv -o park.csv --energy length=1 --max-curvature 0.4 --samples 96", dubins, "jobs/paths.md"),
    Entry("tracts", "A bundle of fibres", "Streamlines as tracked, and smooth within a millimetre. Colours are directions.",
          "fit examples/data/tracts.trk -o raw.csv --smoothing 0 --samples 1\ntracts examples/data/tracts.trk -o smooth.csv --deviation 1",
          tracts, "jobs/tracts.md"),
    Entry("torus", "Geodesics of a torus", "Three closed ways around a ring, each as straight as the ring allows.",
          "fit examples/data/torus.csv -o torus.csv --surface torus:3,1 --method geodesic --off-surface 0.01", torus, "jobs/surfaces.md"),
    Entry("mountain", "Over a mountain", "Through six points of a terrain: red bends least within the ground, white is the shortest.",
          "fit examples/data/path.csv -o over.csv --surface grid:examples/data/mountain.csv,74.5,-92.5 --energy geodesic_bending=1,length=2e-6\n"
          "fit examples/data/path.csv -o straight.csv --surface grid:examples/data/mountain.csv,74.5,-92.5 --method geodesic", mountain, "jobs/surfaces.md"),
    Entry("heights", "A landscape over 9 × 13 heights", "The surface of least Dirichlet energy.",
          "grid examples/data/heights.csv -o surface.obj --picture surface.svg", "surface.svg", "jobs/surfaces.md"),
    Entry("grids", "Crater, waves and dunes", "Three grids of different sizes, in one call.",
          "grid examples/data/grids.csv -o fine.csv --picture grids.svg", "grids.svg", "jobs/surfaces.md"),
    Entry("contours", "Contours that never cross", "49 contour lines of coarse heights, as fair as their neighbours allow.",
          "fit examples/data/contours.csv -o apart.csv --method fair --no-crossing", contours, "jobs/maps.md"),
    Entry("beziers", "Handles that were missing", "Nine Béziers of degree 3 to 10, of whose control points some were known.",
          "bezier examples/data/control_points.csv -o completed.csv --tangents derivatives --picture completed.svg", "completed.svg", "jobs/beziers.md"),
    Entry("motion", "Keyframes that move", "A ball and a leaf, eased, turned, scaled and faded between their keys.",
          "\n".join(f"fit examples/data/keys.csv -o {output} --every 0.04 --ease ease --carry scale:smooth,rotation:angle:smooth,opacity:smooth"
                    for output in ("dance.svg --to motion", "dance.frames")),
          motion, "jobs/motion.md"),
]

README = ("octopus.svg", "world.svg")  # which have copies in docs, under version control

HEAD = """# Gallery

<!-- docs/gallery.py writes this page. -->

Every picture is made by the commands below it, on data that ships in `examples/data`, whenever this site is built. Where `--picture` or the output
is an SVG file, that is the picture. The others are drawn from the output.
"""


def main() -> None:
    program = str(Path(sys.argv[1]).resolve())
    pictures = HERE / "pictures"
    shutil.rmtree(pictures, ignore_errors=True)
    pictures.mkdir()
    page = [HEAD]
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(HERE.parent / "examples/data", Path(folder) / "examples/data")
        os.chdir(folder)
        ran = set()
        for entry in ENTRIES:
            for command in entry.commands.split("\n"):
                if command not in ran:
                    subprocess.run([program, *command.split(), "--quiet", "--force"], check=True)
                    ran.add(command)
            svg = Path(entry.picture).read_text() if isinstance(entry.picture, str) else entry.picture()
            name = f"{entry.name}.svg"
            if len(svg.encode()) <= LARGEST:
                (pictures / name).write_text(svg)
            else:
                name = f"{entry.name}.png"
                png = resvg_py.svg_to_bytes(svg_string=svg, width=1100, sans_serif_family="DejaVu Sans", font_family="DejaVu Sans")
                (pictures / name).write_bytes(bytes(png))
            shown = "\n".join(f"faircurve {command}" for command in entry.commands.split("\n"))
            page.append(f"## {entry.title}\n\n{entry.words}\n\n![{entry.title}](pictures/{name})\n\n```sh\n{shown}\n```\n\n[More on {Path(entry.page).stem}]({entry.page})\n")
    for name in README:
        if (pictures / name).read_bytes() != (HERE / name).read_bytes():
            print(f"docs/{name} was another picture: commit the new one")
            shutil.copy(pictures / name, HERE / name)
    (HERE / "gallery.md").write_text("\n".join(page))


if __name__ == "__main__":
    main()
