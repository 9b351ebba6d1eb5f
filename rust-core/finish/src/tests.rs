//! A pebble with known colours, an opening and a crumb.

use glam::{DAffine3, DMat3, DVec3};

use base::progress::Progress;
use base::{Error, Result};
use close::Openings;
use image::frame::Camera;
use image::photo::{Photo, PhotoInMemory, Pixels};
use mesh::shapes::Shape;
use mesh::{Attribute, AttributeData, TriMesh, check, measure, texture};

use crate::{FinishParams, Finished, Lightness, finish};

const RED: [u8; 3] = [200, 30, 30];

fn waves(p: DVec3) -> [u8; 4] {
    let of = |x: f64| (128.0 + 80.0 * (x * 1.7).sin()) as u8;
    [of(p.x + p.z), of(p.y - 0.4 * p.z), of(p.z + 0.5 * p.x), 255]
}

/// Without its foot, and with a crumb beside it.
fn pebble() -> TriMesh {
    let mut mesh = Shape::Sphere { radius: 1.0 }.mesh(5);
    let bump = |p: DVec3| 1.0 + 0.1 * (4.0 * p.x).sin() * (5.0 * p.y + 1.0).sin();
    mesh.positions.iter_mut().for_each(|p| *p *= bump(*p));
    let positions = mesh.positions.clone();
    mesh.triangles.retain(|corners| corners.iter().any(|&v| positions[v as usize].z > -0.8));
    let first = mesh.positions.len() as u32;
    let crumb = [[3.0, 0.0, 0.0], [3.1, 0.0, 0.0], [3.0, 0.1, 0.0], [3.0, 0.0, 0.1]].map(DVec3::from);
    mesh.positions.extend(crumb);
    mesh.triangles.extend([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]].map(|corners| corners.map(|v| first + v)));
    let colours = mesh.positions.iter().map(|&p| waves(p)).collect();
    mesh.vertex_attributes =
        vec![Attribute::colour("colour", colours), Attribute::f32("confidence", vec![1.0; mesh.positions.len()])];
    mesh
}

fn params() -> FinishParams {
    FinishParams {
        lightness: Lightness::Triangles(400),
        texture: 128,
        padding: 2,
        threads: 1,
        ..FinishParams::default()
    }
}

fn finished(mesh: &TriMesh, photos: &[PhotoInMemory], params: &FinishParams) -> Result<Finished> {
    let photos: Vec<&dyn Photo> = photos.iter().map(|photo| photo as &dyn Photo).collect();
    finish(mesh, &[], &photos, params, &Progress::none())
}

/// From above, red all over.
fn red_photo() -> PhotoInMemory {
    let size = [90, 80];
    PhotoInMemory {
        name: "red".into(),
        camera: Camera::sized([80.0; 2], [44.5, 39.5], size),
        world_from_camera: DAffine3 {
            matrix3: DMat3::from_cols(DVec3::X, -DVec3::Y, -DVec3::Z),
            translation: DVec3::new(0.0, 0.0, 4.0),
        },
        pixels: Pixels { size, colours: vec![RED; size[0] * size[1]] },
        depths: None,
    }
}

/// Texels in the middle of the triangles: their colours and their places on the mesh.
fn middles(level: &crate::TexturedLevel) -> Vec<([u8; 3], DVec3)> {
    let [s, t] = texture::coordinates(&level.mesh).unwrap();
    let size = level.images.size;
    let of = |(number, corners): (usize, &[u32; 3])| {
        let mean = |of: &[f32]| corners.iter().map(|&v| f64::from(of[v as usize])).sum::<f64>() / 3.0;
        let [column, row] = [mean(s), 1.0 - mean(t)].map(|at| ((at * f64::from(size)) as u32).min(size - 1));
        let middle = level.mesh.corners(number).iter().sum::<DVec3>() / 3.0;
        (level.images.tiles[0].colour[(row * size + column) as usize], middle)
    };
    level.mesh.triangles.iter().enumerate().map(of).collect()
}

fn apart(a: [u8; 3], b: &[u8]) -> u8 {
    (0..3).map(|k| a[k].abs_diff(b[k])).max().unwrap_or(0)
}

#[test]
fn a_light_model_shows_the_colours_of_the_surface() {
    let mesh = pebble();
    let made = finished(&mesh, &[], &FinishParams { levels: 3, occlusion_rays: 4, ..params() }).unwrap();
    assert_eq!((made.report.dropped_components, made.levels.len()), ([1, 4], 3));
    assert_eq!(made.detail.triangles.len() + 4, mesh.triangles.len());
    for (number, (level, figures)) in made.levels.iter().zip(&made.report.levels).enumerate() {
        let most = 400 >> (2 * number);
        assert!(figures.triangles == level.mesh.triangles.len() && figures.triangles <= most, "{figures:?}");
        assert_eq!((level.images.size, figures.size), (128 >> number, 128 >> number));
        level.images.validate().unwrap();
        let names: Vec<&str> = level.mesh.vertex_attributes.iter().map(|of| &*of.name).collect();
        assert_eq!(names, ["s", "t"]);
        let tile = &level.images.tiles[0];
        assert!(tile.normal.is_some() && tile.occlusion.is_some() && tile.height.is_none());
        assert!(figures.unseen == 1.0 && figures.charts > 0 && figures.texels_per_unit > 0.0);
        let to_detail =
            measure::deviation(&level.mesh.positions, &made.detail, measure::Side::Ignored, 1, &Progress::none())
                .unwrap()
                .summary
                .max;
        assert!(to_detail <= figures.max_error && figures.max_error < 0.5, "{to_detail} {figures:?}");
    }
    let middles = middles(&made.levels[0]);
    let wrong = middles.iter().filter(|(colour, at)| apart(*colour, &waves(*at)) > 24).count();
    assert!(wrong * 50 < middles.len(), "{wrong} of {}", middles.len());
}

#[test]
fn photos_are_seen_where_they_look() {
    let made = finished(&pebble(), &[red_photo()], &params()).unwrap();
    let middles = middles(&made.levels[0]);
    let above = |from: f64, to: f64| middles.iter().filter(move |(_, at)| at.z > from && at.z < to);
    assert!(above(0.6, 2.0).all(|(colour, _)| apart(*colour, &RED) < 3));
    let below = above(-2.0, -0.3).filter(|(colour, at)| apart(*colour, &waves(*at)) < 40).count();
    assert!(below * 10 > above(-2.0, -0.3).count() * 9);
    assert!(made.report.levels[0].unseen > 0.3 && made.report.levels[0].unseen < 0.8);
    assert_eq!((made.report.photos.len(), made.world_from_camera.len()), (1, 1));
}

#[test]
fn it_is_closed_where_that_is_asked_for() {
    let open = finished(&pebble(), &[], &params()).unwrap();
    assert!(!open.report.is_closed && open.report.closed == 0);
    assert!(!check(&open.detail).is_closed());
    let closed = finished(&pebble(), &[], &FinishParams { close: Openings::All, ..params() }).unwrap();
    assert!(closed.report.is_closed && closed.report.closed == 1);
    // Vertices come once per chart.
    assert!(mesh::check_welded(&closed.levels[0].mesh).is_closed());
}

#[test]
fn all_parts_stay_if_that_is_asked_for() {
    let made = finished(&pebble(), &[], &FinishParams { min_component_share: 0.0, ..params() }).unwrap();
    assert_eq!((made.report.dropped_components, made.report.detail), ([0, 0], pebble().triangles.len()));
}

#[test]
fn a_largest_error_is_kept() {
    let given = FinishParams { lightness: Lightness::MaxError(0.05), levels: 2, ..params() };
    let made = finished(&pebble(), &[], &given).unwrap();
    let [fine, coarse] = [0, 1].map(|k| &made.report.levels[k]);
    assert!(fine.max_error <= 0.05 && coarse.max_error <= 0.1 && coarse.triangles < fine.triangles);
}

#[test]
fn what_can_not_be_used_is_named() {
    let told = |mesh: &TriMesh, params: FinishParams| finished(mesh, &[], &params).unwrap_err().to_string();
    let mut bare = pebble();
    bare.vertex_attributes.clear();
    assert!(told(&bare, params()).contains("neither photos nor colours"));
    let odd = FinishParams { flat_base: true, ..params() };
    assert!(told(&pebble(), odd).contains("give close = all or seen"));
    let narrow = FinishParams { levels: 5, ..params() };
    assert!(
        told(&pebble(), narrow)
            .contains("padding is 2 texels, but must be less than a quarter of the 8 texels of the last level")
    );
    let few = FinishParams { lightness: Lightness::Triangles(3), ..params() };
    assert!(told(&pebble(), few).contains("triangles"));
    assert!(!told(&TriMesh::default(), params()).is_empty());
    assert!(matches!(pebble().vertex_attribute("colour"), Some(AttributeData::Colour(_))));
}

#[test]
fn threads_change_nothing() {
    let given = FinishParams { close: Openings::All, levels: 2, ..params() };
    let mut made = [1, 2].map(|threads| finished(&pebble(), &[], &FinishParams { threads, ..given }).unwrap());
    made.iter_mut().for_each(|made| made.report.seconds.clear());
    assert!(made[0] == made[1]);
}

#[test]
fn each_step_hears_a_cancel_and_tells_how_far_it_is() {
    use std::ops::ControlFlow;
    let given = FinishParams { close: Openings::All, levels: 2, ..params() };
    let mut checks = 1;
    let mut stopped = 0;
    while let Err(error) = finish(&pebble(), &[], &[], &given, &Progress::cancel_after(checks)) {
        assert!(matches!(error, Error::Cancelled), "{error}");
        (checks, stopped) = (checks * 3, stopped + 1);
    }
    assert!(stopped > 4, "{stopped}");
    let mut told = Vec::new();
    let watching = Progress::new(|tick| {
        told.push((tick.stage, tick.fraction));
        ControlFlow::Continue(())
    });
    finish(&pebble(), &[], &[], &given, &watching).unwrap();
    drop(watching);
    assert!(told.windows(2).all(|pair| pair[0].1 <= pair[1].1) && told.last().unwrap().1 > 0.5, "{told:?}");
}
