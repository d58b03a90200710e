"""The program faircurve: where it is, and a run that can be cancelled."""

import os
import queue
import re
import shutil
import subprocess
import sys
import threading
from pathlib import Path

from qgis.core import QgsProcessingException

MISSING = (
    "The program faircurve was not found, neither as a Python package nor on the PATH: run \"{python} -m pip install faircurve\" "
    "and start QGIS again."
)

#: How much of a step is done, in a line that the program writes every ten seconds.
COUNTED = re.compile(r", ([\d,]+) of ([\d,]+) .*, for [\d,]+ s")


def python():
    """The interpreter that QGIS embeds. `sys.executable` is QGIS itself on Windows and macOS, and may be another Python on Linux."""
    home, version = Path(sys.exec_prefix), f"{sys.version_info.major}.{sys.version_info.minor}"
    names = ("python.exe", "python3.exe", f"bin/python{version}", "bin/python3")
    return str(next((home / name for name in names if (home / name).exists()), "python3"))


def command():
    """The words that start the program, and their environment: the Python package, else the program on the PATH."""
    try:
        import faircurve  # noqa: F401
    except ImportError:
        program = shutil.which("faircurve")
        if program is None:
            raise QgsProcessingException(MISSING.format(python=python())) from None
        return [program], None
    # The program finds the package where QGIS did.
    return [python(), "-m", "faircurve._command"], {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


def _lines(stream, into):
    for line in stream:
        into.put(line.rstrip())
    into.put(None)


def run(arguments, feedback, folder, share=1.0):
    """Runs the program in a folder; returns whether it came to its end, which it does not if the run is cancelled.

    Its lines go to the feedback. `share` is the part of the progress bar that it fills.
    """
    words, environment = command()
    hidden = {"creationflags": subprocess.CREATE_NO_WINDOW} if os.name == "nt" else {}
    with subprocess.Popen(
        [*words, *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        errors="replace",
        env=environment,
        cwd=folder,
        **hidden,
    ) as process:
        said = _listen(process, feedback, share)
    if feedback.isCanceled():
        return False
    if process.returncode not in (0, 1):
        # Of a wrong argument the sentence comes first, else last.
        sentence = next((line for line in said if line.startswith("error: ")), said[-1] if said else f"it ended with the status {process.returncode}")
        raise QgsProcessingException(f"faircurve: {sentence}")
    if process.returncode == 1:
        feedback.reportError("Some curves could not be fitted, and stay as they were: the lines above list them.")
    return True


def _listen(process, feedback, share):
    """Hands lines of the program to the feedback, until it ends or the run is cancelled; returns them."""
    start, said, lines = feedback.progress(), [], queue.SimpleQueue()
    reader = threading.Thread(target=_lines, args=(process.stderr, lines), daemon=True)
    reader.start()
    while True:
        if feedback.isCanceled():
            process.kill()
            break
        try:
            line = lines.get(timeout=0.1)
        except queue.Empty:
            continue
        if line is None:
            break
        line = line.removeprefix("faircurve: ")
        said.append(line)
        counted = COUNTED.search(line)
        if counted is None:
            feedback.pushInfo(line)
        else:
            done, every = (int(number.replace(",", "")) for number in counted.groups())
            feedback.setProgress(start + 100 * share * done / max(every, 1))
            feedback.setProgressText(line)
    reader.join()
    return said
