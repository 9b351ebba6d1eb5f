//! Sparse symmetric systems of 6 x 6 blocks, one a scan: factored in an order that keeps them sparse.

use std::collections::BTreeMap;

use crate::linear::{Matrix6, Vector6};

const ZERO: Matrix6 = [[0.0; 6]; 6];

/// Normal equations of many motions: blocks of the lower triangle and the right side.
pub(crate) struct BlockSystem {
    pub diagonal: Vec<Matrix6>,
    /// By `(row, column)` with `row > column`.
    pub below: BTreeMap<(usize, usize), Matrix6>,
    pub right: Vec<Vector6>,
}

impl BlockSystem {
    pub fn new(count: usize) -> Self {
        BlockSystem { diagonal: vec![ZERO; count], below: BTreeMap::new(), right: vec![[0.0; 6]; count] }
    }

    /// Adds the block of `row` and `column`, given as it stands there.
    pub fn add(&mut self, row: usize, column: usize, block: &Matrix6) {
        let (place, transposed) = match row.cmp(&column) {
            std::cmp::Ordering::Equal => (&mut self.diagonal[row], false),
            std::cmp::Ordering::Greater => (self.below.entry((row, column)).or_insert(ZERO), false),
            std::cmp::Ordering::Less => (self.below.entry((column, row)).or_insert(ZERO), true),
        };
        for i in 0..6 {
            for j in 0..6 {
                place[i][j] += if transposed { block[j][i] } else { block[i][j] };
            }
        }
    }

    /// Factors it. `None` if it isn't positive definite. Cost and memory grow with what fills in.
    pub fn factor(&self) -> Option<Factor> {
        let count = self.diagonal.len();
        let order = self.order();
        let mut place = vec![0; count];
        order.iter().enumerate().for_each(|(k, &scan)| place[scan] = k);
        // Columns of what is still to be eliminated, by place.
        let mut columns: Vec<BTreeMap<usize, Matrix6>> = vec![BTreeMap::new(); count];
        for (&(row, column), block) in &self.below {
            let (i, j) = (place[row], place[column]);
            let block = if i > j { *block } else { transposed(block) };
            columns[i.min(j)].insert(i.max(j), block);
        }
        let mut diagonal: Vec<Matrix6> = order.iter().map(|&scan| self.diagonal[scan]).collect();
        let mut factor = Factor { order, diagonal: Vec::with_capacity(count), columns: Vec::with_capacity(count) };
        for k in 0..count {
            let root = cholesky(&diagonal[k])?;
            let column: Vec<(usize, Matrix6)> =
                std::mem::take(&mut columns[k]).into_iter().map(|(i, block)| (i, divided(&block, &root))).collect();
            for (x, (i, left)) in column.iter().enumerate() {
                for (j, right) in &column[..=x] {
                    let target = if i == j { &mut diagonal[*i] } else { columns[*j].entry(*i).or_insert(ZERO) };
                    subtract(target, left, right);
                }
            }
            factor.diagonal.push(root);
            factor.columns.push(column);
        }
        Some(factor)
    }

    /// Scans of fewest neighbours first, those that elimination joins counted.
    fn order(&self) -> Vec<usize> {
        let count = self.diagonal.len();
        let mut near = vec![std::collections::BTreeSet::new(); count];
        for &(row, column) in self.below.keys() {
            near[row].insert(column);
            near[column].insert(row);
        }
        let mut left: std::collections::BTreeSet<(usize, usize)> = (0..count).map(|k| (near[k].len(), k)).collect();
        let mut order = Vec::with_capacity(count);
        while let Some((_, k)) = left.pop_first() {
            order.push(k);
            let around: Vec<usize> = std::mem::take(&mut near[k]).into_iter().collect();
            for &i in &around {
                left.remove(&(near[i].len(), i));
                near[i].remove(&k);
                near[i].extend(around.iter().copied().filter(|&j| j != i));
                left.insert((near[i].len(), i));
            }
        }
        order
    }
}

/// A factored system.
pub(crate) struct Factor {
    order: Vec<usize>,
    diagonal: Vec<Matrix6>,
    columns: Vec<Vec<(usize, Matrix6)>>,
}

/// Right sides that are solved at once, number by number beside each other.
pub(crate) const LANES: usize = 4;
/// A block of each.
pub(crate) type Rows = [[f64; LANES]; 6];

impl Factor {
    pub fn solve(&self, right: &[Vector6]) -> Vec<Vector6> {
        let wide: Vec<Rows> = right.iter().map(|row| row.map(|x| [x, 0.0, 0.0, 0.0])).collect();
        self.solve_all(&wide).into_iter().map(|row| row.map(|x| x[0])).collect()
    }

    /// Solves for several right sides, each as it would be by itself.
    pub fn solve_all(&self, right: &[Rows]) -> Vec<Rows> {
        let mut x: Vec<Rows> = self.order.iter().map(|&scan| right[scan]).collect();
        for k in 0..x.len() {
            let mut here = x[k];
            // Most right sides have few blocks, and fill in late.
            if here.iter().flatten().all(|x| *x == 0.0) {
                continue;
            }
            let root = &self.diagonal[k];
            for i in 0..6 {
                for j in 0..i {
                    let done = here[j];
                    subtract_lanes(&mut here[i], root[i][j], &done);
                }
                here[i].iter_mut().for_each(|x| *x /= root[i][i]);
            }
            x[k] = here;
            for (i, block) in &self.columns[k] {
                for (to, row) in x[*i].iter_mut().zip(block) {
                    let mut sum = [0.0; LANES];
                    for (a, done) in row.iter().zip(&here) {
                        sum.iter_mut().zip(done).for_each(|(sum, x)| *sum += a * x);
                    }
                    to.iter_mut().zip(sum).for_each(|(to, sum)| *to -= sum);
                }
            }
        }
        for k in (0..x.len()).rev() {
            let mut here = x[k];
            for (i, block) in &self.columns[k] {
                let of = x[*i];
                for (row, of) in block.iter().zip(&of) {
                    here.iter_mut().zip(row).for_each(|(to, a)| subtract_lanes(to, *a, of));
                }
            }
            let root = &self.diagonal[k];
            for i in (0..6).rev() {
                for j in i + 1..6 {
                    let done = here[j];
                    subtract_lanes(&mut here[i], root[j][i], &done);
                }
                here[i].iter_mut().for_each(|x| *x /= root[i][i]);
            }
            x[k] = here;
        }
        let mut out = vec![[[0.0; LANES]; 6]; x.len()];
        self.order.iter().zip(x).for_each(|(&scan, x)| out[scan] = x);
        out
    }
}

#[inline(always)]
fn subtract_lanes(to: &mut [f64; LANES], factor: f64, of: &[f64; LANES]) {
    to.iter_mut().zip(of).for_each(|(to, x)| *to -= factor * x);
}

fn transposed(block: &Matrix6) -> Matrix6 {
    std::array::from_fn(|i| std::array::from_fn(|j| block[j][i]))
}

/// The lower triangle whose square it is.
fn cholesky(matrix: &Matrix6) -> Option<Matrix6> {
    let mut root = ZERO;
    for i in 0..6 {
        for j in 0..=i {
            let sum = matrix[i][j] - (0..j).map(|k| root[i][k] * root[j][k]).sum::<f64>();
            if i == j {
                if !(sum > 0.0) {
                    return None;
                }
                root[i][i] = sum.sqrt();
            } else {
                root[i][j] = sum / root[j][j];
            }
        }
    }
    Some(root)
}

/// `block * root^-T`.
fn divided(block: &Matrix6, root: &Matrix6) -> Matrix6 {
    let mut out = ZERO;
    for (to, row) in out.iter_mut().zip(block) {
        for j in 0..6 {
            to[j] = (row[j] - (0..j).map(|k| to[k] * root[j][k]).sum::<f64>()) / root[j][j];
        }
    }
    out
}

/// `target -= left * right^T`.
fn subtract(target: &mut Matrix6, left: &Matrix6, right: &Matrix6) {
    for (to, a) in target.iter_mut().zip(left) {
        for (to, b) in to.iter_mut().zip(right) {
            *to -= a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Theorem: what is solved is solved, in whatever order scans were eliminated.
        #[test]
        fn a_solution_is_one(
            count in 1..9_usize,
            pairs in prop::collection::vec((0..9_usize, 0..9_usize, prop::array::uniform12(-1.0..1.0_f64)), 0..40),
            right in prop::collection::vec(prop::array::uniform6(-1.0..1.0_f64), 9),
        ) {
            let mut system = BlockSystem::new(count);
            let mut dense = vec![vec![0.0; 6 * count]; 6 * count];
            for k in 0..6 * count {
                system.diagonal[k / 6][k % 6][k % 6] += 0.5;
                dense[k][k] += 0.5;
            }
            for (a, b, row) in pairs {
                let (a, b) = (a % count, b % count);
                if a == b {
                    continue;
                }
                let part = |x: usize, y: usize| -> Matrix6 {
                    std::array::from_fn(|i| std::array::from_fn(|j| row[6 * x + i] * row[6 * y + j]))
                };
                for (x, scan) in [a, b].into_iter().enumerate() {
                    for (y, other) in [a, b].into_iter().enumerate() {
                        if scan == other || x > y {
                            system.add(scan, other, &part(x, y));
                        }
                        for i in 0..6 {
                            for j in 0..6 {
                                dense[6 * scan + i][6 * other + j] += part(x, y)[i][j];
                            }
                        }
                    }
                }
            }
            let x = system.factor().unwrap().solve(&right[..count]);
            for (k, row) in dense.iter().enumerate() {
                let product: f64 = row.iter().enumerate().map(|(j, a)| a * x[j / 6][j % 6]).sum();
                prop_assert!((product - right[k / 6][k % 6]).abs() < 1e-9);
            }
        }
    }
}
