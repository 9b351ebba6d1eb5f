//! Quad grids of range images.

use std::ffi::c_char;

use surfrecon::export::{Polygons, write_obj_polygons};
use surfrecon::mesh::{AttributeData, QuadMesh};
use surfrecon::quads::{self, QuadGrid, QuadParams};
use surfrecon::reports::Report as _;

use crate::array::{self, srf_array};
use crate::files::path_of;
use crate::guard::guard;
use crate::handle::{self, handle};
use crate::image::srf_image;
use crate::mesh::srf_mesh;
use crate::params::quads::srf_quads_params;
use crate::progress::{srf_progress, watched};
use crate::reports::quads::srf_quads_report;
use crate::status::{Failure, srf_status};
use crate::{params, pointer, report, sized};

/// A grid with the mesh of its quads that are not on the background.
pub struct Gridded {
    pub grid: QuadGrid,
    mesh: QuadMesh,
}

/// A regular grid of quads over a range image, dense where the surface bends. Released with srf_quads_free().
#[allow(non_camel_case_types)]
pub struct srf_quads {
    _opaque: [u8; 0],
}

handle!(srf_quads, Gridded);

/// Makes a quad grid of an image. Every vertex lies on a pixel of its own. Seen on the pixels no quad folds over. The grid covers the whole
/// image, and its mean error is at most that of the uniform grid of the same size. O(pixels).
/// image       not NULL
/// params      NULL for the defaults
/// progress    NULL for none
/// out_quads   receives a new handle on SRF_OK only. Not NULL
/// out_report  initialized by srf_quads_report_init(). NULL if not wanted
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL,
///             SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_quads_create(
    image: *const srf_image,
    params: *const srf_quads_params,
    progress: *const srf_progress,
    out_quads: *mut *mut srf_quads,
    out_report: *mut srf_quads_report,
) -> srf_status {
    guard(|| {
        pointer::writable("out_quads", out_quads)?;
        if !out_report.is_null() {
            sized::writable("out_report", out_report)?;
        }
        let image = handle::get("image", image)?;
        let params = params::read::<QuadParams, _>("params", params)?;
        watched(progress, |progress| {
            let grid = quads::run(&image.image, &params, progress)?;
            if !out_report.is_null() {
                report::write("out_report", out_report, grid.report.values())?;
            }
            let mesh = grid.mesh();
            handle::give("out_quads", out_quads, Gridded { grid, mesh })
        })
    })
}

/// Releases a quad grid. Views of it are gone.
/// quads      NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_quads_free(quads: *mut srf_quads) -> srf_status {
    guard(|| handle::free("quads", quads))
}

/// All vertices of the grid, those on the background as well, row after row of rows * cols.
/// quads           not NULL
/// out_rows        rows of vertices. NULL if not wanted
/// out_cols        columns of vertices. NULL if not wanted
/// out_positions   3 SRF_TYPE_F64 per vertex, in the sensor's frame. On the background a continuation of the surface. NULL if not wanted
/// out_pixels      2 SRF_TYPE_U32 per vertex: row and column of its pixel, rising strictly along both. NULL if not wanted
/// out_background  one SRF_TYPE_U8 per vertex, 1 on pixels without a sample. NULL if not wanted
/// returns         SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_quads_grid(
    quads: *const srf_quads,
    out_rows: *mut usize,
    out_cols: *mut usize,
    out_positions: *mut srf_array,
    out_pixels: *mut srf_array,
    out_background: *mut srf_array,
) -> srf_status {
    guard(|| {
        let quads = handle::get("quads", quads)?;
        let grid = &quads.grid;
        give("out_rows", out_rows, grid.rows)?;
        give("out_cols", out_cols, grid.cols)?;
        give("out_positions", out_positions, array::points(&grid.positions))?;
        give("out_pixels", out_pixels, array::pixels(&grid.pixels))?;
        give("out_background", out_background, array::flags(&grid.background))
    })
}

/// The quads that are not on the background, with the vertices they use.
/// quads          not NULL
/// out_positions  3 SRF_TYPE_F64 per vertex, in the sensor's frame. NULL if not wanted
/// out_uvs        2 SRF_TYPE_F32 per vertex: image coordinates, 0 to 1 from the left and from the bottom. NULL if not wanted
/// out_corners    4 SRF_TYPE_U32 per quad, counter-clockwise seen from the sensor. NULL if not wanted
/// out_errors     one SRF_TYPE_F32 per quad: largest distance of the samples seen in it. NULL if not wanted
/// returns        SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_quads_faces(
    quads: *const srf_quads,
    out_positions: *mut srf_array,
    out_uvs: *mut srf_array,
    out_corners: *mut srf_array,
    out_errors: *mut srf_array,
) -> srf_status {
    guard(|| {
        let quads = handle::get("quads", quads)?;
        let mesh = &quads.mesh;
        let errors = mesh.face_attributes.iter().find(|a| a.name == "error");
        give("out_positions", out_positions, array::points(&mesh.positions))?;
        give("out_uvs", out_uvs, array::uvs(&mesh.uvs))?;
        give("out_corners", out_corners, array::quads(&mesh.quads))?;
        give("out_errors", out_errors, errors.map_or(array::values_f32(&[]), |a| array::attribute(&a.data)))
    })
}

fn give<T>(name: &str, out: *mut T, value: T) -> Result<(), Failure> {
    if out.is_null() { Ok(()) } else { pointer::write(name, out, value) }
}

/// The quads as triangles, each cut along the diagonal that lies nearer to the samples: quad q is the triangles 2 q and 2 q + 1. Vertices
/// are those of srf_quads_faces(), with the attributes range_row, range_col, grid_row, grid_col, and colour, intensity, confidence where
/// the image has them. Attribute of triangles: error.
/// quads      not NULL
/// out_mesh   receives a new handle on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_quads_triangles(quads: *const srf_quads, out_mesh: *mut *mut srf_mesh) -> srf_status {
    guard(|| {
        pointer::writable("out_mesh", out_mesh)?;
        let quads = handle::get("quads", quads)?;
        handle::give("out_mesh", out_mesh, quads.grid.triangles().into())
    })
}

/// Writes the quads as OBJ, with colours. A file of that name is replaced once all is written, or stays.
/// quads      not NULL
/// path       UTF-8. Not NULL
/// progress   NULL for none
/// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_quads_write_obj(
    quads: *const srf_quads,
    path: *const c_char,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        let (quads, path) = (handle::get("quads", quads)?, path_of("path", path)?);
        let mesh = &quads.mesh;
        let colour = mesh.vertex_attributes.iter().find_map(|a| match &a.data {
            AttributeData::Colour(colour) if a.name == "colour" => Some(&colour[..]),
            _ => None,
        });
        let polygons = Polygons {
            positions: &mesh.positions,
            colour,
            quads: &mesh.quads,
            triangles: &[],
            provenance: None,
            crs: mesh.crs.as_ref(),
        };
        watched(progress, |progress| Ok(write_obj_polygons(path, &polygons, progress)?))
    })
}
