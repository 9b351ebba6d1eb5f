//! From pairs of like points to motions that many of them agree on.
//!
//! Two pairs agree if the points lie equally far apart in both scans and their normals make the same angles with the line between
//! them and with each other: four numbers that no motion changes (point pair features, Drost et al. 2010). Motions are
//! sought around the edges of that graph with most common neighbours (second-order compatibility, Chen et al., "SC2-PCR", CVPR 2022,
//! with pivots of 3-cliques as in Yan et al., "TurboReg", 2025), each fitted to what agrees with it. Nothing is drawn at random.

use glam::{DAffine3, DVec3};

use crate::correspond::Match;
use crate::features::Features;
use crate::linear::apart;
use crate::view::View;
use geom::rigid_fit::RigidFit;

/// Largest difference of distances, in cells.
const DISTANCE: f64 = 1.2;
/// Least distance of two points that fix a motion, in cells.
const APART: f64 = 4.0;
/// Largest difference of cosines of angles between normals and lines.
const COSINE: f64 = 0.3;
/// Points closer than this after the motion agree with it, in cells.
const INLIER: f64 = 1.5;
/// Members of a clique that a motion is first fitted to.
const CLIQUE: usize = 12;

/// How many pivots are tried for a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Effort {
    Quick = 64,
    Thorough = 400,
}

/// Two oriented points of different scans.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Like {
    pub points: [DVec3; 2],
    pub normals: [DVec3; 2],
}

impl Like {
    pub fn of(views: [&View; 2], m: &Match) -> Self {
        Like::of_features(views, views.map(|view| view.features()), m)
    }

    pub fn of_features(views: [&View; 2], features: [&Features; 2], m: &Match) -> Self {
        let [i, j] = [features[0].points[m.a as usize] as usize, features[1].points[m.b as usize] as usize];
        let [a, b] = views.map(|view| &view.coarse);
        Like { points: [a.points[i], b.points[j]], normals: [a.normals[i], b.normals[j]] }
    }
}

/// A motion from the second scan's frame to the first's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hypothesis {
    pub a_from_b: DAffine3,
    /// Pairs that agree with it.
    pub inliers: usize,
}

/// Rows of bits.
struct Graph {
    words: usize,
    bits: Vec<u64>,
}

impl Graph {
    fn new(likes: &[Like], cell: f64) -> Self {
        let words = likes.len().div_ceil(64);
        let mut graph = Graph { words, bits: vec![0; words * likes.len()] };
        let places = Places::new(likes);
        let mut squares = vec![[0.0; 2]; likes.len()];
        for (i, first) in likes.iter().enumerate() {
            places.squares(first, &mut squares[..i]);
            for (j, second) in likes[..i].iter().enumerate() {
                if may_agree(squares[j], cell) && agree(first, second, cell) {
                    graph.bits[i * words + j / 64] |= 1 << (j % 64);
                    graph.bits[j * words + i / 64] |= 1 << (i % 64);
                }
            }
        }
        graph
    }

    fn row(&self, i: usize) -> &[u64] {
        &self.bits[i * self.words..][..self.words]
    }

    fn common(&self, i: usize, j: usize) -> u32 {
        self.row(i).iter().zip(self.row(j)).map(|(a, b)| (a & b).count_ones()).sum()
    }
}

/// Whether distances may be equally far, without their roots: most are not. Exact but for rounding, for which there is slack.
#[inline(always)]
fn may_agree([a2, b2]: [f64; 2], cell: f64) -> bool {
    let off = a2 + b2 - 1.001 * DISTANCE * DISTANCE * cell * cell;
    off <= 0.0 || off * off <= 4.0 * a2 * b2
}

/// The points of likes by coordinates, so that many distances are found at once.
struct Places([[Vec<f64>; 3]; 2]);

impl Places {
    fn new(likes: &[Like]) -> Self {
        Places([0, 1].map(|side| [0, 1, 2].map(|axis| likes.iter().map(|like| like.points[side][axis]).collect())))
    }

    /// Squares of the distances of the first points from those of another, in both scans.
    fn squares(&self, from: &Like, squares: &mut [[f64; 2]]) {
        let count = squares.len();
        for side in 0..2 {
            let [x, y, z] = &self.0[side];
            let (x, y, z) = (&x[..count], &y[..count], &z[..count]);
            let p = from.points[side];
            for k in 0..count {
                let (x, y, z) = (x[k] - p.x, y[k] - p.y, z[k] - p.z);
                squares[k][side] = x * x + y * y + z * z;
            }
        }
    }
}

#[inline(always)]
fn agree(first: &Like, second: &Like, cell: f64) -> bool {
    let (a, b) = (second.points[0] - first.points[0], second.points[1] - first.points[1]);
    let (a2, b2) = (a.length_squared(), b.length_squared());
    let least = APART * APART * cell * cell;
    if a2 < least || b2 < least {
        return false;
    }
    let (la, lb) = (a2.sqrt(), b2.sqrt());
    if (la - lb).abs() > DISTANCE * cell {
        return false;
    }
    let near = |x: f64, y: f64| (x - y).abs() < COSINE;
    near(first.normals[0].dot(a) / la, first.normals[1].dot(b) / lb)
        && near(second.normals[0].dot(a) / la, second.normals[1].dot(b) / lb)
        && near(first.normals[0].dot(second.normals[0]), first.normals[1].dot(second.normals[1]))
}

fn bits(row: impl Iterator<Item = u64>) -> impl Iterator<Item = usize> {
    row.enumerate().flat_map(|(word, mut bits)| {
        std::iter::from_fn(move || {
            (bits != 0).then(|| {
                let bit = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                64 * word + bit
            })
        })
    })
}

/// Motions that pairs of like points agree on, different ones, the best first.
pub(crate) fn hypothesise(likes: &[Like], cell: f64, radius: f64, pivots: usize) -> Vec<Hypothesis> {
    let graph = Graph::new(likes, cell);
    // Of each pair the one that shares most with it.
    let mut edges: Vec<(u32, u32, u32)> = Vec::new();
    for i in 0..likes.len() {
        let best = bits(graph.row(i).iter().copied()).map(|j| (graph.common(i, j), std::cmp::Reverse(j))).max();
        if let Some((common, std::cmp::Reverse(j))) = best.filter(|best| best.0 > 0) {
            edges.push((common, i.max(j) as u32, i.min(j) as u32));
        }
    }
    edges.sort_unstable_by(|x, y| y.0.cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    edges.dedup();
    let mut found: Vec<Hypothesis> = Vec::new();
    let motions =
        edges.iter().take(pivots).filter_map(|&(_, i, j)| around(&graph, likes, i as usize, j as usize, cell));
    for a_from_b in motions {
        if found.iter().any(|known| apart(&known.a_from_b, &a_from_b, radius) < INLIER * cell) {
            continue;
        }
        let inliers = inliers(likes, &a_from_b, INLIER * cell).len();
        if inliers >= 4 {
            found.push(Hypothesis { a_from_b, inliers });
        }
    }
    found.sort_by_key(|hypothesis| std::cmp::Reverse(hypothesis.inliers));
    found
}

/// The motion of an edge and those that agree with both of its ends.
fn around(graph: &Graph, likes: &[Like], i: usize, j: usize, cell: f64) -> Option<DAffine3> {
    let both: Vec<u64> = graph.row(i).iter().zip(graph.row(j)).map(|(a, b)| a & b).collect();
    let mut members: Vec<(u32, usize)> = bits(both.iter().copied())
        .map(|k| (graph.row(k).iter().zip(&both).map(|(a, b)| (a & b).count_ones()).sum(), k))
        .collect();
    members.sort_unstable_by(|x, y| y.0.cmp(&x.0).then(x.1.cmp(&y.1)));
    members.truncate(CLIQUE);
    let first = [i, j].into_iter().chain(members.iter().map(|m| m.1));
    let mut motion = fitted(likes, first, cell)?;
    for _ in 0..3 {
        let agreeing = inliers(likes, &motion, INLIER * cell);
        if agreeing.len() < 3 {
            return None;
        }
        motion = fitted(likes, agreeing.into_iter(), cell)?;
    }
    Some(motion)
}

fn fitted(likes: &[Like], members: impl Iterator<Item = usize>, cell: f64) -> Option<DAffine3> {
    let mut fit = RigidFit::new();
    for k in members {
        let Like { points, normals } = &likes[k];
        fit.point(points[1], points[0], 1.0);
        // A normal is worth as much as a point some cells away.
        fit.direction(normals[1], normals[0], (2.0 * cell) * (2.0 * cell));
    }
    fit.solve()
}

fn inliers(likes: &[Like], a_from_b: &DAffine3, distance: f64) -> Vec<usize> {
    let near = |like: &Like| {
        a_from_b.transform_point3(like.points[1]).distance_squared(like.points[0]) < distance * distance
            && a_from_b.transform_vector3(like.normals[1]).dot(like.normals[0]) > 0.7
    };
    (0..likes.len()).filter(|&k| near(&likes[k])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn like() -> impl Strategy<Value = Like> {
        let place = || prop::array::uniform3(-9.0..9.0_f64).prop_map(DVec3::from);
        (place(), place()).prop_map(|(a, b)| Like { points: [a, b], normals: [DVec3::Z; 2] })
    }

    proptest! {
        /// Theorem: the quick look refuses no two that agree, however close to the limit.
        #[test]
        fn what_agrees_is_looked_at(first in like(), turn in like(), off in -1.0001..1.0001_f64, cell in 0.1..2.0_f64) {
            let [to, way] = turn.points;
            let far = to.distance(first.points[0]) + off * DISTANCE * cell;
            let there = first.points[1] + far * way.normalize_or_zero();
            let second = Like { points: [to, there], normals: [DVec3::Z; 2] };
            let mut squares = [[0.0; 2]];
            Places::new(&[second]).squares(&first, &mut squares);
            prop_assert!(may_agree(squares[0], cell) || !agree(&second, &first, cell));
        }
    }
}
