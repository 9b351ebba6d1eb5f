#!/usr/bin/env bash
# Builds this library and installs the peers, then runs the benchmarks: bench/run.sh [NAME] [--cases TEXT] [--repeats N]
set -euo pipefail
cd "$(dirname "$0")/.."

case ${1:-} in
    sculpt) cargo build --release --quiet -p surfrecon --example sculpt_reference ;;
    *) cargo build --release --quiet -p surfrecon --examples ;;
esac
tools/build_wheel.sh >/dev/null
case ${1:-meshlab} in
    # Without MeshLab's headers the benchmark says that it was skipped.
    meshlab | --*) tools/build_meshlab_plugin.sh 2025.07-double >/dev/null || rm -f out/meshlab-plugin/2025.07-double/* ;;
esac
venv=$(tools/venv.sh bench)
files=$("$venv/bin/python" tools/unpack_wheel.py)
PYTHONPATH=$files exec "$venv/bin/python" bench/run.py "$@"
