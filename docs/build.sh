#!/usr/bin/env bash
# Makes the site in site/: runs the gallery, builds the pages, and checks links, anchors, pictures and commands.
#
#   docs/build.sh
#
# Needs Python 3.10 or later with venv and pip, which fetches docs/requirements.txt.
#
# FAIRCURVE         the program; without it cargo builds one
# CARGO_TARGET_DIR  as cargo takes it
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
if [[ -z ${FAIRCURVE:-} ]]; then
  cargo build --release --locked --quiet
  FAIRCURVE=$target/release/faircurve
fi

# Kept for as long as its requirements stay.
tools=$target/docs/$(cat docs/requirements.txt <(python3 --version) | sha256sum | cut -c 1-16)
if [[ ! -e $tools/complete ]]; then
  rm -rf "$target/docs"
  python3 -m venv "$tools"
  "$tools/bin/pip" install --disable-pip-version-check --quiet -r docs/requirements.txt
  touch "$tools/complete"
fi

"$tools/bin/python" docs/gallery.py "$FAIRCURVE"
# The advertisement of a later MkDocs is left out.
NO_MKDOCS_2_WARNING=1 PATH="$tools/bin:$PATH" "$tools/bin/mkdocs" build --strict
"$tools/bin/python" docs/check.py "$FAIRCURVE"
echo "site/index.html is the start page"
