#!/usr/bin/env bash
# Builds this library and installs the peers, then runs the benchmarks: bench/run.sh [NAME] [--cases TEXT] [--repeats N]
set -euo pipefail
cd "$(dirname "$0")/.."

cargo build --release --quiet -p surfrecon --examples
tools/build_wheel.sh >/dev/null
venv=$(tools/venv.sh bench)
files=$("$venv/bin/python" tools/unpack_wheel.py)
PYTHONPATH=$files exec "$venv/bin/python" bench/run.py "$@"
