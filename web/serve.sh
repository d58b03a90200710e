#!/bin/sh
# Serves the page on this machine: web/serve.sh [PORT]
set -eu
here=$(dirname "$0")
"$here/wasm.sh"
exec node "$here/serve.mjs" "$@"
