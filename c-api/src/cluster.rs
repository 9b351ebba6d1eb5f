//! Clustering a dense mesh, or points, to a coarse mesh of well-shaped triangles.

use surfrecon::cluster::{self, ClusterParams, Clustered, Resolution};
use surfrecon::params::{Params as _, Value};
use surfrecon::reports::Report as _;

use crate::cloud::srf_cloud;
use crate::given::Fields as _;
use crate::guard::guard;
use crate::handle;
use crate::mesh::srf_mesh;
use crate::params::cluster::srf_cluster_params;
use crate::progress::{srf_progress, watched};
use crate::reports::cluster::srf_cluster_report;
use crate::settings::SRF_FROM_DATA;
use crate::status::{Failure, srf_status};
use crate::{params, pointer, report, sized};

/// Replaces a dense mesh by a coarse one of well-shaped triangles with the same components, boundaries and genus. Its vertices lie on the
/// mesh, those of boundaries on its boundaries. Attributes of vertices ride along. Edges of more than two triangles, or of two that turn
/// against each other, are cut.
/// mesh        not NULL
/// params      NULL for the defaults
/// progress    NULL for none
/// out_mesh    receives a new handle on SRF_OK only. Not NULL
/// out_report  initialized by srf_cluster_report_init(). NULL if not wanted
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for a mesh without triangles or two of the sizes in params,
///             SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_cluster(
    mesh: *const srf_mesh,
    params: *const srf_cluster_params,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_report: *mut srf_cluster_report,
) -> srf_status {
    guard(|| {
        let run = |params: &ClusterParams| {
            watched(progress, |progress| Ok(cluster::run(&handle::get("mesh", mesh)?.mesh, params, progress)?))
        };
        one(params, out_mesh, out_report, run)
    })
}

/// Makes a mesh of well-shaped triangles from points: the surface through them, as srf_reconstructor_surface() makes it with its default
/// parameters, is clustered. In the cloud's frame. Colours, intensities and normals ride along.
/// cloud       not NULL
/// params      NULL for the defaults
/// progress    NULL for none
/// out_mesh    receives a new handle on SRF_OK only. Not NULL
/// out_report  initialized by srf_cluster_report_init(). NULL if not wanted
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for points without a surface or two of the sizes in params,
///             SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_cluster(
    cloud: *const srf_cloud,
    params: *const srf_cluster_params,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_report: *mut srf_cluster_report,
) -> srf_status {
    guard(|| {
        let run = |params: &ClusterParams| {
            let cloud = handle::get("cloud", cloud)?;
            watched(progress, |progress| Ok(cluster::run_points(&cloud, params, progress)?))
        };
        one(params, out_mesh, out_report, run)
    })
}

/// Checks what does not depend on the input, runs and hands out.
fn one(
    params: *const srf_cluster_params,
    out_mesh: *mut *mut srf_mesh,
    out_report: *mut srf_cluster_report,
    run: impl FnOnce(&ClusterParams) -> Result<Clustered, Failure>,
) -> Result<(), Failure> {
    pointer::writable("out_mesh", out_mesh)?;
    if !out_report.is_null() {
        sized::writable("out_report", out_report)?;
    }
    let clustered = run(&params::read("params", params)?)?;
    if !out_report.is_null() {
        report::write("out_report", out_report, clustered.report.values())?;
    }
    handle::give("out_mesh", out_mesh, clustered.mesh.into())
}

/// A chain of levels of detail from one run: finer levels go on splitting the patches of coarser ones.
/// srf_meshes_write_glb_levels() writes them.
/// mesh        not NULL
/// vertices    vertices of each level, in any order. Not NULL
/// count       number of levels
/// params      NULL for the defaults. Its vertices, patches, max_error and triangles are not looked at
/// progress    NULL for none
/// out_meshes  room for count handles, which it receives in the order of vertices on SRF_OK only. Not NULL
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for a mesh without triangles, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
///             SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_cluster_levels(
    mesh: *const srf_mesh,
    vertices: *const u64,
    count: usize,
    params: *const srf_cluster_params,
    progress: *const srf_progress,
    out_meshes: *mut *mut srf_mesh,
) -> srf_status {
    guard(|| {
        chain(vertices, count, params, out_meshes, |levels, params| {
            let mesh = handle::get("mesh", mesh)?;
            watched(progress, |progress| Ok(cluster::levels(&mesh.mesh, levels, params, progress)?))
        })
    })
}

/// A chain of levels of detail of points. See srf_cloud_cluster() and srf_mesh_cluster_levels().
/// cloud       not NULL
/// vertices    vertices of each level, in any order. Not NULL
/// count       number of levels
/// params      NULL for the defaults. Its vertices, patches, max_error and triangles are not looked at
/// progress    NULL for none
/// out_meshes  room for count handles, which it receives in the order of vertices on SRF_OK only. Not NULL
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for points without a surface, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
///             SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_cluster_levels(
    cloud: *const srf_cloud,
    vertices: *const u64,
    count: usize,
    params: *const srf_cluster_params,
    progress: *const srf_progress,
    out_meshes: *mut *mut srf_mesh,
) -> srf_status {
    guard(|| {
        chain(vertices, count, params, out_meshes, |levels, params| {
            let cloud = handle::get("cloud", cloud)?;
            watched(progress, |progress| Ok(cluster::levels_of_points(&cloud, levels, params, progress)?))
        })
    })
}

fn chain(
    vertices: *const u64,
    count: usize,
    params: *const srf_cluster_params,
    out_meshes: *mut *mut srf_mesh,
    run: impl FnOnce(&[Resolution], &ClusterParams) -> Result<Vec<Clustered>, Failure>,
) -> Result<(), Failure> {
    pointer::writable("out_meshes", out_meshes)?;
    let given = sized::read("params", params, srf_cluster_params::defaults())?;
    // The levels say how fine they are.
    let params = params::to_core(&srf_cluster_params {
        vertices: 0,
        patches: 0,
        max_error: SRF_FROM_DATA,
        triangles: 0,
        ..given
    })?;
    let levels = pointer::numbers("vertices", vertices, count)?
        .into_iter()
        .map(|n| {
            let mut level = Resolution::Tenth;
            level.set("vertices", Value::Number(n as f64)).map(|_| level)
        })
        .collect::<surfrecon::Result<Vec<_>>>()?;
    for (i, level) in run(&levels, &params)?.into_iter().enumerate() {
        handle::give("out_meshes", out_meshes.wrapping_add(i), level.mesh.into())?;
    }
    Ok(())
}
