//! The seeds of the fuzz targets, small files of every shape the readers know. SURFRECON_GENERATE=1 writes them anew.
// The seed of LAZ is compressed by the crate that reads it.
#![cfg(feature = "las")]
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DAffine3, DVec3};
use surfrecon::export::{self, PlacedFile, PlyEncoding, PlyOptions, PositionType};
use surfrecon::mesh::{Attribute, Crs};
use surfrecon::range_image::Viewing;
use surfrecon::{PointCloud, Progress, RangeImage, TriMesh};

const ENCODINGS: [(&str, PlyEncoding); 3] =
    [("text", PlyEncoding::Ascii), ("little", PlyEncoding::BinaryLittleEndian), ("big", PlyEncoding::BinaryBigEndian)];

fn seeds() -> BTreeMap<String, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("seed");
    let none = Progress::none();
    let mut seeds = BTreeMap::new();
    let mut keep = |name: String| assert!(seeds.insert(name, std::fs::read(&path).unwrap()).is_none());

    let points = (0..20).map(|i| if i % 3 == 1 { [f32::NAN; 3] } else { [i as f32 * 0.25, -0.5, 1e-3 * i as f32] });
    let mut image = RangeImage::from_points(4, 5, points.collect(), Viewing::ALONG_MINUS_Z).unwrap();
    let plain = image.clone();
    image.colour = Some((0..20).map(|i| [i, 2 * i, 255 - i, 255]).collect());
    image.confidence = Some((0..20).map(|i| i as f32 / 20.0).collect());
    let mut mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], vec![[0, 2, 1], [0, 1, 3]]);
    mesh.vertex_attributes = vec![Attribute::f32("quality", vec![0.5; 4]), Attribute::i32("source_scan", vec![-1; 4])];
    mesh.face_attributes = vec![Attribute::bool("hole_fill", vec![true, false])];
    let cloud = PointCloud {
        positions: vec![DVec3::ONE, DVec3::new(1e7, 0.125, -3.5)],
        normals: Some(vec![[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
        colour: Some(vec![[1, 2, 3, 4]; 2]),
        ..PointCloud::default()
    };
    for (name, encoding) in ENCODINGS {
        export::write_range_grid_ply(&path, &plain, encoding, &none).unwrap();
        keep(format!("import_ply/grid_{name}.ply"));
        export::write_range_grid_ply(&path, &image, encoding, &none).unwrap();
        keep(format!("import_ply/coloured_grid_{name}.ply"));
        export::write_ply(&path, &mesh, encoding, &none).unwrap();
        keep(format!("import_ply/mesh_{name}.ply"));
        let doubles = PlyOptions { encoding, positions: PositionType::Double, ..PlyOptions::default() };
        export::write_points_ply(&path, &cloud, doubles, &none).unwrap();
        keep(format!("import_ply/points_{name}.ply"));
    }
    mesh.crs = Some(Crs::new(UTM).unwrap());
    export::write_ply(&path, &mesh, PlyEncoding::Ascii, &none).unwrap();
    keep("import_ply/named.ply".to_owned());
    let strips = "ply\r\nformat ascii 1.0\r\ncomment odd in every way\r\nbye\r\nelement camera 1\r\n\
        property double k\r\nproperty list uchar float view\r\nelement vertex 5\r\nproperty short x\r\nproperty uint y\r\n\
        property char z\r\nproperty ushort red\r\nproperty float green\r\nproperty uchar blue\r\nelement tristrips 1\r\n\
        property list int int vertex_indices\r\nend_header\r\n0.5 2 1 2\r\n-1 4000000000 7 65535 0.5 255\r\n1 0 0 0 0 0\r\n\
        0 1 0 0 0 0\r\n1 1 1 1 1 1\r\n2 2 2 2 nan 2\r\n8 0 1 2 3 -1 2 3 4\r\n";
    std::fs::write(&path, strips).unwrap();
    keep("import_ply/strips.ply".to_owned());

    for (name, text) in [
        ("plain.xyz", "# points\n0.5 -1e3 2\n1 2 3\n"),
        ("coloured.pts", "2\n0 0 0 -1200 255 0 12\n1 0 0 300 1 2 3\n"),
        ("named.asc", "//X,Y,Z,Nx,Ny,Nz\r\n1,2,3,0.6,0,0.8\r\n"),
        ("commas.csv", "1,5;-2,25;3\n0,6;0;nan\n"),
        ("commas.txt", "1,5 -2,25 3 1 2 3\r0,6 0 2,5E-1 4 5 6\r\n"),
    ] {
        std::fs::write(&path, text).unwrap();
        keep(format!("import_points/{name}"));
    }

    let placed = |file: &str, angle: f64| PlacedFile {
        file: file.to_owned(),
        world_from_file: DAffine3::from_rotation_y(angle) * DAffine3::from_translation(DVec3::new(0.1, 0.0, -2.0)),
    };
    export::write_conf(&path, &[placed("a.ply", 0.0), placed("b.ply", 0.5), placed("deep/c.ply", -2.0)]).unwrap();
    keep("import_conf/written.conf".to_owned());
    let odd = "# odd\r\n\r\nCAMERA\t0 0 0 1 0 0 0\r\nmesh reference 0 0 0 0 0 0 1\r\n// b\r\n  mesh deep\\c.ply 1 2 3 4 5 6 7\r";
    std::fs::write(&path, odd).unwrap();
    keep("import_conf/odd.conf".to_owned());
    seeds
}

/// Small files of the formats of scanners, cameras and meshes.
fn scan_seeds() -> BTreeMap<String, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("seed");
    let none = Progress::none();
    let mut seeds = BTreeMap::new();
    let points = (0..12).map(|i| if i % 5 == 1 { [f32::NAN; 3] } else { [i as f32 * 0.25, -0.5, 3.0] });
    let mut image = RangeImage::from_points(3, 4, points.collect(), Viewing::From(DVec3::ZERO)).unwrap();
    image.world_from_sensor = DAffine3::from_translation(DVec3::new(4e6, 5e6, 7.0));
    let plain = image.clone();
    image.colour = Some((0..12).map(|i| [i, 2 * i, 255 - i, 255]).collect());
    image.intensity = Some((0..12).map(|i| i as f32 / 12.0).collect());
    let mut keep = |name: &str, bytes: Vec<u8>| assert!(seeds.insert(format!("import_scan/{name}"), bytes).is_none());
    export::write_ptx(&path, &[&image, &plain], &none).unwrap();
    keep("two.ptx", std::fs::read(&path).unwrap());
    export::write_e57(&path, &[&image, &plain], None, &none).unwrap();
    keep("two.e57", std::fs::read(&path).unwrap());
    keep("unbounded.e57", e57_without_bounds());
    let mut mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], vec![[0, 2, 1], [0, 1, 3]]);
    mesh.vertex_attributes = vec![Attribute::colour("colour", vec![[9, 8, 7, 255]; 4])];
    export::write_obj(&path, &mesh, None, &none).unwrap();
    keep("mesh.obj", std::fs::read(&path).unwrap());
    keep("continued.obj", b"v 0 0 \\\r\n0\rv 1 0 0\nv 0 1 0\nf 1 \\\n\\\n2 3\n".to_vec());
    export::write_stl(&path, &mesh, 1.0, &none).unwrap();
    keep("mesh.stl", std::fs::read(&path).unwrap());
    export::write_3mf(&path, "a", &mesh, &export::GlbOptions::default(), &none).unwrap();
    keep("mesh.3mf", std::fs::read(&path).unwrap());
    keep("objects.3mf", stored_3mf());
    let node =
        export::GlbNode { name: "a", mesh: &mesh, world_from_mesh: DAffine3::IDENTITY, coarser: &[], images: None };
    export::write_glb(&path, &[node], &export::GlbOptions::default(), &none).unwrap();
    keep("mesh.glb", std::fs::read(&path).unwrap());
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    keep("text.stl", format!("solid a\n{facet}endsolid a\n").into_bytes());
    let pcd = |data: &str| {
        format!(
            "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 2\n\
             VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 4\nDATA {data}\n"
        )
    };
    keep("text.pcd", (pcd("ascii") + "1 2 3 255\nnan nan nan 0\n1 2 4 7\n0 0 0 0\n").into_bytes());
    let plain: Vec<u8> = (0..16).flat_map(|i| (i as f32).to_le_bytes()).collect();
    keep("binary.pcd", [pcd("binary").into_bytes(), plain.clone()].concat());
    let packed = [&[31][..], &plain[..32], &[31], &plain[32..]].concat();
    let sizes = [packed.len() as u32, 64].map(u32::to_le_bytes).concat();
    keep("packed.pcd", [pcd("binary_compressed").into_bytes(), sizes, packed].concat());
    keep("map.pgm", b"P5\n2 2\n65535\n\x00\x01\x02\x03\x04\x05\xff\xff".to_vec());
    keep("text.pgm", b"P2\n# c\n2 2\n255\n0 1\n2 255\n".to_vec());
    keep("map.pfm", [b"Pf\n2 2\n-1\n".to_vec(), plain[..16].to_vec()].concat());
    let esri = "ncols 2\nnrows 2\nxllcorner 4000000\nyllcorner 5000000\ncellsize 10\nnodata_value -1\n1 2\n-1 3.5\n";
    keep("grid.asc", esri.as_bytes().to_vec());
    let dict = b"{'descr': '<f4', 'fortran_order': False, 'shape': (4, 4), }  \n";
    keep("map.npy", [&b"\x93NUMPY\x01\x00"[..], &(dict.len() as u16).to_le_bytes(), dict, &plain].concat());
    keep("tile.hgt", (0..16_i16).flat_map(|h| if h == 5 { i16::MIN } else { h }.to_be_bytes()).collect());
    keep("map.png", png(&[0, 1, 500, 65535].map(u16::to_be_bytes).concat()));
    keep("map.tif", tiff(&[1.5, -9999.0, 2.5, 3.5]));
    keep("depth.exr", exr(&[1.5, 2.0, 1e10, 4.0]));
    let corners = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let gltf = format!(
        r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": 36, "uri": "data:;base64,{corners}"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}],
        "nodes": [{{"mesh": 0, "translation": [1, 2, 3]}}], "scenes": [{{"nodes": [0]}}]}}"#
    );
    keep("text.gltf", gltf.into_bytes());
    keep("points.las", las(false));
    keep("points.laz", las(true));
    keep("named.las", named_las());
    image.crs = Some(Crs::new(UTM).unwrap());
    let made = export::Provenance::from_json("{\"by\":\"a seed\",\"of\":[1,2]}").unwrap();
    export::write_e57(&path, &[&image], Some(&made), &none).unwrap();
    keep("named.e57", std::fs::read(&path).unwrap());
    mesh.crs = image.crs;
    for name in ["named.obj", "named.glb"] {
        let named = folder.path().join(name);
        let options = export::WriteOptions { provenance: Some(made.clone()), ..Default::default() };
        export::write_mesh(&named, &mesh, &[], &options, &none).unwrap();
        keep(name, std::fs::read(&named).unwrap());
    }
    seeds
}

/// 2 x 2 pixels of 16 bits.
fn png(data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

/// 2 x 2 points whose rows and columns could be any of 16 bits.
fn e57_without_bounds() -> Vec<u8> {
    use e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue};
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut bytes, "{seed}").unwrap();
    let index = |name| Record { name, data_type: RecordDataType::Integer { min: 0, max: 65535 } };
    let indices = [RecordName::RowIndex, RecordName::ColumnIndex].map(index);
    let places = [Record::CARTESIAN_X_F32, Record::CARTESIAN_Y_F32, Record::CARTESIAN_Z_F32];
    let mut scan = writer.add_pointcloud("{seed-0}", places.into_iter().chain(indices).collect()).unwrap();
    for i in 0..4_u8 {
        let mut values = vec![RecordValue::Single(i.into()); 3];
        values.extend([7 + i / 2, 9 + i % 2].map(|at| RecordValue::Integer(at.into())));
        scan.add_point(values).unwrap();
    }
    scan.set_index_bounds(None);
    scan.finalize().unwrap();
    writer.finalize().unwrap();
    drop(writer);
    bytes.into_inner()
}

/// 2 x 2 heights.
fn tiff(heights: &[f32]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut bytes).unwrap();
    let mut image = encoder.new_image::<tiff::encoder::colortype::Gray32Float>(2, 2).unwrap();
    image.encoder().write_tag(tiff::tags::Tag::GdalNodata, "-9999").unwrap();
    image.write_data(heights).unwrap();
    bytes.into_inner()
}

/// 2 x 2 depths.
fn exr(depths: &[f32]) -> Vec<u8> {
    use exr::prelude::*;
    let channels = AnyChannels::sort([AnyChannel::new("Z", FlatSamples::F32(depths.to_vec()))].into_iter().collect());
    let layer = Layer::new((2, 2), LayerAttributes::named("a"), Encoding::SMALL_LOSSLESS, channels);
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// Files that list, place or describe scans.
fn side_seeds() -> BTreeMap<String, Vec<u8>> {
    let identity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    let matrix = "<MLMatrix44>\n1 0 0 0.5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n</MLMatrix44>";
    [
        ("open3d.json", r#"{"width": 2, "height": 2, "intrinsic_matrix": [2, 0, 0, 0, 2, 0, 0.5, 0.5, 1]}"#.to_owned()),
        ("plain.json", r#"{"fx": 2, "fy": 2.5, "cx": 0.5, "cy": 5e-1, "w": 2, "h": 2}"#.to_owned()),
        ("matrix.txt", "525 0 319.5\n0 525 239.5\n0 0 1\n".to_owned()),
        ("open3d.log", format!("0 0 1\n{identity}1 1 2\n{identity}")),
        ("tum.freiburg", "# timestamp tx ty tz qx qy qz qw\n1305031102.1758 1.34 0.62 1.65 0 0.6 0 -0.8\n".to_owned()),
        ("project.mlp", format!("<!DOCTYPE MeshLabDocument>\n<MeshLabProject>\n<MeshGroup>\n<MLMesh label=\"a\" filename=\"a.ply\" visible=\"1\">\n{matrix}\n</MLMesh>\n</MeshGroup>\n</MeshLabProject>\n")),
        ("set.aln", format!("2\na.ply\n#\n{identity}b.ply\n#\n{identity}0\n")),
        ("pose.xf", identity.to_owned()),
    ]
    .map(|(name, text)| (format!("import_side/{name}"), text.into_bytes()))
    .into()
}

/// A 3MF file with objects in objects and in another part, materials and colours. It is stored, so that a fuzzer meets its text.
fn stored_3mf() -> Vec<u8> {
    let relations = "<Relationships><Relationship Type=\"a/3dmodel\" Target=\"/3D/a.model\"/></Relationships>";
    let mesh = |property: &str| {
        format!(
            "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/><vertex x=\"0\" y=\"1e1\" z=\"-.5\"/>\
             </vertices><triangles><triangle v1=\"0\" v2=\"1\" v3=\"2\"{property}/></triangles></mesh>"
        )
    };
    let model = format!(
        "<model unit=\"inch\" xmlns:p=\"a\"><resources><m:colorgroup id=\"5\"><m:color color=\"#010203\"/><m:color color=\"#0A0b0C80\"/>\
         </m:colorgroup><basematerials id=\"6\"><base displaycolor=\"#F00000\"/></basematerials>\
         <object id=\"1\" pid=\"6\" pindex=\"0\">{}</object><object id=\"2\"><components><component objectid=\"1\"/>\
         <component p:path=\"/b.model\" objectid=\"3\" transform=\"1 0 0 0 1 0 0 0 -2 3 0 0\"/></components></object></resources>\
         <build><item objectid=\"2\"/></build></model>",
        mesh(" pid=\"5\" p1=\"0\" p2=\"1\" p3=\"0\"")
    );
    let other = format!("<model><resources><object id=\"3\">{}</object></resources></model>", mesh(""));
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, text) in [("_rels/.rels", relations), ("3D/a.model", &model), ("b.model", &other)] {
        zip.start_file(name, zipped().compression_method(zip::CompressionMethod::Stored)).unwrap();
        std::io::Write::write_all(&mut zip, text.as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// Without a time and as on Unix, so that the same bytes come out each day and everywhere.
fn zipped() -> zip::write::SimpleFileOptions {
    let options = zip::write::SimpleFileOptions::default().last_modified_time(zip::DateTime::default());
    options.system(zip::System::Unix)
}

/// Recordings of two frames of 2 x 2 pixels.
fn frame_seeds() -> BTreeMap<String, Vec<u8>> {
    let depths = [1.0_f32, 1.5, 0.0, 7.0].map(f32::to_le_bytes).concat();
    // A block of LZFSE that is not packed.
    let block = |bytes: &[u8]| [b"bvx-", &(bytes.len() as u32).to_le_bytes()[..], bytes, b"bvx$"].concat();
    let colours = png(&[200, 100, 50, 1, 2, 3, 4, 5]);
    let metadata = r#"{"K": [2, 0, 0, 0, 2, 0, 0.5, 0.5, 1], "w": 2, "h": 2, "dw": 2, "dh": 2,
        "poses": [[0, 0, 0, 1, 0, 0, 0], [0, 0.6, 0, 0.8, 1, 0, 0]]}"#;
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let mut put = |name: String, content: &[u8]| {
        zip.start_file(name, zipped()).unwrap();
        std::io::Write::write_all(&mut zip, content).unwrap();
    };
    put("metadata".to_owned(), metadata.as_bytes());
    for k in 0..2 {
        put(format!("rgbd/{k}.depth"), &block(&depths));
        put(format!("rgbd/{k}.conf"), &block(&[2, 1, 2, 0]));
        put(format!("rgbd/{k}.jpg"), &colours);
    }
    let archive = zip.finish().unwrap().into_inner();
    let pose = |x: f32| [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let camera = [2.0, 0.0, 0.5, 0.0, 0.0, 2.0, 0.5, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let floats = |numbers: [f32; 16]| numbers.map(f32::to_le_bytes).concat();
    let mut sens = [&4_u32.to_le_bytes()[..], &1_u64.to_le_bytes(), b"s"].concat();
    [camera, pose(0.0), camera, pose(0.0)].into_iter().for_each(|matrix| sens.extend(floats(matrix)));
    sens.extend([2_u32, 0, 2, 2, 2, 2].map(u32::to_le_bytes).concat());
    sens.extend(1000_f32.to_le_bytes());
    sens.extend(2_u64.to_le_bytes());
    for k in 0..2 {
        sens.extend(floats(pose(k as f32)));
        sens.extend([0, 0, colours.len() as u64, 8].map(u64::to_le_bytes).concat());
        sens.extend(&colours);
        sens.extend([1000_u16, 1500, 0, 65535].map(u16::to_le_bytes).concat());
    }
    let transforms = r#"{"fl_x": 2, "fl_y": 2, "cx": 1, "cy": 1, "w": 2, "h": 2, "frames": [{"file_path": "a.png",
        "depth_file_path": "image", "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}]}"#;
    let map = [b"2&2&1&", &depths[..]].concat();
    [
        ("two.r3d", archive),
        ("two.sens", sens),
        ("transforms.json", transforms.into()),
        ("map.geometric.bin", map),
        ("packed.depth", block(&depths)),
        ("colours.png", colours),
    ]
    .map(|(name, bytes)| (format!("import_frames/{name}"), bytes))
    .into()
}

/// Recordings read, and their damaged copies are refused with their name or read.
#[test]
fn recordings_read() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["two.r3d", "two.sens"] {
        let bytes = &frame_seeds()[&format!("import_frames/{name}")];
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let set = surfrecon::import::open(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(set.scans.len(), 2);
        set.scans.iter().for_each(|scan| drop(scan.read().unwrap_or_else(|error| panic!("{error}"))));
    }
}

const UTM: &str = "PROJCS[\"UTM\",UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"25832\"]]";

/// The same with keys of GeoTIFF.
fn named_las() -> Vec<u8> {
    let plain = las(false);
    let keys = [1_u16, 1, 0, 3, 1024, 0, 1, 1, 3072, 0, 1, 32767, 3073, 34737, 5, 0];
    let keys: Vec<u8> = keys.iter().flat_map(|key| key.to_le_bytes()).collect();
    let record = |id: u16, content: &[u8]| {
        let mut record = vec![0; 54];
        record[2..17].copy_from_slice(b"LASF_Projection");
        record[18..20].copy_from_slice(&id.to_le_bytes());
        record[20..22].copy_from_slice(&(content.len() as u16).to_le_bytes());
        [record, content.to_vec()].concat()
    };
    let records = [record(34735, &keys), record(34737, b"Grid|")].concat();
    let mut head = plain[..227].to_vec();
    head[96..100].copy_from_slice(&(227 + records.len() as u32).to_le_bytes());
    head[100] = 2;
    [head, records, plain[227..].to_vec()].concat()
}

/// Eight points of format 2, version 1.2.
fn las(packed: bool) -> Vec<u8> {
    let mut records = Vec::new();
    for i in 0..8_u8 {
        records.extend([i.into(), 7 * i32::from(i), -5].map(i32::to_le_bytes).concat());
        records.extend([9, i, 9, 2, 0, 0, 0, 0, 0, i, i, i, 255, 0]);
    }
    let packing = laz::LazVlr::from_laz_items(laz::LazItemRecordBuilder::default_version_of::<laz::las::Point2>(0));
    let mut vlr = Vec::new();
    packing.write_to(&mut vlr).unwrap();
    let begin = if packed { 227 + 54 + vlr.len() } else { 227 };
    let mut file = vec![0; begin];
    let mut put = |at: usize, content: &[u8]| file[at..at + content.len()].copy_from_slice(content);
    put(0, b"LASF");
    put(24, &[1, 2]);
    put(94, &227_u16.to_le_bytes());
    put(96, &(begin as u32).to_le_bytes());
    put(104, &if packed { [0x82, 26, 0, 8] } else { [2, 26, 0, 8] });
    (131..155).step_by(8).for_each(|at| put(at, &0.01_f64.to_le_bytes()));
    (155..179).step_by(8).for_each(|at| put(at, &4e6_f64.to_le_bytes()));
    if !packed {
        return [file, records].concat();
    }
    put(100, &[1]);
    put(229, laz::LazVlr::USER_ID.as_bytes());
    put(245, &laz::LazVlr::RECORD_ID.to_le_bytes());
    put(247, &(vlr.len() as u16).to_le_bytes());
    put(281, &vlr);
    let mut out = std::io::Cursor::new(file);
    out.set_position(begin as u64);
    let mut compressor = laz::LasZipCompressor::new(&mut out, packing).unwrap();
    compressor.compress_many(&records).unwrap();
    compressor.done().unwrap();
    drop(compressor);
    out.into_inner()
}

/// Every seed reads, and so do what damage leaves of it or it is refused with its name.
#[test]
fn seeds_read() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in scan_seeds() {
        let path = folder.path().join(name.rsplit('/').next().unwrap());
        std::fs::write(&path, &bytes).unwrap();
        let set = surfrecon::import::open(&path).unwrap_or_else(|error| panic!("{error}"));
        set.scans.iter().for_each(|scan| drop(scan.read().unwrap_or_else(|error| panic!("{error}"))));
        for end in (0..bytes.len()).step_by(1 + bytes.len() / 50) {
            std::fs::write(&path, &bytes[..end]).unwrap();
            let outcome = surfrecon::import::open(&path).and_then(|set| set.scans[0].read());
            if let Err(error) = outcome {
                assert!(error.to_string().starts_with(&*path.to_string_lossy()), "{error}");
            }
        }
    }
}

#[test]
fn seeds_are_up_to_date() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds");
    for (name, bytes) in seeds().into_iter().chain(scan_seeds()).chain(side_seeds()).chain(frame_seeds()) {
        let path = root.join(&name);
        if std::env::var_os("SURFRECON_GENERATE").is_some() {
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, &bytes).unwrap();
        }
        let found = std::fs::read(&path).unwrap_or_default();
        assert!(found == bytes, "{name} is not what the code writes: run this test with SURFRECON_GENERATE=1");
    }
}
