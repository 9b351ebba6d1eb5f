//! Exact measures: distances of points to a mesh, areas and angles of its triangles.
//!
//! Distances are found in f64 through [`Bvh`], which no algorithm of this crate builds surfaces with: what judges a
//! result shares no code with what made it.

mod shape;
mod side;

pub use shape::{Quality, angles, area, bounds, enclosed_volume, quality, quality_while, total_area};

use glam::DVec3;
use rayon::prelude::*;

use crate::{Crs, TriMesh};
use base::error::{Error, Result};
use base::magnitude;
use base::progress::Progress;
use geom::bvh::{Bvh, Closest};
use side::PseudoNormals;

/// Points that are measured between two looks at the progress.
pub(super) const CHUNK: usize = 1024;

/// Whether distances say on which side of the surface a point is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// All distances are positive.
    Ignored,
    /// Distances behind the surface are negative. The side follows from the angle-weighted normal of the closest face, edge
    /// or vertex \[BA05\], which is right wherever the mesh is closed, and beside a boundary means the side of the nearest face.
    Signed,
}

base::report! {
    /// Distances of points, or of a surface, from another surface. All figures but `bias` are of absolute values.
    #[derive(Copy, Default)]
    pub struct DistanceReport {
        /// Distances that were measured: of the points, or of the surface's vertices.
        count: usize = count("Distances"),
        /// Their mean.
        mean: f64 = length("Mean distance"),
        /// Root of their mean square.
        rms: f64 = length("Root mean square distance"),
        /// The smallest value that at least 95 % of them do not exceed.
        p95: f64 = length("95 % are within"),
        /// The largest of them.
        max: f64 = length("Largest distance"),
        /// Their mean with signs. Without signs it is the mean.
        bias: f64 = length("Mean with signs"),
        /// Index of the largest, the first of several. There is none where nothing was measured.
        worst: Option<usize> = count("Place of the largest").optional(),
        /// Largest distance that was found on a surface, between its vertices too. There is none for points.
        reached: Option<f64> = length("Largest distance found").optional(),
        /// No point of the surface is farther. It is within 1 % of `reached`, or above it by a millionth of the extent of the other
        /// surface, unless that takes more than 8 measurements for each vertex and 100,000. There is none for points.
        bound: Option<f64> = length("Largest distance, at most").optional(),
    }
}

/// The former name of [`DistanceReport`].
#[deprecated(since = "0.2.0", note = "it is DistanceReport")]
pub type Summary = DistanceReport;

impl DistanceReport {
    /// Sums up `distances`; all zero without any.
    pub fn of(distances: &[f64]) -> Self {
        let count = distances.len();
        if count == 0 {
            return DistanceReport::default();
        }
        let mut sizes: Vec<f64> = distances.iter().map(|d| d.abs()).collect();
        let worst = (0..count).fold(0, |w, i| if sizes[i] > sizes[w] { i } else { w });
        let n = count as f64;
        DistanceReport {
            count,
            mean: sizes.iter().sum::<f64>() / n,
            rms: (sizes.iter().map(|d| d * d).sum::<f64>() / n).sqrt(),
            max: sizes[worst],
            bias: distances.iter().sum::<f64>() / n,
            worst: Some(worst),
            p95: *sizes.select_nth_unstable_by((count * 95).div_ceil(100) - 1, f64::total_cmp).1,
            reached: None,
            bound: None,
        }
    }
}

/// Distances of points to a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Deviation {
    /// One a point.
    pub distances: Vec<f64>,
    /// Their figures.
    pub summary: DistanceReport,
}

/// Exact distances of `points` to the nearest point of `mesh`, with `threads` threads, 0 for one a core.
///
/// # Cost
/// Time O((n + m) log m) for n points and m triangles, memory O(n + m). The result is the same for any number of threads.
///
/// # Errors
/// [`Error::Input`] for a mesh without triangles, with a bad index or in degrees, and for coordinates that aren't finite;
/// [`Error::Cancelled`].
pub fn deviation(
    points: &[DVec3],
    mesh: &TriMesh,
    side: Side,
    threads: usize,
    progress: &Progress<'_>,
) -> Result<Deviation> {
    check_measurable(points, mesh)?;
    progress.plan(&[("measuring", 1.0)]);
    progress.stage(0, chunks(points.len()));
    let pool = base::threads::pool(threads)?;
    progress.run(&pool, || distances(points, mesh, side, threads, 1, progress))
}

/// The same as part of another operation's work, within its pool. Each of the [`chunks`] advances the progress by
/// `counts`.
///
/// # Errors
/// As [`deviation`].
pub fn deviation_within(
    points: &[DVec3],
    mesh: &TriMesh,
    side: Side,
    counts: u64,
    progress: &Progress<'_>,
) -> Result<Deviation> {
    check_measurable(points, mesh)?;
    distances(points, mesh, side, rayon::current_num_threads(), counts, progress)
}

/// Steps in which so many points are measured.
#[doc(hidden)]
pub fn chunks(points: usize) -> u64 {
    points.div_ceil(CHUNK) as u64
}

/// For each of `points` the triangle of `mesh` that is nearest, of several as near the one of the smallest index.
///
/// # Cost
/// As [`deviation`].
///
/// # Errors
/// As [`deviation`].
pub fn nearest_triangles(
    points: &[DVec3],
    mesh: &TriMesh,
    threads: usize,
    progress: &Progress<'_>,
) -> Result<Vec<u32>> {
    check_measurable(points, mesh)?;
    progress.plan(&[("measuring", 1.0)]);
    progress.stage(0, chunks(points.len()));
    let pool = base::threads::pool(threads)?;
    progress.run(&pool, || {
        let bvh = Bvh::build_with(&mesh.positions, &mesh.triangles, threads, progress)?;
        let mut nearest = vec![0; points.len()];
        nearest.par_chunks_mut(CHUNK).zip(points.par_chunks(CHUNK)).try_for_each(|(nearest, points)| {
            for (nearest, &point) in nearest.iter_mut().zip(points) {
                *nearest = bvh.closest_point(point).expect("there is a triangle and the point is finite").triangle;
            }
            progress.advance(1)
        })?;
        Ok(nearest)
    })
}

fn check_measurable(points: &[DVec3], mesh: &TriMesh) -> Result<()> {
    magnitude::points("point", points)?;
    Crs::common([("the mesh", mesh.crs.clone())])?;
    if mesh.triangles.is_empty() && !points.is_empty() {
        return Err(Error::input("the mesh has no triangle to measure distances to"));
    }
    Ok(())
}

/// On the pool of the caller; each chunk of points advances the progress by `counts`.
fn distances(
    points: &[DVec3],
    mesh: &TriMesh,
    side: Side,
    threads: usize,
    counts: u64,
    progress: &Progress<'_>,
) -> Result<Deviation> {
    let mut distances = vec![0.0; points.len()];
    let bvh = Bvh::build_with(&mesh.positions, &mesh.triangles, threads, progress)?;
    measure_points(points, mesh, &bvh, side, &mut distances, |slot, distance, _| *slot = distance, counts, progress)?;
    Ok(Deviation { summary: DistanceReport::of(&distances), distances })
}

/// Keeps the distances of `points` to `mesh`, and where these are closest, on the pool of the caller. Each chunk advances the progress by
/// `counts`.
#[expect(clippy::too_many_arguments, reason = "what two callers were given, and what they keep")]
pub(super) fn measure_points<Kept: Send>(
    points: &[DVec3],
    mesh: &TriMesh,
    bvh: &Bvh<'_>,
    side: Side,
    kept: &mut [Kept],
    keep: impl Fn(&mut Kept, f64, &Closest) + Sync,
    counts: u64,
    progress: &Progress<'_>,
) -> Result<()> {
    let normals = (side == Side::Signed).then(|| PseudoNormals::new(mesh, progress)).transpose()?;
    kept.par_chunks_mut(CHUNK).zip(points.par_chunks(CHUNK)).try_for_each(|(kept, points)| {
        for (slot, &point) in kept.iter_mut().zip(points) {
            let closest = bvh.closest_point(point).expect("there is a triangle and the point is finite");
            let inside = normals.as_ref().is_some_and(|n| n.at(mesh, &closest).dot(point - closest.point) < 0.0);
            let distance = closest.distance();
            keep(slot, if inside { -distance } else { distance }, &closest);
        }
        progress.advance(counts)
    })
}

#[cfg(test)]
mod tests;
