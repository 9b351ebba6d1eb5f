//! A written file reads back as the same, and writes again as the same bytes.

use super::*;
use crate::export::{PlacedFile, Provenance, write_conf};
use crate::import::{self, Content, FileScan};
use image::range_image::DepthKind;
use mesh::Attribute;

const ENCODINGS: [PlyEncoding; 3] = [PlyEncoding::BinaryLittleEndian, PlyEncoding::BinaryBigEndian, PlyEncoding::Ascii];

/// A mesh whose every number is awkward, with every type of attribute, in an order of its own.
fn mesh(vertices: usize) -> TriMesh {
    let f = |i: usize| (i as f32 * 0.37).sin() * 10.0_f32.powi((i % 9) as i32 - 4);
    let positions = (0..vertices).map(|i| DVec3::new(f(i).into(), f(i + 1).into(), f(i + 2).into())).collect();
    let last = vertices as u32 - 1;
    let mut mesh = TriMesh::new(positions, (2..=last).map(|i| [i - 2, i, i - 1]).collect());
    mesh.vertex_attributes = vec![
        Attribute::f32("confidence", (0..vertices).map(f).collect()),
        Attribute::colour(
            "colour",
            (0..vertices).map(|i| [i as u8, (i / 3) as u8, 255, (255 - i % 7) as u8]).collect(),
        ),
        Attribute::i32("range_row", (0..vertices).map(|i| i as i32 - 5).collect()),
        Attribute::bool("interpolated", (0..vertices).map(|i| i % 3 == 0).collect()),
        Attribute::f32("t", (0..vertices).map(|i| f(i + 3)).collect()),
        Attribute::f32("s", (0..vertices).map(|i| f(i + 4)).collect()),
        Attribute::i32("source_vertex", (0..vertices).map(|i| i as i32 / 2).collect()),
    ];
    mesh.face_attributes = vec![
        Attribute::bool("hole_fill", (2..vertices).map(|i| i % 2 == 0).collect()),
        Attribute::i32("source_scan", (2..vertices).map(|i| i as i32).collect()),
        Attribute::i32("chart", (2..vertices).map(|i| i as i32 % 7 - 1).collect()),
    ];
    mesh
}

fn read_mesh(path: &Path) -> TriMesh {
    let Content::Mesh(mesh) = FileScan::new(path).read().unwrap() else { panic!("no mesh") };
    mesh
}

#[test]
fn meshes_survive_and_write_the_same_bytes_again() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (folder.path().join("first.ply"), folder.path().join("second.ply"));
    for vertices in [3, 100, 60_000] {
        let mut mesh = mesh(vertices);
        let provenance = Some(Provenance::from_json("{\"command\": \"merge\", \"inputs\": [1, 2]}").unwrap());
        for positions in [PositionType::Auto, PositionType::Double] {
            if positions == PositionType::Double {
                mesh.positions.iter_mut().for_each(|p| *p += DVec3::new(1e7, 0.1, -3e-9));
            }
            for encoding in ENCODINGS {
                let options = PlyOptions { encoding, positions, provenance: provenance.clone(), part_triangles: 0 };
                write_ply(&first, &mesh, options.clone(), &Progress::none()).unwrap();
                let start = String::from_utf8_lossy(&std::fs::read(&first).unwrap()[..200]).into_owned();
                assert!(
                    start.contains(
                        "1.0\ncomment surfrecon {\"command\":\"merge\"}\ncomment surfrecon {\"inputs\":[1]}\n"
                    )
                );
                let read = read_mesh(&first);
                assert!(read == mesh, "{encoding:?} {positions:?} {vertices}");
                write_ply(&second, &read, options, &Progress::none()).unwrap();
                assert!(std::fs::read(&first).unwrap() == std::fs::read(&second).unwrap());
            }
        }
    }
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    let mesh = mesh(60_000);
    for encoding in ENCODINGS {
        write_ply(&path, &mesh, encoding, &Progress::none()).unwrap();
        let alone = std::fs::read(&path).unwrap();
        for threads in [1, 2, 8] {
            let pool = base::threads::pool(threads).unwrap();
            pool.install(|| write_ply(&path, &mesh, encoding, &Progress::none())).unwrap();
            assert!(std::fs::read(&path).unwrap() == alone, "{encoding:?} on {threads} threads");
        }
    }
}

#[test]
fn points_survive() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.ply");
    let cloud = PointCloud {
        positions: vec![DVec3::new(0.1_f32.into(), -0.0, 1e30_f32.into()), DVec3::ONE],
        normals: Some(vec![[0.0, 0.6, 0.8], [1.0, 0.0, 0.0]]),
        colour: Some(vec![[1, 2, 3, 4], [5, 6, 7, 8]]),
        ..PointCloud::default()
    };
    for encoding in ENCODINGS {
        write_points_ply(&path, &cloud, encoding, &Progress::none()).unwrap();
        let Content::Points(read) = FileScan::new(&path).read().unwrap() else { panic!() };
        assert_eq!(read, cloud);
        write_points_ply(&path, &PointCloud::default(), encoding, &Progress::none()).unwrap();
        assert!(matches!(FileScan::new(&path).read().unwrap(), Content::Points(read) if read.positions.is_empty()));
    }
    let short = PointCloud { colour: Some(vec![]), ..cloud };
    let error = write_points_ply(&path, &short, PlyEncoding::Ascii, &Progress::none()).unwrap_err().to_string();
    assert_eq!(error, "2 points need 2 colours, got 0");
}

/// A bumpy height map with holes, seen by each kind of sensor.
fn images() -> Vec<RangeImage> {
    let (rows, cols) = (7, 5);
    let depth = |i: usize| if i % 6 == 4 { f64::NAN } else { 2.0 + 0.1 * (i as f64).sin() };
    let values: Vec<f64> = (0..rows * cols).map(depth).collect();
    let pinhole = Projection::Pinhole { focal: [10.0, 11.0], centre: [2.0, 3.0], depth: DepthKind::Planar };
    let spherical = Projection::Spherical { first: [0.4, 0.3], step: [-0.1, -0.1] };
    let orthographic = Projection::Orthographic { first: [-1.0, 1.0], step: [0.5, -0.25] };
    let mut images: Vec<RangeImage> = [pinhole, spherical, orthographic]
        .map(|projection| RangeImage::from_values(rows, cols, values.clone(), projection).unwrap())
        .into();
    let points = |image: &RangeImage| {
        (0..image.len()).map(|i| image.point_in_sensor(i).as_vec3().to_array()).collect::<Vec<[f32; 3]>>()
    };
    let viewings = [
        (2, Viewing::ALONG_MINUS_Z),
        (0, Viewing::From(DVec3::ZERO)),
        (0, Viewing::Parallel(DVec3::new(0.0, 0.1, 2.0))),
    ];
    for (from, viewing) in viewings {
        images.push(RangeImage::from_points(rows, cols, points(&images[from]), viewing).unwrap());
    }
    for (i, image) in images.iter_mut().enumerate() {
        image.name = format!("scan{i}");
        image.world_from_sensor = DAffine3::from_rotation_translation(
            DQuat::from_axis_angle(DVec3::new(1.0, 1.0, i as f64).normalize(), i as f64),
            DVec3::new(0.1, 0.2, 0.3) * i as f64,
        );
        image.colour = (i % 2 == 0).then(|| (0..rows * cols).map(|k| [k as u8, 2, 3, 255]).collect());
        image.confidence = (i % 3 == 0).then(|| (0..rows * cols).map(|k| k as f32 / 40.0).collect());
        image.intensity = (i % 3 == 1).then(|| (0..rows * cols).map(|k| k as f32 * -0.1).collect());
    }
    images
}

/// Theorem: written and placed as told, every pixel keeps its point in the world, whatever the sensor, and the rays of the
/// file (along -z) run away from the sensor.
#[test]
fn range_grids_survive_for_every_sensor() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (folder.path().join("first.ply"), folder.path().join("second.ply"));
    for image in images() {
        for encoding in ENCODINGS {
            write_range_grid_ply(&first, &image, encoding, &Progress::none()).unwrap();
            let mut scan = FileScan::new(&first);
            let sensor_from_grid = range_grid_frame(&image).unwrap();
            scan.world_from_sensor = image.world_from_sensor * sensor_from_grid;
            let Content::RangeImage(read) = scan.read().unwrap() else { panic!("no range image") };
            assert_eq!((read.rows(), read.cols()), (image.rows(), image.cols()));
            for i in 0..image.len() {
                assert_eq!(read.is_valid(i), image.is_valid(i), "{} pixel {i}", image.name);
                if !image.is_valid(i) {
                    continue;
                }
                let distance = read.point_in_world(i).distance(image.point_in_world(i));
                assert!(distance < 1e-6, "{} pixel {i}: {distance}", image.name);
                assert_eq!(read.colour.as_ref().map(|c| c[i]), image.colour.as_ref().map(|c| c[i]));
                assert_eq!(read.confidence.as_ref().map(|c| c[i]), image.confidence.as_ref().map(|c| c[i]));
                assert_eq!(read.intensity.as_ref().map(|c| c[i]), image.intensity.as_ref().map(|c| c[i]));
                let seen = sensor_from_grid
                    .inverse()
                    .transform_vector3(image.projection().view_direction(image.point_in_sensor(i)));
                assert!(seen.z < -0.5, "{} pixel {i} is seen along {seen}", image.name);
            }
            write_range_grid_ply(&second, &read, encoding, &Progress::none()).unwrap();
            assert_eq!(std::fs::read(&first).unwrap(), std::fs::read(&second).unwrap());
        }
    }
}

#[test]
fn the_layout_is_that_of_the_stanford_archive() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grid.ply");
    let nan = f32::NAN;
    let points = vec![[0.5, -0.25, 1e-7], [nan; 3], [nan; 3], [3.0, 4.0, 1e20]];
    let image = RangeImage::from_points(2, 2, points, Viewing::ALONG_MINUS_Z).unwrap();
    write_range_grid_ply(&path, &image, PlyEncoding::Ascii, &Progress::none()).unwrap();
    let expected = "ply\nformat ascii 1.0\nobj_info is_mesh 0\nobj_info num_cols 2\nobj_info num_rows 2\n\
        element vertex 2\nproperty float x\nproperty float y\nproperty float z\nelement range_grid 4\n\
        property list uchar int vertex_indices\nend_header\n0.5 -0.25 1e-7 \n3 4 1e20 \n1 0 \n0 \n0 \n1 1 \n";
    assert_eq!(std::fs::read_to_string(&path).unwrap(), expected);
}

#[test]
fn a_set_of_scans_opens_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let images = images();
    let placed: Vec<PlacedFile> = images
        .iter()
        .map(|image| {
            let file = format!("{}.ply", image.name);
            write_range_grid_ply(&folder.path().join(&file), image, PlyEncoding::default(), &Progress::none()).unwrap();
            PlacedFile { file, world_from_file: image.world_from_sensor * range_grid_frame(image).unwrap() }
        })
        .collect();
    let conf = folder.path().join("scans.conf");
    write_conf(&conf, &placed).unwrap();
    let set = import::open(&conf).unwrap();
    // The list says what its quaternions mean, also of one scan, which no overlap could tell.
    assert_eq!(set.notes, [""; 0]);
    for ((scan, image), placed) in set.scans.iter().zip(&images).zip(&placed) {
        assert_eq!(scan.name, image.name);
        assert!(scan.world_from_sensor.abs_diff_eq(placed.world_from_file, 1e-12));
    }
}

#[test]
fn what_can_not_be_written_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.ply");
    let refused = |mesh: &TriMesh, options: PlyOptions| {
        write_ply(&path, mesh, options, &Progress::none()).unwrap_err().to_string()
    };
    let with = |change: &dyn Fn(&mut TriMesh)| {
        let mut mesh = mesh(4);
        change(&mut mesh);
        refused(&mesh, PlyOptions::default())
    };
    assert!(with(&|m| m.positions[1].x = f64::NAN).contains("vertex 1 has a coordinate that is not finite"));
    assert!(with(&|m| m.triangles[0][0] = 9).contains("triangle 0 names vertex 9"));
    assert!(with(&|m| m.vertex_attributes[0].name = "two words".into()).contains("needs a name without blanks"));
    assert!(with(&|m| m.vertex_attributes[0].name = "a\nproperty".into()).contains("needs a name without blanks"));
    assert!(with(&|m| m.vertex_attributes[0].name = "x".into()).contains("attribute x: the name is taken"));
    assert!(with(&|m| m.vertex_attributes[0].name = "alpha".into()).contains("attribute colour: the name is taken"));
    let mut far = mesh(4);
    far.positions[0].x = 1e39;
    let float = PlyOptions { positions: PositionType::Float, ..PlyOptions::default() };
    assert!(refused(&far, float).contains("1e39 is too large for single precision"));
    write_ply(&path, &far, PlyEncoding::Ascii, &Progress::none()).unwrap();
    assert_eq!(read_mesh(&path).positions[0].x, 1e39);

    let around = Projection::Spherical { first: [0.0, 0.0], step: [1.0, 0.1] };
    let panorama = RangeImage::from_values(1, 6, vec![1.0; 6], around).unwrap();
    let error = write_range_grid_ply(&path, &panorama, PlyEncoding::Ascii, &Progress::none()).unwrap_err().to_string();
    assert!(error.contains("more than half a sphere"), "{error}");
    let scaled = PlacedFile { file: "a.ply".into(), world_from_file: DAffine3::from_scale(DVec3::splat(2.0)) };
    assert!(write_conf(&path, &[scaled]).unwrap_err().to_string().contains("is not a rotation and a translation"));
    let named = PlacedFile { file: "a\nb".into(), world_from_file: DAffine3::IDENTITY };
    assert!(write_conf(&path, &[named]).unwrap_err().to_string().contains("can't hold a name"));
}

/// Theorem: cancelled at any check, no file is left and an older one is whole.
#[test]
fn cancelled_at_every_check() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    let mesh = mesh(60_000);
    let mut checks = 0;
    loop {
        let progress = Progress::cancel_after(checks);
        match write_ply(&path, &mesh, PlyEncoding::default(), &progress) {
            Err(Error::Cancelled) => assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0),
            Ok(()) => break,
            Err(other) => panic!("{other}"),
        }
        checks += 1;
    }
    assert!(checks > 5, "{checks}");
    let before = std::fs::read(&path).unwrap();
    let progress = Progress::cancel_after(3);
    assert!(write_ply(&path, &mesh, PlyEncoding::default(), &progress).is_err());
    assert!(std::fs::read(&path).unwrap() == before);
}

#[test]
fn quads_stay_quads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("quads.ply");
    let mut mesh = QuadMesh {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.5), DVec3::Y, DVec3::new(2.0, 0.0, 0.25)],
        uvs: vec![[0.0, 0.0], [0.5, 0.0], [0.5, 1.0], [0.0, 1.0], [1.0, 0.0]],
        quads: vec![[0, 1, 2, 3], [1, 4, 2, 2]],
        face_attributes: vec![Attribute::i32("tile", vec![7, 8])],
        ..QuadMesh::default()
    };
    write_quads_ply(&path, &mesh, PlyEncoding::Ascii, &Progress::none()).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(
        text.ends_with(
            "end_header\n0 0 0 0 0\n1 0 0 0.5 0\n1 1 0.5 0.5 1\n0 1 0 0 1\n2 0 0.25 1 0\n4 0 1 2 3 7\n4 1 4 2 2 8\n"
        ),
        "{text}"
    );
    for encoding in [PlyEncoding::BinaryLittleEndian, PlyEncoding::BinaryBigEndian] {
        write_quads_ply(&path, &mesh, encoding, &Progress::none()).unwrap();
        let read = read_mesh(&path);
        assert_eq!((read.positions.len(), read.triangles.len()), (5, 4));
        assert_eq!(read.positions, mesh.positions);
    }
    mesh.quads[1][0] = 5;
    let error = write_quads_ply(&path, &mesh, PlyEncoding::Ascii, &Progress::none()).unwrap_err().to_string();
    assert_eq!(error, "quad 1 names vertex 5, but there are only 5 vertices");
}
