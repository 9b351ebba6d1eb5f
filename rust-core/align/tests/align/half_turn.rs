//! A thing that looks the same after half a turn: scans that know what is up have a place, groups of others have two, which is said.

use base::progress::Progress;
use glam::DVec3;
use image::RangeImage;
use mesh::TriMesh;
use surfrecon_align::{AlignParams, Alignment, Constraints, Pick, ScanSource, run};

use crate::reach::lines;
use crate::scans::{Known, aligned, errors, look, statue, without_poses};

/// A thing that looks the same after half a turn about x, and after no other turn.
fn double() -> TriMesh {
    let TriMesh { mut positions, mut triangles, .. } = statue().clone();
    positions.iter_mut().for_each(|p| p.y += 0.2);
    let count = positions.len() as u32;
    let turned: Vec<DVec3> = positions.iter().map(|p| DVec3::new(p.x, -p.y, -p.z)).collect();
    positions.extend(turned);
    let others: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|v| v + count)).collect();
    triangles.extend(others);
    TriMesh { positions, triangles, ..TriMesh::default() }
}

/// Both scans, where their sensors know up to `off` in the sensor's frame.
fn by(images: &[RangeImage], up: impl Fn(usize) -> Option<DVec3>) -> Alignment {
    let scan = |(k, (image, truth)): (usize, (RangeImage, &RangeImage))| Known {
        image,
        moment: None,
        up: up(k).map(|up| truth.world_from_sensor.inverse().transform_vector3(up).normalize()),
    };
    let scans: Vec<Known> = without_poses(images).into_iter().zip(images).enumerate().map(scan).collect();
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    run(&sources, &AlignParams::default(), &Constraints::default(), &Progress::none()).unwrap()
}

#[test]
fn up_tells_which_way_a_thing_stands() {
    let thing = double();
    let images =
        [look(&thing, DVec3::new(1.0, 0.15, 0.2), 0.1, 0.2), look(&thing, DVec3::new(1.0, -0.2, 0.1), 0.6, 0.2)];
    let without = by(&images, |_| None);
    assert_eq!(without.report.placed(), 0, "{}", lines(&without));
    let one_alone = by(&images, |k| (k == 0).then_some(DVec3::Z));
    assert_eq!(one_alone, without);
    // A phone in motion knows it to a few degrees.
    let with = by(&images, |k| Some(DVec3::new(0.0, 0.05 * k as f64, 1.0)));
    assert_eq!(with.report.placed(), 2, "{}", lines(&with));
    assert!(errors(&images, &with).iter().all(|off| off.is_some_and(|off| off < 1.0)), "{}", lines(&with));
    // The place where it would lie upside down fits as well, but is refused.
    let other = by(&images, |k| Some(if k == 0 { DVec3::Z } else { -DVec3::Z }));
    assert!(errors(&images, &other).iter().flatten().all(|off| *off == 0.0 || *off > 50.0), "{}", lines(&other));
}

#[test]
fn a_group_that_fits_in_two_places_is_named() {
    let thing = double();
    let from = [(0.15, 0.2, 0.1), (-0.2, 0.1, 0.6), (0.1, -0.2, 1.1), (-0.15, -0.1, 0.3)];
    let images = from.map(|(y, z, roll)| look(&thing, DVec3::new(1.0, y, z), roll, 0.2));
    // Two scans whose poses are known, and two that belong together.
    let given: Vec<RangeImage> =
        (0..4).map(|k| if k < 2 { images[k].clone() } else { without_poses(&images[k..=k]).remove(0) }).collect();
    let constraints = Constraints { fixed: vec![0, 1], trusted: vec![[2, 3]], ..Constraints::default() };
    let alignment = aligned(&given, &constraints);
    assert_eq!(alignment.report.groups, [[0, 1], [2, 3]], "{}", lines(&alignment));
    let said =
        alignment.report.messages.iter().find(|text| text.starts_with("2 scans fit the placed ones in 2 places"));
    let said = said.unwrap_or_else(|| panic!("{}", lines(&alignment)));
    assert!(said.contains("a turn of 180 degrees apart, and nothing decides: \"from"), "{said}");
    // A pair of points decides.
    let knob = thing.positions.iter().copied().max_by(|a, b| (a.x + a.z).total_cmp(&(b.x + b.z))).unwrap();
    let seen = |k: usize| {
        let own = images[k].world_from_sensor.inverse().transform_point3(knob);
        let points = given[k].oriented_points(&Progress::none()).unwrap().positions;
        points.into_iter().min_by(|a, b| a.distance(own).total_cmp(&b.distance(own))).unwrap()
    };
    let pick = Pick { scans: [0, 2], points: [seen(0), seen(2)], normals: None, weight: 1.0 };
    let alignment = aligned(&given, &Constraints { picks: vec![pick], ..constraints });
    assert_eq!(alignment.report.groups, [[0, 1, 2, 3]], "{}", lines(&alignment));
    assert!(errors(&images, &alignment).iter().all(|off| off.is_some_and(|off| off < 1.0)), "{}", lines(&alignment));
}
