//! Cells along a line.

use glam::DVec3;

use super::complex::{Complex, Star};

/// Looks at the cells along a line from a vertex, those inside the hull, as far as `reach`: each with the slot of the facet through which
/// the line leaves it, and how far off that is. Where the line meets an edge or a vertex to
/// the last bit, at those of one side of it.
pub(super) fn along(
    complex: Complex<'_>,
    vertex: u32,
    star: &Star,
    direction: DVec3,
    reach: f64,
    mut look: impl FnMut(u32, usize, f64),
) {
    let here = complex.points[vertex as usize];
    // Six times the volume of the line with an edge: rounded the same from either end, so that cells with the edge agree.
    let side = |from: u32, to: u32| {
        let [low, high] = [from.min(to), from.max(to)].map(|v| complex.points[v as usize] - here);
        let volume = direction.dot(low.cross(high));
        if from < to { volume } else { -volume }
    };
    let is_first = |&&(cell, own): &&(u32, u8)| {
        let [a, b, c] = complex.facet(cell, usize::from(own));
        !complex.is_outer(cell) && side(a, b) >= 0.0 && side(b, c) >= 0.0 && side(c, a) >= 0.0
    };
    let first = star.cells.iter().filter(is_first).min_by_key(|(cell, _)| complex.name(*cell));
    let Some((mut cell, mut slot)) = first.map(|&(cell, own)| (cell, usize::from(own))) else { return };
    loop {
        let mut facet = complex.facet(cell, slot);
        let end = distance(complex, facet, here, direction);
        look(cell, slot, end);
        let beyond = complex.neighbour(cell, slot);
        if complex.is_outer(beyond) || !(end < reach) {
            return;
        }
        let entry = complex.mirror(cell, slot);
        let apex = complex.vertices(beyond)[entry];
        // Counter-clockwise around the line: it leaves between the ends of the edge that are on either side of the apex.
        let Some(turns) = (0..3).find(|&i| side(facet[i], apex) < 0.0 && side(facet[(i + 1) % 3], apex) >= 0.0) else {
            return;
        };
        facet.rotate_left(turns);
        let passed = facet[2];
        slot = complex.vertices(beyond).iter().position(|&v| v == passed).expect("a vertex of the facet between");
        cell = beyond;
    }
}

/// How far it is along a line to the plane of a facet.
fn distance(complex: Complex<'_>, mut facet: [u32; 3], from: DVec3, direction: DVec3) -> f64 {
    facet.sort_unstable();
    let [a, b, c] = facet.map(|v| complex.points[v as usize] - from);
    let normal = (b - a).cross(c - a);
    normal.dot(a) / normal.dot(direction)
}
