//! B-spline surfaces through quad grids.

use surfrecon::quads::Fit;

use crate::array::{self, srf_array};
use crate::guard::guard;
use crate::handle::{self, handle};
use crate::mesh::srf_mesh;
use crate::params::spline::srf_spline_params;
use crate::progress::{srf_progress, watched};
use crate::quads::srf_quads;
use crate::status::{Failure, srf_status, srf_status::*};
use crate::{params, pointer};

/// A surface and which way it looks.
pub struct Surface {
    fit: Fit,
    mirrored: bool,
}

/// A tensor-product B-spline surface over 0..1 x 0..1: u runs along columns, v down rows. Knots are uniform and clamped. Released with
/// srf_spline_free().
#[allow(non_camel_case_types)]
pub struct srf_spline {
    _opaque: [u8; 0],
}

handle!(srf_spline, Surface);

/// Fits a surface to all vertices of a quad grid, those on the background as well. O(vertices).
/// quads             not NULL
/// params            NULL for the defaults
/// progress          NULL for none
/// out_spline        receives a new handle on SRF_OK only. Not NULL
/// out_max_residual  largest distance of a vertex from the surface at the vertex's parameters. NULL if not wanted
/// out_rms_residual  root of the mean square of these distances. NULL if not wanted
/// returns           SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE.
///                   Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_spline_create(
    quads: *const srf_quads,
    params: *const srf_spline_params,
    progress: *const srf_progress,
    out_spline: *mut *mut srf_spline,
    out_max_residual: *mut f64,
    out_rms_residual: *mut f64,
) -> srf_status {
    guard(|| {
        pointer::writable("out_spline", out_spline)?;
        let quads = handle::get("quads", quads)?;
        let params = params::read("params", params)?;
        watched(progress, |progress| {
            let fit = quads.grid.spline(&params, progress)?;
            for (name, out, value) in [
                ("out_max_residual", out_max_residual, fit.max_residual),
                ("out_rms_residual", out_rms_residual, fit.rms_residual),
            ] {
                if !out.is_null() {
                    pointer::write(name, out, value)?;
                }
            }
            handle::give("out_spline", out_spline, Surface { fit, mirrored: quads.grid.mirrored })
        })
    })
}

/// Releases a surface. Views of it are gone.
/// spline     NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_spline_free(spline: *mut srf_spline) -> srf_status {
    guard(|| handle::free("spline", spline))
}

/// The control points, row after row of rows * cols. Knots are clamped and uniform: of n control points and order k, knot i is
/// max(i - (k - 1), 0) / (n + 1 - k), at most 1.
/// spline       not NULL
/// out_rows     rows of control points. NULL if not wanted
/// out_cols     columns of control points. NULL if not wanted
/// out_points   3 SRF_TYPE_F64 per control point, in the sensor's frame. NULL if not wanted
/// returns      SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_spline_control(
    spline: *const srf_spline,
    out_rows: *mut usize,
    out_cols: *mut usize,
    out_points: *mut srf_array,
) -> srf_status {
    guard(|| {
        let surface = handle::get("spline", spline)?;
        let spline = &surface.fit.spline;
        for (name, out, value) in [("out_rows", out_rows, spline.rows), ("out_cols", out_cols, spline.cols)] {
            if !out.is_null() {
                pointer::write(name, out, value)?;
            }
        }
        if out_points.is_null() {
            return Ok(());
        }
        pointer::write("out_points", out_points, array::points(&spline.control))
    })
}

/// The point of some parameters.
/// spline     not NULL
/// u, v       each taken into 0 to 1. Not NaN
/// out_point  receives 3 numbers on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_spline_point(
    spline: *const srf_spline,
    u: f64,
    v: f64,
    out_point: *mut f64,
) -> srf_status {
    guard(|| {
        let surface = handle::get("spline", spline)?;
        if u.is_nan() || v.is_nan() {
            return Err(Failure::new(SRF_ERR_PARAMETER, format!("u and v must be numbers, got {u} and {v}")));
        }
        pointer::copy_out("out_point", out_point, &surface.fit.spline.at(u, v).to_array())
    })
}

/// The surface at rows x cols evenly spread parameters, as triangles that look at the sensor: sample (i, j) is vertex
/// i * cols + j.
/// spline      not NULL
/// rows, cols  at least 2
/// out_mesh    receives a new handle on SRF_OK only. Not NULL
/// returns     SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_spline_sample(
    spline: *const srf_spline,
    rows: usize,
    cols: usize,
    out_mesh: *mut *mut srf_mesh,
) -> srf_status {
    guard(|| {
        pointer::writable("out_mesh", out_mesh)?;
        let surface = handle::get("spline", spline)?;
        let mesh = surface.fit.spline.sample(rows, cols, surface.mirrored)?.triangulated(|_| false);
        handle::give("out_mesh", out_mesh, mesh.into())
    })
}
