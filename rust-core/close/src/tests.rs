//! Whole closings, judged by code that shares nothing with them.

use std::collections::HashSet;
use std::sync::{Arc, Mutex};

use glam::{DVec2, DVec3};

use super::*;
use base::context::{Context, choose};
use base::error::Error;
use base::log::Log;
use base::progress::Progress;
use geom::bvh::Bvh;
use image::range_image::RangeImage;
use image::range_image::test_images::is_past;
use image::source::ScanSource;
use mesh::shapes::Shape;
use mesh::{Attribute, AttributeData, TriMesh, check};
use scan::{ScanParams, VirtualCamera, scan};

/// The triangles of a mesh whose centres are kept, and the vertices that they use.
fn part(mesh: &TriMesh, keep: impl Fn(DVec3) -> bool) -> TriMesh {
    let centre = |t: usize| mesh.corners(t).iter().sum::<DVec3>() / 3.0;
    let kept: Vec<[u32; 3]> =
        (0..mesh.triangles.len()).filter(|&t| keep(centre(t))).map(|t| mesh.triangles[t]).collect();
    let mut number = vec![u32::MAX; mesh.positions.len()];
    let mut positions = Vec::new();
    let triangles = kept
        .iter()
        .map(|t| {
            t.map(|v| {
                if number[v as usize] == u32::MAX {
                    number[v as usize] = positions.len() as u32;
                    positions.push(mesh.positions[v as usize]);
                }
                number[v as usize]
            })
        })
        .collect();
    TriMesh::new(positions, triangles)
}

fn ball(detail: usize) -> TriMesh {
    Shape::Sphere { radius: 1.0 }.mesh(detail)
}

fn params() -> CloseParams {
    CloseParams { threads: 1, ..CloseParams::default() }
}

fn closed(mesh: &TriMesh, visibility: &dyn Visibility, params: &CloseParams) -> Closed {
    let closed = close_seen_by(mesh, visibility, params, &Progress::none()).unwrap();
    kept(mesh, &closed);
    closed
}

/// Holds for every result: a manifold, what was measured to the bit, what was filled marked, the report's figures those of the mesh.
fn kept(mesh: &TriMesh, closed: &Closed) {
    let result = &closed.mesh;
    let report = check(result);
    assert!(report.is_manifold(), "{report}");
    assert_eq!(closed.report.is_closed, report.is_closed());
    assert_eq!(closed.report.open_edges, report.boundary_edges);
    assert_eq!(report.unused_vertices, check(mesh).unused_vertices);
    let bits = |p: &DVec3| p.to_array().map(f64::to_bits);
    assert!(mesh.positions.iter().zip(&result.positions).all(|(a, b)| bits(a) == bits(b)));
    assert_eq!(result.triangles[..mesh.triangles.len()], mesh.triangles[..]);
    let flags = |data: Option<&AttributeData>, first: usize| match data {
        Some(AttributeData::Bool(flags)) => flags.iter().enumerate().all(|(i, &flag)| flag == (i >= first)),
        _ => false,
    };
    assert!(flags(result.vertex_attribute("interpolated"), mesh.positions.len()));
    assert!(flags(result.face_attribute("hole_fill"), mesh.triangles.len()));
    let first = mesh.triangles.len() as u32;
    let pairs = crossing_pairs(result, &Progress::none()).unwrap();
    assert!(pairs.iter().all(|pair| pair[1] < first), "{} pairs cross", pairs.len());
}

/// Range images of a mesh from these places.
fn images(mesh: &TriMesh, eyes: &[DVec3], pixels: usize) -> Vec<RangeImage> {
    let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 1).unwrap();
    let shoot = |&eye: &DVec3| {
        let camera = VirtualCamera::pinhole(pixels, pixels, 0.8, eye, DVec3::ZERO, DVec3::new(0.1, 0.2, 1.0)).unwrap();
        scan(mesh, &bvh, &camera, &ScanParams { backfaces: true, ..ScanParams::default() }, &Progress::none()).unwrap()
    };
    eyes.iter().map(shoot).collect()
}

#[test]
fn the_end_of_a_ball_is_continued_as_a_ball() {
    let open = part(&ball(14), |p| p.z > -0.7);
    let closed = closed(&open, &Blind, &params());
    assert!(closed.report.is_closed);
    assert_eq!(check(&closed.mesh).genus(), Some(0));
    let filled = &closed.mesh.positions[open.positions.len()..];
    let rms = (filled.iter().map(|p| (p.length() - 1.0).powi(2)).sum::<f64>() / filled.len() as f64).sqrt();
    assert!(filled.len() > 20 && rms < 0.02, "{rms}");
    // A flat lid would lie 0.3 off in its middle.
    assert!(filled.iter().any(|p| p.z < -0.96));
    let whole = closed.report.filled_area / closed.report.filled_share;
    assert!((whole - 4.0 * std::f64::consts::PI).abs() < 0.2, "{whole}");
}

/// Half of a hollow ball is seen from inside only. Its wall goes on about as thick as the half that was seen from both sides.
#[test]
fn a_wall_seen_from_inside_does_not_swell() {
    let (outer, inner) = (part(&ball(30), |p| p.z > 0.0), ball(30));
    let first = outer.positions.len() as u32;
    let positions = outer.positions.iter().copied().chain(inner.positions.iter().map(|&p| 0.9 * p)).collect();
    let turned = inner.triangles.iter().map(|&[a, b, c]| [a + first, c + first, b + first]);
    let open = TriMesh::new(positions, outer.triangles.iter().copied().chain(turned).collect());
    let closed = closed(&open, &Blind, &CloseParams { cell: Some(0.02), ..params() });
    assert!(closed.report.is_closed);
    let filled = &closed.mesh.positions[open.positions.len()..];
    let radii = || filled.iter().map(|p| p.length());
    let [least, most] = [radii().fold(f64::INFINITY, f64::min), radii().fold(0.0, f64::max)];
    assert!(filled.len() > 100 && least > 0.9 && most < 1.2, "{} at {least} to {most}", filled.len());
}

#[test]
fn what_stood_on_the_ground_gets_a_flat_foot() {
    let column = Shape::Cylinder { radius: 0.5, half_height: 1.0 }.mesh(10);
    let open = part(&column, |p| p.z > -0.99);
    let lowest = |params: &CloseParams| {
        let closed = closed(&open, &Blind, params);
        assert!(closed.report.is_closed, "{:?}", closed.report.openings);
        closed.mesh.positions.iter().map(|p| p.z).fold(0.0, f64::min)
    };
    let cell = Some(0.06);
    assert!(lowest(&CloseParams { cell, ..params() }) < -1.1);
    let flat = lowest(&CloseParams { cell, flat_base: true, ..params() });
    assert!(flat > -1.02, "{flat}");
    let deep = lowest(&CloseParams { cell, flat_base: true, base_depth: 0.3, ..params() });
    assert!(deep > -1.32 && deep < -1.2, "{deep}");
    let too_deep = CloseParams { cell, flat_base: true, base_depth: 7.0, ..params() };
    let error = close_seen_by(&open, &Blind, &too_deep, &Progress::none()).unwrap_err().to_string();
    assert!(error.starts_with("base_depth is 7, but the longest side of the surface is "), "{error}");
}

#[test]
fn a_hole_with_an_island_is_closed_as_one() {
    let open = part(&ball(16), |p| p.z > -0.5 || p.z < -0.9);
    assert_eq!(check(&open).boundary_loops, 2);
    let closed = closed(&open, &Blind, &params());
    assert!(closed.report.is_closed);
    assert_eq!(check(&closed.mesh).components, 1);
    assert_eq!(closed.report.openings.len(), 1, "{:?}", closed.report.openings);
    assert_eq!(closed.report.openings[0].vertices.len(), 2);
}

#[test]
fn two_shells_are_closed_each() {
    let mut both = part(&ball(12), |p| p.z > -0.8);
    let inner = part(&ball(12), |p| p.x < 0.8);
    let first = both.positions.len() as u32;
    both.positions.extend(inner.positions.iter().map(|p| 0.5 * *p));
    // The inside of a hollow ball faces its middle.
    both.triangles.extend(inner.triangles.iter().map(|&[a, b, c]| [a, c, b].map(|v| v + first)));
    let closed = closed(&both, &Blind, &params());
    let report = check(&closed.mesh);
    assert!(report.is_closed() && report.components == 2 && report.genus() == Some(0), "{report}");
    let volume = mesh::measure::enclosed_volume(&closed.mesh);
    assert!((volume - 4.19 * 0.875).abs() < 0.2, "{volume}");
}

#[test]
fn holes_are_closed_up_to_their_length() {
    let open = part(&ball(16), |p| p.z > -0.9 && p.z < 0.6);
    let holes = CloseParams { openings: Openings::Holes, max_hole_length: Some(4.0), ..params() };
    let closed = closed(&open, &Blind, &holes);
    assert_eq!(check(&closed.mesh).boundary_loops, 1);
    let left: Vec<LeftOpen> = closed.report.left_open().map(|left| left.1).collect();
    assert_eq!(left, [LeftOpen::TooLong]);
    let filled = &closed.mesh.positions[open.positions.len()..];
    assert!(filled.iter().all(|p| p.z < 0.0));
}

#[test]
fn none_leaves_all_open_and_says_so() {
    let open = part(&ball(8), |p| p.z > -0.5);
    let closed = closed(&open, &Blind, &CloseParams { openings: Openings::None, ..params() });
    assert_eq!((closed.mesh.positions.len(), closed.report.added), (open.positions.len(), [0, 0]));
    assert_eq!(closed.report.left_open().map(|left| left.1).collect::<Vec<_>>(), [LeftOpen::NotAsked]);
}

/// Bowl, relief and the walls of a room: no scan saw round their rims.
#[test]
fn shapes_open_by_intent_stay_open_and_pockets_close() {
    let seen = CloseParams { openings: Openings::Seen, cell: Some(0.12), merge_distance: Some(0.12), ..params() };
    let sheet = part(&Shape::Plane { half: DVec2::splat(1.0) }.mesh(12), |_| true);
    let mut relief = sheet.clone();
    relief.positions.iter_mut().for_each(|p| p.z = 0.15 * (3.0 * p.x).sin() * (2.0 * p.y).cos());
    let bowl = {
        let mut inside = part(&ball(12), |p| p.z < 0.0);
        inside.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        inside
    };
    let room = {
        let mut walls = part(&Shape::Cuboid { half: DVec3::ONE }.mesh(8), |p| p.z < 0.95);
        walls.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        walls
    };
    for (name, mesh, eye) in [
        ("relief", &relief, DVec3::new(0.3, 0.2, 4.0)),
        ("bowl", &bowl, DVec3::new(0.2, 0.0, 4.0)),
        ("room", &room, DVec3::new(0.1, 0.2, 4.5)),
    ] {
        let scans = images(mesh, &[eye, eye + DVec3::X], 120);
        let visibility = Scans::of_images(&scans, &Progress::none()).unwrap();
        // A hole in its middle is a pocket that the scans surround.
        let holed = part(mesh, |p| p.truncate().length() > 0.3 || p.z > 0.9);
        let closed = closed(&holed, &visibility, &seen);
        assert_eq!(check(&closed.mesh).boundary_loops, 1, "{name}: {:?}", closed.report.openings);
        let left: Vec<LeftOpen> = closed.report.left_open().map(|left| left.1).collect();
        assert_eq!(left, [LeftOpen::NotEnclosed], "{name}");
    }
}

#[test]
fn nothing_is_filled_where_a_ray_went_on() {
    // Through the ring's hole and past its sides scans see a wall; its lower half was not scanned.
    let ring = Shape::Torus { major: 1.0, minor: 0.35 }.mesh(10);
    let mut scene = ring.clone();
    let first = scene.positions.len() as u32;
    let wall = Shape::Plane { half: DVec2::splat(6.0) }.mesh(4);
    scene.positions.extend(wall.positions.iter().map(|p| *p - 1.5 * DVec3::Z));
    scene.triangles.extend(wall.triangles.iter().map(|t| t.map(|v| v + first)));
    let eyes = [DVec3::new(0.0, 0.0, 5.0), DVec3::new(2.0, 0.5, 4.5), DVec3::new(-2.0, 1.0, 4.5)];
    let scans = images(&scene, &eyes, 160);
    let visibility = Scans::of_images(&scans, &Progress::none()).unwrap();
    let open = part(&ring, |p| p.z > -0.1);
    let (cell, distance) = (0.1, 0.1);
    let given = CloseParams { cell: Some(cell), merge_distance: Some(distance), ..params() };
    let closed = closed(&open, &visibility, &given);
    assert!(closed.report.is_closed, "{:?}", closed.report.openings);
    // The scans themselves say the same, in any order.
    let sources: Vec<&dyn ScanSource> = scans.iter().rev().map(|scan| scan as &dyn ScanSource).collect();
    let by_scans = close(&open, &sources, &given, &Progress::none()).unwrap();
    assert!(by_scans.report.has_sight && by_scans.mesh == closed.mesh);
    let past = |place: DVec3| scans.iter().any(|image| is_past(image, place, distance + 0.5 * cell));
    let mut asked = 0;
    for t in open.triangles.len()..closed.mesh.triangles.len() {
        let [a, b, c] = closed.mesh.corners(t);
        for place in [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0] {
            asked += 1;
            assert!(!past(place), "triangle {t} at {place}");
        }
    }
    assert!(asked > 500);
    // The twin and the lines of sight agree on what is seen.
    let mut both = [0; 2];
    for i in 0..4000_u32 {
        let at = |step: u32| f64::from(i * step % 997) / 997.0 * 4.0 - 2.0;
        let place = DVec3::new(at(17), at(291), 0.4 * at(611));
        let seen = visibility.is_empty_at(place, distance);
        both[usize::from(seen)] += 1;
        assert_eq!(seen, scans.iter().any(|image| is_past(image, place, distance)), "{place}");
    }
    assert!(both[0] > 200 && both[1] > 200, "{both:?}");
}

/// Says that nothing is below a height.
struct Below(f64);

impl Visibility for Below {
    fn is_empty_at(&self, place: DVec3, tolerance: f64) -> bool {
        place.z < self.0 - tolerance
    }
}

/// The stages by themselves: each keeps the fill out of seen space, whatever the others do.
#[test]
fn field_and_fill_keep_out_of_seen_space_each() {
    let open = part(&ball(12), |p| p.z > -0.6);
    let progress = Progress::none();
    let surface = surface::Surface::new(&open, 1, &progress).unwrap();
    let cell = 0.05;
    let (lo, hi) = mesh::measure::bounds(&open.positions).unwrap();
    let extent = field::Extent::new(lo - 0.4 * DVec3::Z, hi, 2.0 * cell);
    let lowest = |visibility: &dyn Visibility| {
        let envelope = visibility::Envelope { visibility, tolerance: 0.0 };
        let (nodes, values) = field::solve(&surface, &extent, envelope, &progress).unwrap();
        let inside = (0..nodes.len()).filter(|&node| values[node] < 0.0).map(|node| nodes.place(node).z);
        inside.fold(0.0, f64::min)
    };
    assert!(lowest(&Blind) < -0.85);
    assert!(lowest(&Below(-0.8)) >= -0.8);
    let lid = part(&ball(12), |p| p.z < -0.65);
    let mut growing = stitch::Growing::new(&surface, &lid);
    let envelope = visibility::Envelope { visibility: &Below(-0.9), tolerance: 0.0 };
    let seen = |growing: &stitch::Growing| {
        retreat::in_seen_space(growing, envelope, cell, retreat::NearMeasured::Passed, &progress)
            .unwrap()
            .iter()
            .filter(|seen| **seen)
            .count()
    };
    assert!(seen(&growing) > 20);
    retreat::retreat(&mut growing, envelope, cell, &progress).unwrap();
    assert_eq!(seen(&growing), 0);
    assert!(growing.positions[..open.positions.len()] == open.positions[..]);
}

/// The grid lies around openings: a naive twin on all nodes agrees, and a finer surface around the same hole takes no more of them.
#[test]
fn the_field_around_openings_is_that_on_all_nodes() {
    let progress = Progress::none();
    let envelope = visibility::Envelope { visibility: &Below(-0.97), tolerance: 0.0 };
    let open = part(&ball(24), |p| p.z > -0.8);
    let surface = surface::Surface::new(&open, 1, &progress).unwrap();
    let (lo, hi) = mesh::measure::bounds(&open.positions).unwrap();
    let extent = field::Extent::new(lo - 0.2 * DVec3::Z, hi, 0.05);
    let (nodes, values) = field::solve(&surface, &extent, envelope, &progress).unwrap();
    let (all, twin) = field::solve_around(&surface, &extent, 1000, envelope, &progress).unwrap();
    assert_eq!(all.len(), all.grid.len());
    assert!(6 * nodes.len() < all.len(), "{} of {}", nodes.len(), all.len());
    let mut compared = 0;
    for number in 0..nodes.len() {
        let [i, j, k] = nodes.node(number).map(|i| i as usize);
        let of_all = twin[all.grid.index([i, j, k])];
        if of_all.abs() < nodes.grid.cell && nodes.place(number).z < -0.8 {
            compared += 1;
            assert!((values[number] - of_all).abs() < 0.02 * nodes.grid.cell, "{} {of_all}", values[number]);
        }
    }
    assert!(compared > 100, "{compared}");
}

/// A loop that lies so that its least triangulation is seen through is closed by a fan around a vertex farther inside.
#[test]
fn small_loops_are_closed_by_fans_out_of_seen_space() {
    let open = part(&ball(8), |p| p.z > -0.9);
    let progress = Progress::none();
    let surface = surface::Surface::new(&open, 1, &progress).unwrap();
    let empty = TriMesh::default();
    let closes = |visibility: &dyn Visibility| {
        let mut growing = stitch::Growing::new(&surface, &empty);
        let envelope = visibility::Envelope { visibility, tolerance: 0.0 };
        fan::close_loops(&mut growing, Some(envelope), 0.1, &progress).unwrap();
        let result = TriMesh::new(growing.positions, growing.triangles);
        let deepest = result.positions[open.positions.len()..].iter().map(|p| p.z).fold(-1.0, f64::max);
        (check(&result).is_closed(), deepest)
    };
    let (is_closed, free) = closes(&Blind);
    assert!(is_closed);
    struct Middle;
    impl Visibility for Middle {
        fn is_empty_at(&self, place: DVec3, _: f64) -> bool {
            place.truncate().length() < 0.2 && place.z < -0.84
        }
    }
    let (is_closed, moved) = closes(&Middle);
    assert!(is_closed && moved > free + 0.02, "{free} {moved}");
    assert!(!closes(&Below(1.0)).0);
}

/// A box whose upper side has a wide opening, through which a spike stands. Each fill without new vertices, and a fan around the middle, meet
/// the spike, and the loop has more edges than a fan may.
#[test]
fn a_long_loop_around_an_obstacle_is_closed_in_parts() {
    let mut open =
        part(&Shape::Cuboid { half: DVec3::ONE }.mesh(24), |p| p.z < 0.99 || p.x.abs().max(p.y.abs()) > 0.75);
    let first = open.positions.len() as u32;
    let spike = [[0.1, 0.0, 0.8], [-0.1, 0.1, 0.8], [-0.1, -0.1, 0.8], [0.0, 0.0, 1.2]];
    open.positions.extend(spike.map(DVec3::from));
    open.triangles.extend([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(|t| t.map(|v: u32| v + first)));
    let report = check(&open);
    assert!(report.is_manifold() && report.boundary_loops == 1 && report.boundary_edges > 64, "{report}");
    let progress = Progress::none();
    let surface = surface::Surface::new(&open, 1, &progress).unwrap();
    let mut growing = stitch::Growing::new(&surface, &TriMesh::default());
    growing.close_loops(&progress).unwrap();
    assert_eq!(growing.triangles.len(), open.triangles.len());
    fan::close_loops(&mut growing, None, 0.1, &progress).unwrap();
    let result = TriMesh::new(growing.positions, growing.triangles);
    assert!(check(&result).is_closed(), "{}", check(&result));
    assert!(crossing_pairs(&result, &progress).unwrap().is_empty());
    assert_eq!(result.triangles[..open.triangles.len()], open.triangles[..]);
}

/// Says of a ball around the south pole that it is empty, whatever anybody measured.
struct Contradicting;

impl Visibility for Contradicting {
    fn is_empty_at(&self, place: DVec3, tolerance: f64) -> bool {
        place.distance(DVec3::new(0.0, 0.0, -1.0)) < 0.9 - tolerance
    }
}

#[test]
fn what_was_seen_through_is_not_closed_but_by_force() {
    let open = part(&ball(12), |p| p.z > -0.9);
    let careful = closed(&open, &Contradicting, &params());
    let first = open.triangles.len();
    let sees = |closed: &Closed| {
        let tolerance = closed.report.merge_distance + 0.5 * closed.report.cell;
        let centre = |t: usize| closed.mesh.corners(t).iter().sum::<DVec3>() / 3.0;
        (first..closed.mesh.triangles.len()).filter(|&t| Contradicting.is_empty_at(centre(t), tolerance)).count()
    };
    assert_eq!(sees(&careful), 0);
    assert!(!careful.report.is_closed);
    assert_eq!(careful.report.left_open().map(|left| left.1).collect::<Vec<_>>(), [LeftOpen::SeenThrough]);
    let forced = closed(&open, &Contradicting, &CloseParams { force: true, ..params() });
    assert!(forced.report.is_closed, "{:?}", forced.report.openings);
    let Some(AttributeData::Bool(flags)) = forced.mesh.face_attribute("forced") else {
        panic!("forced faces are marked")
    };
    let marked = flags.iter().filter(|flag| **flag).count();
    assert!(marked > 0 && sees(&forced) > 0 && flags[..first].iter().all(|flag| !flag));
    assert_eq!(forced.report.openings[0].forced_faces, marked);
    let tolerance = forced.report.merge_distance + 0.5 * forced.report.cell;
    let is_seen = |t: usize| forced.mesh.corners(t).iter().any(|place| Contradicting.is_empty_at(*place, tolerance));
    assert!((first..forced.mesh.triangles.len()).all(|t| flags[t] || !is_seen(t)), "each face in seen space is marked");
}

#[test]
fn the_same_bytes_come_from_any_number_of_threads() {
    let open = part(&ball(12), |p| p.z > -0.6 && p.x < 0.9);
    let scans = images(&ball(12), &[DVec3::new(0.0, 3.0, 3.0), DVec3::new(3.0, -3.0, 1.0)], 100);
    let visibility = Scans::of_images(&scans, &Progress::none()).unwrap();
    let of = |threads: usize| closed(&open, &visibility, &CloseParams { threads, ..CloseParams::default() }).mesh;
    let one = of(1);
    assert!(one == of(2) && one == of(3));
}

#[test]
fn it_can_be_cancelled_at_every_check() {
    let open = part(&ball(6), |p| p.z > -0.5);
    let mut checks = 1;
    let mut cancelled = 0;
    while matches!(close_seen_by(&open, &Blind, &params(), &Progress::cancel_after(checks)), Err(Error::Cancelled)) {
        cancelled += 1;
        checks = checks * 5 / 4 + 1;
    }
    assert!(cancelled > 15, "{cancelled}");
    let whole = close_seen_by(&open, &Blind, &params(), &Progress::cancel_after(checks)).unwrap();
    assert_eq!(whole.mesh, close_seen_by(&open, &Blind, &params(), &Progress::none()).unwrap().mesh);
}

#[test]
fn the_solver_hears_that_it_is_cancelled() {
    let solving = "solving for the fill";
    let progress = Progress::new(|tick| match tick.stage == solving {
        true => std::ops::ControlFlow::Break(()),
        false => std::ops::ControlFlow::Continue(()),
    });
    let open = part(&ball(24), |p| p.z > -0.6);
    let fine = CloseParams { cell: Some(0.03), ..params() };
    assert!(matches!(close_seen_by(&open, &Blind, &fine, &progress), Err(Error::Cancelled)));
    assert!(progress.seconds().iter().all(|lap| lap.0 != solving), "it solved to the end: {:?}", progress.seconds());
}

#[test]
fn attributes_are_continued() {
    let mut open = part(&ball(8), |p| p.z > -0.6);
    let n = open.positions.len();
    open.vertex_attributes = vec![
        Attribute::colour("colour", vec![[10, 20, 30, 255]; n]),
        Attribute::f32("confidence", vec![0.5; n]),
        Attribute::i32("source_scan", vec![3; n]),
        Attribute::bool("interpolated", vec![false; n]),
    ];
    let closed = closed(&open, &Blind, &params()).mesh;
    closed.validate().unwrap();
    let Some(AttributeData::Colour(colours)) = closed.vertex_attribute("colour") else { panic!() };
    assert!(colours[..n].iter().all(|c| c[3] == 255) && colours[n..].iter().all(|&c| c == [10, 20, 30, 0]));
    let Some(AttributeData::I32(scans)) = closed.vertex_attribute("source_scan") else { panic!() };
    assert!(scans[..n].iter().all(|&s| s == 3) && scans[n..].iter().all(|&s| s == -1));
}

#[test]
fn degenerate_inputs_are_named_or_closed() {
    let refused = |mesh: &TriMesh, part: &str| {
        let text = close_seen_by(mesh, &Blind, &params(), &Progress::none()).unwrap_err().to_string();
        assert!(text.contains(part), "{text}");
    };
    refused(&TriMesh::default(), "no triangles");
    let triangle = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]);
    refused(&TriMesh::new(triangle.positions.clone(), vec![[0, 1, 3]]), "vertex 3");
    refused(&TriMesh::new(triangle.positions.clone(), vec![[0, 1, 2], [0, 1, 2]]), "duplicate");
    refused(&TriMesh::new(vec![DVec3::NAN, DVec3::X, DVec3::Y], vec![[0, 1, 2]]), "not finite");
    let text = close_seen_by(&triangle, &Blind, &CloseParams { cell: Some(-1.0), ..params() }, &Progress::none());
    assert!(text.unwrap_err().to_string().contains("cell must be"));
    // One triangle, a flat sheet, a sliver, a vertex nobody uses, one that is closed already; far away and tiny.
    closed(&triangle, &Blind, &params());
    closed(&Shape::Plane { half: DVec2::ONE }.mesh(3), &Blind, &params());
    closed(&TriMesh::new(vec![DVec3::ZERO, DVec3::X, 1e-9 * DVec3::Y], vec![[0, 1, 2]]), &Blind, &params());
    let mut lonely = part(&ball(5), |p| p.z > -0.6);
    lonely.positions.push(DVec3::splat(0.3));
    closed(&lonely, &Blind, &params());
    let whole = closed(&ball(4), &Blind, &params());
    assert_eq!((whole.report.added, whole.report.is_closed), ([0, 0], true));
    for scale in [1e-12, 1e12] {
        let mut scaled = part(&ball(6), |p| p.z > -0.6);
        scaled.positions.iter_mut().for_each(|p| *p = (*p + 3.0) * scale);
        assert!(closed(&scaled, &Blind, &params()).report.is_closed, "{scale}");
    }
}

#[test]
fn every_loop_is_in_the_report() {
    let open = part(&ball(14), |p| p.abs().max_element() < 0.93);
    let loops = check(&open).boundary_loops;
    let closed = closed(&open, &Blind, &params());
    let named: HashSet<u32> = closed.report.openings.iter().flat_map(|opening| opening.vertices.clone()).collect();
    assert_eq!(named.len(), loops);
    assert!(closed.report.is_closed && closed.report.closed == 6);
}

/// Takes half a minute.
#[test]
fn fills_that_are_stuck_are_tried_in_other_cells() {
    if !base::tier::is_thorough() {
        return;
    }
    let shape = scan::sculpture::sculpture(4.0, 0, &Progress::none()).unwrap();
    let (lo, hi) = mesh::measure::bounds(&shape.positions).unwrap();
    let mut state = 30_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    };
    // Holes where balls meet the sculpture.
    let balls: Vec<(DVec3, f64)> =
        (0..12).map(|_| (lo + (hi - lo) * DVec3::new(next(), next(), next()), 10.0 + 20.0 * next())).collect();
    let open = part(&shape, |p| p.z > lo.z + 6.0 && balls.iter().all(|(centre, r)| p.distance(*centre) > *r));
    let params = CloseParams { flat_base: true, ..params() };
    let once = attempts::run(&open, &Blind, &params, &[1.0], &Progress::none()).unwrap();
    let more = closed(&open, &Blind, &params);
    assert!(more.report.open_edges < once.report.open_edges, "{:?}", [more.report.open_edges, once.report.open_edges]);
    assert_eq!(more.report.closed + more.report.left.iter().sum::<usize>(), more.report.openings.len());
}

/// The result of a call, and the warnings that were told during it.
fn heard<T: Send>(call: impl FnOnce() -> base::error::Result<T>) -> (base::error::Result<T>, Vec<String>) {
    let heard = Arc::new(Mutex::new(Vec::new()));
    let (listener, context) = (heard.clone(), Context::new().unwrap());
    context.set_log(Log::To(Arc::new(move |_, text: &str| listener.lock().unwrap().push(text.to_owned()))));
    choose(Some(context));
    let result = base::memory::guarded(call);
    choose(None);
    let texts = heard.lock().unwrap().clone();
    (result, texts)
}

#[test]
fn scans_that_lie_elsewhere_are_told() {
    let open = part(&ball(12), |p| p.z > -0.6);
    let near = images(&ball(12), &[DVec3::new(0.0, 1.0, 4.0)], 60).remove(0);
    let mut far = near.clone();
    far.world_from_sensor.translation += 50.0 * DVec3::X;
    let run = |scans: &[&RangeImage]| {
        let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| *scan as &dyn ScanSource).collect();
        heard(|| close(&open, &sources, &params(), &Progress::none()))
    };
    assert!(run(&[&near]).1.is_empty());
    let (both, told) = run(&[&near, &far]);
    assert!(both.is_ok() && told.len() == 1 && told[0].contains("this scan does not meet the surface"), "{told:?}");
    let refused = run(&[&far]).0.unwrap_err().to_string();
    assert!(refused.starts_with("no scan meets the surface: ") && refused.contains("lies around (50"), "{refused}");
}

#[test]
fn surfaces_that_are_inside_out_are_told() {
    let open = part(&ball(12), |p| p.z > -0.6);
    let mut turned = open.clone();
    turned.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let scans = images(&ball(12), &[DVec3::new(0.0, 1.0, 4.0), DVec3::new(3.0, 0.0, 3.0)], 80);
    let scans = Scans::of_images(&scans, &Progress::none()).unwrap();
    for (visibility, begin) in [
        (&Blind as &dyn Visibility, "the surface looks toward its own middle: "),
        (&scans, "the surface seems to be inside out: "),
    ] {
        let told = |mesh: &TriMesh| heard(|| close_seen_by(mesh, visibility, &params(), &Progress::none())).1;
        assert_eq!(told(&open), Vec::<String>::new());
        assert!(told(&turned).len() == 1 && told(&turned)[0].starts_with(begin), "{:?}", told(&turned));
    }
}

/// Scans saw through on both sides of thin walls. The few faces beside which they did on one side alone decide nothing.
#[test]
fn thin_walls_are_not_said_to_be_inside_out() {
    for apart in [0.05, 0.1, 0.15, 0.2] {
        let plate = sheets(24, apart);
        let eyes = [(1.0, 0.7, 4.0), (-1.0, -0.7, 4.0), (1.0, -0.7, -4.0), (-1.0, 0.7, -4.0)].map(DVec3::from);
        let scans = Scans::of_images(&images(&plate, &eyes, 120), &Progress::none()).unwrap();
        let told = heard(|| close_seen_by(&plate, &scans, &params(), &Progress::none())).1;
        assert_eq!(told, Vec::<String>::new(), "{apart}");
    }
}

#[test]
fn parameters_without_use_are_refused() {
    let open = part(&ball(8), |p| p.z > -0.5);
    let refused = |given: CloseParams| close(&open, &[], &given, &Progress::none()).unwrap_err().to_string();
    let longest = refused(CloseParams { max_hole_length: Some(1.0), ..params() });
    assert!(longest.starts_with("max_hole_length is given, but has no use unless openings are holes"), "{longest}");
    let force = refused(CloseParams { force: true, ..params() });
    assert!(force.starts_with("force is given, but has no use without scans"), "{force}");
    assert!(refused(CloseParams { base_up: UpAxis::X, ..params() }).starts_with("base_up is given without flat_base"));
    assert!(refused(CloseParams { base_depth: 0.1, ..params() }).starts_with("base_depth is given without flat_base"));
}

/// A plate of bumps, which faces up.
fn relief(side: usize, height: impl Fn(f64, f64) -> f64) -> TriMesh {
    let at = |i: usize| 2.0 * i as f64 / (side - 1) as f64 - 1.0;
    let place = |i: usize, j: usize| DVec3::new(at(i), at(j), height(at(i), at(j)));
    let positions = (0..side * side).map(|n| place(n / side, n % side)).collect();
    let quads = (0..side - 1).flat_map(|i| (0..side - 1).map(move |j| (i * side + j) as u32));
    let n = side as u32;
    TriMesh::new(positions, quads.flat_map(|a| [[a, a + n, a + n + 1], [a, a + n + 1, a + 1]]).collect())
}

/// Nothing behind a surface has room over a base in its lowest places. Its fill would lie before it.
#[test]
fn no_fill_turns_a_surface_inside_out() {
    for (side, height) in [(12, 0.1), (12, -0.1), (12, 0.3), (40, 0.1), (40, -0.1), (40, 0.0)] {
        let bumps = relief(side, |x, y| height * (3.0 * x).cos() * (3.0 * y).cos());
        for base_depth in [0.0, 0.3] {
            let params = CloseParams { flat_base: true, base_depth, ..params() };
            let closed = closed(&bumps, &Blind, &params);
            let volume = mesh::measure::enclosed_volume(&closed.mesh);
            assert!(!closed.report.is_closed || volume > 0.0, "{side} {height} {base_depth}: {volume}");
            let left: Vec<LeftOpen> = closed.report.left_open().map(|left| left.1).collect();
            assert!(closed.report.is_closed || left == [LeftOpen::Base], "{side} {height} {base_depth}: {left:?}");
            assert!(closed.report.is_closed || base_depth == 0.0, "{side} {height}");
            // The depth that the text asks for is enough.
            if let Some(place) = closed.report.open.first().filter(|_| side == 12 || height == 0.0) {
                let words: Vec<&str> = place.text.split(' ').collect();
                let depth = words[words.len() - 2].parse().unwrap();
                let deep_enough = CloseParams { base_depth: depth, ..params };
                let report = self::closed(&bumps, &Blind, &deep_enough).report;
                assert!(report.is_closed, "{side} {height}: {:?}", report.open);
            }
            // All that looks down lies on the base, as floats say.
            let base = bumps.positions.iter().map(|p| p.z).fold(f64::INFINITY, f64::min) - base_depth;
            let down = (0..closed.mesh.triangles.len()).map(|t| closed.mesh.corners(t)).filter(|corners| {
                let [a, b, c] = *corners;
                (b - a).cross(c - a).normalize_or_zero().z < -0.95
            });
            let [on, off] = down.fold([0.0; 2], |mut areas, corners| {
                areas[usize::from(corners.iter().any(|p| p.z != base))] += mesh::measure::area(corners);
                areas
            });
            assert!(base_depth == 0.0 || off <= 0.06 * on, "{side} {height} {base_depth}: {off} beside {on}");
        }
    }
    // Two sheets far nearer to each other than a cell.
    let closed = closed(&sheets(12, 0.04), &Blind, &params());
    assert!(!closed.report.is_closed || mesh::measure::enclosed_volume(&closed.mesh) > 0.0);
    assert!(closed.report.left_open().all(|left| matches!(left.1, LeftOpen::InsideOut | LeftOpen::Crossing)));
    // The inside of a ball is one.
    let bowl = part(&ball(12), |p| p.z < 0.5);
    let inside = TriMesh::new(bowl.positions, bowl.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect());
    assert!(closed_without_scans(&inside).report.is_closed);
}

/// Two sheets that face away from each other.
fn sheets(side: usize, apart: f64) -> TriMesh {
    let up = relief(side, |_, _| 0.5 * apart);
    let mut both = TriMesh::new(up.positions.clone(), up.triangles.clone());
    both.positions.extend(up.positions.iter().map(|p| p.with_z(-p.z)));
    let first = up.positions.len() as u32;
    both.triangles.extend(up.triangles.iter().map(|&[a, b, c]| [a, c, b].map(|v| v + first)));
    both
}

/// Cells fit into the walls that are to be closed: a plate as thick as a cell of the fill, and thinner ones.
#[test]
fn thin_plates_are_closed() {
    let edge = sheets(40, 1.0).median_edge();
    for cells in [0.35, 0.6, 0.8, 1.0, 1.5, 2.0] {
        let plate = sheets(40, cells * 2.0 * edge);
        let closed = closed(&plate, &Blind, &CloseParams { cell: Some(edge), ..params() });
        let volume = mesh::measure::enclosed_volume(&closed.mesh);
        let expected = 4.0 * cells * 2.0 * edge;
        assert!(closed.report.is_closed && (volume / expected - 1.0).abs() < 0.2, "{cells}: {volume} of {expected}");
    }
}

fn closed_without_scans(mesh: &TriMesh) -> Closed {
    closed(mesh, &Blind, &params())
}

#[test]
fn triangles_that_hang_together_nowhere_are_refused() {
    let ball = ball(4);
    let positions = ball.triangles.iter().flatten().map(|&v| ball.positions[v as usize]).collect();
    let loose = (0..ball.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let error = close(&TriMesh::new(positions, loose), &[], &params(), &Progress::none()).unwrap_err();
    assert!(error.to_string().contains("merge vertices at one place first"), "{error}");
}

#[test]
fn a_cell_of_another_unit_is_refused() {
    let params = CloseParams { cell: Some(1e-9), ..params() };
    let error = close_seen_by(&part(&ball(8), |p| p.z < 0.5), &Blind, &params, &Progress::none()).unwrap_err();
    assert!(error.to_string().starts_with("cell is 1e-9, but the median edge of the surface is "), "{error}");
}

/// Crumbs of a few triangles beside a ball, also right before it: bodies of some volume, not folded sheets.
#[test]
fn crumbs_become_bodies() {
    let open = part(&ball(8), |p| p.z < 0.6);
    for (count, distance) in [(1, 3.0), (2, 3.0), (4, 3.0), (1, 1.01), (2, 1.01)] {
        let mut mesh = TriMesh::new(open.positions.clone(), open.triangles.clone());
        let crumb = relief(3, |_, _| 0.0);
        let kept = TriMesh::new(crumb.positions, crumb.triangles[..count].to_vec());
        let kept = part(&kept, |_| true);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(kept.positions.iter().map(|p| DVec3::new(distance, 0.1 * p.x, 0.1 * p.y)));
        mesh.triangles.extend(kept.triangles.iter().map(|t| t.map(|v| v + first)));
        let params = CloseParams { cell: Some(0.1), ..params() };
        for params in [params, CloseParams { flat_base: true, ..params }] {
            let closed = closed(&mesh, &Blind, &params);
            assert!(closed.report.is_closed, "{count}: {:?}", closed.report.open);
            let bodies = bodies::Bodies::new(&closed.mesh, true, &Progress::none()).unwrap().list;
            let is_solid = |body: &bodies::Body| body.volume > 1e-3 * body.area.powf(1.5);
            assert!(bodies.len() == 2 && bodies.iter().all(is_solid), "{count}: {bodies:?}");
        }
    }
}
