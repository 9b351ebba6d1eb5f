//! Writing files.

use std::ffi::c_char;
use std::path::Path;

use surfrecon::Progress;
use surfrecon::export::{self, Encoding, GlbNode, GlbOptions, Holding, Up, tell_left_out};
use surfrecon::range_image::RangeImage;

use crate::cloud::srf_cloud;
use crate::files::path_of;
use crate::guard::guard;
use crate::handle::Shared;
use crate::image::{Image, srf_image};
use crate::mesh::{Mesh, srf_mesh};
use crate::params::write::srf_write_options;
use crate::progress::{srf_progress, watched};
use crate::status::{Failure, flag, srf_status, srf_status::*};
use crate::{handle, params, pointer};

/// A value of srf_encoding.
fn encoding_of(given: u32) -> Result<Encoding, Failure> {
    let chosen = given.checked_sub(1).and_then(|place| Encoding::ALL.get(place as usize));
    chosen.copied().ok_or_else(|| {
        Failure::new(SRF_ERR_PARAMETER, format!("encoding must be a value of srf_encoding, 1 to 3, got {given}"))
    })
}

/// Writes a mesh by the ending of the file's name, the writer to take unless another is needed. .ply has all attributes. .glb (binary glTF)
/// has those of vertices, and its node is named as the file without the ending. .obj has colours. .stl has none. .3mf has the unit
/// and colours, for slicers. A file of that name is replaced once all is written, or stays as it is.
/// mesh       not NULL
/// path       UTF-8. Not NULL
/// options    NULL for the defaults
/// progress   NULL for none
/// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT for another ending, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
///            SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_write(
    mesh: *const srf_mesh,
    path: *const c_char,
    options: *const srf_write_options,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        let (mesh, path) = (handle::get("mesh", mesh)?, path_of("path", path)?);
        let options = params::read("options", options)?;
        watched(progress, |progress| {
            export::write_mesh(path, &mesh.mesh, &[], &options, progress)?;
            tell_left_out(path, Holding::Mesh, mesh.mesh.crs.as_ref());
            Ok(())
        })
    })
}

/// Checks, before the work that a mesh takes, that srf_mesh_write() knows the ending of a file's name and has what options ask for. No
/// file is looked at.
/// file       its name, UTF-8. Not NULL
/// options    NULL for the defaults
/// returns    SRF_OK, SRF_ERR_INPUT for another ending, and for an encoding that its format does not have, SRF_ERR_PARAMETER,
///            SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_check_mesh_file(file: *const c_char, options: *const srf_write_options) -> srf_status {
    guard(|| {
        export::check_mesh_file(path_of("file", file)?, &params::read("options", options)?)?;
        Ok(())
    })
}

/// Writes a mesh with all its attributes as PLY, whatever the file's name ends with. A file of that name is replaced once all is written,
/// or stays as it is.
/// mesh       not NULL
/// path       UTF-8. Not NULL
/// encoding   a value of srf_encoding
/// progress   NULL for none
/// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_write_ply(
    mesh: *const srf_mesh,
    path: *const c_char,
    encoding: u32,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        let (mesh, path) = (handle::get("mesh", mesh)?, path_of("path", path)?);
        watched(progress, |progress| Ok(export::write_ply(path, &mesh.mesh, encoding_of(encoding)?, progress)?))
    })
}

/// Writes a mesh with its attributes of vertices as binary glTF, whatever the file's name ends with. A file of that name is replaced once
/// all is written, or stays.
/// mesh             not NULL
/// path             UTF-8. Not NULL
/// name             of the node, UTF-8. NULL for "mesh"
/// metres_per_unit  of the mesh's coordinates, > 0: 0.001 for millimetres
/// z_up             1 if z points up in the mesh's coordinates, 0 if y does, as glTF has it
/// progress         NULL for none
/// returns          SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_write_glb(
    mesh: *const srf_mesh,
    path: *const c_char,
    name: *const c_char,
    metres_per_unit: f64,
    z_up: u32,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        let (mesh, path) = (handle::get("mesh", mesh)?, path_of("path", path)?);
        write_glb(&[mesh], path, name, metres_per_unit, z_up, progress)
    })
}

/// Writes a mesh and coarser ones of the same surface as binary glTF with levels of detail (MSFT_lod). Viewers that know the extension show
/// the coarser ones when the object is small on the screen, others the finest. A file of that name is replaced once all is written, or
/// stays.
/// meshes           finest first, each with no more triangles than the one before, none of them NULL. Not NULL
/// count            number of meshes, at least 1
/// path             UTF-8. Not NULL
/// name             of the node, UTF-8. NULL for "mesh"
/// metres_per_unit  of the meshes' coordinates, > 0: 0.001 for millimetres
/// z_up             1 if z points up in the meshes' coordinates, 0 if y does, as glTF has it
/// progress         NULL for none
/// returns          SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_meshes_write_glb_levels(
    meshes: *const *const srf_mesh,
    count: usize,
    path: *const c_char,
    name: *const c_char,
    metres_per_unit: f64,
    z_up: u32,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        let pointers = pointer::pointers("meshes", meshes, count)?;
        let path = path_of("path", path)?;
        let get = |(i, mesh): (usize, *const srf_mesh)| handle::get(&format!("meshes[{i}]"), mesh);
        let meshes = pointers.into_iter().enumerate().map(get).collect::<Result<Vec<_>, Failure>>()?;
        write_glb(&meshes, path, name, metres_per_unit, z_up, progress)
    })
}

/// Writes levels, the finest first.
fn write_glb(
    meshes: &[Shared<Mesh>],
    path: &Path,
    name: *const c_char,
    metres_per_unit: f64,
    z_up: u32,
    progress: *const srf_progress,
) -> Result<(), Failure> {
    if !(metres_per_unit > 0.0 && metres_per_unit.is_finite()) {
        let text = format!("metres_per_unit must be a finite number > 0, got {metres_per_unit}");
        return Err(Failure::new(SRF_ERR_PARAMETER, text));
    }
    let name = if name.is_null() { "mesh" } else { pointer::text("name", name)? };
    let up = if flag("z_up", z_up)? { Up::Z } else { Up::Y };
    let levels: Vec<_> = meshes.iter().map(|mesh| &mesh.mesh).collect();
    let Some((mesh, coarser)) = levels.split_first() else {
        return Err(Failure::new(SRF_ERR_PARAMETER, "there is no mesh to write: count is 0"));
    };
    let node = GlbNode { name, mesh, world_from_mesh: glam::DAffine3::IDENTITY, coarser, images: None };
    let options = GlbOptions { up, metres_per_unit, ..GlbOptions::default() };
    watched(progress, |progress| Ok(export::write_glb(path, &[node], &options, progress)?))
}

/// Writes a mesh as Wavefront OBJ, whatever the file's name ends with, with the colours of its vertices. Coordinates keep double precision.
/// A file of that name is replaced once all is written, or stays.
/// mesh       not NULL
/// path       UTF-8. Not NULL
/// progress   NULL for none
/// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_write_obj(
    mesh: *const srf_mesh,
    path: *const c_char,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        let (mesh, path) = (handle::get("mesh", mesh)?, path_of("path", path)?);
        watched(progress, |progress| Ok(export::write_obj(path, &mesh.mesh, None, progress)?))
    })
}

/// Writes a mesh as binary STL, whatever the file's name ends with, in single precision and without attributes. A file of that name is
/// replaced once all is written, or stays.
/// mesh       not NULL. SRF_ERR_INPUT if it lies so far from the origin that single precision would lose its detail
/// path       UTF-8. Not NULL
/// progress   NULL for none
/// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_write_stl(
    mesh: *const srf_mesh,
    path: *const c_char,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        let (mesh, path) = (handle::get("mesh", mesh)?, path_of("path", path)?);
        watched(progress, |progress| {
            export::write_stl(path, &mesh.mesh, 1.0, progress)?;
            tell_left_out(path, Holding::Mesh, mesh.mesh.crs.as_ref());
            Ok(())
        })
    })
}

/// Writes a cloud with its normals, colours and intensities as PLY, in its own frame: its pose is not written. A file of that
/// name is replaced once all is written, or stays.
/// cloud      not NULL
/// path       UTF-8. Not NULL
/// encoding   a value of srf_encoding
/// progress   NULL for none
/// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_write_ply(
    cloud: *const srf_cloud,
    path: *const c_char,
    encoding: u32,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        let (cloud, path) = (handle::get("cloud", cloud)?, path_of("path", path)?);
        watched(progress, |progress| Ok(export::write_points_ply(path, &cloud, encoding_of(encoding)?, progress)?))
    })
}

/// Lets images behind handles be written.
pub fn write_images(
    images: *const *const srf_image,
    count: usize,
    path: *const c_char,
    progress: *const srf_progress,
    write: impl FnOnce(&Path, &[&RangeImage], &Progress<'_>) -> surfrecon::Result<()>,
) -> Result<(), Failure> {
    let pointers = pointer::pointers("images", images, count)?;
    let path = path_of("path", path)?;
    let images = pointers
        .into_iter()
        .enumerate()
        .map(|(i, image)| handle::get(&format!("images[{i}]"), image))
        .collect::<Result<Vec<Shared<Image>>, Failure>>()?;
    if images.is_empty() {
        return Err(Failure::new(SRF_ERR_PARAMETER, "there is no image to write: count is 0"));
    }
    let images: Vec<&RangeImage> = images.iter().map(|image| &image.image).collect();
    watched(progress, |progress| {
        write(path, &images, progress)?;
        tell_left_out(path, Holding::Images, images.iter().find_map(|image| image.crs.as_ref()));
        Ok(())
    })
}

/// Writes images so that they open as one set. Each becomes a Stanford range grid (PLY) named like it, in the folder of path. The list
/// (.conf) places them. Files of these names are replaced one by one, the list last.
/// images     none of them NULL. Names must differ and be those of files. Rays within half a sphere. Not NULL
/// count      number of images, at least 1
/// path       of the list, UTF-8, ending in .conf. Not NULL
/// encoding   of the grids, a value of srf_encoding. Coordinates are in single precision in any
/// progress   NULL for none
/// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_images_write_conf(
    images: *const *const srf_image,
    count: usize,
    path: *const c_char,
    encoding: u32,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        // A wrong pointer is told first, as everywhere.
        pointer::text("path", path)?;
        let options = encoding_of(encoding)?;
        write_images(images, count, path, progress, |path, images, progress| {
            export::write_scan_list(path, images, options, progress)
        })
    })
}

/// Writes images with their poses as one PTX file, for images seen from a point. Points are in single precision. Confidences have no place
/// in the format. A file of that name is replaced once all is written, or stays.
/// images     none of them NULL. Not NULL
/// count      number of images, at least 1
/// path       UTF-8. Not NULL
/// progress   NULL for none
/// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_images_write_ptx(
    images: *const *const srf_image,
    count: usize,
    path: *const c_char,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| write_images(images, count, path, progress, export::write_ptx))
}

/// Writes images with their poses and names as structured scans of one E57 file, for images seen from a point. Points are in single
/// precision. Confidences have no place in the format. A file of that name is replaced once all is written, or stays.
/// images     none of them NULL. Not NULL
/// count      number of images, at least 1
/// path       UTF-8. Not NULL
/// progress   NULL for none
/// returns    SRF_OK, SRF_ERR_IO, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_images_write_e57(
    images: *const *const srf_image,
    count: usize,
    path: *const c_char,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        write_images(images, count, path, progress, |path, images, progress| {
            export::write_e57(path, images, None, progress)
        })
    })
}
