//! Conjugate gradients with a preconditioner. All sums run in one order, so that the result is the same for any number of threads.

use base::error::Result;
use base::progress::Progress;

/// A symmetric positive definite matrix, and approximately its inverse. Each writes its product with the first vector into the second one.
pub struct System<M, P> {
    pub matrix: M,
    pub precondition: P,
}

/// The end of steps.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// The squared norm of the residual, as [`System::norm`] gives it.
    pub energy: f64,
    pub most_steps: usize,
}

impl<M: FnMut(&[f64], &mut [f64]), P: FnMut(&[f64], &mut [f64]) -> Result<()>> System<M, P> {
    /// The squared norm of a residual: its product with the preconditioned one.
    ///
    /// # Errors
    /// Those of the preconditioner.
    pub fn norm(&mut self, residual: &[f64]) -> Result<f64> {
        let mut z = vec![0.0; residual.len()];
        (self.precondition)(residual, &mut z)?;
        Ok(dot(residual, &z))
    }

    /// Steps towards `matrix * x = right` from the given `x`. Returns their number.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`]: asked once a step, and by the preconditioner.
    pub fn solve(&mut self, x: &mut [f64], right: &[f64], goal: Goal, progress: &Progress<'_>) -> Result<usize> {
        let n = x.len();
        let mut product = vec![0.0; n];
        (self.matrix)(x, &mut product);
        let mut residual: Vec<f64> = right.iter().zip(&product).map(|(r, p)| r - p).collect();
        let mut z = vec![0.0; n];
        (self.precondition)(&residual, &mut z)?;
        let mut direction = z.clone();
        let mut energy = dot(&residual, &z);
        for step in 0..goal.most_steps {
            progress.check()?;
            if !(energy > goal.energy) {
                return Ok(step);
            }
            (self.matrix)(&direction, &mut product);
            let curvature = dot(&direction, &product);
            if !(curvature > 0.0) {
                return Ok(step);
            }
            let length = energy / curvature;
            for i in 0..n {
                x[i] += length * direction[i];
                residual[i] -= length * product[i];
            }
            (self.precondition)(&residual, &mut z)?;
            let next = dot(&residual, &z);
            let turn = next / energy;
            energy = next;
            for i in 0..n {
                direction[i] = z[i] + turn * direction[i];
            }
        }
        Ok(goal.most_steps)
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
