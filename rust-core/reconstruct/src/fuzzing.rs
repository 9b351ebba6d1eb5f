//! Function that the fuzz target calls.

use glam::DVec3;

use super::{Closure, NoisyPoints, ReconstructParams, Threshold, Topology, run};
use base::{Error, Progress};
use mesh::check;
use mesh::point_cloud::PointCloud;

/// Reasons why points can have no surface.
const REFUSALS: &[&str] = &[
    "needs at least 3 different points with finite coordinates",
    "lie on one line, which bounds no surface",
    "lie in one plane, which encloses nothing",
    "no surface was found: the points fill a volume or lie along curves",
    "no surface was found: a free topology carves wherever a facet is above the threshold",
    "which tell no surface there: give a larger smoothing",
    "coordinates must be finite and at most",
    "or products of them vanish",
    "is too small beside the others to be multiplied with them",
];

/// Makes a surface of any points, from small lattices full of ties and copies to doubles of any size. It is a manifold that accounts for
/// every point, or an error says why there is none.
pub fn points(bytes: &[u8]) {
    let [kind, options, bytes @ ..] = bytes else { return };
    let coordinates: Vec<f64> = match kind % 3 {
        0 => bytes.iter().map(|&b| f64::from(b % 5)).collect(),
        1 => bytes.chunks_exact(2).map(|b| f64::from(i16::from_le_bytes([b[0], b[1]])) / 10.0).collect(),
        _ => bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect(),
    };
    let positions: Vec<DVec3> = coordinates.as_chunks().0.iter().map(|&p| DVec3::from(p)).collect();
    let count = positions.len();
    let params = ReconstructParams {
        topology: if options & 1 == 0 { Topology::Manifold } else { Topology::Free },
        threshold: if options & 2 == 0 { Threshold::Local } else { Threshold::Global },
        closure: [Closure::Auto, Closure::Closed, Closure::Open][usize::from(options >> 2) % 3],
        factor: 1.0 + f64::from(options >> 4) / 15.0,
        noisy_points: NoisyPoints::ALL[usize::from(kind >> 6) % 3],
        threads: 1,
        ..ReconstructParams::default()
    };
    match run(&PointCloud { positions, ..PointCloud::default() }, &params, &Progress::none()) {
        Ok(made) => {
            made.mesh.validate().expect("a mesh");
            assert_eq!(made.report.used + made.report.dropped.len(), count, "points lost");
            let report = check(&made.mesh);
            assert!(params.topology == Topology::Free || report.is_manifold(), "{report}");
        }
        Err(Error::Input(text)) => assert!(REFUSALS.iter().any(|refusal| text.contains(refusal)), "{text}"),
        Err(error) => panic!("{error}"),
    }
}

#[cfg(test)]
proptest::proptest! {
    #[test]
    fn any_bytes_are_points(bytes in proptest::collection::vec(proptest::prelude::any::<u8>(), 0..200)) {
        points(&bytes);
    }
}
