#!/usr/bin/env bash
# Formatting, lints, documentation, licences: everything that needs no running of our code. Runs all, then tells.
set -uo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

failed=0
check() {
    local title=$1 log
    shift
    log=$(mktemp)
    if "$@" >"$log" 2>&1; then
        echo "ok: $title"
    else
        cat "$log"
        echo "FAILED: $title: $*"
        failed=$((failed + 1))
    fi
    rm -f "$log"
}

python=$(tools/python.sh) || exit 1
ruff=$(tools/venv.sh lint)/bin/ruff || exit 1

check "Rust formatting" cargo fmt --all --check
check "Rust formatting of the fuzz targets" cargo fmt --manifest-path rust-core/fuzz/Cargo.toml --check
check "Rust lints" cargo clippy --quiet --workspace --all-targets -- --deny warnings
check "Rust lints without features" cargo clippy --quiet --package surfrecon --no-default-features --all-targets -- --deny warnings
check "Rust documentation" env RUSTDOCFLAGS="--deny warnings" cargo doc --quiet --workspace --no-deps
check "Python formatting" "$ruff" format --no-cache --check .
check "Python lints" "$ruff" check --no-cache --quiet .
check "tree" "$python" tools/check_tree.py
if cargo_deny=$(tools/cargo_tool.sh cargo-deny 0.20.2); then
    # The advisory database is a download that not every machine may make: `cargo deny check advisories` by hand.
    check "licences and sources of dependencies" "$cargo_deny" --log-level error check licenses bans sources
else
    echo "FAILED: cargo-deny could not be installed"
    failed=$((failed + 1))
fi
exit $((failed > 0))
