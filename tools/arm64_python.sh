#!/usr/bin/env bash
# Makes a Python 3.11 for Linux on arm64 with the packages of tools/requirements/NAME.txt, unless it exists, and prints the path of
# a program that runs it under qemu.
# Usage: tools/arm64_python.sh NAME            "$(tools/arm64_python.sh python)" -c 'print(1)'
set -euo pipefail
. "$(dirname "$0")/lib.sh"

name=${1:?usage: tools/arm64_python.sh NAME}
requirements=$root/tools/requirements/$name.txt
[ -f "$requirements" ] || die "there is no environment $name: its list of packages would be tools/requirements/$name.txt"
emulator=$(command -v qemu-aarch64 || command -v qemu-aarch64-static) ||
    die "programs for arm64 need an emulator here: apt-get install qemu-user"
command -v apt-get >/dev/null || die "Python for arm64 is taken from Debian's packages: this needs apt-get"
python=$("$root/tools/python.sh")
export PIP_ROOT_USER_ACTION=ignore
key=$({ "$python" -VV; cat "$requirements" "$0"; } | sha256sum | cut -c1-12)
folder=$cache/arm64/python-$name-$key
if [ ! -e "$folder/.complete" ]; then
    lock "arm64-python-$name"
    if [ ! -e "$folder/.complete" ]; then
        say "preparing a Python for arm64 with $name"
        rm -rf "$folder"
        mkdir -p "$folder/apt/lists/partial" "$folder/apt/archives/partial" "$folder/root" "$folder/packages"
        mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
        echo "deb [arch=arm64 signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror bookworm main" >"$folder/apt/sources.list"
        touch "$folder/apt/status"
        apt=(-qq -o Dir::Etc::sourcelist="$folder/apt/sources.list" -o Dir::Etc::sourceparts=- -o Dir::State::lists="$folder/apt/lists"
            -o Dir::State::status="$folder/apt/status" -o Dir::Cache="$folder/apt" -o APT::Sandbox::User=root
            -o APT::Architecture=arm64 -o APT::Architectures=arm64)
        retry apt-get "${apt[@]}" update >&2 || die "$mirror does not answer"
        retry apt-get "${apt[@]}" install --download-only --yes --no-install-recommends python3.11 libstdc++6 >&2 ||
            die "Debian's packages of Python for arm64 could not be downloaded"
        for package in "$folder"/apt/archives/*.deb; do dpkg -x "$package" "$folder/root"; done
        rm -rf "$folder/apt"
        platforms=(--platform manylinux_2_28_aarch64 --platform manylinux_2_27_aarch64 --platform manylinux_2_26_aarch64
            --platform manylinux_2_17_aarch64 --platform manylinux2014_aarch64)
        retry "$python" -m pip --disable-pip-version-check --quiet install --only-binary :all: "${platforms[@]}" --python-version 3.11 \
            --implementation cp --no-deps --target "$folder/packages" -r "$requirements" >&2 ||
            die "pip could not get tools/requirements/$name.txt for arm64: is the package index reachable?"
        # The name by which a program calls itself again.
        cat >"$folder/packages/sitecustomize.py" <<END
import sys

sys.executable = "$folder/python"
END
        cat >"$folder/python" <<END
#!/bin/sh
PYTHONPATH="\${PYTHONPATH:+\$PYTHONPATH:}$folder/packages" exec $emulator -L "$folder/root" "$folder/root/usr/bin/python3.11" "\$@"
END
        chmod +x "$folder/python"
        touch "$folder/.complete"
    fi
fi
echo "$folder/python"
