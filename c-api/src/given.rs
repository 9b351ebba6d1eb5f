//! Fields of structs of parameters, and what a caller gives in them.

use bytemuck::Pod;

/// Sort of a field of a struct.
#[derive(Clone, Copy)]
pub enum Given {
    /// Nothing yet: 0.
    Reserved(u32),
    /// Worker threads: 0 for those of the whole library.
    Threads(u32),
    /// A length, an angle, a ratio, or a count whose 0 is a number like others. SRF_FROM_DATA for none, NaN where any number is one.
    Double(f64),
    /// A count, 0 for none where that is none. Also a flag, or the place of a choice, counted from 1.
    Whole(u64),
}

/// A struct of parameters.
pub trait Fields: Pod {
    fn defaults() -> Self;

    /// Names of parameters and what the struct holds of each.
    fn given(&self) -> Vec<(&'static str, Given)>;
}
