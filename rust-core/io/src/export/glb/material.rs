//! The materials of a file: the matte one, and those of images.

use std::fmt::Write as _;

use super::buffer::{Buffer, pad, quoted};
use super::part::Part;
use super::sink::GlbSink;
use crate::export::images::{self, ImageFile, ImageOptions, Map};
use base::error::{Error, Result};
use base::progress::Progress;
use mesh::TileImages;
use mesh::images::udim;

/// Maps that a material has a place for.
const MAPS: &[Map] = &[Map::Colour, Map::Normal, Map::Occlusion];

/// The images of a node or of several.
struct Shown<'a> {
    images: &'a TileImages,
    /// Name of the first node with them.
    name: &'a str,
    /// Tiles that triangles lie in.
    tiles: Vec<u32>,
    files: Vec<ImageFile>,
}

/// The materials of a file, each numbered.
#[derive(Default)]
pub struct Materials<'a> {
    has_matte: bool,
    shown: Vec<Shown<'a>>,
}

impl<'a> Materials<'a> {
    /// The materials that nodes ask for. Their images are not packed yet.
    pub fn of(parts: &[Part<'a>]) -> Self {
        let mut all = Materials::default();
        for part in parts {
            let tiles = part.primitives.iter().filter_map(|primitive| primitive.tile);
            let Some(images) = part.node.images else {
                all.has_matte |= part.primitives.iter().any(|primitive| !primitive.mesh.positions.is_empty());
                continue;
            };
            let place = all.shown.iter().position(|shown| std::ptr::eq(shown.images, images));
            let place = place.unwrap_or_else(|| {
                all.shown.push(Shown { images, name: part.node.name, tiles: Vec::new(), files: Vec::new() });
                all.shown.len() - 1
            });
            all.shown[place].tiles.extend(tiles);
        }
        for shown in &mut all.shown {
            shown.tiles.sort_unstable();
            shown.tiles.dedup();
        }
        all
    }

    /// Texels that [`Materials::pack`] counts.
    pub fn texels(&self) -> u64 {
        self.shown.iter().map(|shown| images::texels(shown.images, &shown.tiles, MAPS)).sum()
    }

    /// Makes files of the images.
    ///
    /// # Errors
    /// As [`images::files`], with the node's name.
    pub fn pack(&mut self, options: &ImageOptions, progress: &Progress<'_>) -> Result<()> {
        for shown in &mut self.shown {
            let files = images::files(shown.images, &shown.tiles, MAPS, options, progress);
            shown.files = files.map_err(|error| match error {
                Error::Input(problem) => Error::input(format!("{}: {problem}", shown.name)),
                other => other,
            })?;
        }
        Ok(())
    }

    /// Number of the material of a tile of these images, or of the matte one.
    pub fn number(&self, images: Option<&TileImages>, tile: Option<u32>) -> usize {
        let mut number = usize::from(self.has_matte);
        for shown in &self.shown {
            if let (Some(images), Some(tile)) = (images, tile)
                && std::ptr::eq(shown.images, images)
            {
                return number + shown.tiles.iter().position(|&of| of == tile).unwrap_or_default();
            }
            number += shown.tiles.len();
        }
        0
    }

    /// Lists of the document with their names: materials, textures, images, samplers.
    pub fn json(&self, buffer: &mut Buffer) -> [(&'static str, Vec<String>); 4] {
        let (mut materials, mut textures, mut images) = (Vec::new(), Vec::new(), Vec::new());
        if self.has_matte {
            materials.push(
                "{\"name\":\"matte\",\"doubleSided\":true,\
                 \"pbrMetallicRoughness\":{\"metallicFactor\":0,\"roughnessFactor\":0.8}}"
                    .to_owned(),
            );
        }
        for shown in &self.shown {
            for &tile in &shown.tiles {
                let name = format!("{} {}", shown.name, udim(tile));
                let mut base = String::new();
                let mut others = String::new();
                for file in shown.files.iter().filter(|file| file.tile == tile) {
                    let texture = format!("{{\"index\":{}}}", textures.len());
                    let _ = match file.map {
                        Map::Colour => write!(base, "\"baseColorTexture\":{texture},"),
                        Map::Normal => write!(others, ",\"normalTexture\":{texture}"),
                        Map::Occlusion => write!(others, ",\"occlusionTexture\":{texture}"),
                        Map::Height => Ok(()),
                    };
                    textures.push(format!("{{\"sampler\":0,\"source\":{}}}", images.len()));
                    let view = buffer.file(file.bytes.len());
                    let (name, kind) = (quoted(&format!("{name} {}", file.map.name())), file.mime_type());
                    images.push(format!("{{\"name\":{name},\"bufferView\":{view},\"mimeType\":\"{kind}\"}}"));
                }
                materials.push(format!(
                    "{{\"name\":{},\"doubleSided\":true,\
                     \"pbrMetallicRoughness\":{{{base}\"metallicFactor\":0,\"roughnessFactor\":1}}{others}}}",
                    quoted(&name)
                ));
            }
        }
        // Linear between texels and between the levels of the mipmap, and no texel of the opposite border.
        let sampler = "{\"magFilter\":9729,\"minFilter\":9987,\"wrapS\":33071,\"wrapT\":33071}".to_owned();
        let samplers = if images.is_empty() { Vec::new() } else { vec![sampler] };
        [("materials", materials), ("textures", textures), ("images", images), ("samplers", samplers)]
    }

    /// Writes the images in the order of [`Materials::json`].
    pub fn write(self, sink: &mut GlbSink<'_, '_, '_>) -> Result<()> {
        for file in self.shown.into_iter().flat_map(|shown| shown.files) {
            sink.all(&pad(file.bytes, 0), |&byte| [byte])?;
        }
        Ok(())
    }
}
