//! Small charts are laid beside their neighbours: fewer charts, fewer seams.
//!
//! A chart moves rigidly to where it fits its neighbour's border best, and becomes one with it there. It does along all that they share, or
//! if that stretches it too much along the longest edge alone. It stays by itself where it would overlap.

use glam::{DVec2, DVec3};
use rustc_hash::{FxHashMap, FxHashSet};

use base::error::Result;
use base::progress::{Pace, Progress};
use geom::predicates::orient2d;

use super::charts::{Charts, NONE};
use super::check::insides_meet;
use super::surface::Surface;

/// Rounds over all charts. Few are joined after the second.
const ROUNDS: usize = 4;
/// Lengths of a chart that is joined to its neighbour are stretched by at most this factor, either way.
const STRETCH: f64 = 1.5;
/// A chart of more triangles stays by itself: it is large enough.
const MOST_JOINED: usize = 1024;
/// The box of a chart grows by at most so many times the area that is joined to it, or charts leave gaps between them ...
const GROWTH: f64 = 4.0;
/// ... or by this share of all area, which is nothing.
const NO_GROWTH: f64 = 2e-4;
/// The box's sides become at most this share of those of a square that holds all charts: long ones are hard to place.
const LONGEST: f64 = 0.35;
/// A triangle that reaches into more cells than this is tested against all.
const MOST_CELLS: usize = 1024;

/// An edge that two charts share: the triangle and corner where it begins, in the small chart and in its neighbour.
#[derive(Clone, Copy)]
struct Shared {
    small: (u32, usize),
    large: (u32, usize),
    length: f64,
}

/// Joins charts. Returns how many there are then.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn join(charts: &mut Charts, surface: &Surface, progress: &Progress<'_>) -> Result<usize> {
    let twins = twins(surface, progress)?;
    let mut joiner = Joiner::new(charts, surface, progress)?;
    let mut pace = Pace::new(progress);
    for _ in 0..ROUNDS {
        let is_small = |&c: &usize| (1..=MOST_JOINED).contains(&joiner.members[c].len());
        let mut order: Vec<usize> = (0..joiner.members.len()).filter(is_small).collect();
        order.sort_by(|&a, &b| joiner.area[a].total_cmp(&joiner.area[b]).then(a.cmp(&b)));
        let mut joined = 0;
        for small in order {
            pace.after(64 * joiner.members[small].len())?;
            joined += usize::from(joiner.join_one(small, &twins, &mut pace)?);
        }
        if joined == 0 {
            break;
        }
    }
    Ok(charts.renumber())
}

/// The half-edge on the other side of each: of edges with exactly two triangles that turn alike.
fn twins(surface: &Surface, progress: &Progress<'_>) -> Result<Vec<u32>> {
    let mut edges: FxHashMap<[u32; 2], [u32; 3]> = FxHashMap::default();
    let triangles = &surface.triangles;
    for block in progress.ranges(triangles.len()) {
        for t in block? {
            for k in 0..3 {
                let (a, b) = (triangles[t][k], triangles[t][(k + 1) % 3]);
                let sides = edges.entry([a.min(b), a.max(b)]).or_insert([0, NONE, NONE]);
                sides[0] += 1;
                sides[if a < b { 1 } else { 2 }] = (3 * t + k) as u32;
            }
        }
    }
    let mut twins = vec![NONE; 3 * triangles.len()];
    for [count, forth, back] in edges.into_values() {
        if count == 2 && forth != NONE && back != NONE {
            twins[forth as usize] = back;
            twins[back as usize] = forth;
        }
    }
    Ok(twins)
}

struct Joiner<'a> {
    charts: &'a mut Charts,
    surface: &'a Surface,
    members: Vec<Vec<u32>>,
    /// On the surface.
    area: Vec<f64>,
    /// Triangles by chart and cell.
    cells: FxHashMap<(u32, i32, i32), Vec<u32>>,
    /// Those of each chart that reach into too many cells.
    wide: Vec<Vec<u32>>,
    cell: f64,
    /// Of each chart, in the plane.
    boxes: Vec<[DVec2; 2]>,
    /// Of all charts, on the surface.
    whole: f64,
}

impl<'a> Joiner<'a> {
    fn new(charts: &'a mut Charts, surface: &'a Surface, progress: &Progress<'_>) -> Result<Self> {
        let members = charts.members();
        let double = |&t: &u32| area_vector(surface.corners(t as usize)).length();
        let area: Vec<f64> = members.iter().map(|of| of.iter().map(double).sum::<f64>() / 2.0).collect();
        let all: f64 = area.iter().sum();
        let cell = (2.0 * (all / charts.of.len().max(1) as f64).sqrt()).max(1e-9);
        let wide = vec![Vec::new(); members.len()];
        let boxes = vec![[DVec2::INFINITY, DVec2::NEG_INFINITY]; members.len()];
        let cells = FxHashMap::default();
        let mut joiner = Joiner { charts, surface, members, area, cells, wide, cell, boxes, whole: all };
        for chart in 0..joiner.members.len() {
            progress.check()?;
            for i in 0..joiner.members[chart].len() {
                joiner.enter(chart as u32, joiner.members[chart][i]);
            }
        }
        Ok(joiner)
    }

    /// Lays a chart beside the neighbour that it shares most with, if it fits there. Else beside the next one.
    fn join_one(&mut self, small: usize, twins: &[u32], pace: &mut Pace<'_>) -> Result<bool> {
        let mut neighbours: Vec<(u32, Vec<Shared>)> = self.neighbours(small, twins);
        let length = |shared: &[Shared]| shared.iter().map(|edge| edge.length).sum::<f64>();
        neighbours.sort_by(|a, b| length(&b.1).total_cmp(&length(&a.1)).then(a.0.cmp(&b.0)));
        for (large, shared) in neighbours {
            if self.area[large as usize] < self.area[small] {
                continue;
            }
            let longest =
                shared.iter().copied().reduce(|best, edge| if edge.length > best.length { edge } else { best });
            for along in [shared.as_slice(), longest.as_slice()] {
                if let Some(places) = self.laid_beside(small, along)
                    && self.is_compact(small, large, &places)
                    && self.is_free(small, large, &places, pace)?
                {
                    self.merge(small, large, &places);
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    fn neighbours(&self, small: usize, twins: &[u32]) -> Vec<(u32, Vec<Shared>)> {
        let mut by_chart: FxHashMap<u32, Vec<Shared>> = FxHashMap::default();
        for &t in &self.members[small] {
            for k in 0..3 {
                let twin = twins[3 * t as usize + k];
                let other = if twin == NONE { NONE } else { self.charts.of[twin as usize / 3] };
                if other != NONE && other as usize != small {
                    let [a, b] = [k, (k + 1) % 3].map(|k| self.surface.corners(t as usize)[k]);
                    let large = (twin / 3, twin as usize % 3);
                    by_chart.entry(other).or_default().push(Shared { small: (t, k), large, length: a.distance(b) });
                }
            }
        }
        by_chart.into_iter().collect()
    }

    /// New places of a chart's places, and the neighbour's places that some of them become. `None` if the chart would be stretched too
    /// much.
    fn laid_beside(&self, small: usize, along: &[Shared]) -> Option<FxHashMap<u32, (DVec2, u32)>> {
        let charts = &*self.charts;
        let ends = |edge: &Shared| {
            let ((s, i), (l, j)) = (edge.small, edge.large);
            let (s, l) = (charts.corners[s as usize], charts.corners[l as usize]);
            // The neighbour runs through the edge the other way.
            [(s[i], l[(j + 1) % 3]), (s[(i + 1) % 3], l[j])]
        };
        let (mut from, mut to, mut weight) = (DVec2::ZERO, DVec2::ZERO, 0.0);
        for edge in along {
            for (s, l) in ends(edge) {
                from += charts.uv[s as usize] * edge.length;
                to += charts.uv[l as usize] * edge.length;
                weight += edge.length;
            }
        }
        let (from, to) = (from / weight, to / weight);
        let mut turn = DVec2::ZERO;
        for edge in along {
            for (s, l) in ends(edge) {
                let (p, q) = (charts.uv[s as usize] - from, charts.uv[l as usize] - to);
                turn += edge.length * DVec2::new(p.dot(q), p.perp_dot(q));
            }
        }
        let turn = turn.try_normalize()?;
        let mut places = FxHashMap::default();
        for &t in &self.members[small] {
            for place in charts.corners[t as usize] {
                let at = to + turn.rotate(charts.uv[place as usize] - from);
                places.entry(place).or_insert((at, place));
            }
        }
        let mut taken = FxHashSet::default();
        for (s, l) in along.iter().flat_map(ends) {
            let lies = places.get_mut(&s)?;
            if lies.1 == s && taken.insert(l) {
                *lies = (charts.uv[l as usize], l);
            }
        }
        let is_welded = along.iter().any(|edge| ends(edge).iter().all(|(s, l)| places[s].1 == *l));
        let fits = |&t: &u32| {
            let uv = charts.corners[t as usize].map(|place| places[&place].0);
            is_near_rigid(self.surface.corners(t as usize), uv)
        };
        (is_welded && self.members[small].iter().all(fits)).then_some(places)
    }

    /// Whether the neighbour's box grows by little more than what joins it.
    fn is_compact(&self, small: usize, large: u32, places: &FxHashMap<u32, (DVec2, u32)>) -> bool {
        let before = self.boxes[large as usize];
        let after = places.values().fold(before, |[low, high], &(at, _)| [low.min(at), high.max(at)]);
        let size = |[low, high]: [DVec2; 2]| (high - low).element_product();
        let side = |[low, high]: [DVec2; 2]| (high - low).max_element();
        let is_short = side(after) <= side(before).max(LONGEST * self.whole.sqrt());
        is_short && size(after) - size(before) <= (GROWTH * self.area[small]).max(NO_GROWTH * self.whole)
    }

    /// Whether no triangle of the chart would overlap one of its neighbour's, or another of its own.
    fn is_free(
        &self,
        small: usize,
        large: u32,
        places: &FxHashMap<u32, (DVec2, u32)>,
        pace: &mut Pace<'_>,
    ) -> Result<bool> {
        let laid = |t: u32| self.charts.corners[t as usize].map(|place| places[&place].0);
        let members = &self.members[small];
        for (i, &t) in members.iter().enumerate() {
            let uv = laid(t);
            let mut meets = |others: &[u32], at: &dyn Fn(u32) -> [DVec2; 3]| -> Result<bool> {
                pace.after(8 * others.len())?;
                Ok(others.iter().any(|&other| boxes_meet(uv, at(other)) && insides_meet(uv, at(other))))
            };
            let there = |other: u32| self.charts.triangle(other as usize);
            // Its own triangles lie as they did, but for those that were drawn to the border.
            let is_drawn = self.charts.corners[t as usize].iter().any(|place| places[place].1 != *place);
            let own = if is_drawn { [&members[..i], &members[i + 1..]] } else { [&[][..]; 2] };
            if meets(own[0], &laid)? || meets(own[1], &laid)? || meets(&self.wide[large as usize], &there)? {
                return Ok(false);
            }
            match cells_of(uv, self.cell) {
                Some(cells) => {
                    for (x, y) in cells {
                        if let Some(others) = self.cells.get(&(large, x, y))
                            && meets(others, &there)?
                        {
                            return Ok(false);
                        }
                    }
                }
                None if meets(&self.members[large as usize], &there)? => return Ok(false),
                None => {}
            }
        }
        Ok(true)
    }

    fn merge(&mut self, small: usize, large: u32, places: &FxHashMap<u32, (DVec2, u32)>) {
        let members = std::mem::take(&mut self.members[small]);
        for &t in &members {
            self.leave(small as u32, t);
            let corners = &mut self.charts.corners[t as usize];
            *corners = corners.map(|place| places[&place].1);
            self.charts.of[t as usize] = large;
        }
        for (&place, &(at, becomes)) in places {
            if place == becomes {
                self.charts.uv[place as usize] = at;
            }
        }
        self.wide[small].clear();
        self.area[large as usize] += std::mem::take(&mut self.area[small]);
        members.iter().for_each(|&t| self.enter(large, t));
        self.members[large as usize].extend(members);
    }

    fn enter(&mut self, chart: u32, t: u32) {
        let [low, high] = &mut self.boxes[chart as usize];
        for at in self.charts.triangle(t as usize) {
            (*low, *high) = (low.min(at), high.max(at));
        }
        match cells_of(self.charts.triangle(t as usize), self.cell) {
            Some(cells) => cells.for_each(|(x, y)| self.cells.entry((chart, x, y)).or_default().push(t)),
            None => self.wide[chart as usize].push(t),
        }
    }

    fn leave(&mut self, chart: u32, t: u32) {
        if let Some(cells) = cells_of(self.charts.triangle(t as usize), self.cell) {
            cells.for_each(|(x, y)| drop(self.cells.remove(&(chart, x, y))));
        }
    }
}

/// Cells that the box of a triangle meets. `None` for too many.
fn cells_of(uv: [DVec2; 3], cell: f64) -> Option<impl Iterator<Item = (i32, i32)>> {
    let low = (uv[0].min(uv[1]).min(uv[2]) / cell).floor().as_ivec2();
    let high = (uv[0].max(uv[1]).max(uv[2]) / cell).floor().as_ivec2();
    let [columns, rows] = (high - low).to_array().map(|n| n as usize + 1);
    (columns.saturating_mul(rows) <= MOST_CELLS)
        .then(|| (low.y..=high.y).flat_map(move |y| (low.x..=high.x).map(move |x| (x, y))))
}

fn boxes_meet(s: [DVec2; 3], t: [DVec2; 3]) -> bool {
    let bounds = |[a, b, c]: [DVec2; 3]| (a.min(b).min(c), a.max(b).max(c));
    let ((s_low, s_high), (t_low, t_high)) = (bounds(s), bounds(t));
    s_low.cmple(t_high).all() && t_low.cmple(s_high).all()
}

/// Twice the area of a triangle times its normal.
pub fn area_vector([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Largest and smallest factor by which lengths of a triangle are stretched in the plane. `None` for one without area.
pub fn stretches(corners: [DVec3; 3], uv: [DVec2; 3]) -> Option<[f64; 2]> {
    let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
    let along = e1.try_normalize()?;
    let height = (e2 - along * e2.dot(along)).length();
    let (x1, x2) = (e1.dot(along), e2.dot(along));
    if !(height > 0.0 && x1 > 0.0) {
        return None;
    }
    let (f1, f2) = (uv[1] - uv[0], uv[2] - uv[0]);
    let du = f1 / x1;
    let dv = (f2 - du * x2) / height;
    let (sum, apart, turn) =
        (du.length_squared() + dv.length_squared(), du.length_squared() - dv.length_squared(), du.dot(dv));
    let root = (apart * apart + 4.0 * turn * turn).sqrt();
    Some([((sum + root) / 2.0).sqrt(), ((sum - root) / 2.0).max(0.0).sqrt()])
}

/// Whether a triangle keeps its side and nearly its shape.
fn is_near_rigid(corners: [DVec3; 3], uv: [DVec2; 3]) -> bool {
    orient2d(uv[0], uv[1], uv[2]) > 0
        && stretches(corners, uv).is_some_and(|[most, least]| most <= STRETCH && least * STRETCH >= 1.0)
}
