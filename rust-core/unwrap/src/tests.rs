//! Unwrapping of meshes of every kind, judged by the exact check, which is judged by a naive twin.

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use base::{Error, Progress};
use geom::bvh::Closest;
use mesh::shapes::Shape;
use mesh::{Attribute, AttributeData, TriMesh, texture};

use super::check::{UvReport, check};
use super::params::{ChartScale, UnwrapParams};
use super::{Unwrapped, unwrap};

const SMALL: UnwrapParams =
    UnwrapParams { extent: ChartScale::OneTile, size: 512, padding: 2, cone: 1.2, max_stretch: 4.0, threads: 1 };

fn found(done: &Unwrapped) -> UvReport {
    check(&done.uv, &done.mesh.triangles, &Progress::none()).unwrap()
}

/// Unwraps, and checks all that is promised of every mesh.
fn sound(mesh: &TriMesh, params: &UnwrapParams) -> Unwrapped {
    let done = unwrap(mesh, params, &Progress::none()).unwrap();
    let report = found(&done);
    assert!(report.is_sound(), "{report:?}");
    let collapsed: Vec<u32> = (0..mesh.triangles.len() as u32).filter(|&t| done.chart[t as usize] < 0).collect();
    assert_eq!(report.without_area, collapsed);
    assert_eq!(done.report.collapsed, collapsed.len());
    let vertices = |t: &[u32; 3]| t.map(|v| done.source[v as usize]);
    assert!(done.mesh.triangles.iter().map(vertices).eq(mesh.triangles.iter().copied()));
    assert!(done.source.iter().zip(&done.mesh.positions).all(|(&v, p)| mesh.positions[v as usize] == *p));
    assert!(done.uv.iter().all(|at| at.as_vec2().as_dvec2() == *at && at.min_element() >= 0.0));
    assert!(done.uv.iter().all(|at| f64::from(1.0 - at.y as f32) == 1.0 - at.y));
    let [s, t] = texture::coordinates(&done.mesh).unwrap();
    assert!(s.iter().zip(t).map(|(&s, &t)| DVec2::new(s.into(), t.into())).eq(done.uv.iter().copied()));
    let sources = AttributeData::I32(done.source.iter().map(|&v| v as i32).collect());
    assert_eq!(done.mesh.vertex_attribute("source_vertex"), Some(&sources));
    assert_eq!(done.mesh.face_attribute("chart"), Some(&AttributeData::I32(done.chart.clone())));
    assert!(done.uv.iter().all(|at| at.max_element() <= 10.0));
    done.mesh.validate().unwrap();
    done
}

fn joined(meshes: &[TriMesh]) -> TriMesh {
    let mut all = TriMesh::default();
    for mesh in meshes {
        let first = all.positions.len() as u32;
        all.positions.extend(&mesh.positions);
        all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    all
}

fn moved(mut mesh: TriMesh, by: DVec3, scale: f64) -> TriMesh {
    mesh.positions.iter_mut().for_each(|p| *p = *p * scale + by);
    mesh
}

/// A plate of n x n cubes without every second one of every second row: of high genus.
fn perforated(n: i64) -> TriMesh {
    let is_full =
        |p: [i64; 3]| p[..2].iter().all(|i| (0..n).contains(i)) && p[2] == 0 && !(p[0] % 2 == 1 && p[1] % 2 == 1);
    let mut mesh = TriMesh::default();
    let mut known = std::collections::BTreeMap::new();
    for cell in (0..n * n).map(|i| [i % n, i / n, 0]).filter(|&cell| is_full(cell)) {
        for axis in 0..3 {
            for side in 0..2 {
                let mut other = cell;
                other[axis] += 2 * side - 1;
                if is_full(other) {
                    continue;
                }
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let mut corners: Vec<u32> = [[0, 0], [1, 0], [1, 1], [0, 1]]
                    .map(|[i, j]| {
                        let mut at = cell;
                        (at[axis], at[u], at[v]) = (at[axis] + side, at[u] + i, at[v] + j);
                        *known.entry(at).or_insert_with(|| {
                            mesh.positions.push(DVec3::from_array(at.map(|x| x as f64)));
                            mesh.positions.len() as u32 - 1
                        })
                    })
                    .to_vec();
                if side == 0 {
                    corners.reverse();
                }
                mesh.triangles.extend([[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]);
            }
        }
    }
    mesh
}

#[test]
fn closed_open_many_parts_high_genus() {
    let sphere = Shape::Sphere { radius: 3.0 }.mesh(6);
    let done = sound(&sphere, &SMALL);
    assert!(done.report.charts < 12 && done.report.stretch_p95 < 1.3, "{:?}", done.report);
    assert_eq!(done.report.collapsed, 0);
    assert!(done.report.used > 0.4 && done.report.texels_per_unit > 20.0, "{:?}", done.report);
    sound(&Shape::Torus { major: 3.0, minor: 1.0 }.mesh(5), &SMALL);
    let plane = sound(&Shape::Plane { half: DVec2::new(1e-3, 2e-3) }.mesh(3), &SMALL);
    assert!(plane.report.charts == 1 && plane.report.stretch < 1.0001, "{:?}", plane.report);
    let parts: Vec<TriMesh> = (0..27)
        .map(|i| {
            moved(Shape::Sphere { radius: 0.3 }.mesh(1 + i % 2), DVec3::new((i % 9) as f64, (i / 9) as f64, 0.0), 1.0)
        })
        .collect();
    assert!(sound(&joined(&parts), &SMALL).report.charts >= 27);
    let plate = perforated(11);
    assert_eq!(mesh::check(&plate).genus(), Some(25));
    let done = sound(&plate, &SMALL);
    assert!(done.report.stretch < 1.0001 && done.report.charts < done.report.charts_before, "{:?}", done.report);
}

#[test]
fn an_object_its_mirror_image_and_its_inside() {
    let torus = Shape::Torus { major: 3.0, minor: 1.0 }.mesh(3);
    let mut mirrored = torus.clone();
    mirrored.positions.iter_mut().for_each(|p| p.x = -p.x);
    let inside = mirrored.clone();
    mirrored.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    for mesh in [torus, mirrored, inside] {
        sound(&mesh, &SMALL);
    }
}

#[test]
fn degenerate_and_broken_meshes() {
    let mut mesh = Shape::Sphere { radius: 1.0 }.mesh(2);
    let first = mesh.triangles[0];
    // A point, a segment, the same triangle again and turned, a third one at an edge, and triangles of hardly any height.
    mesh.triangles.extend([[first[0]; 3], [first[0], first[1], first[0]], first, [first[0], first[2], first[1]]]);
    let n = mesh.positions.len() as u32;
    let [a, b] = [first[0], first[1]].map(|v| mesh.positions[v as usize]);
    mesh.positions.push((a + b) * 0.7);
    mesh.triangles.push([first[0], first[1], n]);
    for (i, height) in [1e-4, 1e-6, 3e-6, 1e-8, 1e-12, 0.0].into_iter().enumerate() {
        let n = mesh.positions.len() as u32;
        let at = DVec3::new(2.0, i as f64, 0.0);
        mesh.positions.extend([at, at + DVec3::X, at + DVec3::new(0.4, height, 0.1 * height)]);
        mesh.triangles.push([n, n + 1, n + 2]);
    }
    let done = sound(&mesh, &SMALL);
    assert!((5..=8).contains(&done.report.collapsed), "{:?}", done.report);
    assert!(done.report.collapsed_area < 1e-5, "{:?}", done.report);
}

#[test]
fn what_rounding_turns_is_straightened() {
    // Long triangles of all heights in a fan about one vertex, far from the origin and of very different sizes.
    let mut mesh = TriMesh::default();
    mesh.positions.push(DVec3::ZERO);
    let mut angle = 0.0_f64;
    for i in 0..200 {
        mesh.positions.push(DVec3::new(angle.cos(), angle.sin(), 0.0) * (1.0 + 0.1 * f64::from(i % 3)));
        angle += if i % 2 == 0 { 1e-5 } else { 0.02 };
    }
    mesh.triangles.extend((1..200).map(|i| [0, i, i + 1]));
    let done = sound(&moved(mesh, DVec3::splat(1e5), 10.0), &UnwrapParams { size: 1024, ..SMALL });
    assert!(done.report.collapsed < 10, "{:?}", done.report);
}

/// The inside that two triangles have in common, by clipping one with the other's edges.
fn common_area(s: [DVec2; 3], t: [DVec2; 3]) -> f64 {
    let mut polygon = s.to_vec();
    for k in 0..3 {
        let (a, b) = (t[k], t[(k + 1) % 3]);
        let height = |p: DVec2| (b - a).perp_dot(p - a);
        let mut clipped = Vec::new();
        for i in 0..polygon.len() {
            let (p, q) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            let (hp, hq) = (height(p), height(q));
            if hp >= 0.0 {
                clipped.push(p);
            }
            if hp * hq < 0.0 {
                clipped.push(p + (q - p) * (hp / (hp - hq)));
            }
        }
        polygon = clipped;
    }
    (0..polygon.len()).map(|i| polygon[i].perp_dot(polygon[(i + 1) % polygon.len()])).sum::<f64>() / 2.0
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(200)))]
    #[test]
    fn the_check_finds_what_a_naive_twin_finds(corners in prop::collection::vec((0_u8..7, 0_u8..7), 6..30)) {
        let uv: Vec<DVec2> = corners.iter().map(|&(x, y)| DVec2::new(x.into(), y.into())).collect();
        let triangles: Vec<[u32; 3]> = (0..uv.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let report = check(&uv, &triangles, &Progress::none()).unwrap();
        let at = |t: usize| triangles[t].map(|v| uv[v as usize]);
        let area = |[a, b, c]: [DVec2; 3]| (b - a).perp_dot(c - a);
        let signs = |sign: f64| (0..triangles.len() as u32).filter(|&t| area(at(t as usize)) * sign > 0.0).collect::<Vec<_>>();
        prop_assert_eq!(&report.flipped, &signs(-1.0));
        prop_assert_eq!(report.without_area.len(), (0..triangles.len()).filter(|&t| area(at(t)) == 0.0).count());
        let turned = |t: usize| { let [a, b, c] = at(t); if area([a, b, c]) < 0.0 { [a, c, b] } else { [a, b, c] } };
        let mut pairs = Vec::new();
        for s in 0..triangles.len() {
            for t in s + 1..triangles.len() {
                if area(at(s)) != 0.0 && area(at(t)) != 0.0 && common_area(turned(s), turned(t)) > 1e-6 {
                    pairs.push([s as u32, t as u32]);
                }
            }
        }
        prop_assert_eq!(report.overlapping, pairs);
    }
}

#[test]
fn charts_keep_their_distance() {
    let params = UnwrapParams { size: 256, padding: 4, ..SMALL };
    let parts = [
        Shape::Cuboid { half: DVec3::new(1.0, 2.0, 3.0) }.mesh(1),
        moved(Shape::Sphere { radius: 1.0 }.mesh(3), DVec3::X * 9.0, 1.0),
    ];
    let done = sound(&joined(&parts), &params);
    let texel = 1.0 / f64::from(params.size);
    let at = |v: u32| done.uv[v as usize].extend(0.0);
    let mut nearest = f64::INFINITY;
    for (t, corners) in done.mesh.triangles.iter().enumerate() {
        for (other, points) in done.mesh.triangles.iter().enumerate() {
            if done.chart[t] != done.chart[other] {
                let distance = |&p: &u32| Closest::on_triangle(at(p), &corners.map(at), 0).distance();
                nearest = points.iter().map(distance).fold(nearest, f64::min);
            }
        }
    }
    assert!(nearest > (2.0 * f64::from(params.padding) - 1e-3) * texel, "{} texels", nearest / texel);
    let border = done.uv.iter().map(|p| p.min_element().min(1.0 - p.max_element())).fold(1.0, f64::min);
    assert!(border > (f64::from(params.padding) - 1e-3) * texel, "{} texels", border / texel);
}

#[test]
fn tiles_by_number_and_by_density() {
    let mesh = Shape::Torus { major: 3.0, minor: 1.0 }.mesh(4);
    let one = sound(&mesh, &SMALL);
    let four = sound(&mesh, &UnwrapParams { extent: ChartScale::Tiles(4), ..SMALL });
    assert!(four.report.tiles > 1 && four.report.tiles <= 4, "{:?}", four.report);
    assert!(four.report.texels_per_unit > 1.5 * one.report.texels_per_unit, "{:?}", four.report);
    if base::tier::is_thorough() {
        sound(&mesh, &UnwrapParams { size: 16_384, ..SMALL });
    }
    // Each triangle lies in one tile.
    for t in &four.mesh.triangles {
        let middle = t.iter().map(|&v| four.uv[v as usize]).sum::<DVec2>() / 3.0;
        let inside = |v: u32| (four.uv[v as usize] - middle.floor() - 0.5).abs().max_element() <= 0.5;
        assert!(t.iter().all(|&v| inside(v)));
    }
    let wanted = 1.6 * one.report.texels_per_unit;
    let dense = sound(&mesh, &UnwrapParams { extent: ChartScale::TexelsPerUnit(wanted), ..SMALL });
    assert!((dense.report.texels_per_unit / wanted - 1.0).abs() < 0.01 && dense.report.tiles > 1, "{:?}", dense.report);
}

#[test]
fn attributes_ride_along_and_no_number_of_threads_matters() {
    let mut mesh = Shape::Torus { major: 3.0, minor: 1.0 }.mesh(4);
    let numbers = (0..mesh.positions.len() as i32).collect();
    mesh.vertex_attributes.push(Attribute::i32("source_scan", numbers));
    mesh.face_attributes.push(Attribute::bool("hole_fill", vec![true; mesh.triangles.len()]));
    let mut one = sound(&mesh, &SMALL);
    let mut many = sound(&mesh, &UnwrapParams { threads: 7, ..SMALL });
    let sources = one.source.iter().map(|&v| v as i32).collect();
    assert_eq!(one.mesh.vertex_attributes[0], Attribute::i32("source_scan", sources));
    assert_eq!(one.mesh.face_attributes[0], mesh.face_attributes[0]);
    // Those of an earlier run are replaced.
    let again = sound(&one.mesh, &SMALL);
    assert_eq!((again.mesh.vertex_attributes.len(), again.mesh.face_attributes.len()), (4, 2));
    one.report.seconds.clear();
    many.report.seconds.clear();
    assert!(one == many);
}

#[test]
fn it_can_be_cancelled_anywhere() {
    let mesh = Shape::Torus { major: 3.0, minor: 1.0 }.mesh(2);
    let mut checks = 0;
    let mut cancelled = 0;
    while let Err(error) = unwrap(&mesh, &SMALL, &Progress::cancel_after(checks)) {
        assert!(matches!(error, Error::Cancelled), "{error}");
        cancelled += 1;
        checks += 1 + checks / 4;
    }
    assert!(cancelled > 8, "{cancelled}");
}

#[test]
fn what_cannot_be_unwrapped_is_named() {
    let told = |mesh: &TriMesh, params: &UnwrapParams| unwrap(mesh, params, &Progress::none()).unwrap_err().to_string();
    let plane = Shape::Plane { half: DVec2::ONE }.mesh(1);
    assert!(told(&TriMesh::default(), &SMALL).contains("no triangles"));
    assert!(told(&moved(plane.clone(), DVec3::ONE, 0.0), &SMALL).contains("at one point"));
    let mut broken = plane.clone();
    broken.positions[3].y = f64::NAN;
    assert!(told(&broken, &SMALL).contains("vertex 3"));
    assert!(told(&plane, &UnwrapParams { padding: 128, ..SMALL }).contains("less than a quarter"));
    assert!(told(&plane, &UnwrapParams { size: 2, ..SMALL }).contains("size must be"));
    let parts: Vec<TriMesh> = (0..200).map(|i| moved(plane.clone(), DVec3::X * f64::from(3 * i), 1.0)).collect();
    let crowded = told(&joined(&parts), &UnwrapParams { size: 64, padding: 4, ..SMALL });
    assert!(crowded.contains("200 charts") && crowded.contains("1 of 64 x 64 texels"), "{crowded}");
    let dense = |texels| UnwrapParams { extent: ChartScale::TexelsPerUnit(texels), size: 64, ..SMALL };
    let many = told(&joined(&parts), &dense(25.0));
    assert!(many.contains("25 texels per unit need 200 tiles") && many.contains("or larger tiles"), "{many}");
    let large = told(&joined(&parts), &dense(1e4));
    assert!(large.contains("a chart takes 2000") && large.contains("Use larger tiles"), "{large}");
    for texels in [1e-9, 1e39] {
        let told = told(&plane, &dense(texels));
        assert!(told.contains("texels long") && told.contains("10^9"), "{told}");
    }
    let line = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::X * 2.0], vec![[0, 1, 2]]);
    let done = sound(&line, &SMALL);
    assert_eq!((done.report.charts, done.report.collapsed), (0, 1));
}

#[test]
fn a_sculpture() {
    let cell = if base::tier::is_thorough() { 2.5 } else { 9.0 };
    let mesh = scan::sculpture::sculpture(cell, 0, &Progress::none()).unwrap();
    let done = sound(&mesh, &UnwrapParams { size: 1024, ..SMALL });
    assert!(done.report.charts * 2 < done.report.charts_before, "{:?}", done.report);
    assert!(done.report.collapsed < 5, "{:?}", done.report);
    assert!(done.report.used > 0.45 && done.report.stretch_p95 < 1.5, "{:?}", done.report);
}
