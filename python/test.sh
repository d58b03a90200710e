#!/usr/bin/env bash
# Builds the wheel, installs it into an environment that has nothing else, and runs the tests of the Python package.
#
#   python/test.sh            all of it
#   python/test.sh prepare    only makes the environment of the tests, which is kept for as long as its requirements stay
#
# Needs Python 3.10 or later with venv and pip, which fetches tests/requirements.txt.
#
# FAIRCURVE_AS_TESTED   set it for a wheel of what cargo test has built, which is not for measuring
# CARGO_TARGET_DIR      as cargo takes it
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
quietly() { "$@" >"$work/log" 2>&1 || { cat "$work/log" >&2; return 1; }; }

kept=${CARGO_TARGET_DIR:-$PWD/../target}/python
tools=$kept/$(cat tests/requirements.txt <(python3 --version) | sha256sum | cut -c 1-16)
if [[ ! -e $tools/complete ]]; then
  rm -rf "$kept"
  mkdir -p "$kept"
  python3 -m venv "$tools"
  quietly "$tools/bin/pip" install --disable-pip-version-check -r tests/requirements.txt
  touch "$tools/complete"
fi
[[ ${1:-} != prepare ]] || exit 0

profile=release
[[ -z ${FAIRCURVE_AS_TESTED:-} ]] || profile=dev
quietly "$tools/bin/maturin" build --profile "$profile" --locked --out "$work/wheels"
# The wheel with numpy alone: what the README promises.
python3 -m venv "$work/bare"
quietly "$work/bare/bin/pip" install --disable-pip-version-check "$work"/wheels/*.whl
(cd "$work" && "$work/bare/bin/python" - <<'PYTHON')
import sys

import numpy as np

import faircurve as fc

fit = fc.Natural().fit(np.random.default_rng(0).normal(size=(1000, 10, 2)))
assert fit.sample(64).shape == (1000, 64, 2) and (fit.status == "converged").all()
optional = {"pyarrow", "shapely", "geopandas", "awkward", "matplotlib", "scipy", "dask", "ray", "nibabel", "pandas"}
assert not optional & set(sys.modules), optional & set(sys.modules)
PYTHON
"$work/bare/bin/faircurve" --version

quietly "$tools/bin/pip" install --disable-pip-version-check --force-reinstall --no-deps "$work"/wheels/*.whl
# The tests from a folder of their own, so that the package that was installed is what they import.
mkdir "$work/run"
cp -r tests examples pyproject.toml README.md "$work/run"
(
  cd "$work/run"
  # pyright --verifytypes looks for the package where the python of PATH does.
  export PYTHONDONTWRITEBYTECODE=1 PATH=$tools/bin:$PATH
  package=$(python -c 'import faircurve; print(faircurve.__path__[0])')
  python -m pytest --quiet tests README.md "$package"
  mypy --config-file pyproject.toml -p faircurve
  mypy --config-file pyproject.toml tests/test_types.py examples
  pyright tests/test_types.py examples "$package"
  pyright --ignoreexternal --verifytypes faircurve >"$work/types" || { cat "$work/types"; exit 1; }
  python -m mypy.stubtest faircurve._core --mypy-config-file pyproject.toml
)
for example in examples/*.py; do
  echo "--- $example"
  MPLBACKEND=Agg "$tools/bin/python" "$example" "$work/picture.png"
  rm -f "$work/picture.png"
done
