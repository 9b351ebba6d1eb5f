#!/usr/bin/env bash
# Publishes the crates of the workspace, each after those it depends on: tools/publish_crates.sh [--dry-run]
# cargo finds the order and leaves out what says `publish = false`. What the registry has of this version already is left out,
# so that a run that was cut off can be run again. --dry-run packages and, unless --no-verify is added, builds, and uploads nothing.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

crates=$(cargo metadata --no-deps --format-version 1 | "$(tools/python.sh)" -c '
import json, sys
for package in json.load(sys.stdin)["packages"]:
    if package["publish"] != []:
        print(package["name"], package["version"])')
options=() left=0
while read -r name version; do
    # In its own folder cargo would answer with the crate of the workspace.
    if (cd / && cargo info --quiet --registry crates-io "$name@$version") >/dev/null 2>&1; then
        say "$name $version is published already"
        options+=(--exclude "$name")
    else
        left=$((left + 1))
    fi
done <<<"$crates"
[ $left -gt 0 ] || { say "nothing is left to publish"; exit 0; }
cargo publish --locked --workspace "${options[@]}" "$@"
