#!/usr/bin/env bash
# Formatting, lints, documentation, licences: everything that needs no running of our code. Runs all, then tells.
# Usage: tools/check.sh [PART...]      quick (needs no compiler), lints, bare (lints without features), documentation; else all
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

quick() {
    local lint
    lint=$(tools/venv.sh lint)/bin || exit 1
    check "Rust formatting" cargo fmt --all --check
    check "Rust formatting of the fuzz targets" cargo fmt --manifest-path rust-core/fuzz/Cargo.toml --check
    check "Python formatting" "$lint/ruff" format --no-cache --check .
    check "Python lints" "$lint/ruff" check --no-cache --quiet .
    check "tree" "$python" tools/check_tree.py
    check "licences and sources of dependencies" "$lint/python" tools/check_licences.py
    if command -v node >/dev/null && command -v npm >/dev/null; then
        check "workflows" tools/check_workflows.sh
    else
        echo "SKIPPED workflows: node or npm is missing"
    fi
}

lints() {
    check "Rust lints" cargo clippy --quiet --workspace --all-targets -- --deny warnings
}

bare() {
    check "Rust lints without features" cargo clippy --quiet --package surfrecon --no-default-features --all-targets -- --deny warnings
}

documentation() {
    check "Rust documentation" env RUSTDOCFLAGS="--deny warnings" cargo doc --quiet --workspace --no-deps
}

[ $# -gt 0 ] || set -- quick lints bare documentation
for part in "$@"; do
    case $part in quick | lints | bare | documentation) "$part" ;; *) die "no part of the checks is called $part" ;; esac
done
exit $((failed > 0))
