#!/usr/bin/env bash
# Fetches the benchmark sets through npm, apt and pip into benches/data (not kept in git).
#
#   benches/data.sh [--full] [hanzi] [countries] [tracts] [gshhg]      default: all four
#
#   hanzi      112,617 curves    629,258 points   stroke medians (npm hanzi-writer-data)
#   countries    1,959 curves     80,617 points   borders and coasts 1:50m (npm world-atlas), also as GeoJSON
#   tracts       1,050 curves     29,576 points   3-D fibre tracts (PyPI dipy)
#   gshhg       45,515 curves    472,443 points   shorelines, and rivers (29,072, 223,071 points; Debian gmt-gshhg-low)
#               --full: also the finest ones: 214,376 curves of 10,995,687 points, rivers 43,996 (gmt-gshhg-full)
#
# A set that is there already is not fetched again. Needs npm, python3 with venv, and for gshhg apt and dpkg.
# The licences are those of the packages; nothing fetched here is part of faircurve.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

full=no
sets=()
for argument in "$@"; do
  case $argument in
    --full) full=yes ;;
    hanzi | countries | tracts | gshhg) sets+=("$argument") ;;
    *) echo "unknown argument $argument: hanzi, countries, tracts, gshhg and --full are possible" >&2; exit 2 ;;
  esac
done
((${#sets[@]})) || sets=(hanzi countries tracts gshhg)

mkdir -p data
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
peers/venv.sh
python=$PWD/peers/.venv/bin/python
export PYTHONDONTWRITEBYTECODE=1

# npm_package NAME@VERSION: unpacks it into a folder and prints the folder's name.
npm_package() {
  local folder=$work/npm-${1%@*}
  mkdir -p "$folder"
  (cd "$folder" && npm pack --silent "$1" >/dev/null && tar -xzf ./*.tgz && rm ./*.tgz)
  echo "$folder/package"
}

# debian_package NAME: the same for a Debian package, which need not be installed.
debian_package() {
  local folder=$work/deb-$1 root=''
  mkdir -p "$folder"
  ((EUID == 0)) || root=sudo
  # As root, apt gives up its rights to download; the folder must let it write.
  chmod 777 "$work" "$folder"
  (cd "$folder" && { apt-get -qq download "$1" || { $root apt-get -qq update && apt-get -qq download "$1"; }; } >&2 &&
    dpkg-deb -x ./*.deb .)
  echo "$folder/usr/share/gmt-gshhg"
}

for set in "${sets[@]}"; do
  case $set in
    hanzi)
      [[ -e data/hanzi.npz ]] && continue
      folder=$(npm_package hanzi-writer-data@2.0.1)
      "$python" fetch/hanzi.py "$folder" data/hanzi.npz
      ;;
    countries)
      [[ -e data/countries-50m.npz ]] && continue
      folder=$(npm_package world-atlas@2.0.2)
      "$python" fetch/countries.py "$folder/countries-50m.json" data/countries-50m.geojson data/countries-50m.npz
      ;;
    tracts)
      [[ -e data/tracts.npz ]] && continue
      "$python" -m pip download --quiet --no-deps --dest "$work" dipy==1.12.1
      "$python" -m zipfile -e "$work"/dipy-*.whl "$work/dipy-wheel"
      "$python" fetch/tracts.py "$work/dipy-wheel" data/tracts.npz
      ;;
    gshhg)
      if [[ ! -e data/shorelines.npz || ! -e data/rivers.npz ]]; then
        folder=$(debian_package gmt-gshhg-low)
        "$python" fetch/gshhg.py "$folder/binned_GSHHS_i.nc" data/shorelines.npz
        "$python" fetch/gshhg.py "$folder/binned_river_i.nc" data/rivers.npz
      fi
      if [[ $full == yes && ! -e data/shorelines-full.npz ]]; then
        folder=$(debian_package gmt-gshhg-full)
        "$python" fetch/gshhg.py "$folder/binned_GSHHS_f.nc" data/shorelines-full.npz
        "$python" fetch/gshhg.py "$folder/binned_river_f.nc" data/rivers-full.npz
      fi
      ;;
  esac
done
