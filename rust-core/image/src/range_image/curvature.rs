//! Curvature of a range image: how far a pixel's range departs from that of its eight neighbours.

use super::RangeImage;

/// The absolute second difference `|8 z - sum z_i|` of the ranges, pixel by pixel, over the valid ones of the eight neighbours. With n < 8
/// of them it is `|n z - sum z_i| * 8 / n`. 0 for pixels without a valid neighbour and for invalid pixels. In the unit of the ranges. A
/// plane seen orthographically has zero. O(pixels).
pub fn curvature(image: &RangeImage) -> Vec<f64> {
    let (rows, cols) = (image.rows(), image.cols());
    let ranges: Vec<f64> = (0..image.len()).map(|i| image.range(i)).collect();
    let mut curvature = vec![0.0; image.len()];
    for row in 0..rows {
        for col in 0..cols {
            let z = ranges[row * cols + col];
            if z.is_nan() {
                continue;
            }
            let (mut sum, mut n) = (0.0, 0.0);
            for r in row.saturating_sub(1)..(row + 2).min(rows) {
                for c in col.saturating_sub(1)..(col + 2).min(cols) {
                    let other = ranges[r * cols + c];
                    if !other.is_nan() && (r, c) != (row, col) {
                        // Differences, not sums of ranges: a far-away surface keeps its digits.
                        sum += z - other;
                        n += 1.0;
                    }
                }
            }
            if n > 0.0 {
                curvature[row * cols + col] = f64::abs(sum) * 8.0 / n;
            }
        }
    }
    curvature
}

#[cfg(test)]
mod tests {
    use super::super::{Projection, Viewing};
    use super::*;

    fn heights(rows: usize, cols: usize, z: impl Fn(f64, f64) -> f64) -> RangeImage {
        let values = (0..rows * cols).map(|i| z((i / cols) as f64, (i % cols) as f64)).collect();
        let projection = Projection::Orthographic { first: [0.0; 2], step: [1.0, 1.0] };
        RangeImage::from_values(rows, cols, values, projection).unwrap()
    }

    #[test]
    fn a_plane_is_flat_and_a_paraboloid_is_constant() {
        let plane = heights(5, 6, |r, c| 1e6 + 3.0 * r - 2.0 * c);
        for row in 1..4 {
            assert!(curvature(&plane)[row * 6 + 1..row * 6 + 5].iter().all(|&k| k == 0.0));
        }
        // z = r^2: each of the six neighbours above and below adds 1.
        let bent = heights(5, 6, |r, _| r * r);
        for row in 1..4 {
            assert_eq!(curvature(&bent)[row * 6 + 1..row * 6 + 5], [6.0; 4]);
        }
    }

    #[test]
    fn missing_neighbours_are_made_up_for() {
        // One valid neighbour, 2 higher: |1 z - sum| * 8 / 1.
        let pair = heights(3, 3, |r, c| if (r, c) == (1.0, 1.0) || (r, c) == (0.0, 2.0) { r * 2.0 } else { f64::NAN });
        assert_eq!(curvature(&pair), [0.0, 0.0, 16.0, 0.0, 16.0, 0.0, 0.0, 0.0, 0.0]);
        let lone = heights(3, 3, |r, c| if (r, c) == (1.0, 1.0) { 7.0 } else { f64::NAN });
        assert_eq!(curvature(&lone), [0.0; 9]);
        assert!(curvature(&heights(0, 5, |_, _| 0.0)).is_empty());
    }

    #[test]
    fn a_point_grid_is_measured_along_its_rays() {
        let values = heights(4, 4, |r, c| r * c * c);
        let points: Vec<[f32; 3]> = (0..16).map(|i| values.point_in_sensor(i).as_vec3().to_array()).collect();
        let grid = RangeImage::from_points(4, 4, points.clone(), Viewing::ALONG_MINUS_Z).unwrap();
        assert_eq!(curvature(&grid), curvature(&values));
        let turned: Vec<[f32; 3]> = points.iter().map(|&[x, y, z]| [z, x, y]).collect();
        let grid = RangeImage::from_points(4, 4, turned, Viewing::Parallel(glam::DVec3::new(-2.0, 0.0, 0.0))).unwrap();
        assert_eq!(curvature(&grid), curvature(&values));
    }
}
