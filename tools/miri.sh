#!/usr/bin/env bash
# Runs tests of what holds `unsafe` under Miri, which watches each access to memory: the allocator and what is done with the
# pointers of C's callers. The rest of `unsafe` calls, or is called by, what is not Rust, which Miri does not run.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

cargo +nightly miri --version >/dev/null 2>&1 ||
    die "Miri is missing: rustup toolchain install nightly --component miri --component rust-src"
miri() {
    cargo +nightly miri test --quiet --target-dir target/miri "$@"
}
miri --package surfrecon-allocator --tests
miri --package surfrecon-capi --lib pointer
