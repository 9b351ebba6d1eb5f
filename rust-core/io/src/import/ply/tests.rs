//! Small files of every kind, right and wrong. Temporary files: the reader is tested as it is used.

use super::*;
use mesh::AttributeData;
use std::io::Write;

/// A grid of 3 rows and 4 columns with one colour and one confidence a vertex.
const GRID: &str = "ply\nformat ascii 1.0\nobj_info num_cols 4\nobj_info num_rows 3\nelement vertex 5\n\
    property float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n\
    property uchar blue\nproperty float confidence\nelement range_grid 12\n\
    property list uchar int vertex_indices\nend_header\n\
    0 0 0.25 1 2 3 1\n1 0 0.5 4 5 6 0.5\n2 0 -0.75 7 8 9 0.25\n0 1 1e-3 10 11 12 nan\n3 2 1 255 0 0 -1\n\
    1 0 \n1 1 \n1 2 \n0 \n1 3 \n0 \n0 \n0 \n0 \n0 \n0 \n1 4 \n";

const MESH: &str = "ply\nformat ascii 1.0\ncomment a square, a triangle\nelement vertex 5\nproperty float x\n\
    property float y\nproperty float z\nproperty float quality\nelement face 2\n\
    property list uchar int vertex_indices\nproperty uchar hole_fill\nend_header\n\
    0 0 0 1\n1 0 0 2\n1 1 0 3\n0 1 0 4\n2 2 2 5\n4 0 1 2 3 1\n3 1 4 2 0\n";

fn parse_bytes(bytes: &[u8]) -> Parsed<Content> {
    parse(&mut &bytes[..], bytes.len() as u64, &FileScan::new(Path::new("test.ply")), &Progress::none())
        .map_err(|problem| problem.locate(&mut &bytes[..]))
}

fn image(bytes: &[u8]) -> RangeImage {
    match parse_bytes(bytes).unwrap() {
        Content::RangeImage(image) => image,
        other => panic!("{other:?}"),
    }
}

fn mesh_of(bytes: &[u8]) -> TriMesh {
    match parse_bytes(bytes).unwrap() {
        Content::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

fn cloud(bytes: &[u8]) -> PointCloud {
    match parse_bytes(bytes).unwrap() {
        Content::Points(points) => points,
        other => panic!("{other:?}"),
    }
}

fn refused(text: &str) -> String {
    parse_bytes(text.as_bytes()).unwrap_err().to_string()
}

/// The same file in a binary encoding, made from its text by the header alone.
fn to_binary(text: &str, big: bool) -> Vec<u8> {
    let header = Header::parse(text.as_bytes()).unwrap().unwrap();
    let name = if big { "binary_big_endian" } else { "binary_little_endian" };
    let mut bytes = text[..header.body].replace("ascii", name).into_bytes();
    let mut words = text[header.body..].split_ascii_whitespace();
    let mut put = |scalar: header::ScalarType, word: &str| {
        use header::ScalarType as T;
        let mut little = match scalar {
            T::I8 => word.parse::<i8>().unwrap().to_le_bytes().to_vec(),
            T::U8 => word.parse::<u8>().unwrap().to_le_bytes().to_vec(),
            T::I16 => word.parse::<i16>().unwrap().to_le_bytes().to_vec(),
            T::U16 => word.parse::<u16>().unwrap().to_le_bytes().to_vec(),
            T::I32 => word.parse::<i32>().unwrap().to_le_bytes().to_vec(),
            T::U32 => word.parse::<u32>().unwrap().to_le_bytes().to_vec(),
            T::F32 => word.parse::<f32>().unwrap().to_le_bytes().to_vec(),
            T::F64 => word.parse::<f64>().unwrap().to_le_bytes().to_vec(),
        };
        if big {
            little.reverse();
        }
        bytes.extend(little);
    };
    for element in &header.elements {
        for _ in 0..element.count {
            for property in &element.properties {
                match property.kind {
                    header::Kind::Scalar(scalar) => put(scalar, words.next().unwrap()),
                    header::Kind::List { length, item } => {
                        let count = words.next().unwrap();
                        put(length, count);
                        for _ in 0..count.parse::<usize>().unwrap() {
                            put(item, words.next().unwrap());
                        }
                    }
                }
            }
        }
    }
    bytes
}

#[test]
fn a_grid_keeps_rows_columns_and_attributes() {
    let image = image(GRID.as_bytes());
    assert_eq!((image.rows(), image.cols(), image.name.as_str()), (3, 4, "test"));
    assert_eq!(image.valid_count(), 5);
    assert_eq!(image.point_in_sensor(2), DVec3::new(2.0, 0.0, -0.75));
    assert_eq!(image.point_in_sensor(4), DVec3::new(0.0, 1.0, f64::from(1e-3_f32)));
    assert_eq!(image.point_in_sensor(11), DVec3::new(3.0, 2.0, 1.0));
    assert!(!image.is_valid(3) && !image.is_valid(10));
    assert_eq!(image.colour.as_ref().unwrap()[2], [7, 8, 9, 255]);
    // A value that is no confidence is no trust.
    let confidence = image.confidence.as_ref().unwrap();
    assert_eq!([confidence[1], confidence[4], confidence[11]], [0.5, 0.0, 0.0]);
    assert_eq!(image.projection(), &image::range_image::Projection::PointGrid(Viewing::ALONG_MINUS_Z));
    image.validate().unwrap();
}

#[test]
fn a_mesh_keeps_attributes_and_fans_polygons() {
    let mesh = mesh_of(MESH.as_bytes());
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [1, 4, 2]]);
    assert_eq!(mesh.vertex_attribute("quality"), Some(&AttributeData::F32(vec![1.0, 2.0, 3.0, 4.0, 5.0])));
    assert_eq!(mesh.face_attribute("hole_fill"), Some(&AttributeData::Bool(vec![true, true, false])));
    mesh.validate().unwrap();
}

#[test]
fn all_encodings_and_line_ends_agree() {
    for text in [GRID, MESH] {
        let expected = format!("{:?}", parse_bytes(text.as_bytes()).unwrap());
        let crlf = text.replace('\n', "\r\n");
        let cr = text.replace('\n', "\r");
        let spaced = text.replace("0 0", "0 \t 0").replace("\n1", "\n\n  1");
        let unended = text.trim_end().to_owned();
        for other in [crlf, cr, spaced, unended] {
            assert_eq!(format!("{:?}", parse_bytes(other.as_bytes()).unwrap()), expected, "{other:?}");
        }
        if text == GRID {
            continue;
        }
        for big in [false, true] {
            assert_eq!(format!("{:?}", parse_bytes(&to_binary(text, big)).unwrap()), expected);
        }
    }
    let finite = GRID.replace("nan", "0");
    let expected = format!("{:?}", image(finite.as_bytes()));
    for big in [false, true] {
        assert_eq!(format!("{:?}", image(&to_binary(&finite, big))), expected);
    }
}

#[test]
fn every_scalar_type_and_unknown_parts() {
    let text = "ply\nformat ascii 1.0\nelement camera 1\nproperty double k\nproperty list uint8 float32 view\n\
        element vertex 2\nproperty list ushort short flags\nproperty char x\nproperty int16 y\nproperty uint32 z\n\
        property ushort red\nproperty ushort green\nproperty ushort blue\nproperty float alpha\nproperty double s\n\
        element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n\
        0.5 2 1 2\n2 1 2 -128 -32768 4294967295 65535 0 257 0.5 7\n0 127 32767 0 0 0 0 1 8\n0 1\n";
    for bytes in [text.as_bytes().to_vec(), to_binary(text, false), to_binary(text, true)] {
        let points = cloud(&bytes);
        assert_eq!(points.positions[0], DVec3::new(-128.0, -32768.0, 4_294_967_295.0));
        assert_eq!(points.positions[1], DVec3::new(127.0, 32767.0, 0.0));
        assert_eq!(points.colour.as_ref().unwrap()[..], [[255, 0, 1, 128], [0, 0, 0, 255]]);
    }
}

#[test]
fn strips_turn_every_second_triangle() {
    let text = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n9 0 1 2 3 3 4 -1 2 4\n";
    assert_eq!(mesh_of(text.as_bytes()).triangles, [[0, 1, 2], [2, 1, 3]]);
}

#[test]
fn vertices_may_come_last() {
    let text = "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\nelement vertex 3\n\
        property double x\nproperty double y\nproperty double z\nend_header\n3 2 1 0\n1 2 3\n4 5 6\n7 8 0.1\n";
    let mesh = mesh_of(text.as_bytes());
    assert_eq!((mesh.triangles[0], mesh.positions[2].z), ([2, 1, 0], 0.1));
    let dangling = text.replace("3 2 1 0", "3 2 1 3");
    assert!(refused(&dangling).starts_with("line 10: face 0 of 1"), "{}", refused(&dangling));
}

#[test]
fn coordinates_far_out_keep_their_precision() {
    let text = "ply\nformat ascii 1.0\nobj_info num_cols 2\nobj_info num_rows 1\nelement vertex 2\nproperty double x\n\
        property double y\nproperty double z\nelement range_grid 2\nproperty list uchar int vertex_indices\nend_header\n\
        4512345.123 512345.5 100.25\n4512346.123 512345.5 101.25\n1 0\n1 1\n";
    let mut scan = FileScan::new(Path::new("far.ply"));
    scan.world_from_sensor = DAffine3::from_rotation_z(1.0);
    let Content::RangeImage(image) = parse(&mut text.as_bytes(), text.len() as u64, &scan, &Progress::none()).unwrap()
    else {
        panic!()
    };
    let expected = scan.world_from_sensor.transform_point3(DVec3::new(4_512_345.123, 512_345.5, 100.25));
    assert!(image.point_in_world(0).distance(expected) < 1e-6);
    assert!((image.point_in_world(1).distance(image.point_in_world(0)) - 2.0_f64.sqrt()).abs() < 1e-6);
}

#[test]
fn what_is_not_finite() {
    let grid = GRID.replace("1 0 0.5 4", "inf 0 0.5 4");
    assert_eq!(image(grid.as_bytes()).valid_count(), 4);
    let mesh = MESH.replace("1 1 0 3", "1 -nan 0 3");
    assert_eq!(refused(&mesh), "vertex 2 of 5 (counted from 0): a coordinate of a mesh is not finite");
    let points = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\nelement face 0\n\
        property list uchar int vertex_indices\nend_header\n0 0 0 1 0 0\n0 nan 0 0 1 0\n2 0 0 0 0 1\n";
    let points = cloud(points.as_bytes());
    assert_eq!(points.positions, [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0)]);
    assert_eq!(points.normals.unwrap(), [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
}

#[test]
fn several_cells_may_name_one_vertex() {
    assert_eq!(image(GRID.replace("\n0 \n1 3", "\n1 3 \n1 3").as_bytes()).valid_count(), 6);
}

#[test]
fn what_is_wrong_is_named_with_its_place() {
    let vertices = "element vertex 5";
    let case = |text: &str, expected: &str| {
        let found = refused(text);
        assert!(found.contains(expected), "found: {found}\nexpected: {expected}");
    };
    case(
        &GRID.replace(vertices, "element vertex 1000000000000"),
        "element vertex: the header claims 1000000000000, but",
    );
    case(&GRID.replace(vertices, "element vertex 18446744073709551615"), "element vertex: the header claims");
    case(
        &GRID.replace(vertices, "element vertex 4"),
        "line 20: range_grid 0 of 12 (counted from 0): row 0, column 0: a cell holds at most one vertex, this one 3",
    );
    case(
        &GRID.replace(vertices, "element vertex 6"),
        "line 21: vertex 5 of 6 (counted from 0), property z: the line ends",
    );
    case(
        &GRID.replace("1 0 0.5 4", "1 0 0,5 4"),
        "line 17: vertex 1 of 5 (counted from 0), property z: expected a number, found `0,5`",
    );
    case(
        &GRID.replace("7 8 9", "7 8 300"),
        "line 18: vertex 2 of 5 (counted from 0), property blue: 300 is out of range (the type is uchar)",
    );
    case(
        &GRID.replace("7 8 9", "7 8 9.5"),
        "line 18: vertex 2 of 5 (counted from 0), property blue: expected a whole number, found `9.5`",
    );
    case(&GRID.replace("1 4 \n", "1 5 \n"), "row 2, column 3: vertex 5 does not exist: there are 5");
    case(&GRID.replace("1 4 \n", "1 -1 \n"), "row 2, column 3: vertex -1 does not exist");
    case(&GRID.replace("1 4 \n", "2 3 4 \n"), "row 2, column 3: a cell holds at most one vertex, this one 2");
    case(&GRID.replace("1 4 \n", "1 4 \n0 \n"), "after the last element: 3 bytes follow");
    case(
        &GRID.replace("num_rows 3", "num_rows 4"),
        "num_rows 4 x num_cols 4 is not the number of cells of range_grid, 12",
    );
    case(&GRID.replace("num_rows 3", "num_rows 9223372036854775808"), "is not the number of cells");
    case(&GRID.replace("obj_info num_rows 3\n", ""), "a range grid needs the lines");
    case(&GRID.replace("property float z", "property float w"), "needs the properties x, y and z");
    case(&GRID.replace("property float z", "property float x"), "property `x` is there twice");
    case(&GRID.replace("int vertex_indices", "float vertex_indices"), "no list of whole numbers");
    case(&GRID.replace("element vertex", "element point"), "there is no element `vertex`");
    case(
        &MESH.replace("4 0 1 2 3 1", "2 0 1 1"),
        "line 18: face 0 of 2 (counted from 0): a face needs 3 vertices, this one has 2",
    );
    case(&MESH.replace("3 1 4 2 0", "3 1 4 5 0"), "face 1 of 2 (counted from 0): vertex 5 does not exist");
    case(&MESH.replace("element face 2", "element face 3"), "element face");
    let binary = to_binary(MESH, false);
    let found = parse_bytes(&binary[..binary.len() - 1]).unwrap_err().to_string();
    assert_eq!(found, "face 1 of 2 (counted from 0), property hole_fill: the file ends");
}

/// Theorem: cut anywhere, a file gives an error that names a place, or what was cut off was only white space.
#[test]
fn cut_at_every_byte() {
    let finite = GRID.replace("nan", "0");
    let files: Vec<Vec<u8>> = [GRID, MESH]
        .iter()
        .map(|text| text.as_bytes().to_vec())
        .chain([&finite, MESH].iter().flat_map(|text| [to_binary(text, false), to_binary(text, true)]))
        .collect();
    for file in files {
        for length in 0..file.len() {
            examine(&file[..length]);
            if let Err(problem) = parse_bytes(&file[..length]) {
                assert!(!problem.at.is_empty() && !problem.text.is_empty());
            } else {
                let rest = &file[length..];
                assert!(rest.iter().all(|b| b.is_ascii_whitespace()), "{length} of {} bytes", file.len());
            }
        }
    }
}

/// Theorem: no change of one byte makes the reader panic.
#[test]
fn one_byte_changed() {
    for file in [GRID.as_bytes().to_vec(), MESH.as_bytes().to_vec(), to_binary(MESH, false)] {
        for at in 0..file.len() {
            for byte in [0, b'\n', b' ', b'-', b'0', b'9', b'e', b'.', 0x7F, 0x80, 0xFF] {
                let mut changed = file.clone();
                changed[at] = byte;
                examine(&changed);
            }
        }
    }
}

#[test]
fn previews_are_points_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let many: String = (0..5000).map(|i| format!("{}.5 {} {}.25\n", i, i * i % 97, i % 13)).collect();
    let header = "ply\nformat ascii 1.0\nelement vertex 5000\nproperty float x\nproperty float y\nproperty float z\n";
    let text = format!("{header}end_header\n{many}");
    let with_faces = format!(
        "{header}element face 4000\nproperty list uchar int vertex_indices\nend_header\n{many}{}",
        (0..4000).map(|i| format!("3 {} {} {}\n", i, i + 1, i + 2)).collect::<String>()
    );
    let faces_first = format!(
        "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\n{}end_header\n3 0 1 2\n{many}",
        header.strip_prefix("ply\nformat ascii 1.0\n").unwrap()
    );
    let files = [
        to_binary(&text, false),
        to_binary(&with_faces, true),
        to_binary(&faces_first, true),
        text.into_bytes(),
        with_faces.into_bytes(),
        faces_first.into_bytes(),
    ];
    for (i, bytes) in files.iter().enumerate() {
        let path = folder.path().join(format!("{i}.ply"));
        std::fs::File::create(&path).unwrap().write_all(bytes).unwrap();
        for wanted in [0, 1, 10, 500, 10_000] {
            let points = FileScan::new(&path).preview_points(wanted).unwrap();
            assert!(points.len() <= wanted + wanted / 4 + 1, "{} for {wanted}", points.len());
            assert!(points.len() * 2 >= wanted.min(5000), "{} for {wanted} of file {i}", points.len());
            for p in &points {
                let n = p.x - 0.5;
                assert_eq!((p.y, p.z), ((n * n) % 97.0, n % 13.0 + 0.25), "{p}");
            }
            if wanted >= 500 {
                // Spread over the whole file.
                for tenth in 0..10 {
                    let range = f64::from(tenth) * 500.0..f64::from(tenth + 1) * 500.0;
                    assert!(points.iter().any(|p| range.contains(&p.x)), "file {i}, {wanted}: none in {range:?}");
                }
            }
        }
    }
}

/// Theorem: where the window's borders fall changes nothing.
#[test]
fn any_window_gives_the_same() {
    let rows: String = (0..700).map(|i| format!("{i}.25 -{i}e-{} 0.{i} {}\n", i % 30, i % 256)).collect();
    let header = "element vertex 700\nproperty float x\nproperty double y\nproperty float z\nproperty uchar red\n\
        element face 300\nproperty list uchar int vertex_indices\nend_header\n";
    let faces: String =
        (0..300).map(|i| format!("{} {i} {} {}{}\n", 3 + i % 2, i + 1, i + 2, ["", " 9"][i % 2])).collect();
    let mesh = format!("ply\nformat ascii 1.0\n{header}{rows}{faces}");
    let bare: String = (0..600).map(|i| format!("{}.{i} -0.{i:07} 1.5 \n", i % 10)).collect();
    let cells: String =
        (0..4000).map(|i| if i % 7 < 6 { "0 \n".to_owned() } else { format!("1 {} \n", i / 7) }).collect();
    let grid = format!(
        "ply\nformat ascii 1.0\nobj_info num_cols 40\nobj_info num_rows 100\nelement vertex 600\nproperty float x\n\
        property float y\nproperty float z\nelement range_grid 4000\nproperty list uchar int vertex_indices\n\
        end_header\n{bare}{cells}"
    );
    for text in [mesh, grid] {
        for bytes in [text.clone().into_bytes(), to_binary(&text, false), to_binary(&text, true)] {
            assert!(parse_bytes(&bytes).is_ok());
            // Each shift moves all borders.
            for shift in 0..40 {
                let comment = [b"\ncomment ".to_vec(), vec![b'x'; shift], b"\nelement vertex".to_vec()].concat();
                let at = bytes.windows(15).position(|w| w == b"\nelement vertex").unwrap();
                examine(&[&bytes[..at], &comment, &bytes[at + 15..]].concat());
            }
        }
    }
}

#[test]
fn endless_numbers_are_no_numbers() {
    let with = |digits: usize| MESH.replace("0 0 0 1\n", &format!("0 0 0.{} 1\n", "3".repeat(digits)));
    for digits in [400, 509, 510, 511, 512, 600, 1022, 1023, 1_000_000] {
        examine(with(digits).as_bytes());
        assert_eq!(parse_bytes(with(digits).as_bytes()).is_ok(), digits <= 510, "{digits} digits");
    }
    let found = refused(&with(1_000_000));
    assert!(
        found.starts_with("line 13: vertex 0 of 5 (counted from 0), property z: expected a number, found `0.333"),
        "{found}"
    );
}
