#!/usr/bin/env bash
# Runs a Windows program under Wine: tools/wine.sh PROGRAM.exe [ARGUMENT...]     with --prepare: makes what is needed, prints its folder
# Of the environment Windows' programs see all but what names folders of this system.
set -euo pipefail
. "$(dirname "$0")/lib.sh"

command -v wine >/dev/null && command -v x86_64-w64-mingw32-g++-posix >/dev/null ||
    die "Windows programs need Wine and a compiler here: apt-get install --no-install-recommends wine wine64 g++-mingw-w64-x86-64-win32 g++-mingw-w64-x86-64-posix"
export WINEPREFIX=$cache/wine/prefix WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml=" WINEARCH=win64
if [ ! -e "$WINEPREFIX/.complete" ]; then
    lock wine
    if [ ! -e "$WINEPREFIX/.complete" ]; then
        say "preparing a system for Windows programs in $WINEPREFIX"
        rm -rf "$WINEPREFIX"
        mkdir -p "$WINEPREFIX"
        wineboot --init >/dev/null 2>&1 </dev/null || die "Wine could not make $WINEPREFIX"
        wineserver --wait
        system=$WINEPREFIX/drive_c/windows/system32
        # Wine 8 lacks the library of one function that Rust's standard library takes random numbers from.
        if [ ! -e "$system/bcryptprimitives.dll" ]; then
            scratch=$(mktemp -d)
            trap 'rm -rf "$scratch"' EXIT
            cat >"$scratch/random.c" <<'END'
#include <windows.h>
BOOLEAN NTAPI SystemFunction036(PVOID, ULONG);
__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE data, SIZE_T size) { return SystemFunction036(data, (ULONG)size); }
END
            x86_64-w64-mingw32-gcc -shared -O2 -o "$system/bcryptprimitives.dll" "$scratch/random.c" -ladvapi32
        fi
        touch "$WINEPREFIX/.complete"
    fi
fi
if [ "${1:-}" = --prepare ]; then echo "$WINEPREFIX"; exit 0; fi
unset TMPDIR TEMP TMP HOME
# Windows' programs cannot use all that a stream may be here; pipes they can.
wine "$@" </dev/null 2> >(cat >&2) | cat
