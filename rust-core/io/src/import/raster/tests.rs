use std::sync::Arc;

use glam::DVec3;

use super::super::damage::{endure, read};
use super::super::file::Parse;
use super::super::options::ReadOptions;
use super::super::scan::Content;
use super::super::{Camera, PixelMeaning};
use super::*;
use base::progress::Progress;
use image::range_image::RangeImage;

fn scan(options: ReadOptions) -> FileScan {
    FileScan { options: Arc::new(options), ..FileScan::new(Path::new("N37E014.x")) }
}

fn image(parse: Parse, bytes: &[u8], options: ReadOptions) -> RangeImage {
    match read(parse, bytes, &scan(options)).unwrap() {
        Content::RangeImage(image) => image,
        other => panic!("{other:?}"),
    }
}

fn refused(parse: Parse, bytes: &[u8], options: ReadOptions) -> String {
    read(parse, bytes, &scan(options)).unwrap_err().to_string()
}

fn values(image: &RangeImage) -> Vec<f64> {
    match image.samples() {
        image::range_image::Samples::Values(values) => values.clone(),
        other => panic!("{other:?}"),
    }
}

/// Equal, where NaN equals NaN.
fn same(found: &[f64], expected: &[f64]) {
    let alike = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
    assert!(found.len() == expected.len() && found.iter().zip(expected).all(alike), "{found:?} is not {expected:?}");
}

fn png_file(colour: ::png::ColorType, depth: ::png::BitDepth, size: [u32; 2], data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

fn npy_file(version: u8, dict: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY".to_vec();
    bytes.extend([version, 0]);
    if version == 1 {
        bytes.extend((dict.len() as u16).to_le_bytes());
    } else {
        bytes.extend((dict.len() as u32).to_le_bytes());
    }
    bytes.extend(dict.as_bytes());
    bytes.extend(data);
    bytes
}

fn tiff_file(values: &[f32], size: [u32; 2]) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = ::tiff::encoder::TiffEncoder::new(&mut bytes).unwrap();
    let mut image = encoder.new_image::<::tiff::encoder::colortype::Gray32Float>(size[0], size[1]).unwrap();
    let tags = image.encoder();
    use ::tiff::tags::Tag;
    tags.write_tag(Tag::ModelPixelScaleTag, &[2.0, 2.0, 0.0][..]).unwrap();
    tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, 4.0e6 + 0.25, 5.0e6, 0.0][..]).unwrap();
    tags.write_tag(Tag::GdalNodata, "-99").unwrap();
    image.write_data(values).unwrap();
    bytes.into_inner()
}

fn camera(cols: usize, rows: usize) -> ReadOptions {
    let camera = Camera { size: Some([cols, rows]), ..Camera::new([2.0, 2.0], [0.5, 0.5]) };
    ReadOptions { camera: Some(camera), ..ReadOptions::default() }
}

const NAN: f64 = f64::NAN;

/// Theorem: rows that a few bytes of a file unpack to don't keep who has cancelled waiting.
#[test]
fn unpacking_can_be_cancelled() {
    let png = png_file(::png::ColorType::Grayscale, ::png::BitDepth::Eight, [500, 500], &[0; 250_000]);
    let tiff = tiff_file(&vec![0.0; 250_000], [500, 500]);
    for (parse, bytes, checks) in [(png::parse as Parse, &png, 499), (tiff::parse, &tiff, 0)] {
        let scan = scan(ReadOptions::default());
        let run = |progress| parse(&mut Cursor::new(bytes), bytes.len() as u64, &scan, &progress);
        run(Progress::none()).unwrap();
        for at in [0, checks / 2, checks] {
            assert!(matches!(run(Progress::cancel_after(at)), Err(Error::Cancelled)), "{at}");
        }
    }
}

#[test]
fn sixteen_bits_are_heights_or_millimetres() {
    let data: Vec<u8> = [0_u16, 1, 1500, 65535].iter().flat_map(|v| v.to_be_bytes()).collect();
    let png = png_file(::png::ColorType::Grayscale, ::png::BitDepth::Sixteen, [2, 2], &data);
    let pgm = [b"P5 # by hand\n2\t2\n65535\n".to_vec(), data].concat();
    for (parse, bytes) in [(png::parse as Parse, &png), (pgm::parse, &pgm)] {
        let heights = image(parse, bytes, ReadOptions::default());
        same(&values(&heights), &[0.0, 1.0, 1500.0, 65535.0]);
        // North is up, the lower left pixel is the origin.
        assert_eq!(heights.point_in_sensor(2), DVec3::new(0.0, 0.0, 1500.0));
        assert_eq!(heights.point_in_sensor(1), DVec3::new(1.0, 1.0, 1.0));
        let options = ReadOptions {
            scale: Some(0.5),
            offset: 10.0,
            step: Some(3.0),
            invalid: Some(0.0),
            ..ReadOptions::default()
        };
        let scaled = image(parse, bytes, options);
        same(&values(&scaled), &[NAN, 10.5, 760.0, 32777.5]);
        assert_eq!(scaled.point_in_sensor(1), DVec3::new(3.0, 3.0, 10.5));
        let depth = image(parse, bytes, camera(2, 2));
        same(&values(&depth), &[NAN, 0.001, 1.5, NAN]);
        assert_eq!(depth.point_in_sensor(2), DVec3::new(-0.375, 0.375, 1.5));
        let error = refused(parse, bytes, camera(640, 480));
        assert!(error.contains("2 x 2 pixels, but the camera's images have 640 x 480: open it apart"), "{error}");
        endure(parse, bytes, &scan(ReadOptions::default()));
    }
    let text = b"P2 2 2 255 0 1\n# c\n15 255";
    same(&values(&image(pgm::parse, text, ReadOptions::default())), &[0.0, 1.0, 15.0, 255.0]);
    endure(pgm::parse, text, &scan(ReadOptions::default()));
}

/// Depth images whose camera nobody gave are height maps, with a hint.
#[test]
fn images_of_sixteen_bits_without_a_camera_are_noted() {
    let data: Vec<u8> = (0..4_u16).flat_map(u16::to_be_bytes).collect();
    let png = png_file(::png::ColorType::Grayscale, ::png::BitDepth::Sixteen, [2, 2], &data);
    let eight = png_file(::png::ColorType::Grayscale, ::png::BitDepth::Eight, [2, 2], &[0, 1, 2, 3]);
    let pgm = [b"P5 # by hand\n2\t2\n65535\n".to_vec(), data].concat();
    let camera = br#"{"fx": 2, "fy": 2, "cx": 0.5, "cy": 0.5}"#.to_vec();
    for (files, is_noted) in [
        (vec![("0.png", &png), ("1.png", &png)], true),
        (vec![("0.pgm", &pgm), ("1.pgm", &pgm), ("2.pgm", &pgm)], true),
        (vec![("0.png", &png)], false),
        (vec![("0.png", &eight), ("1.png", &eight)], false),
        (vec![("0.png", &png), ("1.png", &png), ("camera.json", &camera)], false),
    ] {
        let folder = tempfile::tempdir().unwrap();
        files.iter().for_each(|(name, bytes)| std::fs::write(folder.path().join(name), bytes).unwrap());
        let notes = crate::import::open(folder.path()).unwrap().notes;
        let said = format!("{} images of 16 bits are read as height maps, since no camera is given", files.len());
        assert_eq!(notes.iter().any(|note| note.starts_with(&said)), is_noted, "{notes:?}");
    }
}

#[test]
fn colours_are_heights_only_where_they_say_so() {
    let ground = [1, 134, 160, 255, 1, 200, 0, 255, 2, 0, 5, 0, 1, 134, 161, 255];
    let rgba = png_file(::png::ColorType::Rgba, ::png::BitDepth::Eight, [2, 2], &ground);
    same(&values(&image(png::parse, &rgba, ReadOptions::default())), &[0.0, 1673.6, NAN, 0.1]);
    endure(png::parse, &rgba, &scan(ReadOptions::default()));
    let photo = png_file(::png::ColorType::Rgb, ::png::BitDepth::Eight, [2, 1], &[200, 100, 50, 130, 0, 128]);
    assert!(refused(png::parse, &photo, ReadOptions::default()).contains("pixels = terrain_rgb or terrarium"));
    let terrarium = ReadOptions { pixels: PixelMeaning::Terrarium, ..ReadOptions::default() };
    same(&values(&image(png::parse, &photo, terrarium.clone())), &[18532.1953125, 512.5]);
    let grey = png_file(::png::ColorType::Grayscale, ::png::BitDepth::Eight, [2, 1], &[1, 2]);
    assert!(refused(png::parse, &grey, terrarium).contains("this image is grey"));
    same(&values(&image(png::parse, &grey, ReadOptions::default())), &[1.0, 2.0]);
    let bits = png_file(::png::ColorType::Grayscale, ::png::BitDepth::One, [2, 1], &[0x80]);
    assert!(refused(png::parse, &bits, ReadOptions::default()).contains("grey of 1 bits"));
    let small = ReadOptions { max_decoded_gib: 1e-9, ..ReadOptions::default() };
    assert!(refused(png::parse, &grey, small).contains("max_decoded_gib = 0.000000001 GiB: raise it"));
}

#[test]
fn floats_and_their_places() {
    let heights = [1.5_f32, -99.0, 2.5, 3.5, f32::NAN, 4.5];
    let pixels: Vec<u8> = heights.iter().flat_map(|v| v.to_le_bytes()).collect();
    let big: Vec<u8> = heights.iter().flat_map(|v| v.to_be_bytes()).collect();
    let plain = ReadOptions::default;
    let upside_down = [3.5, NAN, 4.5, 1.5, -99.0, 2.5];
    let pfm = [b"Pf\n3 2\n-1.0\n".to_vec(), pixels.clone()].concat();
    same(&values(&image(pfm::parse, &pfm, plain())), &upside_down);
    same(&values(&image(pfm::parse, &[b"Pf 3 2 1\n".to_vec(), big.clone()].concat(), plain())), &upside_down);
    endure(pfm::parse, &pfm, &scan(plain()));
    let straight = [1.5, -99.0, 2.5, 3.5, NAN, 4.5];
    let dict = |descr: &str, fortran: &str, shape: &str| {
        format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}     \n")
    };
    for (version, descr, data) in [(1, "<f4", &pixels), (2, ">f4", &big), (3, "<f4", &pixels)] {
        let npy = npy_file(version, &dict(descr, "False", "(2, 3, 1)"), data);
        same(&values(&image(npy::parse, &npy, plain())), &straight);
        endure(npy::parse, &npy, &scan(plain()));
    }
    let turned = npy_file(1, &dict("<f4", "True", "(3, 2)"), &pixels);
    same(&values(&image(npy::parse, &turned, plain())), &[1.5, 3.5, -99.0, NAN, 2.5, 4.5]);
    let points = read(npy::parse, &npy_file(1, &dict("<f4", "False", "(2, 3)"), &pixels), &scan(plain()));
    assert!(matches!(points.unwrap(), Content::Points(cloud) if cloud.positions == [DVec3::new(1.5, -99.0, 2.5)]));
    let grid = image(npy::parse, &npy_file(1, &dict("<f4", "False", "(1, 2, 3)"), &pixels), plain());
    assert_eq!((grid.valid_count(), grid.point_in_sensor(0)), (1, DVec3::new(1.5, -99.0, 2.5)));
    for (header, problem) in [
        (dict("<f4", "False", "(4294967296, 4294967296)"), "4294967296 x 4294967296 pixels of 4 bytes"),
        (dict("<f4", "False", "(0, 3)"), "must have at least one"),
        (dict("<c16", "False", "(2, 3)"), "its numbers are of the type <c16, but must be floats of 2, 4 or 8 bytes"),
        (dict("|O", "False", "(2, 3)"), "Convert it with array.astype('f4')"),
        ("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (6,), }".to_owned(), "expected {'descr'"),
        (dict("<f4", "False", "(2, 3, 4, 5)"), "an image must have the shape (rows, cols)"),
    ] {
        let error = refused(npy::parse, &npy_file(1, &header, &pixels), plain());
        assert!(error.contains(problem), "{error}");
    }
    let mut long = npy_file(2, "", &[]);
    long[8..12].copy_from_slice(&[0xFF; 4]);
    assert!(refused(npy::parse, &long, plain()).contains("its length, 4294967295 bytes, is more than"));

    let tiff = tiff_file(&heights, [3, 2]);
    let map = image(tiff::parse, &tiff, plain());
    same(&values(&map), &[1.5, NAN, 2.5, 3.5, NAN, 4.5]);
    // The tie point is the upper left corner of the upper left pixel.
    assert_eq!(map.point_in_world(0), DVec3::new(4.0e6 + 1.25, 5.0e6 - 1.0, 1.5));
    assert_eq!(map.point_in_sensor(3), DVec3::new(0.0, 0.0, 3.5));
    assert_eq!(map.point_in_world(5), DVec3::new(4.0e6 + 5.25, 5.0e6 - 3.0, 4.5));
    endure(tiff::parse, &tiff, &scan(plain()));
}

#[test]
fn half_floats_are_read() {
    let header = |descr: &str| format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (2, 3, 1), }}\n");
    let depths = [0x3C00_u16, 0xC000, 0x5640, 0x7E00, 0x3800, 0x0001];
    let little: Vec<u8> = depths.iter().flat_map(|bits| bits.to_le_bytes()).collect();
    let big: Vec<u8> = depths.iter().flat_map(|bits| bits.to_be_bytes()).collect();
    for npy in [npy_file(1, &header("<f2"), &little), npy_file(1, &header(">f2"), &big)] {
        let map = image(npy::parse, &npy, ReadOptions::default());
        same(&values(&map), &[1.0, -2.0, 100.0, NAN, 0.5, 2f64.powi(-24)]);
    }
}

#[test]
fn esri_grids_keep_their_far_places() {
    let text = "NCOLS 3\nnrows 2\nxllcorner 4000000.5\nyllcorner 5000000\ncellsize 10\nNODATA_value -1\n\
        1 2 -1\n4\n5 6.25\n";
    let map = image(esri::parse, text.as_bytes(), ReadOptions::default());
    same(&values(&map), &[1.0, 2.0, NAN, 4.0, 5.0, 6.25]);
    assert_eq!(map.point_in_world(3), DVec3::new(4_000_005.5, 5_000_005.0, 4.0));
    assert_eq!(map.point_in_world(0), DVec3::new(4_000_005.5, 5_000_015.0, 1.0));
    assert!(esri::sniff(text.as_bytes()) && !esri::sniff(b"ncolsx 1") && !esri::sniff(b"1 2 3"));
    endure(esri::parse, text.as_bytes(), &scan(ReadOptions::default()));
    for (text, problem) in [
        ("ncols 2\nnrows 1\ncellsize 1\n1   \n", "line 4: expected height 1 of 2, but the file ends"),
        ("ncols 2\nnrows 1\ncellsize 1\n1 2 3\n", "line 4: expected the end: there are more heights"),
        ("ncols 2\nnrows 1\ncellsize 1\n1 x\n", "line 4: expected a height, found `x`"),
        ("ncols 2\nnrows 1\n1 2\n", "line 3: the header needs ncols, nrows and cellsize"),
        ("ncols 2\nnrows 1\ncellsize 0\n1 2\n", "line 4: cellsize must be finite and > 0"),
        ("ncols 999999999\nnrows 999999999\ncellsize 1\n1 2\n", "999999999 x 999999999 pixels"),
        ("ncols -2\n", "line 1: expected the number of columns, found `-2`"),
        ("ncols 2\n", "line 1: expected heights, but the file ends"),
    ] {
        let error = refused(esri::parse, text.as_bytes(), ReadOptions::default());
        assert!(error.contains(problem), "{error}");
    }
}

#[test]
fn a_tile_of_one_degree_is_in_metres() {
    let side = 5;
    let heights: Vec<u8> =
        (0..side * side).flat_map(|i: i16| if i == 7 { i16::MIN } else { i - 3 }.to_be_bytes()).collect();
    let map = image(hgt::parse, &heights, ReadOptions::default());
    assert_eq!((map.rows(), map.valid_count(), map.is_valid(7)), (5, 24, false));
    assert_eq!(map.point_in_world(20), DVec3::new(0.0, 0.0, 17.0));
    // One degree at 37.5 N: 88.4 km along the parallel, 111.0 km along the meridian (tables of WGS 84).
    let far = map.point_in_world(4);
    assert!((far.x - 88_418.0).abs() < 30.0 && (far.y - 110_990.0).abs() < 30.0, "{far}");
    endure(hgt::parse, &heights, &scan(ReadOptions::default()));
    assert!(refused(hgt::parse, &heights[1..], ReadOptions::default()).contains("49 bytes must be a square"));
    assert!(refused(hgt::parse, &[], ReadOptions::default()).contains("0 bytes must be a square"));
}

fn exr_file(names: [&str; 2], depths: &[f32], size: (usize, usize)) -> Vec<u8> {
    use ::exr::prelude::*;
    let channel = |name: &str, samples: FlatSamples| AnyChannel::new(name, samples);
    let channels: AnyChannels<FlatSamples> = AnyChannels::sort(
        [
            channel(names[0], FlatSamples::F32(depths.to_vec())),
            channel(names[1], FlatSamples::F16(depths.iter().map(|d| f16::from_f32(*d)).collect())),
        ]
        .into_iter()
        .collect(),
    );
    let layer = Layer::new(size, LayerAttributes::named("a"), Encoding::SMALL_LOSSLESS, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

#[test]
fn the_depth_among_a_render_s_channels() {
    let depths = [1.5_f32, 2.0, 1e10, 4.0, 5.0, 6.5];
    let render = exr_file(["ViewLayer.Depth.Z", "Noise.R"], &depths, (3, 2));
    let options = || ReadOptions { camera: Some(Camera::new([2.0, 2.0], [1.0, 0.5])), ..ReadOptions::default() };
    let depth = image(exr::parse, &render, options());
    same(&values(&depth), &[1.5, 2.0, NAN, 4.0, 5.0, 6.5]);
    let half = exr_file(["A", "Z"], &depths, (3, 2));
    same(&values(&image(exr::parse, &half, options())), &[1.5, 2.0, NAN, 4.0, 5.0, 6.5]);
    let error = refused(exr::parse, &exr_file(["A", "Noise"], &depths, (3, 2)), options());
    assert!(error.ends_with("no channel is a depth (Z, Depth or V): there are A, Noise"), "{error}");
    endure(exr::parse, &render, &scan(options()));
}
