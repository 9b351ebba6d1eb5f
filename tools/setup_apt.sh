#!/usr/bin/env bash
# Installs the system libraries the machine lacks. Does nothing when all are there.
# Usage: tools/setup_apt.sh [test|bench|meshlab|gui]     for the demo; else also what tests, the benchmark's peers, building the
# MeshLab plugin or the tests in a window need
set -euo pipefail
. "$(dirname "$0")/lib.sh"

# Libraries that the bpy module links to, and software OpenGL for rendering without a display.
packages=(libx11-6 libxrender1 libxfixes3 libxi6 libxkbcommon0 libsm6 libgl1 libxxf86vm1 libgomp1 libegl1 libgl1-mesa-dri)
# Programs that programs in C are built with, run under and compared by, MeshLab itself, what it needs without a display, and the judge of STL.
if [ "${1:-}" = test ]; then packages+=(admesh cmake pkg-config make valgrind abigail-tools binutils meshlab xvfb xauth xdotool openbox imagemagick); fi
# Headers that the MeshLab plugin is built with: MeshLab's headers include those of Qt, GLEW and Eigen.
case ${1:-} in
    test | bench | meshlab) packages+=(cmake make xz-utils dpkg-dev qtbase5-dev libqt5opengl5-dev libglew-dev libeigen3-dev) ;;
esac
# Libraries that pymeshlab and Open3D link to besides.
case ${1:-} in test | bench) packages+=(libglu1-mesa libopengl0 libusb-1.0-0 libfontconfig1 libfreetype6 libgmp10 libudev1) ;; esac

# The program that installs another Debian.
if [ "${1:-}" = gui ]; then packages+=(debootstrap); fi
# The peers that are libraries in C++, and what Gmsh links to.
if [ "${1:-}" = bench ]; then packages+=(libcgal-dev libboost-dev libgmp-dev libmpfr-dev libtbb-dev libtet1.5-dev libxcursor1 libxft2 libxinerama1); fi
# The slicer that judges closed surfaces: 44 packages, 440 MB, 40 s. Without it the benchmark says so.
if [ "${1:-}" = bench ] && apt-cache show prusa-slicer >/dev/null 2>&1; then packages+=(prusa-slicer); fi
# Not in every Debian; without it the benchmark says so and counts the lines of its programs.
if [ "${1:-}" = bench ] && apt-cache show libopen3d-dev >/dev/null 2>&1; then packages+=(libopen3d-dev pkg-config); fi

command -v cargo >/dev/null || die "cargo is missing: install the Rust toolchain, https://rustup.rs"
if ! command -v c++ >/dev/null; then packages+=(g++); fi

if ! command -v dpkg-query >/dev/null; then
    say "not a Debian system: make sure that the equivalents of these are installed: ${packages[*]}"
    exit 0
fi

missing=()
for package in "${packages[@]}"; do
    state=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
    # Newer releases rename libraries (libfoo -> libfoot64) and declare that they provide the old name.
    if [ "$state" != installed ] && ! dpkg-query -W -f '${Provides}\n' 2>/dev/null | grep -qw -- "$package"; then
        missing+=("$package")
    fi
done
[ ${#missing[@]} = 0 ] && exit 0

if [ "$(id -u)" != 0 ]; then
    die "these packages are missing and only root can install them: sudo apt-get install ${missing[*]}"
fi
lock apt
say "installing ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive
retry apt-get update -qq || die "apt-get update failed: is the package mirror reachable?"
retry apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null || die "apt-get could not install ${missing[*]}"
