//! The fill joined to the measured border: bridges, then hole filling between them. Whatever crosses is taken away and closed anew.

use glam::DVec3;
use rustc_hash::{FxHashMap, FxHashSet};

use base::error::Result;
use base::progress::Progress;
use mesh::TriMesh;
use mesh::holes;

use super::surface::Surface;
use super::{bridge, crossing, cut};

/// Times that fills that cross something, or stayed open, are taken away and closed anew.
const REPAIRS: usize = 4;
/// A loop of more edges is tried so often as a whole. It takes long, and is cut in parts later.
const LONG: usize = 64;
const TRIES: u32 = 2;

/// A surface that grows: measured vertices and triangles first, untouched.
#[derive(Clone)]
pub struct Growing {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// Numbers of measured vertices and triangles.
    pub measured: [usize; 2],
    /// Edges of the measured border, each in the direction of its triangle, and that triangle.
    border: Vec<([u32; 2], [u32; 3])>,
    /// Of each triangle, as long as its corners stay. Triangles beyond its end are new.
    known: Vec<Known>,
    /// Times that each long loop could not be closed, by its smallest vertex and its edges.
    failed: FxHashMap<(u32, usize), u32>,
}

/// Facts about a filled triangle that need not be found twice.
#[derive(Clone, Copy, Default)]
struct Known {
    /// It crosses no other that it was known beside.
    is_clear: bool,
    /// It does not lie in seen space.
    is_unseen: bool,
}

impl Growing {
    /// The measured surface with a fill beside it.
    pub fn new(surface: &Surface<'_>, fill: &TriMesh) -> Self {
        let measured = surface.mesh;
        let count = measured.positions.len() as u32;
        let counts = [measured.positions.len(), measured.triangles.len()];
        let positions = [&measured.positions[..], &fill.positions].concat();
        let shifted = fill.triangles.iter().map(|t| t.map(|v| v + count));
        let triangles = measured.triangles.iter().copied().chain(shifted).collect();
        Growing {
            positions,
            triangles,
            measured: counts,
            border: surface.border(),
            known: Vec::new(),
            failed: FxHashMap::default(),
        }
    }

    /// Edges that are open now, in the direction of their triangles: of the measured border and of the fill.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn open_edges(&self, progress: &Progress<'_>) -> Result<Vec<[u32; 2]>> {
        self.open_beside(&self.triangles[self.measured[1]..], progress)
    }

    fn open_beside(&self, filled: &[[u32; 3]], progress: &Progress<'_>) -> Result<Vec<[u32; 2]>> {
        let sides = filled.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        cut::unpaired(self.border.iter().map(|border| border.0).chain(sides).collect(), progress)
    }

    /// Whether a triangle was filled.
    pub fn is_filled(&self, triangle: usize) -> bool {
        triangle >= self.measured[1]
    }

    /// Whether a triangle is known to lie out of seen space, with the tolerance of [`super::retreat::retreat`].
    pub fn is_unseen(&self, triangle: usize) -> bool {
        self.known.get(triangle).is_some_and(|known| known.is_unseen)
    }

    /// Takes note of the triangles that lie out of seen space.
    pub fn set_unseen(&mut self, seen: &[bool]) {
        self.known.resize(self.triangles.len(), Known::default());
        self.known.iter_mut().zip(seen).for_each(|(known, seen)| known.is_unseen = !seen);
    }

    /// Nothing is known any longer of triangles with vertices that moved.
    pub fn forget_around(&mut self, is_moved: &[bool]) {
        for (known, t) in self.known.iter_mut().zip(&self.triangles) {
            if t.iter().any(|&v| is_moved[v as usize]) {
                *known = Known::default();
            }
        }
    }

    /// Pairs of triangles that cross, with a filled one each.
    fn crossing(&self, progress: &Progress<'_>) -> Result<Vec<[u32; 2]>> {
        let is_clear = |t: usize| self.known.get(t).is_some_and(|known| known.is_clear);
        crossing::pairs(&self.positions, &self.triangles, |t| self.is_filled(t) && !is_clear(t), progress)
    }

    /// Takes note that no two triangles cross.
    fn set_clear(&mut self) {
        self.known.resize(self.triangles.len(), Known::default());
        self.known.iter_mut().for_each(|known| known.is_clear = true);
    }

    /// The vertices and triangles that are filled by now.
    pub fn filled(&self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        (self.positions[self.measured[0]..].to_vec(), self.triangles[self.measured[1]..].to_vec())
    }

    /// Goes back to what was filled before.
    pub fn restore(&mut self, (positions, triangles): (Vec<DVec3>, Vec<[u32; 3]>)) {
        self.positions.truncate(self.measured[0]);
        self.positions.extend(positions);
        self.triangles.truncate(self.measured[1]);
        self.triangles.extend(triangles);
        self.known.truncate(self.measured[1]);
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.positions[v as usize])
    }

    /// Takes filled triangles away that are marked, and those around vertices that are left with several fans. Returns the numbers that
    /// the triangles which stay had before.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn take_away(&mut self, goes: &[bool], progress: &Progress<'_>) -> Result<Vec<u32>> {
        let first = self.measured[1];
        let filled = first as u32..self.triangles.len() as u32;
        let mut kept: Vec<u32> = filled.filter(|&t| !goes[t as usize]).collect();
        loop {
            let triangles: Vec<[u32; 3]> = kept.iter().map(|&t| self.triangles[t as usize]).collect();
            let mut leaving: FxHashMap<u32, u32> = FxHashMap::default();
            for [from, _] in self.open_beside(&triangles, progress)? {
                *leaving.entry(from).or_default() += 1;
            }
            let is_single = |v: &u32| leaving.get(v).is_none_or(|&count| count < 2);
            let before = kept.len();
            kept.retain(|&t| self.triangles[t as usize].iter().all(is_single));
            if kept.len() == before {
                self.triangles.truncate(first);
                self.triangles.extend(triangles);
                let kept: Vec<u32> = (0..first as u32).chain(kept).collect();
                self.known = kept.iter().map(|&t| self.known.get(t as usize).copied().unwrap_or_default()).collect();
                return Ok(kept);
            }
        }
    }

    /// Takes the filled triangles around marked vertices away.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn take_away_around(&mut self, is_marked: &[bool], progress: &Progress<'_>) -> Result<()> {
        let goes: Vec<bool> = self.triangles.iter().map(|t| t.iter().any(|&v| is_marked[v as usize])).collect();
        self.take_away(&goes, progress).map(drop)
    }

    /// Bridges the gaps between the measured border and the fill, and closes what is left of them.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn join(&mut self, cell: f64, progress: &Progress<'_>) -> Result<()> {
        let border = self.open_with_triangles(progress)?;
        let bridges = bridge::gaps(&self.positions, &self.triangles, &border, self.measured[0] as u32, cell, progress)?;
        self.triangles.extend(bridges);
        self.close_loops(progress)?;
        self.repair(progress)
    }

    /// Fills every loop that can be filled without crossing anything.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn close_loops(&mut self, progress: &Progress<'_>) -> Result<holes::HoleReport> {
        let border = self.open_edges(progress)?;
        let is_tried = |vertices: &[u32]| {
            let times = self.failed.get(&(vertices[0], vertices.len()));
            vertices.len() > LONG && times.is_some_and(|&times| times >= TRIES)
        };
        let limit = |vertices: &[u32]| if is_tried(vertices) { f64::NEG_INFINITY } else { f64::INFINITY };
        let report = holes::close(&mut self.positions, &mut self.triangles, &border, limit, 0.0, progress)?;
        for open in &report.open {
            *self.failed.entry((open.vertex, open.edges)).or_default() += 1;
        }
        Ok(report)
    }

    /// Takes fills that cross something away, with all around them, and closes the loops anew. The same around loops that stayed open.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn repair(&mut self, progress: &Progress<'_>) -> Result<()> {
        for _ in 0..REPAIRS {
            let crossing = self.crossing(progress)?;
            let open = self.open_edges(progress)?;
            if crossing.is_empty() && open.is_empty() {
                self.set_clear();
                return Ok(());
            }
            let mut is_bad = vec![false; self.positions.len()];
            let bad = crossing.iter().flatten().flat_map(|&t| self.triangles[t as usize]);
            bad.chain(open.iter().flatten().copied()).for_each(|v| is_bad[v as usize] = true);
            self.take_away_around(&is_bad, progress)?;
            self.set_clear();
            self.close_loops(progress)?;
        }
        let crossing = self.crossing(progress)?;
        let mut goes = vec![false; self.triangles.len()];
        crossing.iter().flatten().for_each(|&t| goes[t as usize] = true);
        if !crossing.is_empty() {
            self.take_away(&goes, progress)?;
        }
        self.set_clear();
        Ok(())
    }

    /// Takes marked triangles and all filled ones around their corners away, and closes the loops anew.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn close_anew_around(&mut self, marked: &[bool], progress: &Progress<'_>) -> Result<()> {
        let mut is_bad = vec![false; self.positions.len()];
        let corners = self.triangles.iter().zip(marked).filter(|(_, marked)| **marked).flat_map(|(t, _)| t);
        corners.for_each(|&v| is_bad[v as usize] = true);
        self.take_away_around(&is_bad, progress)?;
        self.close_loops(progress).map(drop)
    }

    /// The open edges with their triangles.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn open_with_triangles(&self, progress: &Progress<'_>) -> Result<Vec<([u32; 2], [u32; 3])>> {
        let mut of: FxHashMap<[u32; 2], [u32; 3]> = self.border.iter().copied().collect();
        for &[a, b, c] in &self.triangles[self.measured[1]..] {
            of.extend([[a, b], [b, c], [c, a]].map(|edge| (edge, [a, b, c])));
        }
        Ok(self.open_edges(progress)?.into_iter().map(|edge| (edge, of[&edge])).collect())
    }

    /// Drops filled triangles that hang together with no measured one.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn drop_loose(&mut self, progress: &Progress<'_>) -> Result<()> {
        let (piece, count) = cut::pieces(&self.triangles[self.measured[1]..], progress)?;
        let on_border: FxHashSet<[u32; 2]> = self.border.iter().map(|border| border.0).collect();
        let mut is_held = vec![false; count];
        for (&[a, b, c], &piece) in self.triangles[self.measured[1]..].iter().zip(&piece) {
            is_held[piece as usize] |= [[b, a], [c, b], [a, c]].iter().any(|edge| on_border.contains(edge));
        }
        let measured = std::iter::repeat_n(false, self.measured[1]);
        let goes: Vec<bool> = measured.chain(piece.iter().map(|&piece| !is_held[piece as usize])).collect();
        self.take_away(&goes, progress).map(drop)
    }

    /// Drops filled vertices that no triangle uses. Numbers the others in the order of their triangles.
    pub fn drop_unused(&mut self) {
        let measured = self.measured[0];
        let mut number = vec![u32::MAX; self.positions.len()];
        let mut positions = self.positions[..measured].to_vec();
        (0..measured).for_each(|v| number[v] = v as u32);
        for v in self.triangles.iter_mut().flatten() {
            if number[*v as usize] == u32::MAX {
                number[*v as usize] = positions.len() as u32;
                positions.push(self.positions[*v as usize]);
            }
            *v = number[*v as usize];
        }
        self.positions = positions;
    }
}
