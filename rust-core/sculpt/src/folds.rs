//! Folds: an image may hide part of itself, because a point grid folds as seen along its rays, or a scan goes around more than once. Of
//! triangles that cover the same rays the nearest one stays, so that each ray meets the surface once.
//!
//! Nearest first, a triangle stays if it is seen beside all that stay so far. Others near it are found by a grid of windows. The decision
//! is exact. Two triangles are seen beside each other if an edge of one of them has the other one on its outer side and they touch in
//! pixels that they share at most. Around a sensor that tells those of one half of space alone: others are told by a plane between them.

use std::f64::consts::{FRAC_PI_2, PI};

use rayon::prelude::*;

use super::view::{Site, View};
use super::windows::{Grid, Windowed};
use base::error::Result;
use base::progress::Progress;
use image::range_image::{Projection, RangeImage, Samples};

/// Whether pixels of the image can hide one another at all.
pub(super) fn possible(image: &RangeImage) -> bool {
    match (image.projection(), image.samples()) {
        // Rays of one direction, rising in both axes; unless they go around or past a pole.
        (Projection::Spherical { first, step }, Samples::Values(_)) => {
            let sweep = |axis: usize, count: usize| step[axis].abs() * count.saturating_sub(1) as f64;
            let last = first[1] + step[1] * image.rows().saturating_sub(1) as f64;
            !(sweep(0, image.cols()) < 2.0 * PI && first[1].abs() <= FRAC_PI_2 && last.abs() <= FRAC_PI_2)
        }
        (_, Samples::Values(_)) => false,
        _ => true,
    }
}

/// Triangles handled by one thread at a time, and between two looks at the progress.
const BLOCK: usize = 4096;

/// Whether each triangle hides behind others, or is seen edge-on. The triangles turn like columns toward rows. O(n log n) time.
///
/// Being beside each other goes both ways, so a triangle that is beside all others stays and hides none: order counts only
/// among the rest, which mostly is empty.
pub(super) fn hidden<V: View>(view: &V, triangles: &[[u32; 3]], progress: &Progress<'_>) -> Result<Vec<bool>>
where
    V::Site: Windowed,
{
    let sites = |t: u32| triangles[t as usize].map(|p| (p, view.site(p)));
    let mut windows = vec![[[0.0; 2]; 2]; triangles.len()];
    let mut hidden = vec![false; triangles.len()];
    windows.par_chunks_mut(BLOCK).zip(hidden.par_chunks_mut(BLOCK)).enumerate().try_for_each(
        |(block, (windows, hidden))| {
            for (k, (window, hidden)) in windows.iter_mut().zip(hidden).enumerate() {
                let [a, b, c] = sites((block * BLOCK + k) as u32).map(|s| s.1);
                *window = V::Site::window([&a, &b, &c]);
                // A triangle is edge-on if the triangulation took it for seen from the front by a rounding.
                *hidden = V::Site::turn(&a, &b, &c) <= 0.0;
            }
            progress.check()
        },
    )?;
    let are_apart = |one: u32, other: u32| {
        let [one, other] = [one, other].map(|t| &windows[t as usize]);
        let apart = |axis: usize| one[axis][1] < other[axis][0] || other[axis][1] < one[axis][0];
        // Places beyond 1 may be places before it.
        (!V::Site::AROUND && apart(0)) || apart(1)
    };
    let is_beside_all = |t: u32, grid: &Grid| {
        let own = sites(t);
        grid.all(&windows[t as usize], |other| other == t || are_apart(t, other) || are_beside(&own, &sites(other)))
    };
    let mut grid = Grid::new(&windows, V::Site::AROUND);
    for t in 0..triangles.len() {
        if t % BLOCK == 0 {
            progress.check()?;
        }
        if !hidden[t] {
            grid.add(&windows[t], t as u32);
        }
    }
    let in_doubt = |block: &[bool], first: usize| {
        progress.check()?;
        let doubtful = |(k, hidden): (usize, &bool)| {
            let t = (first + k) as u32;
            (!hidden && !is_beside_all(t, &grid)).then_some(t)
        };
        Ok(block.iter().enumerate().filter_map(doubtful).collect::<Vec<_>>())
    };
    let in_doubt = hidden
        .par_chunks(BLOCK)
        .enumerate()
        .map(|(block, hidden)| in_doubt(hidden, block * BLOCK))
        .collect::<Result<Vec<_>>>()?;
    let mut order: Vec<(f64, u32)> = Vec::new();
    for t in in_doubt.into_iter().flatten() {
        let [a, b, c] = sites(t).map(|s| s.1);
        order.push((a.depth() / 3.0 + b.depth() / 3.0 + c.depth() / 3.0, t));
    }
    if order.is_empty() {
        return Ok(hidden);
    }
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    grid.clear();
    for (k, &(_, t)) in order.iter().enumerate() {
        if k % BLOCK == 0 {
            progress.check()?;
        }
        if is_beside_all(t, &grid) {
            grid.add(&windows[t as usize], t);
        } else {
            hidden[t as usize] = true;
        }
    }
    Ok(hidden)
}

/// A triangle's pixels as the sensor sees them.
type Seen<S> = [(u32, S); 3];

/// Whether two triangles have no place in common but that of pixels they share.
fn are_beside<S: Windowed>(one: &Seen<S>, other: &Seen<S>) -> bool {
    let mut touching = false;
    for (one, other) in [(one, other), (other, one)] {
        for i in 0..3 {
            let (from, to) = (&one[i].1, &one[(i + 1) % 3].1);
            let turns = [0, 1, 2].map(|k| S::turn(from, to, &other[k].1));
            if turns.iter().any(|&t| t > 0.0) {
                continue;
            }
            if (0..3).all(|k| turns[k] < 0.0 || shares(one, other[k].0)) {
                return true;
            }
            touching = true;
        }
    }
    (touching && !reaches(one, other) && !reaches(other, one))
        || S::on_two_sides(one.each_ref().map(|corner| &corner.1), other.each_ref().map(|corner| &corner.1))
}

fn shares<S>(triangle: &Seen<S>, pixel: u32) -> bool {
    triangle.iter().any(|corner| corner.0 == pixel)
}

/// Whether a corner of the other triangle is seen in or on the edge of one, and is none of its corners.
fn reaches<S: Site>(one: &Seen<S>, other: &Seen<S>) -> bool {
    let within = |p: &S| (0..3).all(|i| S::turn(&one[i].1, &one[(i + 1) % 3].1, p) >= 0.0);
    other.iter().any(|(pixel, site)| !shares(one, *pixel) && within(site))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::rays::Rays;
    use crate::view::CentralSite;
    use crate::windows::Window;
    use image::range_image::Viewing;

    /// Whether each of some triangles in space hides behind others, seen along -z and from a point far above.
    fn hidden_triangles(triangles: &[[[f32; 3]; 3]]) -> Vec<Vec<bool>> {
        let points: Vec<[f32; 3]> = triangles.iter().flatten().copied().collect();
        let corners: Vec<[u32; 3]> = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        [Viewing::Parallel(-DVec3::Z), Viewing::From(DVec3::Z * 100.0)]
            .into_iter()
            .map(|viewing| {
                let image = RangeImage::from_points(1, points.len(), points.clone(), viewing).unwrap();
                match Rays::new(&image, false) {
                    Rays::Parallel(view) => hidden(&view, &corners, &Progress::none()).unwrap(),
                    Rays::Central(view) => hidden(&view, &corners, &Progress::none()).unwrap(),
                    _ => unreachable!("point grids are seen along parallel rays or from a point"),
                }
            })
            .collect()
    }

    fn triangle(x: f32, y: f32, z: f32) -> [[f32; 3]; 3] {
        [[x, y, z], [x + 1.0, y, z], [x, y + 1.0, z]]
    }

    #[test]
    fn the_nearer_of_two_that_overlap_stays() {
        let pair = [triangle(0.0, 0.0, 0.0), triangle(0.25, 0.25, 1.0)];
        assert_eq!(hidden_triangles(&pair), vec![vec![true, false]; 2]);
        let inner = [[0.3, 0.3, -1.0], [0.4, 0.3, -1.0], [0.3, 0.4, -1.0]];
        assert_eq!(hidden_triangles(&[triangle(0.0, 0.0, 0.0), inner]), vec![vec![false, true]; 2]);
    }

    #[test]
    fn neighbours_and_what_lies_apart_stay() {
        let row: Vec<_> = (0..30).map(|i| triangle(1.5 * i as f32, 0.0, (i % 7) as f32 * 1e-3)).collect();
        assert_eq!(hidden_triangles(&row), vec![vec![false; 30]; 2]);
        // A lattice: edges on common lines, corners shared by six.
        let side = 9;
        let points = (0..side * side).map(|i| [(i % side) as f32, (i / side) as f32, 0.0]).collect();
        let image = RangeImage::from_points(side, side, points, Viewing::Parallel(-DVec3::Z)).unwrap();
        let Rays::Parallel(view) = Rays::new(&image, false) else { unreachable!("parallel rays") };
        let cell = |i: usize| (i / (side - 1) * side + i % (side - 1)) as u32;
        let down = side as u32;
        let triangles: Vec<[u32; 3]> = (0..(side - 1) * (side - 1))
            .map(cell)
            .flat_map(|a| [[a, a + 1, a + down + 1], [a, a + down + 1, a + down]])
            .collect();
        assert!(hidden(&view, &triangles, &Progress::none()).unwrap().iter().all(|h| !h));
    }

    #[test]
    fn work_grows_with_what_is_seen_however_far_outliers_lie() {
        // Numbers looked at for all triangles of a lattice, some of its corners at other scales.
        let looks = |side: usize, outliers: &[f32], eye: Option<f64>| {
            let mut points: Vec<[f32; 3]> =
                (0..side * side).map(|i| [(i % side) as f32, (i / side) as f32, 0.0]).collect();
            let (corner, middle) = (points.len() - 1, points.len() / 2 + side / 2);
            for (k, &far) in outliers.iter().enumerate() {
                points[[corner, middle, 0, middle / 2][k % 4]] = [far, -far, 0.0];
            }
            let viewing = eye.map_or(Viewing::Parallel(-DVec3::Z), |z| Viewing::From(DVec3::Z * z));
            let image = RangeImage::from_points(side, side, points, viewing).unwrap();
            let cells = (0..(side - 1) * (side - 1)).map(|i| (i / (side - 1) * side + i % (side - 1)) as u32);
            let down = side as u32;
            let triangles: Vec<[u32; 3]> =
                cells.flat_map(|a| [[a, a + 1, a + down + 1], [a, a + down + 1, a + down]]).collect();
            let windows: Vec<Window> = match Rays::new(&image, false) {
                Rays::Parallel(view) => windows_of(&view, &triangles),
                Rays::Central(view) => windows_of(&view, &triangles),
                _ => unreachable!("a point grid"),
            };
            let mut grid = Grid::new(&windows, eye.is_some());
            (0..).zip(&windows).for_each(|(t, window)| grid.add(window, t));
            let mut looks = 0_u64;
            for (t, window) in (0..).zip(&windows) {
                let mut met = false;
                assert!(grid.all(window, |other| {
                    looks += 1;
                    met |= other == t;
                    true
                }));
                assert!(met, "what was added to a window is found in it");
            }
            looks as f64 / triangles.len() as f64
        };
        for eye in [None, Some(50.0)] {
            for outliers in [&[][..], &[1e9, 1e9, -1e9, 1e9], &[1e3, 1e9, 1e15, -1e20]] {
                let [small, large] = [100, 200].map(|side| looks(side, outliers, eye));
                assert!(large < 250.0 && large < 1.5 * small, "{small} to {large} a triangle beside {outliers:?}");
            }
        }
    }

    fn windows_of<V: View>(view: &V, triangles: &[[u32; 3]]) -> Vec<Window>
    where
        V::Site: Windowed,
    {
        let window = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|p| view.site(p));
            V::Site::window([&a, &b, &c])
        };
        triangles.iter().map(window).collect()
    }

    #[test]
    fn what_touches_another_elsewhere_than_in_a_shared_pixel_hides() {
        // Two on one line, one with a corner on the line of the first.
        let beside = [[1.0, 1.0, -1.0], [0.5, 0.5, -1.0], [1.0, 0.5, -1.0]];
        assert_eq!(hidden_triangles(&[triangle(0.0, 0.0, 0.0), beside])[0], [false, true]);
        assert_eq!(hidden_triangles(&[triangle(0.0, 0.0, 0.0), triangle(1.0, 0.0, -1.0)])[0], [false, true]);
    }

    #[test]
    fn around_the_sensor_and_over_its_pole_nothing_is_missed() {
        // Fans of triangles around the axes, each twice, at two distances.
        for (axis, u, v) in [(DVec3::Z, DVec3::X, DVec3::Y), (-DVec3::X, DVec3::Y, -DVec3::Z)] {
            let at = |i: u32, r: f64| {
                let angle = f64::from(i) * PI / 4.0;
                r * (axis + 0.1 * (u * angle.cos() + v * angle.sin()))
            };
            let points = [1.0, 2.0].into_iter().flat_map(|r| (0..8).map(move |i| at(i, r)).chain([axis * r]));
            let points: Vec<[f32; 3]> = points.map(|p| p.as_vec3().to_array()).collect();
            let image = RangeImage::from_points(2, 9, points, Viewing::From(DVec3::ZERO)).unwrap();
            for mirrored in [false, true] {
                let Rays::Central(view) = Rays::new(&image, mirrored) else { unreachable!("rays from a point") };
                let turned = |[a, b, c]: [u32; 3]| {
                    let turn = CentralSite::turn(&view.site(a), &view.site(b), &view.site(c));
                    if turn > 0.0 { [a, b, c] } else { [a, c, b] }
                };
                let fan = |i: u32, start: u32| turned([start + 8, start + i, start + (i + 1) % 8]);
                let corners: Vec<[u32; 3]> = (0..8).flat_map(|i| [fan(i, 0), fan(i, 9)]).collect();
                assert_eq!(hidden(&view, &corners, &Progress::none()).unwrap(), [false, true].repeat(8));
            }
        }
    }
}
