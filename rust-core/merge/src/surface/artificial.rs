//! Stage 7: places on the grid for vertices that no crossing places exactly. [MI04, sec. 3.2]
//!
//! An artificial vertex is known to lie on its edge, and no more. It moves along the edge to the mean of its neighbours,
//! measured vertices first.

use rayon::prelude::*;

use super::extract::{APART, Artificial, AtNode, Surface};
use super::passes;
use crate::crossings::lattice::Lattice;
use base::error::Result;
use base::progress::Progress;
use mesh::srgb::Mix;

/// Elements handled between two looks at the progress.
const BLOCK: usize = 1 << 14;
/// Rounds in which artificial vertices follow each other.
const ROUNDS: usize = 4;
/// Artificial vertices keep this distance, in cells, from the nodes of their edge.
const INSET: f64 = 1.0 / 32.0;
/// Parts of a cell, or of trust 1, in which means are formed.
const UNITS: f64 = (1_u64 << 32) as f64;

/// Places the artificial vertices and gives them the mean trust and colour of their neighbours.
pub fn place(
    surface: &mut Surface,
    artificial: &[Artificial],
    lattice: &Lattice,
    progress: &Progress<'_>,
) -> Result<()> {
    let slots = artificial.len();
    if slots == 0 {
        return Ok(());
    }
    let mut slot_of = passes::filled(u32::MAX, surface.positions.len(), progress)?;
    for (slot, a) in artificial.iter().enumerate() {
        slot_of[a.vertex as usize] = slot as u32;
    }
    let (starts, neighbours) = neighbours(surface, slots, &slot_of, progress)?;
    let of = |slot: usize| &neighbours[starts[slot] as usize..starts[slot + 1] as usize];
    for round in 0..=ROUNDS {
        let placed: Vec<_> = (0..slots)
            .into_par_iter()
            .map(|slot| {
                if slot % BLOCK == 0 {
                    progress.check()?;
                }
                let Artificial { vertex, axis, node, is_placed } = artificial[slot];
                let known = |v: &&u32| round > 0 || slot_of[**v as usize] == u32::MAX;
                let base = lattice.world(node, axis as usize, 0.0)[axis as usize];
                // Whole numbers: the sums must not depend on the order of the neighbours.
                let (mut along, mut trust, mut noise, mut colour, mut count) =
                    (0_i128, 0_i128, 0_i128, Mix::default(), 0_u32);
                for &v in of(slot).iter().filter(known) {
                    let v = v as usize;
                    along += ((surface.positions[v][axis as usize] - base) / lattice.voxel * UNITS) as i128;
                    trust = trust.saturating_add((f64::from(surface.confidence[v]) * UNITS) as i128);
                    noise += (f64::from(surface.noise[v]) / lattice.voxel * UNITS) as i128;
                    colour.add(surface.colour[v], 1);
                    count += 1;
                }
                if count == 0 {
                    let v = vertex as usize;
                    return Ok((surface.positions[v], surface.confidence[v], surface.noise[v], surface.colour[v]));
                }
                let mean = |sum: i128| sum as f64 / f64::from(count) / UNITS;
                let position = match is_placed {
                    true => surface.positions[vertex as usize],
                    false => lattice.world(node, axis as usize, mean(along).clamp(INSET, 1.0 - INSET)),
                };
                let noise = (mean(noise) * lattice.voxel) as f32;
                Ok((position, mean(trust) as f32, noise, colour.colour()))
            })
            .collect::<Result<_>>()?;
        passes::each(slots, progress, |slot| {
            let v = artificial[slot].vertex as usize;
            (surface.positions[v], surface.confidence[v], surface.noise[v], surface.colour[v]) = placed[slot];
        })?;
    }
    Ok(())
}

/// The vertices around each artificial vertex, as starts and a flat list.
fn neighbours(
    surface: &Surface,
    slots: usize,
    slot_of: &[u32],
    progress: &Progress<'_>,
) -> Result<(Vec<u32>, Vec<u32>)> {
    let pairs: Vec<Vec<(u32, u32)>> = surface
        .triangles
        .par_chunks(BLOCK)
        .map(|triangles| {
            progress.check()?;
            let mut pairs = Vec::new();
            for &[a, b, c] in triangles {
                for (v, others) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
                    let slot = slot_of[v as usize];
                    if slot != u32::MAX {
                        pairs.extend(others.map(|other| (slot, other)));
                    }
                }
            }
            Ok(pairs)
        })
        .collect::<Result<_>>()?;
    let mut starts = vec![0_u32; slots + 1];
    for pairs in &pairs {
        progress.check()?;
        pairs.iter().for_each(|&(slot, _)| starts[slot as usize + 1] += 1);
    }
    for slot in 1..starts.len() {
        starts[slot] += starts[slot - 1];
    }
    let mut next = starts.clone();
    let mut list = vec![0; starts[starts.len() - 1] as usize];
    for pairs in pairs {
        progress.check()?;
        for (slot, vertex) in pairs {
            list[next[slot as usize] as usize] = vertex;
            next[slot as usize] += 1;
        }
    }
    Ok((starts, list))
}

/// Moves vertices that meet exactly in a node a little way down their edges, or triangles between them would have no area.
pub fn separate_at_nodes(surface: &mut Surface, mut at_nodes: Vec<AtNode>, lattice: &Lattice) {
    at_nodes.sort_unstable_by_key(|a| (a.node, a.vertex));
    for group in at_nodes.chunk_by(|a, b| a.node == b.node).filter(|group| group.len() > 1) {
        for &AtNode { vertex, axis, node, upward } in group {
            let offset = if upward { APART } else { -APART };
            surface.positions[vertex as usize] = lattice.world(node, axis as usize, offset);
            // It lies on no scan any more.
            surface.scan[vertex as usize] = -1;
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec3};

    use crate::params::MergeParams;
    use crate::run::{Run, merge};
    use base::progress::Progress;
    use image::source::PlacedMesh;
    use mesh::measure::{Side, deviation};
    use mesh::{AttributeData, TriMesh};

    #[test]
    fn a_vertex_moved_out_of_a_node_is_marked() {
        // A plane through nodes of the grid: three edges meet it in each of these.
        let (u, v) = (DVec3::new(9.0, -9.0, 0.0), DVec3::new(-9.0, -9.0, 18.0));
        let plane = TriMesh::new(vec![u, v, -u - v], vec![[0, 2, 1]]);
        let placed = PlacedMesh { name: "plane".to_owned(), mesh: &plane, world_from_mesh: DAffine3::IDENTITY };
        let params = MergeParams { voxel: Some(1.0), max_hole_length: Some(0.0), ..MergeParams::default() };
        let mesh = merge(&[&placed], &params, Run::default(), &Progress::none()).unwrap().mesh;
        let off = deviation(&mesh.positions, &plane, Side::Ignored, 0, &Progress::none()).unwrap().distances;
        let (Some(AttributeData::Bool(interpolated)), Some(AttributeData::I32(source))) =
            (mesh.vertex_attribute("interpolated"), mesh.vertex_attribute("source_scan"))
        else {
            panic!("attributes are missing")
        };
        // Unit that a place within a cell is rounded to.
        let exact = 2f64.powi(-20);
        assert!(off.iter().any(|d| *d > exact), "no vertex was moved");
        for v in 0..off.len() {
            assert!(interpolated[v] || off[v] <= exact, "vertex {v} at {} lies {} off", mesh.positions[v], off[v]);
            assert_eq!(interpolated[v], source[v] < 0);
        }
        assert!(interpolated.iter().any(|i| !i), "all are marked");
    }
}
