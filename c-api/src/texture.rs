//! The images of a mesh, made of photos and of the detailed surface that it stands for.

use std::ffi::{CString, c_char};

use surfrecon::mesh::Tile;
use surfrecon::photo::Photo;
use surfrecon::reports::Report as _;
use surfrecon::texture::{self, Textured};

use crate::array::{self, srf_array};
use crate::files::at;
use crate::guard::guard;
use crate::handle::{self, handle};
use crate::mesh::srf_mesh;
use crate::params::texture::srf_texture_params;
use crate::photo::srf_photo;
use crate::pose::{self, srf_pose};
use crate::progress::{srf_progress, watched};
use crate::reports::texture::{srf_texture_report, srf_textured_photo};
use crate::status::{Failure, srf_status, srf_status::*};
use crate::text::c_text;
use crate::{params, pointer, report, sized};

/// Images of a mesh, with texts as C wants them.
pub struct Textures {
    textured: Textured,
    reasons: Vec<CString>,
}

impl From<Textured> for Textures {
    fn from(textured: Textured) -> Self {
        Textures { reasons: textured.report.photos.iter().map(|photo| c_text(&photo.reason)).collect(), textured }
    }
}

/// The images of a mesh, in square tiles of one size. Released with srf_textures_free().
#[allow(non_camel_case_types)]
pub struct srf_textures {
    _opaque: [u8; 0],
}

handle!(srf_textures, Textures);

/// An image of a tile.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_texture_map {
    /// Base colour: 3 SRF_TYPE_U8, sRGB.
    SRF_TEXTURE_MAP_COLOUR = 1,
    /// Source of the colour: one SRF_TYPE_U8. 255 where a photo sees the place, 128 where none does and the colour is that of the detailed
    /// surface's vertices or of the nearest place that is seen, 0 where no triangle is.
    SRF_TEXTURE_MAP_MASK = 2,
    /// Normals in the tangent space of MikkTSpace, y up: 3 SRF_TYPE_U8, of which 128 is 0.
    SRF_TEXTURE_MAP_NORMAL = 3,
    /// Heights of the detailed surface over the mesh: one SRF_TYPE_U16, from lowest to highest of the report.
    SRF_TEXTURE_MAP_HEIGHT = 4,
    /// Ambient occlusion: one SRF_TYPE_U8, as light. 255 where all directions are open.
    SRF_TEXTURE_MAP_OCCLUSION = 5,
}

use srf_texture_map::*;

/// Makes the images of a mesh. A texel shows the place of the detailed surface behind it. Its colour is the mean, as light, of all photos
/// that see this place. Places that no photo sees take the colour of the detailed surface's vertices, or else of the nearest place seen.
/// The images are the same for any order of the photos.
/// mesh          has texture coordinates, as srf_mesh_unwrap() gives them: attributes s and t of its vertices. Not NULL
/// detail        the detailed surface that it stands for, in the same frame. Its attribute colour is used where no photo sees. May be the
///               mesh itself. Not NULL
/// photos        count handles. NULL if count is 0
/// count         number of photos. 0 takes all colours of the detailed surface's vertices
/// params        NULL for the defaults
/// progress      NULL for none
/// out_textures  receives a new handle on SRF_OK only. Not NULL
/// out_report    initialized by srf_texture_report_init(). NULL if not wanted
/// returns       SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for a mesh without texture coordinates, photos that can't be used, or neither photos
///               nor colours, SRF_ERR_OUT_OF_MEMORY, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_texture(
    mesh: *const srf_mesh,
    detail: *const srf_mesh,
    photos: *const *const srf_photo,
    count: usize,
    params: *const srf_texture_params,
    progress: *const srf_progress,
    out_textures: *mut *mut srf_textures,
    out_report: *mut srf_texture_report,
) -> srf_status {
    guard(|| {
        pointer::writable("out_textures", out_textures)?;
        if !out_report.is_null() {
            sized::writable("out_report", out_report)?;
        }
        let params = params::read("params", params)?;
        let (mesh, detail) = (handle::get("mesh", mesh)?, handle::get("detail", detail)?);
        let given = pointer::pointers("photos", photos, count)?;
        let one = |(i, &photo)| handle::get(&format!("photos[{i}]"), photo);
        let held = given.iter().enumerate().map(one).collect::<Result<Vec<_>, _>>()?;
        let photos: Vec<&dyn Photo> = held.iter().map(|photo| -> &dyn Photo { &***photo }).collect();
        let textured =
            watched(progress, |progress| Ok(texture::run(&mesh.mesh, &detail.mesh, &photos, &params, progress)?))?;
        if !out_report.is_null() {
            report::write("out_report", out_report, textured.report.values())?;
        }
        handle::give("out_textures", out_textures, textured.into())
    })
}

/// Releases images. Views of them are gone.
/// textures   NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_textures_free(textures: *mut srf_textures) -> srf_status {
    guard(|| handle::free("textures", textures))
}

/// The size of images.
/// textures   not NULL
/// out_size   receives columns and rows of a tile, which are the same. Not NULL
/// out_tiles  receives the number of tiles. Not NULL
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_textures_size(
    textures: *const srf_textures,
    out_size: *mut usize,
    out_tiles: *mut usize,
) -> srf_status {
    guard(|| {
        pointer::writable("out_tiles", out_tiles)?;
        let images = &handle::get("textures", textures)?.textured.images;
        pointer::write("out_size", out_size, images.size as usize)?;
        pointer::write("out_tiles", out_tiles, images.tiles.len())
    })
}

/// A view of an image of a tile, row after row. The first row is at the top, where t is largest. Tile k fills the unit square at
/// (k % 10, k / 10).
/// textures   not NULL
/// tile       less than the number of tiles
/// map        a value of srf_texture_map
/// out_image  receives the view, which is empty for a map that was not asked for. Not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_textures_image(
    textures: *const srf_textures,
    tile: usize,
    map: u32,
    out_image: *mut srf_array,
) -> srf_status {
    guard(|| {
        let textures = handle::get("textures", textures)?;
        let tiles = &textures.textured.images.tiles;
        let Some(tile) = tiles.get(tile) else {
            let text = format!("tile must be < {}, the number of tiles, got {tile}", tiles.len());
            return Err(Failure::new(SRF_ERR_PARAMETER, text));
        };
        pointer::write("out_image", out_image, image(tile, map)?)
    })
}

fn image(tile: &Tile, map: u32) -> Result<srf_array, Failure> {
    match map {
        m if m == SRF_TEXTURE_MAP_COLOUR as u32 => Ok(array::opaque(&tile.colour)),
        m if m == SRF_TEXTURE_MAP_MASK as u32 => Ok(array::bytes(tile.mask.as_deref().unwrap_or_default())),
        m if m == SRF_TEXTURE_MAP_NORMAL as u32 => Ok(array::opaque(tile.normal.as_deref().unwrap_or_default())),
        m if m == SRF_TEXTURE_MAP_HEIGHT as u32 => Ok(array::words(tile.height.as_deref().unwrap_or_default())),
        m if m == SRF_TEXTURE_MAP_OCCLUSION as u32 => Ok(array::bytes(tile.occlusion.as_deref().unwrap_or_default())),
        other => {
            Err(Failure::new(SRF_ERR_PARAMETER, format!("map must be a value of srf_texture_map, 1 to 5, got {other}")))
        }
    }
}

/// The pose of a photo's camera as it was used.
/// textures  not NULL
/// index     number of the photo, in the order in which they were given
/// out_pose  receives world_from_camera on SRF_OK only. Not NULL
/// returns   SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_textures_pose(
    textures: *const srf_textures,
    index: usize,
    out_pose: *mut srf_pose,
) -> srf_status {
    guard(|| {
        let textures = handle::get("textures", textures)?;
        pointer::write("out_pose", out_pose, pose::pose(*at(&textures.textured.world_from_camera, index)?))
    })
}

/// The figures of a photo.
/// textures   not NULL
/// index      number of the photo, in the order in which they were given
/// out_photo  initialized by srf_textured_photo_init(). Not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_textures_photo(
    textures: *const srf_textures,
    index: usize,
    out_photo: *mut srf_textured_photo,
) -> srf_status {
    guard(|| {
        let textures = handle::get("textures", textures)?;
        report::write("out_photo", out_photo, at(&textures.textured.report.photos, index)?.values())
    })
}

/// Why nothing was taken of a photo.
/// textures    not NULL
/// index       number of the photo, in the order in which they were given
/// out_reason  receives a text that stays until the images are freed, empty for a photo that was used. Not NULL
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_textures_reason(
    textures: *const srf_textures,
    index: usize,
    out_reason: *mut *const c_char,
) -> srf_status {
    guard(|| {
        let textures = handle::get("textures", textures)?;
        pointer::write("out_reason", out_reason, at(&textures.reasons, index)?.as_ptr())
    })
}
