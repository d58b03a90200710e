#!/bin/sh
# Builds the program for WASI and puts it into web/dist.
set -eu
cd "$(dirname "$0")/.."
built=web/dist/faircurve.wasm
rustup target add wasm32-wasip1
RUSTFLAGS="-C target-feature=+simd128" cargo build --locked --profile web -p faircurve --bin faircurve --target wasm32-wasip1 \
    --no-default-features --features cli
mkdir -p web/dist
cp "${CARGO_TARGET_DIR:-target}/wasm32-wasip1/web/faircurve.wasm" "$built"
