//! Poses across the border.

use glam::DAffine3;
use surfrecon::error::{Shown, counted};

use crate::pointer;
use crate::status::{Failure, srf_status::SRF_ERR_INPUT};

/// Places a frame in another: 16 numbers, column after column, as OpenGL and glTF have them. The last row is 0 0 0 1. If a rotation and a
/// translation are asked for, the axes must be orthonormal within 0.02: the nearest rotation is taken.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_pose {
    /// Column after column.
    pub matrix: [f64; 16],
}

/// The transform behind a pointer. NULL is the identity.
pub fn read(name: &str, pose: *const srf_pose) -> Result<DAffine3, Failure> {
    if pose.is_null() { Ok(DAffine3::IDENTITY) } else { transform(name, &pointer::read(name, pose)?) }
}

/// The transform that the caller's numbers stand for.
fn transform(name: &str, pose: &srf_pose) -> Result<DAffine3, Failure> {
    let m = pose.matrix;
    if m.iter().any(|x| !x.is_finite()) {
        return Err(Failure::new(SRF_ERR_INPUT, format!("{name} must have finite numbers")));
    }
    if [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0] {
        let text = format!(
            "{name}: the last row must be 0 0 0 1, got {} {} {} {}. Columns follow each other.",
            Shown(m[3]),
            Shown(m[7]),
            Shown(m[11]),
            Shown(m[15])
        );
        return Err(Failure::new(SRF_ERR_INPUT, text));
    }
    Ok(DAffine3::from_cols_array(&[m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10], m[12], m[13], m[14]]))
}

/// The pose of a sensor behind a pointer: a rotation and a translation, made orthonormal. NULL is the identity.
pub fn read_rigid(name: &str, pose: *const srf_pose) -> Result<DAffine3, Failure> {
    rigid(name, read(name, pose)?)
}

/// The poses of `scans` scans behind a pointer, rigid. `None` for those that are all 0.
pub fn read_all(
    name: &str,
    poses: *const srf_pose,
    count: usize,
    scans: usize,
) -> Result<Vec<Option<DAffine3>>, Failure> {
    if count != scans {
        let given = counted(count as u64, "pose is", "poses are");
        let scans = counted(scans as u64, "scan", "scans");
        let text = format!(
            "{name}: {given} given for {scans}: give as many as there are scans, all 0 at a scan that is left out"
        );
        return Err(Failure::new(SRF_ERR_INPUT, text));
    }
    let one = |(index, pose): (usize, &srf_pose)| {
        if pose.matrix == [0.0; 16] {
            return Ok(None);
        }
        let name = format!("{name}[{index}]");
        rigid(&name, transform(&name, pose)?).map(Some)
    };
    pointer::numbers(name, poses, count)?.iter().enumerate().map(one).collect()
}

fn rigid(name: &str, transform: DAffine3) -> Result<DAffine3, Failure> {
    surfrecon::rigid::nearest(transform).map_err(|why| {
        Failure::new(SRF_ERR_INPUT, format!("{name} must be rigid (a rotation and a translation only): {why}"))
    })
}

/// A transform as the caller gets it.
pub fn pose(transform: DAffine3) -> srf_pose {
    let [a, b, c, d, e, f, g, h, i, x, y, z] = transform.to_cols_array();
    srf_pose { matrix: [a, b, c, 0.0, d, e, f, 0.0, g, h, i, 0.0, x, y, z, 1.0] }
}
