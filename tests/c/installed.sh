#!/usr/bin/env bash
# The C library as installed: the examples built by CMake and by pkg-config against the prefix, and run.
set -uo pipefail
cd "$(dirname "$0")/../.."
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
prefix=$scratch/prefix
failed=0

check() {
    local title=$1
    shift
    if "$@" >"$scratch/log" 2>&1; then
        echo "ok: $title"
    else
        cat "$scratch/log"
        echo "FAILED: $title: $*"
        failed=1
    fi
}

by_cmake() {
    cmake -S c-api/examples -B "$scratch/build" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Release &&
        cmake --build "$scratch/build"
}

by_pkg_config() {
    local flags
    export PKG_CONFIG_PATH=$prefix/lib/pkgconfig
    flags=$(pkg-config --cflags --libs surfrecon) || return 1
    # shellcheck disable=SC2086 # several words
    cc -std=c99 c-api/examples/c/merge_scans.c -o "$scratch/merge_scans" $flags &&
        cc -std=c99 c-api/examples/c/align_scans.c -o "$scratch/align_scans" $flags &&
        cc -std=c99 c-api/examples/c/list_scans.c -o "$scratch/list_scans" $flags &&
        c++ -std=c++17 c-api/examples/cpp/live_tolerance.cpp -o "$scratch/live_tolerance" $flags
}

says_how_to_use() {
    local said
    said=$("$1" 2>&1)
    [[ $said == "usage: "*" OUT.glb SCANS..." ]]
}

lists_a_file() {
    local said
    said=$("$1" rust-core/fuzz/seeds/import_scan/points.laz)
    [[ $said == "points: 8 points, at "* ]]
}

# That of the Rust tests, which is there; `make install` takes a release.
check "installs" env SURFRECON_PROFILE=dev tools/install_c.sh "$prefix"
# Where the library is found is said by its consumer, not by a path inside it.
export LD_LIBRARY_PATH=$prefix/lib
check "examples build with CMake" by_cmake
check "C example built by CMake runs" says_how_to_use "$scratch/build/merge_scans"
check "C example that lists scans, built by CMake, reads LAZ" lists_a_file "$scratch/build/list_scans"
check "C++ example built by CMake runs" "$scratch/build/live_tolerance"
check "C++ example linked statically runs" env -u LD_LIBRARY_PATH "$scratch/build/live_tolerance_static"
check "examples build with pkg-config" by_pkg_config
check "C example built with pkg-config runs" says_how_to_use "$scratch/merge_scans"
check "C example that lists scans, built with pkg-config, reads LAZ" lists_a_file "$scratch/list_scans"
check "C++ example built with pkg-config runs" "$scratch/live_tolerance"
# Two versions of the library may be installed beside each other: programs ask for the one they were built with.
check "programs ask for the library by its versioned name" grep -q "libsurfrecon.so.0.1" <(readelf -d "$scratch/merge_scans")
exit $failed
