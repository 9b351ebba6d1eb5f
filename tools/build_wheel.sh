#!/usr/bin/env bash
# Builds the Python wheel into target/wheels/. Usage: tools/build_wheel.sh
# On Linux it is linked by zig against glibc 2.28, the oldest that Blender's own builds support. Blender does not look at
# the glibc number of a wheel: one that is too new is not refused, it only fails to load.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

# maturin finds zig through the `python` on PATH.
PATH=$("$root/tools/venv.sh" build)/bin:$PATH
mkdir -p target
exec 9>target/wheel.lock   # this tree only: others build wheels of their own
wait_for_lock wheel
portable=()
if [ "$(uname)" = Linux ]; then portable=(--zig --compatibility manylinux_2_28); fi
rm -f target/wheels/surfrecon-*.whl
log=$(mktemp)
trap 'rm -f "$log"' EXIT
[ -d target/release ] || say "compiling surfrecon for Python: some minutes the first time"
maturin build --quiet --release "${portable[@]}" -i "$("$root/tools/python.sh")" \
    --manifest-path blender-addon/python/Cargo.toml --out target/wheels >"$log" 2>&1 || {
    cat "$log" >&2
    die "maturin could not build the wheel, see above"
}
ls target/wheels/surfrecon-*.whl
