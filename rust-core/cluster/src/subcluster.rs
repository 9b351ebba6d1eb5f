//! Stage 2: patches become disks. \[KMT, sec. 3.2\]
//!
//! k-means knows no surface: a patch may lie on both sides of a thin wall, around a hole or a handle. Parts of a patch that are not
//! connected become patches of their own, or go to their neighbours if they are small. A patch that is no disk, or has fewer than three
//! nodes around it, is halved. When nothing is left to do, the fans around all patches are a mesh of the same topology as the surface. Each
//! patch is a disk, three meet in a node, and two that meet twice do so in different nodes, so no edge is there twice. A patch that can't
//! be halved has its largest neighbour halved. It ends at the latest when each patch is one vertex.

use super::connect::{Repairs, SMALL, connect, most_frequent};
use super::kmeans::{halve, members};
use super::polygons::Polygons;
use super::surface::{NONE, Surface};
use base::error::Result;
use base::progress::Progress;

use glam::DVec3;

/// Rounds in which patches may be dissolved. Later ones only halve, so that the rounds end.
const DISSOLVING_ROUNDS: usize = 6;

/// Changes `labels` until every patch is a disk with at least three nodes. Returns the number of patches, the polygons and what was done.
/// Labels are 0.. without gaps.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn make_disks(
    surface: &Surface,
    weights: &[f64],
    labels: &mut [u32],
    progress: &Progress<'_>,
) -> Result<(usize, Polygons, Repairs)> {
    let mut repairs = Repairs::default();
    for round in 0.. {
        progress.check()?;
        let dissolving = round < DISSOLVING_ROUNDS;
        let patches = connect(surface, weights, labels, dissolving, &mut repairs, progress)?;
        let polygons = Polygons::trace(surface, labels, None);
        progress.check()?;
        let bad = bad_patches(surface, labels, patches, &polygons);
        let Some(bad) = bad else { return Ok((patches, polygons, repairs)) };
        progress.check()?;
        mend(surface, weights, labels, patches, &bad, dissolving, &mut repairs);
    }
    unreachable!("the rounds end where each patch is one vertex")
}

/// Faults of a patch.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Fault {
    None,
    NoDisk,
    FewNodes,
}

/// Faults of all patches. `None` if there is none.
fn bad_patches(surface: &Surface, labels: &[u32], patches: usize, polygons: &Polygons) -> Option<Vec<Fault>> {
    // Euler characteristic of the mesh within each patch, to which its dual cells shrink. Half-edges with a twin count once
    // each way, so everything is counted twice.
    let mut twice_euler = vec![0_i32; patches];
    for &label in labels {
        twice_euler[label as usize] += 2;
    }
    for (t, corners) in surface.triangles.iter().enumerate() {
        let [a, b, c] = corners.map(|v| labels[v as usize]);
        if a == b && b == c {
            twice_euler[a as usize] += 2;
        }
        for (k, (from, to)) in [(a, b), (b, c), (c, a)].into_iter().enumerate() {
            if from == to {
                twice_euler[from as usize] -= if surface.twins[3 * t + k] == NONE { 2 } else { 1 };
            }
        }
    }
    let mut nodes = vec![0; patches];
    for (c, &patch) in polygons.patches.iter().enumerate() {
        nodes[patch as usize] += polygons.circle(c).len();
    }
    let faults: Vec<Fault> = (0..patches)
        .map(|p| match (twice_euler[p], nodes[p]) {
            (2, 3..) => Fault::None,
            (2, _) => Fault::FewNodes,
            _ => Fault::NoDisk,
        })
        .collect();
    faults.iter().any(|&f| f != Fault::None).then_some(faults)
}

/// Halves the bad patches. Small ones with few nodes go to a neighbour. One of a single vertex has its largest neighbour halved.
fn mend(
    surface: &Surface,
    weights: &[f64],
    labels: &mut [u32],
    patches: usize,
    faults: &[Fault],
    dissolving: bool,
    repairs: &mut Repairs,
) {
    let (starts, mut list) = members(labels, patches);
    let mean = weights.iter().sum::<f64>() / patches as f64;
    let size = |patch: u32| starts[patch as usize + 1] - starts[patch as usize];
    let mut to_halve = vec![false; patches];
    let mut contacts = Vec::new();
    for patch in (0..patches as u32).filter(|&p| faults[p as usize] != Fault::None) {
        let members = &list[starts[patch as usize] as usize..starts[patch as usize + 1] as usize];
        contacts.clear();
        for &v in members {
            surface.neighbours(v, |w| {
                if labels[w as usize] != patch {
                    contacts.push(labels[w as usize]);
                }
            });
        }
        let weight: f64 = members.iter().map(|&v| weights[v as usize]).sum();
        let few = faults[patch as usize] == Fault::FewNodes;
        if few
            && dissolving
            && weight < 2.0 * SMALL * mean
            && let Some(other) = most_frequent(&mut contacts)
        {
            members.iter().for_each(|&v| labels[v as usize] = other);
            repairs.dissolved += 1;
            continue;
        }
        let halved = if members.len() > 1 {
            Some(patch)
        } else {
            // Its neighbours have so few labels that one of them has several vertices.
            contacts
                .iter()
                .copied()
                .filter(|&p| (p as usize) < patches)
                .max_by_key(|&p| (size(p), std::cmp::Reverse(p)))
        };
        if let Some(halved) = halved {
            to_halve[halved as usize] = true;
        }
    }
    let mut next = patches as u32;
    for patch in (0..patches).filter(|&p| to_halve[p]) {
        let members = &mut list[starts[patch] as usize..starts[patch + 1] as usize];
        // Points in one place can't be halved by a plane.
        let middle = halve(&surface.points, weights, members, DVec3::ZERO).unwrap_or(members.len() / 2);
        if middle == 0 {
            continue;
        }
        members[middle..].iter().for_each(|&v| labels[v as usize] = next);
        next += 1;
        repairs.halved += 1;
    }
}
