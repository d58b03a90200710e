#!/usr/bin/env bash
# Makes everything that a release consists of, and checks it. Nothing leaves this machine: at the end it prints the commands that do.
#
#   ./release.sh [--dry-run] [FOLDER]
#
# FOLDER (target/release-files) then holds both crates, wheels for Linux (x86-64 and AArch64), the source distribution, the npm package, the
# static page, CITATION.cff and SHA256SUMS. --dry-run takes a working tree with changes, and a changelog that does not name the version yet.
#
# Needs Rust, and Python 3.10 with venv: the wheels are linked by zig, which pip brings with maturin. Node packs the npm package.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

dry_run=no
[[ ${1:-} != --dry-run ]] || { dry_run=yes; shift; }
target=${CARGO_TARGET_DIR:-$PWD/target}
mkdir -p "${1:-$target/release-files}"
out=$(cd "${1:-$target/release-files}" && pwd)
rm -rf "${out:?}"/*

section() { printf '\n=== %s\n' "$1"; }
fail() {
  echo "FAILED: $1" >&2
  exit 1
}
# A fault that a dry run only names.
fault() {
  [[ $dry_run == yes ]] || fail "$1"
  echo "NOTICE: $1"
}
field() { sed -n "s/^$2 = \"\\(.*\\)\"/\\1/p" "$1" | head -1; }

section 'Versions'
version=$(field Cargo.toml version)
for manifest in src/dct/Cargo.toml python/Cargo.toml; do
  [[ $(field "$manifest" version) == "$version" ]] || fail "$manifest has version $(field "$manifest" version), and Cargo.toml $version: make them equal"
done
for file in CITATION.cff web/package.json; do
  grep -Eq "\"?version\"?: \"?$version\"?,?\$" "$file" || fail "$file does not have version $version"
done
echo "version $version"
grep -q "^## \[$version\]" CHANGELOG.md || fault "CHANGELOG.md has no section [$version]: rename [Unreleased]"
[[ -z $(git status --porcelain) ]] || fault 'the working tree has changes: commit them'
! git rev-parse -q --verify "refs/tags/v$version" >/dev/null || fault "there is a tag v$version: raise the version"

section 'Crates'
cargo package --locked -p faircurve-dct -p faircurve $([[ $dry_run == no ]] || echo --allow-dirty)
for crate in faircurve-dct faircurve; do
  cp "$target/package/$crate-$version.crate" "$out"
  bytes=$(wc -c <"$out/$crate-$version.crate")
  ((bytes <= 5 << 20)) || fail "$crate-$version.crate has $bytes bytes, and 5 MiB is the most: exclude files in Cargo.toml"
  echo "$crate-$version.crate: $bytes bytes"
done

section 'Promises'
last=$(git describe --tags --match 'v*' --abbrev=0 2>/dev/null || true)
if [[ -z $last ]]; then
  echo 'no release to compare with'
elif cargo semver-checks --version >/dev/null 2>&1; then
  cargo semver-checks --package faircurve --baseline-rev "$last"
else
  fault "cargo semver-checks is missing: cargo install --locked cargo-semver-checks"
fi

section 'Wheels'
venv=$target/release-tools
[[ -x $venv/bin/maturin ]] || python3 -m venv "$venv" || fail 'there is no Python with venv: install python3-venv'
"$venv/bin/pip" install --quiet --disable-pip-version-check 'maturin>=1.9,<2' ziglang cffconvert twine
"$venv/bin/cffconvert" --validate
for machine in x86_64 aarch64; do
  rustup target add "$machine-unknown-linux-gnu"
  (cd python && PATH=$venv/bin:$PATH maturin build --release --locked --zig --compatibility manylinux2014 --target "$machine-unknown-linux-gnu" --out "$out")
done
(cd python && "$venv/bin/maturin" sdist --out "$out")
"$venv/bin/twine" check --strict "$out"/*.whl "$out"/*.tar.gz
# The wheel of this machine, with numpy alone.
rm -rf "$target/release-try"
python3 -m venv "$target/release-try"
"$target/release-try/bin/pip" install --quiet --disable-pip-version-check "$out"/*"$(uname -m)"*.whl
"$target/release-try/bin/python" -c 'import faircurve as fc; assert (fc.Fair().fit([[(0, 0), (2, 1), (3, 0)]]).status == "converged").all()'
"$target/release-try/bin/faircurve" --version

section 'Page and npm package'
if command -v npm >/dev/null; then
  web/build.sh "$target/release-page"
  tar -czf "$out/faircurve-page-$version.tar.gz" -C "$target/release-page" .
  npm pack --silent --pack-destination "$out" ./web
else
  fault 'there is no npm: the npm package is not made'
fi

section 'Sums'
cp CITATION.cff "$out"
(cd "$out" && sha256sum -- * | tee SHA256SUMS)

section 'To release'
cat <<END
git tag -s v$version && git push --tags
cargo publish -p faircurve-dct -p faircurve
$venv/bin/twine upload $out/*.whl $out/faircurve-$version.tar.gz
npm publish $out/faircurve-$version.tgz
END
