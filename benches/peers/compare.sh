#!/usr/bin/env bash
# Times faircurve, NumPy, SciPy and JAX on the same curves in the same run, and prints the ratios.
#
#   benches/peers/compare.sh [--runs 7]
#
# Leave the machine alone meanwhile: at a load above its number of cores the times mean little.
# The JSON lines stay in benches/data/peers.jsonl.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
export PYTHONDONTWRITEBYTECODE=1

benches/data.sh hanzi
python=benches/peers/.venv/bin/python
"$python" benches/peers/natural.py --write-random
"$python" benches/peers/fair.py --write-points
"$python" benches/peers/scf.py --write-input
"$python" benches/peers/bezier.py --write-input
"$python" benches/peers/laplacian.py --write-input
cargo build --release --quiet --locked --example peer_natural --example peer_fair --example peer_scf --example peer_bezier \
    --example peer_laplacian

"$python" -m pip install --quiet --disable-pip-version-check ./python

lines=benches/data/peers.jsonl
"${CARGO_TARGET_DIR:-target}/release/examples/peer_natural" "$@" | tee "$lines"
"$python" benches/peers/python.py "$@" | tee -a "$lines"
"$python" benches/peers/natural.py "$@" | tee -a "$lines"
"${CARGO_TARGET_DIR:-target}/release/examples/peer_fair" "$@" > benches/data/fair.json
"$python" benches/peers/fair.py --faircurve benches/data/fair.json "$@" | tee -a "$lines"
"${CARGO_TARGET_DIR:-target}/release/examples/peer_scf" "$@" | tee -a "$lines"
"$python" benches/peers/scf.py --faircurve benches/data/scf-faircurve.npz "$@" | tee -a "$lines"
"${CARGO_TARGET_DIR:-target}/release/examples/peer_bezier" "$@" | tee -a "$lines"
"$python" benches/peers/bezier.py "$@" | tee -a "$lines"
"${CARGO_TARGET_DIR:-target}/release/examples/peer_laplacian" "$@" | tee -a "$lines"
"$python" benches/peers/laplacian.py "$@" | tee -a "$lines"
echo
"$python" benches/peers/ratios.py "$lines"
