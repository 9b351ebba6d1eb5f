//! A part of the mesh with neighbour links, over its own pixels: what one thread polishes while the others do theirs.
//!
//! Half edge `h` runs from `corners[h]` to the next corner of triangle `h / 3`. An edge without a neighbour is either on the border of the
//! domain ([`NONE`]) or on a seam to another patch ([`SEAM`]). Vertices on a seam stay as they are.

use super::borders::{Border, Region};
use super::delaunay::{NONE, next_of, previous_of};
use super::domain::Domain;
use super::pieces::Pieces;
use super::view::{Site, View};
use base::error::Result;
use base::progress::Progress;

/// In place of a neighbour: it belongs to another patch.
pub(super) const SEAM: u32 = NONE - 1;

/// A part of the mesh.
pub(super) struct Patch<'a, S> {
    /// The places where the border may change.
    pub border: &'a dyn Border,
    /// Samples of vertices and listed pixels, and the pixel index of each.
    pub sites: Vec<S>,
    /// Values of the vertices. Empty if all are samples.
    pub values: Vec<f64>,
    pub pixels: Vec<u32>,
    /// Columns of the image.
    pub cols: u32,
    /// Number of vertices at the start. `sites[..vertices]` were vertices then.
    pub vertices: usize,
    pub corners: Vec<u32>,
    pub twins: Vec<u32>,
    /// Whether each triangle is still part of the mesh.
    pub alive: Vec<bool>,
    /// Lists of pixels, as in the digging: the first of each triangle, the next of each pixel.
    pub first: Vec<u32>,
    pub next: Vec<u32>,
    /// A half edge out of each vertex, [`NONE`] for pixels that are none.
    pub out: Vec<u32>,
    /// Vertices on a seam.
    on_seam: Vec<bool>,
    /// Vertices that can't be removed from the triangles that they have.
    pub settled: Vec<bool>,
    /// Vertices at which more than one fan of triangles meets. They stay.
    pub pinched: Vec<bool>,
}

/// The state of each pixel of the image. A list is empty if it would tell nothing.
pub(super) struct Known {
    /// [`Pieces::values`], where vertices may leave their samples.
    pub values: Vec<f64>,
    /// [`Pieces::settled`].
    pub settled: Vec<bool>,
    /// Whether more than one patch has it, where triangles may lie beyond the domain's border.
    pub shared: Vec<bool>,
}

impl Known {
    fn is_settled(&self, pixel: u32) -> bool {
        self.settled.get(pixel as usize).is_some_and(|&settled| settled)
    }
}

impl<'a, S: Site> Patch<'a, S> {
    /// The patch of some triangles of a mesh. `scratch` has one entry a pixel of the image, all 0, and is returned so.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn new<V: View<Site = S>>(
        view: &V,
        Region { domain, border }: Region<'a>,
        pieces: &Pieces,
        triangles: &[u32],
        known: &Known,
        scratch: &mut [u32],
        progress: &Progress<'_>,
    ) -> Result<Self> {
        let Known { values, .. } = known;
        let count = triangles.len();
        let mut pixels = Vec::with_capacity(count);
        let mut corners = Vec::with_capacity(3 * count);
        for &t in triangles {
            for p in pieces.triangles[t as usize] {
                let slot = &mut scratch[p as usize];
                if *slot == 0 {
                    pixels.push(p);
                    *slot = pixels.len() as u32;
                }
                corners.push(*slot - 1);
            }
        }
        let vertices = pixels.len();
        for &p in &pixels {
            scratch[p as usize] = 0;
        }
        let (mut first, mut next) = (vec![NONE; count], vec![NONE; vertices]);
        for (t, &piece) in triangles.iter().enumerate() {
            for &p in pieces.pixels_of(piece as usize) {
                let k = pixels.len() as u32;
                pixels.push(p);
                next.push(first[t]);
                first[t] = k;
            }
        }
        let mut sites: Vec<S> = Vec::with_capacity(pixels.len());
        for block in progress.blocks(&pixels) {
            sites.extend(block?.iter().map(|&p| view.site(p)));
        }
        let value = |(&p, site): (&u32, &S)| {
            let moved = values[p as usize];
            if moved.is_nan() { site.value() } else { moved }
        };
        let values = if values.is_empty() { Vec::new() } else { pixels.iter().zip(&sites).map(value).collect() };
        let mut patch = Patch {
            border,
            sites,
            values,
            pixels,
            cols: domain.cols,
            vertices,
            corners,
            twins: Vec::new(),
            alive: vec![true; count],
            first,
            next,
            out: Vec::new(),
            on_seam: vec![false; vertices],
            settled: Vec::new(),
            pinched: vec![false; vertices],
        };
        patch.settled.reserve_exact(patch.pixels.len());
        for block in progress.blocks(&patch.pixels) {
            patch.settled.extend(block?.iter().map(|&p| known.is_settled(p)));
        }
        patch.link(domain, &known.shared);
        Ok(patch)
    }

    /// Finds the neighbours.
    fn link(&mut self, domain: &Domain, shared: &[bool]) {
        // An edge with a triangle of another patch beyond it has both ends in that patch, too. One of the border whose ends
        // happen to be shared may count as a seam: neither end can change.
        let is_shared = |p: u32| shared.get(p as usize).is_some_and(|&s| s);
        // Half edges out of each vertex as lists.
        let mut out = vec![NONE; self.sites.len()];
        let mut following = vec![NONE; self.corners.len()];
        for h in 0..self.corners.len() {
            let v = self.corners[h] as usize;
            following[h] = out[v];
            out[v] = h as u32;
        }
        self.twins = vec![NONE; self.corners.len()];
        for h in 0..self.corners.len() as u32 {
            if self.twins[h as usize] != NONE {
                continue;
            }
            let (from, to) = (self.corners[h as usize], self.corners[next_of(h) as usize]);
            let mut g = out[to as usize];
            while g != NONE && self.corners[next_of(g) as usize] != from {
                g = following[g as usize];
            }
            if g != NONE {
                self.twins[h as usize] = g;
                self.twins[g as usize] = h;
            } else {
                let (p, q) = (self.pixels[from as usize], self.pixels[to as usize]);
                let border = !(is_shared(p) && is_shared(q)) && self.border.is_border(p, q);
                self.twins[h as usize] = if border { NONE } else { SEAM };
                if !border {
                    self.on_seam[from as usize] = true;
                    self.on_seam[to as usize] = true;
                } else {
                    self.pinched[from as usize] = domain.fans(self.pixels[from as usize]) > 1;
                }
            }
        }
        self.out = out;
    }

    /// The corner that half edge `h` leads to.
    #[inline(always)]
    pub fn to(&self, h: u32) -> u32 {
        self.corners[next_of(h) as usize]
    }

    /// Whether triangles at `v` belong to another patch.
    pub fn is_on_seam(&self, v: u32) -> bool {
        self.on_seam.get(v as usize).is_some_and(|&on_seam| on_seam)
    }

    /// The place of vertex `v`.
    #[inline(always)]
    pub fn vertex(&self, v: u32) -> S {
        let sample = self.sites[v as usize];
        if self.values.is_empty() { sample } else { sample.at(self.values[v as usize]) }
    }

    /// Column and row of a pixel of the patch.
    pub fn place(&self, v: u32) -> [i64; 2] {
        let p = self.pixels[v as usize];
        [i64::from(p % self.cols), i64::from(p / self.cols)]
    }

    /// Sets a triangle's corners and neighbours, and those neighbours' links to it.
    pub fn set(&mut self, triangle: u32, corners: [u32; 3], twins: [u32; 3]) {
        let h = triangle as usize * 3;
        self.corners[h..h + 3].copy_from_slice(&corners);
        self.twins[h..h + 3].copy_from_slice(&twins);
        for i in 0..3 {
            if twins[i] < SEAM {
                self.twins[twins[i] as usize] = (h + i) as u32;
            }
            self.out[corners[i] as usize] = (h + i) as u32;
        }
    }

    /// Puts a pixel into a triangle's list.
    #[inline]
    pub fn list(&mut self, triangle: u32, pixel: u32) {
        self.next[pixel as usize] = self.first[triangle as usize];
        self.first[triangle as usize] = pixel;
    }

    /// The half edges out of `v`, in turning order from columns toward rows, and whether they close a circle. `false` if a
    /// seam or too many triangles meet there.
    pub fn fan(&self, v: u32, most: usize, half_edges: &mut Vec<u32>) -> Option<Fan> {
        half_edges.clear();
        if (v as usize) < self.vertices && self.pinched[v as usize] {
            return None;
        }
        let start = self.out[v as usize];
        // Back to the border, if there is one.
        let mut h = start;
        let mut fan = Fan::Closed;
        for _ in 0..=most {
            match self.twins[h as usize] {
                SEAM => return None,
                NONE => {
                    fan = Fan::Open;
                    break;
                }
                twin => h = next_of(twin),
            }
            if h == start {
                break;
            }
        }
        if fan == Fan::Closed && h != start {
            return None;
        }
        let start = h;
        loop {
            half_edges.push(h);
            if half_edges.len() > most {
                return None;
            }
            match self.twins[previous_of(h) as usize] {
                SEAM => return None,
                NONE => break,
                twin => h = twin,
            }
            if h == start {
                break;
            }
        }
        Some(fan)
    }

    /// The pieces that are left of the patch, and the pixels that are settled now, or are no more.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn into_pieces(self, known: &Known, progress: &Progress<'_>) -> Result<(Pieces, Vec<(u32, bool)>)> {
        progress.check()?;
        let mut pieces = Pieces::default();
        for t in (0..self.alive.len()).filter(|&t| self.alive[t]) {
            let mut p = self.first[t];
            while p != NONE {
                pieces.pixels.push(self.pixels[p as usize]);
                p = self.next[p as usize];
            }
            pieces.push(std::array::from_fn(|i| self.pixels[self.corners[3 * t + i] as usize]));
        }
        if !self.values.is_empty() {
            let moved = |v: &usize| self.out[*v] != NONE && self.values[*v] != self.sites[*v].value();
            pieces.moved = (0..self.sites.len()).filter(moved).map(|v| (self.pixels[v], self.values[v])).collect();
        }
        let news = self.pixels.iter().zip(&self.settled).zip(&self.out).map(|((&p, &s), &h)| (p, s && h != NONE));
        let news = news.filter(|&(p, settled)| known.is_settled(p) != settled).collect();
        Ok((pieces, news))
    }
}

/// Ends of the triangles around a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fan {
    /// All around.
    Closed,
    /// At the border of the domain on both sides.
    Open,
}
