//! A field to the signed distance of its zero level, by fast sweeping. \[Zha05\]

use base::error::Result;
use base::progress::{Pace, Progress};

use super::grid::Grid;

/// Signed distances, positive where `field` is not negative. Nodes of `known` keep the distances that they have there, and their sides.
/// The distance is infinite if nothing changes sign. Nodes that are not `asked` for hold distances already.
///
/// Cost: eight passes over the grid.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn signed(
    grid: &Grid,
    field: &[f64],
    known: &[(u32, f64)],
    asked: &[bool],
    progress: &Progress<'_>,
) -> Result<Vec<f64>> {
    let mut value = field.to_vec();
    let mut is_fixed: Vec<bool> = asked.iter().map(|asked| !asked).collect();
    for &(node, distance) in known {
        value[node as usize] = distance;
        is_fixed[node as usize] = true;
    }
    let mut pace = Pace::new(progress);
    let mut distance = vec![f64::INFINITY; grid.len()];
    for node in 0..grid.len() {
        pace.after(4)?;
        if is_fixed[node] {
            distance[node] = value[node].abs();
        } else if let Some(crossing) = to_crossing(grid, &value, node) {
            (distance[node], is_fixed[node]) = (crossing, true);
        }
    }
    for order in 0..8 {
        sweep(grid, order, &is_fixed, &mut distance, &mut pace)?;
    }
    for (distance, value) in distance.iter_mut().zip(&value) {
        if *value < 0.0 {
            *distance = -*distance;
        }
    }
    Ok(distance)
}

/// Distance to where the field crosses zero beside a node, as a plane through the crossings on its edges.
fn to_crossing(grid: &Grid, value: &[f64], node: usize) -> Option<f64> {
    let own = value[node];
    let mut inverse_squares = 0.0;
    let sides = grid.neighbours(node);
    for axis in sides.chunks_exact(2) {
        let nearest = axis
            .iter()
            .flatten()
            .filter(|&&other| (value[other] < 0.0) != (own < 0.0))
            .map(|&other| own / (own - value[other]))
            .fold(f64::INFINITY, f64::min);
        if nearest.is_finite() {
            inverse_squares += 1.0 / (nearest * nearest).max(1e-6);
        }
    }
    (inverse_squares > 0.0).then(|| grid.cell / inverse_squares.sqrt())
}

fn sweep(grid: &Grid, order: usize, is_fixed: &[bool], distance: &mut [f64], pace: &mut Pace<'_>) -> Result<()> {
    let [nx, ny, nz] = grid.counts;
    let strides = grid.strides();
    let turned = |axis: usize, i: usize, n: usize| if order >> axis & 1 == 1 { n - 1 - i } else { i };
    for k in 0..nz {
        let k = turned(2, k, nz);
        for j in 0..ny {
            let j = turned(1, j, ny);
            pace.after(nx)?;
            for i in 0..nx {
                let i = turned(0, i, nx);
                let node = grid.index([i, j, k]);
                if is_fixed[node] {
                    continue;
                }
                let least = |axis: usize, at: usize, n: usize| {
                    let below = if at > 0 { distance[node - strides[axis]] } else { f64::INFINITY };
                    let above = if at + 1 < n { distance[node + strides[axis]] } else { f64::INFINITY };
                    below.min(above)
                };
                let mut sides = [least(0, i, nx), least(1, j, ny), least(2, k, nz)];
                sides.sort_unstable_by(f64::total_cmp);
                distance[node] = distance[node].min(upwind(sides, grid.cell));
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
