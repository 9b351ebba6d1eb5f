//! Places where the border of the mesh may run straight past a pixel that it went through before.
//!
//! As a rule only along straight lines of the lattice. If borders are simplified, along any edge that *hugs* the domain:
//!
//! ```text
//!   invalid  . o-------___          o  the edge from pixel to pixel,
//!              |\_____     ----___     at most half a pixel, along rows and columns, from
//!   domain     +-----+----+-----+--o   the line of border pixels next to it on the inner side
//! ```
//!
//! That line has one pixel per column (or row) between the ends, each joined to the next by an edge of the domain's border. It is the whole
//! border between the ends. No pixel lies between the two. So nothing else is covered and no valid pixel is lost. Edges of the lattice
//! don't cross, so no two parts of the mesh come to lie over each other. Neighbours on the line are joined by triangles of the domain: no
//! jump is bridged.
//!
//! Off the lattice the same holds of rows and columns, and the samples must be seen so, too: the pixel on the inner side,
//! and no other pixel of the border in between.

use super::domain::Domain;
use super::view::{Site, View};
use super::windows::{Grid, Windowed};

/// Questions of a patch about borders.
pub(super) trait Border: Sync {
    /// Whether the border, which runs through the pixels `from`, `past`, `to` with the domain on its left, may run straight
    /// from the first to the last of them.
    fn may_pass(&self, from: u32, past: u32, to: u32) -> bool;

    /// Whether the half edge of a triangle may lie on the border: it does if no triangle lies beyond it.
    fn is_border(&self, from: u32, to: u32) -> bool;

    /// Whether a triangle may lie beyond an edge of the domain's border: one under an edge that hugs the domain farther out.
    fn reaches_out(&self) -> bool {
        true
    }
}

/// Places where a mesh may be, and where its border may change.
#[derive(Clone, Copy)]
pub(super) struct Region<'a> {
    pub domain: &'a Domain,
    pub border: &'a dyn Border,
}

/// Borders that change along straight lines of the lattice only. Off the lattice, where hardly any are straight, they change nowhere.
pub(super) struct Straight<'a> {
    pub domain: &'a Domain,
    pub on_lattice: bool,
}

impl Border for Straight<'_> {
    fn may_pass(&self, from: u32, past: u32, to: u32) -> bool {
        let [a, b, c] = [from, past, to].map(|p| self.domain.place(p));
        let (ab, bc) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
        self.on_lattice && ab[0] * bc[1] == ab[1] * bc[0] && ab[0] * bc[0] + ab[1] * bc[1] > 0
    }

    fn is_border(&self, from: u32, to: u32) -> bool {
        self.domain.is_border(from, to)
    }

    fn reaches_out(&self) -> bool {
        false
    }
}

/// Simplified borders of an image on the lattice.
pub(super) struct Hugging<'a> {
    pub domain: &'a Domain,
}

impl Border for Hugging<'_> {
    fn may_pass(&self, from: u32, past: u32, to: u32) -> bool {
        let mut met = false;
        hugs(self.domain, from, to, |pixel| met |= pixel == past) && met
    }

    fn is_border(&self, from: u32, to: u32) -> bool {
        self.domain.is_border(from, to) || hugs(self.domain, from, to, |_| {})
    }
}

/// Simplified borders off the lattice.
pub(super) struct Fenced<'a, V> {
    view: &'a V,
    hugging: Hugging<'a>,
    /// All pixels of the border, by where they are seen.
    pixels: Vec<u32>,
    grid: Grid,
}

impl<'a, V: View> Fenced<'a, V>
where
    V::Site: Windowed,
{
    /// O(pixels).
    pub fn new(view: &'a V, domain: &'a Domain) -> Self {
        let pixels: Vec<u32> = domain.pixels.iter().copied().filter(|&p| domain.is_on_border(p)).collect();
        let window = |&p: &u32| {
            let site = view.site(p);
            V::Site::window([&site; 3])
        };
        let windows: Vec<_> = pixels.iter().map(window).collect();
        let mut grid = Grid::new(&windows, V::Site::AROUND);
        for (k, window) in windows.iter().enumerate() {
            grid.add(window, k as u32);
        }
        Fenced { view, hugging: Hugging { domain }, pixels, grid }
    }
}

impl<V: View> Border for Fenced<'_, V>
where
    V::Site: Windowed,
{
    fn may_pass(&self, from: u32, past: u32, to: u32) -> bool {
        if !self.hugging.may_pass(from, past, to) {
            return false;
        }
        let [a, b, c] = [from, past, to].map(|p| self.view.site(p));
        if !(V::Site::turn(&a, &c, &b) >= 0.0) {
            return false;
        }
        let between = |q: u32| {
            let q = self.view.site(q);
            V::Site::turn(&a, &c, &q) >= 0.0 && V::Site::turn(&c, &b, &q) > 0.0 && V::Site::turn(&b, &a, &q) > 0.0
        };
        self.grid.all(&V::Site::window([&a, &b, &c]), |k| {
            let q = self.pixels[k as usize];
            [from, past, to].contains(&q) || !between(q)
        })
    }

    fn is_border(&self, from: u32, to: u32) -> bool {
        self.hugging.is_border(from, to)
    }
}

/// Whether the edge between two pixels hugs the domain, which lies on its left: turning from it like columns toward rows.
/// `visit` is called for pixels of the line in between, all of them if it does.
fn hugs(domain: &Domain, from: u32, to: u32, mut visit: impl FnMut(u32)) -> bool {
    let (a, b) = (domain.place(from), domain.place(to));
    let d = [b[0] - a[0], b[1] - a[1]];
    // One pixel a step along the axis of the longer side; inward along the other axis.
    let along = usize::from(d[1].abs() > d[0].abs());
    let across = 1 - along;
    let inward = if along == 0 { d[0].signum() } else { -d[1].signum() };
    let (steps, rise) = (d[along].abs(), d[across] * inward);
    let mut last = a;
    for i in 1..=steps {
        // The first pixel on or inside of the edge, and how far inside it lies, in pixels by `steps`.
        let depth = (i * rise).div_euclid(steps) + i64::from((i * rise).rem_euclid(steps) != 0);
        if 2 * (depth * steps - i * rise) > steps + rise.abs() {
            return false;
        }
        let mut place = a;
        place[along] += d[along].signum() * i;
        place[across] += inward * depth;
        if !domain.is_border_step(last, place) {
            return false;
        }
        if i < steps {
            let pixel = domain.pixel(place);
            if domain.fans(pixel) != 1 {
                return false;
            }
            visit(pixel);
        }
        last = place;
    }
    steps > 0
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Checks what simplified borders must keep to. No pixel but those of the domain is covered, no place twice, and each place of the
    /// domain once. The mesh reaches at most half a pixel beyond it along rows and columns.
    pub fn assert_reaches_half_a_pixel(domain: &Domain, triangles: &[[u32; 3]]) {
        let cols = i64::from(domain.cols);
        let place = |p: u32| [(i64::from(p) % cols) as f64, (i64::from(p) / cols) as f64];
        let within = |t: &[u32; 3], [x, y]: [f64; 2]| {
            let corners = t.map(place);
            let turns = [0, 1, 2].map(|i| {
                let ([ax, ay], [bx, by]) = (corners[i], corners[(i + 1) % 3]);
                (bx - ax) * (y - ay) - (by - ay) * (x - ax)
            });
            turns.iter().all(|&turn| turn >= 0.0) || turns.iter().all(|&turn| turn <= 0.0)
        };
        let mut covered = vec![false; domain.rows as usize * domain.cols as usize];
        for &p in &domain.pixels {
            covered[p as usize] = true;
        }
        // Places beside the lines of the lattice.
        const FINE: i64 = 4;
        let side = [domain.cols, domain.rows].map(|n| (i64::from(n) * FINE) as usize);
        let mut layers = vec![0_u8; side[0] * side[1]];
        let mut inside = layers.clone();
        let fine = |i: i64, j: i64| [(i as f64 + 0.371_3) / FINE as f64, (j as f64 + 0.451_9) / FINE as f64];
        for (list, counts) in [(triangles, &mut layers), (&domain.triangles, &mut inside)] {
            for t in list {
                let corners = t.map(place);
                let range = |axis: usize| {
                    let c = corners.map(|c| c[axis] as i64);
                    c[0].min(c[1]).min(c[2])..=c[0].max(c[1]).max(c[2])
                };
                for y in range(1) {
                    for x in range(0) {
                        if within(t, [x as f64, y as f64]) {
                            assert!(covered[(y * cols + x) as usize], "pixel {x}, {y} is covered");
                        }
                        for k in 0..FINE * FINE {
                            let [i, j] = [x * FINE + k % FINE, y * FINE + k / FINE];
                            if within(t, fine(i, j)) {
                                counts[j as usize * side[0] + i as usize] += 1;
                            }
                        }
                    }
                }
            }
        }
        assert!(layers.iter().zip(&inside).all(|(&n, &whole)| n <= 1 && n >= whole), "folded or torn");
        // The square of a pixel around a place meets a half cell if it meets its box and reaches over its diagonal.
        let near = |x: f64, y: f64| {
            domain.triangles.iter().any(|t| {
                let corners = t.map(place);
                let ends = |axis: usize| {
                    let c = corners.map(|c| c[axis]);
                    (c[0].min(c[1]).min(c[2]), c[0].max(c[1]).max(c[2]))
                };
                let ((left, right), (top, bottom)) = (ends(0), ends(1));
                let most = 0.5 + 1e-12;
                if x < left - most || x > right + most || y < top - most || y > bottom + most {
                    return false;
                }
                [-most, most].into_iter().any(|dx| {
                    [-most, most]
                        .into_iter()
                        .any(|dy| within(t, [(x + dx).clamp(left, right), (y + dy).clamp(top, bottom)]))
                })
            })
        };
        for t in triangles {
            for i in 0..3 {
                let ([ax, ay], [bx, by]) = (place(t[i]), place(t[(i + 1) % 3]));
                if domain.triangles.len() < 1500 && (ax - bx).abs() + (ay - by).abs() > 2.0 {
                    for k in 1..24 {
                        let share = f64::from(k) / 24.0;
                        assert!(near(ax + share * (bx - ax), ay + share * (by - ay)), "({ax}, {ay}) to ({bx}, {by})");
                    }
                }
            }
        }
    }
}
