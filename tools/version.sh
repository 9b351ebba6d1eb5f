#!/usr/bin/env bash
# Prints the version of this tree.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
sed -n 's/^version = "\(.*\)"$/\1/p' "$root/Cargo.toml" | head -1
