//! In whatever pieces a mesh comes, the file is the one that the whole mesh makes.

use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;

use super::*;
use crate::export::{PositionType, Provenance, part_path, write_ply};
use mesh::{Crs, TriMesh};

/// Some rows of a mesh's vertices or triangles.
type Piece = (bool, Range<usize>);

fn hand_over(mesh: &TriMesh, pieces: &[Piece], sink: &mut dyn MeshSink) -> Result<()> {
    sink.begin(&mesh.outline())?;
    for (of_vertices, range) in pieces {
        let places: Vec<usize> = range.clone().collect();
        let entries = |list: &[Attribute]| list.iter().map(|of| of.data.gather(&places)).collect::<Vec<_>>();
        if *of_vertices {
            let attributes = entries(&mesh.vertex_attributes);
            sink.vertices(range.start as u64, &mesh.positions[range.clone()], &attributes)?;
        } else {
            let attributes = entries(&mesh.face_attributes);
            sink.triangles(range.start as u64, &wide(&mesh.triangles[range.clone()]), &attributes)?;
        }
    }
    Ok(())
}

fn wide(triangles: &[[u32; 3]]) -> Vec<[u64; 3]> {
    triangles.iter().map(|t| t.map(u64::from)).collect()
}

fn whole(mesh: &TriMesh) -> Vec<Piece> {
    vec![(false, 0..mesh.triangles.len()), (true, 0..mesh.positions.len())]
}

/// All rows, cut in some places.
fn pieces(mesh: &TriMesh, cuts: &[usize]) -> Vec<Piece> {
    let mut found = Vec::new();
    for (of_vertices, count) in [(true, mesh.positions.len()), (false, mesh.triangles.len())] {
        let mut ends: Vec<usize> = cuts.iter().map(|cut| cut % (count + 1)).chain([0, count]).collect();
        ends.sort_unstable();
        found.extend(ends.windows(2).map(|ends| (of_vertices, ends[0]..ends[1])));
    }
    found
}

prop_compose! {
    /// A mesh near the origin or far from it, on numbers of single precision or not, with attributes of every kind.
    fn meshes()(
        corners in prop::collection::vec(prop::array::uniform3(-1000..1000_i32), 1..200),
        far in prop::sample::select(vec![0.0, 5e4, 3e7, 1e39]),
        unit in prop::sample::select(vec![0.5, 0.1]),
        attributes in any::<[bool; 5]>(),
        seed in any::<u32>(),
    ) -> TriMesh {
        let count = corners.len();
        let place = |c: &[i32; 3]| DVec3::from_array(c.map(|x| f64::from(x) * unit + far));
        let of = |i: usize| (i as u32).wrapping_mul(seed | 1);
        let triangle = |t: usize| [0, 1, 2].map(|k| of(3 * t + k) % count as u32);
        let mut mesh = TriMesh::new(corners.iter().map(place).collect(), (0..2 * count).map(triangle).collect());
        let every = |count: usize| [
            Attribute::f32("confidence", (0..count).map(|i| of(i) as f32).collect()),
            Attribute::i32("source_scan", (0..count).map(|i| of(i) as i32).collect()),
            Attribute::bool("interpolated", (0..count).map(|i| of(i) % 3 == 0).collect()),
            Attribute::colour("colour", (0..count).map(|i| of(i).to_le_bytes()).collect()),
            Attribute::colour("other", (0..count).map(|i| of(i).to_be_bytes()).collect()),
        ];
        let chosen = |count: usize| every(count).into_iter().zip(attributes).filter_map(|(a, is)| is.then_some(a)).collect();
        mesh.vertex_attributes = chosen(count);
        mesh.face_attributes = chosen(2 * count);
        mesh.crs = (seed % 2 == 0).then(|| Crs::new("EPSG:25832").unwrap());
        mesh
    }
}

proptest! {
    #[test]
    fn pieces_in_any_order_make_the_same_file(
        mesh in meshes(),
        (cuts, order) in (prop::collection::vec(any::<usize>(), 0..6), Just((0..14).collect::<Vec<usize>>()).prop_shuffle()),
        big in any::<bool>(),
        positions in prop::sample::select(vec![PositionType::Auto, PositionType::Float, PositionType::Double]),
        said in any::<bool>(),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let [one, other] = ["one.ply", "other.ply"].map(|name| folder.path().join(name));
        let encoding = if big { PlyEncoding::BinaryBigEndian } else { PlyEncoding::BinaryLittleEndian };
        let provenance = said.then(|| Provenance::from_json("{\"command\": \"merge\"}").unwrap());
        let options = PlyOptions { encoding, positions, provenance, part_triangles: 0 };
        let pieces = pieces(&mesh, &cuts);
        let pieces: Vec<Piece> = order.iter().filter_map(|&place| pieces.get(place).cloned()).collect();
        let at_once = write_ply(&one, &mesh, options.clone(), &Progress::none());
        let made = write_ply_in_pieces(&other, options, |sink| hand_over(&mesh, &pieces, sink), &Progress::none());
        match at_once {
            Ok(()) => {
                made.unwrap();
                prop_assert!(std::fs::read(&one).unwrap() == std::fs::read(&other).unwrap());
            }
            Err(error) => {
                prop_assert_eq!(made.unwrap_err().to_string(), error.to_string());
                prop_assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
            }
        }
    }
}

/// A run of a mesh's triangles with the vertices that it names, as one would cut it out by hand.
fn cut_out(mesh: &TriMesh, run: Range<usize>) -> TriMesh {
    let triangles: Vec<usize> = run.collect();
    let named: BTreeSet<u32> = triangles.iter().flat_map(|&t| mesh.triangles[t]).collect();
    let vertices: Vec<usize> = named.iter().map(|&v| v as usize).collect();
    let number: BTreeMap<u32, u32> = named.into_iter().zip(0..).collect();
    let of = |list: &[Attribute], places: &[usize]| {
        list.iter().map(|of| Attribute { name: of.name.clone(), data: of.data.gather(places) }).collect()
    };
    let mut part = TriMesh::new(
        vertices.iter().map(|&v| mesh.positions[v]).collect(),
        triangles.iter().map(|&t| mesh.triangles[t].map(|v| number[&v])).collect(),
    );
    part.vertex_attributes = of(&mesh.vertex_attributes, &vertices);
    part.face_attributes = of(&mesh.face_attributes, &triangles);
    part.crs.clone_from(&mesh.crs);
    part
}

proptest! {
    /// Theorem: a mesh in parts is in files that have, run by run, the triangles of the whole and their vertices, bit by bit, and no file
    /// is there but these. One that needs no parts is the file that it always was.
    #[test]
    fn parts_are_runs_of_the_whole(
        mesh in meshes(),
        cuts in prop::collection::vec(any::<usize>(), 0..6),
        part_triangles in 1..300_u32,
        big in any::<bool>(),
        said in any::<bool>(),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let [there, other] = ["there.ply", "other.ply"].map(|name| folder.path().join(name));
        let encoding = if big { PlyEncoding::BinaryBigEndian } else { PlyEncoding::BinaryLittleEndian };
        let provenance = said.then(|| Provenance::from_json("{\"command\": \"merge\"}").unwrap());
        let one = PlyOptions { encoding, provenance, ..PlyOptions::default() };
        let options = PlyOptions { part_triangles, ..one.clone() };
        let pieces = pieces(&mesh, &cuts);
        let none = Progress::none();
        write_ply(&there, &mesh, options.clone(), &none).unwrap();
        write_ply_in_pieces(&other, options, |sink| hand_over(&mesh, &pieces, sink), &none).unwrap();
        let (all, most) = (mesh.triangles.len(), part_triangles as usize);
        let count = all.div_ceil(most);
        let kind = if is_double(&Extent::of(&mesh.positions), PositionType::Auto).unwrap() {
            PositionType::Double
        } else {
            PositionType::Float
        };
        prop_assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2 * count);
        for number in 0..count {
            let expected = folder.path().join("expected.ply");
            let part = cut_out(&mesh, most * number..all.min(most * (number + 1)));
            if count > 1 {
                write_ply(&expected, &part, PlyOptions { positions: kind, ..one.clone() }, &none).unwrap();
            } else {
                write_ply(&expected, &mesh, one.clone(), &none).unwrap();
            }
            for path in [&there, &other] {
                let path = part_path(path, number as u64 + 1, count as u64);
                prop_assert!(std::fs::read(path).unwrap() == std::fs::read(&expected).unwrap());
            }
            std::fs::remove_file(expected).unwrap();
        }
    }
}

/// Theorem: what is not the mesh of the outline is no file, and a file that was there is untouched.
#[test]
fn what_is_not_as_announced_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    std::fs::write(&path, "old").unwrap();
    let mut mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]);
    mesh.vertex_attributes.push(Attribute::i32("row", vec![1, 2, 3]));
    let rows = || [AttributeData::I32(vec![1, 2, 3])];
    let refused = |options: PlyOptions, make: &(dyn Fn(&mut dyn MeshSink) -> Result<()> + Sync)| {
        let text = write_ply_in_pieces(&path, options, |sink| make(sink), &Progress::none()).unwrap_err().to_string();
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        text
    };
    let begun = |make: &(dyn Fn(&mut dyn MeshSink) -> Result<()> + Sync)| {
        refused(PlyOptions::default(), &|sink| {
            sink.begin(&mesh.outline())?;
            make(sink)
        })
    };
    let text = refused(PlyEncoding::Ascii.into(), &|_| Ok(()));
    assert!(text.ends_with("mesh.ply: what is written piece by piece must be binary, not text"), "{text}");
    assert!(refused(PlyOptions::default(), &|_| Ok(())).contains("its outline must come first"));
    let parts = PlyOptions { part_triangles: 1, ..PlyOptions::default() };
    let many = |triangles| MeshOutline { vertices: 1 << 32, triangles, ..mesh.outline() };
    let text = refused(parts, &|sink| sink.begin(&many(10)));
    assert!(text.contains("mesh.ply: 4294967296 vertices are more than PLY files have numbers for"), "{text}");
    let text = begun(&|sink| sink.triangles(0, &wide(&mesh.triangles), &[]));
    assert!(text.contains("says 3 vertices and 1 triangles, but 0 and 1 were handed over"), "{text}");
    let text = begun(&|sink| sink.vertices(1, &mesh.positions, &rows()));
    assert!(text.contains("there are only 3 vertices, and no 3 from 1 on"), "{text}");
    assert!(begun(&|sink| sink.vertices(0, &mesh.positions, &[])).contains("the attributes of its vertices"));
    let other = [AttributeData::F32(vec![1.0; 3])];
    assert!(begun(&|sink| sink.vertices(0, &mesh.positions, &other)).contains("the attributes of its vertices"));
    assert!(begun(&|sink| sink.triangles(0, &[[0, 1, 3]], &[])).contains("triangle 0 names vertex 3"));
    let text = begun(&|sink| sink.vertices(0, &[DVec3::ZERO, DVec3::X, DVec3::NAN], &rows()));
    assert!(text.contains("vertex 2 has a coordinate that is not finite"), "{text}");
    let text = begun(&|sink| {
        sink.triangles(0, &wide(&mesh.triangles), &[])?;
        sink.vertices(0, &[DVec3::ZERO, DVec3::X, DVec3::Z], &rows())
    });
    assert!(text.contains("its vertices must lie where its outline says"), "{text}");
    write_ply_in_pieces(&path, PlyOptions::default(), |sink| hand_over(&mesh, &whole(&mesh), sink), &Progress::none())
        .unwrap();
    assert_ne!(std::fs::read(&path).unwrap(), b"old");
}
