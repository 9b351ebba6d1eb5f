//! The tier of tests that runs: what a change needs, or everything (`make test ALL=1`, which sets `SURFRECON_TIER` to `all`).

/// Whether everything is tested.
#[must_use]
pub fn is_thorough() -> bool {
    std::env::var_os("SURFRECON_TIER").is_some_and(|tier| tier == "all")
}

/// Returns how many of `all` cases a property test takes: each in the second tier, a quarter in the first, and at least one.
///
/// The cases of the first tier are the first of those of the second: both begin with the same seed.
#[must_use]
pub fn cases(all: u32) -> u32 {
    if is_thorough() { all } else { all.div_ceil(4) }
}
