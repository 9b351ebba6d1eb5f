//! Colours of places that no photo sees, and of texels that no triangle covers.

use glam::DVec3;

use base::error::Result;
use base::progress::Progress;
use geom::neighbours::KdTree;
use mesh::{AttributeData, TriMesh, srgb::Mix};

use super::atlas::{NONE, Texel};
use super::behind::Place;

/// Seen places among which the nearest are searched. Each stands for those around it.
const MOST: usize = 1_000_000;

/// Colours of the detailed surface's vertices, if it has any.
pub fn vertex_colours(mesh: &TriMesh) -> Option<&[[u8; 4]]> {
    match mesh.vertex_attribute("colour") {
        Some(AttributeData::Colour(colours)) if colours.iter().any(|colour| colour[3] > 0) => Some(colours),
        _ => None,
    }
}

/// The colour of the detailed surface at a place. `None` if its vertices have none.
pub fn of_vertices(place: &Place, mesh: &TriMesh, colours: &[[u8; 4]]) -> Option<[u8; 3]> {
    let corners = mesh.triangles.get(place.triangle as usize)?.map(|v| colours[v as usize]);
    let [b, c] = place.weights;
    let [red, green, blue, alpha] = Mix::of_triangle(corners, [1.0 - b - c, b, c].map(|share| share.max(0.0)));
    (alpha > 0).then_some([red, green, blue])
}

/// Gives each place without a colour that of the nearest place seen clearly, or else of any with one. Places are in space, so
/// that no seam is in the way.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn from_nearest(
    colours: &mut [Option<[u8; 3]>],
    is_clear: &[bool],
    places: &[Place],
    progress: &Progress<'_>,
) -> Result<()> {
    if colours.iter().all(Option::is_some) {
        return Ok(());
    }
    let with = |clear: bool| -> Vec<usize> {
        (0..places.len()).filter(|&i| colours[i].is_some() && (is_clear[i] || !clear)).collect()
    };
    let seen = if with(true).is_empty() { with(false) } else { with(true) };
    if seen.is_empty() {
        return Ok(());
    }
    let seen: Vec<usize> = seen.iter().copied().step_by(seen.len().div_ceil(MOST)).collect();
    let at = |i: usize| DVec3::from(places[i].point.map(f64::from));
    let points: Vec<DVec3> = seen.iter().map(|&i| at(i)).collect();
    let neighbours = KdTree::try_new(&points, progress)?;
    let unseen: Vec<usize> = (0..places.len()).filter(|&i| colours[i].is_none()).collect();
    for block in progress.ranges(unseen.len()) {
        for &i in &unseen[block?] {
            colours[i] = neighbours.nearest(at(i)).and_then(|(nearest, _)| colours[seen[nearest as usize]]);
        }
    }
    Ok(())
}

/// For each texel of a tile the place in the list of covered texels whose value it takes: its own, or of the covered texel
/// nearest to it in steps along rows and columns. So no mipmap mixes the background in.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn sources(texels: &[Texel], size: u32, progress: &Progress<'_>) -> Result<Vec<u32>> {
    let size = size as usize;
    let mut sources = vec![NONE; size * size];
    let mut front: Vec<u32> = Vec::new();
    for (i, texel) in texels.iter().enumerate() {
        sources[texel.place as usize] = i as u32;
    }
    let around = |place: usize| {
        let (row, column) = (place / size, place % size);
        [
            (row > 0).then(|| place - size),
            (column > 0).then(|| place - 1),
            (column + 1 < size).then(|| place + 1),
            (row + 1 < size).then(|| place + size),
        ]
    };
    front.extend(texels.iter().map(|texel| texel.place));
    while !front.is_empty() {
        let mut next = Vec::new();
        for block in progress.blocks(&front) {
            for &place in block? {
                for to in around(place as usize).into_iter().flatten() {
                    if sources[to] == NONE {
                        sources[to] = sources[place as usize];
                        next.push(to as u32);
                    }
                }
            }
        }
        front = next;
    }
    Ok(sources)
}
