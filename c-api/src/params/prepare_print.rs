//! Parameters of prepare_print. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::srf_status;

/// The side that gets this length.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_scale_side {
    /// The longest of the sides along x, y and z.
    SRF_SCALE_SIDE_LONGEST = 1,
    /// The side along up.
    SRF_SCALE_SIDE_HEIGHT = 2,
}

/// How a closed mesh is made ready for printing. Each step is left out unless its parameter is given. Lengths are in the
/// unit of the result: if the mesh is scaled, in that of the scaled one. Meshes of scans are in metres. Starts with its
/// size. Set to the defaults by srf_prepare_print_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_prepare_print_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
    /// number.
    pub threads: u32,
    /// Length of the side of the result: 0.1 for a print of 10 cm, if the unit is a metre. All sides are scaled alike. > 0,
    /// at most 1e30. SRF_FROM_DATA, the default: the size stays.
    pub scale_to: f64,
    /// The side that gets this length. A value of srf_scale_side, default SRF_SCALE_SIDE_LONGEST.
    pub scale_side: u64,
    /// Stands the mesh on a flat face: the part below the height of the base is cut off. Off: nothing is cut off. 1 or 0,
    /// default 0.
    pub flat_base: u64,
    /// Height of the base above the lowest point. > 0. SRF_FROM_DATA, the default: 0 if the mesh stands on a face, else at
    /// most a 50th of its height.
    pub base_height: f64,
    /// Thinnest wall that the printer makes. Thinner ones are made as thick, where there is room. > 0. SRF_FROM_DATA, the
    /// default: no wall is moved.
    pub min_wall: f64,
    /// Thickness of the walls around a cavity. Larger ones make smaller cavities. > 0. SRF_FROM_DATA, the default: nothing
    /// is hollowed out.
    pub hollow: f64,
    /// Size of the cells in which the cavity is made, at most a third of the walls. Smaller ones take more memory and time.
    /// > 0. SRF_FROM_DATA, the default: a 256th of the longest side, but from a quarter to a third of the walls.
    pub hollow_cell: f64,
    /// Diameter of a hole that leads from the base into the cavity, so that resin or powder runs out. It needs a base and a
    /// cavity. > 0. SRF_FROM_DATA, the default: the cavity stays shut.
    pub drain: f64,
    /// Sides of the hole, which is a prism. 3 to 1024, default 32.
    pub drain_sides: u64,
    /// Size across up of the space that the printer fills: along x, or along y if up is along x. Larger meshes are cut into
    /// parts. > 0. SRF_FROM_DATA, the default: any.
    pub printer_width: f64,
    /// Size across up of the space that the printer fills: along y, or along z if up is not along z. > 0. SRF_FROM_DATA,
    /// the default: any.
    pub printer_depth: f64,
    /// Size along up of the space that the printer fills. > 0. SRF_FROM_DATA, the default: any.
    pub printer_height: f64,
    /// Direction away from the plate that is printed on. A value of srf_print_up, default SRF_PRINT_UP_Z.
    pub print_up: u64,
}

impl Fields for srf_prepare_print_params {
    fn defaults() -> Self {
        srf_prepare_print_params {
            struct_size: size_of::<Self>() as u32,
            threads: 0,
            scale_to: SRF_FROM_DATA,
            scale_side: 1,
            flat_base: 0,
            base_height: SRF_FROM_DATA,
            min_wall: SRF_FROM_DATA,
            hollow: SRF_FROM_DATA,
            hollow_cell: SRF_FROM_DATA,
            drain: SRF_FROM_DATA,
            drain_sides: 32,
            printer_width: SRF_FROM_DATA,
            printer_depth: SRF_FROM_DATA,
            printer_height: SRF_FROM_DATA,
            print_up: 1,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("threads", Given::Threads(self.threads)),
            ("scale_to", Given::Double(self.scale_to)),
            ("scale_side", Given::Whole(self.scale_side)),
            ("flat_base", Given::Whole(self.flat_base)),
            ("base_height", Given::Double(self.base_height)),
            ("min_wall", Given::Double(self.min_wall)),
            ("hollow", Given::Double(self.hollow)),
            ("hollow_cell", Given::Double(self.hollow_cell)),
            ("drain", Given::Double(self.drain)),
            ("drain_sides", Given::Whole(self.drain_sides)),
            ("printer_width", Given::Double(self.printer_width)),
            ("printer_depth", Given::Double(self.printer_depth)),
            ("printer_height", Given::Double(self.printer_height)),
            ("print_up", Given::Whole(self.print_up)),
        ]
    }
}

/// Sets the defaults. Call srf_prepare_print_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_prepare_print_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_prepare_print_params_init_sized(
    params: *mut srf_prepare_print_params,
    size: usize,
) -> srf_status {
    guard(|| sized::init("params", params, size, srf_prepare_print_params::defaults()))
}
