//! Reading files.

use std::ffi::{CString, c_char};
use std::path::Path;
use std::sync::Arc;

use surfrecon::Progress;
use surfrecon::import::{self, Camera, Content, ReadOptions, ScanSet};

use crate::cloud::srf_cloud;
use crate::given::Fields as _;
use crate::guard::guard;
use crate::handle::{self, handle};
use crate::image::srf_image;
use crate::mesh::srf_mesh;
use crate::params::open::srf_read_options;
use crate::pose::{self, srf_pose};
use crate::progress::{srf_progress, watched};
use crate::status::{Failure, srf_status, srf_status::*};
use crate::text::c_text;
use crate::{params, pointer, sized};

/// Scans opened together, with texts as C wants them.
#[derive(Clone)]
pub struct Scans {
    pub set: ScanSet,
    /// Shared by the copies that are made where a set is changed while others work with it: texts that were handed out stay.
    names: Arc<[CString]>,
    notes: Arc<[CString]>,
}

/// Scans of one or several files, opened but not read: their samples stay on disk until they are needed. Released with
/// srf_scans_free().
#[allow(non_camel_case_types)]
pub struct srf_scans {
    _opaque: [u8; 0],
}

handle!(srf_scans, Scans);

/// Sort of content of a scan.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_content {
    /// A srf_image.
    SRF_CONTENT_IMAGE = 1,
    /// A srf_mesh.
    SRF_CONTENT_MESH = 2,
    /// A srf_cloud.
    SRF_CONTENT_CLOUD = 3,
}

pub fn path_of<'a>(name: &str, path: *const c_char) -> Result<&'a Path, Failure> {
    let path = pointer::text(name, path)?;
    if path.is_empty() {
        return Err(Failure::new(SRF_ERR_INPUT, format!("{name} must not be empty")));
    }
    Ok(Path::new(path))
}

/// Opens files of scans: single scans, lists that place several, or folders. Formats are recognized by content. Scans are read as PLY
/// (range grids, meshes and points), PTX, E57, PCD, LAS and LAZ, points in text, OBJ, STL, 3MF and glTF. Height maps and depth images are read
/// as PNG, PGM, PFM, OpenEXR, TIFF, NumPy arrays, SRTM tiles and ESRI grids. Lists are read as .conf, .mlp and .aln. Folders, zip archives,
/// .r3d and .sens of recordings of depth cameras and phones give their frames as images with colours. Of the files, a camera makes the
/// images depth images, a trajectory places them. How the files were understood goes to the log too. It reads headers. Of a .conf whose
/// quaternions could mean two things it also reads a few thousand points per scan, to find out which. Damage further on in a file is told
/// when its scan is read.
/// paths       UTF-8. Not NULL, nor is any of them
/// count       number of paths, at least 1
/// options     what the files do not say themselves. NULL for the defaults
/// progress    NULL for none
/// out_scans   receives a new handle on SRF_OK only. Not NULL
/// returns     SRF_OK, SRF_ERR_IO, SRF_ERR_FORMAT naming the place, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
///             SRF_ERR_STRUCT_SIZE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scans_open(
    paths: *const *const c_char,
    count: usize,
    options: *const srf_read_options,
    progress: *const srf_progress,
    out_scans: *mut *mut srf_scans,
) -> srf_status {
    guard(|| watched(progress, |progress| open(paths, count, options, progress, out_scans)))
}

/// The caller's facts on the files. The camera is no parameter of the table.
fn read_options(given: *const srf_read_options) -> Result<ReadOptions, Failure> {
    let given = sized::read("options", given, srf_read_options::defaults())?;
    let ([fx, fy, cx, cy], [cols, rows]) = (given.intrinsics, given.camera_size);
    let mut options: ReadOptions = params::to_core(&given)?;
    if given.intrinsics != [0.0; 4] {
        if (cols == 0) != (rows == 0) {
            let text = format!("camera_size must be columns and rows, or 0 and 0, got {cols} and {rows}");
            return Err(Failure::new(SRF_ERR_PARAMETER, text));
        }
        let size = (cols != 0).then_some([cols as usize, rows as usize]);
        options.camera = Some(Camera { size, ..Camera::new([fx, fy], [cx, cy]) });
    } else if [cols, rows] != [0, 0] {
        return Err(Failure::new(SRF_ERR_PARAMETER, "camera_size goes with intrinsics, which are not given"));
    }
    Ok(options)
}

fn open(
    paths: *const *const c_char,
    count: usize,
    options: *const srf_read_options,
    progress: &Progress<'_>,
    out_scans: *mut *mut srf_scans,
) -> Result<(), Failure> {
    pointer::writable("out_scans", out_scans)?;
    let pointers = pointer::pointers("paths", paths, count)?;
    let paths = pointers
        .into_iter()
        .enumerate()
        .map(|(i, path)| path_of(&format!("paths[{i}]"), path))
        .collect::<Result<Vec<_>, Failure>>()?;
    let options = read_options(options)?;
    let set = import::open_with(&paths, &options, progress)?;
    set.tell();
    let names = set.scans.iter().map(|scan| c_text(&scan.name)).collect();
    let notes = set.notes.iter().map(|note| c_text(note)).collect();
    handle::give("out_scans", out_scans, Scans { set, names, notes })
}

/// Releases a set of scans.
/// scans      NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scans_free(scans: *mut srf_scans) -> srf_status {
    guard(|| handle::free("scans", scans))
}

/// Number of scans, and of notes on how the files were understood.
/// scans      not NULL
/// out_scans  NULL if not wanted
/// out_notes  NULL if not wanted
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scans_count(
    scans: *const srf_scans,
    out_scans: *mut usize,
    out_notes: *mut usize,
) -> srf_status {
    guard(|| {
        let scans = handle::get("scans", scans)?;
        let give = |name, out: *mut usize, value| if out.is_null() { Ok(()) } else { pointer::write(name, out, value) };
        give("out_scans", out_scans, scans.names.len())?;
        give("out_notes", out_notes, scans.notes.len())
    })
}

/// The entry of a number, counted from 0.
pub fn at<T>(all: &[T], index: usize) -> Result<&T, Failure> {
    let refused = || Failure::new(SRF_ERR_PARAMETER, format!("index must be < {}, got {index}", all.len()));
    all.get(index).ok_or_else(refused)
}

/// A note on how the files were understood.
/// scans      not NULL
/// index      less than the number of notes
/// out_note   receives a text that stays until the set is freed, on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scans_note(
    scans: *const srf_scans,
    index: usize,
    out_note: *mut *const c_char,
) -> srf_status {
    guard(|| pointer::write("out_note", out_note, at(&handle::get("scans", scans)?.notes, index)?.as_ptr()))
}

/// Name and place of a scan.
/// scans      not NULL
/// index      less than the number of scans
/// out_name   receives a text that stays until the set is freed. NULL if not wanted
/// out_pose   receives world_from_sensor. NULL if not wanted
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scans_describe(
    scans: *const srf_scans,
    index: usize,
    out_name: *mut *const c_char,
    out_pose: *mut srf_pose,
) -> srf_status {
    guard(|| {
        let scans = handle::get("scans", scans)?;
        let scan = at(&scans.set.scans, index)?;
        if !out_name.is_null() {
            pointer::write("out_name", out_name, scans.names[index].as_ptr())?;
        }
        if out_pose.is_null() {
            Ok(())
        } else {
            pointer::write("out_pose", out_pose, pose::pose(scan.world_from_sensor))
        }
    })
}

/// Places a scan of a set, whatever its file says: where an alignment found it, for example. The file is neither read nor changed. A scan
/// that was added to a merge or an alignment before stays there as it was.
/// scans              not NULL
/// index              less than the number of scans
/// world_from_sensor  a rotation and a translation. NULL for the identity
/// returns            SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scans_set_pose(
    scans: *mut srf_scans,
    index: usize,
    world_from_sensor: *const srf_pose,
) -> srf_status {
    guard(|| {
        let world_from_sensor = pose::read_rigid("world_from_sensor", world_from_sensor)?;
        handle::change("scans", scans.cast_const(), |scans| {
            at(&scans.set.scans, index)?;
            scans.set.scans[index].world_from_sensor = world_from_sensor;
            Ok(())
        })
    })
}

/// Whether a scan is a frame of a recording, of which there may be thousands.
/// scans         not NULL
/// index         less than the number of scans
/// out_is_frame  receives 1 if it is, else 0. Not NULL
/// returns       SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scans_is_frame(
    scans: *const srf_scans,
    index: usize,
    out_is_frame: *mut u32,
) -> srf_status {
    guard(|| {
        let scans = handle::get("scans", scans)?;
        pointer::write("out_is_frame", out_is_frame, at(&scans.set.scans, index)?.is_frame().into())
    })
}

/// Reads a scan. A range image comes placed in the world. A mesh and a cloud come in their own frame, which srf_scans_describe() places.
/// scans        not NULL
/// index        less than the number of scans
/// progress     counts the bytes of the file. NULL for none
/// out_content  receives a value of srf_content: which of the three handles was made. Not NULL
/// out_image    receives a new handle or NULL. Not NULL
/// out_mesh     receives a new handle or NULL. Not NULL
/// out_cloud    receives a new handle or NULL. Not NULL
/// returns      SRF_OK, SRF_ERR_IO, SRF_ERR_FORMAT naming the place, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
///              SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scans_read(
    scans: *const srf_scans,
    index: usize,
    progress: *const srf_progress,
    out_content: *mut u32,
    out_image: *mut *mut srf_image,
    out_mesh: *mut *mut srf_mesh,
    out_cloud: *mut *mut srf_cloud,
) -> srf_status {
    guard(|| read(scans, index, progress, (out_content, out_image, out_mesh, out_cloud)))
}

type Outs = (*mut u32, *mut *mut srf_image, *mut *mut srf_mesh, *mut *mut srf_cloud);

fn read(
    scans: *const srf_scans,
    index: usize,
    progress: *const srf_progress,
    (out_content, out_image, out_mesh, out_cloud): Outs,
) -> Result<(), Failure> {
    pointer::writable("out_content", out_content)?;
    pointer::writable("out_image", out_image)?;
    pointer::writable("out_mesh", out_mesh)?;
    pointer::writable("out_cloud", out_cloud)?;
    let scans = handle::get("scans", scans)?;
    watched(progress, |progress| {
        let content = at(&scans.set.scans, index)?.read_with(progress)?;
        pointer::write("out_image", out_image, std::ptr::null_mut())?;
        pointer::write("out_mesh", out_mesh, std::ptr::null_mut())?;
        pointer::write("out_cloud", out_cloud, std::ptr::null_mut())?;
        let kind = match content {
            Content::RangeImage(image) => {
                handle::give("out_image", out_image, image.into())?;
                srf_content::SRF_CONTENT_IMAGE
            }
            Content::Mesh(mesh) => {
                handle::give("out_mesh", out_mesh, mesh.into())?;
                srf_content::SRF_CONTENT_MESH
            }
            Content::Points(cloud) => {
                handle::give("out_cloud", out_cloud, cloud)?;
                srf_content::SRF_CONTENT_CLOUD
            }
        };
        pointer::write("out_content", out_content, kind as u32)
    })
}
