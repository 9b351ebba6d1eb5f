//! Each format that has matrices, tried with each kind of them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

use super::open;
use super::scan::Content;

/// A place in the scan, no coordinate of which is like another.
const POINT: DVec3 = DVec3::new(1.0, 2.0, 4.0);

/// Identity, rotations alone, translations alone, and both, small translations among them.
fn rigid() -> Vec<DAffine3> {
    let translations = [DVec3::ZERO, DVec3::new(5.0, -6.0, 7.0), DVec3::new(0.0, 0.0, 1e-7), DVec3::new(4e6, 0.0, 0.0)];
    let rotations = [
        DQuat::IDENTITY,
        DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2),
        DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.2, 2.0),
    ];
    let place = |rotation| translations.map(|translation| DAffine3::from_rotation_translation(rotation, translation));
    rotations.into_iter().flat_map(place).collect()
}

/// The same, each mirrored.
fn mirrored() -> Vec<DAffine3> {
    rigid().into_iter().map(|pose| pose * DAffine3::from_scale(DVec3::new(1.0, -1.0, 1.0))).collect()
}

/// A line a row of the matrix, or a line a column of it.
fn lines(pose: &DAffine3, by_rows: bool) -> String {
    let matrix = DMat4::from(*pose);
    let matrix = if by_rows { matrix.transpose() } else { matrix };
    matrix.to_cols_array_2d().iter().fold(String::new(), |mut text, [x, y, z, w]| {
        writeln!(text, "{x} {y} {z} {w}").unwrap();
        text
    })
}

/// A folder with a scan of one point, and one file of text.
struct Files(tempfile::TempDir);

impl Files {
    fn new() -> Files {
        let folder = tempfile::tempdir().unwrap();
        let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
        std::fs::write(folder.path().join("a.ply"), format!("{ply}1 2 4\n")).unwrap();
        Files(folder)
    }

    fn put(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

/// The place of the point in the world, or the reason why it has none.
fn placed(path: &Path) -> Result<DVec3, String> {
    let scan = open(path).map_err(|error| error.to_string())?.scans.remove(0);
    Ok(match scan.read().map_err(|error| error.to_string())? {
        Content::Points(cloud) => cloud.world_from_cloud.transform_point3(cloud.positions[0]),
        Content::RangeImage(image) => image.point_in_world(0),
        Content::Mesh(mesh) => scan.world_from_sensor.transform_point3(mesh.positions[0]),
    })
}

/// Writes a file of one pose and says what is opened.
type Write = fn(&Files, &DAffine3) -> PathBuf;

/// Formats whose matrices go row by row and must be rigid.
const BY_ROWS: [(&str, Write); 6] = [
    ("xf", |files, pose| beside(files, "a.xf", pose)),
    ("tf", |files, pose| beside(files, "a.tf", pose)),
    ("pose.txt", |files, pose| beside(files, "a.pose.txt", pose)),
    ("mlp", |files, pose| {
        let mesh = format!("<MLMesh filename=\"a.ply\"><MLMatrix44>{}</MLMatrix44></MLMesh>", lines(pose, true));
        files.put("s.mlp", format!("<MeshLabProject><MeshGroup>{mesh}</MeshGroup></MeshLabProject>"))
    }),
    ("aln", |files, pose| files.put("s.aln", format!("1\na.ply\n#\n{}0\n", lines(pose, true)))),
    ("log", |files, pose| files.put("s.log", format!("0 0 1\n{}", lines(pose, true)))),
];

fn beside(files: &Files, name: &str, pose: &DAffine3) -> PathBuf {
    files.put(name, lines(pose, true));
    files.0.path().join("a.ply")
}

fn opened(format: &str, path: &Path) -> Result<DVec3, String> {
    if format != "log" {
        return placed(path);
    }
    let set = super::open_many(&[&path.with_file_name("a.ply"), path]).map_err(|error| error.to_string())?;
    Ok(set.scans[0].world_from_sensor.transform_point3(POINT))
}

#[test]
fn row_by_row() {
    for (format, write) in BY_ROWS {
        for pose in rigid() {
            let files = Files::new();
            let found = opened(format, &write(&files, &pose)).unwrap();
            let expected = pose.transform_point3(POINT);
            assert!(found.abs_diff_eq(expected, 1e-9), "{format}: {found} is not {expected} by {pose:?}");
        }
        for pose in mirrored() {
            let files = Files::new();
            let error = opened(format, &write(&files, &pose)).unwrap_err();
            assert!(error.contains("it mirrors, but a scan can only be turned and moved"), "{format}: {error}");
        }
    }
}

#[test]
fn column_by_column_where_only_that_fits() {
    for pose in rigid().into_iter().filter(|pose| pose.translation.length() > 1.0) {
        let files = Files::new();
        files.put("a.xf", lines(&pose, false));
        let found = placed(&files.0.path().join("a.ply")).unwrap();
        assert!(found.abs_diff_eq(pose.transform_point3(POINT), 1e-9), "{found} by {pose:?}");
    }
}

/// A PTX of one point, its axes as given, its matrix written in lines that are columns or rows.
fn ptx(files: &Files, pose: &DAffine3, axes: DMat3, by_rows: bool) -> PathBuf {
    let DVec3 { x, y, z } = pose.translation;
    let mut text = format!("1\n1\n{x} {y} {z}\n");
    for axis in [axes.x_axis, axes.y_axis, axes.z_axis] {
        writeln!(text, "{} {} {}", axis.x, axis.y, axis.z).unwrap();
    }
    files.put("a.ptx", text + &lines(pose, by_rows) + "1 2 4\n")
}

#[test]
fn ptx_multiplies_rows_and_may_mirror() {
    for pose in rigid().into_iter().chain(mirrored()) {
        let expected = pose.transform_point3(POINT);
        let is_turned = pose.matrix3 != DMat3::IDENTITY;
        // Some writers leave the axes as they are.
        for axes in [pose.matrix3, DMat3::IDENTITY] {
            let files = Files::new();
            let found = placed(&ptx(&files, &pose, axes, false)).unwrap();
            assert!(found.abs_diff_eq(expected, 1e-6), "{found} is not {expected} by {pose:?}");
            // The other way round it is told by the place of the translation, or by axes that are the matrix's columns.
            if pose.translation.length() > 1.0 || (axes == pose.matrix3 && is_turned) {
                let found = placed(&ptx(&files, &pose, axes, true)).unwrap();
                assert!(found.abs_diff_eq(expected, 1e-6), "by rows: {found} is not {expected} by {pose:?}");
            }
        }
    }
}

#[test]
fn what_we_write_as_ptx_and_e57_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    for pose in rigid() {
        let viewing = image::range_image::Viewing::From(DVec3::ZERO);
        let mut image = image::RangeImage::from_points(1, 2, vec![[1.0, 2.0, 4.0], [f32::NAN; 3]], viewing).unwrap();
        image.world_from_sensor = pose;
        let progress = base::progress::Progress::none();
        let [ptx, e57] = ["a.ptx", "a.e57"].map(|name| folder.path().join(name));
        crate::export::write_ptx(&ptx, &[&image], &progress).unwrap();
        crate::export::write_e57(&e57, &[&image], None, &progress).unwrap();
        for path in [ptx, e57] {
            let found = placed(&path).unwrap();
            assert!(found.abs_diff_eq(pose.transform_point3(POINT), 1e-8), "{}: {found} by {pose:?}", path.display());
        }
    }
}

#[test]
fn gltf_goes_column_by_column_and_may_mirror() {
    let corners = [POINT, POINT + DVec3::X, POINT + DVec3::Y].map(|p| p.as_vec3().to_array());
    let bytes: Vec<u8> = corners.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    for (pose, is_mirrored) in
        rigid().into_iter().map(|pose| (pose, false)).chain(mirrored().into_iter().map(|pose| (pose, true)))
    {
        let files = Files::new();
        files.put("a.bin", &bytes);
        let matrix = DMat4::from(pose).to_cols_array();
        let path = files.put(
            "a.gltf",
            format!(
                r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0,"matrix":{matrix:?}}}],
                "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
                "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
                "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36,"uri":"a.bin"}}]}}"#
            ),
        );
        assert!(placed(&path).unwrap().abs_diff_eq(pose.transform_point3(POINT), 1e-8), "{pose:?}");
        let Content::Mesh(mesh) = open(&path).unwrap().scans[0].read().unwrap() else { panic!("no mesh") };
        // The outside stays outside.
        assert_eq!(mesh.triangles, [if is_mirrored { [0, 2, 1] } else { [0, 1, 2] }]);
    }
}

/// Frames of `transforms.json` look along -z with y up.
#[test]
fn transforms_go_row_by_row() {
    let mut depth = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut depth, 2, 2);
    encoder.set_color(::png::ColorType::Grayscale);
    encoder.set_depth(::png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(&[3, 0xE8].repeat(4)).unwrap();
    for pose in rigid().into_iter().chain(mirrored()) {
        let files = Files::new();
        files.put("depth.png", &depth);
        let rows = DMat4::from(pose).transpose().to_cols_array_2d();
        let path = files.put(
            "transforms.json",
            format!(
                r#"{{"w":2,"h":2,"fl_x":2,"fl_y":2,"frames":[{{"depth_file_path":"depth.png","transform_matrix":{rows:?}}}]}}"#
            ),
        );
        if pose.matrix3.determinant() < 0.0 {
            let error = open(&path).unwrap_err().to_string();
            assert!(error.contains("it mirrors, but a scan can only be turned and moved"), "{error}");
            continue;
        }
        let scan = open(&path).unwrap().scans.remove(0);
        let ahead = scan.world_from_sensor.transform_vector3(DVec3::Z);
        assert!(ahead.abs_diff_eq(-pose.matrix3.z_axis, 1e-9), "{ahead} by {pose:?}");
        assert!(scan.world_from_sensor.translation.abs_diff_eq(pose.translation, 1e-9));
    }
}
