//! Files that stages of a merge leave to look at, see [`mesh::dump`].

use base::error::Result;
use glam::DVec3;
use mesh::dump::{self, Stage};

use crate::crossings::bundles::RawBundle;
use crate::crossings::lattice::{ACROSS, BRICK, BRICK_BITS, Lattice, ROWS};
use crate::field::Labels;
use crate::surface::numbering::GONE;
use crate::surface::tile::Tiles;
use crate::surface::whole::Whole;

/// The crossings of the scans, by the numbers of these from 1 on, as far as they are not added up.
pub fn crossings(raw: &[RawBundle], lattice: &Lattice) -> Result<()> {
    dump::stage("merge-1-crossings", || {
        let mut stage = Stage::default();
        for bundle in raw {
            let axis = bundle.key.axis as usize;
            let [u, v] = ACROSS[axis];
            for crossing in bundle.found.chunks.iter().flatten() {
                let line = crossing.line() as i32;
                let mut node = [0; 3];
                node[axis] = crossing.cell;
                node[u] = (bundle.key.across[0] << BRICK_BITS) + (line & (BRICK - 1));
                node[v] = (bundle.key.across[1] << BRICK_BITS) + (line >> BRICK_BITS);
                stage.positions.push(lattice.world(node, axis, f64::from(crossing.fraction)));
                stage.values.push(crossing.scan() as i32 + 1);
            }
        }
        stage
    })
}

/// The nodes that are labelled: 1 inside, -1 outside.
pub fn labels(labels: &Labels, lattice: &Lattice) -> Result<()> {
    dump::stage("merge-2-labels", || {
        let mut stage = Stage::default();
        for (brick, of_brick) in labels {
            for (plane, value) in [(&of_brick.inside, 1), (&of_brick.outside, -1)] {
                for (row, bits) in (0..ROWS as i32).zip(plane) {
                    for x in (0..BRICK).filter(|x| bits >> x & 1 == 1) {
                        let within = [x, row & (BRICK - 1), row >> BRICK_BITS];
                        let node = [0, 1, 2].map(|axis| (brick[axis] << BRICK_BITS) + within[axis]);
                        stage.positions.push(lattice.world(node, 0, 0.0));
                        stage.values.push(value);
                    }
                }
            }
        }
        stage
    })
}

/// The surface by its connected parts, before holes are closed.
pub fn parts<T: Tiles>(whole: &Whole<T>) -> Result<()> {
    let mut failed = Ok(());
    dump::stage("merge-3-parts", || {
        let mut stage = Stage::default();
        failed = by_parts(whole, &mut stage);
        stage
    })?;
    failed
}

fn by_parts<T: Tiles>(whole: &Whole<T>, stage: &mut Stage) -> Result<()> {
    stage.positions.resize(whole.vertices() as usize, DVec3::ZERO);
    stage.values.resize(whole.vertices() as usize, 0);
    for i in 0..whole.tiles.count() {
        let numbered = whole.tile(i)?;
        let tile = &numbered.tile;
        let kept = (0..tile.own).map(|v| (v, numbered.vertex(v))).filter(|of| of.1 != GONE);
        for (v, number) in kept {
            stage.positions[number as usize] = tile.surface.positions[v];
            stage.values[number as usize] = whole.chosen.part(i, tile.part_of[v]) as i32 + 1;
        }
        let kept = (0..tile.surface.triangles.len()).filter(|&t| numbered.triangle(t).is_some());
        stage.triangles.extend(kept.map(|t| tile.surface.triangles[t].map(|v| numbered.vertex(v as usize) as u32)));
    }
    Ok(())
}
