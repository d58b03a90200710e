"""What both extensions do: selected paths through the program faircurve. Nothing else of the drawing changes."""

import copy
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import inkex
from lxml import etree

MARK = "data-faircurve"

#: The option that takes marked paths alone.
MARKED = ("--where", f"{MARK}=yes")

#: What holds paths that are not drawn themselves.
HIDDEN = ("defs", "clipPath", "mask", "marker", "pattern", "symbol")

MISSING = (
    "The program faircurve was not found, neither as a Python package nor on the PATH: run “{python} -m pip install faircurve”, "
    "or install the program."
)


def command():
    """The words that start the program: the Python package, else the program on the PATH or where cargo and pip put it."""
    try:
        import faircurve  # noqa: F401

        return [sys.executable, "-m", "faircurve._command"]
    except ImportError:
        home = Path.home()
        places = os.pathsep.join([os.environ.get("PATH", ""), str(home / ".cargo/bin"), str(home / ".local/bin")])
        program = shutil.which("faircurve", path=places)
    if program is None:
        raise inkex.AbortExtension(MISSING.format(python=sys.executable))
    return [program]


class PathExtension(inkex.EffectExtension):
    """An extension that changes paths."""

    def add_length(self, pars, name, value):
        pars.add_argument(f"--{name}", type=float, default=value)
        pars.add_argument(f"--{name}_unit", default="px")

    def length(self, name, title):
        """A length in user units of the drawing."""
        value, unit = getattr(self.options, name), getattr(self.options, f"{name}_unit")
        if not 0 < value < float("inf"):
            raise inkex.AbortExtension(f"“{title}” is {value:g} {unit}; it must be more than 0: give a length such as 1 px.")
        return repr(self.svg.viewport_to_unit(f"{value!r}{unit}"))

    def commands(self):
        """Subcommands of the program with their options. Each makes a drawing of the same one."""
        raise NotImplementedError

    def chosen(self, given, made):
        """The path data to keep of those that the commands made."""
        return made[0]

    def data(self, path):
        """Path data that the program is given."""
        return path.get("d")

    def paths(self):
        """The selected paths, also those in selected groups, or all that are drawn."""
        if self.svg.selection:
            chosen = [path for top in self.svg.selection for path in top.iter(inkex.addNS("path", "svg"))]
        else:
            inside = " or ".join(f"self::svg:{name}" for name in HIDDEN)
            chosen = self.svg.xpath(f"//svg:path[not(ancestor::*[{inside}])]")
        if not chosen:
            raise inkex.AbortExtension("There is no path: select paths, or make paths of objects by Path › Object to Path.")
        live = [path.get_id() for path in chosen if path.get("inkscape:path-effect") is not None]
        if live:
            inkex.errormsg(f"Paths with live effects stay as they are: {', '.join(live)}. Path › Object to Path makes plain paths of them.")
        return [path for path in chosen if path.get("inkscape:path-effect") is None and path.get("d")]

    def effect(self):
        commands = self.commands()
        paths = self.paths()
        if not paths:
            return
        given, asked = [path.get("d") for path in paths], [self.data(path) for path in paths]
        for path, data in zip(paths, asked):
            path.set("d", data)
            path.set(MARK, "yes")
        drawing = copy.deepcopy(self.document)
        for path, data in zip(paths, given):
            path.set("d", data)
            path.pop(MARK)
        made = [self.run_program(drawing, k == 0, *command) for k, command in enumerate(commands)]
        for path, before, asked_for, *after in zip(paths, given, asked, *made):
            # What could not be used comes out as it went in.
            after = [data for data in after if data != asked_for]
            data = self.chosen(before, after) if after else before
            if data != before:
                path.set("d", data)
                # Both describe the nodes that were there.
                path.pop("sodipodi:nodetypes")
                path.pop("sodipodi:type")

    def run_program(self, drawing, tells, name, *options):
        """Path data of the marked paths, as the program makes them; its sentence, where it fails. It tells of single paths if asked to."""
        with tempfile.TemporaryDirectory() as folder:
            before, after = Path(folder) / "before.svg", Path(folder) / "after.svg"
            drawing.write(str(before), encoding="utf-8", xml_declaration=True)
            words = [*command(), name, str(before), "-o", str(after), *options]
            hidden = {"creationflags": subprocess.CREATE_NO_WINDOW} if os.name == "nt" else {}
            environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
            run = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, encoding="utf-8", errors="replace", env=environment, **hidden)
            said = [line.removeprefix("faircurve: ") for line in run.stderr.splitlines() if line.strip()]
            if run.returncode not in (0, 1):
                sentence = next((line for line in said if line.startswith("error: ")), said[-1] if said else f"it ended with the status {run.returncode}")
                raise inkex.AbortExtension(f"faircurve: {sentence}")
            if run.returncode == 1 and tells:
                listed = [line.replace(f"{before}, ", "") for line in said if line.startswith("  ")]
                inkex.errormsg("\n".join(["Some paths could not be used:", *listed]))
            return [path.get("d") for path in etree.parse(str(after)).iter(inkex.addNS("path", "svg")) if path.get(MARK)]
