//! Bodies of a closed surface: how they are turned, and how they lie in each other.
//!
//! A body's surface is counted by how often others enclose it. Faces above one of its places are counted along a line straight up. Which of
//! them the line meets is exact. A line through an edge or a vertex counts as if it lay a hair farther along x, and less along y.

use std::cmp::Ordering;

use glam::{DVec2, DVec3, Vec3Swizzles};
use rayon::prelude::*;

use base::error::Result;
use base::progress::{Pace, Progress};
use geom::predicates::{orient2d, orient3d};
use mesh::TriMesh;
use mesh::holes::Bounds;
use mesh::measure::area;

use super::crossing::Tree;
use super::cut;

/// A body of a mesh: faces joined over edges.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    /// Its faces.
    pub faces: usize,
    /// Its area.
    pub area: f64,
    /// Its volume. Negative for a cavity, and for a body that is inside out. Of an open body it depends on where its first vertex lies.
    pub volume: f64,
    /// Centre of its largest face.
    pub place: DVec3,
    /// How often the bodies around it enclose it. A body that is inside out counts as -1. It is known of closed meshes.
    pub around: i32,
}

/// Kinds of bodies, by where they lie and how they are turned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lies {
    /// Outside of all others, or in a cavity.
    Outer,
    /// A cavity.
    Cavity,
    /// Turned, so that the outside is inside.
    InsideOut,
    /// In the solid of another, or a cavity within such a body.
    Nested,
    /// Without volume.
    Flat,
}

impl Body {
    /// Its kind.
    pub fn lies(&self) -> Lies {
        let turn = i32::from(self.volume > 0.0) - i32::from(self.volume < 0.0);
        match (self.around, turn) {
            (_, 0) => Lies::Flat,
            (0, 1) => Lies::Outer,
            (1, -1) => Lies::Cavity,
            (around, _) if around > 0 => Lies::Nested,
            _ => Lies::InsideOut,
        }
    }

    /// Whether it lies otherwise than another: in other bodies, or turned over.
    pub fn lies_unlike(&self, other: &Body) -> bool {
        (self.around, self.lies()) != (other.around, other.lies())
    }
}

/// The bodies of a mesh.
#[derive(Clone, Debug, Default)]
pub struct Bodies {
    /// The body of each face.
    pub of: Vec<u32>,
    /// The bodies in the order of their first faces.
    pub list: Vec<Body>,
}

impl Bodies {
    /// Of any mesh. How they lie in each other is known if it `is_closed`, as far as they do not cross.
    ///
    /// Cost: O(n log n) for n faces.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn new(mesh: &TriMesh, is_closed: bool, progress: &Progress<'_>) -> Result<Self> {
        let (of, count) = cut::pieces(&mesh.triangles, progress)?;
        let mut bodies = Bodies { of, list: vec![Body::default(); count] };
        bodies.list = bodies.at(&mesh.positions, &mesh.triangles, is_closed, progress)?;
        Ok(bodies)
    }

    /// The bodies once their vertices lie elsewhere.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn at(
        &self,
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        is_closed: bool,
        progress: &Progress<'_>,
    ) -> Result<Vec<Body>> {
        let mut pace = Pace::new(progress);
        let mut list = vec![Body::default(); self.list.len()];
        let mut first = vec![DVec3::ZERO; list.len()];
        let mut largest = vec![f64::NEG_INFINITY; list.len()];
        for (corners, &body) in triangles.iter().zip(&self.of) {
            pace.after(4)?;
            let corners = corners.map(|v| positions[v as usize]);
            let (own, body, number) = (area(corners), &mut list[body as usize], body as usize);
            if body.faces == 0 {
                first[number] = corners[0];
            }
            if own > largest[number] {
                (largest[number], body.place) = (own, (corners[0] + corners[1] + corners[2]) / 3.0);
            }
            let [a, b, c] = corners.map(|place| place - first[number]);
            body.faces += 1;
            body.area += own;
            body.volume += a.dot(b.cross(c)) / 6.0;
        }
        if is_closed && list.len() > 1 {
            self.look_around(&mut list, positions, triangles, progress)?;
        }
        Ok(list)
    }

    fn look_around(
        &self,
        list: &mut [Body],
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        progress: &Progress<'_>,
    ) -> Result<()> {
        let corners = |t: u32| triangles[t as usize].map(|v| positions[v as usize]);
        let boxes = (0..triangles.len() as u32).map(|t| (t, Bounds::of(corners(t)))).collect();
        let tree = Tree::new(boxes, progress)?;
        list.par_iter_mut().enumerate().with_min_len(64).try_for_each(|(number, body)| {
            let mut pace = Pace::new(progress);
            let line = Bounds { min: body.place, max: body.place.with_z(f64::INFINITY) };
            let mut around = 0;
            tree.meeting(&line, &mut |t| {
                pace.after(8)?;
                if self.of[t as usize] as usize != number {
                    around += above(body.place, corners(t));
                }
                Ok(true)
            })?;
            body.around = around;
            Ok(())
        })
    }
}

/// 1 if a line straight up from a place leaves through a triangle, -1 if it enters through it, 0 if it does not meet it.
fn above(place: DVec3, [a, b, c]: [DVec3; 3]) -> i32 {
    let flat = |from: DVec3, to: DVec3| beside(from.xy(), to.xy(), place.xy());
    let turn = flat(a, b);
    let is_met = turn != 0 && flat(b, c) == turn && flat(c, a) == turn;
    if is_met && orient3d(a, b, c, place) == turn { i32::from(turn) } else { 0 }
}

/// The side of a line on which a place lies that is moved by a hair along x and by far less along y.
fn beside(from: DVec2, to: DVec2, place: DVec2) -> i8 {
    let sign = |order: Ordering| order as i8;
    match orient2d(from, to, place) {
        0 if from.y != to.y => sign(from.y.total_cmp(&to.y)),
        0 if from.x != to.x => sign(to.x.total_cmp(&from.x)),
        side => side,
    }
}

#[cfg(test)]
mod tests {
    use mesh::shapes::Shape;
    use proptest::prelude::*;

    use super::*;

    /// Boxes as one mesh, each by its middle, half its side and whether it is turned.
    fn boxes(of: &[(DVec3, f64, bool)]) -> TriMesh {
        let mut mesh = TriMesh::default();
        for &(middle, half, is_turned) in of {
            let one = Shape::Cuboid { half: DVec3::splat(half) }.mesh(1);
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(one.positions.iter().map(|p| *p + middle));
            let turned = |[a, b, c]: [u32; 3]| if is_turned { [a, c, b] } else { [a, b, c] };
            mesh.triangles.extend(one.triangles.iter().map(|t| turned(*t).map(|v| v + first)));
        }
        mesh
    }

    fn kinds(of: &[(DVec3, f64, bool)]) -> Vec<Lies> {
        let bodies = Bodies::new(&boxes(of), true, &Progress::none()).unwrap();
        bodies.list.iter().map(Body::lies).collect()
    }

    #[test]
    fn each_body_is_judged_by_what_lies_around_it() {
        let o = DVec3::ZERO;
        assert_eq!(kinds(&[(o, 1.0, false), (o, 3.0, true)]), [Lies::InsideOut, Lies::InsideOut]);
        assert_eq!(
            kinds(&[(o, 3.0, false), (o, 2.0, true), (o, 1.0, false)]),
            [Lies::Outer, Lies::Cavity, Lies::Outer]
        );
        assert_eq!(kinds(&[(o, 3.0, false), (o, 1.0, false)]), [Lies::Outer, Lies::Nested]);
        // Beside each other, and one on the other: the line straight up runs through edges and corners.
        let beside = 8.0 * DVec3::Z;
        assert_eq!(kinds(&[(o, 3.0, false), (beside, 1.0, true)]), [Lies::Outer, Lies::InsideOut]);
        assert_eq!(kinds(&[(o, 1.0, false), (DVec3::new(2.0, 0.0, 2.0), 1.0, false)]), [Lies::Outer; 2]);
        let mut flat = boxes(&[(o, 1.0, false)]);
        flat.positions.iter_mut().for_each(|p| p.z = 0.0);
        assert_eq!(Bodies::new(&flat, true, &Progress::none()).unwrap().list[0].lies(), Lies::Flat);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(base::tier::cases(200)))]

        /// Boxes within boxes and beside them, on a lattice, so that lines meet edges and corners.
        #[test]
        fn boxes_are_counted_as_their_bounds_say(
            places in prop::collection::vec(([-6..7_i32, -6..7, -6..7], 1..5_i32, prop::bool::ANY), 1..8),
        ) {
            let of: Vec<(DVec3, f64, bool)> =
                places.iter().map(|&(p, half, turned)| (DVec3::from(p.map(f64::from)), f64::from(half), turned)).collect();
            let bounds: Vec<Bounds> =
                of.iter().map(|&(middle, half, _)| Bounds { min: middle - half, max: middle + half }).collect();
            let is_clear = |a: &Bounds, b: &Bounds| {
                let inner = |a: &Bounds, b: &Bounds| a.min.cmplt(b.min).all() && b.max.cmplt(a.max).all();
                !a.meets(b) || inner(a, b) || inner(b, a)
            };
            for (k, a) in bounds.iter().enumerate() {
                prop_assume!(bounds[..k].iter().all(|b| is_clear(a, b)));
            }
            let bodies = Bodies::new(&boxes(&of), true, &Progress::none()).unwrap();
            for (k, body) in bodies.list.iter().enumerate() {
                let encloses = |j: usize| j != k && bounds[j].encloses(&bounds[k]);
                let around: i32 = (0..of.len()).filter(|&j| encloses(j)).map(|j| if of[j].2 { -1 } else { 1 }).sum();
                prop_assert_eq!(body.around, around);
                prop_assert_eq!(body.volume < 0.0, of[k].2);
            }
        }
    }
}
