//! Binary glTF 2.0 (`.glb`): meshes or points with colours and custom attributes, one node each.

//!
//! | file | what |
//! |---|---|
//! | `part` | a mesh in its place, cut by the tiles of its images |
//! | `primitive` | triangles or points with one material |
//! | `material` | materials and their images |
//! | `buffer`, `sink` | the binary part, announced and written |

mod buffer;
mod material;
mod part;
mod primitive;
mod sink;

use std::fmt::Write as _;
use std::io::{BufWriter, Write};
use std::path::Path;

use glam::{DAffine3, DQuat, DVec3};

use super::Provenance;
use super::atomic::write_atomically;
use super::images::ImageOptions;
use super::provenance::extras;
use base::error::{Error, Result, known_as};
use base::memory;
use base::progress::Progress;
use buffer::{Buffer, pad, quoted};
use material::Materials;
use mesh::{Crs, texture};
use part::Part;
use sink::GlbSink;

pub use part::GlbNode;
pub(super) use part::origin;

/// In double precision, then in single.
const BYTES_A_NORMAL: f64 = 36.0;
/// Of a vertex with texture coordinates: its normal, by its place. With images also the vertex in its tile.
const BYTES_A_SMOOTH_NORMAL: f64 = 150.0;
const BYTES_IN_A_TILE: f64 = 150.0;

base::stages! {
    /// Stages with their shares of the time: of a file with images, and of one without.
    PLAN, PLAIN_PLAN:
    PACKING = "packing images", 0.9, 0.0;
    WRITING = "writing", 0.1, 1.0;
}
base::choices! {
    /// The direction that is up in the coordinates of the meshes. In glTF itself it is y.
    pub enum Up {
        /// As glTF has it: nothing is turned.
        Y = "y" "Y",
        /// A node above all others turns z up to y up.
        Z = "z" "Z",
    }
}

/// Options of [`write_glb`], about the coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct GlbOptions {
    /// The vertical.
    pub up: Up,
    /// Metres a unit, as glTF counts in metres: 0.001 for millimetres. Put into the node above all others.
    pub metres_per_unit: f64,
    /// Provenance that the file tells.
    pub provenance: Option<Provenance>,
    /// Form of the images.
    pub images: ImageOptions,
}

impl Default for GlbOptions {
    fn default() -> Self {
        GlbOptions { up: Up::Y, metres_per_unit: 1.0, provenance: None, images: ImageOptions::default() }
    }
}

/// Writes meshes as binary glTF.
///
/// Written are positions, normals, the vertex attribute `colour` and every other vertex attribute. Positions have single precision,
/// relative to an origin in the node's translation if they are far from zero. Normals are the mean of the faces by area. `colour` is
/// written as `COLOR_0`, converted from sRGB to linear in 16 bits. Texture coordinates ([`texture`]) are `TEXCOORD_0`. Others have single
/// precision under their name in capitals after an underscore: `confidence` is `_CONFIDENCE`. The coordinate reference system of meshes
/// that their nodes leave in place goes into `asset.extras` ([`Provenance`]): the nodes below `world` are in it. Attributes of faces have
/// no place in glTF and are left out.
/// Materials are matte, white and two-sided.
///
/// A mesh with images ([`GlbNode::images`]) has a material for each tile. Colours, normals and occlusion are packed into the file. Heights and
/// the mask have no place in glTF. Neither has `colour` then, as glTF would multiply both. Coordinates are those within the tile. Normals are by
/// angle and do not show seams, as those of all meshes with texture coordinates. Tangents are written where there is a normal map: those of
/// the images, else as MikkTSpace makes them.
///
/// With [`GlbNode::coarser`], the level of as many triangles per pixel as the finest has on half of the screen is the one to show: that is
/// what the coverages (`MSFT_screencoverage`) say.
///
/// # Errors
/// A mesh that isn't valid ([`validate`](mesh::TriMesh::validate)), a coarser one with more triangles, a pose that isn't rigid, a scale that isn't
/// positive, a coordinate, a float or an integer that single precision can't hold, more than 4 GiB. [`Error::Io`]. [`Error::Cancelled`].
/// Then no file is left, and one that was there is untouched.
pub fn write_glb(path: &Path, nodes: &[GlbNode<'_>], options: &GlbOptions, progress: &Progress<'_>) -> Result<()> {
    if !(options.metres_per_unit > 0.0 && options.metres_per_unit.is_finite()) {
        let scale = options.metres_per_unit;
        return Err(Error::input(format!("metres_per_unit must be a finite number > 0, got {scale}")));
    }
    expect(nodes)?;
    let mut parts = Vec::new();
    for node in nodes {
        let levels = std::iter::once(node.mesh).chain(node.coarser.iter().copied());
        for (level, mesh) in levels.enumerate() {
            let finer = parts.last().filter(|_| level > 0).map(|part: &Part<'_>| part.triangles);
            if let Some(finer) = finer.filter(|&finer| finer < mesh.triangles.len()) {
                let (name, count) = (node.name, mesh.triangles.len());
                return Err(Error::input(format!(
                    "{name}: level {level} has {count} triangles, but must have fewer than the one before, {finer}"
                )));
            }
            parts.push(Part::new(node, mesh, level, progress)?);
        }
    }
    // A mesh that its pose moves is in no system.
    let in_place = nodes.iter().filter(|node| node.world_from_mesh == DAffine3::IDENTITY);
    let is_in_place = in_place.clone().count() == nodes.len();
    let crs = Crs::agreed(in_place.filter(|_| is_in_place).map(|node| (node.name, node.mesh.crs.clone())))?;
    for node in nodes {
        let named: Vec<_> = (1..=node.coarser.len()).map(|level| format!("its level {level}")).collect();
        let coarser = named.iter().zip(node.coarser).map(|(name, mesh)| (name.as_str(), mesh.crs.clone()));
        Crs::agreed([(node.name, node.mesh.crs.clone())].into_iter().chain(coarser))?;
    }
    let mut materials = Materials::of(&parts);
    let texels = materials.texels();
    progress.plan(if texels > 0 { PLAN } else { PLAIN_PLAN });
    if texels > 0 {
        progress.stage(PACKING, texels);
        materials.pack(&options.images, progress)?;
    }
    let (json, binary) = document(&parts, &materials, options, &extras(options.provenance.as_ref(), crs.as_ref())?);
    let json = pad(json.into_bytes(), b' ');
    let total = 12 + 8 + json.len() as u64 + if binary > 0 { 8 + binary } else { 0 };
    let Ok(length) = u32::try_from(total) else {
        return Err(Error::input(format!(
            "{}: a glb file holds at most 4 GiB, and this would be {total} bytes",
            known_as(path)
        )));
    };
    progress.stage(WRITING, binary);
    write_atomically(path, progress, |file| {
        let mut sink = GlbSink { out: BufWriter::with_capacity(1 << 18, file), path, progress };
        let header = [0x4654_6c67, 2, length, json.len() as u32, 0x4e4f_534a];
        sink.put(bytemuck::cast_slice(&header.map(u32::to_le)))?;
        sink.put(&json)?;
        if binary > 0 {
            sink.put(bytemuck::cast_slice(&[binary as u32, 0x004e_4942].map(u32::to_le)))?;
            for primitive in parts.iter().flat_map(|part| &part.primitives) {
                primitive.write(&mut sink)?;
            }
            materials.write(&mut sink)?;
        }
        sink.out.flush().map_err(|e| Error::io(path, e))
    })
}

/// Foresees the memory of normals and of meshes that are cut.
fn expect(nodes: &[GlbNode<'_>]) -> Result<()> {
    let mut bytes = 0.0;
    let mut vertices = 0;
    for node in nodes {
        for mesh in std::iter::once(node.mesh).chain(node.coarser.iter().copied()) {
            let count = if mesh.triangles.is_empty() { 0 } else { mesh.positions.len() };
            let of_images = if node.images.is_some() { BYTES_IN_A_TILE } else { 0.0 };
            let is_smooth = texture::coordinates(mesh).is_some();
            bytes += count as f64 * (of_images + if is_smooth { BYTES_A_SMOOTH_NORMAL } else { BYTES_A_NORMAL });
            vertices += count;
        }
    }
    memory::expect_each(vertices, bytes / vertices.max(1) as f64, 0.0, "normals of", "vertices")
}

/// The JSON document, and the length of the binary buffer.
fn document(parts: &[Part<'_>], materials: &Materials<'_>, options: &GlbOptions, extras: &str) -> (String, u64) {
    let mut buffer = Buffer::default();
    let (mut meshes, mut nodes) = (Vec::new(), Vec::new());
    for (index, part) in parts.iter().enumerate() {
        let name = match part.level {
            0 => quoted(part.node.name),
            level => quoted(&format!("{} LOD{level}", part.node.name)),
        };
        let mut node = format!("{{\"name\":{name}");
        let mut json =
            |of: &primitive::Primitive<'_>| of.json(materials.number(part.node.images, of.tile), &mut buffer);
        let primitives: Vec<String> = part.primitives.iter().filter_map(&mut json).collect();
        if !primitives.is_empty() {
            let _ = write!(node, ",\"mesh\":{}", meshes.len());
            meshes.push(format!("{{\"name\":{name},\"primitives\":[{}]}}", primitives.join(",")));
        }
        let (r, t) = (part.rotation, part.translation);
        if r != DQuat::IDENTITY {
            let _ = write!(node, ",\"rotation\":[{},{},{},{}]", r.x, r.y, r.z, r.w);
        }
        if t != DVec3::ZERO {
            let _ = write!(node, ",\"translation\":[{},{},{}]", t.x, t.y, t.z);
        }
        if part.level == 0 && !part.node.coarser.is_empty() {
            node += &levels(part.node, index);
        }
        nodes.push(node + "}");
    }
    let has_levels = parts.iter().any(|part| part.level > 0);
    // Coarser levels belong to no scene: they take their node's place.
    let roots = parts.iter().enumerate().filter(|(_, part)| part.level == 0);
    let mut roots: Vec<String> = roots.map(|(i, _)| i.to_string()).collect();
    let as_gltf_has_it = options.up == Up::Y && options.metres_per_unit == 1.0;
    if !nodes.is_empty() && !as_gltf_has_it {
        let mut root = format!("{{\"name\":\"world\",\"children\":[{}]", roots.join(","));
        if options.up == Up::Z {
            let half = std::f64::consts::FRAC_1_SQRT_2;
            let _ = write!(root, ",\"rotation\":[-{half},0,0,{half}]");
        }
        let scale = options.metres_per_unit;
        if scale != 1.0 {
            let _ = write!(root, ",\"scale\":[{scale},{scale},{scale}]");
        }
        roots = vec![nodes.len().to_string()];
        nodes.push(root + "}");
    }
    let version = env!("CARGO_PKG_VERSION");
    let mut json = format!("{{\"asset\":{{\"version\":\"2.0\",\"generator\":\"surfrecon {version}\"{extras}}}");
    let mut list = |name: &str, items: &[String]| {
        if !items.is_empty() {
            let _ = write!(json, ",\"{name}\":[{}]", items.join(","));
        }
    };
    if has_levels {
        list("extensionsUsed", &["\"MSFT_lod\"".to_owned()]);
    }
    list("nodes", &nodes);
    list("meshes", &meshes);
    for (name, items) in materials.json(&mut buffer) {
        list(name, &items);
    }
    if buffer.length > 0 {
        list("buffers", &[format!("{{\"byteLength\":{}}}", buffer.length)]);
    }
    list("bufferViews", &buffer.views);
    list("accessors", &buffer.accessors);
    if roots.is_empty() {
        // A scene must not have an empty list of nodes, and strict readers want the list.
        json.push('}');
    } else {
        list("scenes", &[format!("{{\"nodes\":[{}]}}", roots.join(","))]);
        json.push_str(",\"scene\":0}");
    }
    (json, buffer.length)
}

/// The names of the coarser levels of node `index`, which follow it, and the share of the screen down to which each is shown.
fn levels(node: &GlbNode<'_>, index: usize) -> String {
    let ids: Vec<String> = (1..=node.coarser.len()).map(|level| (index + level).to_string()).collect();
    let finest = node.mesh.triangles.len().max(1) as f64;
    let shares = node.coarser.iter().map(|mesh| 0.5 * mesh.triangles.len() as f64 / finest);
    let shares: Vec<String> = shares.chain([0.0]).map(|share| share.to_string()).collect();
    format!(
        ",\"extensions\":{{\"MSFT_lod\":{{\"ids\":[{}]}}}},\"extras\":{{\"MSFT_screencoverage\":[{}]}}",
        ids.join(","),
        shares.join(",")
    )
}

#[cfg(test)]
mod tests;
