#!/usr/bin/env bash
# What a GPU does, on a machine that has one and nothing else: no network, no toolchain.
#
#   benches/hardware.sh pack FOLDER    here: builds, and puts all that is needed into FOLDER (some 40 MB)
#   FOLDER/hardware.sh [OUT]           there: runs it, within 6 minutes; writes OUT/hardware.md, hardware.json and logs
#
# What says most comes first: the doctor; every method's whole calls, first and later ones, beside the CPU (f64 before
# f32, lanes last); peers on the same card; rows a second of the ring kernels; results compared with the CPU's on the data
# that ships; and the GPU's tests, as far as time is left (status 124: it was over). A part that fails is named at the end,
# with status 1; the other parts run all the same. Peers are those whose packages python3 has: cuSPARSE, JAX, PyTorch.
#
# VK_DRIVER_FILES       the driver file (ICD), where the loader finds none or a wrong one
# FAIRCURVE_BANDWIDTH   the memory's bandwidth in GB/s that rows are a share of, if not the one that is measured
# FAIRCURVE_SECONDS     seconds for whole calls, 150 if not set
# FAIRCURVE_QUICK       set it to run the smallest sizes only, and few of the tests
# FAIRCURVE_PYTHON      the Python that has the peers' packages, python3 if not set
# FAIRCURVE_AS_TESTED   set it to pack programs as the tests have built them, which are not for measuring
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

pack() {
  local folder=$1
  mkdir -p "$folder/data"
  folder=$(cd "$folder" && pwd)
  cd "$here/.."
  # made NAME COMMAND…: the program of that name among those that cargo makes.
  made() {
    local name=$1
    shift
    cargo "$@" --locked --message-format=json | grep "\"name\":\"$name\"" |
      sed -n 's/.*"executable":"\([^"]*\)".*/\1/p' | tail -1
  }
  local as=release
  [[ -z ${FAIRCURVE_AS_TESTED:-} ]] || as=dev
  cp "$(made faircurve build --profile $as --bin faircurve)" "$folder/faircurve"
  cp "$(made gpu test --no-run --test gpu)" "$folder/gpu-tests"
  cp "$(made hardware build --profile $as --bench hardware)" "$folder/throughput"
  cp "$(made gpu build --profile $as --bench gpu)" "$folder/rows"
  cp "$(made peer_fair build --profile $as --example peer_fair)" "$folder/peer_fair"
  strip "$folder"/{faircurve,gpu-tests,throughput,rows,peer_fair}
  cp examples/data/* "$folder/data/"
  cp benches/hardware.sh benches/peers/{fair,tridiagonal,ratios}.py "$folder/"
  du -sh "$folder"
}

if [[ ${1:-} == pack ]]; then
  pack "${2:?a folder to pack into}"
  exit
fi

out=${1:-$here/out}
mkdir -p "$out"
export FAIRCURVE_REQUIRE_GPU=1 FAIRCURVE_DATA=$here/data FAIRCURVE_JSON=$out/hardware.json
export XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-${TMPDIR:-/tmp}}
failed=()
start=$SECONDS
# part NAME SECONDS COMMAND…: what it prints goes to OUT/NAME.log.
part() {
  local name=$1 seconds=$2
  shift 2
  echo "=== $name"
  timeout "$seconds" "$@" >"$out/$name.log" 2>&1 || failed+=("$name (status $?)")
  tail -n 3 "$out/$name.log"
}

part doctor 60 "$here/faircurve" doctor

measure=(--bench)
[[ -z ${FAIRCURVE_QUICK:-} ]] || measure=()
part throughput 220 "$here/throughput" ${measure[@]+"${measure[@]}"}

# The same fair curves by faircurve on the card and by JAX on it, and the same tridiagonal systems.
peers() {
  local python=$1 few=()
  [[ -z ${FAIRCURVE_QUICK:-} ]] || few=(--rows 4096 --runs 1)
  "$python" "$here/tridiagonal.py" ${few[@]+"${few[@]}"}
  if ! "$python" -c 'import jax, scipy' 2>/dev/null; then
    echo 'Fair curves: not measured, the packages jax and scipy are not here.'
    return
  fi
  mkdir -p "$out/peers"
  "$python" "$here/fair.py" --data "$out/peers" --write-points
  for precision in f32 f64; do
    FAIRCURVE_DATA=$out/peers FAIRCURVE_DEVICE=$precision "$here/peer_fair" --runs 3 >"$out/peers/$precision.json"
  done
  # JAX takes the card if it has one.
  JAX_PLATFORMS='' "$python" "$here/fair.py" --data "$out/peers" --faircurve "$out/peers/f64.json" >"$out/peers/lines.jsonl"
  cat "$out/peers/f32.json" "$out/peers/lines.jsonl"
  "$python" "$here/ratios.py" "$out/peers/lines.jsonl"
}
python=${FAIRCURVE_PYTHON:-python3}
if "$python" -c 'import numpy' 2>/dev/null; then
  export -f peers
  export here out
  part peers 90 bash -euo pipefail -c 'peers "$1"' - "$python"
else
  echo 'Peers: not measured, there is no python3 with NumPy.' | tee "$out/peers.log"
fi

part rows 60 "$here/rows" ${measure[@]+"${measure[@]}"}

compare() {
  local name=$1
  shift
  part "compare-$name" 100 "$here/faircurve" compare "$@" --device gpu
}
storms=$here/data/storms.csv.gz countries=$here/data/countries-110m.geojson
columns=(--columns x=lon,y=lat,curve=id)
compare natural "$storms" "${columns[@]}"
compare smoothing "$storms" "${columns[@]}" --method smoothing --smoothing 0.1
compare countries "$countries"
# In f32 some of these curves end in another minimum, or not, in software too: they are told, not judged.
told() {
  local name=$1 before=${#failed[@]}
  compare "$@"
  ((${#failed[@]} == before)) || unset 'failed[-1]'
  grep -E '^(GPU|f32:|f64:)' "$out/compare-$name.log" || true
}
if [[ -z ${FAIRCURVE_QUICK:-} ]]; then
  told deviation "$countries" --deviation 0.2
  told fair "$countries" --method fair --energy bending=1,length=0.1
  told scf "$countries" --method scf
fi

# Those that read sources, start a browser or ask another driver's compiler stay where the sources are.
only=()
[[ -z ${FAIRCURVE_QUICK:-} ]] || only=(conformance_linalg)
left=$((360 - (SECONDS - start)))
if ((left > 20)); then
  part tests "$left" "$here/gpu-tests" ${only[@]+"${only[@]}"} --skip twins:: --skip browser:: --skip compilers::
else
  echo 'Tests: no time was left.'
fi

{
  echo '## Hardware'
  echo
  cat "$out/doctor.log"
  for log in "$out"/compare-*.log; do
    printf '\n%s\n\n' "$(basename "$log" .log)"
    cat "$log"
  done
  echo
  cat "$out/throughput.log"
  echo
  cat "$out/rows.log"
  echo
  cat "$out/peers.log"
} >"$out/hardware.md"
echo "=== $((SECONDS - start)) s; $out/hardware.md, $out/hardware.json"
if ((${#failed[@]})); then
  printf 'FAILED: %s\n' "${failed[@]}" >&2
  exit 1
fi
