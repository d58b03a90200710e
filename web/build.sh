#!/bin/sh
# Puts a folder together that any host can serve: web/build.sh FOLDER
set -eu
[ $# -eq 1 ] || { echo "usage: web/build.sh FOLDER" >&2; exit 2; }
mkdir -p "$1"
folder=$(cd "$1" && pwd)
cd "$(dirname "$0")"
./wasm.sh
mkdir -p "$folder/dist" "$folder/samples"
cp -r index.html style.css icon.svg faircurve.mjs npz.mjs page vendor "$folder"
cp dist/faircurve.wasm "$folder/dist"
for sample in world-110m.topojson traced.svg storms.csv.gz tracts.trk NOTICE; do
    cp "../examples/data/$sample" "$folder/samples"
done
cp ../LICENSE-MIT ../LICENSE-APACHE "$folder"
node size.mjs "$folder"
