#!/usr/bin/env bash
# Makes a Python 3.11 for Windows with the packages of tools/requirements/NAME.txt, unless it exists, and prints its folder.
# Usage: tools/windows_python.sh NAME            tools/wine.sh "$(tools/windows_python.sh python)/python.exe" -c 'print(1)'
# The interpreter is that which panda3d's wheel brings for the programs that are made with it; what is the same on all systems, the
# standard library's modules in Python, is taken from this one's.
set -euo pipefail
. "$(dirname "$0")/lib.sh"

name=${1:?usage: tools/windows_python.sh NAME}
requirements=$root/tools/requirements/$name.txt
[ -f "$requirements" ] || die "there is no environment $name: its list of packages would be tools/requirements/$name.txt"
python=$("$root/tools/python.sh")
export PIP_ROOT_USER_ACTION=ignore
"$root/tools/wine.sh" --prepare >/dev/null
# NumPy as Blender 4.5 brings it: newer ones call functions that Wine 8 lacks.
old_numpy="numpy==1.26.4"
# Needs of these packages on Windows alone.
windows="panda3d==1.10.16 colorama==0.4.6 tzdata==2025.2"
key=$({ "$python" -VV; cat "$requirements" "$0"; } | sha256sum | cut -c1-12)
folder=$cache/wine/python-$name-$key
if [ ! -e "$folder/.complete" ]; then
    lock "wine-python-$name"
    if [ ! -e "$folder/.complete" ]; then
        say "preparing a Python for Windows with $name"
        rm -rf "$folder"
        mkdir -p "$folder/DLLs" "$folder/Lib/site-packages" "$folder/scratch"
        pip=("$python" -m pip --disable-pip-version-check --quiet)
        for_windows=(--only-binary :all: --platform win_amd64 --python-version 3.11 --implementation cp --no-deps)
        grep -v '^numpy==' "$requirements" >"$folder/scratch/requirements.txt"
        # shellcheck disable=SC2086 # several packages
        retry "${pip[@]}" install "${for_windows[@]}" --target "$folder/Lib/site-packages" $old_numpy ${windows#* } \
            -r "$folder/scratch/requirements.txt" >&2 ||
            die "pip could not get tools/requirements/$name.txt for Windows: is the package index reachable?"
        retry "${pip[@]}" download "${for_windows[@]}" --dest "$folder/scratch" "${windows%% *}" >&2 ||
            die "pip could not get ${windows%% *}, which brings Python for Windows"
        "$python" - "$folder" <<'END'
import pathlib, shutil, sys, sysconfig, zipfile

folder = pathlib.Path(sys.argv[1])
with zipfile.ZipFile(next((folder / "scratch").glob("panda3d*.whl"))) as wheel:
    for name in wheel.namelist():
        path = pathlib.PurePosixPath(name)
        if path.parts[0] == "deploy_libs" and path.suffix in (".dll", ".pyd"):
            place = folder if path.name.lower() in ("python311.dll", "vcruntime140.dll", "vcruntime140_1.dll") else folder / "DLLs"
            (place / path.name).write_bytes(wheel.read(name))
ignored = shutil.ignore_patterns("site-packages", "dist-packages", "__pycache__", "lib-dynload", "test", "tests", "config-*", "idlelib")
shutil.copytree(sysconfig.get_path("stdlib"), folder / "Lib", ignore=ignored, dirs_exist_ok=True)
END
        cd "$folder/scratch"
        echo 'int Py_Main(int, wchar_t **); int wmain(int n, wchar_t **a) { return Py_Main(n, a); }' >main.c
        x86_64-w64-mingw32-gcc -municode -o "$folder/python.exe" -x c <(echo '#include <wchar.h>'; cat main.c) -x none "$folder/python311.dll"
        # The library that modules of the stable interface link to: all of it stands in python311.dll.
        { echo EXPORTS; x86_64-w64-mingw32-objdump -p "$folder/python311.dll" |
            awk '/Ordinal\/Name Pointer/ {on = 1; next} on && NF >= 2 && $NF ~ /^_?Py/ {print "  " $NF " = python311." $NF}'; } >python3.def
        x86_64-w64-mingw32-gcc -shared -nostdlib -Wl,-e0 -o "$folder/python3.dll" python3.def
        cd "$root"
        rm -rf "$folder/scratch"
        touch "$folder/.complete"
    fi
fi
echo "$folder"
