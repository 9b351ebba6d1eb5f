#!/usr/bin/env bash
# Runs the property tests on random inputs of their own choice, EXPLORE_ROUNDS=10 times; `make test` takes the same ones each time.
# What one finds is kept in rust-core/proptest-regressions: mend it and commit the seed with it.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

rounds=${EXPLORE_ROUNDS:-10}
modules=$(grep -rl '^ *proptest! {' rust-core/src | sed 's|^rust-core/src/||; s|\.rs$||; s|/mod$||; s|/|::|g')
cargo test --quiet --release --package surfrecon --lib --no-run
for round in $(seq "$rounds"); do
    echo "== round $round of $rounds"
    # shellcheck disable=SC2086
    env -u PROPTEST_RNG_SEED cargo test --quiet --release --package surfrecon --lib -- $modules
done
echo "explore: $rounds rounds, nothing found"
