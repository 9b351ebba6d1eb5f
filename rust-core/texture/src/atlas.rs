//! The texels of a tile that triangles cover.

use glam::DVec2;
use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;
use mesh::images;

use super::target::TextureTarget;

/// No triangle.
pub const NONE: u32 = u32::MAX;

/// A texel whose centre lies in a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texel {
    /// Row times size plus column, rows from the top.
    pub place: u32,
    /// The triangle.
    pub triangle: u32,
    /// Weights of its second and third corner.
    pub weights: [f32; 2],
}

/// The covered texels of a tile, in the order of their places. Of triangles that share a centre on an edge the first has it.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn texels(target: &TextureTarget<'_>, tile: u32, size: u32, progress: &Progress<'_>) -> Result<Vec<Texel>> {
    let mut triangles = vec![NONE; (size as usize).pow(2)];
    let low = images::corner(tile);
    let in_texels = |t: usize| target.triangle(t).map(|at| centred(at - low, size));
    for block in progress.ranges(target.mesh.triangles.len()) {
        for t in block?.filter(|&t| target.tile(t) == tile) {
            let corners = in_texels(t);
            let (lo, hi) = (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
            let last = f64::from(size - 1);
            let range = |lo: f64, hi: f64| lo.ceil().max(0.0) as u32..=hi.floor().min(last).max(-1.0) as i64 as u32;
            if hi.x < 0.0 || hi.y < 0.0 {
                continue;
            }
            for row in range(lo.y, hi.y) {
                if row % 64 == 0 {
                    progress.check()?;
                }
                for column in range(lo.x, hi.x) {
                    let place = (row * size + column) as usize;
                    if triangles[place] == NONE && weights(corners, DVec2::new(column.into(), row.into())).is_some() {
                        triangles[place] = t as u32;
                    }
                }
            }
        }
    }
    let with = |(place, &t): (usize, &u32)| {
        (t != NONE).then(|| {
            let centre = DVec2::new((place as u32 % size).into(), (place as u32 / size).into());
            let [_, b, c] = weights(in_texels(t as usize), centre).unwrap_or([1.0, 0.0, 0.0]);
            Texel { place: place as u32, triangle: t, weights: [b as f32, c as f32] }
        })
    };
    Ok(triangles.par_iter().enumerate().filter_map(with).collect())
}

/// In texels, the centres of which lie at whole numbers, rows from the top.
fn centred(uv: DVec2, size: u32) -> DVec2 {
    DVec2::new(uv.x, 1.0 - uv.y) * f64::from(size) - 0.5
}

/// Weights of the corners at a point. `None` outside and for a triangle without area.
fn weights([a, b, c]: [DVec2; 3], p: DVec2) -> Option<[f64; 3]> {
    let whole = (b - a).perp_dot(c - a);
    let of = [(b - p).perp_dot(c - p), (c - p).perp_dot(a - p), (a - p).perp_dot(b - p)].map(|x| x / whole);
    (whole != 0.0 && of.iter().all(|&x| x >= 0.0)).then_some(of)
}
