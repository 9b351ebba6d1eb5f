//! Coordinate reference systems of surveys.

use std::ffi::c_char;

use surfrecon::mesh::Crs;

use crate::cloud::srf_cloud;
use crate::files::{at, srf_scans};
use crate::guard::guard;
use crate::image::srf_image;
use crate::mesh::srf_mesh;
use crate::status::{Failure, srf_status, srf_status::*};
use crate::{handle, pointer};

/// Writes a text where the caller has room for it, and how long it is.
pub fn give(text: &str, out_text: *mut c_char, capacity: usize, out_length: *mut usize) -> Result<(), Failure> {
    let text = crate::text::c_text(text);
    pointer::write("out_length", out_length, text.as_bytes().len())?;
    if out_text.is_null() {
        return Ok(());
    }
    let bytes = text.as_bytes_with_nul();
    if capacity < bytes.len() {
        let problem = format!("capacity must be at least {}, got {capacity}", bytes.len());
        return Err(Failure::new(SRF_ERR_PARAMETER, problem));
    }
    pointer::copy_out("out_text", out_text.cast::<u8>(), bytes)
}

fn give_crs(crs: Option<&Crs>, out_text: *mut c_char, capacity: usize, out_length: *mut usize) -> Result<(), Failure> {
    give(crs.map_or("", Crs::text), out_text, capacity, out_length)
}

/// The system that a text names. NULL or an empty one for none.
fn crs_of(text: *const c_char) -> Result<Option<Crs>, Failure> {
    let text = if text.is_null() { "" } else { pointer::text("text", text)? };
    Ok(if text.is_empty() { None } else { Some(Crs::new(text)?) })
}

/// The coordinate reference system that scans of files lie in, as their files name it: well-known text, or a code as EPSG:25832.
/// Nothing is transformed: scans of different systems, or in degrees, are not merged or aligned, and results keep the text.
/// scans       not NULL
/// index       less than the number of scans. SIZE_MAX for what all that name one agree on
/// out_text    receives the text with its zero byte, an empty one for none. NULL if not wanted
/// capacity    room there, in bytes
/// out_length  receives the length of the text without its zero byte. Not NULL
/// returns     SRF_OK, SRF_ERR_INPUT where scans disagree or are in degrees, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_IO,
///             SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scans_crs(
    scans: *const srf_scans,
    index: usize,
    out_text: *mut c_char,
    capacity: usize,
    out_length: *mut usize,
) -> srf_status {
    guard(|| {
        pointer::writable("out_length", out_length)?;
        let scans = handle::get("scans", scans)?;
        let crs = if index == usize::MAX { scans.set.crs()? } else { at(&scans.set.scans, index)?.crs()? };
        give_crs(crs.as_ref(), out_text, capacity, out_length)
    })
}

/// Says which coordinate reference system scans lie in, whatever their files name.
/// scans      not NULL
/// index      less than the number of scans. SIZE_MAX for all of them
/// text       UTF-8. NULL or empty for none
/// returns    SRF_OK, SRF_ERR_INPUT for what names none, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scans_set_crs(scans: *mut srf_scans, index: usize, text: *const c_char) -> srf_status {
    guard(|| {
        let crs = crs_of(text)?;
        handle::change("scans", scans.cast_const(), |scans| {
            let all = &mut scans.set.scans;
            if index == usize::MAX {
                all.iter_mut().for_each(|scan| scan.set_crs(crs.clone()));
            } else {
                at(all, index)?;
                all[index].set_crs(crs.clone());
            }
            Ok(())
        })
    })
}

/// The coordinate reference system of the world that an image lies in, which its pose places it in.
/// image       not NULL
/// out_text    as for srf_scans_crs()
/// capacity    room there, in bytes
/// out_length  receives the length of the text without its zero byte. Not NULL
/// returns     SRF_OK, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_crs(
    image: *const srf_image,
    out_text: *mut c_char,
    capacity: usize,
    out_length: *mut usize,
) -> srf_status {
    guard(|| give_crs(handle::get("image", image)?.image.crs.as_ref(), out_text, capacity, out_length))
}

/// Says which coordinate reference system the world of an image is in. Views of the image are gone.
/// image      not NULL
/// text       UTF-8. NULL or empty for none
/// returns    SRF_OK, SRF_ERR_INPUT for what names none, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_set_crs(image: *mut srf_image, text: *const c_char) -> srf_status {
    guard(|| {
        let crs = crs_of(text)?;
        handle::change("image", image.cast_const(), |image| {
            image.image.crs = crs;
            Ok(())
        })
    })
}

/// The coordinate reference system of the world that a cloud lies in, which its pose places it in.
/// cloud       not NULL
/// out_text    as for srf_scans_crs()
/// capacity    room there, in bytes
/// out_length  receives the length of the text without its zero byte. Not NULL
/// returns     SRF_OK, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_crs(
    cloud: *const srf_cloud,
    out_text: *mut c_char,
    capacity: usize,
    out_length: *mut usize,
) -> srf_status {
    guard(|| give_crs(handle::get("cloud", cloud)?.crs.as_ref(), out_text, capacity, out_length))
}

/// Says which coordinate reference system the world of a cloud is in. Views of the cloud are gone.
/// cloud      not NULL
/// text       UTF-8. NULL or empty for none
/// returns    SRF_OK, SRF_ERR_INPUT for what names none, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_set_crs(cloud: *mut srf_cloud, text: *const c_char) -> srf_status {
    guard(|| {
        let crs = crs_of(text)?;
        handle::change("cloud", cloud.cast_const(), |cloud| {
            cloud.crs = crs;
            Ok(())
        })
    })
}

/// The coordinate reference system that the coordinates of a mesh are in. Results have that of the scans they were made of, unless they are
/// in the frame of one whose pose moves it. Meshes that are transformed have none any more. srf_mesh_write() puts it into .ply, .glb and
/// .obj. A system that can't be said goes to the log.
/// mesh        not NULL
/// out_text    as for srf_scans_crs()
/// capacity    room there, in bytes
/// out_length  receives the length of the text without its zero byte. Not NULL
/// returns     SRF_OK, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_crs(
    mesh: *const srf_mesh,
    out_text: *mut c_char,
    capacity: usize,
    out_length: *mut usize,
) -> srf_status {
    guard(|| give_crs(handle::get("mesh", mesh)?.mesh.crs.as_ref(), out_text, capacity, out_length))
}

/// Says which coordinate reference system the coordinates of a mesh are in. Views of the mesh are gone.
/// mesh       not NULL
/// text       UTF-8. NULL or empty for none
/// returns    SRF_OK, SRF_ERR_INPUT for what names none, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_set_crs(mesh: *mut srf_mesh, text: *const c_char) -> srf_status {
    guard(|| {
        let crs = crs_of(text)?;
        handle::change("mesh", mesh.cast_const(), |mesh| {
            mesh.mesh.crs = crs;
            Ok(())
        })
    })
}
