//! Normals from the grid, oriented toward the sensor.

use glam::DVec3;

use super::RangeImage;
use super::samples::SampleGrid;
use super::spacing::{EdgeLimit, Spacing};
use base::error::Result;
use base::progress::Progress;

/// A unit normal per pixel in the sensor's frame, toward the sensor. Zero for invalid pixels and for those without a neighbour both along
/// the row and along the column that is no jump away. O(pixels).
///
/// # Errors
/// An attribute of the wrong length, or more than 2^32 - 2 pixels.
pub fn normals(image: &RangeImage) -> Result<Vec<[f32; 3]>> {
    image.validate()?;
    let progress = &Progress::none();
    let grid = SampleGrid::new(image, progress)?;
    let limit = EdgeLimit::from_data(image, &grid, Spacing::of(image, &grid, progress)?, progress)?;
    let mut normals = vec![[0.0; 3]; image.len()];
    for (k, &pixel) in grid.pixels.iter().enumerate() {
        normals[pixel as usize] = sample_normal(image, &grid, &limit, k).as_vec3().to_array();
    }
    Ok(normals)
}

/// The unit normal of a sample, toward the sensor, zero where there is none: the sum of the cross products of neighbouring
/// grid edges within `limit`. With all four neighbours that is the cross product of the two central differences.
pub fn sample_normal(image: &RangeImage, grid: &SampleGrid, limit: &EdgeLimit, sample: usize) -> DVec3 {
    let here = grid.positions[sample];
    let [left, right, up, down] = limit.allowed(grid, sample).map(|n| n.map(|n| grid.positions[n] - here));
    let mut sum = DVec3::ZERO;
    for (first, second) in [(right, down), (down, left), (left, up), (up, right)] {
        if let (Some(first), Some(second)) = (first, second) {
            sum += first.cross(second);
        }
    }
    let normal = sum.normalize_or_zero();
    if normal.dot(image.projection().view_direction(here)) > 0.0 { -normal } else { normal }
}

#[cfg(test)]
mod tests {
    use super::super::Projection;
    use super::super::test_images::*;
    use super::*;

    #[test]
    fn a_plane_has_its_normal_everywhere_toward_the_sensor() {
        for projection in projections(9, 8) {
            let centre = ahead(&projection);
            let normal = (centre.normalize() + DVec3::new(0.2, -0.1, 0.15)).normalize();
            let image = render(9, 8, projection, plane(centre, normal));
            for image in [as_point_grid(&image), image] {
                for n in normals(&image).unwrap() {
                    let n = DVec3::from(n.map(f64::from));
                    assert!(n.distance(-normal) < 1e-5, "{projection:?} {n} {normal}");
                }
            }
        }
    }

    #[test]
    fn a_sphere_has_its_own_normals_up_to_the_sampling() {
        for projection in projections(60, 60) {
            let centre = ahead(&projection);
            let image = render(60, 60, projection, sphere(centre, 0.25));
            for (i, n) in normals(&image).unwrap().into_iter().enumerate() {
                let n = DVec3::from(n.map(f64::from));
                let radial = (image.point_in_sensor(i) - centre) / 0.25;
                let (_, direction) = image.ray_in_sensor(i);
                if image.is_valid(i) && radial.dot(direction) < -0.5 {
                    assert!(n.distance(radial) < 0.03, "{projection:?} pixel {i}: {n} for {radial}");
                }
                assert!(image.is_valid(i) || n == DVec3::ZERO);
            }
        }
    }

    #[test]
    fn jumps_do_not_bend_normals() {
        // Two flat terraces; the step between columns 3 and 4 is far above the spacing.
        let projection = Projection::Orthographic { first: [0.0; 2], step: [1.0, 1.0] };
        let values = (0..64).map(|i| if i % 8 < 4 { 0.0 } else { 50.0 }).collect();
        let image = RangeImage::from_values(8, 8, values, projection).unwrap();
        assert!(normals(&image).unwrap().iter().all(|&n| n == [0.0, 0.0, 1.0]));
    }
}
