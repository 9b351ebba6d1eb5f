//! How far poses may be off: what becomes of them if pieces of the surface are left out (the infinitesimal jackknife).
//!
//! Distances between surfaces that lie beside each other are off together: by noise that was smoothed over them, by what lies
//! between samples, by warp. Each piece of space counts as one observation, however many samples there are. Sandwich of
//! inverse normal matrices around the sum over pieces (Liang & Zeger 1986). White noise, which others assume, gives far too little.

use glam::{DVec3, IVec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::blocks::{BlockSystem, Factor, LANES};
use crate::judge::PIECE;
use crate::linear::{Matrix6, Vector6};
use crate::relax::{NARROW, Net, Tie, Use, contacts, weight_of};
use base::error::Result;
use base::progress::Progress;

/// Covariances of the scans that have unknowns, in their gauges. Zero for the others.
pub(crate) fn covariances(net: &Net<'_>, progress: &Progress<'_>) -> Result<Vec<Matrix6>> {
    let (reach, scale) = NARROW;
    let equations = |purpose| net.equations(reach, scale, purpose, progress);
    let factor = match response(equations(Use::Response)?) {
        Some(factor) => Some(factor),
        None => equations(Use::Step)?.factor(),
    };
    let Some(factor) = factor else { return Ok(vec![[[0.0; 6]; 6]; net.views.len()]) };
    let unknowns = net.unknowns();
    let gauges = net.gauges();
    let width = PIECE * net.views.iter().map(|view| view.fine().cell).fold(0.0, f64::max);
    let mut places: FxHashMap<IVec3, usize> = FxHashMap::default();
    let mut pieces: Vec<Vec<(usize, Vector6)>> = Vec::new();
    for link in &net.links {
        progress.check()?;
        let (Some(of_a), Some(of_b)) = (&gauges[link.a], &gauges[link.b]) else { continue };
        for contact in contacts(net, *link, net.samples(), reach) {
            let residual = contact.distance();
            let weight = weight_of(net, *link, &contact, scale);
            let middle = 0.5 * (contact.a + contact.b);
            let piece = *places.entry((middle / width).floor().as_ivec3()).or_insert_with(|| {
                pieces.push(Vec::new());
                pieces.len() - 1
            });
            let sides = [
                (unknowns[link.a], of_a.row(middle, -contact.normal)),
                (unknowns[link.b], of_b.row(middle, contact.normal)),
            ];
            for (unknown, row) in sides {
                let Some(unknown) = unknown else { continue };
                let push = row.map(|x| weight * residual * x);
                match pieces[piece].iter_mut().find(|entry| entry.0 == unknown) {
                    Some((_, sum)) => sum.iter_mut().zip(push).for_each(|(sum, x)| *sum += x),
                    None => pieces[piece].push((unknown, push)),
                }
            }
        }
    }
    for Tie { pick, exact } in &net.ties {
        let [a, b] = pick.scans;
        let (Some(of_a), Some(of_b), Some(at_a), Some(at_b)) = (&gauges[a], &gauges[b], net.poses[a], net.poses[b])
        else {
            continue;
        };
        let places = [at_a.transform_point3(pick.points[0]), at_b.transform_point3(pick.points[1])];
        let weight = net.weight_of_pick(pick);
        for axis in DVec3::AXES {
            let off = (places[1] - places[0]).dot(axis).hypot(*exact);
            let push = |row: Vector6| row.map(|x| weight * off * x);
            let sides = [(unknowns[a], of_a.row(places[0], -axis)), (unknowns[b], of_b.row(places[1], axis))];
            pieces.push(sides.into_iter().filter_map(|(unknown, row)| Some((unknown?, push(row)))).collect());
        }
    }
    let count = unknowns.iter().flatten().count();
    let mut of_unknown = vec![[[0.0; 6]; 6]; count];
    for some in pieces.chunks(AT_ONCE * LANES) {
        let solved = some.par_chunks(LANES).map(|some| {
            progress.check()?;
            let mut right = vec![[[0.0; LANES]; 6]; count];
            for (lane, piece) in some.iter().enumerate() {
                for &(unknown, push) in piece {
                    right[unknown].iter_mut().zip(push).for_each(|(row, x)| row[lane] = x);
                }
            }
            Ok(factor.solve_all(&right))
        });
        // One piece after the other, so that sums are the same for any number of threads.
        for shifts in solved.collect::<Result<Vec<_>>>()? {
            for lane in 0..LANES {
                for (sum, shift) in of_unknown.iter_mut().zip(&shifts) {
                    for (row, x) in sum.iter_mut().zip(shift) {
                        row.iter_mut().zip(shift).for_each(|(to, y)| *to += x[lane] * y[lane]);
                    }
                }
            }
        }
    }
    // Poses were fitted to the same pieces.
    let spare = pieces.len() as f64 - 6.0 * count as f64;
    let correction = if spare > 0.0 { pieces.len() as f64 / spare } else { f64::INFINITY };
    of_unknown.iter_mut().flatten().flatten().for_each(|x| *x *= correction.min(MOST_CORRECTION));
    Ok(unknowns.iter().map(|unknown| unknown.map_or([[0.0; 6]; 6], |unknown| of_unknown[unknown])).collect())
}

/// So many times as many pieces as are solved together have their solutions in memory.
const AT_ONCE: usize = 16;

/// Returns the factor of a system. One in which something may slide gets the least spring that makes it definite: poses move far where that
/// alone holds them. `None` if no spring does.
fn response(mut system: BlockSystem) -> Option<Factor> {
    if let Some(factor) = system.factor() {
        return Some(factor);
    }
    let trace: f64 = system.diagonal.iter().map(|block| (0..6).map(|i| block[i][i]).sum::<f64>()).sum();
    let mean = trace / (6.0 * system.diagonal.len().max(1) as f64);
    let mut held = 0.0;
    for spring in SPRINGS {
        for block in &mut system.diagonal {
            (0..6).for_each(|i| block[i][i] += (spring - held) * mean);
        }
        held = spring;
        if let Some(factor) = system.factor() {
            return Some(factor);
        }
    }
    None
}

/// Springs that are tried, as shares of what holds a scan on average.
const SPRINGS: [f64; 7] = [1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2];

/// Few pieces tell little, but not nothing.
const MOST_CORRECTION: f64 = 10.0;
