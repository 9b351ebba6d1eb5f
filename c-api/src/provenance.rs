//! Provenance: what files say of where they are from.

use std::ffi::c_char;

use surfrecon::export::{Holding, Provenance, WriteOptions, tell_left_out, write_e57, write_mesh};
use surfrecon::import;

use crate::crs::give;
use crate::files::path_of;
use crate::guard::guard;
use crate::image::srf_image;
use crate::mesh::srf_mesh;
use crate::params::write::srf_write_options;
use crate::progress::{srf_progress, watched};
use crate::status::{Failure, srf_status};
use crate::write::write_images;
use crate::{handle, params, pointer};

/// The provenance that a file is to say. NULL for nothing.
pub fn provenance_of(json: *const c_char) -> Result<Option<Provenance>, Failure> {
    if json.is_null() { Ok(None) } else { Ok(Some(Provenance::from_json(pointer::text("provenance", json)?)?)) }
}

/// Writes a mesh as srf_mesh_write() does, and says in the file where it is from.
/// mesh        not NULL
/// path        UTF-8. Not NULL
/// options     NULL for the defaults
/// provenance  an object in JSON, as program, parameters and hashes of what was read: .ply and .obj have it as comments, .glb in
///             asset.extras.surfrecon, .stl and .3mf have no place for it. NULL for none
/// progress    NULL for none
/// returns     SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT for another ending and for what is no such object, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED,
///             SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_write_from(
    mesh: *const srf_mesh,
    path: *const c_char,
    options: *const srf_write_options,
    provenance: *const c_char,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        let (mesh, path) = (handle::get("mesh", mesh)?, path_of("path", path)?);
        let options = WriteOptions { provenance: provenance_of(provenance)?, ..params::read("options", options)? };
        watched(progress, |progress| {
            write_mesh(path, &mesh.mesh, &[], &options, progress)?;
            tell_left_out(path, Holding::Mesh, mesh.mesh.crs.as_ref());
            Ok(())
        })
    })
}

/// Writes images as srf_images_write_e57() does, and says in the file where it is from. That is the text provenance of its root, in a
/// namespace of its own, which readers that do not know it pass over.
/// images      none of them NULL. Not NULL
/// count       number of images, at least 1
/// path        UTF-8. Not NULL
/// provenance  an object in JSON. NULL for none
/// progress    NULL for none
/// returns     SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT for what is no such object and for images of different systems, SRF_ERR_PARAMETER,
///             SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_images_write_e57_from(
    images: *const *const srf_image,
    count: usize,
    path: *const c_char,
    provenance: *const c_char,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        let provenance = provenance_of(provenance)?;
        write_images(images, count, path, progress, |path, images, progress| {
            write_e57(path, images, provenance.as_ref(), progress)
        })
    })
}

/// The provenance that a file of this library says: .ply, .obj, .glb, .e57.
/// path        UTF-8. Not NULL
/// out_text    receives an object in JSON with its zero byte, an empty text where the file says nothing. NULL if not wanted
/// capacity    room there, in bytes
/// out_length  receives the length of the text without its zero byte. Not NULL
/// returns     SRF_OK, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_file_provenance(
    path: *const c_char,
    out_text: *mut c_char,
    capacity: usize,
    out_length: *mut usize,
) -> srf_status {
    guard(|| {
        pointer::writable("out_length", out_length)?;
        let said = import::provenance(path_of("path", path)?)?;
        give(&said.map_or_else(String::new, |said| said.to_json()), out_text, capacity, out_length)
    })
}
