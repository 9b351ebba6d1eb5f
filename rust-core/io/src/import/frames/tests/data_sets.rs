//! Twins of further layouts: data sets in folders, RTAB-Map's export, instant-ngp's list.

use glam::{DAffine3, DMat3, DVec3};
use image::frame::Camera;
use std::fmt::Write as _;

use super::twin::{FRAMES, Files, Twin, grey8, rows};
use super::writers::{levels, quaternion};

/// The rows of a matrix on four lines.
fn four_lines(pose: DAffine3) -> String {
    let words: Vec<String> = rows(pose, " ").split(' ').map(str::to_owned).collect();
    words.chunks(4).map(|row| row.join(" ") + "\n").collect()
}

fn intrinsics(camera: Camera) -> String {
    let ([fx, fy], [cx, cy]) = (camera.focal, camera.centre);
    format!("{fx} 0 {cx} 0\n0 {fy} {cy} 0\n0 0 1 0\n0 0 0 1\n")
}

/// Colours have their own camera. One frame was lost.
pub(super) fn scannet(twin: &Twin) -> Files {
    let mut files = Files::default();
    for k in 0..FRAMES {
        files.put(format!("depth/{}.png", k * 20), twin.depth_png(k, 1000.0));
        files.put(format!("color/{}.jpg", k * 20), twin.jpeg(k));
        files.put(format!("pose/{}.txt", k * 20), four_lines(twin.pose(k)));
    }
    files.put("depth/990.png", twin.depth_png(0, 1000.0));
    files.put("color/990.jpg", twin.jpeg(0));
    files.put("pose/990.txt", "-inf -inf -inf -inf\n".repeat(4));
    files.put("intrinsic/intrinsic_depth.txt", intrinsics(twin.camera));
    files.put("intrinsic/intrinsic_color.txt", intrinsics(twin.photo));
    files.put("intrinsic/extrinsic_depth.txt", four_lines(DAffine3::IDENTITY));
    files.put("intrinsic/extrinsic_color.txt", four_lines(DAffine3::IDENTITY));
    files
}

pub(super) fn replica(twin: &Twin) -> Files {
    let mut files = Files::default();
    let mut poses = String::new();
    for k in 0..FRAMES {
        writeln!(poses, "{}", rows(twin.pose(k), " ")).unwrap();
        files.put(format!("results/depth{k:06}.png"), twin.depth_png(k, 6000.0));
        files.put(format!("results/frame{k:06}.jpg"), twin.jpeg(k));
    }
    files.put("traj.txt", poses);
    let Camera { focal, centre, size } = twin.camera;
    let ([fx, fy], [cx, cy], [w, h]) = (focal, centre, size.unwrap());
    let camera = format!(r#"{{"w": {w}, "h": {h}, "fx": {fx}, "fy": {fy}, "cx": {cx}, "cy": {cy}, "scale": 6000.0}}"#);
    files.put("cam_params.json", format!("{{\"camera\": {camera}}}"));
    files
}

/// Poses in between have no image. One image has no pose.
pub(super) fn arkit_scenes(twin: &Twin) -> Files {
    let mut files = Files::default();
    let mut poses = String::new();
    let Camera { focal, centre, size } = twin.camera;
    let ([fx, fy], [cx, cy], [w, h]) = (focal, centre, size.unwrap());
    let put = |files: &mut Files, k: usize, time: f64| {
        let name = format!("40753679_{time:.3}");
        files.put(format!("lowres_depth/{name}.png"), twin.depth_png(k, 1000.0));
        files.put(format!("lowres_wide/{name}.png"), twin.png(k));
        files.put(format!("confidence/{name}.png"), grey8(twin.size(), &levels(twin.size(), [0, 1, 2])));
    };
    for k in 0..FRAMES {
        let time = 6790.5 + 0.1 * k as f64;
        let inverse = twin.pose(k).inverse();
        let ([x, y, z, w_], t) = quaternion(inverse);
        let turn = glam::DQuat::from_xyzw(x, y, z, w_).to_scaled_axis();
        writeln!(poses, "{time:.6} {} {} {} {} {} {}", turn.x, turn.y, turn.z, t.x, t.y, t.z).unwrap();
        writeln!(poses, "{:.6} 0 0 0 0 0 0", time + 0.05).unwrap();
        put(&mut files, k, time + 0.001);
        files.put(format!("lowres_wide_intrinsics/40753679_{time:.3}.pincam"), format!("{w} {h} {fx} {fy} {cx} {cy}"));
    }
    put(&mut files, 0, 6799.0);
    files.put("lowres_wide.traj", poses);
    files
}

/// Options that RTAB-Map exported with.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Rtabmap {
    /// Poses of the camera with time and number, images by their time.
    Camera,
    /// Poses of the robot, images by their number.
    Robot,
    /// Poses of the camera as matrices, folders of the database viewer.
    Viewer,
}

pub(super) fn rtabmap(twin: &Twin, form: Rtabmap) -> Files {
    let mut files = Files::default();
    let Camera { focal, centre, size } = twin.photo;
    let ([fx, fy], [cx, cy], [w, h]) = (focal, centre, size.unwrap());
    // Ahead of the robot and above it, tilted down.
    let ahead = DMat3::from_cols(DVec3::NEG_Y, DVec3::NEG_Z, DVec3::X) * DMat3::from_rotation_x(0.2);
    let local = DAffine3 { matrix3: ahead, translation: DVec3::new(0.1, 0.02, 0.6) };
    let base = if form == Rtabmap::Viewer { "" } else { "rtabmap_" };
    let mut poses = "#timestamp x y z qx qy qz qw id\n".to_owned();
    for k in 0..FRAMES {
        let (time, id) = (1_725_904_699.25 + k as f64, 2 * k + 3);
        let pose = if form == Rtabmap::Robot { twin.pose(k) * local.inverse() } else { twin.pose(k) };
        let ([x, y, z, qw], t) = quaternion(pose);
        if form == Rtabmap::Viewer {
            let matrix = rows(pose, " ");
            writeln!(poses, "{}", matrix.split(' ').take(12).collect::<Vec<_>>().join(" ")).unwrap();
        } else {
            writeln!(poses, "{time:.6} {} {} {} {x} {y} {z} {qw} {id}", t.x, t.y, t.z).unwrap();
        }
        let name = if form == Rtabmap::Camera { format!("{time:.6}") } else { id.to_string() };
        files.put(format!("{base}depth/{name}.png"), twin.depth_png(k, 1000.0));
        files.put(format!("{base}rgb/{name}.jpg"), twin.jpeg(k));
        let matrix = rows(local, ", ");
        let transform = matrix.split(", ").take(12).collect::<Vec<_>>().join(", ");
        let calibration = format!(
            "%YAML:1.0\n---\ncamera_name: \"{name}\"\nimage_width: {w}\nimage_height: {h}\ncamera_matrix:\n   rows: 3\n   \
             cols: 3\n   data: [ 9., 0., 9., 0., 9., 9., 0., 0., 1. ]\ndistortion_coefficients:\n   rows: 1\n   cols: 5\n   \
             data: [ 0.1, 0., 0., 0., 0. ]\nprojection_matrix:\n   rows: 3\n   cols: 4\n   data: [ {fx}, 0., {cx}, 0., 0., \
             {fy},\n       {cy}, 0., 0., 0., 1., 0. ]\nlocal_transform:\n   rows: 3\n   cols: 4\n   data: [ {transform} ]\n"
        );
        files.put(format!("{base}calib/{name}.yaml"), calibration);
    }
    if form != Rtabmap::Viewer {
        poses += "1725904600.0 1 2 3 0 0 0 1 -1\n";
    }
    files.put(
        match form {
            Rtabmap::Camera => "rtabmap_camera_poses.txt",
            Rtabmap::Robot => "rtabmap_poses.txt",
            Rtabmap::Viewer => "camera_poses.txt",
        },
        poses,
    );
    files
}

/// A NumPy array of floats.
pub(super) fn npy([cols, rows]: [usize; 2], values: &[f32]) -> Vec<u8> {
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, {cols}), }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}
