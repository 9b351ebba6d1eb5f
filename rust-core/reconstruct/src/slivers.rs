//! The circumscribed balls of cells so flat that doubles lose their volume.
//!
//! Rows of a range image lie in planes, but for what rounding or the last digits of a file leave. At the sides of the image, cells as flat
//! as that join samples far from each other, and their balls are huge: empty space flows to the outside through them. A ball that is
//! taken for a small one dams it up, and what lies behind it looks like a room inside.

use glam::DVec3;

use geom::double_double::{self, DoubleDouble, Vector};

/// A cell is too flat for twice the precision as well if its volume is less than this share of that of a box over its edges.
const FLATTEST: f64 = 1e-28;

/// The centre of the ball through the corners of a cell as seen from the first of them, and whether it lies on the cell's side of the facet
/// opposite to each. `None` for cells that lie in a plane as far as can be told.
pub(super) fn ball([a, b, c, d]: [DVec3; 4]) -> Option<(DVec3, [bool; 4])> {
    let edges @ [u, v, w] = [b, c, d].map(|corner| double_double::difference(corner, a));
    let normals = [double_double::cross(v, w), double_double::cross(w, u), double_double::cross(u, v)];
    let volume = double_double::dot(u, normals[0]);
    let squares = edges.map(|edge| double_double::dot(edge, edge));
    let flattest = FLATTEST * squares.iter().map(|square| square.value()).product::<f64>().sqrt();
    // Also for NaN.
    if !(volume.value().abs() > flattest) {
        return None;
    }
    // Times twice the volume.
    let centre: Vector = [0, 1, 2].map(|axis| {
        let part = |k: usize| normals[k][axis] * squares[k];
        part(0) + part(1) + part(2)
    });
    // Volumes of the cells that the centre makes with the facets, times twice the volume: positive on the cell's side of them.
    let [beside_b, beside_c, beside_d] = normals.map(|normal| double_double::dot(centre, normal));
    let beside_a = volume * volume + volume * volume - beside_b - beside_c - beside_d;
    let sides = [beside_a, beside_b, beside_c, beside_d].map(|beside| beside.value() >= 0.0);
    Some((DVec3::from_array(centre.map(DoubleDouble::value)) * (0.5 / volume.value()), sides))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn cross(a: [i128; 3], b: [i128; 3]) -> [i128; 3] {
        [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i])
    }

    fn dot(a: [i128; 3], b: [i128; 3]) -> i128 {
        (0..3).map(|k| a[k] * b[k]).sum()
    }

    proptest! {
        /// Parallelograms, one corner a step off their plane: integers say what is exact.
        #[test]
        fn balls_of_slivers_are_those_of_integers(
            long in 1_i128 << 17..1 << 18, short in 1_i128..1 << 12, [p, q, r] in [-9_i128..10, -9_i128..10, 0..2_i128],
            far in prop::sample::select(vec![0.0, 1e3, -7e7]),
        ) {
            let (u, v) = ([long, p, 0], [q, long - short, 1]);
            let w = [u[0] + v[0], u[1] + v[1] + 1, u[2] + v[2] + r];
            let normals = [cross(v, w), cross(w, u), cross(u, v)];
            let (volume, squares) = (dot(u, normals[0]), [u, v, w].map(|edge| dot(edge, edge)));
            let centre = [0, 1, 2].map(|axis| (0..3).map(|k| normals[k][axis] * squares[k]).sum::<i128>());
            let beside = normals.map(|normal| dot(centre, normal));
            let first = 2 * volume * volume - beside.iter().sum::<i128>();
            let corner = |edge: [i128; 3]| DVec3::splat(far) + DVec3::from_array(edge.map(|x| x as f64));
            let (found, sides) = ball([[0; 3], u, v, w].map(corner)).unwrap();
            let exact = DVec3::from_array(centre.map(|x| x as f64 / (2.0 * volume as f64)));
            prop_assert!(found.distance(exact) <= 1e-12 * exact.length(), "{} instead of {}", found, exact);
            prop_assert_eq!(sides, [first, beside[0], beside[1], beside[2]].map(|beside| beside >= 0));
        }
    }

    #[test]
    fn cells_in_a_plane_have_none() {
        assert_eq!(ball([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y]), None);
        assert_eq!(ball([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::splat(f64::NAN)]), None);
    }
}
