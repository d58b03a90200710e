#!/usr/bin/env bash
# Tests the extensions, without Inkscape's window, and in Inkscape where there is xvfb-run.
#
#   integrations/inkscape/test.sh [FOLDER]     FOLDER takes pictures
#
# Needs Inkscape 1.2 with its Python modules (Debian: inkscape, python3-lxml, python3-cssselect, python3-numpy), and for that Python
# the package faircurve, or the program on the PATH.
#
# INKSCAPE_PYTHON       the Python of Inkscape, by default /usr/bin/python3
# INKSCAPE_EXTENSIONS   the folder of its extensions, by default /usr/share/inkscape/extensions
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

python=${INKSCAPE_PYTHON:-/usr/bin/python3}
export PYTHONDONTWRITEBYTECODE=1
export PYTHONPATH=${INKSCAPE_EXTENSIONS:-/usr/share/inkscape/extensions}:$(cd ../../python && pwd)${PYTHONPATH:+:$PYTHONPATH}
if ! "$python" -c 'import inkex' 2>/dev/null; then
  echo "NOTICE: Inkscape is not installed for $python: its extensions are not tested" >&2
  exit 0
fi
export FAIRCURVE_PICTURES=${1:+$(realpath -m "$1")}
"$python" -W ignore -m unittest discover --start-directory tests
