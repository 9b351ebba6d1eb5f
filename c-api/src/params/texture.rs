//! Parameters of texture. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// How a mesh gets its textures. Starts with its size. Set to the defaults by srf_texture_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_texture_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
    /// number.
    pub threads: u32,
    /// Columns and rows of a tile, in texels. 16 to 16384, default 2048.
    pub size: u64,
    /// Poses of the cameras are moved a little until the photos agree with each other on the surface. Off: cameras stay
    /// where they are. 1 or 0, default 1.
    pub refine_cameras: u64,
    /// Photos are made equally bright, channel by channel: exposure and white balance differ from photo to photo. Off:
    /// colours are taken as they are. 1 or 0, default 1.
    pub match_exposure: u64,
    /// Of three photos and more that see a place the brightest is left out where it is brighter than the others:
    /// reflections of lamps only add light. Off: highlights are averaged with the rest. 1 or 0, default 1.
    pub drop_highlights: u64,
    /// A normal map is made, in the tangent space of MikkTSpace, y up. Off: none is made. 1 or 0, default 0.
    pub normal_map: u64,
    /// A map of the height of the detailed surface over the mesh is made. Off: none is made. 1 or 0, default 0.
    pub height_map: u64,
    /// Rays per place of the map of ambient occlusion. 16 suffice for most. 0: none is made. 0 to 4096, default 0.
    pub occlusion_rays: u64,
}

impl Fields for srf_texture_params {
    fn defaults() -> Self {
        srf_texture_params {
            struct_size: size_of::<Self>() as u32,
            threads: 0,
            size: 2048,
            refine_cameras: 1,
            match_exposure: 1,
            drop_highlights: 1,
            normal_map: 0,
            height_map: 0,
            occlusion_rays: 0,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("threads", Given::Threads(self.threads)),
            ("size", Given::Whole(self.size)),
            ("refine_cameras", Given::Whole(self.refine_cameras)),
            ("match_exposure", Given::Whole(self.match_exposure)),
            ("drop_highlights", Given::Whole(self.drop_highlights)),
            ("normal_map", Given::Whole(self.normal_map)),
            ("height_map", Given::Whole(self.height_map)),
            ("occlusion_rays", Given::Whole(self.occlusion_rays)),
        ]
    }
}

/// Sets the defaults. Call srf_texture_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_texture_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_texture_params_init_sized(params: *mut srf_texture_params, size: usize) -> srf_status {
    guard(|| sized::init("params", params, size, srf_texture_params::defaults()))
}
