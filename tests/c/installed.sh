#!/usr/bin/env bash
# The C library as installed: what is in it, and the examples built by CMake and by pkg-config against it, and run.
# Installs what the Rust tests have built; SURFRECON_PROFILE=release a release, of which more is asked. SURFRECON_BUILT may name
# libraries that are built.
set -uo pipefail
cd "$(dirname "$0")/../.."
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
prefix=$scratch/prefix
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -1)
compatible=${version%%.*}
[ "$compatible" != 0 ] || compatible=${version%.*}
library=$prefix/lib/libsurfrecon.so.$version
export SURFRECON_PROFILE=${SURFRECON_PROFILE:-dev}
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
    local flags static
    export PKG_CONFIG_PATH=$prefix/lib/pkgconfig
    flags=$(pkg-config --cflags --libs surfrecon) && static=$(pkg-config --static --cflags --libs surfrecon) || return 1
    # shellcheck disable=SC2086 # several words
    cc -std=c99 c-api/examples/c/merge_scans.c -o "$scratch/merge_scans" $flags &&
        cc -std=c99 c-api/examples/c/merge_frames.c -o "$scratch/merge_frames" $flags -lm &&
        cc -std=c99 c-api/examples/c/align_scans.c -o "$scratch/align_scans" $flags &&
        cc -std=c99 c-api/examples/c/list_scans.c -o "$scratch/list_scans" $flags &&
        cc -std=c99 -static c-api/examples/c/list_scans.c -o "$scratch/list_scans_static" $static &&
        c++ -std=c++17 -pthread c-api/examples/cpp/tracked_camera.cpp -o "$scratch/tracked_camera" $flags &&
        c++ -std=c++17 -pthread c-api/examples/cpp/merge_server.cpp -o "$scratch/merge_server" $flags &&
        c++ -std=c++17 c-api/examples/cpp/live_tolerance.cpp -o "$scratch/live_tolerance" $flags
}

# The program of the header's beginning, by the lines of the guide.
by_guide() {
    local folder=$scratch/guide lines
    mkdir "$folder" && sed -n 's|^ \*     ||p; /^#ifndef/q' c-api/include/surfrecon.h >"$folder/app.c" || return 1
    lines=$(grep '^cc app\.c ' docs/site/guide/c.md) && [ "$(wc -l <<<"$lines")" = 2 ] || return 1
    { echo 'cmake_minimum_required(VERSION 3.16)'; echo 'project(app C)'; echo 'add_executable(app app.c)'; sed -n '/^```cmake$/,/^```$/p' docs/site/guide/c.md | sed '/^```/d'; } \
        >"$folder/CMakeLists.txt"
    export PKG_CONFIG_PATH=$prefix/lib/pkgconfig
    (cd "$folder" && bash -euc "$lines") && cmake -S "$folder" -B "$folder/build" -DCMAKE_PREFIX_PATH="$prefix" && cmake --build "$folder/build" &&
        asks_for_files "$folder/app" && asks_for_files "$folder/build/app"
}

# Checks what that program does without arguments.
asks_for_files() {
    "$1"
    [ $? = 2 ]
}

says_how_to_use() {
    local said
    said=$("$1" 2>&1)
    [[ $said == "usage: "*" OUT SCANS..." ]]
}

lists_a_file() {
    local said
    said=$("$1" rust-core/fuzz/seeds/import_scan/points.laz)
    [[ $said == "points: 8 points, at "* ]]
}

# Installed at one place and used at another: nothing inside may name the first.
installs_and_moves() {
    DESTDIR=$scratch/staged tools/install_c.sh /opt/elsewhere && mv "$scratch/staged/opt/elsewhere" "$prefix"
}

names_no_place() {
    local described
    described=$(readelf -d "$library") && ! grep -E "RPATH|RUNPATH" <<<"$described" &&
        ! grep -rlE --include={*.pc,*.cmake,*.h,*.hpp,*.txt} "/opt/elsewhere|$scratch|$PWD" "$prefix"
}

is_stripped() {
    local sections
    sections=$(readelf -SW "$library") && ! grep -E '\.symtab|\.debug_' <<<"$sections"
}

# A line of Rust's own library, whose debug information is there for any profile: addr2line follows the link to it.
finds_debug_information() {
    local address
    address=$(nm "$prefix/lib/.debug/libsurfrecon.so.$version.debug" | grep -m 1 ' t .*panicking.*default_hook')
    addr2line -e "$library" "0x${address%% *}" | grep 'library/std/.*[0-9]$'
}

# All that is exported has the version, and programs ask for it.
symbols_have_a_version() {
    diff <(nm -D --defined-only "$library" | sed -n 's/.* T //p' | sort) <(sed "s/\$/@@SURFRECON_$compatible/" c-api/abi/symbols.txt | sort) &&
        nm -D "$scratch/merge_scans" | grep "U srf_merger_run@SURFRECON_$compatible"
}

asks_for_no_unwinder() {
    local private
    private=$(pkg-config --static --libs surfrecon) && ! grep gcc <<<"$private"
}

# Of all that is linked, and of nothing that only runs in the compiler or in tests.
licences_are_there() {
    local folder=$prefix/share/doc/surfrecon named
    cmp LICENSE-MIT "$folder/LICENSE-MIT" && cmp LICENSE-APACHE "$folder/LICENSE-APACHE" || return 1
    for named in "Rust's standard library" rayon-core roxmltree zune-inflate rustix; do
        grep "^- $named [0-9.]*: " "$folder/LICENSES-THIRD-PARTY.txt" || return 1
    done
    ! grep -E "^- (surfrecon|serde_derive|proptest)" "$folder/LICENSES-THIRD-PARTY.txt"
}

# Whether CMake takes the library for the version that a program asks for.
cmake_takes() {
    cat >"$scratch/wanted.cmake" <<END
set(PACKAGE_FIND_VERSION $1)
include($prefix/share/cmake/surfrecon/surfreconConfigVersion.cmake)
if(NOT PACKAGE_VERSION_COMPATIBLE STREQUAL "$2" OR NOT PACKAGE_VERSION STREQUAL "$version")
  message(FATAL_ERROR "\${PACKAGE_VERSION} as $1: \${PACKAGE_VERSION_COMPATIBLE}")
endif()
END
    cmake -P "$scratch/wanted.cmake"
}

# Libraries that are only names: where each goes, and what CMake hears of it.
installs_for_windows() {
    local built=$scratch/windows there=$scratch/for-windows file
    mkdir "$built" && touch "$built/surfrecon.dll" "$built/libsurfrecon.dll.a" "$built/libsurfrecon.a" || return 1
    # Writes a file that there is nothing in.
    printf '#!/bin/bash\ntouch "${@: -1}"\n' >"$built/objcopy" && chmod +x "$built/objcopy"
    SURFRECON_OBJCOPY=$built/objcopy SURFRECON_TARGET=x86_64-pc-windows-gnu SURFRECON_BUILT=$built tools/install_c.sh "$there" || return 1
    for file in bin/surfrecon.dll bin/.debug/surfrecon.dll.debug lib/libsurfrecon.dll.a lib/libsurfrecon.a include/surfrecon.h lib/pkgconfig/surfrecon.pc; do
        test -f "$there/$file" || return 1
    done
    grep 'LOCATION "${_surfrecon_prefix}/bin/surfrecon.dll"' "$there/share/cmake/surfrecon/surfreconConfig.cmake" &&
        grep 'IMPLIB "${_surfrecon_prefix}/lib/libsurfrecon.dll.a"' "$there/share/cmake/surfrecon/surfreconConfig.cmake"
}

has_at_most_8_mb() {
    local size
    size=$(stat -c %s "$library")
    echo "$size bytes"
    [ "$size" -le 8000000 ]
}

# libabigail reads the arguments of functions from the debug information.
tells_types() {
    abidw --no-corpus-path "$library" --out-file "$scratch/library.abi" &&
        grep -A5 "<function-decl name='srf_merger_run'" "$scratch/library.abi" | grep "<parameter "
}

check "installs, and is moved" installs_and_moves
# The consumer of the library says where it is found, not a path inside it.
export LD_LIBRARY_PATH=$prefix/lib
check "examples build with CMake" by_cmake
check "C example built by CMake runs" says_how_to_use "$scratch/build/merge_scans"
check "C++ example with threads built by CMake runs" "$scratch/build/tracked_camera" "$scratch/frames.glb" 3
check "C example that lists scans, built by CMake, reads LAZ" lists_a_file "$scratch/build/list_scans"
check "C++ example built by CMake runs" "$scratch/build/live_tolerance"
check "C++ example with the static library runs" env -u LD_LIBRARY_PATH "$scratch/build/live_tolerance_static"
check "examples build with pkg-config" by_pkg_config
check "the lines of the guide build the program of the header" by_guide
check "C example built with pkg-config runs" says_how_to_use "$scratch/merge_scans"
check "C example that lists scans, built with pkg-config, reads LAZ" lists_a_file "$scratch/list_scans"
check "C++ example built with pkg-config runs" "$scratch/live_tolerance"
check "C example linked with -static reads LAZ" lists_a_file "$scratch/list_scans_static"
check "C example linked with -static needs no library" bash -c "! readelf -d '$scratch/list_scans_static' | grep NEEDED"
# Two versions of the library may be installed beside each other: programs ask for the one they were built with.
check "programs ask for the library by its versioned name" grep -q "\[libsurfrecon.so.$compatible\]" <(readelf -d "$scratch/merge_scans")
check "symbols have a version" symbols_have_a_version
check "nothing installed names a place" names_no_place
check "the library is stripped" is_stripped
check "its debug information is found" finds_debug_information
check "pkg-config asks for no unwinder" asks_for_no_unwinder
check "licences are installed" licences_are_there
check "CMake takes this version" cmake_takes "$version" TRUE
check "CMake takes a compatible version" cmake_takes "$compatible" TRUE
check "CMake takes no later version" cmake_takes 99 FALSE
check "CMake takes no incompatible version" cmake_takes 0.0.9 FALSE
check "installs for Windows" installs_for_windows
if [ "$SURFRECON_PROFILE" = release ]; then
    check "the library has at most 8 MB" has_at_most_8_mb
    check "its debug information tells types" tells_types
fi
exit $failed
