//! Parameters of unwrap. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::srf_status;

/// How a mesh gets its texture coordinates. Starts with its size. Set to the defaults by srf_unwrap_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_unwrap_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
    /// number.
    pub threads: u32,
    /// Tiles to fill, as densely as they hold the charts. 1 to 100. 0, the default: one.
    pub tiles: u64,
    /// Texels per unit of length on the surface, in as many tiles as that takes. > 0. SRF_FROM_DATA, the default: as many
    /// as fit the tiles.
    pub texels_per_unit: f64,
    /// Columns and rows of a tile, in texels. 16 to 16384, default 2048.
    pub size: u64,
    /// Texels that stay free around each chart, twice as many between two. Mipmaps of level n need 2^n. 0 to 256, default
    /// 4.
    pub padding: u64,
    /// Largest angle between the normal of a triangle and the mean normal of its chart. Smaller angles make flatter charts
    /// and more of them. Radians, 0.017453292519943295 to 1.5533430342749532, default 1.2217304763960306.
    pub cone: f64,
    /// Largest factor by which the area of a triangle in the texture may differ from its share of the chart, either way.
    /// Charts that exceed it are split. 1.1 to 1000, default 4.
    pub max_stretch: f64,
}

impl Fields for srf_unwrap_params {
    fn defaults() -> Self {
        srf_unwrap_params {
            struct_size: size_of::<Self>() as u32,
            threads: 0,
            tiles: 0,
            texels_per_unit: SRF_FROM_DATA,
            size: 2048,
            padding: 4,
            cone: 1.2217304763960306,
            max_stretch: 4.0,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("threads", Given::Threads(self.threads)),
            ("tiles", Given::Whole(self.tiles)),
            ("texels_per_unit", Given::Double(self.texels_per_unit)),
            ("size", Given::Whole(self.size)),
            ("padding", Given::Whole(self.padding)),
            ("cone", Given::Double(self.cone)),
            ("max_stretch", Given::Double(self.max_stretch)),
        ]
    }
}

/// Sets the defaults. Call srf_unwrap_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_unwrap_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_unwrap_params_init_sized(params: *mut srf_unwrap_params, size: usize) -> srf_status {
    guard(|| sized::init("params", params, size, srf_unwrap_params::defaults()))
}
