//! A mesh by the tiles of its images.

use glam::DVec2;

use base::error::{Error, Result};
use base::progress::Progress;
use mesh::{TileImages, TriMesh, images, texture};

/// The triangles of a tile.
pub(super) struct Tiled {
    pub tile: u32,
    pub triangles: Vec<usize>,
}

/// The triangles of a valid mesh by the tiles that they lie in. Tiles without any are left out.
///
/// # Errors
/// [`Error::Input`] for images that are not whole, for a mesh without triangles or coordinates, for a triangle in no tile or in one
/// without images. [`Error::Cancelled`].
pub(super) fn by_tile(mesh: &TriMesh, of: &TileImages, progress: &Progress<'_>) -> Result<Vec<Tiled>> {
    of.validate()?;
    let [right, up] = [texture::S, texture::T];
    let Some([s, t]) = texture::coordinates(mesh) else {
        return Err(Error::input(format!(
            "there are images, but no texture coordinates: unwrap the mesh first, or give it the attributes {right} and {up}"
        )));
    };
    if mesh.triangles.is_empty() {
        return Err(Error::input("there are images, but no triangles that show them: leave the images out"));
    }
    let count = of.tiles.len();
    let mut tiles: Vec<Tiled> = (0..count as u32).map(|tile| Tiled { tile, triangles: Vec::new() }).collect();
    for range in progress.ranges(mesh.triangles.len()) {
        for triangle in range? {
            let corners = mesh.triangles[triangle].map(|v| DVec2::new(s[v as usize].into(), t[v as usize].into()));
            let tile = images::tile_of(triangle, corners)?;
            let Some(tiled) = tiles.get_mut(tile as usize) else {
                return Err(Error::input(format!(
                    "triangle {triangle} lies in tile {tile}, counted from 0, but there are images of {count}: give images of all tiles"
                )));
            };
            tiled.triangles.push(triangle);
        }
    }
    tiles.retain(|tiled| !tiled.triangles.is_empty());
    Ok(tiles)
}

/// Checks that there is one tangent for each corner, if there are any.
///
/// # Errors
/// [`Error::Input`].
pub(super) fn check_tangents(mesh: &TriMesh, of: &TileImages) -> Result<()> {
    let count = mesh.triangles.len();
    match &of.tangents {
        Some(tangents) if tangents.len() != count => Err(Error::input(format!(
            "the images come with tangents of {} triangles, but the mesh has {count}: make the images for this mesh",
            tangents.len()
        ))),
        _ => Ok(()),
    }
}
