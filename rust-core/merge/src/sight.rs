//! What scans see through is not there: flying pixels, veils at jumps, things that moved. \[MAW07\] votes so on depths;
//! here on the intersections.
//!
//! Every scan whose lines of sight are known votes on every tally: it has a surface there, or it sees through. What more
//! scans see through than have a surface there goes, before anything is made of it. Two at least have to, since a rod
//! thinner than a pixel is missed now and then.

use std::sync::Arc;
use std::sync::atomic::{AtomicU16, Ordering::Relaxed};

use glam::DVec3;
use rayon::prelude::*;

use super::crossing::OnLine;
use super::field::Bundles;
use super::lattice::{ACROSS, BRICK, BRICK_BITS, Lattice};
use super::lines::{SortedBundle, sort_tallies};
use super::numbers::Roll;
use super::tally::Tally;
use base::error::Result;
use base::progress::Progress;
use image::range_image::noise::Noise;
use image::sight::{LinesOfSight, Seen};
use image::source::Measured;

/// At most so many scans vote, those of the smallest numbers, which is as good as by chance: more would tell the same.
const MOST_VOTERS: usize = 256;
/// What fewer scans see through stays.
const LEAST_THROUGH: u16 = 2;

/// The votes on a tally.
#[derive(Default)]
pub struct Votes {
    surface: AtomicU16,
    through: AtomicU16,
}

impl Votes {
    fn is_through(&self) -> bool {
        is_through(self.through.load(Relaxed), self.surface.load(Relaxed))
    }
}

/// What the scans see at the tallies of each bundle; nothing where none votes. `images` is what was measured of those that are range images,
/// by number. Surfaces may be off by `tolerance`, in world units.
///
/// # Errors
/// A scan can't be loaded any more; cancelled.
pub fn ask(
    bundles: &Bundles,
    roll: &Roll<'_>,
    images: &[(u32, Measured)],
    lattice: &Lattice,
    tolerance: f64,
    progress: &Progress<'_>,
) -> Result<Vec<Vec<Votes>>> {
    let voters = voters(images);
    if voters.is_empty() {
        return Ok(Vec::new());
    }
    let votes: Vec<Vec<Votes>> =
        bundles.list.iter().map(|bundle| bundle.list.iter().map(|_| Votes::default()).collect()).collect();
    voters.par_iter().with_max_len(1).try_for_each(|&(scan, noise)| {
        progress.advance(1)?;
        let Some(sight) = lines_of_sight(roll, scan, noise, progress)? else { return Ok(()) };
        (bundles.list.iter().zip(&votes)).try_for_each(|(bundle, votes)| {
            progress.check()?;
            look(&sight, bundle, lattice, tolerance, |tally, seen| {
                let of_kind = if seen == Seen::Through { &votes[tally].through } else { &votes[tally].surface };
                of_kind.fetch_add(1, Relaxed);
            });
            Ok(())
        })
    })?;
    Ok(votes)
}

/// Drops what the scans see through. Gives the rest and the number of tallies dropped.
///
/// # Errors
/// Cancelled.
pub fn drop_seen_through(bundles: Bundles, votes: Vec<Vec<Votes>>, progress: &Progress<'_>) -> Result<(Bundles, u64)> {
    if votes.is_empty() {
        return Ok((bundles, 0));
    }
    let mut dropped = 0;
    let list = (bundles.list.into_iter().zip(votes))
        .map(|(bundle, votes)| {
            if !votes.iter().any(Votes::is_through) {
                return Ok(bundle);
            }
            progress.check()?;
            let left = without(Arc::unwrap_or_clone(bundle), votes.iter().map(Votes::is_through));
            dropped += left.1;
            Ok(Arc::new(left.0))
        })
        .filter(|bundle| bundle.as_ref().map_or(true, |bundle| !bundle.list.is_empty()))
        .collect::<Result<_>>()?;
    Ok((Bundles::new(list), dropped))
}

/// The numbers of the scans that vote, with their noise; none where they are too few.
pub fn voters(images: &[(u32, Measured)]) -> Vec<(u32, &Noise)> {
    let mut noises: Vec<_> =
        images.iter().filter(|image| image.1.has_lines_of_sight).map(|(scan, image)| (*scan, &image.noise)).collect();
    // One has it, others see through.
    if noises.len() <= usize::from(LEAST_THROUGH) {
        return Vec::new();
    }
    noises.truncate(MOST_VOTERS);
    noises
}

/// A scan, by its number, made to be asked what it sees.
///
/// # Errors
/// It can't be loaded any more; cancelled.
pub fn lines_of_sight(
    roll: &Roll<'_>,
    number: u32,
    noise: &Noise,
    progress: &Progress<'_>,
) -> Result<Option<LinesOfSight>> {
    let place = roll.place(number).expect("it is of a scan of the roll");
    match roll.sources[place].image(progress)? {
        Some(image) => LinesOfSight::new(&image, noise.clone(), progress),
        None => Ok(None),
    }
}

/// Whether a tally goes that so many scans see through, and so many have a surface at.
pub fn is_through(through: u16, surface: u16) -> bool {
    through >= LEAST_THROUGH && through > surface
}

/// A bundle without the tallies that go, and how many these were.
pub fn without(mut bundle: SortedBundle, mut goes: impl Iterator<Item = bool>) -> (SortedBundle, u64) {
    let before = bundle.list.len();
    bundle.list.retain(|_| !goes.next().is_some_and(|goes| goes));
    let dropped = (before - bundle.list.len()) as u64;
    bundle.list.sort_unstable_by_key(Tally::key);
    (sort_tallies(bundle.key, bundle.list), dropped)
}

/// Calls `each` with the place in the list of each tally of a bundle that a scan votes on, and what it sees there.
pub fn look(
    sight: &LinesOfSight,
    bundle: &SortedBundle,
    lattice: &Lattice,
    tolerance: f64,
    mut each: impl FnMut(usize, Seen),
) {
    let axis = bundle.key.axis as usize;
    let [u, v] = ACROSS[axis];
    let mut first_node = [0; 3];
    [first_node[u], first_node[v]] = bundle.key.across.map(|brick| brick << BRICK_BITS);
    let half = 0.5 * lattice.voxel * f64::from(BRICK);
    for (i, &(along, first)) in bundle.bricks.iter().enumerate() {
        first_node[axis] = along << BRICK_BITS;
        let centre = lattice.world(first_node, axis, 0.0) + DVec3::splat(half);
        if !sight.may_see(centre, 3.0_f64.sqrt() * half + tolerance) {
            continue;
        }
        let (from, to) = (first as usize, bundle.bricks.get(i + 1).map_or(bundle.list.len(), |next| next.1 as usize));
        for (place, tally) in (from..to).zip(&bundle.list[from..to]) {
            let line = tally.line() as i32;
            let mut node = first_node;
            node[u] += line & (BRICK - 1);
            node[v] += line >> BRICK_BITS;
            node[axis] = tally.cell;
            let at = lattice.world(node, axis, tally.fraction());
            match sight.see(at, tally.deviation() * lattice.voxel, tolerance) {
                Seen::Nothing => {}
                seen => each(place, seen),
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::f64::consts::TAU;

    use super::super::{MergeParams, Merged, run};
    use super::*;
    use geom::bvh::Bvh;
    use image::RangeImage;
    use image::range_image::test_images::as_point_grid;
    use image::range_image::{Samples, Viewing};
    use image::source::{Loading, ScanSource};
    use mesh::TriMesh;
    use mesh::shapes::Shape;
    use scan::{Camera, ScanParams};

    pub(crate) const CELL: f64 = 0.04;

    /// Cuboids, by centre and half size.
    pub(crate) fn cuboids(parts: &[[DVec3; 2]]) -> TriMesh {
        let mut all = TriMesh::default();
        for &[centre, half] in parts {
            let part = Shape::Cuboid { half }.mesh(1);
            let first = all.positions.len() as u32;
            all.positions.extend(part.positions.iter().map(|&p| p + centre));
            all.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        all
    }

    pub(crate) const FLOOR: [DVec3; 2] = [DVec3::new(0.0, 0.0, -0.1), DVec3::new(2.5, 2.5, 0.1)];
    pub(crate) const BOX: [DVec3; 2] = [DVec3::new(0.1, 0.0, 0.25), DVec3::new(0.2, 0.3, 0.25)];

    /// What `count` cameras around the origin see of a scene each, with noise of `sigma` cells and poses off by `off` cells.
    pub(crate) fn frames(count: usize, [sigma, off]: [f64; 2], scene: impl Fn(usize) -> TriMesh) -> Vec<RangeImage> {
        let look = |k: usize| {
            let mesh = scene(k);
            let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 0).unwrap();
            let (sin, cos) = (TAU * k as f64 / count as f64).sin_cos();
            let eye = DVec3::new(3.0 * cos, 3.0 * sin, 2.0);
            let camera = Camera::pinhole(150, 200, 0.8, eye, DVec3::ZERO, DVec3::Z).unwrap();
            let params =
                ScanParams { seed: k as u64, noise: sigma * CELL, pose_shift: off * CELL, ..ScanParams::default() };
            let mut image = scan::scan(&mesh, &bvh, &camera, &params, &Progress::none()).unwrap();
            image.name = format!("{k:02}");
            image
        };
        (0..count).map(look).collect()
    }

    #[test]
    fn one_more_or_less_changes_one_voter() {
        let loading = Loading { triangulation: Default::default(), cell: 0.0 };
        let frame = &frames(1, [0.0; 2], |_| cuboids(&[FLOOR]))[0];
        let measured = frame.load(&loading, &Progress::none()).unwrap().measured.unwrap();
        let images: Vec<(u32, Measured)> = (0..300).map(|scan| (7 * scan, measured.clone())).collect();
        let of = |gone: usize| {
            let left: Vec<_> = images.iter().enumerate().filter(|of| of.0 != gone).map(|of| of.1.clone()).collect();
            voters(&left).iter().map(|voter| voter.0).collect::<std::collections::BTreeSet<_>>()
        };
        let all = of(usize::MAX);
        assert_eq!(all.len(), MOST_VOTERS);
        assert!((0..300).all(|gone| of(gone).difference(&all).count() <= 1));
    }

    fn merged(frames: &[RangeImage]) -> Merged {
        let sources: Vec<&dyn ScanSource> = frames.iter().map(|s| s as &dyn ScanSource).collect();
        let params = MergeParams { voxel: Some(CELL), max_hole_length: Some(0.0), ..MergeParams::default() };
        run(&sources, &params, &Progress::none()).unwrap()
    }

    /// Share of the vertices of `a` near the middle that have no vertex of `b` within a cell.
    fn alone(a: &Merged, b: &Merged) -> f64 {
        let key = |p: DVec3| (p / CELL).floor().as_ivec3();
        let there: std::collections::HashSet<_> = b.mesh.positions.iter().map(|&p| key(p)).collect();
        let beside =
            |p: DVec3| (0..27).any(|i| there.contains(&(key(p) + glam::ivec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1))));
        let near: Vec<_> = a.mesh.positions.iter().filter(|p| p.truncate().length() < 1.2).collect();
        near.iter().filter(|p| !beside(***p)).count() as f64 / near.len() as f64
    }

    #[test]
    fn what_stood_there_for_a_few_frames_is_gone_and_the_floor_is_whole() {
        for sigma in [0.0, 0.5] {
            let empty = merged(&frames(16, [sigma, 0.0], |_| cuboids(&[FLOOR])));
            let with_box = |k: usize| if k % 4 == 1 { cuboids(&[FLOOR, BOX]) } else { cuboids(&[FLOOR]) };
            let found = merged(&frames(16, [sigma, 0.0], with_box));
            assert!(found.report.seen_through > 500, "{}", found.report.seen_through);
            let (stayed, lost) = (alone(&found, &empty), alone(&empty, &found));
            assert!(stayed < 0.002 && lost < 0.01, "at {sigma}: {stayed} stayed, {lost} of the floor lost");
        }
    }

    #[test]
    fn what_most_frames_have_stays() {
        for sigma in [0.0, 0.5] {
            let still = merged(&frames(16, [sigma, 0.0], |_| cuboids(&[FLOOR, BOX])));
            // Some edges of the box, where pixels beyond them are noisy.
            assert!(still.report.seen_through < 20, "{}", still.report.seen_through);
            let gone = |k: usize| if k % 4 == 1 { cuboids(&[FLOOR]) } else { cuboids(&[FLOOR, BOX]) };
            let found = merged(&frames(16, [sigma, 0.0], gone));
            let lost = alone(&still, &found);
            assert!(lost < 0.005, "{lost}");
        }
    }

    #[test]
    fn rods_and_sheets_stay() {
        // Rods of a pixel to seven; a sheet that most cameras see from its edge or not at all.
        for (half, off) in [(0.008, 0.0), (0.008, 0.4), (0.032, 0.0), (0.032, 0.4), (0.064, 0.4)] {
            let rod = [DVec3::new(0.0, 0.1, 0.4), DVec3::new(half, half, 0.4)];
            let sheet = [DVec3::new(0.6, -0.4, 0.3), DVec3::new(half, 0.3, 0.3)];
            let found = merged(&frames(16, [0.0, off], |_| cuboids(&[FLOOR, rod, sheet])));
            assert_eq!(found.report.seen_through, 0, "half a width of {half}");
            let up = found.mesh.positions.iter().filter(|p| p.z > 0.1 && p.x.abs() < 0.1 && (p.y - 0.1).abs() < 0.1);
            // What no triangle of any scan shows can't be in the result.
            assert!(half < 0.03 || up.count() > 40, "half a width of {half}");
        }
    }

    #[test]
    fn what_is_off_to_the_side_is_not_seen_through() {
        // Level floors fit, whatever the error to the side is.
        for off in [1.0, 2.0, 3.0] {
            let mut scans =
                frames(16, [0.0; 2], |_| cuboids(&[FLOOR, [DVec3::new(0.0, 0.0, 0.4), DVec3::new(0.08, 0.08, 0.4)]]));
            for (i, scan) in scans.iter_mut().enumerate() {
                let normal = |k: usize| {
                    (0..12).map(|j| ((12 * (7 * i + k) + j) as f64 * 0.754_877_666).fract()).sum::<f64>() - 6.0
                };
                scan.world_from_sensor.translation += off * CELL * DVec3::new(normal(0), normal(3), 0.0);
            }
            let found = merged(&scans);
            let up = found.mesh.positions.iter().filter(|p| p.z > 0.2 && p.z < 0.6).count();
            assert!(up > 200, "off by {off}: {up} left, {} seen through", found.report.seen_through);
        }
    }

    #[test]
    fn veils_beside_jumps_are_gone() {
        let scene = |_| cuboids(&[FLOOR, BOX]);
        let clean = frames(16, [0.0; 2], scene);
        let veiled: Vec<RangeImage> = (clean.iter())
            .map(|image| {
                let Samples::Values(values) = image.samples() else { panic!("values") };
                let mut mixed = values.clone();
                for i in 15..values.len() - 15 {
                    // A ramp from the nearer side on.
                    let jump = values[i + 1] - values[i];
                    if (5.0 * CELL..25.0 * CELL).contains(&jump.abs()) {
                        let (from, on) = if jump > 0.0 { (i, 1) } else { (i + 1, -1) };
                        for k in 1..15 {
                            let pixel = from.wrapping_add_signed(on * k);
                            mixed[pixel] = values[from] + (values[pixel] - values[from]) * k as f64 / 15.0;
                        }
                    }
                }
                let mut veiled =
                    RangeImage::from_values(image.rows(), image.cols(), mixed, *image.projection()).unwrap();
                (veiled.name, veiled.world_from_sensor) = (image.name.clone(), image.world_from_sensor);
                veiled
            })
            .collect();
        let (clean, veiled) = (merged(&clean), merged(&veiled));
        let (left, lost) = (alone(&veiled, &clean), alone(&clean, &veiled));
        // Without looking through 0.3 are left.
        assert!(left < 0.015 && lost < 0.005, "{left} left, {lost} lost");
    }

    #[test]
    fn grids_of_points_vote_where_they_say_from_where_and_two_scans_are_no_majority() {
        let scene = |k: usize| if k == 0 { cuboids(&[FLOOR, BOX]) } else { cuboids(&[FLOOR]) };
        let images = frames(8, [0.0; 2], scene);
        let dropped = merged(&images).report.seen_through;
        assert!(dropped > 100);
        assert_eq!(merged(&images[..2]).report.seen_through, 0);
        let grids: Vec<RangeImage> = (images.iter())
            .map(|image| {
                let mut grid = as_point_grid(image);
                (grid.name, grid.world_from_sensor) = (image.name.clone(), image.world_from_sensor);
                grid
            })
            .collect();
        let by_grids = merged(&grids).report.seen_through;
        assert!(by_grids.abs_diff(dropped) * 20 < dropped, "{by_grids} of {dropped}");
        let still = frames(8, [0.0; 2], |_| cuboids(&[FLOOR, BOX]));
        let grids: Vec<RangeImage> = (still.iter())
            .map(|image| {
                let points = as_point_grid(image);
                let Samples::Points(points) = points.samples() else { panic!("points") };
                let viewing = Viewing::Parallel(DVec3::Z);
                let mut grid = RangeImage::from_points(image.rows(), image.cols(), points.clone(), viewing).unwrap();
                (grid.name, grid.world_from_sensor) = (image.name.clone(), image.world_from_sensor);
                grid
            })
            .collect();
        assert_eq!(merged(&grids).report.seen_through, 0);
    }
}
