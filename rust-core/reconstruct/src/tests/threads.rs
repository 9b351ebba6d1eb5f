//! The same bytes for any number of threads, of clouds so large that their tetrahedralization is made in parallel.

use glam::DVec3;

use super::seen::hollow_ball;
use super::{cloud, random};
use crate::{NoisyPoints, ReconstructParams, Reconstructed, Reconstructor};
use base::progress::Progress;
use mesh::point_cloud::PointCloud;

const COUNT: usize = 60_000;

/// A bent sheet at random, with noise in spacings.
fn sheet(noise: f64) -> Vec<DVec3> {
    let mut random = random(3);
    let spacing = (1.0 / COUNT as f64).sqrt();
    let place = |_| {
        let [x, y] = [random(), random()];
        let normal = (0..12).map(|_| random()).sum::<f64>() - 6.0;
        DVec3::new(x, y, 0.05 * (6.0 * x).sin() + noise * spacing * normal)
    };
    (0..COUNT).map(place).collect()
}

/// The surface and all that is reported but for how long it took.
fn made(cloud: &PointCloud, sensors: &[DVec3], params: &ReconstructParams) -> Reconstructed {
    let mut reconstructor = Reconstructor::new(cloud).unwrap();
    if !sensors.is_empty() {
        reconstructor.seen_from(sensors.to_vec()).unwrap();
    }
    let mut made = reconstructor.into_surface(params, &Progress::none()).unwrap();
    made.report.seconds.clear();
    made
}

/// The surface that one thread makes, which any number of them makes.
fn by_any_threads(cloud: &PointCloud, sensors: &[DVec3], params: ReconstructParams) -> Reconstructed {
    let by_one = made(cloud, sensors, &ReconstructParams { threads: 1, ..params });
    for threads in [2, 3, 8] {
        let by_more = made(cloud, sensors, &ReconstructParams { threads, ..params });
        assert!(by_more.mesh == by_one.mesh, "{threads} threads make another surface");
        assert_eq!(by_more.report, by_one.report, "{threads} threads");
    }
    by_one
}

#[test]
fn open_noisy_sheets() {
    let sheet = cloud(sheet(0.3));
    let smoothed = by_any_threads(&sheet, &[], ReconstructParams::default()).report;
    assert!(smoothed.smoothing > 0.0 && smoothed.moved > 0.0 && !smoothed.closed, "{smoothed:?}");
}

/// Small neighbourhoods, for the test's sake.
fn smoothed_a_little() -> ReconstructParams {
    ReconstructParams { smooth: Some(0.05), ..ReconstructParams::default() }
}

mod thorough {
    use super::*;

    #[test]
    fn open_noisy_sheets_through_points_as_they_are() {
        let sheet = cloud(sheet(0.3));
        for noisy_points in [NoisyPoints::PutBack, NoisyPoints::AsClean] {
            let made = by_any_threads(&sheet, &[], ReconstructParams { noisy_points, ..smoothed_a_little() });
            assert_eq!(
                (made.report.smoothing, made.report.moved, made.report.closed),
                (0.0, 0.0, false),
                "{noisy_points:?}"
            );
            let Some(mesh::AttributeData::I32(sources)) = made.mesh.vertex_attribute("source_point") else { panic!() };
            let places = sources.iter().map(|&source| sheet.positions[source as usize]);
            assert!(made.mesh.positions.iter().copied().eq(places), "{noisy_points:?}");
        }
    }
}

#[test]
fn noisy_hollow_balls_with_normals() {
    let by_normals = by_any_threads(&hollow_ball(COUNT, 0.3).cloud(), &[], smoothed_a_little()).report;
    assert!(by_normals.smoothing > 0.0 && by_normals.closed, "{by_normals:?}");
}

#[test]
fn noisy_hollow_balls_with_sensors() {
    let ball = hollow_ball(COUNT, 0.3);
    let by_sensors = by_any_threads(&cloud(ball.points.clone()), &ball.sensors(3.0), smoothed_a_little()).report;
    assert!(by_sensors.smoothing > 0.0 && by_sensors.closed, "{by_sensors:?}");
}
