#!/usr/bin/env bash
# Installs one version of a cargo tool into the cache, unless it is there, and prints the path of its program.
# Usage: tools/cargo_tool.sh NAME VERSION [PROGRAM]     PROGRAM is what it installs, where that is not called like it
set -euo pipefail
. "$(dirname "$0")/lib.sh"

name=${1:?usage: tools/cargo_tool.sh NAME VERSION}
version=${2:?usage: tools/cargo_tool.sh NAME VERSION}
program=${3:-$name}
prefix=$cache/cargo/$name-$version
if [ ! -x "$prefix/bin/$program" ]; then
    lock "cargo-$name"
    if [ ! -x "$prefix/bin/$program" ]; then
        say "compiling $name $version, once"
        # A tool that runs for a second needs no optimizing; compiling it fast matters more.
        export CARGO_PROFILE_RELEASE_OPT_LEVEL=0 CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_CODEGEN_UNITS=256
        export CARGO_PROFILE_RELEASE_DEBUG=0 CARGO_PROFILE_RELEASE_STRIP=none
        retry env CARGO_TARGET_DIR="$cache/cargo/build-$name" cargo install --quiet --locked --version "$version" --root "$prefix" "$name" >&2 ||
            die "cargo could not install $name $version: is the crate registry reachable?"
        rm -rf "$cache/cargo/build-$name"
    fi
fi
echo "$prefix/bin/$program"
