//! Stage 3: which side of the surface is each basin on?
//!
//! Two basins joined by a gate nearly as wide as themselves are parts of one room. Then rooms remain that touch through narrow gates: the
//! outside, the inside of an object, its legs behind thin necks, voids in noise. If the surface lies between two rooms, large balls touch
//! from both sides at its facets, all over it. If it does not, the few facets between them cross the neck and no balls touch. So the facets
//! vote, and rooms get sides by decreasing number of votes, then the rest by decreasing gate. One wide gate does not empty an object that
//! hundreds of its facets speak for, which a threshold on the size of facets alone can not tell.

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::balls::CHUNK;
use super::basins::{Basins, Gate, OUTSIDE};
use base::error::Result;
use base::progress::Progress;

/// Basins are one room if the gate between them is at least this share of the smaller one's depth.
const ONE_ROOM: f32 = 0.9;

/// Fewest tangent facets that put two rooms on different sides: about those around five samples.
const VOTES: u32 = 12;

/// ... and at least this share of all facets between them. It is about one half on clean samples, a tenth where scans
/// with noise as large as their spacing lie on top of each other, and next to none across a neck.
const SHARE: f64 = 0.05;

/// Groups of basins whose sides are known relative to each other.
pub(super) struct Groups {
    /// Twice the parent, plus one if the parent is on the other side.
    parents: Vec<u32>,
}

impl Groups {
    pub(super) fn new(count: usize) -> Self {
        Groups { parents: (0..count as u32).map(|basin| 2 * basin).collect() }
    }

    /// The group's root, and 1 if the basin is on the other side than the root.
    pub(super) fn find(&mut self, basin: u32) -> (u32, u32) {
        let (mut root, mut other) = (basin, 0);
        while self.parents[root as usize] >> 1 != root {
            other ^= self.parents[root as usize] & 1;
            root = self.parents[root as usize] >> 1;
        }
        let (mut here, mut side) = (basin, other);
        while here != root {
            let parent = std::mem::replace(&mut self.parents[here as usize], 2 * root + side);
            side ^= parent & 1;
            here = parent >> 1;
        }
        (root, other)
    }

    /// Puts two basins on the same side or on different ones, unless it is known already. The new root, if there is one.
    pub(super) fn join(&mut self, a: u32, b: u32, different: bool) -> Option<(u32, u32)> {
        let ((a, side_a), (b, side_b)) = (self.find(a), self.find(b));
        if a == b {
            return None;
        }
        let (root, child) = (a.min(b), a.max(b));
        self.parents[child as usize] = 2 * root + (side_a ^ side_b ^ u32::from(different));
        Some((root, child))
    }
}

/// The facets between two rooms.
#[derive(Clone, Copy)]
struct Contact {
    rooms: [u32; 2],
    facets: u32,
    votes: u32,
    gate: f32,
}

impl Contact {
    fn is_surface(&self) -> bool {
        self.votes >= VOTES && f64::from(self.votes) >= SHARE * f64::from(self.facets)
    }
}

/// The side of each cell: 1 inside, 0 outside.
pub(super) fn sides(basins: Basins, progress: &Progress<'_>) -> Result<Vec<u8>> {
    let Basins { basin, mut depth, gates } = basins;
    let mut groups = Groups::new(depth.len());
    // Rooms: from the widest gate down, so that rooms deepen as they grow.
    for chunk in gates.chunks(CHUNK) {
        for gate in chunk {
            let [a, b] = gate.basins.map(|basin| groups.find(basin).0);
            if a != b
                && gate.clearance >= ONE_ROOM * depth[a as usize].min(depth[b as usize])
                && let Some((root, child)) = groups.join(a, b, false)
            {
                depth[root as usize] = depth[root as usize].max(depth[child as usize]);
            }
        }
        progress.advance(chunk.len() as u64)?;
    }
    for contact in contacts(&gates, &mut groups, progress)? {
        groups.join(contact.rooms[0], contact.rooms[1], contact.is_surface());
    }
    let outside = groups.find(OUTSIDE);
    let sides: Vec<u8> = (0..depth.len() as u32)
        .map(|basin| {
            let (root, side) = groups.find(basin);
            u8::from(root == outside.0 && side != outside.1)
        })
        .collect();
    Ok(basin.par_iter().map(|&basin| sides[basin as usize]).collect())
}

/// All pairs of rooms that touch, in the order in which they are to be decided.
fn contacts(gates: &[Gate], groups: &mut Groups, progress: &Progress<'_>) -> Result<Vec<Contact>> {
    let rooms: Vec<u32> = (0..groups.parents.len() as u32).map(|basin| groups.find(basin).0).collect();
    let mut found: Vec<Contact> = Vec::new();
    let mut places = FxHashMap::default();
    for chunk in gates.chunks(CHUNK) {
        for gate in chunk {
            let [a, b] = gate.basins.map(|basin| rooms[basin as usize]);
            if a == b {
                continue;
            }
            let pair = [a.min(b), a.max(b)];
            let place = *places.entry(pair).or_insert(found.len());
            if place == found.len() {
                found.push(Contact { rooms: pair, facets: 0, votes: 0, gate: gate.clearance });
            }
            found[place].facets += gate.facets;
            found[place].votes += gate.tangent;
        }
        progress.advance(chunk.len() as u64)?;
    }
    let votes = |contact: &Contact| if contact.is_surface() { contact.votes } else { 0 };
    // Stable: contacts were found in the order of their widest gates.
    found.sort_by(|a, b| votes(b).cmp(&votes(a)).then(b.gate.total_cmp(&a.gate)));
    Ok(found)
}
