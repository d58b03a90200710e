#!/usr/bin/env bash
# Runs every check of the project, the GPU tests included: on Vulkan in software (lavapipe) where there is no GPU.
#
#   tests/run.sh
#
# Needs a Rust toolchain with rustfmt and clippy, and a C linker. Installs what else is missing where it can: lavapipe
# by apt, for the browser check Chromium by apt and playwright-core by npm, for the page rustup's target wasm32-wasip1, for the Python
# package Python by apt and what its tests import by pip, and so for the site; in CI QGIS and Inkscape by apt. Without those the checks are skipped with a notice; without lavapipe the run fails, since a GPU test must never be skipped unseen.
#
# VK_DRIVER_FILES         set it to the driver file (ICD) of a real GPU to test that one instead of lavapipe
# FAIRCURVE_ALL_FAMILIES  set it to ask compilers of all families of cards for every kernel, not of one
# CARGO_TARGET_DIR        as cargo takes it
# CHROMIUM                a Chromium other than /usr/bin/chromium
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

heading=''
heading_start=0
close_section() {
  [[ -z $heading ]] || echo "--- $heading: $((SECONDS - heading_start)) s"
}
section() {
  close_section
  heading=$1 heading_start=$SECONDS
  printf '\n=== %s\n' "$heading"
}
notices=()
notice() {
  notices+=("$1")
  echo "NOTICE: $1"
}
fail() {
  echo "FAILED: $1" >&2
  exit 1
}
logs=$(mktemp -d)
preparing='' compiling='' installing=''
on_exit() {
  local status=$?
  for job in $preparing $compiling $installing; do
    kill "$job" 2>/dev/null || true
  done
  rm -rf "$logs"
  ((status == 0)) || printf '\nFAILED in: %s (exit status %s)\n' "$heading" "$status" >&2
}
trap on_exit EXIT

has() { command -v "$1" >/dev/null; }

# apt_install PACKAGE…: false where there is no apt, no right to use it, or no such package.
apt_lists_fresh=no
apt_install() {
  has apt-get || return 1
  local root=()
  if ((EUID != 0)); then
    has sudo || return 1
    root=(sudo)
  fi
  if [[ $apt_lists_fresh == no ]]; then
    "${root[@]}" apt-get update -qq || echo "apt-get update failed; trying with the package lists as they are"
    apt_lists_fresh=yes
  fi
  "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" </dev/null >/dev/null
}

# The driver file of lavapipe for this processor, or nothing.
lavapipe_icd() {
  local folder file
  for folder in /usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d /etc/vulkan/icd.d; do
    for file in "$folder/lvp_icd.$(uname -m).json" "$folder"/lvp_icd*.json; do
      if [[ -e $file ]]; then
        echo "$file"
        return
      fi
    done
  done
}

has_vulkan_loader() {
  compgen -G '/usr/lib/*/libvulkan.so.1' >/dev/null || compgen -G '/usr/lib*/libvulkan.so.1' >/dev/null ||
    compgen -G '/usr/local/lib*/libvulkan.so.1' >/dev/null
}

section 'Tools'
has cargo || fail 'there is no cargo: install Rust (https://rustup.rs)'
{ cargo fmt --version && cargo clippy --version; } || fail 'rustfmt or clippy is missing: rustup component add rustfmt clippy'
if [[ -z ${VK_DRIVER_FILES:-} ]]; then
  if [[ -z $(lavapipe_icd) ]] || ! has_vulkan_loader; then
    apt_install mesa-vulkan-drivers libvulkan1 ||
      fail 'lavapipe is missing and apt cannot install it: install the Vulkan loader and the Vulkan drivers of Mesa'
  fi
  VK_DRIVER_FILES=$(lavapipe_icd)
  [[ -n $VK_DRIVER_FILES ]] || fail 'the Vulkan drivers of Mesa are installed, but hold no lvp_icd*.json'
fi
export VK_DRIVER_FILES
echo "Vulkan driver: $VK_DRIVER_FILES"
export FAIRCURVE_REQUIRE_GPU=1
# Mesa complains about a missing one, once an adapter; nothing is written there.
export XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-${TMPDIR:-/tmp}}

# The environment of the Python tests comes from the network while the compiler works.
python_tests=yes
if ! python3 -c 'import sys; assert sys.version_info >= (3, 10); import ensurepip, venv' >/dev/null 2>&1 && ! apt_install python3-venv; then
  notice 'the Python package is not tested: there is no Python 3.10 with venv and pip'
  python_tests=no
else
  python/test.sh prepare &
  preparing=$!
fi

browser=yes
[[ -n ${CHROMIUM:-} ]] || has chromium || apt_install chromium || true
: "${CHROMIUM:=$(command -v chromium || true)}"
export CHROMIUM
if [[ -z $CHROMIUM ]]; then
  notice 'no browser check: there is no Chromium and apt cannot install it'
  browser=no
elif ! has node || ! has npm; then
  notice 'no browser check: there is no node or no npm'
  browser=no
elif ! (cd tests/browser && npm ls --silent >/dev/null 2>&1) &&
  ! npm ci --prefix tests/browser --no-audit --no-fund --loglevel=error; then
  notice 'no browser check: npm cannot install playwright-core'
  browser=no
fi

# In CI every crate is built once, so incremental files would only cost disk.
[[ -z ${CI:-} ]] || export CARGO_INCREMENTAL=0

# The page's program is compiled while others are: by a profile of its own, whose folder no other cargo locks.
page=no
if [[ $browser == yes ]]; then
  if has rustup && rustup target add wasm32-wasip1 2>/dev/null; then
    page=yes
    web/wasm.sh >"$logs/wasm" 2>&1 &
    compiling=$!
  else
    notice 'the page is not tested: rustup cannot add the target wasm32-wasip1'
  fi
fi

# QGIS and Inkscape are large: only CI installs them.
if [[ -n ${CI:-} ]]; then
  apt_install qgis python3-qgis qgis-providers inkscape python3-lxml python3-cssselect python3-numpy xvfb xauth >"$logs/desktop" 2>&1 &
  installing=$!
fi

if [[ $browser == yes ]]; then
  section 'Browser: the smoke capture'
  # Status 77 (no adapter) counts as a failure from here on: Chromium brings its own adapter.
  node tests/browser/run.mjs tests/browser/smoke.json
  export FAIRCURVE_REQUIRE_BROWSER=1
fi

section 'Format'
cargo fmt --all --check
# Files that a macro declares, which cargo fmt does not find.
rustfmt --check --edition 2024 src/discrete/energy/*.rs

section 'Lints'
cargo clippy --locked --workspace --all-targets --quiet -- -D warnings
# The core alone: other packages of the workspace would bring features back. The program without a GPU is what the page is made of.
cargo clippy --locked --package faircurve --no-default-features --quiet -- -D warnings

section 'Documentation'
RUSTDOCFLAGS='-D warnings' cargo doc --locked --workspace --no-deps --quiet

section 'Public face'
# The list is made from what a nightly compiler says of the library; stable ones do not say it.
if cargo +nightly --version >/dev/null 2>&1 && cargo public-api --version >/dev/null 2>&1; then
  tests/public.sh --check
else
  notice 'the public face is not compared with tests/public.txt: that takes a nightly toolchain and cargo-public-api'
fi

# One profile for all: optimised, with debug assertions (profile.dev). Criterion runs each bench once here, as a test.
# tests/gpu/browser.rs captures dispatches of every kernel and runs them in Chromium too.
section 'Tests, and benches in test mode: compiled'
cargo test --locked --workspace --tests --benches --no-run --quiet

section 'Tests, and benches in test mode'
cargo test --locked --workspace --tests --benches --no-fail-fast

export FAIRCURVE_AS_TESTED=1
section 'What measures hardware, tried'
hardware=$(mktemp -d)
benches/hardware.sh pack "$hardware"
FAIRCURVE_QUICK=1 "$hardware/hardware.sh" "$hardware/out"
rm -r "$hardware"

section 'Documentation examples'
cargo test --locked --workspace --doc

if [[ $python_tests == yes ]]; then
  section 'Python'
  wait "$preparing" || fail 'what the Python tests import cannot be installed'
  python/test.sh
fi

export FAIRCURVE=${CARGO_TARGET_DIR:-$PWD/target}/debug/faircurve
export PATH=$(dirname "$FAIRCURVE"):$PATH
if [[ $page == yes ]]; then
  section 'Page and npm package'
  wait "$compiling" || { cat "$logs/wasm" >&2; fail 'the program for browsers cannot be compiled'; }
  web/test.sh
fi

if [[ $python_tests == yes ]]; then
  section 'Site: gallery, links and commands'
  docs/build.sh

  section 'QGIS and Inkscape'
  [[ -z $installing ]] || wait "$installing" || notice 'apt cannot install QGIS and Inkscape'
  integrations/qgis/test.sh
  integrations/inkscape/test.sh
fi

close_section
printf '\nAll checks passed in %s s.\n' "$SECONDS"
for text in ${notices[@]+"${notices[@]}"}; do echo "NOTICE: $text"; done
