use std::collections::BTreeSet;
use std::f64::consts::PI;

use glam::DVec3;
use proptest::prelude::*;

mod stairs;

use super::*;
use crate::range_image::test_images::*;
use crate::range_image::{DepthKind, Projection, Samples, Viewing};

const UNIT_GRID: Projection = Projection::Orthographic { first: [0.0; 2], step: [1.0, 1.0] };

fn run(image: &RangeImage) -> RangeSurface {
    run_with(image, &TriangulateParams::default())
}

/// A surface that may be empty.
fn run_with(image: &RangeImage, params: &TriangulateParams) -> RangeSurface {
    let none = &Progress::none();
    triangulate_samples(image, samples(image, params, none).unwrap(), params, none).unwrap()
}

fn with_limit(limit: f64) -> TriangulateParams {
    TriangulateParams { edge_limit: Some(limit), ..TriangulateParams::default() }
}

fn heights(rows: usize, cols: usize, z: impl Fn(usize, usize) -> f64) -> RangeImage {
    RangeImage::from_values(rows, cols, (0..rows * cols).map(|i| z(i / cols, i % cols)).collect(), UNIT_GRID).unwrap()
}

/// Triangles as pixels, each turned so that its smallest comes first.
fn pixel_triangles(surface: &RangeSurface) -> BTreeSet<[u32; 3]> {
    let turned = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| surface.pixels[v as usize]);
        [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
    };
    surface.triangles.iter().map(turned).collect()
}

/// Rules that hold for any image: see the documentation of `triangulate`.
fn check(image: &RangeImage, surface: &RangeSurface) {
    let n = surface.positions.len();
    assert!(surface.pixels.len() == n && surface.confidence.len() == n);
    assert_eq!(n + surface.isolated_pixels, image.valid_count());
    assert!(surface.pixels.is_sorted_by(|a, b| a < b));
    for (k, &pixel) in surface.pixels.iter().enumerate() {
        assert_eq!(surface.positions[k], image.point_in_sensor(pixel as usize));
    }
    let mut used = vec![0; n];
    let mut edges = std::collections::BTreeMap::new();
    for &t in &surface.triangles {
        let [a, b, c] = t.map(|v| surface.positions[v as usize]);
        let normal = (b - a).cross(c - a);
        assert!(normal.dot(image.projection().view_direction(a)) < 0.0, "a triangle turns its back on the sensor");
        for i in 0..3 {
            used[t[i] as usize] += 1;
            *edges.entry((t[i], t[(i + 1) % 3])).or_insert(0) += 1;
        }
    }
    assert!(used.iter().all(|&u| u > 0), "a vertex without a triangle");
    assert!(edges.values().all(|&count| count == 1), "an edge used twice in the same direction");
    assert_eq!(pixel_triangles(surface).len(), surface.triangles.len(), "a triangle twice");
    for &(a, b) in edges.keys() {
        if !edges.contains_key(&(b, a)) {
            assert_eq!((surface.confidence[a as usize], surface.confidence[b as usize]), (0.0, 0.0), "border vertices");
        }
    }
}

/// The same triangles found cell by cell, straight from the definition (an image without folds).
fn naive(image: &RangeImage, limit: f64) -> BTreeSet<[u32; 3]> {
    let cols = image.cols();
    let at = |i: usize| image.point_in_sensor(i);
    let mut found = BTreeSet::new();
    for row in 1..image.rows() {
        for col in 1..cols {
            let corners = [(row - 1) * cols + col - 1, (row - 1) * cols + col, row * cols + col, row * cols + col - 1];
            let valid: Vec<usize> = corners.into_iter().filter(|&i| image.is_valid(i)).collect();
            let candidates = match valid[..] {
                [a, b, c] => vec![[a, b, c]],
                [a, b, c, d] if at(a).distance(at(c)) <= at(b).distance(at(d)) => vec![[a, b, c], [a, c, d]],
                [a, b, c, d] => vec![[a, b, d], [b, c, d]],
                _ => vec![],
            };
            for [i, j, k] in candidates {
                let short = [(i, j), (j, k), (k, i)].iter().all(|&(i, j)| at(i).distance(at(j)) <= limit);
                let normal = (at(j) - at(i)).cross(at(k) - at(i));
                let side = normal.dot(image.projection().view_direction(at(i)));
                if short && side != 0.0 {
                    let t = if side < 0.0 { [i, j, k] } else { [i, k, j] };
                    let t = t.map(|v| v as u32);
                    found.insert([t, [t[1], t[2], t[0]], [t[2], t[0], t[1]]].into_iter().min().unwrap());
                }
            }
        }
    }
    found
}

proptest! {
    #[test]
    fn any_image_gives_what_the_definition_says(
        rows in 1_usize..9, cols in 1_usize..9, which in 0_usize..16, limit in 0.3..3.0_f64,
        depths in prop::collection::vec(prop_oneof![3 => (1.0..2.0_f64).prop_map(Some), 1 => Just(None)], 64),
    ) {
        let projection = projections(rows, cols)[which];
        let values = depths[..rows * cols].iter().map(|d| d.map_or(f64::NAN, |d| d)).collect();
        let image = RangeImage::from_values(rows, cols, values, projection).unwrap();
        let surface = run_with(&image, &with_limit(limit));
        check(&image, &surface);
        prop_assert_eq!(pixel_triangles(&surface), naive(&image, limit));
        // The same samples as points (f32) give what they give by the definition, too.
        let grid = as_point_grid(&image);
        let surface = run_with(&grid, &with_limit(limit));
        check(&grid, &surface);
        prop_assert_eq!(pixel_triangles(&surface), naive(&grid, limit));
    }

    #[test]
    fn any_point_grid_gives_a_sound_surface(
        points in prop::collection::vec(prop_oneof![
            9 => [-2.0..2.0_f32, -2.0..2.0_f32, -2.0..2.0_f32],
            1 => Just([f32::NAN; 3]), 1 => Just([0.5; 3]), 1 => Just([3e38, -3e38, 3e38]),
        ], 48),
        parallel in any::<bool>(),
    ) {
        let viewing = if parallel { Viewing::Parallel(DVec3::new(0.3, -0.2, -1.0)) } else { Viewing::From(DVec3::splat(3.0)) };
        let image = RangeImage::from_points(6, 8, points, viewing).unwrap();
        let surface = run(&image);
        let edges = surface.triangles.len() * 3;
        prop_assert!(surface.positions.len() <= edges);
        prop_assert!(surface.confidence.iter().all(|c| (0.0..=1.0).contains(c)));
    }
}

#[test]
fn a_full_image_has_two_triangles_a_cell_in_every_projection() {
    for projection in projections(12, 9) {
        let centre = ahead(&projection);
        let image = render(12, 9, projection, plane(centre, centre + DVec3::new(0.2, 0.1, -0.1)));
        for image in [as_point_grid(&image), image] {
            let surface = run(&image);
            check(&image, &surface);
            assert_eq!(surface.triangles.len(), 2 * 11 * 8, "{projection:?}");
            assert_eq!(surface.isolated_pixels, 0);
        }
    }
}

#[test]
fn a_cell_with_three_valid_corners_gives_one_triangle() {
    for missing in 0..4 {
        let image = heights(2, 2, |r, c| if r * 2 + c == missing { f64::NAN } else { 0.0 });
        let surface = run(&image);
        check(&image, &surface);
        assert_eq!(surface.triangles.len(), 1);
    }
}

#[test]
fn the_shorter_diagonal_in_space_wins() {
    // Raising one corner lengthens the diagonal through it.
    for (raised, other_diagonal) in [(0, [1, 2]), (1, [0, 3]), (2, [0, 3]), (3, [1, 2])] {
        let surface = run(&heights(2, 2, |r, c| if r * 2 + c == raised { 1.0 } else { 0.0 }));
        assert!(surface.triangles.iter().all(|t| t.contains(&other_diagonal[0]) && t.contains(&other_diagonal[1])));
    }
}

#[test]
fn a_step_is_a_jump_and_the_default_limit_comes_from_the_median() {
    let step = |height: f64| heights(8, 8, move |_, c| if c < 4 { 0.0 } else { height });
    // Unit spacing: 3.4 is the limit; the diagonal of the cells over the step is sqrt(2 + height^2).
    assert_eq!(run(&step(3.0)).triangles.len(), 2 * 49);
    assert_eq!(run(&step(3.2)).triangles.len(), 2 * 49 - 7 * 2, "edges pass, diagonals don't");
    assert_eq!(run(&step(4.0)).triangles.len(), 2 * 42);
    assert_eq!(run_with(&step(4.0), &with_limit(9.0)).triangles.len(), 2 * 49);
    assert_eq!(run(&step(4.0)).spacing, 1.0);
}

#[test]
fn where_rays_fan_out_the_limit_grows_with_range() {
    // A logarithmic spiral is seen at the same angle at all ranges, here from 0.2 to 4: samples lie 20 times as far apart
    // at its end as at its beginning.
    let projection = Projection::Spherical { first: [-1.0, -0.2], step: [0.01, 0.01] };
    let spiral = |azimuth: f64| (1.5 * azimuth).exp();
    let image = render(40, 200, projection, |_, d| Some(spiral(d.y.atan2(d.x))));
    for image in [as_point_grid(&image), image] {
        let surface = run(&image);
        assert_eq!(surface.triangles.len(), 2 * 39 * 199);
        let absolute = run_with(&image, &with_limit(3.4 * surface.spacing));
        assert!(absolute.triangles.len() < surface.triangles.len());
    }
    // A ball before it is torn off, and the spiral behind it is whole around the shadow.
    let (centre, radius) = (DVec3::new(1.5, 1.0, 0.0), 0.2);
    let ball = sphere(centre, radius);
    let image = render(40, 200, projection, |o, d| ball(o, d).or(Some(spiral(d.y.atan2(d.x)))));
    let surface = run(&image);
    let on_ball = |&v: &u32| (surface.positions[v as usize].distance(centre) - radius).abs() < 1e-9;
    let bridges = |t: &&[u32; 3]| t.iter().any(on_ball) && !t.iter().all(on_ball);
    assert!(surface.triangles.iter().filter(|t| t.iter().all(on_ball)).count() > 100);
    assert_eq!(surface.triangles.iter().find(bridges), None);
}

#[test]
fn grazing_surfaces_are_left_out_above_the_limit() {
    for projection in projections(10, 10) {
        let centre = ahead(&projection);
        let towards = centre.normalize();
        // 60 degrees between the normal and the middle ray, the others within +- 0.43 rad.
        let normal = towards * 0.5 + towards.any_orthonormal_vector() * 0.75_f64.sqrt();
        let image = render(10, 10, projection, plane(centre, normal));
        let count = |degrees: f64| {
            let params = TriangulateParams { grazing_limit: degrees.to_radians(), edge_limit: Some(1e3) };
            run_with(&image, &params).triangles.len()
        };
        assert_eq!((count(34.0), count(87.0), count(90.0)), (0, 2 * 81, 2 * 81), "{projection:?}");
        if matches!(projection, Projection::Orthographic { .. }) {
            assert_eq!((count(59.9), count(60.1)), (0, 2 * 81));
        }
    }
}

#[test]
fn a_fold_of_a_point_grid_is_a_jump() {
    // Column 2 lies left of column 1: the cells between them are seen from behind.
    let xs = [0.0, 1.0, 0.6, 1.6, 2.6];
    let points = (0..15).map(|i| [xs[i % 5], (i / 5) as f32, 0.0]).collect();
    let image = RangeImage::from_points(3, 5, points, Viewing::ALONG_MINUS_Z).unwrap();
    let surface = run(&image);
    check(&image, &surface);
    assert_eq!(surface.triangles.len(), 2 * 6);
    assert!(surface.triangles.iter().all(|t| {
        let columns = t.map(|v| surface.pixels[v as usize] % 5);
        !(columns.contains(&1) && columns.contains(&2))
    }));
}

#[test]
fn a_point_grid_without_a_whole_cell_still_faces_the_sensor() {
    // Found by the property test: no cell had both edges at its corner a, so nothing voted for the turn of the grid.
    for mirrored in [1.0, -1.0] {
        let points = [[f32::NAN; 3], [mirrored, 0.0, 0.0], [0.0, 1.0, 0.0], [mirrored, 1.0, 0.0]];
        let image = RangeImage::from_points(2, 2, points.to_vec(), Viewing::ALONG_MINUS_Z).unwrap();
        let surface = run(&image);
        check(&image, &surface);
        assert_eq!(surface.triangles.len(), 1);
    }
}

#[test]
fn confidence_is_the_cosine_ramped_to_zero_at_the_border() {
    for projection in projections(16, 16) {
        let (centre, hole) = (ahead(&projection), 5 * 16 + 7);
        let normal = (centre.normalize() + DVec3::new(0.3, 0.2, 0.1)).normalize();
        let image = render(16, 16, projection, plane(centre, normal));
        let mut values: Vec<f64> = (0..256).map(|i| image.range(i)).collect();
        values[hole] = f64::NAN;
        let mut image = RangeImage::from_values(16, 16, values, projection).unwrap();
        let surface = run_with(&image, &with_limit(10.0));
        check(&image, &surface);
        let border =
            |r: i32, c: i32| r <= 0 || c <= 0 || r >= 15 || c >= 15 || ((r - 5).abs() <= 1 && (c - 7).abs() <= 1);
        for (&pixel, &confidence) in surface.pixels.iter().zip(&surface.confidence) {
            let (row, col) = (pixel as i32 / 16, pixel as i32 % 16);
            // The 3-4 chamfer distance to the nearest border vertex, by trying all.
            let distance = (0..256)
                .filter(|i| border(i / 16, i % 16))
                .map(|i| ((i / 16 - row).abs(), (i % 16 - col).abs()))
                .map(|(dr, dc)| 3 * dr.max(dc) + dr.min(dc))
                .min()
                .unwrap();
            let ramp = f64::from(distance.min(15)) / 15.0;
            let (_, direction) = image.ray_in_sensor(pixel as usize);
            let cosine = normal.dot(direction).abs();
            assert!(
                (f64::from(confidence) - ramp * cosine).abs() < 1e-6,
                "({row}, {col}) {confidence} {ramp} {cosine}"
            );
        }
        // Given confidences take the cosine's place.
        image.confidence = Some(vec![3.0; 256]);
        let given = run_with(&image, &with_limit(10.0));
        for (k, &pixel) in surface.pixels.iter().enumerate() {
            let (_, direction) = image.ray_in_sensor(pixel as usize);
            let cosine = normal.dot(direction).abs() as f32;
            assert!((given.confidence[k] * cosine - 3.0 * surface.confidence[k]).abs() < 1e-5);
        }
    }
}

#[test]
fn poor_images_give_empty_surfaces() {
    for (rows, cols) in [(0, 0), (0, 5), (5, 0), (1, 1), (1, 9), (9, 1), (3, 3)] {
        let image = heights(rows, cols, |_, _| f64::NAN);
        assert_eq!(run(&image), RangeSurface::default());
        if rows.min(cols) < 2 {
            let surface = run(&heights(rows, cols, |r, c| (r + c) as f64));
            assert_eq!((surface.triangles.len(), surface.isolated_pixels), (0, rows * cols));
        }
    }
    let same = RangeImage::from_points(4, 4, vec![[1.0; 3]; 16], Viewing::ALONG_MINUS_Z).unwrap();
    assert_eq!(run(&same).isolated_pixels, 16, "all samples at one place");
    let huge = RangeImage::from_values(
        3,
        3,
        vec![1e308; 9],
        Projection::Pinhole { focal: [1e-3, 1e-3], centre: [-1.0, -1.0], depth: DepthKind::Planar },
    );
    assert!(huge.unwrap_err().to_string().contains("values reach to 1e308"), "points beyond the range of f64");
}

#[test]
fn bad_parameters_are_named() {
    let image = heights(2, 2, |_, _| 0.0);
    let text = triangulate(&image, &with_limit(-1.0), &Progress::none()).unwrap_err().to_string();
    assert!(text.starts_with("edge_limit must be a finite number > 0, got -1"), "{text}");
    let grazing = TriangulateParams { grazing_limit: 2.0, ..TriangulateParams::default() };
    assert!(
        triangulate(&image, &grazing, &Progress::none())
            .unwrap_err()
            .to_string()
            .starts_with("grazing_limit must be > 0")
    );
}

/// A grid of points with rows for columns.
fn transposed(image: &RangeImage) -> RangeImage {
    let (Samples::Points(points), &Projection::PointGrid(viewing)) = (image.samples(), image.projection()) else {
        panic!("no grid of points")
    };
    let (rows, cols) = (image.rows(), image.cols());
    let points = (0..image.len()).map(|i| points[i % rows * cols + i / rows]).collect();
    RangeImage::from_points(cols, rows, points, viewing).unwrap()
}

/// Triangles as points of the world, apart from the side that they show.
fn in_space(surface: &RangeSurface) -> BTreeSet<[[u64; 3]; 3]> {
    let corners = |t: &[u32; 3]| {
        let mut corners = t.map(|v| surface.positions[v as usize].to_array().map(|x| (x + 0.0).to_bits()));
        corners.sort_unstable();
        corners
    };
    surface.triangles.iter().map(corners).collect()
}

#[test]
fn rows_may_lie_further_apart_than_columns_and_columns_than_rows() {
    for ratio in [1.0, 1.7, 2.1, 3.0, 3.5, 4.0, 10.0, 100.0] {
        for (rows, cols) in [(40, 60), (60, 40), (9, 60)] {
            let projection = Projection::Orthographic { first: [0.0; 2], step: [0.05, 0.05 * ratio] };
            // No step, one that runs down the middle, one that runs across it.
            for (step, is_across) in [(0.0, false), (0.6 * ratio.sqrt(), false), (0.6 * ratio, true)] {
                let is_up = |i: usize| if is_across { i / cols >= rows / 2 } else { i % cols >= cols / 2 };
                let values = (0..rows * cols).map(|i| if is_up(i) { step } else { 0.0 }).collect();
                let image = RangeImage::from_values(rows, cols, values, projection).unwrap();
                let torn = match is_across {
                    _ if step == 0.0 => 0,
                    true => cols - 1,
                    false => rows - 1,
                };
                let grid = as_point_grid(&image);
                for image in [&image, &grid] {
                    let surface = run(image);
                    check(image, &surface);
                    let all = (rows - 1) * (cols - 1);
                    assert_eq!(surface.triangles.len(), 2 * (all - torn), "{rows} x {cols}, {ratio}, a step of {step}");
                }
                let (surface, turned) = (run(&grid), run(&transposed(&grid)));
                assert!(in_space(&turned) == in_space(&surface), "{rows} x {cols}, {ratio}, a step of {step}");
                assert_eq!(turned.spacing, surface.spacing);
            }
        }
    }
}

#[test]
fn a_spinning_scanner_sees_all_of_a_room() {
    // 16 rings 2 degrees apart, samples 0.2 degrees apart, in a box; no ray runs along an axis.
    let projection = Projection::Spherical {
        first: [0.05 - PI, 15_f64.to_radians()],
        step: [0.2_f64.to_radians(), -2_f64.to_radians()],
    };
    let (low, high) = (DVec3::new(-2.5, -2.4, -1.2), DVec3::new(1.5, 0.6, 1.3));
    let wall = |_, to: DVec3| Some((DVec3::select(to.cmpgt(DVec3::ZERO), high, low) / to).min_element());
    let image = render(16, 1800, projection, wall);
    for image in [as_point_grid(&image), image] {
        let surface = run(&image);
        check(&image, &surface);
        assert_eq!(surface.triangles.len(), 2 * 15 * 1799);
        let normals = crate::range_image::normals::normals(&image).unwrap();
        assert!(normals.iter().all(|normal| *normal != [0.0; 3]));
    }
}

#[test]
fn a_slant_makes_no_pixel_longer() {
    // Seen at 80 degrees rows lie 5.8 times as far apart as columns; pixels are square, so one number holds for both.
    for projection in projections(30, 40) {
        let centre = ahead(&projection);
        let towards = centre.normalize();
        let up = projection.ray(10, 20, DVec3::NAN).1 - projection.ray(20, 20, DVec3::NAN).1;
        let up = if up == DVec3::ZERO { DVec3::Y } else { up.normalize() };
        let normal = towards * 80_f64.to_radians().cos() + up * 80_f64.to_radians().sin();
        let image = render(30, 40, projection, |o, d| plane(centre, normal)(o, d).filter(|t| (0.0..9.0).contains(t)));
        let none = &Progress::none();
        for image in [as_point_grid(&image), image] {
            let grid = SampleGrid::new(&image, none).unwrap();
            let spacing = Spacing::of(&image, &grid, none).unwrap();
            assert_eq!(spacing.along_rows, spacing.along_columns, "{projection:?}");
        }
    }
}

#[test]
fn an_image_without_a_triangle_is_an_error_in_three_parts() {
    let image = heights(3, 3, |r, c| if (r + c) % 2 == 0 { 0.0 } else { f64::NAN });
    let said = |image: &RangeImage, params: &TriangulateParams| {
        triangulate(image, params, &Progress::none()).unwrap_err().to_string()
    };
    let text = said(&image, &TriangulateParams::default());
    assert!(text.starts_with("the image: no triangle comes of its 3 x 3 pixels, of which 5 are valid. A"), "{text}");
    assert!(text.contains("triangle needs three neighbouring pixels that no jump separates. Check"), "{text}");
    let flat = heights(3, 3, |_, _| 0.0);
    assert!(
        said(&flat, &with_limit(0.5)).ends_with("Raise edge_limit, which is 0.5, or leave it out to have it measured.")
    );
    let grazing = TriangulateParams { grazing_limit: 0.1, ..TriangulateParams::default() };
    let steep = heights(3, 3, |r, _| r as f64);
    assert!(said(&steep, &grazing).contains("Raise grazing_limit"));
    assert!(said(&heights(3, 3, |_, _| f64::NAN), &grazing).ends_with("pixels of value NaN are not measured."));
}

#[test]
fn a_caller_is_asked_before_each_step_of_the_work() {
    use std::ops::ControlFlow;
    use std::sync::atomic::{AtomicUsize, Ordering};
    let asked = AtomicUsize::new(0);
    let ask = |_| {
        asked.fetch_add(1, Ordering::Relaxed);
        ControlFlow::Continue(())
    };
    let (mut image, params) = (heights(5, 5, |r, c| (r + c) as f64), TriangulateParams::default());
    let surface = triangulate(&image, &params, &Progress::none()).unwrap();
    surface.into_mesh(&image, &Progress::new(ask)).unwrap();
    assert!(asked.swap(0, Ordering::Relaxed) > 0, "attributes of many vertices take their time");
    image.intensity = Some(vec![0.0; 3]);
    triangulate(&image, &params, &Progress::new(ask)).unwrap_err();
    assert!(asked.swap(0, Ordering::Relaxed) > 0, "so does collecting many samples, after the image is looked at");
}
