//! The virtual range scanner: mesh + camera -> range image.

use crate::params::ParamSpec;

/// Parameters of the virtual scanner.
pub const PARAMS: &[ParamSpec] = &[];
