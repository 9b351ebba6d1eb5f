#!/usr/bin/env bash
# Prints what to set in a shell so that cargo builds for another system: eval "$(tools/cross.sh x86_64-pc-windows-gnu)"
# For macOS and for Linux zig links: `cargo zigbuild`, `maturin --zig`.
# Rust's standard library is taken where `rustup target add` has put it. Elsewhere it is compiled with the program, from the sources
# that `rustup component add rust-src` or a Debian package of the compiler's version holds: good for testing, not supported upstream.
set -euo pipefail
. "$(dirname "$0")/lib.sh"

triple=${1:-}
grep -q "\"$triple\"" "$root/tools/platforms.py" && [ -n "$triple" ] ||
    die "usage: tools/cross.sh TRIPLE     one of tools/platforms.py, got '$triple'"
host=$(rustc -vV | sed -n 's/^host: //p')
version=$(rustc -vV | sed -n 's/^release: //p')
sysroot=$(readlink -f "$(rustc --print sysroot)")
upper=$(echo "$triple" | tr 'a-z-' 'A-Z_')
set_() { printf 'export %s=%q\n' "$1" "$2"; }

# Sources of the standard library, of the compiler's own version.
sources() {
    local own=$sysroot/lib/rustlib/src/rust folder=$cache/cross/rust-src-$version
    if [ -d "$own/library/std" ]; then echo "$own"; return; fi
    if [ ! -e "$folder/.complete" ]; then
        command -v apt-get >/dev/null ||
            die "Rust's standard library for $triple is missing: rustup target add $triple"
        say "fetching the sources of Rust's standard library $version"
        rm -rf "$folder"
        mkdir -p "$folder/apt/lists/partial" "$folder/apt/archives/partial"
        local mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
        printf 'deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] %s %s main\n' \
            "$mirror" trixie "$mirror" trixie-backports >"$folder/apt/sources.list"
        local apt=(-qq -o Dir::Etc::sourcelist="$folder/apt/sources.list" -o Dir::Etc::sourceparts=-
            -o Dir::State::lists="$folder/apt/lists" -o Dir::Cache="$folder/apt" -o APT::Sandbox::User=root)
        retry apt-get "${apt[@]}" update >&2 || die "$mirror does not answer"
        local package
        package=$(apt-cache "${apt[@]}" madison rust-src | awk '{print $3}' | grep -m1 "^$version+") ||
            die "Debian has no sources of Rust $version: rustup target add $triple, or rustup component add rust-src"
        (cd "$folder" && retry apt-get "${apt[@]}" download "rust-src=$package" >&2) || die "rust-src could not be downloaded"
        dpkg -x "$folder"/rust-src*.deb "$folder"
        rm -rf "$folder/apt" "$folder"/*.deb
        touch "$folder/.complete"
    fi
    echo "$folder/usr/src/rustc-$version"
}

# The toolchain with those sources in it, and with the two objects of windows-gnu that cargo does not build.
toolchain() {
    local from folder
    folder=$cache/cross/rust-$version
    from=$(sources)
    if [ ! -e "$folder/.complete" ]; then
        rm -rf "$folder"
        mkdir -p "$folder"
        # Links cost nothing; over file systems they are not possible.
        for part in bin lib libexec; do
            [ ! -d "$sysroot/$part" ] || cp -al "$sysroot/$part" "$folder/" 2>/dev/null || cp -a "$sysroot/$part" "$folder/"
        done
        mkdir -p "$folder/lib/rustlib/src"
        ln -sfn "$from" "$folder/lib/rustlib/src/rust"
        touch "$folder/.complete"
    fi
    # The program with which rustc strips libraries for macOS looks for LLVM here.
    local shared
    for shared in "$folder"/lib/libLLVM.so.*; do
        [ ! -e "$shared" ] || ln -sf "$shared" "$folder/lib/rustlib/$host/lib/"
    done
    local objects=$folder/lib/rustlib/$triple/lib
    case $triple in *-windows-gnu) if [ ! -e "$objects/rsend.o" ]; then
        mkdir -p "$objects/self-contained"
        for part in rsbegin rsend; do
            RUSTC_BOOTSTRAP=1 "$folder/bin/rustc" --target "$triple" --emit=obj -o "$objects/$part.o" "$from/library/rtstartup/$part.rs"
            cp "$objects/$part.o" "$objects/self-contained/"
        done
    fi ;; esac
    echo "$folder"
}

# Frameworks of macOS that zig has no stubs of: a library's names are all that linking needs, and the Rust bindings list them.
mac_stubs() {
    local sdk=$cache/cross/mac-stubs crates
    if [ ! -e "$sdk/.complete" ]; then
        rm -rf "$sdk"
        mkdir -p "$sdk/usr/lib"
        crates=$(cd "$root" && cargo metadata --format-version 1 --locked --filter-platform "$triple" |
            "$("$root/tools/python.sh")" -c 'import json, sys, pathlib
for package in json.load(sys.stdin)["packages"]:
    print(package["name"], pathlib.Path(package["manifest_path"]).parent)')
        stub CoreFoundation "$(awk '$1 == "objc2-core-foundation" || $1 == "core-foundation-sys" {print $2}' <<<"$crates")" 'kCF|CF|__CF|OBJC'
        stub IOKit "$(awk '$1 == "objc2-io-kit" {print $2}' <<<"$crates")" 'kIO|IO|NX'
        cp "$("$root/tools/venv.sh" build)"/lib/python*/site-packages/ziglang/lib/libc/darwin/libSystem.tbd "$sdk/usr/lib/"
        touch "$sdk/.complete"
    fi
    echo "$sdk"
}

# Writes the stub of a framework: its name, folders of crates that bind it, how its names begin.
stub() {
    local folder=$sdk/System/Library/Frameworks/$1.framework names
    [ -n "$2" ] || die "no crate binds $1 any more: tools/cross.sh need not make a stub of it"
    # shellcheck disable=SC2086 # several folders
    names=$(grep -rhoE "\b(fn|static) ($3)[A-Za-z0-9_]+" $2 --include='*.rs' | awk '{print "_" $2}' | sort -u | paste -sd, | sed 's/,/, /g')
    mkdir -p "$folder"
    cat >"$folder/$1.tbd" <<END
--- !tapi-tbd
tbd-version: 4
targets: [ x86_64-macos, arm64-macos ]
install-name: '/System/Library/Frameworks/$1.framework/Versions/A/$1'
exports:
  - targets: [ x86_64-macos, arm64-macos ]
    symbols: [ $names ]
...
END
}

lock "cross"
path=$("$root/tools/venv.sh" build)/bin
if [ "$triple" != "$host" ] && [ ! -d "$sysroot/lib/rustlib/$triple/lib" ]; then
    folder=$(toolchain)
    path=$folder/bin:$path
    set_ RUSTC "$folder/bin/rustc"
    set_ RUSTC_BOOTSTRAP 1
    set_ CARGO_UNSTABLE_BUILD_STD std,panic_unwind
fi
linking=
case $triple in
    *-windows-gnu)
        command -v x86_64-w64-mingw32-gcc >/dev/null ||
            die "the linker for Windows is missing: apt-get install gcc-mingw-w64-x86-64-win32"
        set_ "CARGO_TARGET_${upper}_LINKER" x86_64-w64-mingw32-gcc
        path=$root/tools/windows-gnu:$path
        ;;
    *-apple-darwin)
        set_ MACOSX_DEPLOYMENT_TARGET 11.0
        if [ "$(uname)" != Darwin ]; then
            set_ SDKROOT "$(mac_stubs)"
            # The identity of a library is a hash of all that zig links, with the places of object files if these are not left out.
            linking=" -C link-arg=-Wl,-S"
        fi
        ;;
esac
set_ PATH "$path:$PATH"
set_ RUSTFLAGS "$(without_paths)$linking"
# A folder each: several may be built at a time, and flags that differ would have all compiled anew each time.
set_ CARGO_TARGET_DIR "$root/target/cross-$triple"
