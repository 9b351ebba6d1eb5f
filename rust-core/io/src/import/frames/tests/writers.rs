//! Twins of each layout: every feature that it has, written as its programs write it.

use glam::{DAffine3, DQuat, DVec3};
use image::frame::Camera;
use std::fmt::Write as _;

use super::twin::{FRAMES, Files, Twin, grey8, grey16, jpeg, rows};

/// Columns of low confidence.
pub(super) const LOW: std::ops::Range<usize> = 28..30;

/// Confidence levels, low, medium and high: low in some columns, medium in the one behind them.
pub(super) fn levels([cols, rows]: [usize; 2], [low, medium, high]: [u8; 3]) -> Vec<u8> {
    let level = |col: usize| {
        if LOW.contains(&col) {
            low
        } else if col == LOW.end {
            medium
        } else {
            high
        }
    };
    (0..cols * rows).map(|i| level(i % cols)).collect()
}

pub(super) fn quaternion(pose: DAffine3) -> ([f64; 4], DVec3) {
    (DQuat::from_mat3(&pose.matrix3).to_array(), pose.translation)
}

pub(super) fn seven_scenes(twin: &Twin) -> Files {
    let mut files = Files::default();
    for k in 0..FRAMES {
        let mut depths = twin.whole(k, 1000.0);
        depths.iter_mut().filter(|depth| **depth == 0).for_each(|depth| *depth = 65535);
        files.put(format!("frame-{k:06}.depth.png"), grey16(twin.size(), &depths));
        files.put(format!("frame-{k:06}.color.png"), twin.png(k));
        files.put(format!("frame-{k:06}.pose.txt"), rows(twin.pose(k), "\t"));
    }
    files
}

pub(super) fn tum(twin: &Twin) -> Files {
    let mut files = Files::default();
    let (mut depth, mut rgb, mut poses) = ("# depth\n".to_owned(), "# colour\n".to_owned(), "# poses\n".to_owned());
    for k in 0..FRAMES {
        let time = 1305031453.0 + k as f64;
        let ([x, y, z, w], t) = quaternion(twin.pose(k));
        writeln!(depth, "{time:.6} depth/{time:.6}.png").unwrap();
        writeln!(rgb, "{:.6} rgb/{:.6}.png", time + 0.011, time + 0.011).unwrap();
        writeln!(poses, "{:.4} {} {} {} {x} {y} {z} {w}", time - 0.004, t.x, t.y, t.z).unwrap();
        writeln!(poses, "{:.4} 0 0 0 0 0 0 1", time + 0.5).unwrap();
        files.put(format!("depth/{time:.6}.png"), twin.depth_png(k, 5000.0));
        files.put(format!("rgb/{:.6}.png", time + 0.011), twin.png(k));
    }
    // Of the whole sequence, most of which is not here.
    depth += "1305031499.000000 depth/1305031499.000000.png\n";
    files.put("depth.txt", depth);
    files.put("rgb.txt", rgb);
    files.put("groundtruth.txt", poses);
    files.put("camera.json", r#"{"fx": 525, "fy": 525, "cx": 319.5, "cy": 239.5, "width": 640, "height": 480}"#);
    files
}

pub(super) fn redwood(twin: &Twin) -> Files {
    let mut files = Files::default();
    let mut log = String::new();
    for k in 0..FRAMES {
        let pose = rows(twin.pose(k), " ");
        let words: Vec<&str> = pose.split(' ').collect();
        writeln!(log, "{k} {k} {}", k + 1).unwrap();
        words.chunks(4).for_each(|row| writeln!(log, "{}", row.join(" ")).unwrap());
        // Times in the names differ, and ten comes after two.
        files.put(format!("depth/{}-{:012}.png", k + 8, k * 33_000), twin.depth_png(k, 1000.0));
        files.put(format!("rgb/{}-{:012}.jpg", k + 8, k * 33_000 + 17), twin.jpeg(k));
    }
    files.put("trajectory.log", log);
    files.put("odometry.log", "0 0 1\n");
    files.put(
        "camera_primesense.json",
        r#"{"width": 640, "height": 480, "intrinsic_matrix": [525, 0, 0, 0, 525, 0, 319.5, 239.5, 1]}"#,
    );
    files
}

pub(super) fn icl_rendered(twin: &Twin) -> Files {
    let mut files = Files::default();
    for k in 0..FRAMES {
        let (depth, pose) = (&twin.depths[k], twin.pose(k));
        let text: Vec<String> = (0..depth.len())
            .map(|i| if depth.is_valid(i) { depth.point_in_sensor(i).length() } else { 0.0 })
            .map(|range| format!("{range:.6}"))
            .collect();
        files.put(format!("scene_00_{k:04}.depth"), text.join(" "));
        files.put(format!("scene_00_{k:04}.png"), twin.png(k));
        let vector = |v: DVec3| format!("[{}, {}, {}]';", v.x, v.y, v.z);
        let text = format!(
            "cam_pos = {}\ncam_dir = {}\ncam_up = {}\ncam_sky = [0, 1, 0]';\n",
            vector(pose.translation),
            vector(pose.matrix3.z_axis * 1.0),
            vector(pose.matrix3.y_axis)
        );
        files.put(format!("scene_00_{k:04}.txt"), text);
    }
    files
}

pub(super) fn icl_in_form_of_tum(twin: &Twin) -> Files {
    let mut files = Files::default();
    let mut poses = String::new();
    for k in 0..FRAMES {
        let ([x, y, z, w], t) = quaternion(twin.pose(k));
        writeln!(poses, "{} {} {} {} {x} {y} {z} {w}", k + 7, t.x, t.y, t.z).unwrap();
        files.put(format!("depth/{}.png", k + 7), twin.depth_png(k, 5000.0));
        files.put(format!("rgb/{}.png", k + 7), twin.png(k));
    }
    files.put("livingRoom0.gt.freiburg", poses);
    files.put("depth/99.png", grey16(twin.size(), &vec![0; 64 * 48]));
    files
}

pub(super) fn nerfstudio(twin: &Twin) -> Files {
    let mut files = Files::default();
    let mut frames = Vec::new();
    let Camera { focal, centre, size } = twin.photo;
    let [w, h] = size.unwrap();
    for k in 0..FRAMES {
        let pose = rows(twin.pose_backward(k), ",");
        let words: Vec<&str> = pose.split(',').collect();
        let nested: Vec<String> = words.chunks(4).map(|row| format!("[{}]", row.join(","))).collect();
        // Each frame has its own intrinsics; those for all are wrong.
        frames.push(format!(
            r#"{{"file_path": "./images/f{k}.jpg", "depth_file_path": "depths/f{k}.png", "fl_x": {}, "cx": {},
                "transform_matrix": [{}]}}"#,
            focal[0],
            centre[0] + 0.5,
            nested.join(",")
        ));
        files.put(format!("images/f{k}.jpg"), twin.jpeg(k));
        files.put(format!("depths/f{k}.png"), twin.depth_png(k, 4000.0));
    }
    // One without depth.
    frames.push(
        r#"{"file_path": "images/none.jpg", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}"#.to_owned(),
    );
    let head = format!(
        r#""fl_x": 1, "fl_y": {}, "cx": 1, "cy": {}, "w": {w}, "h": {h}, "k1": 0.0, "camera_model": "OPENCV",
           "depth_unit_scale_factor": 0.00025"#,
        focal[1],
        centre[1] + 0.5
    );
    files.put("transforms.json", format!("{{{head}, \"frames\": [{}]}}", frames.join(",\n")));
    files
}

pub(super) fn polycam(twin: &Twin, corrected: bool) -> Files {
    let mut files = Files::default();
    let Camera { focal, centre, size } = twin.photo;
    let [w, h] = size.unwrap();
    let rim = 10;
    for k in 0..FRAMES {
        let time = 1_650_000_000_000 + k * 250_000;
        let camera = |pose: DAffine3| {
            let numbers = rows(pose, ",");
            let entries = numbers.split(',').take(12).enumerate();
            let entries: String = entries.map(|(i, x)| format!(", \"t_{}{}\": {x}", i / 4, i % 4)).collect();
            format!(
                r#"{{"fx": {}, "fy": {}, "cx": {}, "cy": {}, "width": {w}, "height": {h}, "blur_score": 99.5{entries}}}"#,
                focal[0], focal[1], centre[0], centre[1]
            )
        };
        let put = |files: &mut Files, prefix: &str, pose: DAffine3, image: Vec<u8>| {
            files.put(format!("keyframes/{prefix}cameras/{time}.json"), camera(pose));
            files.put(format!("keyframes/{prefix}images/{time}.jpg"), image);
        };
        let pose = twin.pose_backward(k);
        if corrected {
            let mut colours = twin.colours[k].clone();
            for (i, pixel) in colours.iter_mut().enumerate() {
                let (row, col) = (i / w, i % w);
                if row < 8 || col < rim || w - 1 - col < rim {
                    *pixel = [0; 3];
                }
            }
            put(&mut files, "corrected_", pose, jpeg([w, h], &colours));
            put(&mut files, "", DAffine3::from_translation(DVec3::Y) * pose, twin.jpeg(k));
        } else {
            put(&mut files, "", pose, twin.jpeg(k));
        }
        files.put(format!("keyframes/depth/{time}.png"), twin.depth_png(k, 1000.0));
        files.put(format!("keyframes/confidence/{time}.png"), grey8(twin.size(), &levels(twin.size(), [0, 127, 255])));
    }
    files.put("mesh_info.json", "{}");
    files
}

/// Record3D's metadata: the matrix column by column.
fn record3d_metadata(twin: &Twin) -> String {
    let Camera { focal, centre, size } = twin.photo;
    let ([w, h], [dw, dh]) = (size.unwrap(), twin.size());
    let poses: Vec<String> = (0..FRAMES)
        .map(|k| {
            let ([x, y, z, w], t) = quaternion(twin.pose_backward(k));
            format!("[{x},{y},{z},{w},{},{},{}]", t.x, t.y, t.z)
        })
        .collect();
    format!(
        r#"{{"K": [{}, 0, 0, 0, {}, 0, {}, {}, 1], "w": {w}, "h": {h}, "dw": {dw}, "dh": {dh}, "fps": 60,
            "poses": [{}]}}"#,
        focal[0],
        focal[1],
        centre[0],
        centre[1],
        poses.join(",")
    )
}

fn lzfse(bytes: &[u8]) -> Vec<u8> {
    let mut packed = Vec::new();
    lzfse_rust::encode_bytes(bytes, &mut packed).unwrap();
    packed
}

pub(super) fn record3d(twin: &Twin) -> Files {
    let mut files = Files::default();
    files.put("metadata", record3d_metadata(twin));
    for k in 0..FRAMES {
        let depth: Vec<u8> = twin.floats(k).iter().flat_map(|depth| depth.to_le_bytes()).collect();
        files.put(format!("rgbd/{k}.depth"), lzfse(&depth));
        files.put(format!("rgbd/{k}.conf"), lzfse(&levels(twin.size(), [0, 1, 2])));
        files.put(format!("rgbd/{k}.jpg"), twin.jpeg(k));
    }
    files.put("sound.m4a", "no image");
    files
}

pub(super) fn record3d_exr(twin: &Twin) -> Files {
    let mut files = Files::default();
    files.put("EXR_RGBD/metadata.json", record3d_metadata(twin));
    for k in 0..FRAMES {
        let [cols, rows] = twin.size();
        let channel = exr::prelude::AnyChannel::new("R", exr::prelude::FlatSamples::F32(twin.floats(k)));
        let channels = exr::prelude::AnyChannels::sort([channel].into_iter().collect());
        let layer = exr::prelude::Layer::new(
            (cols, rows),
            exr::prelude::LayerAttributes::named("a"),
            exr::prelude::Encoding::SMALL_LOSSLESS,
            channels,
        );
        let mut bytes = std::io::Cursor::new(Vec::new());
        use exr::prelude::WritableImage as _;
        exr::prelude::Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).unwrap();
        files.put(format!("EXR_RGBD/depth/{k}.exr"), bytes.into_inner());
        files.put(format!("EXR_RGBD/rgb/{k}.jpg"), twin.jpeg(k));
    }
    files
}

pub(super) fn scanner_app(twin: &Twin) -> Files {
    let mut files = Files::default();
    let Camera { focal, centre, .. } = twin.photo;
    for k in 0..FRAMES {
        let json = format!(
            r#"{{"time": 4.5, "cameraPoseARFrame": [{}], "intrinsics": [{}, 0, {}, 0, {}, {}, 0, 0, 1]}}"#,
            rows(twin.pose_backward(k), ","),
            focal[0],
            centre[0],
            focal[1],
            centre[1]
        );
        // Single precision makes the last one this.
        let json = json.replace("1.000000000]", "0.99999988079071045]");
        files.put(format!("frame_{k:05}.json"), json);
        files.put(format!("depth_{k:05}.png"), twin.depth_png(k, 1000.0));
        files.put(format!("conf_{k:05}.png"), grey8(twin.size(), &levels(twin.size(), [0, 1, 2])));
        if k % 3 == 0 {
            files.put(format!("frame_{k:05}.jpg"), twin.jpeg(k));
        }
    }
    files.put("info.json", r#"{"numImages": 70}"#);
    files
}

pub(super) fn stray(twin: &Twin) -> Files {
    let mut files = Files::default();
    let camera = twin.camera.scaled_to([1920, 1440]);
    let mut rows = "timestamp, frame, x, y, z, qx, qy, qz, qw, fx, fy, cx, cy, distortion_center_x\n".to_owned();
    for k in 0..FRAMES {
        let ([x, y, z, w], t) = quaternion(twin.pose(k));
        let [fx, fy, cx, cy] = [camera.focal[0], camera.focal[1], camera.centre[0], camera.centre[1]];
        writeln!(
            rows,
            "{}, {k:06}, {}, {}, {}, {x}, {y}, {z}, {w}, {fx}, {fy}, {cx}, {cy}, ",
            6.5 + k as f64,
            t.x,
            t.y,
            t.z
        )
        .unwrap();
        files.put(format!("depth/{k:06}.png"), twin.depth_png(k, 1000.0));
        files.put(format!("confidence/{k:06}.png"), grey8(twin.size(), &levels(twin.size(), [0, 1, 2])));
    }
    files.put("odometry.csv", rows);
    files.put("camera_matrix.csv", "99, 0.0, 1\n0.0, 99, 1\n0.0, 0.0, 1.0");
    files.put("rgb.mp4", "video");
    files
}

pub(super) fn colmap(twin: &Twin, binary: bool) -> Files {
    let mut files = Files::default();
    let Camera { focal, centre, size } = twin.photo;
    let [w, h] = size.unwrap();
    let params = [focal[0], focal[1], centre[0] + 0.5, centre[1] + 0.5];
    let (mut cameras, mut images) = (1_u64.to_le_bytes().to_vec(), (FRAMES as u64).to_le_bytes().to_vec());
    cameras.extend([7_u32.to_le_bytes(), 1_u32.to_le_bytes()].concat());
    cameras.extend([w as u64, h as u64].map(u64::to_le_bytes).concat());
    cameras.extend(params.map(f64::to_le_bytes).concat());
    let mut text = "# images\n".to_owned();
    for k in 0..FRAMES {
        let ([x, y, z, qw], t) = quaternion(twin.pose(k).inverse());
        let name = format!("f{k}.jpg");
        writeln!(text, "{} {qw} {x} {y} {z} {} {} {} 7 {name}\n1.5 2.5 -1 3.5 4.5 17", k + 1, t.x, t.y, t.z).unwrap();
        images.extend((k as u32 + 1).to_le_bytes());
        images.extend([qw, x, y, z, t.x, t.y, t.z].map(f64::to_le_bytes).concat());
        images.extend(7_u32.to_le_bytes());
        images.extend(name.bytes().chain([0]));
        images.extend([&1_u64.to_le_bytes()[..], &[0; 24]].concat());
        let [cols, rows] = twin.size();
        let map: Vec<u8> = twin.floats(k).iter().flat_map(|depth| depth.to_le_bytes()).collect();
        let kind = if k == 2 { "photometric" } else { "geometric" };
        let map = [format!("{cols}&{rows}&1&").into_bytes(), map].concat();
        files.put(format!("dense/stereo/depth_maps/{name}.{kind}.bin"), map);
        files.put(format!("dense/images/{name}"), twin.jpeg(k));
    }
    if binary {
        files.put("dense/sparse/cameras.bin", cameras);
        files.put("dense/sparse/images.bin", images);
    } else {
        let line = params.map(|p| p.to_string()).join(" ");
        files.put("dense/sparse/cameras.txt", format!("# cameras\n7 PINHOLE {w} {h} {line}\n"));
        files.put("dense/sparse/images.txt", text);
    }
    files
}

pub(super) fn sens(twin: &Twin, packed: bool) -> Vec<u8> {
    let floats = |m: [f64; 16]| m.map(|x| (x as f32).to_le_bytes()).concat();
    let matrix = |pose: DAffine3| floats(glam::DMat4::from(pose).transpose().to_cols_array());
    let camera = |c: Camera| {
        let mut m = [0.0; 16];
        (m[0], m[2], m[5], m[6], m[10], m[15]) = (c.focal[0], c.centre[0], c.focal[1], c.centre[1], 1.0, 1.0);
        floats(m)
    };
    let mut file = 4_u32.to_le_bytes().to_vec();
    file.extend(8_u64.to_le_bytes());
    file.extend(b"StructureSensor".iter().take(8));
    for part in [camera(twin.photo), matrix(DAffine3::IDENTITY), camera(twin.camera), matrix(DAffine3::IDENTITY)] {
        file.extend(part);
    }
    file.extend([2, u32::from(packed)].map(u32::to_le_bytes).concat());
    let ([w, h], [dw, dh]) = (twin.photo.size.unwrap(), twin.size());
    file.extend([w, h, dw, dh].map(|n| (n as u32).to_le_bytes()).concat());
    file.extend(1000_f32.to_le_bytes());
    file.extend((FRAMES as u64 + 1).to_le_bytes());
    for k in 0..=FRAMES {
        // The first is lost.
        let index = k.saturating_sub(1);
        let pose =
            if k == 0 { [f32::NEG_INFINITY; 16].map(f32::to_le_bytes).concat() } else { matrix(twin.pose(index)) };
        let raw: Vec<u8> = twin.whole(index, 1000.0).iter().flat_map(|depth| depth.to_le_bytes()).collect();
        let depth = if packed { zlib(&raw) } else { raw };
        let colour = twin.jpeg(index);
        file.extend(pose);
        file.extend([9_u64, 9, colour.len() as u64, depth.len() as u64].map(u64::to_le_bytes).concat());
        file.extend([colour, depth].concat());
    }
    file.extend(0_u64.to_le_bytes());
    file
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}
