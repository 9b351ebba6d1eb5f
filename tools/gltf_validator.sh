#!/usr/bin/env bash
# Installs the Khronos glTF validator into the cache, unless it is there, and prints the folder of its module.
# Needs node and npm; prints nothing where these are missing. Usage: tools/gltf_validator.sh
set -euo pipefail
. "$(dirname "$0")/lib.sh"

version=2.0.0-dev.3.10
command -v node >/dev/null && command -v npm >/dev/null || exit 0
folder=$cache/gltf-validator-$version
if [ ! -f "$folder/node_modules/gltf-validator/index.js" ]; then
    lock gltf-validator
    mkdir -p "$folder"
    retry npm install --silent --no-audit --no-fund --prefix "$folder" "gltf-validator@$version" >&2 ||
        die "npm could not install gltf-validator $version: is its registry reachable?"
fi
echo "$folder/node_modules/gltf-validator"
