//! The virtual range scanner.

use surfrecon::geom::bvh::Bvh;
use surfrecon::scan::{self, Camera, ScanParams};

use crate::guard::guard;
use crate::handle;
use crate::image::{srf_image, srf_projection};
use crate::mesh::srf_mesh;
use crate::pose::{self, srf_pose};
use crate::progress::{srf_progress, watched};
use crate::settings::{SRF_FROM_DATA, from_data, threads};
use crate::status::{Failure, srf_status, srf_status::*};
use crate::{pointer, sized};

/// What a virtual scanner adds to the truth. Starts with its size; set to the defaults, which add nothing, by
/// srf_scan_params_init(). Lengths are in the unit of the mesh.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_scan_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024; 0, the default, for the number of srf_set_threads().
    pub threads: u32,
    /// Standard deviation of the noise along each ray, >= 0.
    pub noise: f64,
    /// Growth of the noise at grazing angles, >= 0.
    pub noise_grazing: f64,
    /// Step of the values, >= 0; 0 for none.
    pub quantum: f64,
    /// Share of pixels without a value, 0 to 1.
    pub dropout: f64,
    /// Further share of them at grazing angles, 0 to 1.
    pub dropout_grazing: f64,
    /// Largest distance seen, > 0; SRF_FROM_DATA, the default, for no limit.
    pub max_range: f64,
    /// Error of the reported position, >= 0.
    pub pose_shift: f64,
    /// Error of the reported orientation, in radians, >= 0.
    pub pose_turn: f64,
    /// What all randomness follows from, at most 2^53.
    pub seed: u64,
    /// 1: triangles seen from behind give values too; 0, the default: they do not.
    pub backfaces: u64,
}

impl srf_scan_params {
    fn defaults() -> Self {
        let core = ScanParams::default();
        srf_scan_params {
            struct_size: size_of::<Self>() as u32,
            threads: core.threads as u32,
            noise: core.noise,
            noise_grazing: core.noise_grazing,
            quantum: core.quantum,
            dropout: core.dropout,
            dropout_grazing: core.dropout_grazing,
            max_range: core.max_range.unwrap_or(SRF_FROM_DATA),
            pose_shift: core.pose_shift,
            pose_turn: core.pose_turn,
            seed: core.seed,
            backfaces: u64::from(core.backfaces),
        }
    }

    fn to_core(self) -> Result<ScanParams, Failure> {
        if self.backfaces > 1 {
            let text = format!("params.backfaces must be 0 or 1, got {}", self.backfaces);
            return Err(Failure::new(SRF_ERR_PARAMETER, text));
        }
        Ok(ScanParams {
            noise: self.noise,
            noise_grazing: self.noise_grazing,
            quantum: self.quantum,
            dropout: self.dropout,
            dropout_grazing: self.dropout_grazing,
            max_range: from_data(self.max_range),
            backfaces: self.backfaces == 1,
            pose_shift: self.pose_shift,
            pose_turn: self.pose_turn,
            seed: self.seed,
            threads: threads(self.threads),
        })
    }
}

/// Sets the defaults. Call srf_scan_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_scan_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scan_params_init_sized(params: *mut srf_scan_params, size: usize) -> srf_status {
    guard(|| sized::init("params", params, size, srf_scan_params::defaults()))
}

/// Scans a mesh: a value for every pixel whose ray meets it. The same image for any number of threads. Where the mesh has the
/// vertex attribute colour, the image has colours.
/// mesh               not NULL
/// rows, cols         size of the image
/// projection         how pixels see, no grid; not NULL
/// world_from_sensor  where the sensor stands: a rotation and a translation; NULL for the identity
/// params             NULL for the defaults
/// progress           NULL for none
/// out_image          receives a new handle on SRF_OK only; not NULL
/// returns            SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_OUT_OF_MEMORY, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
///                    SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scan_mesh(
    mesh: *const srf_mesh,
    rows: usize,
    cols: usize,
    projection: *const srf_projection,
    world_from_sensor: *const srf_pose,
    params: *const srf_scan_params,
    progress: *const srf_progress,
    out_image: *mut *mut srf_image,
) -> srf_status {
    guard(|| {
        pointer::writable("out_image", out_image)?;
        let mesh = handle::get("mesh", mesh)?;
        let params = sized::read("params", params, srf_scan_params::defaults())?.to_core()?;
        let projection = pointer::read("projection", projection)?.to_core()?;
        let world_from_sensor = pose::read_rigid("world_from_sensor", world_from_sensor)?;
        let camera = Camera { rows, cols, projection, world_from_sensor };
        let progress = watched(progress);
        let bvh = Bvh::build_with(&mesh.mesh.positions, &mesh.mesh.triangles, params.threads, &progress)?;
        let image = scan::scan(&mesh.mesh, &bvh, &camera, &params, &progress)?;
        handle::give("out_image", out_image, image.into())
    })
}
