#!/usr/bin/env bash
# Builds the documentation site: tools/docs.sh FOLDER. Anything that is missing or leads nowhere is an error.
# The package is taken from target/wheel-files/, where tools/unpack_wheel.py puts the built one.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

folder=${1:?usage: tools/docs.sh FOLDER}
python=$(tools/python.sh)
environment=$(tools/venv.sh docs)
"$python" tools/unpack_wheel.py >/dev/null

# The crates that users meet through the one they name, and no others that were documented before.
crates=()
for manifest in rust-core/Cargo.toml rust-core/*/Cargo.toml; do
    name=$(sed -n '/^\[package\]/,/^\[/s/^name = "\(.*\)"/\1/p' "$manifest")
    [ "$name" = surfrecon-fuzz ] || crates+=(--package "$name")
done
rm -rf "${CARGO_TARGET_DIR:-target}/doc"
RUSTDOCFLAGS="--deny warnings" cargo doc --quiet --locked --no-deps "${crates[@]}"
PYTHONPATH=target/wheel-files "$environment/bin/python" tools/docs/build.py --rust "${CARGO_TARGET_DIR:-target}/doc" "$folder"
echo "$folder/index.html"
