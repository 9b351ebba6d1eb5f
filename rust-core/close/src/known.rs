//! Signed distances at the nodes beside the measured surface.

use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;

use super::nodes::Nodes;
use super::surface::Surface;

/// Layers of nodes on each side whose distance is known: a value and a slope.
pub const LAYERS: f64 = 2.0;

/// Nodes whose nearest point of the surface lies within two cells and not on its border, with their signed distances, rising.
/// The surface says nothing of nodes whose nearest point lies on its border, and of those farther behind it than `depth`.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn near(surface: &Surface<'_>, nodes: &Nodes, depth: f64, progress: &Progress<'_>) -> Result<Vec<(u32, f64)>> {
    let reach = LAYERS * nodes.grid.cell;
    let numbers: Vec<u32> = (0..nodes.len() as u32).collect();
    let known: Vec<Vec<(u32, f64)>> = numbers
        .par_chunks(1024)
        .map(|numbers| {
            progress.check()?;
            let mut hint = None;
            let known = |&number: &u32| {
                let beside = surface.beside_within(nodes.place(number as usize), reach, &mut hint)?;
                (!beside.is_at_border && beside.distance >= -depth).then_some((number, beside.distance))
            };
            Ok(numbers.iter().filter_map(known).collect())
        })
        .collect::<Result<_>>()?;
    Ok(known.concat())
}
