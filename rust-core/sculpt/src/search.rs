//! Fewer triangles by search: edges collapse to the best pixel near their middle, vertices move to a better pixel, edges flip. Every change
//! keeps all pixels within the tolerance. Collapses take away two triangles each. Moves and flips lower the sum of squared errors and so
//! make room for further collapses and removals. Later rounds start with flips that may raise it.
//!
//! A collapse and a move are one operation: the polygon of one or two stars is filled by a fan around a pixel inside.
//! Positive triangles over all its edges fill a simple polygon, so no other test of the geometry is needed.
//!
//! If vertices need not be samples, the centre of a fan takes a value that keeps its pixels within the tolerance. Such values are an
//! interval, as what each pixel sees is linear in the value. It takes the one with the smallest sum of squares.

use super::delaunay::{NONE, next_of, previous_of};
use super::patch::{Fan, Patch};
use super::star::{MOST, Rules};
use super::view::Site;
use base::error::Result;
use base::progress::{Pace, Progress};

/// Cost of looking at an edge or a vertex besides its pixels, in pixels.
const LOOK: usize = 256;

/// Pixels from the middle of an edge to the farthest pixel to which it may collapse, along both axes.
const REACH: i64 = 2;

/// Pixels of the largest star whose vertex moves in a light search: a step of one pixel gains little in larger ones.
const LIGHT: usize = 128;

/// A sum of squares must fall by this factor to count: rounding must not keep changes going around.
const BETTER: f64 = 1.0 - 1e-9;

/// The search before vertices are removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Search {
    /// Nothing.
    None,
    /// Flips, and moves along rows and columns.
    Light,
    /// Collapses, too.
    Full,
    /// All of these, and vertices may leave their samples.
    Free,
}

/// Pixels that see less of a centre's value than this share of it do not bound it: they are checked with the others.
const LEAST_SHARE: f64 = 1e-9;

/// The centre of a fan.
#[derive(Clone, Copy)]
struct Centre {
    /// Sum of squared errors.
    cost: f64,
    member: usize,
    value: f64,
}

/// Searches and makes changes. It keeps its memory between them.
pub(super) struct Searcher<'p, S> {
    pace: Pace<'p>,
    half_edges: Vec<u32>,
    others: Vec<u32>,
    /// Corners of the polygon in turning order, and what lies beyond the edge from each to the next.
    ring: Vec<u32>,
    ring_sites: Vec<S>,
    outer: Vec<u32>,
    /// The polygon's triangles.
    slots: Vec<u32>,
    /// The polygon's pixels, its vertices first.
    members: Vec<u32>,
    member_sites: Vec<S>,
    /// The corner with which the triangle of the fan begins in which each pixel is seen, or is likely to be.
    likely: Vec<u8>,
    /// The pixel that failed last: likely to fail again.
    spoiler: usize,
    /// Share and offset of each pixel that is seen in a fan, while its centre's value is sought.
    shares: Vec<[f64; 2]>,
    /// Whether vertices may leave their samples.
    free: bool,
}

impl<'p, S: Site> Searcher<'p, S> {
    pub fn new(progress: &'p Progress<'_>) -> Self {
        Searcher {
            pace: Pace::new(progress),
            half_edges: Vec::new(),
            others: Vec::new(),
            ring: Vec::new(),
            ring_sites: Vec::new(),
            outer: Vec::new(),
            slots: Vec::new(),
            members: Vec::new(),
            member_sites: Vec::new(),
            likely: Vec::new(),
            spoiler: 0,
            shares: Vec::new(),
            free: false,
        }
    }

    /// One round over all edges and vertices of a patch.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn improve(&mut self, patch: &mut Patch<'_, S>, search: Search, rules: &Rules) -> Result<()> {
        if search == Search::None {
            return Ok(());
        }
        self.free = search == Search::Free;
        if let Some(seed) = rules.shake {
            self.shake(patch, seed, rules)?;
        }
        self.flip_edges(patch, rules)?;
        self.move_vertices(patch, search == Search::Light, rules)?;
        if search != Search::Light {
            self.collapse_edges(patch, rules)?;
            self.flip_edges(patch, rules)?;
        }
        Ok(())
    }

    fn collapse_edges(&mut self, patch: &mut Patch<'_, S>, rules: &Rules) -> Result<()> {
        for h in 0..patch.corners.len() as u32 {
            if !patch.alive[h as usize / 3] || !self.gather_pair(patch, h) {
                continue;
            }
            self.pace.after(LOOK + self.members.len())?;
            let [a, b] = [patch.place(patch.corners[h as usize]), patch.place(patch.to(h))];
            let near = |place: [i64; 2]| (0..2).all(|i| (2 * place[i] - a[i] - b[i]).abs() <= 2 * REACH + 1);
            let mut best = Centre { cost: f64::INFINITY, member: 0, value: f64::NAN };
            for m in 0..self.members.len() {
                if m < 2 || near(patch.place(self.members[m])) {
                    self.try_centre(m, &mut best, rules);
                    self.pace.after(self.members.len())?;
                }
            }
            if best.cost < f64::INFINITY {
                self.make_fan(patch, best, 2);
            }
        }
        Ok(())
    }

    fn move_vertices(&mut self, patch: &mut Patch<'_, S>, light: bool, rules: &Rules) -> Result<()> {
        let most = if light { LIGHT } else { usize::MAX };
        for v in 0..patch.sites.len() as u32 {
            if patch.out[v as usize] == NONE || !self.gather_star(patch, v) {
                continue;
            }
            self.pace.after(LOOK + self.members.len())?;
            if self.members.len() > most {
                continue;
            }
            let from = patch.place(v);
            let near = |place: [i64; 2]| {
                let [right, down] = [0, 1].map(|i| (place[i] - from[i]).abs());
                right <= 1 && down <= 1 && (!light || right + down <= 1)
            };
            let now = patch.vertex(v);
            let cost = BETTER * self.fan_cost(0, &now, f64::INFINITY, rules);
            let mut best = Centre { cost, member: 0, value: f64::NAN };
            for m in 0..self.members.len() {
                if near(patch.place(self.members[m])) && (m > 0 || self.free) {
                    self.try_centre(m, &mut best, rules);
                    self.pace.after(self.members.len())?;
                }
            }
            if best.cost < cost {
                self.make_fan(patch, best, 1);
            }
        }
        Ok(())
    }

    /// Collects the star of `v`, `false` if it must stay.
    fn gather_star(&mut self, patch: &Patch<'_, S>, v: u32) -> bool {
        if patch.fan(v, MOST, &mut self.half_edges) != Some(Fan::Closed) {
            return false;
        }
        self.clear();
        for i in 0..self.half_edges.len() {
            let h = self.half_edges[i];
            self.add_corner(patch, h);
            self.slots.push(h / 3);
        }
        self.add_members(patch, &[v]);
        true
    }

    /// Collects the stars of both ends of an edge, `false` if they must stay.
    fn gather_pair(&mut self, patch: &Patch<'_, S>, h: u32) -> bool {
        let (u, v) = (patch.corners[h as usize], patch.to(h));
        // Each edge once, from its smaller end.
        if u > v
            || patch.fan(u, MOST, &mut self.half_edges) != Some(Fan::Closed)
            || patch.fan(v, MOST, &mut self.others) != Some(Fan::Closed)
        {
            return false;
        }
        let (k, l) = (self.half_edges.len(), self.others.len());
        if !(3..=MOST).contains(&(k + l - 4)) {
            return false;
        }
        let back = patch.twins[h as usize];
        let rotate = |list: &mut [u32], first: u32| {
            let at = list.iter().position(|&x| x == first).expect("the edge leaves its own end");
            list.rotate_left(at);
        };
        rotate(&mut self.half_edges, h);
        rotate(&mut self.others, back);
        self.clear();
        for i in 1..k - 1 {
            self.add_corner(patch, self.half_edges[i]);
        }
        for j in 1..l - 1 {
            self.add_corner(patch, self.others[j]);
        }
        // If a corner comes twice, the ends have another common neighbour: the polygon is none.
        if (1..self.ring.len()).any(|i| self.ring[..i].contains(&self.ring[i])) {
            return false;
        }
        self.slots.extend(self.half_edges.iter().map(|h| h / 3));
        self.slots.extend(self.others[1..l - 1].iter().map(|h| h / 3));
        self.add_members(patch, &[u, v]);
        true
    }

    fn clear(&mut self) {
        self.ring.clear();
        self.ring_sites.clear();
        self.outer.clear();
        self.slots.clear();
        self.members.clear();
        self.member_sites.clear();
        self.likely.clear();
        self.spoiler = 0;
    }

    /// Adds the corner that a half edge of the star leads to.
    fn add_corner(&mut self, patch: &Patch<'_, S>, h: u32) {
        let corner = patch.to(h);
        self.ring.push(corner);
        self.ring_sites.push(patch.vertex(corner));
        self.outer.push(patch.twins[next_of(h) as usize]);
    }

    fn add_members(&mut self, patch: &Patch<'_, S>, vertices: &[u32]) {
        self.members.extend(vertices);
        self.likely.resize(vertices.len(), 0);
        // Of two stars' triangles those of the first one begin at its second corner, and two of each meet at the edge.
        let (corners, first_star) = (self.ring.len(), self.half_edges.len());
        let before = |slot: usize| match vertices {
            [_, _] if slot < first_star => 1,
            [_, _] => 2,
            _ => 0,
        };
        for (slot, &t) in self.slots.iter().enumerate() {
            let likely = slot.saturating_sub(before(slot)).min(corners.saturating_sub(1)) as u8;
            let mut p = patch.first[t as usize];
            while p != NONE {
                self.members.push(p);
                self.likely.push(likely);
                p = patch.next[p as usize];
            }
        }
        self.member_sites.extend(self.members.iter().map(|&p| patch.sites[p as usize]));
    }

    /// Takes member `m` for the centre if that is better than `best`.
    fn try_centre(&mut self, m: usize, best: &mut Centre, rules: &Rules) {
        let sample = self.member_sites[m];
        let k = self.ring.len();
        if (0..k).any(|i| !rules.allow(&self.ring_sites[i], &self.ring_sites[(i + 1) % k], &sample)) {
            return;
        }
        let mut value = sample.value();
        if self.free {
            match self.best_value(m, rules) {
                Some(found) => value = found,
                None => return,
            }
        }
        let cost = self.fan_cost(m, &sample.at(value), best.cost, rules);
        if cost < best.cost {
            *best = Centre { cost, member: m, value };
        }
    }

    /// The value of a centre at member `m` with the smallest sum of squared offsets of those within the tolerance.
    fn best_value(&mut self, m: usize, rules: &Rules) -> Option<f64> {
        let k = self.ring.len();
        let apex = self.member_sites[m];
        let [mut low, mut high] = apex.room(rules.tolerance);
        // Two planes a triangle tell how much of the centre's value each pixel sees.
        let step = high.min(1e3 * -low);
        if !(step > 0.0) {
            return None;
        }
        let raised = apex.at(apex.value() + step);
        let mut planes = [None; MOST];
        self.shares.clear();
        for (other, p) in self.member_sites.iter().enumerate() {
            if other == m {
                continue;
            }
            let i = self.wedge(&apex, p, self.likely[other]);
            let (a, b) = (&self.ring_sites[i], &self.ring_sites[(i + 1) % k]);
            let (level, lifted) = planes[i].get_or_insert_with(|| (S::plane(a, b, &apex), S::plane(a, b, &raised)));
            let offset = S::offset(level, p);
            let share = (S::offset(lifted, p) - offset) / step;
            let [least, most] = p.room(rules.tolerance);
            if share > LEAST_SHARE {
                low = low.max((least - offset) / share);
                high = high.min((most - offset) / share);
            } else if !(offset >= least && offset <= most) {
                return None;
            }
            if !(low <= high) {
                return None;
            }
            self.shares.push([share, offset]);
        }
        // The centre's own offset is its distance from the sample.
        let (mut product, mut square) = (0.0, 1.0);
        for [share, offset] in &self.shares {
            product += share * offset;
            square += share * share;
        }
        // Not quite to the ends, so that rounding leaves it within.
        let margin = (1e-6 * (high - low)).min(1e-9 * step);
        Some(apex.value() + (-product / square).clamp(low + margin, high - margin))
    }

    /// Sum of squared errors of a fan around `apex`, at member `m`. Infinite if one is beyond the tolerance, or if the sum is not below
    /// `limit`.
    fn fan_cost(&mut self, m: usize, apex: &S, limit: f64, rules: &Rules) -> f64 {
        let k = self.ring.len();
        let plane = |i: usize| S::plane(&self.ring_sites[i], &self.ring_sites[(i + 1) % k], apex);
        let spoiler = &self.member_sites[self.spoiler];
        if self.spoiler != m
            && !(S::error(&plane(self.wedge(apex, spoiler, self.likely[self.spoiler])), spoiler).abs()
                <= rules.tolerance)
        {
            return f64::INFINITY;
        }
        let mut planes = [None; MOST];
        let mut sum = 0.0;
        for (other, p) in self.member_sites.iter().enumerate() {
            if other == m && !self.free {
                continue;
            }
            let i = if other == m { 0 } else { self.wedge(apex, p, self.likely[other]) };
            let error = S::error(planes[i].get_or_insert_with(|| plane(i)), p);
            if !(error.abs() <= rules.tolerance) {
                self.spoiler = other;
                return f64::INFINITY;
            }
            sum += error * error;
            if sum >= limit {
                return f64::INFINITY;
            }
        }
        sum
    }

    /// The triangle of the fan around `apex` in which a pixel of the polygon is seen, `likely` if it is seen there.
    #[inline]
    fn wedge(&self, apex: &S, p: &S, likely: u8) -> usize {
        let k = self.ring.len();
        let i = usize::from(likely);
        let next = if i + 1 == k { 0 } else { i + 1 };
        if S::turn(apex, &self.ring_sites[i], p) >= 0.0 && S::turn(apex, &self.ring_sites[next], p) <= 0.0 {
            return i;
        }
        let mut before = S::turn(apex, &self.ring_sites[0], p);
        for i in 0..k {
            let after = S::turn(apex, &self.ring_sites[(i + 1) % k], p);
            if before >= 0.0 && after <= 0.0 {
                return i;
            }
            before = after;
        }
        // Only an apex at the pixel itself sees it nowhere.
        0
    }

    /// Fills the polygon by a fan. The first `vertices` members were vertices.
    fn make_fan(&mut self, patch: &mut Patch<'_, S>, centre: Centre, vertices: usize) {
        let k = self.ring.len();
        let m = centre.member;
        let apex = self.members[m];
        if self.free {
            patch.values[apex as usize] = centre.value;
        }
        let site = patch.vertex(apex);
        for &v in &self.members[..vertices] {
            patch.out[v as usize] = NONE;
        }
        for &v in self.ring.iter().chain([&apex]) {
            patch.settled[v as usize] = false;
        }
        for (i, &t) in self.slots.iter().enumerate() {
            patch.alive[t as usize] = i < k;
            patch.first[t as usize] = NONE;
        }
        for i in 0..k {
            let (next, before) = (self.slots[(i + 1) % k], self.slots[(i + k - 1) % k]);
            let corners = [self.ring[i], self.ring[(i + 1) % k], apex];
            patch.set(self.slots[i], corners, [self.outer[i], next * 3 + 2, before * 3 + 1]);
        }
        for other in (0..self.members.len()).filter(|&other| other != m) {
            let t = self.slots[self.wedge(&site, &self.member_sites[other], self.likely[other])];
            patch.list(t, self.members[other]);
        }
    }

    fn flip_edges(&mut self, patch: &mut Patch<'_, S>, rules: &Rules) -> Result<()> {
        for h in 0..patch.corners.len() as u32 {
            let g = patch.twins[h as usize];
            if patch.alive[h as usize / 3] && g < h {
                self.flip(patch, h, g, BETTER, rules);
                self.pace.after(LOOK + self.members.len())?;
            }
        }
        Ok(())
    }

    /// Flips half of the edges, better or not: where no change lowers the sum of squares, another mesh may have room. A hash
    /// chooses them, so that the same image gives the same mesh.
    fn shake(&mut self, patch: &mut Patch<'_, S>, seed: u32, rules: &Rules) -> Result<()> {
        for h in 0..patch.corners.len() as u32 {
            let g = patch.twins[h as usize];
            if patch.alive[h as usize / 3] && g < h {
                let [from, to] = [patch.corners[h as usize], patch.to(h)].map(|v| u64::from(patch.pixels[v as usize]));
                let mut x = (from << 32 | to).wrapping_add(u64::from(seed)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                x = (x ^ x >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                if x >> 63 == 0 {
                    self.flip(patch, h, g, f64::INFINITY, rules);
                    self.pace.after(LOOK + self.members.len())?;
                }
            }
        }
        Ok(())
    }

    /// Replaces an edge by the other diagonal of the two triangles beside it, if the sum of squares falls below `limit` times
    /// what it was.
    fn flip(&mut self, patch: &mut Patch<'_, S>, h: u32, g: u32, limit: f64, rules: &Rules) {
        let [a, b] = [patch.corners[h as usize], patch.to(h)];
        let [c, d] = [previous_of(h), previous_of(g)].map(|h| patch.corners[h as usize]);
        let [sa, sb, sc, sd] = [a, b, c, d].map(|v| patch.vertex(v));
        if c == d || !rules.allow(&sa, &sd, &sc) || !rules.allow(&sd, &sb, &sc) {
            return;
        }
        self.clear();
        self.slots.extend([h / 3, g / 3]);
        self.add_members(patch, &[]);
        let old = [S::plane(&sa, &sb, &sc), S::plane(&sb, &sa, &sd)];
        let new = [S::plane(&sa, &sd, &sc), S::plane(&sd, &sb, &sc)];
        let (mut before, mut after) = (0.0, 0.0);
        for p in &self.member_sites {
            let was = S::error(&old[usize::from(S::turn(&sa, &sb, p) < 0.0)], p);
            let is = S::error(&new[usize::from(S::turn(&sd, &sc, p) < 0.0)], p);
            if !(is.abs() <= rules.tolerance) {
                return;
            }
            before += was * was;
            after += is * is;
        }
        if !(after < limit * before) {
            return;
        }
        for v in [a, b, c, d] {
            patch.settled[v as usize] = false;
        }
        let (t, u) = (h / 3, g / 3);
        let [bc, ca] = [next_of(h), previous_of(h)].map(|h| patch.twins[h as usize]);
        let [ad, db] = [next_of(g), previous_of(g)].map(|h| patch.twins[h as usize]);
        patch.first[t as usize] = NONE;
        patch.first[u as usize] = NONE;
        patch.set(t, [a, d, c], [ad, u * 3 + 2, ca]);
        patch.set(u, [d, b, c], [db, bc, t * 3 + 1]);
        for (&p, site) in self.members.iter().zip(&self.member_sites) {
            patch.list(if S::turn(&sd, &sc, site) < 0.0 { u } else { t }, p);
        }
    }
}
