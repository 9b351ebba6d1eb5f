//! The level set of the field as triangles: closed, a manifold, oriented. \[LC87\], with cases of its own (`table`).

use glam::DVec3;
use rustc_hash::FxHashMap;

use base::error::Result;
use base::progress::{Pace, Progress};
use mesh::TriMesh;

use super::table::{CASES, EDGES, MIDDLE};

/// Crossings keep this share of an edge from its ends, so that no triangle vanishes.
const LEAST_SHARE: f64 = 0.02;

/// Triangles in cells, between corners with values below 0 and all others. Positive values are outside. The level set is closed where
/// cells lie on all sides of it. `place` puts a vertex on an edge. It is given the inside node, the outside node and where between them
/// linear values cross, 0 to 1.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn extract(
    cells: impl Iterator<Item = [usize; 8]>,
    field: &[f64],
    place: impl Fn(usize, usize, f64) -> DVec3,
    progress: &Progress<'_>,
) -> Result<TriMesh> {
    let mut mesh = TriMesh::default();
    let mut vertices: FxHashMap<(u32, u8), u32> = FxHashMap::default();
    let mut pace = Pace::new(progress);
    let is_inside = |node: usize| field[node] < 0.0;
    for corners in cells {
        pace.after(1)?;
        let case = (0..8).fold(0, |case, c| case | usize::from(is_inside(corners[c])) << c);
        for polygon in &CASES[case] {
            pace.after(16)?;
            let mut numbers = [0; 13];
            let mut middle = DVec3::ZERO;
            for &edge in &polygon.vertices {
                let (c, axis) = EDGES[edge as usize];
                let (a, b) = (corners[c], corners[c | 1 << axis]);
                let number = *vertices.entry((a as u32, axis as u8)).or_insert_with(|| {
                    let (inside, outside) = if is_inside(a) { (a, b) } else { (b, a) };
                    let share = field[inside] / (field[inside] - field[outside]);
                    mesh.positions.push(place(inside, outside, share.clamp(LEAST_SHARE, 1.0 - LEAST_SHARE)));
                    mesh.positions.len() as u32 - 1
                });
                numbers[edge as usize] = number;
                middle += mesh.positions[number as usize] / polygon.vertices.len() as f64;
            }
            if polygon.triangles.iter().any(|t| t.contains(&MIDDLE)) {
                numbers[MIDDLE as usize] = mesh.positions.len() as u32;
                mesh.positions.push(middle);
            }
            mesh.triangles.extend(polygon.triangles.iter().map(|t| t.map(|c| numbers[c as usize])));
        }
    }
    Ok(mesh)
}

/// The point between two nodes at a share of the way.
pub fn between([inside, outside]: [DVec3; 2], share: f64) -> DVec3 {
    inside + share * (outside - inside)
}

#[cfg(test)]
mod tests {
    use super::super::grid::Grid;
    use super::*;
    use mesh::check;

    fn of(field: impl Fn(usize) -> f64, counts: [usize; 3]) -> TriMesh {
        let grid = Grid { origin: DVec3::ZERO, cell: 1.0, counts };
        let values: Vec<f64> =
            (0..grid.len()).map(|node| if grid.is_outermost(node) { 1.0 } else { field(node) }).collect();
        let place = |a, b, t| between([a, b].map(|node| grid.place(node)), t);
        extract(grid.cells(), &values, place, &Progress::none()).unwrap()
    }

    /// Any signs at all, all cases beside each other.
    #[test]
    fn noise_is_closed_and_a_manifold() {
        for seed in 0..40_u64 {
            let mesh = of(
                |node| {
                    let mixed = (node as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15 ^ seed << 32).rotate_left(23);
                    (mixed.wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as f64 / (1 << 23) as f64 - 1.0
                },
                [7, 8, 9],
            );
            let report = check(&mesh);
            assert!(report.is_closed(), "{report}");
        }
    }

    #[test]
    fn a_ball_faces_outward() {
        let grid = Grid { origin: DVec3::ZERO, cell: 1.0, counts: [15; 3] };
        let centre = DVec3::splat(7.1);
        let mesh = of(|node| grid.place(node).distance(centre) - 5.0, [15; 3]);
        assert!(check(&mesh).is_closed());
        let volume = mesh::measure::enclosed_volume(&mesh);
        assert!((volume - 523.6).abs() < 15.0, "{volume}");
    }
}
