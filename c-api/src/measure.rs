//! Measuring.

use surfrecon::mesh::certify::certify;
use surfrecon::mesh::measure::{self, Side, Summary};

use crate::array::{Borrowed, srf_array};
use crate::guard::guard;
use crate::handle;
use crate::mesh::srf_mesh;
use crate::progress::{srf_progress, watched};
use crate::status::{Failure, flag, srf_status};
use crate::{pointer, sized};

/// Figures over many distances, all but bias of their absolute values. Starts with its size; prepared by
/// srf_distances_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_distances {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// How many.
    pub count: u64,
    /// Mean.
    pub mean: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// The smallest value that at least 95 % do not exceed.
    pub p95: f64,
    /// Largest.
    pub max: f64,
    /// Mean of the values with their signs.
    pub bias: f64,
    /// Index of the largest, the first of several; 0 if there is none.
    pub worst: u64,
}

impl From<Summary> for srf_distances {
    fn from(s: Summary) -> Self {
        srf_distances {
            struct_size: size_of::<Self>() as u32,
            reserved: 0,
            count: s.count as u64,
            mean: s.mean,
            rms: s.rms,
            p95: s.p95,
            max: s.max,
            bias: s.bias,
            worst: s.worst.unwrap_or_default() as u64,
        }
    }
}

/// Prepares a struct for srf_mesh_distances(). Call srf_distances_init(distances), which adds the size that this header knows.
/// distances  not NULL
/// size       sizeof(srf_distances): what of the struct this library does not know becomes 0
/// returns    SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_distances_init_sized(distances: *mut srf_distances, size: usize) -> srf_status {
    guard(|| sized::init("distances", distances, size, srf_distances::default()))
}

/// Exact distances of points to the nearest point of a mesh. Time O((n + m) log m) for n points and m triangles; the same for
/// any number of threads.
/// mesh           with at least one triangle; not NULL
/// points         3 SRF_TYPE_F64 or SRF_TYPE_F32 a point, finite; not NULL
/// is_signed      1: distances behind the surface are negative; 0: all are positive
/// threads        at most 1024; 0 for the number of srf_set_threads()
/// progress       NULL for none
/// out_distances  room for a double a point; NULL if only the figures are wanted
/// out_figures    initialized by srf_distances_init(); NULL if not wanted
/// returns        SRF_OK, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE.
///                Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_distances(
    mesh: *const srf_mesh,
    points: *const srf_array,
    is_signed: u32,
    threads: u32,
    progress: *const srf_progress,
    out_distances: *mut f64,
    out_figures: *mut srf_distances,
) -> srf_status {
    guard(|| {
        let side = side("is_signed", is_signed)?;
        if !out_figures.is_null() {
            sized::writable("out_figures", out_figures)?;
        }
        let mesh = handle::get("mesh", mesh)?;
        let points = Borrowed::new("points", points, 3)?.points()?;
        watched(progress, |progress| {
            let deviation = measure::deviation(&points, &mesh.mesh, side, threads as usize, progress)?;
            if !out_figures.is_null() {
                sized::write("out_figures", out_figures, deviation.summary.into())?;
            }
            if out_distances.is_null() {
                return Ok(());
            }
            pointer::copy_out("out_distances", out_distances, &deviation.distances)
        })
    })
}

/// How far one surface lies from another: exact at its vertices, with a bound that holds for every point between them.
/// mesh           the surface; not NULL
/// reference      with at least one triangle; not NULL
/// is_signed      1: distances behind the reference are negative; 0: all are positive
/// threads        at most 1024; 0 for the number of srf_set_threads()
/// progress       NULL for none
/// out_distances  room for a double a vertex of mesh; NULL if only the figures are wanted
/// out_figures    of the vertices; initialized by srf_distances_init(); NULL if not wanted
/// out_reached    receives the largest distance found, between the vertices too; NULL if not wanted
/// out_bound      receives what no point of the surface exceeds: within 1 % of out_reached or a millionth of the extent
///                of reference above it, unless that takes more than 8 measurements a vertex and 100,000; NULL if not
///                wanted
/// returns        SRF_OK, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE.
///                Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_surface_distance(
    mesh: *const srf_mesh,
    reference: *const srf_mesh,
    is_signed: u32,
    threads: u32,
    progress: *const srf_progress,
    out_distances: *mut f64,
    out_figures: *mut srf_distances,
    out_reached: *mut f64,
    out_bound: *mut f64,
) -> srf_status {
    guard(|| {
        let side = side("is_signed", is_signed)?;
        if !out_figures.is_null() {
            sized::writable("out_figures", out_figures)?;
        }
        let (mesh, reference) = (handle::get("mesh", mesh)?, handle::get("reference", reference)?);
        watched(progress, |progress| {
            let found = certify(&mesh.mesh, &reference.mesh, side, threads as usize, progress)?;
            if !out_figures.is_null() {
                sized::write("out_figures", out_figures, found.vertices.summary.into())?;
            }
            for (name, out, value) in
                [("out_reached", out_reached, found.reached), ("out_bound", out_bound, found.bound)]
            {
                if !out.is_null() {
                    pointer::write(name, out, value)?;
                }
            }
            if out_distances.is_null() {
                return Ok(());
            }
            pointer::copy_out("out_distances", out_distances, &found.vertices.distances)
        })
    })
}

fn side(name: &str, is_signed: u32) -> Result<Side, Failure> {
    Ok(if flag(name, is_signed)? { Side::Signed } else { Side::Ignored })
}
