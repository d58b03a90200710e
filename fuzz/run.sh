#!/usr/bin/env bash
# Fuzzes by coverage, with libFuzzer: every target for a stated time, one after the other, on a corpus that grows.
#
#   fuzz/run.sh [SECONDS] [TARGET…]      3600 seconds each, all targets, unless told otherwise
#
# Needs a stable Rust toolchain and a C++ compiler. New inputs go to fuzz/found/TARGET, which git ignores; what breaks a target to
# fuzz/artifacts/TARGET, and the script ends with 1. Run an input again with: fuzz/run.sh 0 TARGET, then the binary it names and the file.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

seconds=${1:-3600}
shift || true
targets=("$@")
if [[ ${#targets[@]} -eq 0 ]]; then
  for file in fuzz_targets/*.rs; do targets+=("$(basename "$file" .rs)"); done
fi

# What cargo-fuzz asks of the compiler for coverage, without the sanitizers that need a nightly: there is no unsafe code to sanitize.
triple=$(rustc -vV | sed -n 's/^host: //p')
coverage='-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 -Cllvm-args=-sanitizer-coverage-inline-8bit-counters'
coverage+=' -Cllvm-args=-sanitizer-coverage-pc-table -Cllvm-args=-sanitizer-coverage-trace-compares --cfg fuzzing'
RUSTFLAGS="$coverage" cargo build --release --target "$triple" --bins
binaries=$(cargo metadata --no-deps --format-version 1 | sed -n 's/.*"target_directory":"\([^"]*\)".*/\1/p')/$triple/release

broken=0
for target in "${targets[@]}"; do
  mkdir -p "found/$target" "artifacts/$target"
  echo "=== $target: $binaries/$target"
  ((seconds > 0)) || continue
  # 2 GiB is far more than inputs of 4 KiB may lead to, and a minute far longer, even beside other work. What targets print is not
  # shown. Whole paths: the command line's target runs in a folder of its own.
  "$binaries/$target" "$PWD/found/$target" "$PWD/corpus/$target" -max_total_time="$seconds" -max_len=4096 -timeout=60 -rss_limit_mb=2048 \
    -close_fd_mask=1 -print_final_stats=1 -verbosity=1 -artifact_prefix="$PWD/artifacts/$target/" 2>&1 | grep -v '^#[0-9]*\s*\(NEW\|REDUCE\|pulse\)' || broken=1
done
exit $broken
