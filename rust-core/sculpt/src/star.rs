//! Removing a vertex: the best triangulation of its star without it, by dynamic programming.
//!
//! The star is a polygon of up to [`MOST`] corners. Every triangle of three of its corners is tried at most once: it must
//! turn like columns toward rows and keep every pixel seen in it within the tolerance. Positive triangles over all edges
//! of a simple polygon triangulate it, so no other test of the geometry is needed. Of all such triangulations the one with
//! the smallest sum of squared errors is taken.
//!
//! The side of each diagonal on which the pixels are seen is found once per diagonal, 64 pixels per word. The pixels of a triangle are the
//! words of its three edges, joined bit by bit. As most triangles fail, words are found when they are asked for.

use super::delaunay::{NONE, next_of, previous_of};
use super::patch::{Fan, Patch, SEAM};
use super::sides::Lanes;
use super::view::Site;
use base::error::Result;
use base::progress::{Pace, Progress};

/// Most corners of a star.
pub(super) const MOST: usize = 16;

/// Cost of looking at a vertex besides its pixels, in pixels.
const LOOK: usize = 256;

/// Words of a star from which on each triangle is worth a look at the progress.
const MANY: usize = 256;

/// Rules that triangles must keep to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    /// Largest distance along a ray, world units.
    pub tolerance: f64,
    /// Square of the sine of the smallest angle, as seen from the sensor.
    pub least_sine_squared: f64,
    /// Columns between two rows of a lattice, as far as angles go.
    pub aspect: f64,
    /// Start of a search: random flips of this seed.
    pub shake: Option<u32>,
}

impl Rules {
    /// Whether there may be a triangle: it turns like columns toward rows and is wide enough.
    #[inline(always)]
    pub fn allow<S: Site>(&self, a: &S, b: &S, c: &S) -> bool {
        S::turn(a, b, c) > 0.0 && S::is_wide(a, b, c) && (self.least_sine_squared == 0.0 || self.is_blunt(a, b, c))
    }

    /// Whether no angle is too small: the smallest one lies between the two longest sides.
    fn is_blunt<S: Site>(&self, a: &S, b: &S, c: &S) -> bool {
        let [a, b, c] = [a, b, c].map(|site| site.seen(self.aspect));
        let sides = [(b - a).length_squared(), (c - b).length_squared(), (a - c).length_squared()];
        let shortest = sides[0].min(sides[1]).min(sides[2]);
        let others = if shortest == sides[0] {
            sides[1] * sides[2]
        } else if shortest == sides[1] {
            sides[0] * sides[2]
        } else {
            sides[0] * sides[1]
        };
        (b - a).cross(c - a).length_squared() >= self.least_sine_squared * others
    }
}

/// Filling of a star without its vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Filling {
    /// The third corner of each triangle, in the order in which polygons are split, 4 bits each, the first one lowest.
    code: u64,
}

/// Finds and makes fillings. It keeps its memory between stars.
pub(super) struct Surgeon<'p, S: Site> {
    pace: Pace<'p>,
    half_edges: Vec<u32>,
    fan: Fan,
    /// Corners of the star in turning order.
    ring: Vec<u32>,
    corner_sites: Vec<S>,
    /// The star's pixels, the vertex first.
    members: Vec<u32>,
    member_sites: Vec<S>,
    lanes: Lanes,
    words: usize,
    /// For each pair of corners i < j, `words` words each: pixels seen on the positive side of the edge from i to j, and
    /// on the positive side or on the edge.
    positive: Vec<u64>,
    not_negative: Vec<u64>,
    /// Words known of each pair.
    known: [[u32; MOST]; MOST],
    /// On which side of the edge from corner i to j > i the vertex is seen, as a sign.
    vertex_side: [[i8; MOST]; MOST],
    /// The best filling of the polygon from corner i to corner j: its cost, and the third corner of the triangle over (i, j). The cost is
    /// negative if it is not known yet, infinite if there is no filling.
    cost: [[f64; MOST]; MOST],
    third: [[u8; MOST]; MOST],
    /// The pixel that failed last: likely to fail again.
    spoiler: usize,
    outer: Vec<u32>,
    slots: Vec<u32>,
}

impl<'p, S: Site> Surgeon<'p, S> {
    pub fn new(progress: &'p Progress<'_>) -> Self {
        Surgeon {
            pace: Pace::new(progress),
            half_edges: Vec::new(),
            fan: Fan::Closed,
            ring: Vec::new(),
            corner_sites: Vec::new(),
            members: Vec::new(),
            member_sites: Vec::new(),
            lanes: Lanes::default(),
            words: 0,
            positive: Vec::new(),
            not_negative: Vec::new(),
            known: [[0; MOST]; MOST],
            vertex_side: [[0; MOST]; MOST],
            cost: [[0.0; MOST]; MOST],
            third: [[0; MOST]; MOST],
            spoiler: 0,
            outer: Vec::new(),
            slots: Vec::new(),
        }
    }

    /// The corners of the star that was looked at last.
    pub fn ring(&self) -> &[u32] {
        &self.ring
    }

    /// The best filling of the star of `v` without it, if there is one. If there is none, the vertex is settled, but on a seam, where its
    /// star is not all here. Before it stands the sum of squared errors of its triangles' pixels, world units, as bits: they sort as the
    /// sums do.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn find(&mut self, patch: &mut Patch<'_, S>, v: u32, rules: &Rules) -> Result<Option<(u64, Filling)>> {
        if !self.gather(patch, v) {
            patch.settled[v as usize] = !patch.is_on_seam(v);
            self.pace.after(LOOK)?;
            return Ok(None);
        }
        let filling = self.fill(rules);
        self.pace.after(LOOK + self.members.len())?;
        patch.settled[v as usize] = filling.is_none();
        Ok(filling)
    }

    fn fill(&mut self, rules: &Rules) -> Option<(u64, Filling)> {
        let k = self.ring.len();
        self.spoiler = 0;
        if !self.vertex_can_be_covered(rules) {
            return None;
        }
        self.sort_sides_later();
        for row in &mut self.cost[..k] {
            row[..k].fill(-1.0);
        }
        let cost = self.best(0, k - 1, rules);
        if cost == f64::INFINITY {
            return None;
        }
        let (mut code, mut shift) = (0, 0);
        self.encode(0, k - 1, &mut code, &mut shift);
        Some((cost.to_bits(), Filling { code }))
    }

    /// Collects the star of `v`. `false` if it must stay.
    fn gather(&mut self, patch: &Patch<'_, S>, v: u32) -> bool {
        let Some(fan) = patch.fan(v, MOST, &mut self.half_edges) else { return false };
        self.fan = fan;
        self.ring.clear();
        self.ring.extend(self.half_edges.iter().map(|&h| patch.to(h)));
        if fan == Fan::Open {
            let last = self.half_edges[self.half_edges.len() - 1];
            self.ring.push(patch.corners[previous_of(last) as usize]);
        }
        let k = self.ring.len();
        if !(3..=MOST).contains(&k) {
            return false;
        }
        self.corner_sites.clear();
        self.corner_sites.extend(self.ring.iter().map(|&c| patch.vertex(c)));
        let site = patch.sites[v as usize];
        if fan == Fan::Open {
            let [from, past, to] = [self.ring[k - 1], v, self.ring[0]].map(|v| patch.pixels[v as usize]);
            if !patch.border.may_pass(from, past, to) {
                return false;
            }
        }
        self.members.clear();
        self.member_sites.clear();
        self.members.push(v);
        self.member_sites.push(site);
        for &h in &self.half_edges {
            let mut p = patch.first[h as usize / 3];
            while p != NONE {
                self.members.push(p);
                self.member_sites.push(patch.sites[p as usize]);
                p = patch.next[p as usize];
            }
        }
        true
    }

    /// Whether some triangle of the ring covers the vertex itself within the tolerance: most stars fail here.
    fn vertex_can_be_covered(&mut self, rules: &Rules) -> bool {
        let (c, v) = (&self.corner_sites, &self.member_sites[0]);
        let k = c.len();
        let side = &mut self.vertex_side;
        for i in 0..k {
            for j in i + 1..k {
                let turn = S::turn(&c[i], &c[j], v);
                side[i][j] = i8::from(turn > 0.0) - i8::from(turn < 0.0);
            }
        }
        for i in 0..k {
            for j in i + 2..k {
                if side[i][j] > 0 {
                    continue;
                }
                for m in i + 1..j {
                    if side[i][m] >= 0
                        && side[m][j] >= 0
                        && S::turn(&c[i], &c[m], &c[j]) > 0.0
                        && S::error(&S::plane(&c[i], &c[m], &c[j]), v).abs() <= rules.tolerance
                    {
                        return true;
                    }
                }
            }
        }
        false
    }

    fn sort_sides_later(&mut self) {
        let k = self.ring.len();
        self.words = self.member_sites.len().div_ceil(64);
        self.positive.resize(k * k * self.words, 0);
        self.not_negative.resize(k * k * self.words, 0);
        for row in &mut self.known[..k] {
            row[..k].fill(0);
        }
        self.lanes.set(&self.corner_sites, &self.member_sites);
    }

    /// Finds on which side of the edge from corner `i` to `j` the pixels of `word` are seen, once. Words are asked for in
    /// order.
    #[inline(always)]
    fn sort_sides(&mut self, i: usize, j: usize, word: usize) {
        if self.known[i][j] as usize > word {
            return;
        }
        self.known[i][j] = word as u32 + 1;
        let at = (i * self.ring.len() + j) * self.words + word;
        [self.positive[at], self.not_negative[at]] =
            self.lanes.sides(&self.corner_sites, &self.member_sites, i, j, word);
    }

    /// Smallest cost of the polygon of corners `i` to `j`.
    fn best(&mut self, i: usize, j: usize, rules: &Rules) -> f64 {
        if j == i + 1 {
            return 0.0;
        }
        if self.cost[i][j] >= 0.0 {
            return self.cost[i][j];
        }
        let mut best = (f64::INFINITY, 0);
        for m in i + 1..j {
            let mut cost = self.triangle(i, m, j, best.0, rules);
            if cost < best.0 {
                cost += self.best(i, m, rules);
            }
            if cost < best.0 {
                cost += self.best(m, j, rules);
            }
            if cost < best.0 {
                best = (cost, m as u8);
            }
        }
        self.cost[i][j] = best.0;
        self.third[i][j] = best.1;
        best.0
    }

    /// Sum of the squared errors of the pixels in a triangle. Infinite if it must not be, or is not below `limit`.
    fn triangle(&mut self, i: usize, m: usize, j: usize, limit: f64, rules: &Rules) -> f64 {
        let [a, b, c] = [i, m, j].map(|i| self.corner_sites[i]);
        if !rules.allow(&a, &b, &c) {
            return f64::INFINITY;
        }
        let plane = S::plane(&a, &b, &c);
        let fails = |site: &S| !(S::error(&plane, site).abs() <= rules.tolerance);
        let side = &self.vertex_side;
        if side[i][m] >= 0 && side[m][j] >= 0 && side[i][j] <= 0 && fails(&self.member_sites[0]) {
            return f64::INFINITY;
        }
        if self.spoiler != 0 {
            let spoiler = &self.member_sites[self.spoiler];
            if fails(spoiler)
                && S::turn(&a, &b, spoiler) >= 0.0
                && S::turn(&b, &c, spoiler) >= 0.0
                && S::turn(&a, &c, spoiler) <= 0.0
            {
                return f64::INFINITY;
            }
        }
        let (k, words) = (self.ring.len(), self.words);
        // Cancelled: whoever asked for the filling hears it, too.
        if words >= MANY && self.pace.after(words * 64).is_err() {
            return f64::INFINITY;
        }
        let (im, mj, ij) = ((i * k + m) * words, (m * k + j) * words, (i * k + j) * words);
        let mut sum = 0.0;
        for word in 0..words {
            self.sort_sides(i, m, word);
            self.sort_sides(m, j, word);
            self.sort_sides(i, j, word);
            let mut bits = self.not_negative[im + word] & self.not_negative[mj + word] & !self.positive[ij + word];
            if word + 1 == words && !self.member_sites.len().is_multiple_of(64) {
                bits &= (1 << (self.member_sites.len() % 64)) - 1;
            }
            while bits != 0 {
                let member = word * 64 + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let error = S::error(&plane, &self.member_sites[member]);
                if !(error.abs() <= rules.tolerance) {
                    self.spoiler = member;
                    return f64::INFINITY;
                }
                sum += error * error;
            }
            if sum >= limit {
                return f64::INFINITY;
            }
        }
        sum
    }

    fn encode(&self, i: usize, j: usize, code: &mut u64, shift: &mut u32) {
        if j == i + 1 {
            return;
        }
        let m = usize::from(self.third[i][j]);
        *code |= (m as u64) << *shift;
        *shift += 4;
        self.encode(i, m, code, shift);
        self.encode(m, j, code, shift);
    }

    /// Removes `v`, whose star has not changed since `filling` was found. The corners that were around it are in
    /// [`Surgeon::ring`] afterwards.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn make(&mut self, patch: &mut Patch<'_, S>, v: u32, filling: Filling) -> Result<()> {
        let gathered = self.gather(patch, v);
        assert!(gathered, "a filling was found for this star");
        let k = self.ring.len();
        self.outer.clear();
        self.outer.extend(self.half_edges.iter().map(|&h| patch.twins[next_of(h) as usize]));
        self.slots.clear();
        self.slots.extend(self.half_edges.iter().map(|&h| h / 3));
        for &t in &self.slots {
            patch.alive[t as usize] = false;
            patch.first[t as usize] = NONE;
        }
        patch.out[v as usize] = NONE;
        let root = match self.fan {
            Fan::Closed => self.outer[k - 1],
            Fan::Open => NONE,
        };
        let mut code = filling.code;
        let mut used = 0;
        self.build(patch, 0, k - 1, root, &mut code, &mut used);
        let new = &self.slots[..used];
        for (&p, site) in self.members.iter().zip(&self.member_sites) {
            let holder = new.iter().find(|&&t| {
                let [a, b, c] = [0, 1, 2].map(|i| patch.vertex(patch.corners[3 * t as usize + i]));
                S::turn(&a, &b, site) >= 0.0 && S::turn(&b, &c, site) >= 0.0 && S::turn(&c, &a, site) >= 0.0
            });
            let holder = *holder.expect("a triangulation of the star covers its pixels");
            patch.list(holder, p);
            self.pace.after(1)?;
        }
        Ok(())
    }

    /// Fills the polygon of corners `i` to `j`. `across` is the half edge beyond its edge from `j` to `i`.
    fn build(
        &mut self,
        patch: &mut Patch<'_, S>,
        i: usize,
        j: usize,
        across: u32,
        code: &mut u64,
        used: &mut usize,
    ) -> u32 {
        let m = (*code & 15) as usize;
        *code >>= 4;
        let t = self.slots[*used];
        *used += 1;
        patch.alive[t as usize] = true;
        let ring = [self.ring[i], self.ring[m], self.ring[j]];
        patch.set(t, ring, [SEAM, SEAM, across]);
        let left = if m == i + 1 { self.outer[i] } else { self.build(patch, i, m, t * 3, code, used) };
        let right = if j == m + 1 { self.outer[m] } else { self.build(patch, m, j, t * 3 + 1, code, used) };
        for (edge, twin) in [(t * 3, left), (t * 3 + 1, right)] {
            patch.twins[edge as usize] = twin;
            if twin < SEAM {
                patch.twins[twin as usize] = edge;
            }
        }
        t * 3 + 2
    }
}
