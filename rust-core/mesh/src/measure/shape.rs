//! Areas, volumes and angles of a mesh's triangles.

use glam::DVec3;

use crate::TriMesh;
use base::error::Result;

/// Angles of a triangle at its corners, in radians. If two corners are equal, 0 at them.
pub fn angles(corners: [DVec3; 3]) -> [f64; 3] {
    std::array::from_fn(|k| {
        let u = corners[(k + 1) % 3] - corners[k];
        let v = corners[(k + 2) % 3] - corners[k];
        u.cross(v).length().atan2(u.dot(v))
    })
}

/// Area of a triangle.
pub fn area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// Area of all triangles together.
pub fn total_area(mesh: &TriMesh) -> f64 {
    (0..mesh.triangles.len()).map(|t| area(mesh.corners(t))).sum()
}

/// Volume that a closed mesh encloses. Negative if it is inside out, without meaning if it is open.
pub fn enclosed_volume(mesh: &TriMesh) -> f64 {
    // Measured from a vertex of the mesh: far from the origin the terms would cancel.
    let Some(&origin) = mesh.positions.first() else { return 0.0 };
    let sixfold: f64 = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t).map(|p| p - origin);
            a.dot(b.cross(c))
        })
        .sum();
    sixfold / 6.0
}

/// Lower and upper corner of the points. `None` without points.
pub fn bounds(positions: &[DVec3]) -> Option<(DVec3, DVec3)> {
    let first = *positions.first()?;
    Some(positions.iter().fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p))))
}

/// Areas and angles of a mesh's triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Triangles.
    pub triangles: usize,
    /// Triangles whose area, computed in double precision, is zero.
    pub without_area: usize,
    /// Area of all together.
    pub area: f64,
    /// Area of the smallest and of the largest.
    pub area_range: [f64; 2],
    /// Smallest angle of all, radians.
    pub smallest_angle: f64,
    /// Mean over the triangles of their smallest angle, radians. pi/3 if all are equilateral.
    pub mean_smallest_angle: f64,
    /// Largest angle of all, radians.
    pub largest_angle: f64,
    /// Triangles by their smallest angle, in steps of 5 degrees. The last step includes 60.
    pub by_smallest_angle: [usize; 12],
}

/// Measures the triangles. All zero without any.
///
/// # Panics
/// If a triangle names a vertex that doesn't exist: see [`TriMesh::validate`].
pub fn quality(mesh: &TriMesh) -> Quality {
    let measured = quality_while(mesh, |_| Ok(()));
    measured.expect("nothing stops it")
}

/// The same with the angles of each triangle shown to `visit`, which may stop it.
///
/// # Errors
/// What `visit` returns.
pub fn quality_while(mesh: &TriMesh, mut visit: impl FnMut([f64; 3]) -> Result<()>) -> Result<Quality> {
    let triangles = mesh.triangles.len();
    if triangles == 0 {
        return Ok(Quality::default());
    }
    let mut q = Quality {
        triangles,
        area_range: [f64::INFINITY, 0.0],
        smallest_angle: std::f64::consts::PI,
        ..Quality::default()
    };
    for t in 0..triangles {
        let corners = mesh.corners(t);
        let (area, angles) = (area(corners), angles(corners));
        visit(angles)?;
        let [low, high] = angles.iter().fold([f64::INFINITY, 0.0_f64], |[l, h], &a| [l.min(a), h.max(a)]);
        q.without_area += usize::from(area == 0.0);
        q.area += area;
        q.area_range = [q.area_range[0].min(area), q.area_range[1].max(area)];
        q.smallest_angle = q.smallest_angle.min(low);
        q.largest_angle = q.largest_angle.max(high);
        q.mean_smallest_angle += low / triangles as f64;
        q.by_smallest_angle[((low.to_degrees() / 5.0) as usize).min(11)] += 1;
    }
    Ok(q)
}
