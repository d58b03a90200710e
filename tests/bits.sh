#!/usr/bin/env bash
# Prints a hash of what every method gives on the data that ships: run it before and after a change that must not move a bit.
#
#   tests/bits.sh PROGRAM [cpu|f32|f64]… > bits.txt      default: all three; f32 and f64 run on the first GPU
#
# One row a run: hash of the output, hash of the report's curves, exit status, name. Where a row differs, run its command
# (`-v` as the first argument prints them) with both programs and compare the files.
set -euo pipefail

verbose=no
if [[ ${1:-} == -v ]]; then
  verbose=yes
  shift
fi
program=$(realpath "${1:?the program to run}")
shift
devices=("${@:-cpu f32 f64}")
data=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../examples/data")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

hash_of() { if [[ -e $1 ]]; then sha256sum <"$1" | cut -c 1-16; else echo '-               '; fi; }

# run NAME OUTPUT ARGUMENT…: hashes OUTPUT and the report's rows. Its head names the device.
run() {
  local name=$1 output=$work/$2 status=0
  shift 2
  [[ $verbose == no ]] || echo "$program $* ${device[*]} -o $output --report $work/report.json --force -q" >&2
  rm -f "$work"/*
  "$program" "$@" "${device[@]}" -o "$output" --report "$work/report.json" --force -q >/dev/null 2>&1 || status=$?
  if [[ -e $work/report.json ]]; then sed '1d; s/"seconds":{[^}]*}//' "$work/report.json" >"$work/rows.json"; fi
  printf '%s %s %s %s %s\n' "$(hash_of "$output")" "$(hash_of "$work/rows.json")" "$status" "$which" "$name"
}

for which in ${devices[@]}; do
  case $which in
    cpu) device=(--device cpu) ;;
    f32 | f64) device=(--device gpu --precision "$which") ;;
    *) echo "unknown device $which" >&2; exit 2 ;;
  esac
  borders=$data/countries-110m.geojson storms=$data/storms.csv.gz dots=$data/dots.csv octopus=$data/octopus.csv
  storms_columns=(--columns x=lon,y=lat,curve=id,t=hours)

  run 'natural 110m' o.csv fit "$borders"
  run 'natural 110m to GeoJSON' o.geojson fit "$borders" --samples 5
  run 'natural storms, t' o.csv fit "$storms" "${storms_columns[@]}"
  run 'natural storms, spacing' o.csv fit "$storms" "${storms_columns[@]}" --spacing 0.3
  run 'natural 110m, Béziers' o.svg fit "$borders" --as bezier --tolerance 0.01
  run 'smoothing 0.01' o.csv fit "$borders" --smoothing 0.01
  run 'smoothing deviation' o.csv fit "$borders" --method smoothing --deviation 0.1
  run 'smoothing deviation, storms, unpinned' o.csv fit "$storms" "${storms_columns[@]}" --deviation 0.2 --pin none
  run 'tube' o.csv fit "$borders" --tube 0.1
  run 'fair bending' o.csv fit "$borders" --method fair
  run 'fair bending, length' o.csv fit "$borders" --method fair --energy bending=1,length=1
  run 'fair deviation, storms, t' o.csv fit "$storms" "${storms_columns[@]}" --method fair --energy bending=1,length=1 --deviation 0.2
  run 'fair corners' o.csv fit "$borders" --method fair --corners 60deg
  run 'fair exponent' o.csv fit "$dots" --method fair --exponent 3 --energy bending=1,length=0.1
  run 'fair tension' o.csv fit "$octopus" --method fair --energy bending=1,tension=0.1
  run 'fair variation' o.csv fit "$octopus" --method fair --energy variation=1,length=0.1
  run 'fair attachment' o.csv fit "$octopus" --method fair --energy bending=1,attachment=10
  run 'fair, Sobolev gradients' o.csv fit "$octopus" --method fair --solver sobolev --energy bending=1,length=0.1
  run 'fair, areas kept' o.csv fit "$dots" --method fair --deviation 2% --preserve-area
  run 'fair deviation' o.csv fit "$octopus" --method fair --deviation 0.5
  run 'fair, Béziers' o.csv fit "$octopus" --method fair --as bezier --tolerance 0.01
  run 'scf' o.csv fit "$octopus" --method scf
  run 'scf, exponent 3' o.csv fit "$dots" --method scf --exponent 3
  run 'scf, starts' o.csv fit "$dots" --method scf --starts 8
  run 'scf, tension' o.csv fit "$dots" --method scf --exponent 3 --tension 1
  run 'scf 110m' o.csv fit "$borders" --method scf --samples 4
  run 'Bézier' o.csv bezier "$data/control_points.csv"
  run 'Bézier, variation' o.csv bezier "$data/control_points.csv" --energy variation=1,tension=0.1
  run 'Bézier, elevated' o.npz bezier "$data/control_points.csv" --elevate 2
  run 'Bézier, reduced' o.csv bezier "$data/control_points.csv" --known file --elevate 3 --as polyline
  run 'chain, c2' o.csv bezier "$octopus" --degree 3 --known joints --joints c2
  run 'chain, g1' o.svg bezier "$octopus" --degree 3 --known joints --joints g1
  run 'grid, exact' o.npz grid "$data/grids.csv"
  run 'grid, sparse' o.npz grid "$data/grids.csv" --rule sparse --support 7
  run 'grid, mesh' o.obj grid "$data/heights.csv" --rounds 4
done

# Tables and pictures of the papers, on the CPU, if their program lies beside this one; scf.txt has seconds in it.
papers=$(dirname "$program")/faircurve-papers
if [[ " ${devices[*]} " == *' cpu '* && -x $papers ]]; then
  "$papers" -o "$work/experiments" -q >/dev/null
  (cd "$work/experiments" && find . -type f ! -name scf.txt | sort | xargs sha256sum | cut -c 1-16,65-)
fi
