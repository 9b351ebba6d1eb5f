#!/usr/bin/env bash
# Installs the C library through cargo-c: shared and static library, headers, pkg-config and CMake files.
# Usage: tools/install_c.sh PREFIX
set -euo pipefail
. "$(dirname "$0")/lib.sh"
prefix=${1:?usage: tools/install_c.sh PREFIX}
case $prefix in /*) ;; *) die "PREFIX must be an absolute path, got $prefix" ;; esac

cargo_cinstall=$(tools/cargo_tool.sh cargo-c 0.10.18+cargo-0.92.0 cargo-cinstall)
# cargo finds its subcommands on the PATH.
PATH=$(dirname "$cargo_cinstall"):$PATH
cd "$root"
cargo cinstall --release --locked --package surfrecon-capi --prefix "$prefix" --libdir lib ${DESTDIR:+--destdir "$DESTDIR"}
say "installed under $prefix; programs find it with pkg-config surfrecon or find_package(surfrecon)"
