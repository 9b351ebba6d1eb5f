#!/usr/bin/env bash
# Runs each fuzz target of rust-core/fuzz for FUZZ_SECONDS=60. Usage: tools/fuzz.sh [TARGET...]
# The flags are those of cargo-fuzz without a sanitizer, so that the stable compiler will do and nothing has to be installed.
# What a target finds stays in out/fuzz/TARGET: make it a named unit test.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

seconds=${FUZZ_SECONDS:-60}
host=$(rustc -vV | sed -n 's/^host: //p')
command -v c++ >/dev/null || die "a C++ compiler is missing: libFuzzer is compiled from source"

# Coverage feedback for our code and what it calls; --target keeps these flags away from build scripts.
export RUSTFLAGS="--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table
    -Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1"
RUSTFLAGS=$(echo $RUSTFLAGS)
cargo build --quiet --release --manifest-path rust-core/fuzz/Cargo.toml --target "$host" --target-dir target/fuzz

targets=("$@")
if [ ${#targets[@]} = 0 ]; then
    for file in rust-core/fuzz/fuzz_targets/*.rs; do targets+=("$(basename "$file" .rs)"); done
fi
failed=()
for target in "${targets[@]}"; do
    echo "== $target, $seconds s"
    mkdir -p "out/fuzz/$target/corpus"
    seeds=()
    if [ -d "rust-core/fuzz/seeds/$target" ]; then seeds+=("rust-core/fuzz/seeds/$target"); fi
    dictionary=()
    if [ -f "rust-core/fuzz/dictionaries/$target.dict" ]; then dictionary+=("-dict=rust-core/fuzz/dictionaries/$target.dict"); fi
    # A reader's memory is bounded by its file's size: inputs of at most 64 kB must not need 1 GB, nor 5 s.
    target/fuzz/"$host"/release/"$target" "out/fuzz/$target/corpus" "${seeds[@]}" "${dictionary[@]}" -max_total_time="$seconds" \
        -max_len=65536 -rss_limit_mb=1024 -timeout=5 -print_funcs=0 -print_final_stats=1 \
        -artifact_prefix="out/fuzz/$target/" >"out/fuzz/$target/log" 2>&1 || failed+=("$target")
    tail -n 5 "out/fuzz/$target/log"
done
[ ${#failed[@]} = 0 ] || die "failed: ${failed[*]}; logs and inputs are in out/fuzz/"
echo "fuzz: ${#targets[@]} targets, nothing found"
