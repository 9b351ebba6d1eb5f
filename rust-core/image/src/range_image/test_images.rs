//! Images of analytic surfaces in every projection, with their handedness mirrored in every way.

use glam::DVec3;

use super::{DepthKind, Projection, RangeImage, Samples, Viewing};

/// Every projection at about `rows` x `cols` pixels over a field of view of 0.6 x 0.6 (lengths or radians), with steps of
/// either sign.
pub fn projections(rows: usize, cols: usize) -> Vec<Projection> {
    let mut all = Vec::new();
    for (sx, sy) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let step = [0.6 * sx / cols as f64, 0.6 * sy / rows as f64];
        let first = [-0.3 * sx, -0.3 * sy];
        all.push(Projection::Orthographic { first, step });
        all.push(Projection::Spherical { first, step });
        let centre = [0.5 * cols as f64, 0.5 * rows as f64];
        let focal = [cols as f64 / 0.6 * sx, rows as f64 / 0.6 * sy];
        all.push(Projection::Pinhole { focal, centre, depth: DepthKind::Planar });
        all.push(Projection::Pinhole { focal, centre, depth: DepthKind::Ray });
    }
    all
}

/// The image a sensor takes of the surface that `hit(origin, direction)` gives the distance to along each ray.
pub fn render(
    rows: usize,
    cols: usize,
    projection: Projection,
    hit: impl Fn(DVec3, DVec3) -> Option<f64>,
) -> RangeImage {
    let value = |index: usize| {
        let (row, col) = (index / cols, index % cols);
        let (origin, direction) = projection.ray(row, col, DVec3::NAN);
        match (hit(origin, direction), &projection) {
            (None, _) => f64::NAN,
            (Some(t), Projection::Orthographic { .. }) => origin.z - t,
            (Some(t), Projection::Pinhole { depth: DepthKind::Planar, .. }) => t * direction.z,
            (Some(t), _) => t,
        }
    };
    RangeImage::from_values(rows, cols, (0..rows * cols).map(value).collect(), projection).expect("an image")
}

/// Distance along a ray to a plane.
pub fn plane(point: DVec3, normal: DVec3) -> impl Fn(DVec3, DVec3) -> Option<f64> {
    move |origin, direction| Some((point - origin).dot(normal) / direction.dot(normal))
}

/// Distance along a ray to the near side of a sphere.
pub fn sphere(centre: DVec3, radius: f64) -> impl Fn(DVec3, DVec3) -> Option<f64> {
    move |origin, direction| {
        let to_centre = centre - origin;
        let along = to_centre.dot(direction);
        let square = radius * radius - (to_centre.length_squared() - along * along);
        (square > 0.0).then(|| along - square.sqrt())
    }
}

/// The middle of the field of view at a distance of 2 for each projection.
pub fn ahead(projection: &Projection) -> DVec3 {
    match projection {
        Projection::Orthographic { .. } => DVec3::new(0.0, 0.0, -2.0),
        Projection::Pinhole { .. } => DVec3::new(0.0, 0.0, 2.0),
        _ => DVec3::new(2.0, 0.0, 0.0),
    }
}

/// The same samples as a point grid (in single precision).
pub fn as_point_grid(image: &RangeImage) -> RangeImage {
    let points = (0..image.len()).map(|i| image.point_in_sensor(i).as_vec3().to_array()).collect();
    let viewing = match image.projection() {
        Projection::Orthographic { .. } => Viewing::ALONG_MINUS_Z,
        _ => Viewing::From(DVec3::ZERO),
    };
    RangeImage::from_points(image.rows(), image.cols(), points, viewing).expect("an image")
}

/// Whether all of 3 x 3 pixels around a place lie behind it by more than `slack`, in pinhole images of planar depth without noise. A naive
/// twin of lines of sight.
pub fn is_past(image: &RangeImage, place: DVec3, slack: f64) -> bool {
    let (Projection::Pinhole { focal, centre, .. }, Samples::Values(values)) = (*image.projection(), image.samples())
    else {
        panic!("pinhole images of planar depth alone")
    };
    let at = image.world_from_sensor.inverse().transform_point3(place);
    let pixel = [centre[1] + focal[1] * at.y / at.z, centre[0] + focal[0] * at.x / at.z].map(|x| x.round() as i64);
    let rows = image.rows() as i64;
    (0..9).all(|i| {
        let [row, col] = [pixel[0] + i / 3 - 1, pixel[1] + i % 3 - 1];
        let inside = at.z > 0.0 && row >= 0 && col >= 0 && row < rows && col < image.cols() as i64;
        inside && values[(row * image.cols() as i64 + col) as usize] > at.z + slack * at.z / at.length()
    })
}
