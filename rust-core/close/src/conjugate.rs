//! Conjugate gradients with a preconditioner. All sums run in one order, so that the result is the same for any number of threads.

use base::error::Result;
use base::progress::Progress;

/// Steps towards `matrix * x = right` from the given `x` until the preconditioned residual has fallen to `share` of that of `x = 0`,
/// or `most` steps were made. Returns their number.
///
/// # Errors
/// [`base::Error::Cancelled`]: asked once a step, and by the preconditioner.
pub fn solve(
    x: &mut [f64],
    right: &[f64],
    mut matrix: impl FnMut(&[f64], &mut [f64]),
    mut precondition: impl FnMut(&[f64], &mut [f64]) -> Result<()>,
    share: f64,
    most: usize,
    progress: &Progress<'_>,
) -> Result<usize> {
    let n = x.len();
    let mut z = vec![0.0; n];
    precondition(right, &mut z)?;
    let whole = dot(right, &z);
    let mut product = vec![0.0; n];
    matrix(x, &mut product);
    let mut residual: Vec<f64> = right.iter().zip(&product).map(|(r, p)| r - p).collect();
    precondition(&residual, &mut z)?;
    let mut direction = z.clone();
    let mut energy = dot(&residual, &z);
    for step in 0..most {
        progress.check()?;
        if !(energy > share * share * whole) {
            return Ok(step);
        }
        matrix(&direction, &mut product);
        let curvature = dot(&direction, &product);
        if !(curvature > 0.0) {
            return Ok(step);
        }
        let length = energy / curvature;
        for i in 0..n {
            x[i] += length * direction[i];
            residual[i] -= length * product[i];
        }
        precondition(&residual, &mut z)?;
        let next = dot(&residual, &z);
        let turn = next / energy;
        energy = next;
        for i in 0..n {
            direction[i] = z[i] + turn * direction[i];
        }
    }
    Ok(most)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
