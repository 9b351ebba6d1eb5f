//! Values of the mask.

/// No triangle covers the texel.
pub const BACKGROUND: u8 = 0;
/// No photo sees the place: the colour is that of the detailed surface's vertices, or of the nearest place.
pub const FILLED: u8 = 128;
/// A photo sees the place.
pub const SEEN: u8 = 255;
