"""The extensions, as Inkscape calls them, and in Inkscape where there is one and a display."""

import contextlib
import io
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import numpy as np

FOLDER = Path(__file__).parents[1] / "faircurve_inkscape"
sys.path.insert(0, str(FOLDER))

import inkex  # noqa: E402
from fair_curves import FairCurves  # noqa: E402
from fewer_nodes import FewerNodes, nodes  # noqa: E402
from lxml import etree  # noqa: E402

DATA = Path(__file__).parents[3] / "examples/data"

DRAWING = """<svg xmlns="http://www.w3.org/2000/svg" xmlns:sodipodi="http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd"
 xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" width="100mm" height="50mm" viewBox="0 0 200 100">
<!-- kept --><style>.a {{ fill: none }}</style>
<defs><clipPath id="clip"><path id="hidden" d="M 0,0 3,9 9,3 Z"/></clipPath></defs>
<g id="layer" inkscape:groupmode="layer" inkscape:label="L &amp; M" transform="translate(10 5) scale(2 -1)" style="stroke:#123">
 <path id="zigzag" class="a" style="stroke-width:.5;opacity:0.50" sodipodi:nodetypes="ccccc" d="m 0,0 10,10 h 10 L 30,-0 40,10"/>
 <g id="inner" clip-path="url(#clip)"><path id="closed" d="M 10,30 C 12,31 18,33 20,30 A 5 8 0 0 1 20,40 L 10,40 Z m 30,0 4,6 5,-2 z"/></g>
 <rect id="box" x="1" y="2" width="30" height="4"/>
</g>
{more}</svg>
"""


def run(extension, drawing, *arguments):
    """The drawing that an extension makes, and what it tells."""
    out, told = io.BytesIO(), io.StringIO()
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stderr(told):
        path = Path(folder) / "drawing.svg"
        path.write_text(drawing, encoding="utf-8")
        with contextlib.suppress(SystemExit):
            extension().run([*arguments, str(path)], output=out)
    return out.getvalue().decode(), told.getvalue()


def drawn(text):
    """Path data by id, and the drawing without them."""
    root = etree.fromstring(text.encode())
    data = {}
    for path in root.iter("{*}path"):
        data[path.get("id")] = path.attrib.pop("d")
        path.attrib.pop(inkex.addNS("nodetypes", "sodipodi"), None)
    return data, etree.tostring(root, method="c14n")


def samples(data, steps=40):
    """Points along each subpath of path data."""
    t = np.linspace(0, 1, steps)[:, None]
    lines = []
    for subpath in inkex.Path(data).to_superpath():
        pieces = [np.array(subpath[0][1])[None]]
        for (_, a, b), (c, d, _) in zip(subpath, subpath[1:]):
            a, b, c, d = (np.array(one) for one in (a, b, c, d))
            pieces.append((1 - t) ** 3 * a + 3 * t * (1 - t) ** 2 * b + 3 * t**2 * (1 - t) * c + t**3 * d)
        lines.append(np.concatenate(pieces))
    return lines


def to_lines(points, lines):
    """The largest distance of points from polygons, which are lists of points."""
    starts, ends = (np.concatenate([line[k : len(line) - 1 + k] for line in lines]) for k in (0, 1))
    steps = ends - starts
    squares = np.maximum((steps**2).sum(axis=1), 1e-30)
    along = np.clip(((points[:, None] - starts) * steps).sum(axis=2) / squares, 0, 1)
    return np.linalg.norm(points[:, None] - starts - along[:, :, None] * steps, axis=2).min(axis=1).max()


def distance(one, other):
    """The largest distance of two lists of polygons from each other."""
    return max(to_lines(np.concatenate(one), other), to_lines(np.concatenate(other), one))


class Fair(unittest.TestCase):
    def test_curves_go_through_nodes_and_nothing_else_changes(self):
        given, frame = drawn(DRAWING.format(more=""))
        corners = {
            "zigzag": [(0, 0), (10, 10), (20, 10), (30, 0), (40, 10)],
            "closed": [(10, 30), (20, 30), (20, 40), (10, 40), (40, 30), (44, 36), (49, 34)],
        }
        for method in ("fair", "natural", "scf"):
            text, told = run(FairCurves, DRAWING.format(more=""), f"--method={method}")
            self.assertEqual(told, "")
            made, frame_now = drawn(text)
            self.assertEqual(frame_now, frame)
            self.assertEqual(made["hidden"], given["hidden"])
            self.assertNotIn("nodetypes", text)
            for name, places in corners.items():
                along = np.concatenate(samples(made[name], 400))
                for place in places:
                    self.assertLess(np.hypot(*(along - place).T).min(), 0.06, (method, name, place))
            self.assertEqual([made[name].upper().count("Z") for name in corners], [0, 2])
            self.assertEqual(made["zigzag"].upper().count("M"), 1)
        natural = drawn(run(FairCurves, DRAWING.format(more=""), "--method=natural")[0])[0]
        self.assertEqual(nodes(natural["zigzag"]), 5)

    def test_only_the_selection_changes(self):
        given, _ = drawn(DRAWING.format(more=""))
        for chosen, changed in (("zigzag", {"zigzag"}), ("inner", {"closed"}), ("layer", {"zigzag", "closed"})):
            made, _ = drawn(run(FairCurves, DRAWING.format(more=""), f"--id={chosen}")[0])
            self.assertEqual({name for name in given if made[name] != given[name]}, changed)

    def test_data_of_nodes(self):
        for given, nodes in (
            ("M 0,0 h 5 v 5 z l 2,3 4,4", "M0.0,0.0 5.0,0.0 5.0,5.0 Z M0.0,0.0 2.0,3.0 6.0,7.0"),
            ("m 1,1 2,2 -1,3 -1,-5 z m 9,9 t 1,1", "M1.0,1.0 3.0,3.0 2.0,6.0 Z M10.0,10.0 11.0,11.0"),
            ("M 0,0 Q 1,1 2,0 A 1 1 0 0 0 4,0", "M0.0,0.0 2.0,0.0 4.0,0.0"),
        ):
            self.assertEqual(FairCurves().data(inkex.PathElement(d=given)), nodes)

    def test_shapes_and_live_effects(self):
        more = """<path id="star" sodipodi:type="star" d="M 50,50 60,60 70,50 60,40 Z"/>
<path id="live" inkscape:path-effect="#e" inkscape:original-d="M 0,0 5,5 10,0" d="M 0,0 5,5 10,0"/>"""
        text, told = run(FairCurves, DRAWING.format(more=more))
        made, _ = drawn(text)
        self.assertEqual(made["live"], "M 0,0 5,5 10,0")
        self.assertIn("Paths with live effects stay as they are: live. Path › Object to Path makes plain paths", told)
        self.assertNotIn("sodipodi:type", text)
        self.assertIn("C", made["star"].upper())

    def test_a_path_that_cannot_be_read_stays(self):
        more = '<path id="bad" d="M 0,0 L 5"/><path id="dot" d="M 3,3"/><path id="none"/>'
        for extension in (FairCurves, FewerNodes):
            wave = " ".join(f"{k},{k % 2 / 4}" for k in range(50))
            text, told = run(extension, DRAWING.format(more=more + f'<path id="wave" d="M {wave}"/>'))
            self.assertIn('d="M 0,0 L 5"', text)
            self.assertIn('d="M 3,3"', text)
            self.assertNotIn(wave, text)
        self.assertRegex(told, "^Some paths could not be used:\\n  .*bad")
        self.assertEqual(told.count("Some paths"), 1)

    def test_sentences(self):
        box = '<svg xmlns="http://www.w3.org/2000/svg"><rect width="3" height="4"/></svg>'
        for extension, drawing, arguments, sentence in (
            (FewerNodes, DRAWING.format(more=""), ["--within=0"], "“Within” is 0 px; it must be more than 0: give a length"),
            (FairCurves, DRAWING.format(more=""), ["--tolerance=-1"], "“Tolerance” is -1 px; it must be more than 0"),
            (FairCurves, DRAWING.format(more=""), ["--method=round"], "round"),
            (FewerNodes, box, [], "There is no path: select paths, or make paths of objects"),
        ):
            text, told = run(extension, drawing, *arguments)
            self.assertIn(sentence, told)
            self.assertNotIn("Traceback", told)
            self.assertEqual(text, "")

    def test_a_missing_program_is_a_sentence(self):
        with mock.patch.dict(sys.modules, {"faircurve": None}), mock.patch("shutil.which", return_value=None):
            _, told = run(FairCurves, DRAWING.format(more=""))
        self.assertRegex(told, "faircurve was not found, .* run “.*python3? -m pip install faircurve”")


class Fewer(unittest.TestCase):
    def test_traced_lettering_has_few_nodes_within_the_distance(self):
        drawing = (DATA / "traced.svg").read_text()
        given, frame = drawn_in_order(drawing)
        # The drawing has three px in a unit.
        for arguments in (["--within=3"], [f"--within={3 / 96 * 25.4!r}", "--within_unit=mm"]):
            made, frame_now = drawn_in_order(run(FewerNodes, drawing, *arguments)[0])
            self.assertEqual(frame_now, frame)
            for before, after in zip(given, made):
                self.assertLess(nodes(after), 0.1 * nodes(before))
                self.assertLess(distance(samples(before, 2), samples(after)), 1.001)

    def test_no_path_has_more_nodes_than_before(self):
        drawing = (DATA / "lettering.svg").read_text()
        given, frame = drawn_in_order(drawing)
        for within in (0.1, 1):
            made, frame_now = drawn_in_order(run(FewerNodes, drawing, f"--within={within}")[0])
            self.assertEqual(frame_now, frame)
            self.assertTrue(all(nodes(after) <= nodes(before) for before, after in zip(given, made)))
            # The letters' units are 0.092 px.
            for before, after, px in zip(given, made, [0.092] * 9 + [1]):
                self.assertLess(px * distance(samples(before, 60), samples(after, 60)), 1.03 * within)
            self.assertLess(sum(map(nodes, made)), sum(map(nodes, given)))

    def test_corners(self):
        noise = np.random.default_rng(2).normal(size=60) * 0.2
        wave = " ".join(f"{x},{20 + 5 * np.sin(x / 5) + y:.3f}" for x, y in enumerate(noise))
        drawing = f'<svg xmlns="http://www.w3.org/2000/svg"><path id="p" d="M {wave}"/></svg>'
        for corners in (["auto"], ["straight"], ["angle", "--angle=30"]):
            made, _ = drawn(run(FewerNodes, drawing, f"--corners={corners[0]}", *corners[1:])[0])
            self.assertLess(nodes(made["p"]), 20 if corners[0] != "angle" else 61)


def drawn_in_order(text):
    root = etree.fromstring(text.encode())
    data = [path.attrib.pop("d") for path in root.iter("{*}path")]
    return data, etree.tostring(root, method="c14n")


@unittest.skipUnless(shutil.which("inkscape") and shutil.which("xvfb-run"), "Inkscape or xvfb-run is not installed")
class InInkscape(unittest.TestCase):
    def test_inkscape_runs_the_extensions(self):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "extensions").mkdir()
            (Path(folder) / "extensions/faircurve_inkscape").symlink_to(FOLDER)
            given, made = Path(folder) / "given.svg", Path(folder) / "made.svg"
            shutil.copy(DATA / "traced.svg", given)
            actions = f"select-all;org.faircurve.fewer-nodes.noprefs;export-filename:{made};export-do"
            subprocess.run(
                ["xvfb-run", "-a", "inkscape", "--with-gui", "--batch-process", f"--actions={actions}", str(given)],
                env={**os.environ, "INKSCAPE_PROFILE_DIR": folder},
                capture_output=True,
                timeout=120,
                check=True,
            )
            before, after = (drawn_in_order(path.read_text())[0] for path in (given, made))
            self.assertEqual(len(before), len(after))
            self.assertLess(sum(map(nodes, after)), 0.5 * sum(map(nodes, before)))
            picture(made, "traced")

    def test_pictures(self):
        if not os.environ.get("FAIRCURVE_PICTURES"):
            self.skipTest("no folder is given")
        with tempfile.TemporaryDirectory() as folder:
            for name, extension, arguments in (
                ("traced-fewer", FewerNodes, ["--within=3"]),
                ("lettering-fewer", FewerNodes, ["--within=1"]),
                *((f"lettering-{method}", FairCurves, [f"--method={method}"]) for method in ("fair", "natural", "scf")),
            ):
                path = Path(folder) / f"{name}.svg"
                path.write_text(run(extension, (DATA / f"{name.split('-')[0]}.svg").read_text(), *arguments)[0])
                picture(path, name)


def picture(path, name):
    """Draws a drawing by Inkscape if pictures are asked for."""
    folder = os.environ.get("FAIRCURVE_PICTURES")
    if folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        subprocess.run(["inkscape", str(path), f"--export-filename={folder}/{name}.png", "-w", "1000"], capture_output=True, check=True)


if __name__ == "__main__":
    unittest.main()
