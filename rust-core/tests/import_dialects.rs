//! Files as other programs write them: marks at the start, line ends, decimal commas, layouts. A valid file reads as it is meant. One that
//! can't be read says why and what to do.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue};
use glam::{DAffine3, DVec3};
use surfrecon::export;
use surfrecon::import::{self, Content, ReadOptions, open_with};
use surfrecon::{PointCloud, Progress, TriMesh};

/// Contents of some files, in words. The first one is opened with the others beside it if they are a set.
fn read_all(paths: &[&Path]) -> surfrecon::Result<String> {
    let set = open_with(paths, &ReadOptions::default(), &Progress::none())?;
    let mut text = format!("{:?}", set.notes);
    for scan in &set.scans {
        text += &format!("{:?} {:?}", scan.world_from_sensor, scan.read()?);
        assert!(!scan.preview_points(5)?.is_empty(), "{}", scan.name);
    }
    Ok(text)
}

/// The content of a file of so many bytes.
fn read(name: &str, bytes: &[u8]) -> surfrecon::Result<Content> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    import::open(&path)?.scans[0].read()
}

fn refused(name: &str, bytes: &[u8]) -> String {
    match read(name, bytes) {
        Err(error) => error.to_string(),
        Ok(content) => panic!("{name} is read: {content:?}"),
    }
}

fn mesh(content: surfrecon::Result<Content>) -> TriMesh {
    match content.unwrap() {
        Content::Mesh(mesh) => mesh,
        other => panic!("no mesh: {other:?}"),
    }
}

fn cloud(content: surfrecon::Result<Content>) -> PointCloud {
    match content.unwrap() {
        Content::Points(cloud) => cloud,
        other => panic!("no points: {other:?}"),
    }
}

const IDENTITY: &str = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";

/// Texts of every format, each alone, and lists and side files with what they need: the last of a set is the text.
fn texts() -> Vec<(String, Vec<u8>)> {
    let mut texts = Vec::new();
    for kind in ["import_scan", "import_ply", "import_points", "import_side", "import_conf"] {
        let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(kind);
        for seed in std::fs::read_dir(seeds).unwrap() {
            let seed = seed.unwrap().path();
            let bytes = std::fs::read(&seed).unwrap();
            let is_text = std::str::from_utf8(&bytes).is_ok() && !bytes.contains(&0);
            if is_text {
                texts.push((seed.file_name().unwrap().to_string_lossy().into_owned(), bytes));
            }
        }
    }
    let many = |line: &dyn Fn(usize) -> String| (0..20_000).map(line).collect::<String>().into_bytes();
    // Longer than any window or head of a file.
    texts.push(("long.obj".to_owned(), many(&|i| format!("v {i} 0.5 {}\n", i * i))));
    texts.push(("long.xyz".to_owned(), many(&|i| format!("{i} 0.5 {}\n", i * i))));
    texts.push(("long.csv".to_owned(), many(&|i| format!("{i},0.5,{},7\n", i * i))));
    texts
}

/// Opens a text as what it is: a side file with a depth image, a list with its scans, a pose beside its scan.
fn open_text(folder: &Path, name: &str, bytes: &[u8]) -> surfrecon::Result<String> {
    let put = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds");
    let ply = std::fs::read(seeds.join("import_ply/grid_little.ply")).unwrap();
    for scan in ["a.ply", "b.ply", "deep/c.ply"] {
        put(scan, &ply);
    }
    let image = put("image.pgm", &std::fs::read(seeds.join("import_scan/map.pgm")).unwrap());
    let path = put(name, bytes);
    let outcome = match path.extension().and_then(|e| e.to_str()).unwrap() {
        "json" => read_all(&[&image, &path]),
        _ if name == "matrix.txt" => read_all(&[&image, &path]),
        "log" => read_all(&[&image, &image, &path]),
        "freiburg" => read_all(&[&image, &path]),
        "xf" => read_all(&[&put("pose.ply", &ply)]),
        _ => read_all(&[&path]),
    };
    std::fs::remove_file(path).unwrap();
    outcome
}

/// Theorem: a byte order mark and the kind of line ends say nothing about what a text holds.
#[test]
fn marks_and_line_ends_change_nothing() {
    let (mut wrong, mut read) = (Vec::new(), 0);
    for (name, bytes) in texts() {
        let folder = tempfile::tempdir().unwrap();
        let text = String::from_utf8(bytes).unwrap().replace("\r\n", "\n").replace('\r', "\n");
        let open = |text: &str| open_text(folder.path(), &name, text.as_bytes()).map_err(|error| error.to_string());
        let expected = open(&text);
        // A seed may be a file that is refused: with the same words then.
        read += usize::from(expected.is_ok());
        for ends in ["\n", "\r\n", "\r"] {
            for mark in ["", "\u{feff}"] {
                let variant = format!("{mark}{}", text.replace('\n', ends));
                match open(&variant) {
                    found if found == expected => {}
                    Ok(_) => wrong.push(format!("{name} with {mark:?} and {ends:?} is misread")),
                    Err(error) => wrong.push(format!("{name} with {mark:?} and {ends:?}: {error}")),
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
    assert!(read > 25, "{read} texts are read");
}

/// Line ends of several kinds in one file are all line ends.
#[test]
fn mixed_line_ends() {
    let read = mesh(read("mixed.obj", b"v 0 0 0\rv 1 0 0\nv 1 1 0\r\nf 1 2 3\r"));
    assert_eq!((read.positions.len(), read.triangles), (3, vec![[0, 1, 2]]));
    assert_eq!(cloud(self::read("mixed.xyz", b"1 2 3\r4 5 6\n\r7 8 9\r\n")).positions.len(), 3);
}

/// Only text has marks: numbers that look like one are numbers.
#[test]
fn binary_files_have_no_marks() {
    for first in [[0xEF, 0xBB, 0xBF, 0x01], [0xFF, 0xFE, 0x00, 0x41], [0xFE, 0xFF, 0x00, 0x41]] {
        let mut tile = first.to_vec();
        tile.extend((2..16_i16).flat_map(i16::to_be_bytes));
        let Content::RangeImage(image) = read("tile.hgt", &tile).unwrap() else { panic!("no grid") };
        let heights = [0, 1].map(|i| f64::from(i16::from_be_bytes([first[2 * i], first[2 * i + 1]])));
        assert_eq!(image.len(), 16);
        assert_eq!([0, 1].map(|i| image.point_in_sensor(i).z), heights);
    }
    // A buffer of a glTF file, all of whose bytes could be those of a text.
    let folder = tempfile::tempdir().unwrap();
    let x = f32::from_le_bytes([0xEF, 0xBB, 0xBF, 0x3F]);
    let mut floats: [f32; 9] = std::array::from_fn(|i| f32::from_le_bytes([b'a' + i as u8, b'z', 0xBF, 0x3F]));
    floats[0] = x;
    std::fs::write(folder.path().join("a.bin"), floats.map(f32::to_le_bytes).concat()).unwrap();
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, gltf("a.bin")).unwrap();
    let read = mesh(import::open(&path).unwrap().scans[0].read());
    assert_eq!(read.positions[0], DVec3::new(x.into(), floats[1].into(), floats[2].into()));
}

fn gltf(uri: &str) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": 36, "uri": "{uri}"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}],
        "nodes": [{{"mesh": 0}}], "scenes": [{{"nodes": [0]}}]}}"#
    )
}

/// UTF-16 is named, whatever the text would be, and so is the remedy.
#[test]
fn utf_16_is_named() {
    let mut wrong = Vec::new();
    for (name, bytes) in texts() {
        let folder = tempfile::tempdir().unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let text = text.trim_start_matches('\u{feff}');
        let without_mark = text.is_ascii().then(|| text.to_owned());
        let texts = [format!("\u{feff}{text}")].into_iter().chain(without_mark);
        for (text, to_bytes) in
            texts.flat_map(|text| [(text.clone(), u16::to_le_bytes as fn(_) -> _), (text, u16::to_be_bytes)])
        {
            let bytes: Vec<u8> = text.encode_utf16().flat_map(to_bytes).collect();
            match open_text(folder.path(), &name, &bytes) {
                Err(error) if error.to_string().contains("this is UTF-16 text: save it as UTF-8") => {}
                other => wrong.push(format!("{name}: {:?}", other.map(|_| "read").map_err(|e| e.to_string()))),
            }
        }
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

/// Theorem: decimal commas are read as such or refused with the remedy, never as two numbers.
#[test]
fn decimal_commas() {
    let expected = vec![DVec3::new(1.5, -2.25, 3.0), DVec3::new(4e6 + 0.5, 0.125, -6.0)];
    for text in [
        "1,5 -2,25 3,0\n4000000,5 0,125 -6,0\n",
        "1,5\t-2,25\t3\n4000000,5\t1,25E-1\t-6\n",
        "  1,5   -2,25   3,0  \r\n+4000000,5 0,125 -6\r\n",
        "X Y Z\n1,5 -2,25 3,0\n4000000,5 0,125 -6\n",
        "2\n1,5 -2,25 3,0\n4000000,5 0,125 -6\n",
        "1,5;-2,25;3\n4000000,5;0,125;-6\n",
    ] {
        assert_eq!(cloud(read("a.xyz", text.as_bytes())).positions, expected, "{text}");
    }
    let coloured = cloud(read("a.txt", b"1,5 2,5 3,5 255 0 7\n4,5 5,5 6,5 1 2 3\n"));
    assert_eq!(coloured.colour.unwrap(), [[255, 0, 7, 255], [1, 2, 3, 255]]);
    assert_eq!(coloured.positions[1], DVec3::new(4.5, 5.5, 6.5));
    // A guess is told.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xyz");
    std::fs::write(&path, "1,5 2,5 3,5\n").unwrap();
    assert_eq!(import::open(&path).unwrap().notes, ["a.xyz: commas within numbers are taken as decimal points"]);
    // Commas between the numbers as well: nothing tells the two apart.
    for text in ["1,05,2,25,3,00\n4,50,5,50,6,05\n", "x,y,z\n1,5,2,25,3,5\n"] {
        let error = refused("a.csv", text.as_bytes());
        assert!(error.contains("line ") && error.contains("decimal commas"), "{error}");
        assert!(error.contains("write decimal points, or semicolons between the numbers"), "{error}");
    }
    // Commas that separate go on doing so.
    for (text, expected) in [
        ("1, 2, 3\n", DVec3::new(1.0, 2.0, 3.0)),
        ("1 ,2 ,3\n", DVec3::new(1.0, 2.0, 3.0)),
        ("1,2, 3\n", DVec3::new(1.0, 2.0, 3.0)),
        ("1.5,2,3 255,0,7\n", DVec3::new(1.5, 2.0, 3.0)),
        ("10,20,30,255,0,7\n", DVec3::new(10.0, 20.0, 30.0)),
        ("x,y,z,r,g,b\n10,20,30,255,0,7\n", DVec3::new(10.0, 20.0, 30.0)),
        ("001,002,003,004,005,006\n", DVec3::new(1.0, 2.0, 3.0)),
    ] {
        assert_eq!(cloud(read("a.txt", text.as_bytes())).positions, [expected], "{text}");
    }
}

/// Statements of OBJ may go on in the next line.
#[test]
fn obj_lines_that_continue() {
    let plain = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nv 5 5 5\nf 1 2 5\n";
    let expected = mesh(read("a.obj", plain.as_bytes()));
    for ends in ["\n", "\r\n", "\r"] {
        let text = "v 0 0 \\\n0\nv 1 \\\n\\\n0 0\n# C:\\models\\\nv 1 1 0\nvn 0 0 \\\n1\nv 0 1 0\nf 1 2 \\\n 3 4\nv 5 5 5\n\
                    f 1\\\n 2 5 \\\n";
        assert_eq!(mesh(read("a.obj", text.replace('\n', ends).as_bytes())), expected, "{ends:?}");
    }
    // Across the ends of windows, wherever these fall.
    let mut text = String::new();
    for i in 0..40_000 {
        text += &format!("v {i} \\\n   0.5 \\\n {}\n", i % 7);
    }
    let many = cloud(read("a.obj", text.as_bytes()));
    assert!(many.positions.iter().enumerate().all(|(i, p)| *p == DVec3::new(i as f64, 0.5, (i % 7) as f64)));
    assert_eq!(many.positions.len(), 40_000);
    let error = refused("a.obj", b"v 0 0 0\nf 1 1 \\\n x\n");
    assert!(error.contains("line 3: `x` names no vertex"), "{error}");
}

/// A file of E57 with one scan of the given fields beside x, y and z, and without bounds of its indices.
fn e57(fields: &[(RecordName, i64, i64)], points: &[([f64; 3], &[i64])]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut bytes, "file").unwrap();
    let mut prototype = vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
    prototype.extend(fields.iter().map(|(name, min, max)| Record {
        name: name.clone(),
        data_type: RecordDataType::Integer { min: *min, max: *max },
    }));
    let mut scan = writer.add_pointcloud("a", prototype).unwrap();
    for (position, values) in points {
        let mut row: Vec<RecordValue> = position.map(RecordValue::Double).to_vec();
        row.extend(values.iter().copied().map(RecordValue::Integer));
        scan.add_point(row).unwrap();
    }
    scan.set_index_bounds(None);
    scan.finalize().unwrap();
    writer.finalize().unwrap();
    drop(writer);
    bytes.into_inner()
}

/// Without a grid the origin is a place like any other, unless the file says that a point is none.
#[test]
fn e57_points_at_the_origin() {
    // Every third point has no measurement: flagged so, its coordinates are the origin.
    let points: Vec<([f64; 3], &[i64])> = (0..12)
        .map(|i| match i % 3 {
            0 => ([0.0; 3], &[0][..]),
            1 => ([1.0, 2.0, f64::from(i)], &[0][..]),
            _ => ([0.0; 3], &[2][..]),
        })
        .collect();
    let plain: Vec<([f64; 3], &[i64])> = points.iter().map(|point| (point.0, &[][..])).collect();
    let all: Vec<DVec3> = points.iter().map(|point| DVec3::from_array(point.0)).collect();
    assert_eq!(cloud(read("a.e57", &e57(&[], &plain))).positions, all);
    let measured: Vec<DVec3> = points.iter().filter(|point| point.1 == [0]).map(|point| point.0.into()).collect();
    let flagged = e57(&[(RecordName::CartesianInvalidState, 0, 2)], &points);
    assert_eq!(cloud(read("a.e57", &flagged)).positions, measured);
}

/// Without bounds of the indices the grid is what its points use, whatever the fields could hold.
#[test]
fn e57_without_index_bounds() {
    let points = |first: [i64; 2]| -> Vec<([f64; 3], [i64; 2])> {
        (0..12).map(|i| ([1.0 + i as f64, 2.0, 3.0], [first[0] + i / 4, first[1] + i % 4])).collect()
    };
    for (first, least, most) in
        [([0, 0], 0, i64::from(u16::MAX)), ([7, 1000], i64::from(i32::MIN), i64::from(i32::MAX)), ([1, 1], 0, 7)]
    {
        let points = points(first);
        // In any order, and not all there: the last row has one pixel, the first column is whole.
        let order = [8, 3, 0, 5, 1, 2, 7, 6, 4];
        let some: Vec<([f64; 3], &[i64])> = order.iter().map(|&i: &usize| (points[i].0, &points[i].1[..])).collect();
        let fields = [(RecordName::RowIndex, least, most), (RecordName::ColumnIndex, least, most)];
        let Content::RangeImage(image) = read("a.e57", &e57(&fields, &some)).unwrap() else { panic!("no grid") };
        assert_eq!((image.rows(), image.cols(), image.valid_count()), (3, 4, 9), "{first:?}");
        for pixel in 0..12 {
            assert_eq!(image.is_valid(pixel), pixel < 9, "{pixel}");
            if pixel < 9 {
                assert_eq!(image.point_in_sensor(pixel), DVec3::from_array(points[pixel].0));
            }
        }
    }
    // Two points at the ends of the fields: no grid, and nothing is allocated for one.
    let far: [([f64; 3], &[i64]); 2] = [([1.0; 3], &[0, 0]), ([2.0; 3], &[65_535, 65_535])];
    let fields = [(RecordName::RowIndex, 0, 65_535), (RecordName::ColumnIndex, 0, 65_535)];
    let error = refused("a.e57", &e57(&fields, &far));
    assert!(error.contains("rows 0 to 65535 and columns 0 to 65535 are too many for 2 points"), "{error}");
    let error = refused("a.e57", &e57(&fields, &[]));
    assert!(error.contains("the scan has no valid points"), "{error}");
}

/// A whole image in one strip, as Python's tifffile writes it, whatever its size.
#[test]
fn tiff_of_one_strip() {
    use tiff::encoder::{Compression, TiffEncoder, colortype};
    let (rows, cols) = (2_100_u32, 2_000_u32);
    let height = |i: u32| f64::from(i % 977) * 0.5;
    let values: Vec<f64> = (0..rows * cols).map(height).collect();
    assert!(values.len() * 8 > 32 << 20);
    for packing in [Compression::Uncompressed, Compression::Lzw] {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut bytes).unwrap().with_compression(packing);
        let mut image = encoder.new_image::<colortype::Gray64Float>(cols, rows).unwrap();
        image.rows_per_strip(rows).unwrap();
        image.write_data(&values).unwrap();
        let bytes = bytes.into_inner();
        let Content::RangeImage(image) = read("one.tif", &bytes).unwrap() else { panic!("no image") };
        assert_eq!((image.rows(), image.cols()), (rows as usize, cols as usize));
        assert!((0..image.len()).step_by(1009).all(|i| image.point_in_sensor(i).z == height(i as u32)));
        // The limit is the caller's, and its name is told.
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("one.tif");
        std::fs::write(&path, &bytes).unwrap();
        let little = ReadOptions { max_decoded_gib: 0.02, ..ReadOptions::default() };
        let error = open_with(&[&path], &little, &Progress::none()).unwrap().scans[0].read().unwrap_err().to_string();
        assert!(error.contains("max_decoded_gib"), "{error}");
    }
}

/// Heights that would be letters, were the tile a text.
#[test]
fn low_land_is_no_text() {
    let heights: Vec<u8> = (0..1201 * 1201_u32).flat_map(|i| (40 + (i % 60) as i16).to_be_bytes()).collect();
    for name in ["N00E000.hgt", "n37e014.HGT"] {
        let Content::RangeImage(image) = read(name, &heights).unwrap() else { panic!("no image") };
        assert_eq!((image.rows(), image.valid_count(), image.point_in_sensor(7).z), (1201, 1201 * 1201, 47.0));
    }
}

/// Lists of each kind name files elsewhere where the caller allows it.
#[test]
fn lists_reach_out_of_their_folder_where_that_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    let mesh = TriMesh::new(vec![[0.0; 3].into(), [1.0, 0.0, 0.0].into(), [0.0, 1.0, 0.0].into()], vec![[0, 1, 2]]);
    export::write_ply(
        &folder.path().join("one.ply"),
        &mesh,
        export::PlyEncoding::BinaryLittleEndian,
        &Progress::none(),
    )
    .unwrap();
    let lists = [
        ("a.conf", "bmesh ../one.ply 0 0 0 0 0 0 1\n"),
        ("a.aln", "1\n../one.ply\n#\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n0\n"),
    ];
    for (name, text) in lists {
        let list = inner.join(name);
        std::fs::write(&list, text).unwrap();
        let open = |allow_outside| {
            open_with(&[&list], &ReadOptions { allow_outside, ..ReadOptions::default() }, &Progress::none())
        };
        assert!(open(false).unwrap_err().to_string().contains("leads out of the folder"), "{name}");
        let set = open(true).unwrap();
        assert!(matches!(set.scans[0].read().unwrap(), Content::Mesh(read) if read.triangles.len() == 1), "{name}");
    }
}

/// Theorem: in no format that a mesh can be written in is an empty one read as if it were one.
#[test]
fn empty_meshes_are_refused() {
    use export::{GlbNode, GlbOptions, PlyEncoding};
    type Write = fn(&Path, &TriMesh, &Progress<'_>) -> surfrecon::Result<()>;
    fn ply(path: &Path, mesh: &TriMesh, encoding: PlyEncoding) -> surfrecon::Result<()> {
        export::write_ply(path, mesh, encoding, &Progress::none())
    }
    let writers: [(&str, Write); 6] = [
        ("text.ply", |path, mesh, _| ply(path, mesh, PlyEncoding::Ascii)),
        ("little.ply", |path, mesh, _| ply(path, mesh, PlyEncoding::BinaryLittleEndian)),
        ("big.ply", |path, mesh, _| ply(path, mesh, PlyEncoding::BinaryBigEndian)),
        ("a.obj", |path, mesh, progress| export::write_obj(path, mesh, None, progress)),
        ("a.stl", |path, mesh, progress| export::write_stl(path, mesh, 1.0, progress)),
        ("a.glb", |path, mesh, progress| {
            let node = GlbNode { name: "a", mesh, world_from_mesh: DAffine3::IDENTITY, coarser: &[], images: None };
            export::write_glb(path, &[node], &GlbOptions::default(), progress)
        }),
    ];
    let folder = tempfile::tempdir().unwrap();
    let mut wrong = Vec::new();
    let empty = TriMesh::new(Vec::new(), Vec::new());
    let says_so = |error: &str| {
        ["the mesh has no triangles", "there is no vertex", "there is no mesh"]
            .iter()
            .any(|words| error.contains(words))
    };
    for (name, write) in writers {
        let path = folder.path().join(name);
        write(&path, &empty, &Progress::none()).unwrap();
        match import::open(&path).and_then(|set| set.scans[0].read()) {
            Err(error @ surfrecon::Error::Format { .. }) if says_so(&error.to_string()) => {}
            other => wrong.push(format!("{name}: {other:?}")),
        }
    }
    let quads = folder.path().join("quads.ply");
    export::write_quads_ply(&quads, &Default::default(), PlyEncoding::Ascii, &Progress::none()).unwrap();
    match import::open(&quads).and_then(|set| set.scans[0].read()) {
        Err(error @ surfrecon::Error::Format { .. }) if says_so(&error.to_string()) => {}
        other => wrong.push(format!("quads.ply: {other:?}")),
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // A file that holds nothing by mistake is still refused.
    for (name, bytes) in [("a.obj", &b""[..]), ("a.obj", b"# cut off\n"), ("a.stl", b"")] {
        let error = refused(name, bytes);
        assert!(error.contains("line 1: "), "{error}");
    }
    let lines = refused("a.gltf", gltf_of_lines().as_bytes());
    assert!(lines.contains("there are no triangles and no points"), "{lines}");
}

fn gltf_of_lines() -> String {
    gltf("data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA").replace("}}]}],", "}, \"mode\": 1}]}],")
}

/// The version of glTF that is not read is named, with the remedy.
#[test]
fn old_gltf_is_named() {
    let old = r#"{"asset": {"version": "1.0"}, "accessors": {"a": {"bufferView": "v", "componentType": 5126, "count": 3}},
                  "meshes": {"m": {"primitives": []}}, "scenes": {"s": {"nodes": []}}, "scene": "s"}"#;
    let unsaid = old.replace(r#""asset": {"version": "1.0"}, "#, "");
    let mut binary = b"glTF".to_vec();
    binary.extend([1_u32, 20, 0, 0].map(u32::to_le_bytes).concat());
    for bytes in [old.as_bytes(), unsaid.as_bytes(), &binary] {
        let error = refused("a.gltf", bytes);
        assert!(error.contains("glTF 1.0") && error.contains("2.0 is read: write it anew as glTF 2.0"), "{error}");
    }
    let newer = refused("a.gltf", gltf("a.bin").replace("\"2.0\"", "\"3.0\"").as_bytes());
    assert!(newer.contains("glTF 3.0"), "{newer}");
}

/// A pose beside a scan is text as well.
#[test]
fn poses_beside_scans_have_marks_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xyz");
    std::fs::write(&path, "1 2 3\n").unwrap();
    std::fs::write(folder.path().join("a.xf"), format!("\u{feff}{}", IDENTITY.replacen("0 0 0", "0 0 9", 1))).unwrap();
    assert_eq!(import::open(&path).unwrap().scans[0].world_from_sensor.translation.x, 9.0);
}
