//! Parameters of spline. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// How a surface is fitted to a quad grid. Starts with its size. Set to the defaults by srf_spline_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_spline_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Order of the surface, its degree plus one: 2 is made of straight pieces, 4 is cubic. 2 to 4, default 4.
    pub order: u64,
    /// Rows of control points, from the order to the grid's rows. Fewer make the surface smoother, in the sense of least
    /// squares. 2 to 67108864. 0, the default: as many as the grid has, so that the surface runs through its vertices.
    pub rows: u64,
    /// Columns of control points, from the order to the grid's columns. Fewer make the surface smoother, in the sense of
    /// least squares. 2 to 67108864. 0, the default: as many as the grid has, so that the surface runs through its
    /// vertices.
    pub columns: u64,
}

impl Fields for srf_spline_params {
    fn defaults() -> Self {
        srf_spline_params { struct_size: size_of::<Self>() as u32, reserved: 0, order: 4, rows: 0, columns: 0 }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("reserved", Given::Reserved(self.reserved)),
            ("order", Given::Whole(self.order)),
            ("rows", Given::Whole(self.rows)),
            ("columns", Given::Whole(self.columns)),
        ]
    }
}

/// Sets the defaults. Call srf_spline_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_spline_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_spline_params_init_sized(params: *mut srf_spline_params, size: usize) -> srf_status {
    guard(|| sized::init("params", params, size, srf_spline_params::defaults()))
}
