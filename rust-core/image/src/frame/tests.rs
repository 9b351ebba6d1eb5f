//! Truth that can be derived: planes seen by two cameras whose colours say where they are.

use glam::{DAffine3, DQuat, DVec3};

use super::*;
use base::error::Error;

/// A depth image of so many rows and columns whose ray meets a plane at distance z along its axis, or what `depth`
/// gives.
fn depth(rows: usize, cols: usize, camera: Camera, depth: impl Fn(usize, usize) -> f64) -> RangeImage {
    let values = (0..rows * cols).map(|i| depth(i / cols, i % cols)).collect();
    RangeImage::from_values(rows, cols, values, camera.projection(DepthKind::Planar)).unwrap()
}

/// A colour image whose pixels hold their own column and row, in units of `unit` pixels.
fn ramp(camera: Camera, unit: usize) -> ColourImage {
    let [cols, rows] = camera.size.unwrap();
    let pixels = (0..rows * cols).map(|i| [(i % cols / unit) as u8, (i / cols / unit) as u8, 7]).collect();
    ColourImage { camera, pixels, colour_from_depth: DAffine3::IDENTITY, black_rim: false }
}

fn made(frame: Frame) -> (RangeImage, LeftOutReport) {
    frame.into_range_image(&Progress::none()).unwrap()
}

/// Theorem: a camera scaled to another size sees a point at the same share of its image.
#[test]
fn pixel_centres_are_kept() {
    let camera = Camera::sized([1447.0, -1450.0], [966.0, 691.5], [1920, 1440]);
    let small = camera.scaled_to([256, 192]);
    for point in [DVec3::new(0.1, 0.2, 1.0), DVec3::new(-1.0, 0.5, 2.0)] {
        let (of, at) = (camera.project(point), small.project(point));
        for (axis, share) in [1920.0 / 256.0, 1440.0 / 192.0].into_iter().enumerate() {
            assert!(((of[axis] + 0.5) - (at[axis] + 0.5) * share).abs() < 1e-9);
        }
    }
    let back = small.scaled_to([1920, 1440]);
    assert!((back.centre[0] - 966.0).abs() < 1e-9 && back.size == camera.size);
    let unknown = Camera::new([5.0, 5.0], [1.0, 1.0]).scaled_to([4, 3]);
    assert_eq!(unknown, Camera::sized([5.0, 5.0], [1.0, 1.0], [4, 3]));
}

/// Theorem: an image that is registered gives each pixel its own colour. Of a larger one each sample takes the colour of the place that its
/// ray goes through.
#[test]
fn colours_are_those_of_the_rays() {
    let camera = Camera::sized([40.0, 40.0], [31.5, 23.5], [64, 48]);
    let image = depth(48, 64, camera, |row, _| if row == 5 { f64::NAN } else { 2.0 });
    let (same, _) = made(Frame { colour: Some(ramp(camera, 1)), ..Frame::new(image.clone()) });
    let (larger, left_out) =
        made(Frame { colour: Some(ramp(camera.scaled_to([256, 192]), 4)), ..Frame::new(image.clone()) });
    let (same, larger) = (same.colour.unwrap(), larger.colour.unwrap());
    for i in (0..image.len()).filter(|&i| image.is_valid(i)) {
        assert_eq!(same[i], [(i % 64) as u8, (i / 64) as u8, 7, 255]);
        assert_eq!(larger[i], same[i]);
    }
    assert_eq!(left_out, LeftOutReport { of: 47 * 64, ..LeftOutReport::default() });
    assert_eq!(left_out.in_words(), None);
}

/// Theorem: with the camera to the side, a sample that a nearer surface hides has no colour, those that it sees have
/// the one at the place where it sees them, and those outside of its image have none.
#[test]
fn what_is_hidden_has_no_colour() {
    let camera = Camera::sized([80.0, 80.0], [63.5, 47.5], [128, 96]);
    // A post of 20 columns, one metre away, before a wall at two.
    let (near, far) = (1.0, 2.0);
    let post = 54..74;
    let image = depth(96, 128, camera, |_, col| if post.contains(&col) { near } else { far });
    let mut colour = ramp(camera.scaled_to([256, 192]), 1);
    // The colour camera stands to the right of the depth sensor: it sees less of the wall left of the post.
    let shift = 0.1;
    colour.colour_from_depth = DAffine3::from_translation(DVec3::new(-shift, 0.0, 0.0));
    let (out, _) = made(Frame { colour: Some(colour.clone()), ..Frame::new(image.clone()) });
    let found = out.colour.unwrap();
    let (mut hidden, mut seen) = (0, 0);
    for i in 0..image.len() {
        let point = image.point_in_sensor(i);
        let [x, _] = colour.camera.project(point - DVec3::X * shift);
        // The post's edges as the colour camera sees them, in its own pixels.
        let edges = [53.5, 73.5].map(|col| ((col - 63.5) / 80.0 * near - shift) / near * 160.0 + 127.5);
        let is_behind = point.z > near && (edges[0]..edges[1]).contains(&x);
        let is_outside = !(-0.5..255.5).contains(&x);
        // Within two samples of the edge either is right.
        let is_near_edge = edges.iter().any(|edge| (x - edge).abs() < 4.0);
        if is_outside {
            assert_eq!(found[i][3], 0);
        } else if !is_near_edge {
            assert_eq!(found[i][3] == 0, is_behind, "pixel {i} at {x}");
            hidden += usize::from(is_behind);
            if !is_behind {
                seen += 1;
                assert!((f64::from(found[i][0]) - x).abs() <= 0.51, "{:?} for {x}", found[i]);
            }
        }
    }
    assert!(hidden >= 96 * 2 && seen > 96 * 90, "{hidden} hidden, {seen} seen");
}

/// Theorem: a surface that is seen at a grazing angle, and one seen by a turned camera, hides nothing of itself.
#[test]
fn a_slope_does_not_hide_itself() {
    let camera = Camera::sized([80.0, 80.0], [63.5, 47.5], [128, 96]);
    let slope = |_: usize, col: usize| 1.0 / (1.0 - 1.2 * (col as f64 - 63.5) / 80.0).max(0.05);
    let image = depth(96, 128, camera, slope);
    let mut colour = ramp(camera.scaled_to([256, 192]), 1);
    let turn = DAffine3::from_quat(DQuat::from_rotation_y(0.05));
    colour.colour_from_depth = turn * DAffine3::from_translation(DVec3::new(0.03, 0.01, 0.0));
    let (out, _) = made(Frame { colour: Some(colour), ..Frame::new(image) });
    let found = out.colour.unwrap();
    // Inside, where nothing lies out of the image.
    let none = (0..96 * 128).filter(|i| (20..90).contains(&(i % 128)) && (10..86).contains(&(i / 128)));
    assert_eq!(none.filter(|&i| found[i][3] == 0).count(), 0);
}

#[test]
fn what_can_not_be_trusted_is_left_out_and_counted() {
    let camera = Camera::sized([40.0, 40.0], [31.5, 23.5], [64, 48]);
    let image = depth(48, 64, camera, |row, col| if row == 0 { f64::NAN } else { 1.0 + col as f64 / 10.0 });
    // Half as large as the depth: a pixel speaks of four.
    let levels = (0..32 * 24).map(|i| if i % 32 < 4 { 0 } else { 2 }).collect();
    let confidence = ConfidenceImage { size: [32, 24], levels, least: 1 };
    let mut colour = ramp(camera.scaled_to([256, 192]), 2);
    colour.black_rim = true;
    for (i, pixel) in colour.pixels.iter_mut().enumerate() {
        *pixel = if i / 256 >= 184 { [1, 0, 2] } else { [200, 100, 50] };
    }
    let frame = Frame { colour: Some(colour), confidence: Some(confidence), reach: Some(5.0), ..Frame::new(image) };
    let (out, left_out) = made(frame.clone());
    let samples = 47;
    // 8 columns by confidence; columns 41 on lie beyond 5; of the rest the rows whose centre falls on row 176 on.
    let in_rim = (0..48).filter(|row| (f64::from(*row) + 0.5) * 4.0 - 0.5 >= 175.5).count();
    let expected = LeftOutReport {
        of: 64 * samples,
        low_confidence: 8 * samples,
        out_of_reach: 23 * samples,
        black_rim: 33 * in_rim,
        ..LeftOutReport::default()
    };
    assert_eq!(left_out, expected);
    assert_eq!(out.valid_count(), expected.of - 31 * samples - 33 * in_rim);
    let words = left_out.in_words().unwrap();
    assert!(
        words.starts_with("left out of the samples: 12.5 % of low confidence, 35.9 % beyond the sensor's reach, "),
        "{words}"
    );
    let cut = ConfidenceImage { levels: vec![1; 3], ..frame.confidence.clone().unwrap() };
    let error = Frame { confidence: Some(cut), ..frame.clone() }.into_range_image(&Progress::none()).unwrap_err();
    assert!(error.to_string().contains("the confidence image of 32 x 24 pixels has 3"), "{error}");
    let cancelled = frame.into_range_image(&Progress::cancel_after(0));
    assert!(matches!(cancelled, Err(Error::Cancelled)));
}

#[test]
fn enlarged_depth_is_taken_in_its_own_size_and_a_background_left_out() {
    // A wall that is turned, and a background that stands for nothing.
    let (small, times) = ([40, 30], 4);
    let depth = |r: usize, c: usize| if c > 35 { 1e10 } else { 1.0 + 0.003 * r as f64 + 0.004 * (c * c) as f64 / 7.0 };
    let image = |times: usize| {
        let [cols, rows] = small.map(|side| side * times);
        let scale = times as f64;
        let centre = [19.5, 14.5].map(|c| (c + 0.5) * scale - 0.5);
        let projection = Camera::new([30.0 * scale; 2], centre).projection(DepthKind::Planar);
        let values = (0..rows * cols).map(|i| depth(i / cols / times, i % cols / times)).collect();
        RangeImage::from_values(rows, cols, values, projection).unwrap()
    };
    let (as_it_was, of_small) = made(Frame::new(image(1)));
    let (back, of_large) = made(Frame::new(image(times)));
    assert_eq!([back.cols(), back.rows()], small);
    assert_eq!((of_small.far, of_large.far), (4 * 30, 4 * 30));
    let ranges = |image: &RangeImage| -> Vec<u64> { (0..image.len()).map(|i| image.range(i).to_bits()).collect() };
    assert_eq!(ranges(&back), ranges(&as_it_was));
    assert_eq!(of_large.enlarged, Some([[160, 120], small]));
    let words = of_large.in_words().unwrap();
    assert!(words.starts_with("160 x 120 pixels of depth are 40 x 30 pixels, repeated, "), "{words}");
    assert!(words.ends_with("left out of the samples: 10.0 % far beyond all others"), "{words}");
}
