//! Images of a mesh's tiles as PNG or JPEG files.

use png::{BitDepth, ColorType, Encoder};
use rayon::prelude::*;
use std::io::Write as _;

use super::jpeg;
use base::error::{Error, Result};
use base::memory;
use base::params::{choice, count};
use base::progress::Progress;
use mesh::{Tile, TileImages};

base::choices! {
    /// Form of the images of textures.
    pub enum ImageFormat {
        /// Without loss.
        Png = "png" "PNG",
        /// Colours with a small loss, in a third of the bytes or less. Normals, heights and occlusion stay without loss.
        Jpeg = "jpeg" "JPEG",
    }
}

base::params! {
    /// How the images of a mesh are written.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ImageOptions of "images" {
        /// Form of the images of colours.
        image_format: ImageFormat = choice("Image format", ImageFormat::CHOICES),
        /// Quality of JPEG images, as libjpeg counts it.
        jpeg_quality: u32 = count("JPEG quality").default(90.0).at_least(1.0).at_most(100.0),
    }
}

/// A map of a tile that files have a place for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Map {
    Colour,
    Normal,
    Height,
    Occlusion,
}

impl Map {
    /// Name in files.
    pub(super) fn name(self) -> &'static str {
        match self {
            Map::Colour => "colour",
            Map::Normal => "normal",
            Map::Height => "height",
            Map::Occlusion => "occlusion",
        }
    }

    fn is_of(self, tile: &Tile) -> bool {
        match self {
            Map::Colour => true,
            Map::Normal => tile.normal.is_some(),
            Map::Height => tile.height.is_some(),
            Map::Occlusion => tile.occlusion.is_some(),
        }
    }

    /// Bytes of a texel, before they are packed.
    fn bytes(self) -> f64 {
        match self {
            Map::Colour | Map::Normal => 3.0,
            Map::Height => 2.0,
            Map::Occlusion => 1.0,
        }
    }
}

/// An image as a file.
pub(super) struct ImageFile {
    pub tile: u32,
    pub map: Map,
    pub format: ImageFormat,
    pub bytes: Vec<u8>,
}

impl ImageFile {
    pub(super) fn mime_type(&self) -> &'static str {
        match self.format {
            ImageFormat::Png => "image/png",
            ImageFormat::Jpeg => "image/jpeg",
        }
    }

    pub(super) fn ending(&self) -> &'static str {
        match self.format {
            ImageFormat::Png => "png",
            ImageFormat::Jpeg => "jpg",
        }
    }
}

/// The images of these maps and tiles as files, tile by tile. Maps that the tiles lack are left out. Counts the texels of those that are
/// there ([`texels`]).
///
/// # Errors
/// [`Error::Parameter`]. [`Error::Input`] for a tile that JPEG can't hold. [`Error::OutOfMemory`]. [`Error::Cancelled`].
pub(super) fn files(
    images: &TileImages,
    tiles: &[u32],
    maps: &[Map],
    options: &ImageOptions,
    progress: &Progress<'_>,
) -> Result<Vec<ImageFile>> {
    options.validate()?;
    let wanted = wanted(images, tiles, maps);
    let texels = f64::from(images.size).powi(2);
    let bytes = wanted.iter().map(|(_, map)| map.bytes() * texels).sum();
    let what = || format!("packing {} images of {} x {} texels", wanted.len(), images.size, images.size);
    memory::expect(bytes, what, "use smaller tiles")?;
    let of = |&(tile, map): &(u32, Map)| file(images, tile, map, options, progress);
    progress.run(&*base::threads::pool(0)?, || wanted.par_iter().map(of).collect())
}

/// Texels of all images that [`files`] makes.
pub(super) fn texels(images: &TileImages, tiles: &[u32], maps: &[Map]) -> u64 {
    u64::from(images.size).pow(2) * wanted(images, tiles, maps).len() as u64
}

fn wanted(images: &TileImages, tiles: &[u32], maps: &[Map]) -> Vec<(u32, Map)> {
    let all = tiles.iter().flat_map(|&tile| maps.iter().map(move |&map| (tile, map)));
    all.filter(|&(tile, map)| map.is_of(&images.tiles[tile as usize])).collect()
}

fn file(
    images: &TileImages,
    number: u32,
    map: Map,
    options: &ImageOptions,
    progress: &Progress<'_>,
) -> Result<ImageFile> {
    let (size, tile) = (images.size, &images.tiles[number as usize]);
    let format = if map == Map::Colour { options.image_format } else { ImageFormat::Png };
    let png = |pixels, colour| png(size, pixels, colour, BitDepth::Eight, progress);
    let bytes = match map {
        Map::Colour if format == ImageFormat::Jpeg => {
            let file = jpeg::encoded([size; 2], 3, tile.colour.as_flattened(), options.jpeg_quality, progress)?;
            progress.advance(u64::from(size).pow(2))?;
            file
        }
        Map::Colour => png(tile.colour.as_flattened(), ColorType::Rgb)?,
        Map::Normal => png(tile.normal.as_deref().unwrap_or_default().as_flattened(), ColorType::Rgb)?,
        Map::Occlusion => png(tile.occlusion.as_deref().unwrap_or_default(), ColorType::Grayscale)?,
        Map::Height => {
            let values: Vec<[u8; 2]> = tile.height.iter().flatten().map(|height| height.to_be_bytes()).collect();
            self::png(size, values.as_flattened(), ColorType::Grayscale, BitDepth::Sixteen, progress)?
        }
    };
    Ok(ImageFile { tile: number, map, format, bytes })
}

fn png(size: u32, pixels: &[u8], colour: ColorType, depth: BitDepth, progress: &Progress<'_>) -> Result<Vec<u8>> {
    let mut file = Vec::new();
    let failed = |error: png::EncodingError| Error::input(format!("the image can't be packed as PNG: {error}"));
    let mut encoder = Encoder::new(&mut file, size, size);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    let mut writer = encoder.write_header().map_err(failed)?;
    let mut stream = writer.stream_writer().map_err(failed)?;
    for row in pixels.chunks((pixels.len() / size as usize).max(1)) {
        stream.write_all(row).map_err(|error| failed(error.into()))?;
        progress.advance(size.into())?;
    }
    stream.finish().map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(file)
}
