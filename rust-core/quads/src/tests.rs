//! Rules that always hold of a quad grid, whatever the image.

use glam::DVec3;
use proptest::prelude::*;

mod scenes;

use super::stitch::Net;
use super::*;
use base::error::Error;
use base::progress::Progress;
use image::range_image::test_images::{ahead, as_point_grid, plane, projections, render, sphere};
use image::range_image::{Projection, RangeImage, Viewing};
use mesh::{AttributeData, Crs, check};
use scenes::{Scene, params, scenes};

fn flat(rows: usize, cols: usize, z: impl Fn(f64, f64) -> f64) -> RangeImage {
    let values = (0..rows * cols).map(|i| z((i / cols) as f64, (i % cols) as f64)).collect();
    RangeImage::from_values(rows, cols, values, Projection::Orthographic { first: [0.0; 2], step: [1.0, -1.0] })
        .unwrap()
}

fn quads(image: &RangeImage, params: &QuadParams) -> QuadGrid {
    let grid = run(image, params, &Progress::none()).unwrap();
    assert_sound(image, params, &grid);
    grid
}

fn net_of(grid: &QuadGrid) -> Net {
    Net { rows: grid.rows, cols: grid.cols, sites: grid.pixels.clone() }
}

/// Checks all that must hold of a result.
fn assert_sound(image: &RangeImage, params: &QuadParams, grid: &QuadGrid) {
    let report = &grid.report;
    let [down, across] = report.tiles;
    if params.target == Target::AsGiven {
        assert_eq!(grid.rows, (params.rows - 1) * down + 1);
        assert_eq!(grid.cols, (params.columns - 1) * across + 1);
    }
    let net = net_of(grid);
    assert_eq!(net.sites.len(), grid.rows * grid.cols);
    for i in 0..grid.rows {
        for j in 0..grid.cols {
            let [row, col] = net.sites[i * grid.cols + j];
            // Strictly rising both ways, from corner to corner of the image.
            assert!(j == 0 || col > net.sites[i * grid.cols + j - 1][1]);
            assert!(i == 0 || row > net.sites[(i - 1) * grid.cols + j][0]);
            let (last_row, last_col) = (image.rows() as u32 - 1, image.cols() as u32 - 1);
            assert!(i != 0 || row == 0);
            assert!(j != 0 || col == 0);
            assert!(i != grid.rows - 1 || row == last_row);
            assert!(j != grid.cols - 1 || col == last_col);
            if i + 1 < grid.rows && j + 1 < grid.cols {
                assert!(Net::is_sound(net.corners(i, j).map(|v| net.sites[v])), "quad {i} {j} folds");
            }
            // Vertices are samples.
            let index = row as usize * image.cols() + col as usize;
            if image.is_valid(index) {
                assert!(!grid.background[i * grid.cols + j]);
                assert_eq!(grid.positions[i * grid.cols + j], image.point_in_sensor(index));
            }
        }
    }
    assert!(grid.positions.iter().all(|p| p.is_finite()));
    // The errors: no worse than the uniform grid's, and those of the quads.
    // What is missed counts as the depth extent.
    let judged = |error: f64, missed: usize| error * (report.valid_pixels - missed) as f64 + missed as f64;
    let adaptive = judged(report.relative_error, report.missed_pixels);
    let uniform = judged(report.uniform_relative_error, report.uniform_missed_pixels);
    assert!(adaptive <= uniform * (1.0 + 1e-12) || params.target != Target::AsGiven || report.depth_extent == 0.0);
    assert_eq!(report.valid_pixels, image.valid_count());
    let worst = grid.quad_errors.iter().copied().fold(0.0, f32::max);
    assert_eq!(worst, report.max_error as f32);
    assert!(report.relative_error * report.depth_extent <= report.rms_error * (1.0 + 1e-12));
    assert!(report.rms_error <= report.max_error * (1.0 + 1e-12));
    assert_eq!(report.quads, grid.kept.iter().filter(|k| **k).count());
    assert_mesh(image, grid);
}

fn assert_mesh(image: &RangeImage, grid: &QuadGrid) {
    let (mesh, triangles) = (grid.mesh(), grid.triangles());
    assert_eq!((mesh.quads.len(), triangles.triangles.len()), (grid.report.quads, 2 * grid.report.quads));
    assert_eq!(mesh.uvs.len(), mesh.positions.len());
    triangles.validate().unwrap();
    let found = check(&triangles);
    assert!(found.is_manifold() && found.unused_vertices == 0, "{found}");
    let int = |name: &str| match triangles.vertex_attribute(name) {
        Some(AttributeData::I32(v)) => v.clone(),
        other => panic!("{name}: {other:?}"),
    };
    let (row, col) = (int("range_row"), int("range_col"));
    for (v, [u, w]) in mesh.uvs.iter().enumerate() {
        assert!((0.0..=1.0).contains(u) && (0.0..=1.0).contains(w));
        assert!((f64::from(*u) * (image.cols() as f64 - 1.0) - f64::from(col[v])).abs() < 1e-3);
        assert!(((1.0 - f64::from(*w)) * (image.rows() as f64 - 1.0) - f64::from(row[v])).abs() < 1e-3);
    }
    // Over the pixels every triangle turns the same way: none folds over, none is empty.
    for t in &triangles.triangles {
        let [a, b, c] = t.map(|v| [i64::from(col[v as usize]), i64::from(row[v as usize])]);
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        assert!(if grid.mirrored { area > 0 } else { area < 0 });
    }
}

/// The mean error by the textbook: every pixel looks for its quad and its triangle.
fn plain_errors(image: &RangeImage, grid: &QuadGrid) -> Vec<f64> {
    let net = net_of(grid);
    let mut errors = Vec::new();
    for index in (0..image.len()).filter(|&i| image.is_valid(i)) {
        let (row, col) = ((index / image.cols()) as i64, (index % image.cols()) as i64);
        let turn = |a: [u32; 2], b: [u32; 2]| {
            let [r0, c0, r1, c1] = [a[0], a[1], b[0], b[1]].map(i64::from);
            (c1 - c0) * (row - r0) - (r1 - r0) * (col - c0)
        };
        let inside = |corners: &[usize]| {
            (0..corners.len()).all(|k| turn(net.sites[corners[k]], net.sites[corners[(k + 1) % corners.len()]]) >= 0)
        };
        let (origin, direction) = image.ray_in_sensor(index);
        let sample = (image.point_in_sensor(index) - origin).dot(direction);
        let mut found = Vec::new();
        for quad in 0..grid.kept.len() {
            let [a, b, c, d] = grid.corners(quad);
            if inside(&[a, b, c, d]) {
                let halves = if grid.odd_diagonals[quad] { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] };
                for half in halves.iter().filter(|h| inside(&h[..])) {
                    let [p, q, r] = half.map(|v| grid.positions[v]);
                    let normal = (q - p).cross(r - p);
                    found.push(((p - origin).dot(normal) / direction.dot(normal) - sample).abs());
                }
            }
        }
        // On a shared side all agree.
        assert!(!found.is_empty());
        errors.push(found[0]);
    }
    errors
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(192)))]

    #[test]
    fn any_image_keeps_every_promise(scene in scenes(), kind in 0..32_usize, params in params()) {
        let image = scene.seen(kind);
        match run(&image, &params, &Progress::none()) {
            Ok(grid) => {
                assert_sound(&image, &params, &grid);
                let other = run(&image, &QuadParams { threads: 1, ..params }, &Progress::none()).unwrap();
                let same = |g: &QuadGrid| {
                    let mut g = g.clone();
                    g.report.seconds.clear();
                    g
                };
                prop_assert_eq!(same(&grid), same(&other));
                // Flat and pinhole images alone: seen on the pixels a straight edge is straight there.
                if kind < 16 && !matches!(image.projection(), Projection::Spherical { .. }) {
                    let errors = plain_errors(&image, &grid);
                    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
                    let max = errors.iter().copied().fold(0.0, f64::max);
                    let report = &grid.report;
                    // Nothing is a share of no extent.
                    let told = report.relative_error * report.depth_extent;
                    prop_assert!(report.depth_extent == 0.0 || (mean - told).abs() <= 1e-9, "{} {:?}", mean, report);
                    prop_assert!((max - report.max_error).abs() <= 1e-9, "{} {:?}", max, report);
                }
            }
            Err(Error::Input(text)) => {
                let needed = |tiles: Option<usize>, n: usize, pixels: usize| (n - 1) * tiles.unwrap() >= pixels;
                prop_assert!(
                    text.contains("quads is covered by valid pixels")
                        || needed(params.tiles_down, params.rows, scene.rows)
                        || needed(params.tiles_across, params.columns, scene.cols),
                    "{}", text
                );
            }
            Err(error) => prop_assert!(false, "{}", error),
        }
    }

    #[test]
    fn a_wanted_error_is_kept(scene in scenes(), kind in 0..32_usize, error in 0.0..0.3_f64, max in any::<bool>()) {
        let image = scene.seen(kind);
        let target = if max { Target::Max(error) } else { Target::Rms(error) };
        let params = QuadParams { target, threads: 2, ..QuadParams::default() };
        // Holes may leave no quad at all.
        let made = run(&image, &params, &Progress::none());
        prop_assume!(!matches!(&made, Err(Error::Input(text)) if text.contains("quads is covered by valid pixels")));
        let grid = made.unwrap();
        assert_sound(&image, &params, &grid);
        let reached = if max { grid.report.max_error } else { grid.report.rms_error };
        // A vertex a pixel is the last resort; its errors are rounding, or endless if holes leave no quad.
        let is_last = grid.pixels.len() == image.len() && (reached < 1e-6 || !grid.kept.contains(&true));
        prop_assert!(reached <= error || is_last, "{} > {}", reached, error);
    }
}

#[test]
fn a_grid_whose_vertices_meet_no_sample_lies_at_the_samples() {
    for projection in projections(9, 7) {
        // Inside: none of the corners, which are all the vertices.
        let mut values = vec![f64::NAN; 9 * 7];
        for i in [2 * 7 + 2, 2 * 7 + 3, 3 * 7 + 2, 4 * 7 + 5] {
            values[i] = 2.0;
        }
        let image = RangeImage::from_values(9, 7, values, projection).unwrap();
        for image in [as_point_grid(&image), image] {
            let params = QuadParams {
                tiles_down: Some(1),
                tiles_across: Some(1),
                rows: 2,
                columns: 2,
                gap_passes: 0,
                coverage: 0.0,
                threads: 1,
                ..QuadParams::default()
            };
            let grid = quads(&image, &params);
            assert!(grid.background.iter().all(|b| *b));
            // A sphere of radius 2 bends away from its flat grid by less than that.
            assert!(grid.report.max_error < 0.4, "{projection:?}: {:?}", grid.report);
        }
    }
}

#[test]
fn planes_are_met_exactly_by_every_sensor() {
    for projection in projections(41, 33) {
        let point = ahead(&projection);
        let image = render(41, 33, projection, plane(point, point + DVec3::new(0.2, -0.1, 0.15)));
        for image in [as_point_grid(&image), image] {
            let grid = quads(&image, &QuadParams { threads: 1, ..QuadParams::default() });
            assert!(grid.report.max_error < 1e-6, "{projection:?}: {:?}", grid.report);
            assert!(grid.kept.iter().all(|k| *k));
            // All faces look at the sensor.
            let mesh = grid.triangles();
            for t in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.corners(t);
                assert!((b - a).cross(c - a).dot(image.projection().view_direction(a)) < 0.0, "{projection:?}");
            }
        }
    }
}

#[test]
fn features_draw_vertices_and_the_error_falls() {
    // A ridge, a sphere on a plane, a fine bump: each is met better than by the uniform grid.
    let images = [
        flat(200, 220, |r, c| if (c - 0.3 * r - 60.0).abs() < 9.0 { 5.0 } else { 0.0 }),
        flat(200, 220, |r, c| (2500.0 - (r - 90.0).powi(2) - (c - 120.0).powi(2)).max(0.0).sqrt()),
        flat(200, 220, |r, c| 20.0 * (-((r - 55.0).powi(2) + (c - 140.0).powi(2)) / 60.0).exp()),
    ];
    for (k, image) in images.iter().enumerate() {
        for smoothing in [0.0, 1.0] {
            let params = QuadParams { smoothing, threads: 2, ..QuadParams::default() };
            let report = quads(image, &params).report;
            assert!(!report.is_uniform, "{k}");
            assert!(report.relative_error < 0.95 * report.uniform_relative_error, "{k}: {report:?}");
        }
    }
}

#[test]
fn a_mask_is_followed() {
    let projection = projections(120, 130)[0];
    let image = render(120, 130, projection, sphere(ahead(&projection), 0.25));
    // A grid that knows nothing of the rim.
    let params = QuadParams { floor: 1e6, tiles_down: Some(2), threads: 2, ..QuadParams::default() };
    let grid = quads(&image, &params);
    assert!(grid.report.snapped > 0 && grid.kept.iter().any(|k| !k), "{:?}", grid.report);
    for quad in (0..grid.kept.len()).filter(|&q| grid.kept[q]) {
        assert!(grid.corners(quad).iter().all(|&v| !grid.background[v]));
    }
    // Nearly the whole disk is covered by the mesh.
    let mesh = grid.triangles();
    let area: f64 = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            0.5 * (b - a).cross(c - a).z.abs()
        })
        .sum();
    let disk = std::f64::consts::PI * 0.25 * 0.25;
    assert!(area > 0.93 * disk && area < disk * 1.001, "{area} of {disk}");
    // Everything on request: the whole rectangle.
    let whole = quads(&image, &QuadParams { coverage: 0.0, ..params });
    assert!(whole.kept.iter().all(|k| *k) && check(&whole.triangles()).components == 1);
    assert_eq!((whole.pixels, whole.positions), (grid.pixels, grid.positions));
}

#[test]
fn single_gaps_are_filled_and_a_vertex_may_stand_on_one() {
    let image = flat(33, 33, |r, c| if (r as usize, c as usize) == (16, 16) { f64::NAN } else { r + 2.0 * c });
    let params =
        QuadParams { tiles_down: Some(1), tiles_across: Some(1), rows: 3, columns: 3, ..QuadParams::default() };
    let grid = quads(&image, &params);
    assert_eq!((grid.report.gaps_filled, grid.background.contains(&true), grid.report.valid_pixels), (1, false, 1088));
    assert_eq!(grid.positions[4], DVec3::new(16.0, -16.0, 48.0));
    let holed = quads(&image, &QuadParams { gap_passes: 0, ..params });
    assert!(holed.report.gaps_filled == 0 && holed.report.max_error < 1e-9);
}

#[test]
fn units_and_offsets_do_not_matter() {
    let scene = Scene { rows: 50, cols: 44, seed: 7, holes: 0.05, roughness: 0.01, step: 0.5 };
    let of = |scale: f64, offset: f64| {
        let image = flat(50, 44, |r, c| scale * scene.value(r, c) + offset);
        quads(&image, &QuadParams { tiles_down: Some(2), ..QuadParams::default() }).pixels
    };
    let pixels = of(1.0, 0.0);
    for scale in [0.5_f64.powi(40), 2.0_f64.powi(20), 2.0_f64.powi(400)] {
        assert_eq!(of(scale, 0.0), pixels);
    }
}

#[test]
fn attributes_ride_along() {
    let mut image = flat(30, 30, |r, c| (r * 0.3).sin() + (c * 0.2).cos());
    image.colour = Some((0..900).map(|i| [(i / 30) as u8, (i % 30) as u8, 7, 255]).collect());
    image.intensity = Some((0..900).map(|i| i as f32).collect());
    let params = QuadParams { rows: 4, columns: 5, ..QuadParams::default() };
    let (grid, mesh) = (quads(&image, &params), quads(&image, &params).mesh());
    assert_eq!(mesh.vertex_attributes.len(), 6);
    for (name, data) in mesh.vertex_attributes.iter().map(|a| (a.name.as_str(), &a.data)) {
        match data {
            AttributeData::Colour(colours) => {
                for (v, colour) in colours.iter().enumerate() {
                    let vertex = grid.positions.iter().position(|p| *p == mesh.positions[v]).unwrap();
                    assert_eq!(*colour, [grid.pixels[vertex][0] as u8, grid.pixels[vertex][1] as u8, 7, 255]);
                }
            }
            _ => assert_eq!(data.len(), mesh.positions.len(), "{name}"),
        }
    }
}

#[test]
fn what_cannot_be_done_is_said() {
    let message =
        |image: &RangeImage, params: &QuadParams| run(image, params, &Progress::none()).unwrap_err().to_string();
    let small = flat(9, 40, |r, _| r);
    let params = QuadParams::default();
    assert!(message(&flat(1, 40, |_, _| 0.0), &params).contains("at least 2 x 2 pixels"));
    assert!(message(&flat(0, 0, |_, _| 0.0), &params).contains("at least 2 x 2 pixels"));
    assert!(message(&flat(20, 20, |_, _| f64::NAN), &params).contains("no pixel is valid"));
    assert!(message(&small, &QuadParams { rows: 10, ..params }).contains("ask for fewer rows"));
    assert!(message(&small, &QuadParams { tiles_across: Some(usize::MAX), ..params }).contains("tiles_across must be"));
    assert!(message(&small, &QuadParams { rows: 1, ..params }).contains("rows must be >= 2"));
    assert!(message(&small, &QuadParams { floor: f64::NAN, ..params }).contains("floor must be"));
    let target = Target::Max(-1.0);
    assert!(
        message(&small, &QuadParams { target, ..params }).contains("max_error must be a finite number >= 0, got -1")
    );
    assert!(message(&flat(20, 20, |r, _| if r < 9.0 { 1e308 } else { -1e308 }), &params).contains("use a larger unit"));
    let scattered = flat(20, 20, |r, c| if (r + c) % 5.0 == 0.0 { 1.0 } else { f64::NAN });
    let text = message(&scattered, &QuadParams { coverage: 1.0, gap_passes: 0, ..params });
    assert!(text.contains("a mesh has at least one quad. Lower coverage"), "{text}");
    let mut named = flat(20, 20, |_, _| f64::NAN);
    named.name = "chin".to_owned();
    assert!(message(&named, &params).starts_with("chin: "));
    named.colour = Some(vec![[0; 4]; 3]);
    assert!(message(&named, &params).contains("colours"));
}

/// Of any image there comes a whole grid of finite vertices, or an error that says what is the matter with it.
#[test]
fn strange_images_give_a_whole_grid_or_a_reason() {
    let big = |r: f64, c: f64| if ((r + c) as usize).is_multiple_of(2) { 1e300 } else { -1e300 };
    let wild =
        |r: f64, c: f64| [0.0, -0.0, 1e-320, -5.0, f64::INFINITY, f64::NAN, 1e18][(r * 31.0 + c * 7.0) as usize % 7];
    let mut outcomes = [0; 2];
    let mut take = |image: &RangeImage| {
        for target in [Target::AsGiven, Target::Max(1e-3)] {
            match run(image, &QuadParams { target, ..QuadParams::default() }, &Progress::none()) {
                Ok(grid) => {
                    grid.mesh().validate().unwrap();
                    assert_eq!(grid.positions.len(), grid.rows * grid.cols);
                    assert!(grid.positions.iter().all(|p| p.is_finite()));
                    outcomes[0] += 1;
                }
                Err(Error::Input(text)) => {
                    assert!(REASONS.iter().any(|reason| text.contains(reason)), "{text}");
                    outcomes[1] += 1;
                }
                Err(error) => panic!("{error}"),
            }
        }
    };
    for value in
        [&big as &dyn Fn(f64, f64) -> f64, &wild, &|_, _| 0.0, &|r, c| if r + c < 1.0 { 1.0 } else { f64::NAN }]
    {
        for projection in projections(20, 20) {
            let values = (0..400).map(|i| value((i / 20) as f64, (i % 20) as f64)).collect();
            take(&RangeImage::from_values(20, 20, values, projection).unwrap());
        }
        let points: Vec<[f32; 3]> =
            (0..400).map(|i| [value(f64::from(i), 3.0) as f32, value(1.0, f64::from(i)) as f32, 1.0]).collect();
        for viewing in [Viewing::ALONG_MINUS_Z, Viewing::From(DVec3::ZERO)] {
            take(&RangeImage::from_points(20, 20, points.clone(), viewing).unwrap());
        }
    }
    assert!(outcomes.iter().all(|&count| count > 4), "{outcomes:?}");
}

/// Of images that no grid is made of.
const REASONS: [&str; 3] = [
    "quads is covered by valid pixels",
    "no pixel is valid",
    "are farther than can be computed with: use a larger unit",
];

#[test]
fn no_grid_is_made_in_degrees() {
    let mut image = Scene { rows: 20, cols: 20, seed: 3, holes: 0.0, roughness: 0.01, step: 0.5 }.seen(0);
    image.crs = Some(Crs::new("EPSG:4326").unwrap());
    let error = run(&image, &QuadParams::default(), &Progress::none()).unwrap_err().to_string();
    assert!(error.starts_with("its coordinates are degrees (EPSG:4326), in which nothing can be measured"), "{error}");
}

#[test]
fn cancelling_stops_at_every_check() {
    let image = Scene { rows: 60, cols: 60, seed: 3, holes: 0.1, roughness: 0.01, step: 0.5 }.seen(0);
    for target in [Target::AsGiven, Target::Rms(0.01)] {
        let params = QuadParams { target, threads: 1, ..QuadParams::default() };
        let mut checks = 0;
        while let Err(error) = run(&image, &params, &Progress::cancel_after(checks)) {
            assert!(matches!(error, Error::Cancelled), "{error}");
            checks += 1 + checks / 4;
        }
        assert!(checks > 100);
    }
}
