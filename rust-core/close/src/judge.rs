//! The judge of which fills stay: not those that are not asked for, lie in seen space or turn the surface inside out.

use rustc_hash::FxHashSet;

use base::error::Result;
use base::progress::Progress;
use mesh::measure::area;

use super::openings::{self, Border, Opening};
use super::params::{CloseParams, FILL_CELLS, Openings};
use super::report::{LeftOpen, OpeningReport};
use super::retreat::NearMeasured;
use super::stitch::Growing;
use super::surface::{Surface, normal};
use super::visibility::Envelope;
use super::{cells, fan, retreat, turned};

/// Share of an opening's fill that may lie in seen space and be left open as small holes. Beyond it the opening stays as it was.
const LITTLE: f64 = 0.05;

/// The judge of which fills stay.
pub struct Judge<'a> {
    pub surface: &'a Surface<'a>,
    pub border: &'a Border,
    pub params: &'a CloseParams,
    pub envelope: Envelope<'a>,
    pub strict: Envelope<'a>,
    pub floor: Option<Envelope<'a>>,
    /// The length that fills are looked at and moved by: a cell of the merge.
    pub step: f64,
    /// The longest boundary that is closed.
    pub max_hole_length: Option<f64>,
    /// Whether scans say where nothing is.
    pub has_sight: bool,
}

/// The fills that stay.
pub struct Settled {
    /// Of each face, those that were measured among them.
    pub forced: Vec<bool>,
    /// Faces of fills that are open somewhere, since each way to close them crosses something.
    pub stuck: Vec<bool>,
    pub openings: Vec<OpeningReport>,
}

impl Judge<'_> {
    /// Takes the few faces in seen space away that could not move back, and closes small loops that are open by fans.
    pub fn mend(&self, growing: &mut Growing, progress: &Progress<'_>) -> Result<()> {
        let turned = self.turned(growing, progress)?;
        if turned.contains(&true) {
            growing.take_away(&turned, progress)?;
        }
        if self.params.force {
            return fan::close_loops(growing, self.floor, self.step, progress);
        }
        let seen = retreat::in_seen_space(growing, self.strict, self.step, NearMeasured::Passed, progress)?;
        let mut goes = vec![false; growing.triangles.len()];
        for opening in openings::find(growing, self.border, progress)? {
            let [all, in_seen] = areas(growing, &opening, &seen);
            for &t in opening.triangles.iter().filter(|_| in_seen <= LITTLE * all) {
                goes[t as usize] = seen[t as usize];
            }
        }
        growing.take_away(&goes, progress)?;
        fan::close_loops(growing, Some(self.strict), self.step, progress)
    }

    /// Takes fills away that are not asked for, or lie in seen space.
    pub fn settle(&self, growing: &mut Growing, progress: &Progress<'_>) -> Result<Settled> {
        let beside = if self.params.force { NearMeasured::Asked } else { NearMeasured::Passed };
        let seen = retreat::in_seen_space(growing, self.strict, self.step, beside, progress)?;
        let below = match self.floor {
            Some(floor) => retreat::in_seen_space(growing, floor, self.step, NearMeasured::Passed, progress)?,
            None => vec![false; growing.triangles.len()],
        };
        let found = openings::find(growing, self.border, progress)?;
        let mut goes = vec![false; growing.triangles.len()];
        let mut openings = Vec::new();
        for opening in &found {
            let refused = self.reason(opening, growing, progress)?;
            let [all, in_seen] = areas(growing, opening, &seen);
            let is_seen = !self.params.force && in_seen > 0.0;
            let goes_whole = refused.is_some() || is_seen && in_seen > LITTLE * all;
            for &t in &opening.triangles {
                goes[t as usize] = goes_whole || is_seen && seen[t as usize];
            }
            let is_of_base = opening.triangles.iter().all(|&t| below[t as usize] || !seen[t as usize]);
            let space = if is_of_base { LeftOpen::Base } else { LeftOpen::SeenThrough };
            let reason = refused.or(is_seen.then_some(space));
            openings.push(opening_report(self.border, &opening.loops, reason));
        }
        let kept = growing.take_away(&goes, progress)?;
        let forced = kept.iter().map(|&t| seen[t as usize]).collect();
        let mut settled = Settled { forced, stuck: vec![false; growing.triangles.len()], openings };
        self.count(growing, &mut settled, progress)?;
        self.take_turned_away(growing, &mut settled, progress)?;
        Ok(settled)
    }

    /// Reason why an opening is not to be closed, whatever was seen in it.
    fn reason(&self, opening: &Opening, growing: &Growing, progress: &Progress<'_>) -> Result<Option<LeftOpen>> {
        if opening.triangles.is_empty() {
            return Ok(Some(LeftOpen::Crossing));
        }
        let length: f64 = opening.loops.iter().map(|&number| self.border.loops[number as usize].length).sum();
        if self.max_hole_length.is_some_and(|longest| length > longest) {
            return Ok(Some(LeftOpen::TooLong));
        }
        let is_open = self.params.openings == Openings::Seen
            && !openings::is_enclosed(opening, growing, self.surface, self.envelope, self.step, progress)?;
        Ok(is_open.then_some(LeftOpen::NotEnclosed))
    }

    fn turned(&self, growing: &Growing, progress: &Progress<'_>) -> Result<Vec<bool>> {
        // Over a base nothing is the inside of a thing.
        let over_base = self.params.flat_base.then_some(f64::INFINITY);
        let tolerance = if self.has_sight { Some(self.strict.tolerance) } else { over_base };
        turned::find(growing, tolerance, progress)
    }

    /// Takes fills away that turn the surface inside out.
    fn take_turned_away(&self, growing: &mut Growing, settled: &mut Settled, progress: &Progress<'_>) -> Result<()> {
        let turned = self.turned(growing, progress)?;
        if !turned.contains(&true) {
            return Ok(());
        }
        let of_turned = turned.iter().zip(&growing.triangles).filter(|(turned, _)| **turned);
        let vertices: FxHashSet<u32> = of_turned.flat_map(|(_, corners)| *corners).collect();
        for opening in settled.openings.iter_mut().filter(|opening| vertices.contains(&opening.vertices[0])) {
            let reason = if self.params.flat_base { LeftOpen::Base } else { LeftOpen::InsideOut };
            *opening = OpeningReport { area: 0.0, forced_faces: 0, left_open: Some(reason), ..opening.clone() };
        }
        let kept = growing.take_away(&turned, progress)?;
        settled.forced = kept.iter().map(|&t| settled.forced[t as usize]).collect();
        settled.stuck = kept.iter().map(|&t| settled.stuck[t as usize]).collect();
        Ok(())
    }

    /// Gives the base as the reason, where the surface looks up right above it: no fill has room there.
    pub fn blame_base(&self, openings: &mut [OpeningReport]) {
        let Some(floor) = self.floor else { return };
        let up = self.params.base_up.direction();
        let down = FILL_CELLS * self.step * up;
        let lies_on_base = |t: usize| {
            let corners = self.surface.mesh.corners(t);
            floor.is_seen(corners[0] - down) && normal(corners).dot(up) > cells::LOOKS_UP
        };
        let mut stuck = openings.iter_mut().filter(|opening| opening.left_open == Some(LeftOpen::Crossing)).peekable();
        if stuck.peek().is_some() && (0..self.surface.mesh.triangles.len()).any(lies_on_base) {
            stuck.for_each(|opening| opening.left_open = Some(LeftOpen::Base));
        }
    }

    /// Fills in the areas of what stayed. A fill that has an open edge of its own is not closed.
    fn count(&self, growing: &Growing, settled: &mut Settled, progress: &Progress<'_>) -> Result<()> {
        let found = openings::find(growing, self.border, progress)?;
        let Settled { forced, stuck, openings } = settled;
        let open: FxHashSet<u32> = growing.open_edges(progress)?.into_iter().flatten().collect();
        for opening in &found {
            let vertex = self.border.loops[opening.loops[0] as usize].vertex;
            let Some(of) = openings.iter_mut().find(|of| of.vertices.contains(&vertex)) else { continue };
            let corners = opening.triangles.iter().flat_map(|&t| growing.triangles[t as usize]);
            let is_open = opening.triangles.is_empty() || corners.into_iter().any(|v| open.contains(&v));
            of.area += opening.triangles.iter().map(|&t| area(growing.corners(t as usize))).sum::<f64>();
            of.forced_faces += opening.triangles.iter().filter(|&&t| forced[t as usize]).count();
            if is_open && of.left_open.is_none() {
                of.left_open = Some(LeftOpen::Crossing);
                opening.triangles.iter().for_each(|&t| stuck[t as usize] = true);
            }
        }
        Ok(())
    }
}

/// Of an opening's fill, and of its part in seen space.
fn areas(growing: &Growing, opening: &Opening, seen: &[bool]) -> [f64; 2] {
    let mut areas = [0.0; 2];
    for &t in &opening.triangles {
        let own = area(growing.corners(t as usize));
        areas[0] += own;
        areas[1] += if seen[t as usize] { own } else { 0.0 };
    }
    areas
}

/// The figures of an opening that consists of these loops.
pub fn opening_report(border: &Border, loops: &[u32], left_open: Option<LeftOpen>) -> OpeningReport {
    let loops = || loops.iter().map(|&number| border.loops[number as usize]);
    OpeningReport {
        vertices: loops().map(|edge_loop| edge_loop.vertex).collect(),
        edges: loops().map(|edge_loop| edge_loop.edges).sum(),
        length: loops().map(|edge_loop| edge_loop.length).sum(),
        area: 0.0,
        left_open,
        forced_faces: 0,
    }
}
