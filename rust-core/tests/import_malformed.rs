//! The ways files are wrong, by accident or by design, each for every format it can happen in: what is said, and where.
#![allow(clippy::unwrap_used)]

use std::path::{MAIN_SEPARATOR, Path};

use surfrecon::Progress;
use surfrecon::import::{Content, ReadOptions, open_with};

/// Fault of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Class {
    /// A count times a size overflows, or is more than the file could hold.
    Count,
    /// Elements that take no bytes, very many.
    Empty,
    /// An index, an offset or a reference points outside.
    Index,
    /// A list is longer or shorter than what it lists.
    List,
    /// The file ends early, or a line doesn't.
    Cut,
    /// Text, XML or JSON that isn't, that is too deep, or with entities.
    Syntax,
    /// Unpacks to more than it should.
    Bomb,
    /// Names files elsewhere.
    Path,
    /// Numbers that are none.
    Number,
    /// Lists itself, or is its own child.
    Cycle,
}
use Class::*;

fn seed(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(name)).unwrap()
}

/// A seed with the bytes from `at` on replaced.
fn patched(name: &str, at: usize, bytes: &[u8]) -> Vec<u8> {
    let mut file = seed(name);
    file[at..at + bytes.len()].copy_from_slice(bytes);
    file
}

/// A seed of text with a word replaced.
fn reworded(name: &str, from: &str, to: &str) -> Vec<u8> {
    let file = seed(name);
    let at = file.windows(from.len()).position(|w| w == from.as_bytes()).unwrap_or_else(|| panic!("{name}: {from}"));
    [&file[..at], to.as_bytes(), &file[at + from.len()..]].concat()
}

fn cut(name: &str, share: f64) -> Vec<u8> {
    let mut file = seed(name);
    file.truncate((file.len() as f64 * share) as usize);
    file
}

fn ply(elements: &str, body: &str) -> Vec<u8> {
    format!("ply\nformat ascii 1.0\n{elements}end_header\n{body}").into_bytes()
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
const FACE: &str = "property list uchar int vertex_indices\n";
const POSE: &str = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";

fn pcd(fields: &str, width: &str, data: &str) -> Vec<u8> {
    format!(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS {fields}\nWIDTH {width}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {width}\nDATA {data}\n"
    )
    .into_bytes()
}
const F3: &str = "x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1";

fn gltf(rest: &str) -> Vec<u8> {
    format!(r#"{{"asset": {{"version": "2.0"}}, {rest}}}"#).into_bytes()
}

/// A triangle's data as glTF, with parts to be replaced.
fn gltf_with(uri: &str, view: &str, accessor: &str, nodes: &str) -> Vec<u8> {
    gltf(&format!(
        r#""buffers": [{{"byteLength": 36, "uri": "{uri}"}}], "bufferViews": [{view}], "accessors": [{accessor}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}], "nodes": [{nodes}], "scenes": [{{"nodes": [0]}}]"#
    ))
}
const DATA: &str = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
const VIEW: &str = r#"{"buffer": 0, "byteLength": 36}"#;
const POSITIONS: &str = r#"{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}"#;
const NODE: &str = r#"{"mesh": 0}"#;

/// Grey of 8 bits per pixel, claimed to be of this size, with this data.
fn png(cols: u32, rows: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, cols, rows);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

/// The size in a PNG's header replaced, its checksum mended.
fn png_claim(size: u32) -> Vec<u8> {
    let mut bytes = png(2, 2, &[0; 8]);
    bytes[16..20].copy_from_slice(&size.to_be_bytes());
    bytes[20..24].copy_from_slice(&size.to_be_bytes());
    let mut crc = u32::MAX;
    for byte in &bytes[12..29] {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    bytes[29..33].copy_from_slice(&(!crc).to_be_bytes());
    bytes
}

fn mlp(inside: &str) -> Vec<u8> {
    format!("<!DOCTYPE MeshLabDocument><MeshLabProject><MeshGroup>{inside}</MeshGroup></MeshLabProject>").into_bytes()
}

/// Name, class, content, what is said after the name.
fn cases() -> Vec<(&'static str, Class, Vec<u8>, &'static str)> {
    let deep = |open: &str, close: &str| (open.repeat(100_000) + &close.repeat(100_000)).into_bytes();
    let npy = |shape: &str| {
        let dict = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}\n");
        [b"\x93NUMPY\x01\x00", &(dict.len() as u16).to_le_bytes()[..], dict.as_bytes(), &[0; 16]].concat()
    };
    vec![
        // PLY
        ("a.ply", Count, ply(&format!("element vertex 4000000000000\n{XYZ}"), "0 0 0\n"), "element vertex: the header claims 4000000000000, but the rest of the file holds at most 1: it is cut short"),
        ("a.ply", Count, ply("element vertex 99999999999999999999\n", ""), "line 3: vertex: `99999999999999999999` is not a count (a whole number >= 0)"),
        ("a.ply", Empty, ply("element vertex 4000000000000\n", ""), "header: element `vertex` claims 4000000000000 entries, but has no properties"),
        ("a.ply", Empty, ply(&format!("element ghost 4000000000000\nelement vertex 1\n{XYZ}"), "0 0 0\n"), "header: element `ghost` claims 4000000000000 entries, but has no properties"),
        ("a.ply", Index, ply(&format!("element vertex 3\n{XYZ}element face 1\n{FACE}"), "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"), "line 13: face 0 of 1 (counted from 0): vertex 3 does not exist: there are 3, counted from 0"),
        ("a.ply", Index, ply(&format!("element vertex 3\n{XYZ}element face 1\n{FACE}"), "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"), "line 13: face 0 of 1 (counted from 0): vertex -1 does not exist: there are 3, counted from 0"),
        ("a.ply", List, ply(&format!("element vertex 3\n{XYZ}element face 1\n{FACE}"), "0 0 0\n1 0 0\n0 1 0\n-3 0 1 2\n"), "line 13: face 0 of 1 (counted from 0), property vertex_indices: -3 is out of range (the type is uchar)"),
        ("a.ply", List, ply(&format!("element vertex 3\n{XYZ}element face 1\nproperty list uint int vertex_indices\n"), "0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n"), "face 0 of 1 (counted from 0), property vertex_indices: the file ends"),
        ("a.ply", Cut, cut("import_ply/mesh_little.ply", 0.9), "element vertex: the header claims 4, but the rest of the file holds at most 3: it is cut short"),
        ("a.ply", Cut, cut("import_ply/mesh_text.ply", 0.9), "vertex 3 of 4 (counted from 0), property z: the file ends"),
        ("a.ply", Cut, ("ply\n".to_owned() + &"x".repeat(1 << 20)).into_bytes(), "header: the file ends before `end_header`"),
        ("a.ply", Syntax, ply("element vertex 1\nproperty flat x\n", "0\n"), "line 4: unknown type `flat`: there are char, uchar, short, ushort, int, uint, float, double, int8 to float64"),
        ("a.ply", Number, ply(&format!("element vertex 3\n{XYZ}element face 1\n{FACE}"), "nan 0 0\n1 0 0\n0 inf 0\n3 0 1 2\n"), "vertex 0 of 3 (counted from 0): a coordinate of a mesh is not finite"),
        ("a.ply", Number, ply(&format!("element vertex 1\n{XYZ}"), "0 zero 0\n"), "line 8: vertex 0 of 1 (counted from 0), property y: expected a number, found `zero`"),
        // PTX
        ("a.ptx", Count, format!("9999999\n9999999\n{POSE}0 0 0\n").into_bytes(), "line 10: 9999999 columns of 9999999 rows don't fit the 6 bytes that follow"),
        ("a.ptx", Cut, format!("2\n2\n{POSE}0 0 0 0.5\n1 2 3 0.5\n1 2 3 0.5\n").into_bytes(), "line 13: expected point 3 of 2 columns x 2 rows, but the file ends"),
        ("a.ptx", List, format!("1\n2\n{POSE}0 0 1\n1 2 3 0.5\n").into_bytes(), "line 12: expected the end of the line: each point of a scan has the same columns, found `0.5`"),
        ("a.ptx", Number, format!("1\n2\n{}0 0 1\n1 2 3\n", POSE.replace("0 0 0 1", "nan 0 0 1")).into_bytes(), "line 10: NaN is not a finite number"),
        ("a.ptx", Syntax, format!("1\n2\n{POSE}0 0 1\n1 two 3\n").into_bytes(), "line 12: expected y, found `two`"),
        // Points in text
        ("a.pts", Count, b"4000000000000\n0 0 0\n".to_vec(), "line 1: 4000000000000 points are announced, but 1 follow: the file was cut short"),
        ("a.pts", List, b"3\n0 0 0\n1 1 1\n".to_vec(), "line 1: 3 points are announced, but 2 follow: the file was cut short"),
        ("a.xyz", List, b"0 0 0\n1 1\n".to_vec(), "line 2: 2 numbers, but the first point has 3"),
        ("a.xyz", Number, b"0 0 0\n1 x 1\n".to_vec(), "line 2: expected a number, found `x`"),
        ("a.xyz", Cut, "1 ".repeat(1 << 20).into_bytes(), "line 1: longer than 65,536 bytes: a point has one line"),
        // PCD
        ("a.pcd", Count, pcd(F3, "4000000000", "binary"), "line 11: 4000000000 x 1 points don't fit the 0 bytes that follow"),
        ("a.pcd", Count, pcd(F3, "4000000000", "ascii"), "line 11: 4000000000 x 1 points don't fit the 0 bytes that follow"),
        ("a.pcd", Empty, pcd("x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 0 0 0", "4000000000", "binary"), "line 11: a cloud needs the fields x, y and z, once each"),
        ("a.pcd", Bomb, [pcd(F3, "1000", "binary_compressed"), [u32::MAX; 2].map(u32::to_le_bytes).concat()].concat(), "data: 1000 points of 12 bytes, but it unpacks to 4294967295 bytes"),
        ("a.pcd", Index, [pcd(F3, "1", "binary_compressed"), [3, 12].map(u32::to_le_bytes).concat(), vec![0xFF, 0xFF, 0xFF]].concat(), "point 0 of 1: the data ends or is damaged"),
        ("a.pcd", Cut, cut("import_scan/binary.pcd", 0.9), "line 11: 2 x 2 points don't fit the 43 bytes that follow"),
        ("a.pcd", Syntax, pcd("x y\nSIZE 4 4\nTYPE F F\nCOUNT 1 1", "1", "ascii"), "line 11: a cloud needs the fields x, y and z, once each"),
        ("a.pcd", Number, [pcd(F3, "1", "ascii"), b"1 2 b\n".to_vec()].concat(), "line 12: expected a number, found `b`"),
        // E57
        ("a.e57", Cut, cut("import_scan/two.e57", 0.5), "while decoding: Failed to read E57: Failed creating paged CRC reader: File appears to be truncated: file size 2560 is not a multiple of the page size 1024"),
        ("a.e57", Count, patched("import_scan/two.e57", 32, &u64::MAX.to_le_bytes()), "while decoding: Not implemented: XML sections larger than 52428800 bytes are not supported"),
        ("a.e57", Index, patched("import_scan/two.e57", 24, &u64::MAX.to_le_bytes()), "while decoding: Failed to read E57: File appears to be truncated: cannot seek to XML section at offset 18446744073709551615: File appears to be truncated: offset 18446744073709551615 is behind end of file"),
        ("a.e57", Syntax, reworded("import_scan/two.e57", "<e57Root", "<e57R00t"), "while decoding: Failed to read E57: File appears to be truncated: cannot read 3854 bytes of XML data: Detected invalid checksum (expected: [154, 43, 182, 88], actual: [201, 80, 7, 91]) for page 0"),
        ("a.e57", Number, patched("import_scan/two.e57", 100, &[0xFF; 40]), "while decoding: Failed to read E57: File appears to be truncated: cannot read 3854 bytes of XML data: Detected invalid checksum (expected: [154, 43, 182, 88], actual: [46, 252, 59, 200]) for page 0"),
        // LAS
        ("a.las", Count, patched("import_scan/points.las", 107, &u32::MAX.to_le_bytes()), "header: 4294967295 points of 26 bytes don't fit the 208 bytes left"),
        ("a.las", Index, patched("import_scan/points.las", 96, &u32::MAX.to_le_bytes()), "header: a header of 227 bytes and points from byte 4294967295 don't fit a file of 435"),
        ("a.las", Cut, cut("import_scan/points.las", 0.9), "header: 8 points of 26 bytes don't fit the 164 bytes left"),
        ("a.las", Number, patched("import_scan/points.las", 131, &f64::NAN.to_le_bytes()), "header: the scale [NaN, 0.01, 0.01] or the offset [4000000, 4000000, 4000000] is not usable"),
        ("a.laz", Cut, cut("import_scan/points.laz", 0.9), "table of chunks: the table of chunks is missing: the file was cut short or never finished"),
        ("a.laz", Bomb, patched("import_scan/points.laz", 107, &u32::MAX.to_le_bytes()), "header: 4294967295 points unpack to more than max_decoded_gib, 4"),
        ("a.laz", Bomb, patched("import_scan/points.laz", 107, &100_000_000_u32.to_le_bytes()), "header: 100000000 points can't be in 110 bytes: it is damaged or cut off"),
        ("a.laz", Index, patched("import_scan/points.laz", seed("import_scan/points.laz").len() - 60, &[0xFF; 60]), "table of chunks: 4294967295 chunks don't fit 8 points in 437 bytes"),
        // OBJ
        ("a.obj", Index, b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n".to_vec(), "line 4: a face names vertex 4, but there are only 3"),
        ("a.obj", Index, b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n".to_vec(), "line 4: `-4` names no vertex: they are counted from 1, or backwards from -1"),
        ("a.obj", Index, b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n".to_vec(), "line 4: `0` names no vertex: they are counted from 1, or backwards from -1"),
        ("a.obj", List, b"v 0 0 0\nv 1 0 0\nf 1 2\n".to_vec(), "line 3: a face needs three vertices or more"),
        ("a.obj", Number, b"v 0 0 0\nv nan 0 0\nv 0 1e999 0\nf 1 2 3\n".to_vec(), "line 2: a coordinate is not finite"),
        ("a.obj", Cut, b"v 0 0 0\nv 1 0\n".to_vec(), "line 2: expected z, but the line ends"),
        // STL
        ("a.stl", Count, patched("import_scan/mesh.stl", 80, &u32::MAX.to_le_bytes()), "header: 4294967295 triangles of 50 bytes don't fit the 184 bytes of the file"),
        ("a.stl", Cut, cut("import_scan/mesh.stl", 0.9), "header: 2 triangles of 50 bytes don't fit the 165 bytes of the file"),
        ("a.stl", Number, patched("import_scan/mesh.stl", 96, &f32::NAN.to_le_bytes()), "triangle 0 of 2: a coordinate is not finite"),
        ("a.stl", Syntax, b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n".to_vec(), "line 4: expected z, but the line ends"),
        ("a.stl", Cut, b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n".to_vec(), "line 4: expected `endsolid`, but the file ends"),
        // glTF
        ("a.glb", Count, patched("import_scan/mesh.glb", 12, &u32::MAX.to_le_bytes()), "byte 12: a chunk of 4294967295 bytes goes beyond the end of the file"),
        ("a.glb", Cut, cut("import_scan/mesh.glb", 0.9), "byte 984: a chunk of 152 bytes goes beyond the end of the file"),
        ("a.gltf", Count, gltf_with(DATA, VIEW, &POSITIONS.replace(": 3,", ": 4000000000000,"), NODE), "accessor 0: its 4000000000000 elements don't fit their buffer"),
        ("a.gltf", Index, gltf_with(DATA, &VIEW.replace(": 36", ": 36, \"byteOffset\": 1"), POSITIONS, NODE), "accessor 0: its 3 elements don't fit their buffer"),
        ("a.gltf", Index, gltf_with(DATA, VIEW, &POSITIONS.replace("View\": 0", "View\": 7"), NODE), "accessor 0: it needs a buffer view"),
        ("a.gltf", Index, gltf_with(DATA, VIEW, &POSITIONS.replace(r#""count""#, r#""byteOffset": 18446744073709551615, "count""#), NODE), "accessor 0: its 3 elements don't fit their buffer"),
        ("a.gltf", List, gltf_with(DATA, VIEW, &POSITIONS.replace("VEC3", "MAT2"), NODE), "accessor 0: its type must be SCALAR, VEC2, VEC3 or VEC4"),
        ("a.gltf", Cycle, gltf_with(DATA, VIEW, POSITIONS, r#"{"mesh": 0, "children": [0]}"#), "node 0: it must have one parent, but has two"),
        ("a.gltf", Path, gltf_with("../../secret.bin", VIEW, POSITIONS, NODE), "buffer ../../secret.bin: ../../secret.bin leads out of the folder of this file: put the scans beside it or below it, or allow files outside (allow_outside)"),
        ("a.gltf", Path, gltf_with("file:///etc/passwd", VIEW, POSITIONS, NODE), "buffer file:///etc/passwd: there is no such file: buffers must be in the file itself or in files beside it"),
        ("a.gltf", Syntax, gltf("\"meshes\": ["), "start of file: this is neither glTF's JSON nor a binary glTF: expected value at line 1 column 42"),
        ("a.gltf", Syntax, [b"{\"asset\": {\"version\": \"2.0\"}, \"x\": ".to_vec(), deep("[", "]")].concat(), "start of file: this is neither glTF's JSON nor a binary glTF: EOF while parsing an object at line 1 column 200035"),
        ("a.gltf", Number, gltf_with(&DATA.replace("AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA", "AADAfwAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"), VIEW, POSITIONS, NODE), "mesh 0, primitive 0: vertex 0 has a coordinate that is not finite"),
        // Images
        ("a.png", Bomb, png_claim(60_000), "header: 60000 x 60000 pixels would take more than max_decoded_gib = 4 GiB: raise it if the file is to be trusted"),
        ("a.png", Cut, { let mut file = png(20, 20, &[7; 800]); file.truncate(60); file }, "while decoding: unexpected end of file"),
        ("a.png", Count, png_claim(0), "while decoding: Invalid image dimensions"),
        ("a.pgm", Count, b"P5\n999999 999999\n65535\n0000".to_vec(), "header: 999999 x 999999 pixels of 2 bytes are more than the 4 bytes that follow"),
        ("a.pgm", Cut, b"P5\n2 2\n65535\n0000".to_vec(), "header: 2 x 2 pixels of 2 bytes are more than the 4 bytes that follow"),
        ("a.pgm", Number, b"P2\n2 2\n255\n1 2 3 four\n".to_vec(), "byte 17: expected pixel 3 of 4, a whole number"),
        ("a.pfm", Count, b"Pf\n999999 999999\n-1\n0000".to_vec(), "header: 999999 x 999999 pixels of 4 bytes are more than the 4 bytes that follow"),
        ("a.pfm", Cut, b"Pf\n2 2\n-1\n0000".to_vec(), "header: 2 x 2 pixels of 4 bytes are more than the 4 bytes that follow"),
        ("a.npy", Count, npy("(4294967296, 4294967296)"), "header: 4294967296 x 4294967296 pixels of 4 bytes are more than the 16 bytes that follow"),
        ("a.npy", Cut, npy("(4, 4)"), "header: 4 x 4 pixels of 4 bytes are more than the 16 bytes that follow"),
        ("a.npy", Empty, npy("(0, 4294967296)"), "header: an image of 4294967296 x 0 pixels must have at least one"),
        ("a.hgt", Cut, vec![0; 27], "whole file: 27 bytes must be a square of 2-byte heights (1201 x 1201 or 3601 x 3601)"),
        ("a.asc", Count, b"ncols 999999999\nnrows 999999999\ncellsize 1\n1\n".to_vec(), "header: 999999999 x 999999999 pixels of 2 bytes are more than the 2 bytes that follow"),
        ("a.asc", Cut, b"ncols 2\nnrows 2\ncellsize 1\n1 2 3\n".to_vec(), "header: 2 x 2 pixels of 2 bytes are more than the 6 bytes that follow"),
        ("a.tif", Cut, b"II*\0\x08\0\0\0".to_vec(), "while decoding: the file ends too early"),
        ("a.tif", Index, b"II*\0\xFF\xFF\xFF\xFF".to_vec(), "while decoding: the file ends too early"),
        ("a.exr", Cut, b"\x76\x2f\x31\x01\x02\0\0\0channels\0".to_vec(), "while decoding: invalid: reference to missing bytes"),
        // Lists and what stands beside scans
        ("a.conf", Path, b"bmesh ../../secret.ply 0 0 0 0 0 0 1\n".to_vec(), "line 1: ../../secret.ply leads out of the folder of this file: put the scans beside it or below it, or allow files outside (allow_outside)"),
        ("a.conf", Path, b"bmesh /etc/passwd 0 0 0 0 0 0 1\n".to_vec(), "line 1: /etc/passwd leads out of the folder of this file: put the scans beside it or below it, or allow files outside (allow_outside)"),
        ("a.conf", List, b"bmesh x.ply 0 0 0 0 0 0\n".to_vec(), "line 1: expected tx ty tz qx qy qz qw at the end of the line, found `x.ply` for tx"),
        ("a.conf", Number, b"bmesh x.ply 0 0 0 0 0 0 0\n".to_vec(), "line 1: the quaternion is zero and turns nowhere: for no rotation write 0 0 0 1"),
        ("a.conf", Cycle, b"bmesh a.conf 0 0 0 0 0 0 1\n".to_vec(), "line 1: a.conf is a list of scans, but must be a scan"),
        ("a.mlp", Path, mlp(r#"<MLMesh filename="../../secret.ply" label="a"/>"#), "line 1: ../../secret.ply leads out of the folder of this file: put the scans beside it or below it, or allow files outside (allow_outside)"),
        ("a.mlp", Cycle, mlp(r#"<MLMesh filename="a.mlp" label="a"/>"#), "line 1: a.mlp is a list of scans, but must be a scan"),
        ("a.mlp", Syntax, b"<!DOCTYPE MeshLabDocument><MeshLabProject><MeshGroup>".to_vec(), "line 1: the root node was opened but never closed"),
        ("a.mlp", Syntax, [b"<!DOCTYPE MeshLabDocument>".to_vec(), deep("<a>", "</a>")].concat(), "whole file: an `MLMesh` must name a mesh"),
        ("a.mlp", Bomb, br#"<!DOCTYPE MeshLabDocument [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]><MeshLabProject><MeshGroup><MLMesh filename="&c;"/></MeshGroup></MeshLabProject>"#.to_vec(), "whole file: it declares entities, which no project needs"),
        ("a.mlp", Number, mlp(r#"<MLMesh filename="x.ply" label="a"><MLMatrix44>1 0 0 0 0 nan 0 0 0 0 1 0 0 0 0 1</MLMatrix44></MLMesh>"#), "line 1: NaN is not a finite number"),
        ("a.aln", Path, b"1\n../secret.ply\n#\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n0\n".to_vec(), "line 2: ../secret.ply leads out of the folder of this file: put the scans beside it or below it, or allow files outside (allow_outside)"),
        ("a.aln", Count, b"4000000000\nx.ply\n#\n".to_vec(), "line 3: expected a row of a 4 x 4 matrix, but the file ends"),
        ("a.aln", Cut, b"1\nx.ply\n#\n1 0 0 0\n0 1 0".to_vec(), "line 5: expected a number of a 4 x 4 matrix, but the line ends"),
        ("a.json", Syntax, b"{\"fx\": 1, \"fy\": 1, \"cx\": ".to_vec(), "line 1, column 25: this is not JSON"),
        ("a.json", Syntax, [b"{\"fx\": 1, \"fy\": ".to_vec(), deep("[", "]")].concat(), "whole file: 200016 bytes are more than intrinsics need, at most 65536"),
        ("a.json", Number, br#"{"fx": 0, "fy": 1, "cx": 0, "cy": 1e999}"#.to_vec(), "line 1, column 39: a number is too large: at most 1.8e308 is read"),
        ("a.log", Cut, b"0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 1 2\n1 0 0 0\n".to_vec(), "line 7: expected a row of a 4 x 4 matrix, but the file ends"),
        ("a.log", Number, b"0 0 1\n1 0 0 nan\n0 1 0 0\n0 0 1 0\n0 0 0 1\n".to_vec(), "line 5: NaN is not a finite number"),
        ("a.xf", Cut, b"1 0 0 0 0 1".to_vec(), "whole file: a pose must be a 4 x 4 matrix, found 6 numbers"),
        ("a.xf", Number, b"1 0 0 0 0 9 0 0 0 0 1 0 0 0 0 1".to_vec(), "whole file: the matrix is not a rigid transform: its axes have the lengths 1.0000, 9.0000, 1.0000 and are orthonormal within 8.00e1, which must be at most 0.02. Apply scale and shear to the samples instead."),
    ]
}

/// The words on a file, without its path.
fn said(folder: &Path, name: &str, content: &[u8]) -> String {
    std::fs::write(folder.join(name), content).unwrap();
    let mut opened = vec![folder.join(name)];
    if name.ends_with(".xf") {
        opened = vec![folder.join("a.ply")];
        std::fs::write(&opened[0], ply(&format!("element vertex 1\n{XYZ}"), "0 0 0\n")).unwrap();
    }
    if [".json", ".log"].iter().any(|ending| name.ends_with(ending)) {
        opened.push(folder.join("depth.pgm"));
        std::fs::write(&opened[1], seed("import_scan/map.pgm")).unwrap();
    }
    let outcome = open_with(&opened, &ReadOptions::default(), &Progress::none())
        .and_then(|set| set.scans.iter().map(|scan| scan.read()).collect::<Result<Vec<Content>, _>>());
    opened.iter().chain([&folder.join(name)]).for_each(|path| drop(std::fs::remove_file(path)));
    match outcome {
        Ok(read) => format!("read as {}", format!("{read:?}").chars().take(60).collect::<String>()),
        Err(error) => error.to_string().replace(&format!("{}{MAIN_SEPARATOR}", folder.display()), ""),
    }
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let mut wrong = Vec::new();
    let is_built = |name: &str| cfg!(feature = "las") || !name.starts_with("a.la");
    for (name, class, content, expected) in cases().into_iter().filter(|case| is_built(case.0)) {
        let found = said(folder.path(), name, &content);
        let found = found.strip_prefix(&format!("{name}: ")).unwrap_or(&found);
        if found != expected {
            wrong.push(format!("{name} {class:?}\n   found    {found}\n   expected {expected}"));
        }
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}
