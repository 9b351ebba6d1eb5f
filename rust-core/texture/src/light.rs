//! Light of a photo between its pixels.

use glam::DVec2;

use image::photo::Pixels;
use mesh::srgb;

/// Of a photo with more than this share of black or overexposed pixels nothing is taken.
pub const MOST_CLIPPED: f64 = 0.99;
/// Pixels at or above this byte in any channel are overexposed: they may be of any brightness.
const OVEREXPOSED: u8 = 254;
/// Pixels at or below this byte in all channels are black.
const BLACK: u8 = 1;

/// Whether a pixel says nothing of its colour.
#[inline]
pub fn is_clipped(colour: [u8; 3]) -> bool {
    colour.iter().any(|&byte| byte >= OVEREXPOSED) || colour.iter().all(|&byte| byte <= BLACK)
}

/// Share of black and overexposed pixels.
pub fn clipped_share(pixels: &Pixels) -> f64 {
    let clipped = pixels.colours.iter().filter(|&&colour| is_clipped(colour)).count();
    clipped as f64 / pixels.colours.len().max(1) as f64
}

/// Light between pixels, of [`srgb::WHITE`], and whether one of the four says nothing. Places lie within the image.
#[inline]
pub fn between(pixels: &Pixels, at: DVec2) -> ([f32; 3], bool) {
    let [columns, rows] = pixels.size;
    let (x, y) = ((at.x as usize).min(columns.max(2) - 2), (at.y as usize).min(rows.max(2) - 2));
    let (fx, fy) = ((at.x - x as f64) as f32, (at.y - y as f64) as f32);
    let (right, below) = (usize::from(columns > 1), if rows > 1 { columns } else { 0 });
    let first = y * columns + x;
    let four = [first, first + right, first + below, first + below + right].map(|i| pixels.colours[i]);
    let shares = [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy];
    let mut light = [0.0; 3];
    for (colour, share) in four.iter().zip(shares) {
        for (sum, &byte) in light.iter_mut().zip(colour) {
            *sum += share * f32::from(srgb::light(byte));
        }
    }
    (light, four.into_iter().any(is_clipped))
}

/// Brightness of light, as the eye weighs the channels.
#[inline]
pub fn level([red, green, blue]: [f32; 3]) -> f32 {
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}

/// The bytes of light.
#[inline]
pub fn bytes(light: [f32; 3]) -> [u8; 3] {
    light.map(|of| srgb::byte((of + 0.5).clamp(0.0, f32::from(srgb::WHITE)) as u16))
}
