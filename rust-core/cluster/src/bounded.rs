//! A level within a largest error: patches are split where its mesh lies too far off, until it lies nowhere too far off.

use super::driver::{Job, Rims};
use super::kmeans::KMeans;
use super::report::Clustered;
use base::error::Result;
use base::progress::Progress;
use geom::bvh::Bvh;
use mesh::{certify, measure};

/// Patches that a largest error starts with.
const FIRST_PATCHES: usize = 32;
/// Rounds of refinement for a largest error ...
const REFINEMENTS: usize = 60;
/// ... the first of which relax what they make: of noise that nodes slide away from, that may never lie near enough.
const RELAXED: usize = 24;
/// Rounds after which the patches around a vertex that stays beyond are split, too, a ring more each round, ...
const PATIENCE: u8 = 10;
/// ... so many at most.
const MOST_RINGS: u8 = 6;

impl<'a> Job<'a> {
    /// Splits the patches with a place beyond `bound` until there is none. Vertices of the input come first, which is soon measured. Then
    /// come all points of both surfaces.
    pub(super) fn within(&self, start: &KMeans<'a>, bound: f64, progress: &Progress<'_>) -> Result<Clustered> {
        let reference = self.cut_input();
        let bvh = Bvh::build_with(&reference.positions, &reference.triangles, rayon::current_num_threads(), progress)?;
        // In how many rounds each vertex was beyond.
        let mut rounds = vec![0_u8; reference.positions.len()];
        let mut kmeans = start.restarted();
        kmeans.split_to(FIRST_PATCHES, progress)?;
        for round in 0..REFINEMENTS {
            kmeans.step(progress)?;
            let disks = self.repaired(&kmeans, progress)?;
            // Halfway to a patch a vertex nothing is won over the input.
            if disks.nodes() >= self.surface.points.len() {
                break;
            }
            progress.lap("patches");
            let relaxation = if round < RELAXED { self.params.relaxation } else { 0 };
            let Some(made) = self.make(disks, None, relaxation, Rims::AsTheyCome, progress)? else { break };
            let side = measure::Side::Ignored;
            let deviation = measure::deviation_within(&reference.positions, &made.mesh, side, 0, progress)?;
            let mut beyond: Vec<bool> = deviation.distances.iter().map(|&d| d > bound).collect();
            if !beyond.contains(&true) {
                let there = certify::within(&reference, &made.mesh, bound, progress)?;
                let back = certify::within(&made.mesh, &reference, bound, progress)?;
                if there.beyond.is_empty() && back.beyond.is_empty() {
                    progress.lap("measure");
                    return Ok(made.into_result(deviation.summary, there.bound.max(back.bound)));
                }
                // Its place, and those at the corners of the triangle that lies too far off.
                let places = there.beyond.iter().map(|b| b[0]).chain(back.beyond.iter().map(|b| b[1]));
                let far_off = there.beyond.iter().map(|b| b[1]).chain(back.beyond.iter().map(|b| b[0]));
                let corners = far_off.flat_map(|t| made.mesh.corners(t as usize));
                let at_corners = corners.filter_map(|p| bvh.closest_point(p)).map(|closest| closest.triangle);
                for t in places.chain(at_corners) {
                    reference.triangles[t as usize].iter().for_each(|&v| beyond[v as usize] = true);
                }
            }
            progress.lap("measure");
            widen(&mut beyond, &mut rounds, &reference.triangles);
            kmeans.split_marked(&beyond);
            kmeans.step(progress)?;
        }
        self.input_itself(progress)
    }
}

/// Marks what is around vertices that were marked in many rounds, of which it counts them: their own patches are as small as
/// may be, and were no help.
fn widen(marked: &mut [bool], rounds: &mut [u8], triangles: &[[u32; 3]]) {
    let mut rings = vec![0_u8; marked.len()];
    for v in (0..marked.len()).filter(|&v| marked[v]) {
        rounds[v] = rounds[v].saturating_add(1);
        rings[v] = rounds[v].saturating_sub(PATIENCE).clamp(1, MOST_RINGS);
    }
    for _ in 1..rings.iter().copied().max().unwrap_or(0) {
        let before = rings.clone();
        for triangle in triangles {
            let most = triangle.iter().map(|&v| before[v as usize]).max().unwrap_or(0);
            triangle.iter().for_each(|&v| rings[v as usize] = rings[v as usize].max(most.saturating_sub(1)));
        }
    }
    marked.iter_mut().zip(rings).for_each(|(marked, rings)| *marked = rings > 0);
}
