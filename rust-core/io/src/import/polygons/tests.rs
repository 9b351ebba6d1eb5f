use std::path::Path;

use glam::{DQuat, DVec2, DVec3};

use super::super::{Content, FileScan, damage, obj};
use super::*;

/// An arrow of area 2.5, whose fan around the first corner has triangles of 2, -0.5 and 1.
const ARROW: [[f64; 2]; 5] = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.5], [0.0, 2.0]];

/// The triangles that a polygon of places is cut into.
fn cut(positions: &[DVec3]) -> Vec<[u32; 3]> {
    let mut triangles = fan(positions.len());
    let mut polygons = Polygons::default();
    polygons.add(0, positions.len());
    polygons.cut(positions, &mut triangles, &Progress::none()).unwrap();
    triangles
}

fn fan(corners: usize) -> Vec<[u32; 3]> {
    (2..corners as u32).map(|i| [0, i - 1, i]).collect()
}

/// The areas of the triangles of a polygon in space whose normal this is.
fn areas(positions: &[DVec3], triangles: &[[u32; 3]], normal: DVec3) -> Vec<f64> {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        (b - a).cross(c - a).dot(normal) / 2.0
    };
    triangles.iter().map(area).collect()
}

fn area_of(outline: &[DVec2]) -> f64 {
    (0..outline.len()).map(|i| outline[i].perp_dot(outline[(i + 1) % outline.len()])).sum::<f64>() / 2.0
}

/// Planes of every direction, near and far.
fn planes() -> Vec<(DQuat, DVec3)> {
    let turns = [[0.0, 0.0, 0.0], [0.3, -1.2, 2.0], [3.0, 0.1, 0.2], [1.57, 0.0, 0.4], [0.7, 1.5, -2.0]];
    let places = [DVec3::ZERO, DVec3::new(4e5, -5e6, 120.0)];
    let turn = |[x, y, z]: [f64; 3]| DQuat::from_euler(glam::EulerRot::XYZ, x, y, z);
    turns.into_iter().flat_map(|angles| places.map(|place| (turn(angles), place))).collect()
}

/// The outline's triangles cover its area once, none turned over, wherever it lies and whichever corner is its first.
fn check(outline: &[DVec2]) {
    let whole = area_of(outline);
    assert!(whole > 0.0, "the outline goes round the wrong way");
    for (turn, place) in planes() {
        for first in 0..outline.len() {
            let mut outline = outline.to_vec();
            outline.rotate_left(first);
            let positions: Vec<DVec3> = outline.iter().map(|p| turn * p.extend(0.0) + place).collect();
            let triangles = cut(&positions);
            let areas = areas(&positions, &triangles, turn * DVec3::Z);
            let rounding = 1e-7 * whole;
            assert!(areas.iter().all(|&area| area > -rounding), "{areas:?} of {triangles:?} from {first}");
            assert!((areas.iter().sum::<f64>() - whole).abs() < rounding, "{areas:?} are not {whole}");
            assert!(triangles.iter().flatten().all(|&corner| (corner as usize) < outline.len()));
        }
    }
}

fn points(outline: &[[f64; 2]]) -> Vec<DVec2> {
    outline.iter().map(|&p| DVec2::from_array(p)).collect()
}

#[test]
fn repeated_corners_and_spikes_cover_nothing() {
    // A skyline whose valleys touch nothing, with each corner there twice; a tower of no width.
    let skyline = [
        [0.0, 0.0],
        [5.0, 0.0],
        [5.0, 1.0],
        [4.0, 1.0],
        [4.0, 2.0],
        [3.0, 2.0],
        [3.0, 0.5],
        [2.0, 0.5],
        [2.0, 2.0],
        [1.0, 2.0],
        [1.0, 1.0],
        [0.0, 1.0],
    ];
    for twice in 0..1 << skyline.len() {
        let repeated = |(k, corner): (usize, &[f64; 2])| vec![*corner; 1 + (twice >> k & 1)];
        if twice % 37 == 0 || twice + 1 == 1 << skyline.len() {
            let outline: Vec<[f64; 2]> = skyline.iter().enumerate().flat_map(repeated).collect();
            check(&points(&outline));
        }
    }
    check(&points(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 3.0], [1.0, 1.0], [0.0, 1.0]]));
    check(&points(&[[1.0, 3.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]));
    check(&points(&[
        [0.0, 0.0],
        [2.0, 0.0],
        [2.0, 0.0],
        [2.0, 2.0],
        [3.0, 2.5],
        [3.0, 3.0],
        [3.0, 2.5],
        [2.0, 2.0],
        [0.0, 2.0],
    ]));
}

#[test]
fn concave_polygons_are_covered_once() {
    check(&points(&ARROW));
    // A quad that is an arrowhead, a staircase with corners on its edges, a comb, a star.
    check(&points(&[[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]]));
    check(&points(&[[0.0, 0.0], [1.0, 0.0], [3.0, 0.0], [3.0, 1.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]]));
    let comb = (0..6).flat_map(|i| {
        let x = f64::from(6 - i);
        [[x, 1.0], [x - 0.5, 1.0], [x - 0.5, 0.1], [x - 1.0, 0.1]]
    });
    check(&points(&[vec![[0.0, 0.0], [6.0, 0.0]], comb.collect()].concat()));
    let star = (0..24).map(|i| {
        let (angle, radius) = (f64::from(i) * std::f64::consts::TAU / 24.0, [1.0, 0.2, 0.7, 0.15][i as usize % 4]);
        DVec2::from_angle(angle) * radius
    });
    check(&star.collect::<Vec<_>>());
}

#[test]
fn a_spiral_of_many_corners_is_covered_once() {
    let arm = |i: u32, wide: f64| {
        let angle = f64::from(i) * 0.05;
        DVec2::from_angle(angle) * (1.0 + angle + wide)
    };
    let outline: Vec<DVec2> = (0..900).map(|i| arm(i, 2.0)).chain((0..900).rev().map(|i| arm(i, 0.0))).collect();
    let positions: Vec<DVec3> = outline.iter().map(|p| p.extend(0.0)).collect();
    let areas = areas(&positions, &cut(&positions), DVec3::Z);
    assert!(areas.iter().all(|&area| area > 0.0));
    assert!((areas.iter().sum::<f64>() / area_of(&outline) - 1.0).abs() < 1e-12);
}

/// Holes are reached over bridges, whose ends are there twice.
#[test]
fn polygons_with_holes_are_covered_once() {
    let square = [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0], [0.0, 0.0]];
    let hole = |x: f64, y: f64| [[x, y], [x, y + 2.0], [x + 2.0, y + 2.0], [x + 2.0, y], [x, y]];
    check(&points(&[&square[..], &hole(1.0, 1.0)].concat()));
    // Both holes by one bridge, then through the first to the second.
    let two = [&square[..], &hole(1.0, 1.0)[..3], &hole(5.0, 4.0), &hole(1.0, 1.0)[2..]].concat();
    check(&points(&two));
    // Two squares that meet at a corner.
    check(&points(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0], [1.0, 1.0], [0.0, 1.0]]));
}

/// Fans that turn nothing over stay, also where rounding turns flat triangles, and what has no area.
#[test]
fn convex_polygons_stay_fans() {
    let circle: Vec<DVec2> = (0..40).map(|i| DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / 40.0)).collect();
    let straight: Vec<DVec2> = (0..40)
        .map(|i| match (i / 10, f64::from(i % 10) / 10.0) {
            (0, t) => DVec2::new(t, 0.0),
            (1, t) => DVec2::new(1.0, t),
            (2, t) => DVec2::new(1.0 - t, 1.0),
            (_, t) => DVec2::new(0.0, 1.0 - t),
        })
        .collect();
    let fan_of_concave = points(&[[1.0, 0.5], [0.0, 2.0], [0.0, 0.0], [2.0, 0.0], [2.0, 2.0]]);
    for outline in [circle, straight, fan_of_concave] {
        for (turn, place) in planes() {
            let positions = outline.iter().map(|p| (turn * p.extend(0.0) + place).as_vec3().as_dvec3());
            let positions: Vec<DVec3> = if place == DVec3::ZERO {
                positions.collect()
            } else {
                outline.iter().map(|p| turn * p.extend(0.0) + place).collect()
            };
            assert_eq!(cut(&positions), fan(outline.len()));
        }
    }
    for positions in [vec![DVec3::ONE; 5], (0..5).map(|i| DVec3::ONE * f64::from(i)).collect()] {
        assert_eq!(cut(&positions), fan(5));
    }
    // A saddle has no plane, but its fan turns nothing over.
    let saddle = [[0.0, 0.0, 0.5], [1.0, 0.0, 0.0], [1.0, 1.0, 0.5], [0.0, 1.0, 0.0]].map(DVec3::from_array);
    assert_eq!(cut(&saddle), fan(4));
}

#[test]
fn large_and_small_ones_are_cut_alike() {
    let arrow = |size: f64| points(&ARROW).iter().map(|p| DVec3::new(p.x * size, 0.0, -p.y * size)).collect::<Vec<_>>();
    let expected = cut(&arrow(1.0));
    assert_ne!(expected, fan(5));
    for size in [1e-300, 1e-160, 1e-20, 1e20, 1e160, 1e300] {
        assert_eq!(cut(&arrow(size)), expected, "{size}");
    }
}

/// A polygon that crosses itself is cut into as many triangles of its own corners, whatever it is.
#[test]
fn what_crosses_itself_ends() {
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 40) as f64 / f64::from(1 << 24)
    };
    for corners in [4, 5, 9, 120] {
        for _ in 0..20 {
            // Few places, so that many corners share one.
            let mut place = || (random() * 6.0).floor();
            let positions: Vec<DVec3> = (0..corners).map(|_| DVec3::new(place(), place(), 0.0)).collect();
            let triangles = cut(&positions);
            assert_eq!(triangles.len(), corners - 2);
            assert!(triangles.iter().flatten().all(|&corner| (corner as usize) < corners));
        }
    }
    let progress = Progress::cancel_after(0);
    let mut polygons = Polygons::default();
    polygons.add(0, 5);
    let positions: Vec<DVec3> = points(&ARROW).iter().map(|p| p.extend(0.0)).collect();
    let outcome = polygons.cut(&positions, &mut fan(5), &progress);
    assert!(matches!(outcome, Err(base::error::Error::Cancelled)));
}

/// Polygons among triangles, in each reader that has some: their triangles stay in their places.
#[test]
fn readers_of_polygons_cut_them() {
    let vertices: Vec<String> = ARROW.iter().map(|[x, y]| format!("{x} {y} 0")).collect();
    let text = format!("v {}\nf 5 4 2\nf 1 2 3 4 5\nf 1 2 3\nf 1 2 3 5\n", vertices.join("\nv "));
    let scan = FileScan::new(Path::new("x.obj"));
    let Content::Mesh(mesh) = damage::read(obj::parse, text.as_bytes(), &scan).unwrap() else { panic!("no mesh") };
    check_read(&mesh);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        std::fs::write(&path, ply(format)).unwrap();
        let Content::Mesh(mesh) = crate::import::open(&path).unwrap().scans[0].read().unwrap() else { panic!("none") };
        check_read(&mesh);
        assert_eq!(mesh.face_attributes[0].data.len(), mesh.triangles.len(), "{format}");
    }
}

fn check_read(mesh: &mesh::TriMesh) {
    let areas = areas(&mesh.positions, &mesh.triangles, DVec3::Z);
    assert_eq!((mesh.triangles[0], mesh.triangles[4]), ([4, 3, 1], [0, 1, 2]));
    assert!(areas[1..4].iter().all(|&area| area > 0.0), "{areas:?}");
    assert_eq!((areas[1..4].iter().sum::<f64>(), areas[5..].iter().sum::<f64>()), (2.5, 4.0));
    assert_eq!(mesh.triangles.len(), 7);
}

/// The same faces, each with a number.
fn ply(format: &str) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {format} 1.0\nelement vertex 5\nproperty double x\nproperty double y\nproperty double z\nelement face 4\n\
        property list uchar int vertex_indices\nproperty float quality\nend_header\n"
    )
    .into_bytes();
    let faces: [&[i32]; 4] = [&[4, 3, 1], &[0, 1, 2, 3, 4], &[0, 1, 2], &[0, 1, 2, 4]];
    let is_text = format == "ascii";
    let is_big = format == "binary_big_endian";
    let put = |bytes: &mut Vec<u8>, shown: String, little: &[u8]| {
        if is_text {
            bytes.extend(shown.into_bytes());
        } else {
            let mut little = little.to_vec();
            if is_big {
                little.reverse();
            }
            bytes.extend(little);
        }
    };
    for [x, y] in ARROW {
        [x, y, 0.0].iter().for_each(|x| put(&mut bytes, format!("{x} "), &x.to_le_bytes()));
        if is_text {
            bytes.push(b'\n');
        }
    }
    for (number, face) in faces.iter().enumerate() {
        put(&mut bytes, format!("{} ", face.len()), &[face.len() as u8]);
        face.iter().for_each(|v| put(&mut bytes, format!("{v} "), &v.to_le_bytes()));
        put(&mut bytes, format!("{number}\n"), &(number as f32).to_le_bytes());
    }
    bytes
}
