//! A field to the signed distance of its zero level, by fast sweeping. \[Zha05\]

use base::error::Result;
use base::progress::{Pace, Progress};

use super::nodes::Nodes;

/// Signed distances, positive where `field` is not negative. Nodes of `known` keep the distances that they have there, and their sides.
/// The distance is infinite if nothing changes sign.
///
/// Cost: eight passes over the nodes.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn signed(nodes: &Nodes, field: &[f64], known: &[(u32, f64)], progress: &Progress<'_>) -> Result<Vec<f64>> {
    let mut value = field.to_vec();
    let mut is_fixed = vec![false; nodes.len()];
    for &(node, distance) in known {
        value[node as usize] = distance;
        is_fixed[node as usize] = true;
    }
    let mut pace = Pace::new(progress);
    let mut distance = vec![f64::INFINITY; nodes.len()];
    for node in 0..nodes.len() {
        pace.after(4)?;
        if is_fixed[node] {
            distance[node] = value[node].abs();
        } else if let Some(crossing) = to_crossing(nodes, &value, node) {
            (distance[node], is_fixed[node]) = (crossing, true);
        }
    }
    for order in 0..8 {
        sweep(nodes, order, &is_fixed, &mut distance, &mut pace)?;
    }
    for (distance, value) in distance.iter_mut().zip(&value) {
        if *value < 0.0 {
            *distance = -*distance;
        }
    }
    Ok(distance)
}

/// Distance to where the field crosses zero beside a node, as a plane through the crossings on its edges.
fn to_crossing(nodes: &Nodes, value: &[f64], node: usize) -> Option<f64> {
    let own = value[node];
    let mut inverse_squares = 0.0;
    for axis in nodes.sides(node).chunks_exact(2) {
        let nearest = axis
            .iter()
            .filter_map(|&other| value.get(other as usize))
            .filter(|&&other| (other < 0.0) != (own < 0.0))
            .map(|&other| own / (own - other))
            .fold(f64::INFINITY, f64::min);
        if nearest.is_finite() {
            inverse_squares += 1.0 / (nearest * nearest).max(1e-6);
        }
    }
    (inverse_squares > 0.0).then(|| nodes.grid.cell / inverse_squares.sqrt())
}

fn sweep(nodes: &Nodes, order: usize, is_fixed: &[bool], distance: &mut [f64], pace: &mut Pace<'_>) -> Result<()> {
    let turned = |axis: usize, i: usize, n: usize| if order >> axis & 1 == 1 { n - 1 - i } else { i };
    let [_, ny, nz] = nodes.grid.counts;
    for k in 0..nz {
        for j in 0..ny {
            let row = nodes.row(turned(1, j, ny), turned(2, k, nz));
            pace.after(row.len() + 1)?;
            for i in 0..row.len() {
                let node = row.start + turned(0, i, row.len());
                if is_fixed[node] {
                    continue;
                }
                let at = |other: u32| distance.get(other as usize).copied().unwrap_or(f64::INFINITY);
                let [a, b, c, d, e, f] = nodes.sides(node).map(at);
                let mut sides = [a.min(b), c.min(d), e.min(f)];
                sides.sort_unstable_by(f64::total_cmp);
                distance[node] = distance[node].min(upwind(sides, nodes.grid.cell));
            }
        }
    }
    Ok(())
}

/// The distance at a node from the least ones beside it along each axis, rising.
fn upwind([a, b, c]: [f64; 3], cell: f64) -> f64 {
    let one = a + cell;
    if one <= b {
        return one;
    }
    let two = 0.5 * (a + b + (2.0 * cell * cell - (a - b) * (a - b)).max(0.0).sqrt());
    if two <= c {
        return two;
    }
    let (sum, squares) = (a + b + c, a * a + b * b + c * c);
    (sum + (sum * sum - 3.0 * (squares - cell * cell)).max(0.0).sqrt()) / 3.0
}
