#!/usr/bin/env bash
# Tests the plugin in a QGIS without a window.
#
#   integrations/qgis/test.sh [FOLDER]     FOLDER takes pictures, before and after
#
# Needs QGIS with its Python modules (Debian: qgis, python3-qgis, qgis-providers), and for that Python the package
# faircurve, or the program on the PATH.
#
# QGIS_PYTHON   the Python of QGIS, by default /usr/bin/python3
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

python=${QGIS_PYTHON:-/usr/bin/python3}
export QT_QPA_PLATFORM=offscreen PYTHONDONTWRITEBYTECODE=1
if ! "$python" -c 'import qgis.core' 2>/dev/null; then
  echo "NOTICE: QGIS is not installed for $python: its plugin is not tested" >&2
  exit 0
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export XDG_RUNTIME_DIR=$work QGIS_CUSTOM_CONFIG_PATH=$work/profile FAIRCURVE_PICTURES=${1:+$(realpath -m "$1")}
PYTHONPATH=$PWD:$(cd ../../python && pwd):/usr/share/qgis/python/plugins${PYTHONPATH:+:$PYTHONPATH} "$python" -W ignore tests/test_plugin.py
