#!/bin/sh
# Tests the package in Node and the page in Chromium: web/test.sh
#
# FAIRCURVE names a native program, which both are compared with. CHROMIUM names the browser. SCREENSHOTS names a folder for
# pictures of the page. QUICK leaves out what takes a minute.
set -eu
cd "$(dirname "$0")"
./wasm.sh
[ -d ../tests/browser/node_modules ] || npm ci --prefix ../tests/browser
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
./build.sh "$folder"
FOLDER=$folder node --test --test-reporter=spec --test-concurrency=1 test/package.test.mjs test/page.test.mjs
