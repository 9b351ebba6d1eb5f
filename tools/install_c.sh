#!/usr/bin/env bash
# Installs the C library: shared and static library, headers, licences, pkg-config and CMake files. The installed tree can be moved.
# Usage: tools/install_c.sh PREFIX     In the environment:
#   DESTDIR              is put before all paths
#   SURFRECON_TARGET     the system it is for, by Rust's name; else this one. tools/cross.sh sets up what building for it takes
#   SURFRECON_PROFILE    another profile of cargo than release: dev
#   SURFRECON_BUILT      a folder with the libraries as cargo built them: then nothing is compiled
#   SURFRECON_CC, LDFLAGS, SURFRECON_OBJCOPY    link the shared library for Linux; take debug information out
set -euo pipefail
. "$(dirname "$0")/lib.sh"
prefix=${1:?usage: tools/install_c.sh PREFIX}
case $prefix in /*) ;; *) die "PREFIX must be an absolute path, got $prefix" ;; esac
case ${DESTDIR:-/} in /*) ;; *) die "DESTDIR must be an absolute path, got $DESTDIR" ;; esac
final=${DESTDIR:-}$prefix
install -d "$final" && [ -w "$final" ] || die "$final cannot be written to: choose another PREFIX, or who may write there"
cd "$root"

host=$(rustc -vV | sed -n 's/^host: //p')
target=${SURFRECON_TARGET:-$host}
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -1)
# The name that programs ask for when they are loaded: versions that differ in it may be installed beside each other. From 1.0 on a minor
# version breaks nothing.
compatible=${version%%.*}
[ "$compatible" != 0 ] || compatible=${version%.*}

# Private: what programs link besides that have the static library inside. What unwinds the stack is the C compiler's own choice.
static=libsurfrecon.a
case $target in
    *-linux-*)
        file=libsurfrecon.so.$version named=libsurfrecon.so.$compatible plain=libsurfrecon.so
        private="-lutil -lrt -lpthread -lm -ldl -lc"
        shared=lib/$file asked="IMPORTED_SONAME \"$named\""
        ;;
    *-apple-darwin)
        file=libsurfrecon.$version.dylib named=libsurfrecon.$compatible.dylib plain=libsurfrecon.dylib
        private="-framework IOKit -framework CoreFoundation -liconv -lSystem"
        # Names of dylibs are paths; this one leaves the folder to the program.
        shared=lib/$file asked="IMPORTED_SONAME \"@rpath/$named\""
        ;;
    *-windows-*)
        file=surfrecon.dll named=libsurfrecon.dll.a plain=
        case $target in *-msvc) named=surfrecon.dll.lib static=surfrecon.lib ;; esac
        private="-lkernel32 -lntdll -luserenv -lws2_32 -ldbghelp -ladvapi32 -lole32 -loleaut32 -lpdh -lpowrprof -lpsapi"
        shared=bin/$file asked="IMPORTED_IMPLIB \"\${_surfrecon_prefix}/lib/$named\""
        ;;
    *) die "nobody has tried $target: teach tools/install_c.sh its names" ;;
esac

# For older systems than this one, and for others, zig links, where cross.sh has put it.
cc=(${SURFRECON_CC:-cc}) cargo=(cargo) build=build for=$target unwinder=
case $target in *-windows-*) ;; *)
    if [ -n "${SURFRECON_TARGET:-}" ] && [ "$(uname)" = Linux ] && command -v cargo-zigbuild >/dev/null; then
        cargo=(cargo-zigbuild) build=zigbuild
        case $target in *-linux-gnu)
            # The oldest that Blender's own builds support.
            for=$target.2.28 unwinder=-lunwind
            [ -n "${SURFRECON_CC:-}" ] || cc=(python-zig cc -target "${target/-unknown/}.2.28")
        ;; esac
    fi
;; esac

built=${SURFRECON_BUILT:-}
if [ -z "$built" ]; then
    profile=${SURFRECON_PROFILE:-release}
    how=(--quiet --locked --profile "$profile" --package surfrecon-capi ${SURFRECON_TARGET:+--target "$for"})
    case $target in
        # The name is given here, not in each build: a library that is used where it was built has no links beside it.
        *-apple-darwin) "${cargo[@]}" rustc "${how[@]}" -- -C link-arg=-Wl,-install_name,"@rpath/$named" -C strip=symbols ;;
        *) "${cargo[@]}" "$build" "${how[@]}" ;;
    esac
    built=${CARGO_TARGET_DIR:-target}/${SURFRECON_TARGET:+$target/}${profile/#dev/debug}
fi
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
[ -f "$built/$static" ] || die "there is no $static in $built: SURFRECON_BUILT must be a folder as cargo built it"
# All is made here before any of it is installed.
to=$scratch/tree
install -d "$to/lib/pkgconfig" "$to/include" "$to/share/cmake/surfrecon" "$to/share/doc/surfrecon"

# The shared library for Linux, from the static one. Cargo can't give symbols a version: rustc has a list of symbols of its own. Nor
# the library its name: one that is used where it was built has no links beside it.
link_for_linux() {
    echo "SURFRECON_$compatible { global: srf_*; local: *; };" >"$scratch/symbols"
    # shellcheck disable=SC2086 # several words
    "${cc[@]}" -shared -o "$scratch/$file" -Wl,-soname,"$named" -Wl,--version-script="$scratch/symbols" -Wl,--build-id=sha1 \
        -Wl,-z,relro,-z,now,-z,nodelete -Wl,--gc-sections -Wl,--as-needed -Wl,--whole-archive "$built/$static" -Wl,--no-whole-archive \
        ${LDFLAGS:-} $private $unwinder ||
        die "the shared library could not be linked: SURFRECON_CC must be a C compiler for $target"
}

objcopy() { # Binutils' is for its own system; LLVM's, which comes with rustc, for all.
    local sysroot mingw=${target%%-*}-w64-mingw32-objcopy
    if [ -n "${SURFRECON_OBJCOPY:-}" ]; then
        "$SURFRECON_OBJCOPY" "$@"
    elif [ "$target" = "$host" ]; then
        command objcopy "$@"
    elif [[ $target == *-windows-* ]] && command -v "$mingw" >/dev/null; then
        "$mingw" "$@"
    else
        sysroot=$(rustc --print sysroot)
        LD_LIBRARY_PATH=$sysroot/lib "$sysroot/lib/rustlib/$host/bin/rust-objcopy" "$@"
    fi
}

# Debug information goes where debuggers and abidiff look for it, beside the shared library wherever that is moved; in the static one
# it is ten times the code.
install_stripped() {
    local folder=$to/$(dirname "$shared") debug=$file.debug
    (cd "$scratch" && objcopy --only-keep-debug "$file" "$debug" && objcopy --strip-all --add-gnu-debuglink="$debug" "$file") &&
        objcopy --strip-debug "$built/$static" "$scratch/$static" ||
        die "debug information could not be taken out: SURFRECON_OBJCOPY must be binutils' or LLVM's objcopy for $target"
    install -d "$folder/.debug"
    install -m 644 "$scratch/$debug" "$folder/.debug/"
    install -m 755 "$scratch/$file" "$folder/"
    install -m 644 "$scratch/$static" "$to/lib/"
}

case $target in
    *-linux-*)
        link_for_linux
        install_stripped
        ;;
    *-windows-gnu*)
        cp "$built/$file" "$scratch/"
        install_stripped
        ;;
    *) # There no objcopy does: a dylib is stripped by rustc, and MSVC's debug information is a file of its own.
        install -d "$to/$(dirname "$shared")"
        install -m 755 "$built/${plain:-$file}" "$to/$shared"
        install -m 644 "$built/$static" "$to/lib/"
        ;;
esac
case $target in
    *-windows-*) install -m 644 "$built/$named" "$to/lib/" ;;
    *)
        ln -sf "$file" "$to/lib/$named"
        ln -sf "$named" "$to/lib/$plain"
        ;;
esac
install -m 644 c-api/include/* "$to/include/"
install -m 644 LICENSE-MIT LICENSE-APACHE "$to/share/doc/surfrecon/"
if python=$(tools/python.sh 2>/dev/null || command -v python3); then
    "$python" tools/third_party_licences.py "$to/share/doc/surfrecon/LICENSES-THIRD-PARTY.txt" --target "$target"
else
    say "the licences of what is linked inside are left out; do not hand on this library without them"
fi
# CMake takes names of libraries without -l, on any system.
libraries=$(sed 's/ -/;-/g; s/-l//g' <<<"$private")
for template in c-api/cmake/*.in; do
    name=$(basename "$template" .in)
    case $name in *.pc) name=lib/pkgconfig/$name ;; *) name=share/cmake/surfrecon/$name ;; esac
    sed -e "s|@VERSION@|$version|; s|@COMPATIBLE@|$compatible|; s|@SHARED@|$shared|; s|@ASKED@|$asked|; s|@STATIC@|lib/$static|" \
        -e "s|@PRIVATE@|$private|; s|@LIBRARIES@|$libraries|" "$template" >"$to/$name"
done
# Each file in place of the old one, which programs that run keep; folders that are there stay as they are.
(cd "$to" && find . ! -type d -print0 | tar --null -cf - -T -) | (cd "$final" && tar -xf - --no-same-owner) ||
    die "not all could be written under $final, see above"
say "installed under $final; programs find it with pkg-config surfrecon or find_package(surfrecon)"
