//! Open surfaces of which no sensor is known, byte for byte.
//!
//! Work that is done faster, or only if sensors are known, leaves them as they are. Whoever changes them on purpose says in `CHANGELOG.md`
//! what is otherwise. They measure it in `docs/decisions/`, and take over the hashes that this test then prints.

use glam::DVec3;

use super::{random, reconstruct};
use crate::{Closure, ReconstructParams, Threshold};
use mesh::AttributeData;

/// The view of a scanner far above in so many rows and columns about 1 apart: a slope, before it a ball, a wall with a hole, and a box. It
/// measures heights with noise and misses one pixel in thirty. Nothing is computed but by operations that all machines round alike.
fn scan(side: i32) -> Vec<DVec3> {
    let mut random = random(31);
    let size = f64::from(side);
    let mut points = Vec::new();
    for i in 0..side * side {
        let [x, y] = [i % side, i / side].map(|k| f64::from(k) + 0.3 * random());
        let noise = 0.2 * (random() + random() + random() - 1.5);
        let is_missed = random() < 1.0 / 30.0;
        let mut z = 0.3 * y;
        let inside = (0.2 * size).powi(2) - (x - 0.3 * size).powi(2) - (y - 0.35 * size).powi(2);
        if inside > 0.0 {
            z = z.max(0.1 * size + inside.sqrt());
        }
        if (x - 0.75 * size).abs() < 0.04 * size && (y - 0.4 * size).abs() > 0.1 * size {
            z += 0.1 * size;
        }
        if (x - 0.45 * size).abs() < 0.1 * size && (y - 0.8 * size).abs() < 0.1 * size {
            z = z.max(0.3 * size + 0.1 * x);
        }
        if !is_missed {
            points.push(DVec3::new(x, y, z + noise));
        }
    }
    points
}

/// FNV-1a over the triangles, each vertex by its point.
fn hash(points: &[DVec3], params: &ReconstructParams) -> u64 {
    let (made, report) = reconstruct(points.to_vec(), params);
    assert!(!made.report.closed && report.boundary_loops > 1, "{report}");
    let Some(AttributeData::I32(source)) = made.mesh.vertex_attribute("source_point") else { panic!("no points") };
    let bytes = made.mesh.triangles.as_flattened().iter().flat_map(|&v| source[v as usize].to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[test]
fn open_surfaces_without_sensors_are_what_they_were() {
    let joined = ReconstructParams::default();
    let open = ReconstructParams { closure: Closure::Open, threshold: Threshold::Global, ..joined };
    // The large one is done in parallel.
    let [small, large] = [scan(64), scan(220)];
    let found = [(&small, &joined), (&small, &open), (&large, &joined), (&large, &open)].map(|(p, how)| hash(p, how));
    let expected = [0x6251_9979_e348_ce5f, 0x61b7_bc9b_7267_9395, 0xfee6_7fc1_171b_b86f, 0x2741_8f3e_4e30_ea78];
    assert!(found == expected, "{found:#x?} instead of {expected:#x?}");
}
