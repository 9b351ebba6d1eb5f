//! Delaunay triangulation of pixels of a rectangle of the lattice, each triangle with the list of pixels seen in it.
//!
//! Half edge `h` runs from `corners[h]` to the next corner of triangle `h / 3`. `twins[h]` is the same edge seen from the other side.
//! Triangles turn like columns toward rows. All decisions are made in integers.
//!
//! The edge between two lattice neighbours is a Delaunay edge of any set of lattice points that holds both: no lattice
//! point lies in the circle over it. The same holds for a cell's diagonal, up to a tie with the cell's other diagonal. So
//! a border of lattice edges needs no constraints, only [`Delaunay::settle_diagonal`].

/// Stands for no half edge, no triangle or the end of a list.
pub(super) const NONE: u32 = u32::MAX;

/// A pixel of the rectangle, column in the low and row in the high half.
pub(super) type Spot = u32;

/// The spot at (`row`, `col`) of the rectangle.
#[inline]
pub(super) fn spot(row: u32, col: u32) -> Spot {
    row << 16 | col
}

/// Row and column of a spot.
#[inline]
pub(super) fn row_col(spot: Spot) -> (u32, u32) {
    (spot >> 16, spot & 0xffff)
}

/// The triangulation.
#[derive(Clone)]
pub(super) struct Delaunay {
    /// Columns of the rectangle.
    pub cols: u32,
    pub corners: Vec<Spot>,
    pub twins: Vec<u32>,
    /// First pixel seen in each triangle.
    pub first: Vec<u32>,
    /// The next pixel of the same list, by index in the rectangle.
    pub next: Vec<u32>,
    /// Triangles whose corners or lists changed. They may repeat.
    pub touched: Vec<u32>,
    pending: Vec<u32>,
}

#[inline(always)]
fn xy(spot: Spot) -> (i64, i64) {
    (i64::from(spot & 0xffff), i64::from(spot >> 16))
}

/// Twice the area of the triangle. Positive if it turns like columns toward rows.
#[inline(always)]
pub(super) fn turn(a: Spot, b: Spot, c: Spot) -> i64 {
    let ((ax, ay), (bx, by), (cx, cy)) = (xy(a), xy(b), xy(c));
    (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
}

/// Whether `d` lies within the circle through `a`, `b`, `c`, which turn like columns toward rows.
#[inline]
fn in_circle(a: Spot, b: Spot, c: Spot, d: Spot) -> bool {
    let (dx, dy) = xy(d);
    let relative = |p: Spot| {
        let (x, y) = xy(p);
        let (x, y) = (x - dx, y - dy);
        (x, y, x * x + y * y)
    };
    // Coordinates below 2^16: products of four of them fit 64 bits only for tiles below 2^14 pixels per side.
    let ((ax, ay, aa), (bx, by, bb), (cx, cy, cc)) = (relative(a), relative(b), relative(c));
    ax * (by * cc - bb * cy) - ay * (bx * cc - bb * cx) + aa * (bx * cy - by * cx) > 0
}

#[inline(always)]
pub(super) fn next_of(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

#[inline(always)]
pub(super) fn previous_of(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

impl Delaunay {
    /// The rectangle from (0, 0) to (`last_row`, `last_col`) as two triangles. Both are at least 1.
    pub fn new(last_row: u32, last_col: u32) -> Self {
        let (a, b, c, d) = (spot(0, 0), spot(0, last_col), spot(last_row, last_col), spot(last_row, 0));
        Delaunay {
            cols: last_col + 1,
            corners: vec![a, b, c, a, c, d],
            twins: vec![NONE, NONE, 3, 2, NONE, NONE],
            first: vec![NONE; 2],
            next: vec![NONE; (last_row as usize + 1) * (last_col as usize + 1)],
            touched: Vec::new(),
            pending: Vec::new(),
        }
    }

    /// Number of triangles.
    pub fn len(&self) -> u32 {
        self.first.len() as u32
    }

    /// Index of a spot in the rectangle.
    #[inline(always)]
    pub fn index(&self, spot: Spot) -> usize {
        ((spot >> 16) * self.cols + (spot & 0xffff)) as usize
    }

    /// Puts a pixel into the list of a triangle.
    #[inline(always)]
    pub fn list(&mut self, triangle: u32, pixel: Spot) {
        let index = self.index(pixel);
        self.next[index] = self.first[triangle as usize];
        self.first[triangle as usize] = pixel;
    }

    fn take_list(&mut self, triangle: u32) -> u32 {
        std::mem::replace(&mut self.first[triangle as usize], NONE)
    }

    #[inline(always)]
    fn after(&self, pixel: Spot) -> u32 {
        self.next[self.index(pixel)]
    }

    fn set(&mut self, triangle: u32, corners: [Spot; 3], twins: [u32; 3]) {
        let h = triangle as usize * 3;
        self.corners[h..h + 3].copy_from_slice(&corners);
        self.twins[h..h + 3].copy_from_slice(&twins);
        for (i, twin) in twins.into_iter().enumerate() {
            if twin != NONE {
                self.twins[twin as usize] = (h + i) as u32;
            }
        }
    }

    fn push(&mut self, corners: [Spot; 3]) -> u32 {
        self.corners.extend(corners);
        self.twins.extend([NONE; 3]);
        self.first.push(NONE);
        self.len() - 1
    }

    /// Makes `p`, which lies in `triangle` and is in its list, a vertex. The triangles that change are in
    /// [`Delaunay::touched`].
    pub fn insert(&mut self, p: Spot, triangle: u32) {
        let h = triangle * 3;
        let [a, b, c] = [0, 1, 2].map(|i| self.corners[(h + i) as usize]);
        let on = if turn(a, b, p) == 0 {
            Some(h)
        } else if turn(b, c, p) == 0 {
            Some(h + 1)
        } else if turn(c, a, p) == 0 {
            Some(h + 2)
        } else {
            None
        };
        match on {
            Some(edge) => self.split_edge(edge, p),
            None => self.split_face(triangle, p),
        }
        while let Some(h) = self.pending.pop() {
            self.legalize(h);
        }
    }

    fn split_face(&mut self, t: u32, p: Spot) {
        let h = t as usize * 3;
        let [a, b, c] = [self.corners[h], self.corners[h + 1], self.corners[h + 2]];
        let [ab, bc, ca] = [self.twins[h], self.twins[h + 1], self.twins[h + 2]];
        let (t1, t2) = (self.push([b, c, p]), self.push([c, a, p]));
        self.set(t1, [b, c, p], [bc, NONE, NONE]);
        self.set(t2, [c, a, p], [ca, NONE, t1 * 3 + 1]);
        self.set(t, [a, b, p], [ab, t1 * 3 + 2, t2 * 3 + 1]);
        let mut q = self.take_list(t);
        while q != NONE {
            let after = self.after(q);
            if q != p {
                let (of_a, of_b) = (turn(p, a, q), turn(p, b, q));
                let to = if of_a >= 0 && of_b <= 0 {
                    t
                } else if of_b >= 0 && turn(p, c, q) <= 0 {
                    t1
                } else {
                    t2
                };
                self.list(to, q);
            }
            q = after;
        }
        self.touched.extend([t, t1, t2]);
        self.pending.extend([t * 3, t1 * 3, t2 * 3]);
    }

    fn split_edge(&mut self, h: u32, p: Spot) {
        let t = h / 3;
        let (next, previous) = (next_of(h), previous_of(h));
        let [a, b, c] = [h, next, previous].map(|h| self.corners[h as usize]);
        let [g, bc, ca] = [h, next, previous].map(|h| self.twins[h as usize]);
        let tb = self.push([b, c, p]);
        self.set(tb, [b, c, p], [bc, NONE, NONE]);
        self.set(t, [c, a, p], [ca, NONE, tb * 3 + 1]);
        let mut q = self.take_list(t);
        while q != NONE {
            let after = self.after(q);
            if q != p {
                let to = if turn(p, c, q) >= 0 { t } else { tb };
                self.list(to, q);
            }
            q = after;
        }
        self.touched.extend([t, tb]);
        self.pending.extend([t * 3, tb * 3]);
        if g == NONE {
            return;
        }
        let u = g / 3;
        let (next, previous) = (next_of(g), previous_of(g));
        let d = self.corners[previous as usize];
        let [ad, db] = [next, previous].map(|h| self.twins[h as usize]);
        let ub = self.push([d, b, p]);
        self.set(ub, [d, b, p], [db, tb * 3 + 2, NONE]);
        self.set(u, [a, d, p], [ad, ub * 3 + 2, t * 3 + 1]);
        let mut q = self.take_list(u);
        while q != NONE {
            let after = self.after(q);
            if q != p {
                let to = if turn(p, d, q) <= 0 { u } else { ub };
                self.list(to, q);
            }
            q = after;
        }
        self.touched.extend([u, ub]);
        self.pending.extend([u * 3, ub * 3]);
    }

    /// Flips edge `h`, the first of its triangle, whose last corner is the new vertex, if the circle demands it.
    fn legalize(&mut self, h: u32) {
        let g = self.twins[h as usize];
        if g == NONE {
            return;
        }
        let t = h as usize / 3 * 3;
        let [x, y, p] = [self.corners[t], self.corners[t + 1], self.corners[t + 2]];
        let d = self.corners[previous_of(g) as usize];
        if in_circle(x, y, p, d) {
            self.flip(h);
        }
    }

    /// Replaces edge `h`, the first of its triangle, by the other diagonal of the two triangles beside it.
    fn flip(&mut self, h: u32) {
        let (t, g) = (h / 3, self.twins[h as usize]);
        let u = g / 3;
        let [x, y, p] = [0, 1, 2].map(|i| self.corners[(t * 3 + i) as usize]);
        let d = self.corners[previous_of(g) as usize];
        let [yp, px] = [1, 2].map(|i| self.twins[(t * 3 + i) as usize]);
        let [xd, dy] = [next_of(g), previous_of(g)].map(|h| self.twins[h as usize]);
        let lists = [self.take_list(t), self.take_list(u)];
        self.set(u, [d, y, p], [dy, yp, NONE]);
        self.set(t, [x, d, p], [xd, u * 3 + 2, px]);
        for mut q in lists {
            while q != NONE {
                let after = self.after(q);
                let to = if turn(d, p, q) >= 0 { t } else { u };
                self.list(to, q);
                q = after;
            }
        }
        self.touched.extend([t, u]);
        self.pending.extend([t * 3, u * 3]);
    }

    /// Makes the diagonal from `b` to `d` of a cell an edge. Both are vertices. If it is none yet, the cell's other diagonal is: the four
    /// corners lie on one circle with nothing else in it. `at_vertex` is a half edge out of each vertex, by index.
    pub fn settle_diagonal(&mut self, b: Spot, d: Spot, at_vertex: &mut [u32]) {
        let start = at_vertex[self.index(b)];
        let mut out = start;
        let mut opposite = NONE;
        let mut turned_back = false;
        while out != NONE {
            let (right, left) = (self.corners[next_of(out) as usize], self.corners[previous_of(out) as usize]);
            if right == d || left == d {
                return;
            }
            if turn(b, right, d) > 0 && turn(b, left, d) < 0 {
                opposite = next_of(out);
                break;
            }
            // To the border or around, then from the start to the border on the other side.
            let mut following = NONE;
            if !turned_back {
                following = self.twins[previous_of(out) as usize];
                if following == start {
                    break;
                }
                if following == NONE {
                    turned_back = true;
                    out = start;
                }
            }
            if turned_back {
                let twin = self.twins[out as usize];
                following = if twin == NONE { NONE } else { next_of(twin) };
            }
            out = following;
        }
        if opposite == NONE {
            return;
        }
        // `flip` takes the edge as the first of its triangle.
        let order = [opposite, next_of(opposite), previous_of(opposite)];
        let (corners, twins) = (order.map(|h| self.corners[h as usize]), order.map(|h| self.twins[h as usize]));
        let t = opposite / 3;
        self.set(t, corners, twins);
        let u = self.twins[t as usize * 3] / 3;
        self.flip(t * 3);
        self.pending.clear();
        for h in [t, u].into_iter().flat_map(|t| t * 3..t * 3 + 3) {
            let index = self.index(self.corners[h as usize]);
            at_vertex[index] = h;
        }
    }
}
