use std::io::Cursor;

use super::*;
use crate::import::{self, Content};
use mesh::Attribute;
use proptest::prelude::*;

pub(super) fn written(mesh: &TriMesh, options: &GlbOptions) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.3mf");
    write_3mf(&path, "a", mesh, options, &Progress::none()).unwrap();
    std::fs::read(path).unwrap()
}

pub(super) fn read(bytes: &[u8]) -> TriMesh {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.3mf");
    std::fs::write(&path, bytes).unwrap();
    let Content::Mesh(mesh) = import::open(&path).unwrap().scans[0].read().unwrap() else { panic!("no mesh") };
    mesh
}

pub(super) fn tetrahedron() -> TriMesh {
    let positions = vec![DVec3::ZERO, DVec3::new(0.25, 0.0, 0.0), DVec3::Y, DVec3::Z];
    TriMesh::new(positions, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
}

fn model_text(bytes: &[u8]) -> String {
    let mut zip = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
    std::io::read_to_string(zip.by_name("3D/3dmodel.model").unwrap()).unwrap()
}

#[test]
fn written_read_written_is_the_same() {
    let mut mesh = tetrahedron();
    mesh.vertex_attributes.push(Attribute::colour("colour", vec![[1, 2, 3, 255], [255, 0, 9, 255], [7; 4], [7; 4]]));
    let first = written(&mesh, &GlbOptions::default());
    let found = read(&first);
    assert!(found == mesh);
    assert_eq!(written(&found, &GlbOptions::default()), first);
}

#[test]
fn units_are_said_and_read() {
    let mesh = tetrahedron();
    for (metres, unit) in [(1.0, "meter"), (1e-3, "millimeter"), (0.0254, "inch"), (0.2, "millimeter")] {
        let options = GlbOptions { metres_per_unit: metres, ..GlbOptions::default() };
        let bytes = written(&mesh, &options);
        assert!(model_text(&bytes).contains(&format!("unit=\"{unit}\"")), "{metres}");
        for (found, place) in read(&bytes).positions.iter().zip(&mesh.positions) {
            assert!(found.abs_diff_eq(*place * metres, 1e-15), "{metres}: {found}");
        }
    }
    // Nothing is turned, whatever is up.
    let standing = GlbOptions { up: crate::export::glb::Up::Z, ..GlbOptions::default() };
    assert_eq!(written(&mesh, &standing), written(&mesh, &GlbOptions::default()));
}

#[test]
fn far_meshes_keep_their_shape() {
    let mut mesh = tetrahedron();
    mesh.positions.iter_mut().for_each(|place| *place += DVec3::new(4e6, -5e6, 100.0));
    let found = read(&written(&mesh, &GlbOptions::default()));
    for (found, place) in found.positions.iter().zip(&mesh.positions) {
        assert!(found.abs_diff_eq(*place, 2e-7), "{found} {place}");
    }
}

#[test]
fn many_colours_are_rounded() {
    let count = MOST_COLOURS + 2;
    let positions = (0..count).map(|i| DVec3::new((i % 300) as f64, (i / 300) as f64, 0.0)).collect();
    let mut mesh = TriMesh::new(positions, (0..count as u32 - 301).map(|i| [i, i + 1, i + 300]).collect());
    let colours: Vec<[u8; 4]> = (0..count as u32).map(|i| (i << 8 | 0xff).to_be_bytes()).collect();
    mesh.vertex_attributes.push(Attribute::colour("colour", colours.clone()));
    let found = read(&written(&mesh, &GlbOptions::default()));
    let Some(AttributeData::Colour(read)) = found.vertex_attribute("colour") else { panic!("no colours") };
    let named = mesh.triangles.as_flattened().iter().map(|&v| v as usize);
    let off = named.flat_map(|v| (0..4).map(move |c| (v, c))).map(|(v, c)| read[v][c].abs_diff(colours[v][c]));
    let off = off.max().unwrap();
    assert!(off > 0 && off <= 5, "{off}");
}

#[test]
fn names_are_escaped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.3mf");
    write_3mf(&path, "Tom & \"J\" <1>\u{1}", &tetrahedron(), &GlbOptions::default(), &Progress::none()).unwrap();
    let text = model_text(&std::fs::read(&path).unwrap());
    assert!(text.contains("name=\"Tom &amp; &quot;J&quot; &lt;1&gt;\""), "{text}");
    assert!(matches!(import::open(&path).unwrap().scans[0].read(), Ok(Content::Mesh(_))));
}

#[test]
fn what_the_format_cannot_hold_is_refused() {
    let path = std::env::temp_dir().join("never.3mf");
    let refused = |mesh: &TriMesh| {
        let error = write_3mf(&path, "a", mesh, &GlbOptions::default(), &Progress::none()).unwrap_err().to_string();
        assert!(!path.exists());
        error
    };
    let points = TriMesh::new(tetrahedron().positions, Vec::new());
    assert!(refused(&points).starts_with("a 3MF file holds triangles"));
    let flat = TriMesh::new(tetrahedron().positions, vec![[1, 1, 2]]);
    assert!(refused(&flat).starts_with("a 3MF file holds triangles"));
    let huge = TriMesh::new(vec![DVec3::ZERO, DVec3::X * 1e300, DVec3::Y], vec![[0, 1, 2]]);
    assert!(refused(&huge).starts_with("a coordinate is too large"));
    // The place in millimetres is, though it is not in the unit.
    let far = TriMesh::new(
        tetrahedron().positions.into_iter().map(|place| place + DVec3::splat(1e37)).collect(),
        vec![[0, 1, 2]],
    );
    let options = GlbOptions { metres_per_unit: 0.2, ..GlbOptions::default() };
    let error = write_3mf(&path, "a", &far, &options, &Progress::none()).unwrap_err().to_string();
    assert!(error.starts_with("a coordinate is too large"), "{error}");
    for metres in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e31, 1e-31] {
        let options = GlbOptions { metres_per_unit: metres, ..GlbOptions::default() };
        let error = write_3mf(&path, "a", &tetrahedron(), &options, &Progress::none()).unwrap_err().to_string();
        assert_eq!(error, format!("metres_per_unit must be from 1e-30 to 1e30 for 3MF, got {metres:e}"));
    }
    assert!(check_counts(MOST, MOST).is_ok());
    let error = check_counts(3, MOST + 1).unwrap_err().to_string();
    assert!(error.starts_with("a 3MF file holds at most 2147483647 vertices"), "{error}");
}

/// Theorem: the longest numbers and names stay within the length that is said beforehand.
#[test]
fn the_text_keeps_to_its_bound() {
    let small = f64::from(f32::MIN_POSITIVE) * 1.000_000_1;
    let positions =
        (0..3000).map(|i| DVec3::new(-small * f64::from(i % 3), -small, f64::from(f32::from_bits(i + 1)))).collect();
    let mut mesh = TriMesh::new(positions, (0..2998).map(|i| [i, i + 1, i + 2]).collect());
    mesh.vertex_attributes.push(Attribute::colour("colour", (0..3000_u32).map(|i| (i << 8).to_be_bytes()).collect()));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.3mf");
    // Writing asserts it.
    write_3mf(
        &path,
        &"\"".repeat(5000),
        &mesh,
        &GlbOptions { metres_per_unit: 0.3e-29, ..GlbOptions::default() },
        &Progress::none(),
    )
    .unwrap();
    assert_eq!(import::open(&path).unwrap().scans.len(), 1);
}

#[test]
fn triangles_without_area_by_name_are_left_out() {
    let mut mesh = tetrahedron();
    mesh.triangles.insert(1, [1, 1, 2]);
    assert!(read(&written(&mesh, &GlbOptions::default())).triangles == tetrahedron().triangles);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(40)))]
    // Theorem: coordinates of single precision come back as numbers that round to them, colours to the bit, whatever they are.
    #[test]
    fn single_precision_comes_back(
        places in prop::collection::vec(prop::array::uniform3(-1e3_f32..1e3), 3..40),
        colours in prop::collection::vec(prop::array::uniform4(0_u8..), 40),
        seed in 0_usize..1000,
    ) {
        let count = places.len();
        let positions = places.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
        let corner = |t: usize, k: usize| ((t * (seed + 3) + k * (t + 1)) % count) as u32;
        let triangles: Vec<[u32; 3]> = (0..count).map(|t| [corner(t, 0), corner(t, 1), corner(t, 2)]).chain([[0, 1, 2]])
            .filter(|corners| !is_flat(corners)).collect();
        let mut mesh = TriMesh::new(positions, triangles);
        mesh.vertex_attributes.push(Attribute::colour("colour", colours[..count].to_vec()));
        let found = read(&written(&mesh, &GlbOptions::default()));
        let single = |mesh: &TriMesh| mesh.positions.iter().map(|place| place.as_vec3()).collect::<Vec<_>>();
        prop_assert_eq!(single(&found), single(&mesh));
        prop_assert_eq!(&found.triangles, &mesh.triangles);
        let Some(AttributeData::Colour(read)) = found.vertex_attribute("colour") else { panic!("no colours") };
        for &v in mesh.triangles.as_flattened() {
            prop_assert_eq!(read[v as usize], colours[v as usize]);
        }
    }
}
