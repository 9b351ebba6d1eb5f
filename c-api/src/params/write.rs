//! Parameters of write. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// Axis of the mesh that points up, for glTF, where y does.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_up {
    /// As glTF has it: nothing is turned.
    SRF_UP_Y = 1,
    /// A node above all others turns z up to y up.
    SRF_UP_Z = 2,
}

/// Form of the numbers in PLY files. Other formats have one way.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_encoding {
    /// Coordinates in single precision unless they lie so far from the origin that they would lose detail.
    SRF_ENCODING_BINARY = 1,
    /// Coordinates in double precision.
    SRF_ENCODING_BINARY_DOUBLE = 2,
    /// Coordinates with the fewest digits that read back as the same numbers.
    SRF_ENCODING_ASCII = 3,
}

/// How a mesh is written. Starts with its size. Set to the defaults by srf_write_options_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_write_options {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Metres a unit of the mesh, for glTF, which is in metres, and 3MF, which says its unit: 0.001 for millimetres. STL
    /// files say it in their header, unless it is 1, and are then read in metres. Other formats keep the unit. > 0, default
    /// 1.
    pub metres_per_unit: f64,
    /// Axis of the mesh that points up, for glTF, where y does. A value of srf_up, default SRF_UP_Y.
    pub up: u64,
    /// Form of the numbers in PLY files. Other formats have one way. A value of srf_encoding, default SRF_ENCODING_BINARY.
    pub encoding: u64,
    /// A PLY file gets no more triangles than this. Of a larger mesh it gets the first, and files beside it called
    /// name-2-of-3.ply and so on get the others. Each has the vertices that its triangles name, so that parts meet in
    /// vertices of the same coordinates. 0: one file. 0 to 2147483647, default 0.
    pub part_triangles: u64,
}

impl Fields for srf_write_options {
    fn defaults() -> Self {
        srf_write_options {
            struct_size: size_of::<Self>() as u32,
            reserved: 0,
            metres_per_unit: 1.0,
            up: 1,
            encoding: 1,
            part_triangles: 0,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("reserved", Given::Reserved(self.reserved)),
            ("metres_per_unit", Given::Double(self.metres_per_unit)),
            ("up", Given::Whole(self.up)),
            ("encoding", Given::Whole(self.encoding)),
            ("part_triangles", Given::Whole(self.part_triangles)),
        ]
    }
}

/// Sets the defaults. Call srf_write_options_init(options), which adds the size that this header knows.
/// options  not NULL
/// size     sizeof(srf_write_options): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_write_options_init_sized(options: *mut srf_write_options, size: usize) -> srf_status {
    guard(|| sized::init("options", options, size, srf_write_options::defaults()))
}
