//! Creases: where the surface bends sharply along a line. Patches are drawn onto them, so that edges run along them and nodes stay on them.
//! Ours: the paper's patches know no creases.
//!
//! An edge is sharp if its triangles turn by more than the angle asked for, and so do, nearly, the means of the triangles of a few rings on
//! either side. The means of noise are alike. Sharp edges that make runs of a few edges of the net are creases. Shorter runs are detail
//! that the net can't show. A patch with a piece of a crease has its centre there, at a corner if there is one. The line between two such
//! patches has a node where the crease crosses it. So the crease is a path of edges from centre to centre by construction, whatever the
//! surface's topology, and fans stay fans.

use std::collections::BTreeSet;

use glam::DVec3;
use rayon::prelude::*;

use super::kmeans::KMeans;
use super::surface::{CORNER as FIXED, area_vector};
use super::surface::{NONE, Surface, looking};
use base::error::Result;
use base::progress::Progress;

/// The means of both sides turn by at least this share of the angle: they reach into what bends beside the edge.
const SIDES: f64 = 0.7;
/// Rings of triangles in the means of the sides.
const RINGS: u32 = 3;
/// Least length of a crease, in edges of the net, ...
const LEAST: f64 = 3.0;
/// ... and of a branch that ends freely.
const LEAST_BRANCH: f64 = 1.0;
/// Cosine of the turn from which a crease has a corner: 45 degrees.
const CORNER: f64 = 0.7;
/// Rounds in which branches of branches go.
const PRUNINGS: usize = 16;
/// Distance from a corner within which its turn is measured, and no other is, in edges of the net.
const REACH: f64 = 0.5;
/// Area of a patch in squares of the net's edges: a hexagon.
const PATCH: f64 = 2.6;
/// Lloyd steps that draw centres onto creases.
const STEPS: usize = 4;
/// Rounds of such steps. In between, corners that have no patch of their own get one.
const ROUNDS: usize = 3;
/// Vertices of a crease that another patch keeps on each side, at most.
const REGAINS: usize = 4;
/// Edges looked at between two looks at the progress.
const CHUNK: usize = 1024;
/// Steps along a crease from where a node is.
const WALK: usize = 256;

/// The sharp edges of a surface, each by its first half-edge.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn sharp_edges(surface: &Surface, angle: f64, progress: &Progress<'_>) -> Result<Vec<u32>> {
    if !(angle > 0.0) {
        return Ok(Vec::new());
    }
    let (bend, sides_bend) = (angle.cos(), (SIDES * angle).cos());
    let mut edges = Vec::new();
    for h in 0..surface.twins.len() as u32 {
        looking(h, progress)?;
        let twin = surface.twins[h as usize];
        if twin == NONE || twin < h {
            continue;
        }
        let [a, b] = [h, twin].map(|h| area_vector(surface.corners(h / 3)).normalize_or_zero());
        if a != DVec3::ZERO && b != DVec3::ZERO && a.dot(b) < bend {
            edges.push(h);
        }
    }
    let mut bends = vec![false; edges.len()];
    bends.par_chunks_mut(CHUNK).zip(edges.par_chunks(CHUNK)).try_for_each(|(bends, edges)| {
        for (bends, &h) in bends.iter_mut().zip(edges) {
            *bends = sides_turn(surface, h) < sides_bend;
        }
        progress.check()
    })?;
    let mut bends = bends.into_iter();
    edges.retain(|_| bends.next() == Some(true));
    Ok(edges)
}

/// Cosine of the angle between the mean normals on the two sides of an edge: of the triangles that are reached from either first.
fn sides_turn(surface: &Surface, h: u32) -> f64 {
    let mut sums = [DVec3::ZERO; 2];
    let mut seen = vec![h / 3, surface.twins[h as usize] / 3];
    let mut front = 0..2;
    let mut sides = vec![0, 1];
    for _ in 0..=RINGS {
        let end = seen.len();
        for i in front {
            let (t, side) = (seen[i], sides[i]);
            sums[side] += area_vector(surface.corners(t));
            for k in 0..3 {
                let twin = surface.twins[(3 * t + k) as usize];
                if twin != NONE && !seen.contains(&(twin / 3)) {
                    seen.push(twin / 3);
                    sides.push(side);
                }
            }
        }
        front = end..seen.len();
    }
    sums[0].normalize_or_zero().dot(sums[1].normalize_or_zero())
}

/// The creases that a net of a certain size shows.
#[derive(Default)]
pub struct Creases {
    /// Half-edges along creases, both of each edge, by the vertices that they leave, in order.
    leaving: Vec<(u32, u32)>,
    /// Vertices where creases meet, end or turn, in order.
    corners: Vec<u32>,
}

impl Creases {
    /// Creases of `sharp` edges for about `patches` patches.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn of(surface: &Surface, sharp: &[u32], patches: usize, progress: &Progress<'_>) -> Result<Self> {
        let area: f64 = surface.areas.iter().sum();
        let spacing = (area / (PATCH * patches.max(1) as f64)).sqrt();
        let both = sharp.iter().flat_map(|&h| [h, surface.twins[h as usize]]);
        let mut creases = Creases { leaving: both.map(|h| (surface.from(h), h)).collect(), corners: Vec::new() };
        creases.leaving.sort_unstable();
        creases.drop_branches(surface, LEAST_BRANCH * spacing, progress)?;
        creases.drop_short(surface, LEAST * spacing);
        progress.check()?;
        creases.find_corners(surface, REACH * spacing);
        Ok(creases)
    }

    pub fn is_empty(&self) -> bool {
        self.leaving.is_empty()
    }

    /// Half-edges of creases that leave a vertex.
    fn at(&self, v: u32) -> &[(u32, u32)] {
        let start = self.leaving.partition_point(|l| l.0 < v);
        let rest = &self.leaving[start..];
        &rest[..rest.iter().take_while(|l| l.0 == v).count()]
    }

    /// Vertices on creases, in order.
    fn vertices(&self) -> impl Iterator<Item = u32> {
        self.leaving.chunk_by(|a, b| a.0 == b.0).map(|at| at[0].0)
    }

    fn is_corner(&self, v: u32) -> bool {
        self.corners.binary_search(&v).is_ok()
    }

    /// Way along which a node at a vertex slides: along this half-edge, or not at all.
    pub fn way(&self, v: u32) -> u32 {
        match self.at(v) {
            [] => NONE,
            _ if self.is_corner(v) => FIXED,
            [first, ..] => first.1,
        }
    }

    /// The half-edge of the crease after `h`, unless it has a corner there.
    fn after(&self, surface: &Surface, h: u32) -> Option<u32> {
        let v = surface.to(h);
        if self.is_corner(v) {
            return None;
        }
        self.onward(surface, h)
    }

    /// The half-edge after `h`, at a vertex that has no third one.
    fn onward(&self, surface: &Surface, h: u32) -> Option<u32> {
        match self.at(surface.to(h)) {
            [one, other] if one.1 == surface.twins[h as usize] => Some(other.1),
            [one, other] if other.1 == surface.twins[h as usize] => Some(one.1),
            _ => None,
        }
    }

    /// The closest point to `p` along the crease from half-edge `start`, and the half-edge it lies on.
    pub fn walk(&self, surface: &Surface, p: DVec3, start: u32) -> (DVec3, u32) {
        let mut best = surface.on_half_edge(p, start);
        let mut at = start;
        for _ in 0..WALK {
            let twin = |h: u32| surface.twins[h as usize];
            let step = match best.1 {
                t if t >= 1.0 => self.after(surface, at),
                t if t <= 0.0 => self.after(surface, twin(at)),
                _ => None,
            };
            let Some(step) = step else { break };
            let other = surface.on_half_edge(p, step);
            if other.0.distance_squared(p) >= best.0.distance_squared(p) {
                break;
            }
            (best, at) = (other, step);
        }
        (best.0, at)
    }

    fn retain(&mut self, surface: &Surface, gone: &[u32]) {
        let mut gone: Vec<u32> = gone.iter().flat_map(|&h| [h, surface.twins[h as usize]]).collect();
        gone.sort_unstable();
        self.leaving.retain(|l| gone.binary_search(&l.1).is_err());
    }

    /// Drops branches below `least` that end freely where others go on.
    fn drop_branches(&mut self, surface: &Surface, least: f64, progress: &Progress<'_>) -> Result<()> {
        for _ in 0..PRUNINGS {
            progress.check()?;
            let mut gone = Vec::new();
            for end in self.leaving.chunk_by(|a, b| a.0 == b.0).filter(|at| at.len() == 1) {
                let (mut branch, mut passed) = (vec![end[0].1], 0.0);
                loop {
                    let h = branch[branch.len() - 1];
                    passed += length(surface, h);
                    match self.onward(surface, h) {
                        Some(next) if passed < least => branch.push(next),
                        _ => break,
                    }
                }
                let last = surface.to(branch[branch.len() - 1]);
                if passed < least && self.at(last).len() > 2 && !surface.on_border(end[0].0) {
                    gone.extend(branch);
                }
            }
            if gone.is_empty() {
                break;
            }
            self.retain(surface, &gone);
        }
        Ok(())
    }

    /// Drops all runs whose edges are shorter than `least` together, or that reach no farther than half of it.
    fn drop_short(&mut self, surface: &Surface, least: f64) {
        let runs = Runs::of(self, surface, |_, _| true);
        let mut lengths = vec![0.0; runs.vertices.len()];
        let mut boxes = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); runs.vertices.len()];
        for &(v, h) in &self.leaving {
            let (run, p) = (runs.run(v) as usize, surface.points[v as usize]);
            lengths[run] += 0.5 * length(surface, h);
            boxes[run] = (boxes[run].0.min(p), boxes[run].1.max(p));
        }
        let shows = |run: usize| lengths[run] >= least && 2.0 * boxes[run].0.distance(boxes[run].1) >= least;
        self.leaving.retain(|l| shows(runs.run(l.0) as usize));
    }

    /// Corners: where not two edges meet, and where two do and turn, the sharpest first, no other within `reach` of it.
    fn find_corners(&mut self, surface: &Surface, reach: f64) {
        let along = |mut h: u32, visit: &mut dyn FnMut(u32)| {
            let mut passed = 0.0;
            for _ in 0..WALK {
                visit(surface.to(h));
                passed += length(surface, h);
                match self.onward(surface, h) {
                    Some(next) if passed < reach => h = next,
                    _ => break,
                }
            }
            surface.points[surface.to(h) as usize]
        };
        let mut turns = Vec::new();
        for at in self.leaving.chunk_by(|a, b| a.0 == b.0) {
            let v = at[0].0;
            let here = surface.points[v as usize];
            match at {
                [one, other] => {
                    let [p, q] = [one.1, other.1].map(|h| (along(h, &mut |_| {}) - here).normalize_or_zero());
                    if -p.dot(q) < CORNER {
                        turns.push((-p.dot(q), v));
                    }
                }
                _ => turns.push((f64::NEG_INFINITY, v)),
            }
        }
        turns.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let (mut corners, mut near) = (Vec::new(), BTreeSet::new());
        for (turn, v) in turns {
            if turn > f64::NEG_INFINITY && near.contains(&v) {
                continue;
            }
            self.at(v).iter().for_each(|l| {
                along(l.1, &mut |w| {
                    near.insert(w);
                });
            });
            corners.push(v);
        }
        corners.sort_unstable();
        self.corners = corners;
    }

    /// Draws the centres of patches with a piece of a crease onto it, and gives corners patches of their own.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn attract(&self, surface: &Surface, kmeans: &mut KMeans<'_>, progress: &Progress<'_>) -> Result<()> {
        for round in 0..ROUNDS {
            for _ in 0..STEPS {
                kmeans.move_centres();
                let pieces = Pieces::of(self, surface, &kmeans.labels, kmeans.centres.len());
                for (centre, piece) in kmeans.centres.iter_mut().zip(&pieces.chosen) {
                    if let Some(piece) = piece {
                        *centre = piece.middle;
                    }
                }
                kmeans.assign(progress)?;
            }
            if round + 1 == ROUNDS {
                break;
            }
            let pieces = Pieces::of(self, surface, &kmeans.labels, kmeans.centres.len());
            let before = kmeans.centres.len();
            let mut given = vec![false; before];
            for &v in &self.corners {
                let label = kmeans.labels[v as usize] as usize;
                let own = pieces.chosen[label].as_ref().is_some_and(|p| p.centre == v);
                if !own && !given[label] {
                    given[label] = true;
                    kmeans.centres.push(surface.points[v as usize]);
                }
            }
            if kmeans.centres.len() == before {
                break;
            }
            kmeans.assign(progress)?;
        }
        self.regain(surface, &mut kmeans.labels, kmeans.centres.len());
        Ok(())
    }

    /// Gives vertices on creases that lie in a patch with another piece to the next patch along the crease.
    fn regain(&self, surface: &Surface, labels: &mut [u32], patches: usize) {
        for _ in 0..REGAINS {
            let pieces = Pieces::of(self, surface, labels, patches);
            let mut given = Vec::new();
            for at in self.leaving.chunk_by(|a, b| a.0 == b.0) {
                let v = at[0].0;
                if !pieces.has(v, labels[v as usize]) {
                    let beside = |l: &(u32, u32)| {
                        let w = surface.to(l.1);
                        pieces.has(w, labels[w as usize]).then(|| labels[w as usize])
                    };
                    given.extend(at.iter().filter_map(beside).min().map(|label| (v, label)));
                }
            }
            if given.is_empty() {
                break;
            }
            given.into_iter().for_each(|(v, label)| labels[v as usize] = label);
        }
    }
}

fn length(surface: &Surface, h: u32) -> f64 {
    surface.points[surface.from(h) as usize].distance(surface.points[surface.to(h) as usize])
}

/// Vertices on creases that are joined by edges of these.
struct Runs {
    vertices: Vec<u32>,
    /// Place in `vertices` of the first of each one's run.
    leaders: Vec<u32>,
}

impl Runs {
    /// Runs by the edges that `joins` allows.
    fn of(creases: &Creases, surface: &Surface, joins: impl Fn(u32, u32) -> bool) -> Self {
        let vertices: Vec<u32> = creases.vertices().collect();
        let mut leaders: Vec<u32> = (0..vertices.len() as u32).collect();
        fn find(leaders: &mut [u32], mut i: u32) -> u32 {
            while leaders[i as usize] != i {
                leaders[i as usize] = leaders[leaders[i as usize] as usize];
                i = leaders[i as usize];
            }
            i
        }
        let place = |v: u32| vertices.partition_point(|&w| w < v) as u32;
        for &(v, h) in &creases.leaving {
            let w = surface.to(h);
            if v < w && joins(v, w) {
                let (a, b) = (find(&mut leaders, place(v)), find(&mut leaders, place(w)));
                leaders[a.max(b) as usize] = a.min(b);
            }
        }
        for i in 0..leaders.len() as u32 {
            leaders[i as usize] = find(&mut leaders, i);
        }
        Runs { vertices, leaders }
    }

    fn run(&self, v: u32) -> u32 {
        self.leaders[self.vertices.partition_point(|&w| w < v)]
    }
}

/// A piece of a crease in a patch.
pub struct Piece {
    run: u32,
    /// Its corner, or its mean.
    middle: DVec3,
    /// The vertex nearest to that.
    pub centre: u32,
}

/// The piece of a crease in each patch: the longest of those with a corner, or of all.
pub struct Pieces<'a> {
    pub creases: &'a Creases,
    runs: Runs,
    pub chosen: Vec<Option<Piece>>,
}

impl<'a> Pieces<'a> {
    pub fn of(creases: &'a Creases, surface: &Surface, labels: &[u32], patches: usize) -> Self {
        let label = |v: u32| labels[v as usize];
        let runs = Runs::of(creases, surface, |v, w| label(v) == label(w));
        let mut sums = vec![(0.0, DVec3::ZERO, false); runs.vertices.len()];
        for &(v, h) in &creases.leaving {
            let sum = &mut sums[runs.run(v) as usize];
            sum.0 += length(surface, h);
            sum.1 += surface.points[v as usize] * length(surface, h);
        }
        let inner = |v: u32| !surface.on_border(v);
        for &v in creases.corners.iter().filter(|&&v| inner(v)) {
            sums[runs.run(v) as usize].2 = true;
        }
        let mut best: Vec<Option<u32>> = vec![None; patches];
        for (i, &v) in (0..).zip(&runs.vertices) {
            if runs.leaders[i as usize] == i {
                let slot = &mut best[label(v) as usize];
                let rank = |run: u32| (sums[run as usize].2, sums[run as usize].0);
                if slot.is_none_or(|run| rank(i) > rank(run)) {
                    *slot = Some(i);
                }
            }
        }
        // The vertex nearest to the mean; a corner, where there is one.
        let mut nearest = vec![(f64::INFINITY, NONE); runs.vertices.len()];
        for &v in runs.vertices.iter().filter(|&&v| inner(v)) {
            let run = runs.run(v) as usize;
            let (weight, sum, has_corner) = sums[run];
            if !has_corner || creases.is_corner(v) {
                let squared = surface.points[v as usize].distance_squared(sum / weight);
                if squared < nearest[run].0 {
                    nearest[run] = (squared, v);
                }
            }
        }
        let piece = |run: u32| {
            let ((weight, sum, has_corner), centre) = (sums[run as usize], nearest[run as usize].1);
            if centre == NONE {
                return None;
            }
            let middle = if has_corner { surface.points[centre as usize] } else { sum / weight };
            Some(Piece { run, middle, centre })
        };
        let chosen = best.into_iter().map(|run| run.and_then(piece)).collect();
        Pieces { creases, runs, chosen }
    }

    /// Whether a vertex lies on its patch's piece.
    pub fn has(&self, v: u32, label: u32) -> bool {
        let chosen = &self.chosen[label as usize];
        !self.creases.at(v).is_empty() && chosen.as_ref().is_some_and(|piece| piece.run == self.runs.run(v))
    }

    /// Whether an edge between two patches joins their pieces.
    pub fn joins(&self, surface: &Surface, labels: &[u32], h: u32) -> bool {
        let (v, w) = (surface.from(h), surface.to(h));
        self.creases.leaving.binary_search(&(v, h)).is_ok()
            && self.has(v, labels[v as usize])
            && self.has(w, labels[w as usize])
    }
}
