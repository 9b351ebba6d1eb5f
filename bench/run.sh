#!/usr/bin/env bash
# Builds this library and installs the peers, then runs the benchmarks: bench/run.sh [NAME] [OPTION...], see --help
set -euo pipefail
cd "$(dirname "$0")/.."

# Nothing is built to say what there is.
case " $* " in *" -h "* | *" --help "*) exec "$(tools/python.sh)" bench/run.py --help ;; esac

case ${1:-} in "" | -*) name=all ;; *) name=$1 ;; esac
asked() { [ "$name" = all ] || [ "$name" = "$1" ]; }

cargo build --release --quiet -p surfrecon --examples
if asked capi; then
    cargo build --release --quiet -p surfrecon-capi
    cargo build --release --quiet -p surfrecon-tests --example capi_overhead
fi
if asked io; then
    cargo build --release --quiet -p surfrecon-tests --example decoders
fi
# The benchmark says what a peer lacks, and counts it as skipped.
if asked sculpt; then
    cargo build --release --quiet --locked --manifest-path bench/meshopt/Cargo.toml --target-dir "${CARGO_TARGET_DIR:-target}" || true
fi
if asked meshlab; then
    tools/build_meshlab_plugin.sh 2025.07-double >/dev/null || rm -f out/meshlab-plugin/2025.07-double/*
fi
tools/build_wheel.sh >/dev/null
venv=$(tools/venv.sh bench)
files=$("$venv/bin/python" tools/unpack_wheel.py)
PYTHONPATH=$files exec "$venv/bin/python" bench/run.py "$@"
