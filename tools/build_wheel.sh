#!/usr/bin/env bash
# Builds the Python wheel into target/wheels/. Usage: tools/build_wheel.sh [PLATFORM]     this one, or one of tools/platforms.py
# On Linux it is linked by zig against glibc 2.28, the oldest that Blender's own builds support. Blender does not look at
# the glibc number of a wheel: one that is too new is not refused, it only fails to load.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

python=$("$root/tools/python.sh")
triple=$("$python" tools/platforms.py "$@")
options=()
if [ $# = 0 ]; then
    # maturin finds zig through the `python` on PATH.
    PATH=$("$root/tools/venv.sh" build)/bin:$PATH
else
    environment=$(tools/cross.sh "$triple")
    eval "$environment"
    options+=(--target "$triple")
fi
mkdir -p target
exec 9>target/wheel.lock   # this tree only: others build wheels of their own
wait_for_lock wheel
case $triple in
    x86_64-*-linux-*) options+=(--zig --compatibility manylinux_2_28) tag='*linux*_x86_64' ;;
    aarch64-*-linux-*) options+=(--zig --compatibility manylinux_2_28) tag='*linux*_aarch64' ;;
    x86_64-*-windows-*) tag=win_amd64 ;;
    aarch64-apple-*) tag='macosx*_arm64' ;;
    x86_64-apple-*) tag='macosx*_x86_64' ;;
esac
case $triple in *-apple-*) [ "$(uname)" = Darwin ] || options+=(--zig) ;; esac
mkdir -p target/wheels
made=$(mktemp -d target/wheels/.made-XXXXXX)
log=$(mktemp)
# It stands among the sources, where maturin looks for licences, as long as the wheel is built: it is of this platform.
licences=python/LICENSES-THIRD-PARTY.txt
trap 'rm -rf "$log" "$licences" "$made"' EXIT
"$python" tools/third_party_licences.py "$licences" --package surfrecon-python --target "$triple"
[ -d "${CARGO_TARGET_DIR:-target}/release" ] || say "compiling surfrecon for Python: some minutes the first time"
maturin build --quiet --release --locked "${options[@]}" -i "$python" \
    --manifest-path python/Cargo.toml --out "$made" >"$log" 2>&1 || {
    cat "$log" >&2
    die "maturin could not build the wheel, see above"
}
"$python" tools/wheel_without_paths.py "$made"/*.whl
# Whoever looks meanwhile finds the old wheel or the new one. What has the old name or the old version is not taken for the new one.
new=target/wheels/$(basename "$made"/*.whl)
mv -f "$made"/*.whl target/wheels/
# shellcheck disable=SC2086 # the tag is a pattern
for old in target/wheels/surfrecon-*-$tag.whl; do [ "$old" = "$new" ] || rm -f "$old"; done
ls "$new"
