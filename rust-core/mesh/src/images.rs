//! Images on a mesh with texture coordinates: the colours and maps of its tiles.

use glam::DVec2;

use base::error::{Error, Result};

/// Tiles in a row of the plane.
pub const ROW: u32 = 10;
/// Most tiles: as many rows as a row has tiles.
pub const MOST_TILES: u32 = ROW * ROW;
/// Number that the first tile has in the names of files.
const FIRST_UDIM: u32 = 1001;

/// The images of a tile: square, row by row from the top. Values of covered texels go on into the background.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tile {
    /// Base colour, sRGB.
    pub colour: Vec<[u8; 3]>,
    /// Normals in tangent space, y up: 128 is 0.
    pub normal: Option<Vec<[u8; 3]>>,
    /// Heights from [`TileImages::heights`]' first to its second.
    pub height: Option<Vec<u16>>,
    /// Ambient occlusion: 255 where all directions are open. As light, not as sRGB.
    pub occlusion: Option<Vec<u8>>,
    /// Source of each colour, as its maker numbers sources.
    pub mask: Option<Vec<u8>>,
}

/// Material of a mesh with texture coordinates ([`texture`](crate::texture)), in square tiles of one size. Tile `k` fills the unit square
/// whose lower left corner is `(k % 10, k / 10)`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TileImages {
    /// Columns and rows of a tile.
    pub size: u32,
    /// The tiles, at most [`MOST_TILES`].
    pub tiles: Vec<Tile>,
    /// Heights that 0 and 65,535 of the height maps stand for, in the unit of the mesh.
    pub heights: Option<[f64; 2]>,
    /// Tangents of the corners of the mesh's triangles, as MikkTSpace makes them: direction, and the sign of the bitangent. Of use with
    /// a normal map.
    pub tangents: Option<Vec<[[f32; 4]; 3]>>,
}

impl TileImages {
    /// Checks that there are tiles, and that all images have the size of a tile. All tiles have the same maps.
    ///
    /// # Errors
    /// [`Error::Input`] naming the first that is wrong.
    pub fn validate(&self) -> Result<()> {
        let (size, count) = (self.size, self.tiles.len());
        if size == 0 {
            return Err(Error::input("the images have 0 columns and rows: give tiles of at least 1 texel"));
        }
        if count == 0 || count > MOST_TILES as usize {
            return Err(Error::input(format!("there are {count} tiles of images, but must be 1 to {MOST_TILES}")));
        }
        let texels = u64::from(size).pow(2);
        let first = self.tiles[0].lengths();
        for (k, tile) in self.tiles.iter().enumerate() {
            for ((map, length), (_, of_first)) in tile.lengths().into_iter().zip(first) {
                if length.is_some() != of_first.is_some() {
                    let [with, without] = if length.is_some() { [k, 0] } else { [0, k] };
                    return Err(Error::input(format!(
                        "tile {with} has the map {map}, but tile {without} has not: give it to all tiles or to none"
                    )));
                }
                if let Some(length) = length.filter(|&length| length as u64 != texels) {
                    return Err(Error::input(format!(
                        "the map {map} of tile {k} has {length} texels, but a tile of {size} x {size} has {texels}"
                    )));
                }
            }
        }
        if self.tiles[0].height.is_some() && self.heights.is_none() {
            return Err(Error::input(
                "there is a height map, but not the heights that its values stand for: give both",
            ));
        }
        Ok(())
    }
}

impl Tile {
    /// Names of the maps, with the number of their texels.
    fn lengths(&self) -> [(&'static str, Option<usize>); 5] {
        [
            ("colour", Some(self.colour.len())),
            ("normal", self.normal.as_ref().map(Vec::len)),
            ("height", self.height.as_ref().map(Vec::len)),
            ("occlusion", self.occlusion.as_ref().map(Vec::len)),
            ("mask", self.mask.as_ref().map(Vec::len)),
        ]
    }
}

/// Number that a tile has in the names of files, as UDIM counts.
pub fn udim(tile: u32) -> u32 {
    FIRST_UDIM + tile
}

/// Lower left corner of a tile in the plane.
pub fn corner(tile: u32) -> DVec2 {
    DVec2::new(f64::from(tile % ROW), f64::from(tile / ROW))
}

/// The tile that a triangle with these texture coordinates lies in, if it lies in one. Its middle decides.
pub fn tile([a, b, c]: [DVec2; 3]) -> u32 {
    let middle = ((a + b + c) / 3.0).clamp(DVec2::ZERO, DVec2::splat(f64::from(ROW) - 0.5));
    middle.y as u32 * ROW + middle.x as u32
}

/// As [`tile`], checked.
///
/// # Errors
/// [`Error::Input`] if triangle `t` lies in no one tile, or its coordinates are not finite.
pub fn tile_of(t: usize, triangle: [DVec2; 3]) -> Result<u32> {
    let tile = tile(triangle);
    let low = corner(tile);
    let is_inside = |at: DVec2| (at - low).cmpge(DVec2::ZERO).all() && (at - low).cmple(DVec2::ONE).all();
    if triangle.into_iter().all(is_inside) {
        return Ok(tile);
    }
    Err(Error::input(format!(
        "the texture coordinates of triangle {t} lie in no one tile. Each triangle must lie in one unit square of {ROW} x {ROW}, u and v \
         from 0 to {ROW}."
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(change: impl FnOnce(&mut TileImages)) -> String {
        let tile = Tile { colour: vec![[1, 2, 3]; 4], occlusion: Some(vec![9; 4]), ..Tile::default() };
        let mut images = TileImages { size: 2, tiles: vec![tile.clone(), tile], ..TileImages::default() };
        images.validate().unwrap();
        change(&mut images);
        images.validate().unwrap_err().to_string()
    }

    #[test]
    fn images_that_do_not_fit_are_named() {
        assert!(told(|images| images.size = 0).contains("give tiles of at least 1 texel"));
        assert!(told(|images| images.tiles.clear()).contains("there are 0 tiles of images, but must be 1 to 100"));
        let short = told(|images| images.tiles[1].colour.truncate(3));
        assert_eq!(short, "the map colour of tile 1 has 3 texels, but a tile of 2 x 2 has 4");
        let uneven = told(|images| images.tiles[1].occlusion = None);
        assert_eq!(uneven, "tile 0 has the map occlusion, but tile 1 has not: give it to all tiles or to none");
        let uneven = told(|images| images.tiles[1].mask = Some(vec![0; 4]));
        assert_eq!(uneven, "tile 1 has the map mask, but tile 0 has not: give it to all tiles or to none");
        let vague = told(|images| images.tiles.iter_mut().for_each(|tile| tile.height = Some(vec![0; 4])));
        assert!(vague.contains("not the heights that its values stand for"), "{vague}");
    }

    #[test]
    fn tiles_are_counted_as_udim_does() {
        let small = |x: f64, y: f64| [[0.1, 0.1], [0.9, 0.1], [0.1, 0.9]].map(|[u, v]| DVec2::new(x + u, y + v));
        assert_eq!(tile_of(0, small(3.0, 2.0)).unwrap(), 23);
        assert_eq!(udim(23), 1024);
        // All of a border belongs to both of its tiles.
        assert_eq!(tile_of(0, [[1.0, 0.0], [1.0, 1.0], [0.5, 0.5]].map(DVec2::from)).unwrap(), 0);
        for bad in [small(0.5, 0.0), small(10.0, 0.0), small(-1.0, 0.0), small(f64::NAN, 0.0)] {
            let error = tile_of(7, bad).unwrap_err().to_string();
            assert!(error.starts_with("the texture coordinates of triangle 7 lie in no one tile"), "{error}");
        }
    }
}
