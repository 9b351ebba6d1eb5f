#!/usr/bin/env bash
# Runs the property tests on random inputs of their own choice, EXPLORE_ROUNDS=10 times; `make test` takes the same ones each time.
# What one finds is kept in the proptest-regressions of its crate: mend it and commit the seed with it.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$root"

rounds=${EXPLORE_ROUNDS:-10}
crates=$(grep -rl '^ *proptest! {' rust-core/*/src | cut -d/ -f2 | sort -u)
for crate in $crates; do cargo test --quiet --release --package "surfrecon-$crate" --lib --no-run; done
for round in $(seq "$rounds"); do
    echo "== round $round of $rounds"
    for crate in $crates; do
        modules=$(cd "rust-core/$crate/src" && grep -rl '^ *proptest! {' . | sed 's|^\./||; s|\.rs$||; s|/mod$||; s|/|::|g')
        # shellcheck disable=SC2086
        env -u PROPTEST_RNG_SEED SURFRECON_TIER=all cargo test --quiet --release --package "surfrecon-$crate" --lib -- $modules
    done
done
echo "explore: $rounds rounds, nothing found"
