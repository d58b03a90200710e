#!/usr/bin/env bash
# Writes the public face of the library, every item a line, to tests/public.txt; or compares it.
#
#   tests/public.sh           after a change that is meant
#   tests/public.sh --check   fails, and prints the difference, where the list is not what the library has
#
# Needs a nightly toolchain, and cargo-public-api: cargo install --locked cargo-public-api
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# Without what types implement by themselves or by derive.
now=$(cargo public-api -sss 2>/dev/null) || { cargo public-api -sss; exit 1; }
if [[ ${1:-} == --check ]]; then
  diff -u tests/public.txt - <<<"$now" || {
    echo 'The public face is not that of tests/public.txt. Where that is meant, run tests/public.sh and say so in CHANGELOG.md.' >&2
    exit 1
  }
  echo "$(wc -l <tests/public.txt) public items, as in tests/public.txt"
else
  printf '%s\n' "$now" >tests/public.txt
fi
