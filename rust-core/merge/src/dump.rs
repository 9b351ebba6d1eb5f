//! What stages of a merge leave to look at, see [`mesh::dump`].

use base::error::Result;
use mesh::dump::{self, Stage};

use super::Labels;
use super::bundles::RawBundle;
use super::extract::Surface;
use super::lattice::{ACROSS, BRICK, BRICK_BITS, Lattice, ROWS};

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
pub fn parts(surface: &Surface, part_of: &[u32]) -> Result<()> {
    dump::stage("merge-3-parts", || Stage {
        positions: surface.positions.clone(),
        values: part_of.iter().map(|&part| part as i32 + 1).collect(),
        triangles: surface.triangles.clone(),
    })
}
