//! Binary glTF 2.0 (`.glb`): meshes or points with colours and custom attributes, one node each.

use std::fmt::Write as _;
use std::io::{BufWriter, Write};
use std::path::Path;

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};

use super::Provenance;
use super::atomic::{Output, write_atomically};
use super::provenance::extras;
use base::error::{Error, Result, known_as};
use base::memory;
use base::progress::Progress;
use mesh::{AttributeData, Crs, TriMesh, texture};

/// Elements that are written between two looks at the progress.
const CHUNK: usize = 1 << 14;
/// In double precision, then in single.
const BYTES_A_NORMAL: f64 = 36.0;
/// Coordinates larger than this times the mesh's size get an origin of their own: single precision keeps 2^-24 of a
/// coordinate, which then is at most 2^-20 of the size.
const FAR: f64 = 8.0;
/// Integers up to this are kept by the single precision that they are written in.
const EXACT: i32 = 1 << 24;
/// Largest difference of a pose from a rigid one.
const RIGID: f64 = 1e-6;

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
}

impl Default for GlbOptions {
    fn default() -> Self {
        GlbOptions { up: Up::Y, metres_per_unit: 1.0, provenance: None }
    }
}

/// A mesh in its place, for [`write_glb`].
#[derive(Clone, Copy, Debug)]
pub struct GlbNode<'a> {
    /// Name of the node and of its mesh.
    pub name: &'a str,
    /// Written as points if it has no triangles, as an empty node if it has no vertices either.
    pub mesh: &'a TriMesh,
    /// Places the mesh in the world: a rotation and a translation.
    pub world_from_mesh: DAffine3,
    /// The same with fewer and fewer triangles, in the mesh's frame, for the extension `MSFT_lod`: viewers that know it
    /// show these when the object is small on the screen, others never. Empty for none.
    pub coarser: &'a [&'a TriMesh],
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
/// With [`GlbNode::coarser`], the level of as many triangles per pixel as the finest has on half of the screen is the one to show: that is
/// what the coverages (`MSFT_screencoverage`) say.
///
/// # Errors
/// A mesh that isn't valid ([`TriMesh::validate`]), a coarser one with more triangles, a pose that isn't rigid, a scale that isn't
/// positive, a coordinate, a float or an integer that single precision can't hold, more than 4 GiB. [`Error::Io`]. [`Error::Cancelled`].
/// Then no file is left, and one that was there is untouched.
pub fn write_glb(path: &Path, nodes: &[GlbNode<'_>], options: &GlbOptions, progress: &Progress<'_>) -> Result<()> {
    if !(options.metres_per_unit > 0.0 && options.metres_per_unit.is_finite()) {
        let scale = options.metres_per_unit;
        return Err(Error::input(format!("metres_per_unit must be a finite number > 0, got {scale}")));
    }
    let meshes = nodes.iter().flat_map(|node| std::iter::once(&node.mesh).chain(node.coarser));
    let vertices = meshes.filter(|mesh| !mesh.triangles.is_empty()).map(|mesh| mesh.positions.len()).sum();
    memory::expect_each(vertices, BYTES_A_NORMAL, 0.0, "normals of", "vertices")?;
    let mut parts = Vec::new();
    for node in nodes {
        let levels = std::iter::once(node.mesh).chain(node.coarser.iter().copied());
        for (level, mesh) in levels.enumerate() {
            let finer = parts.last().filter(|_| level > 0).map(|part: &Part<'_>| part.mesh.triangles.len());
            if let Some(finer) = finer.filter(|&finer| finer < mesh.triangles.len()) {
                let (name, count) = (node.name, mesh.triangles.len());
                return Err(Error::input(format!(
                    "{name}: level {level} has {count} triangles, but must have fewer than the one before, {finer}"
                )));
            }
            parts.push(Part::new(node, mesh, level)?);
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
    let (json, binary) = document(&parts, options, &extras(options.provenance.as_ref(), crs.as_ref())?);
    let json = pad(json.into_bytes(), b' ');
    let total = 12 + 8 + json.len() as u64 + if binary > 0 { 8 + binary } else { 0 };
    let Ok(length) = u32::try_from(total) else {
        return Err(Error::input(format!(
            "{}: a glb file holds at most 4 GiB, and this would be {total} bytes",
            known_as(path)
        )));
    };
    progress.plan(&[("writing", 1.0)]);
    progress.stage(0, binary);
    write_atomically(path, progress, |file| {
        let mut sink = Sink { out: BufWriter::with_capacity(1 << 18, file), path, progress };
        let header = [0x4654_6c67, 2, length, json.len() as u32, 0x4e4f_534a];
        sink.put(bytemuck::cast_slice(&header.map(u32::to_le)))?;
        sink.put(&json)?;
        if binary > 0 {
            sink.put(bytemuck::cast_slice(&[binary as u32, 0x004e_4942].map(u32::to_le)))?;
            for part in &parts {
                part.write(&mut sink)?;
            }
        }
        sink.out.flush().map_err(|e| Error::io(path, e))
    })
}

/// A node with what is worked out beforehand.
struct Part<'a> {
    node: &'a GlbNode<'a>,
    /// The node's mesh or one of its coarser ones, and which.
    mesh: &'a TriMesh,
    level: usize,
    /// Taken off all positions and put into the node's translation.
    origin: DVec3,
    rotation: DQuat,
    translation: DVec3,
    /// Bounds of the positions as written.
    bounds: [Vec3; 2],
    normals: Vec<[f32; 3]>,
    colour: Option<&'a [[u8; 4]]>,
    /// Texture coordinates to the right and upwards.
    texture: Option<[&'a [f32]; 2]>,
    /// Names as written, and the data.
    custom: Vec<(String, &'a AttributeData)>,
}

impl<'a> Part<'a> {
    fn new(node: &'a GlbNode<'a>, mesh: &'a TriMesh, level: usize) -> Result<Self> {
        let name = node.name;
        mesh.validate().map_err(|e| Error::input(format!("{name}: {e}")))?;
        let (m, t) = (node.world_from_mesh.matrix3, node.world_from_mesh.translation);
        if !(m * m.transpose()).abs_diff_eq(DMat3::IDENTITY, RIGID) || m.determinant() < 0.0 || !t.is_finite() {
            return Err(Error::input(format!("{name}: its pose must be a rotation and a translation")));
        }
        let origin = origin(&mesh.positions);
        let start = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        let bounds = mesh.positions.iter().fold(start, |[lo, hi], &p| {
            let p = (p - origin).as_vec3();
            [lo.min(p), hi.max(p)]
        });
        let is_finite = bounds[0].is_finite() && bounds[1].is_finite();
        if !mesh.positions.is_empty() && !is_finite {
            return Err(Error::input(format!(
                "{name}: a coordinate is too large for single precision: use a larger unit"
            )));
        }
        let mut colour = None;
        let texture = texture::coordinates(mesh);
        let mut custom: Vec<(String, &AttributeData)> = Vec::new();
        for attribute in &mesh.vertex_attributes {
            if let ("colour", AttributeData::Colour(c)) = (attribute.name.as_str(), &attribute.data) {
                colour = Some(c.as_slice());
                continue;
            }
            let written = format!("_{}", attribute.name.to_uppercase());
            if custom.iter().any(|c| c.0 == written) {
                return Err(Error::input(format!("{name}: two attributes would be written as {written}: rename one")));
            }
            check_values(name, &attribute.name, &attribute.data)?;
            if texture.is_some() && texture::has_name(&attribute.name) {
                continue;
            }
            custom.push((written, &attribute.data));
        }
        Ok(Part {
            node,
            mesh,
            level,
            origin,
            rotation: DQuat::from_mat3(&m).normalize(),
            translation: node.world_from_mesh.transform_point3(origin),
            bounds,
            normals: if mesh.triangles.is_empty() { Vec::new() } else { normals(mesh) },
            colour,
            texture,
            custom,
        })
    }

    /// Writes what [`document`] has announced, in the same order.
    fn write(&self, sink: &mut Sink<'_, '_, '_>) -> Result<()> {
        let mesh = self.mesh;
        let single = |v: Vec3| v.to_array().map(|x| x.to_bits().to_le());
        sink.all(&mesh.triangles, |t| t.map(u32::to_le))?;
        sink.all(&mesh.positions, |&p| single((p - self.origin).as_vec3()))?;
        sink.all(&self.normals, |n| n.map(|x| x.to_bits().to_le()))?;
        if let Some(colour) = self.colour {
            let linear = linear_table();
            sink.all(colour, |&[r, g, b, a]| {
                let [r, g, b] = [r, g, b].map(|x| linear[x as usize].to_le());
                [r, g, b, (u16::from(a) * 257).to_le()]
            })?;
        }
        if let Some([s, t]) = self.texture {
            for (s, t) in s.chunks(CHUNK).zip(t.chunks(CHUNK)) {
                let pairs: Vec<[f32; 2]> = s.iter().zip(t).map(|(&s, &t)| [s, t]).collect();
                // glTF counts from the top.
                sink.all(&pairs, |&[s, t]| [s, 1.0 - t].map(|x| x.to_bits().to_le()))?;
            }
        }
        for (_, data) in &self.custom {
            match data {
                AttributeData::F32(v) => sink.all(v, |x| [x.to_bits().to_le()])?,
                AttributeData::I32(v) => sink.all(v, |&x| [(x as f32).to_bits().to_le()])?,
                AttributeData::Bool(v) => sink.all(v, |&x| [f32::from(u8::from(x)).to_bits().to_le()])?,
                AttributeData::Colour(v) => sink.all(v, |&x| x)?,
            }
        }
        Ok(())
    }
}

/// The origin of the node's own coordinates: zero unless the mesh is far from it. Along an axis it is a number of single precision between
/// half and twice of all coordinates. Differences of such numbers are exact, so that taking it off never rounds further than single
/// precision does without it.
pub(super) fn origin(positions: &[DVec3]) -> DVec3 {
    let Some((lo, hi)) = mesh::measure::bounds(positions) else { return DVec3::ZERO };
    let (size, far) = ((hi - lo).max_element(), lo.abs().max(hi.abs()).max_element());
    if far <= FAR * size {
        return DVec3::ZERO;
    }
    let along = |lo: f64, hi: f64| {
        let middle = f64::from(lo.midpoint(hi).round() as f32);
        let (least, most) = if middle > 0.0 { (lo, hi) } else { (-hi, -lo) };
        if least >= middle.abs() / 2.0 && most <= middle.abs() * 2.0 { middle } else { 0.0 }
    };
    DVec3::new(along(lo.x, hi.x), along(lo.y, hi.y), along(lo.z, hi.z))
}

fn check_values(node: &str, attribute: &str, data: &AttributeData) -> Result<()> {
    let bad = match data {
        AttributeData::F32(v) => v.iter().position(|x| !x.is_finite()).map(|i| (i, v[i].to_string())),
        AttributeData::I32(v) => {
            let place = v.iter().position(|x| !(-EXACT..=EXACT).contains(x));
            place.map(|i| (i, v[i].to_string()))
        }
        AttributeData::Bool(_) | AttributeData::Colour(_) => None,
    };
    match bad {
        None => Ok(()),
        Some((i, value)) => Err(Error::input(format!(
            "{node}: attribute {attribute} of vertex {i} is {value}, which a glb file can't hold: replace or remove it"
        ))),
    }
}

/// Normals of the vertices, the mean of their faces by area, of length 1. +z where the faces say nothing.
fn normals(mesh: &TriMesh) -> Vec<[f32; 3]> {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(t);
        let normal = (b - a).cross(c - a);
        for &v in corners {
            sums[v as usize] += normal;
        }
    }
    let unit = |n: &DVec3| n.try_normalize().filter(|n| n.is_finite()).unwrap_or(DVec3::Z).as_vec3().normalize();
    sums.iter().map(|n| unit(n).to_array()).collect()
}

/// From an sRGB byte to a linear value in 16 bits.
fn linear_table() -> [u16; 256] {
    std::array::from_fn(|i| {
        let x = i as f64 / 255.0;
        let linear = if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
        (linear * 65535.0).round() as u16
    })
}

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_BYTE: u32 = 5121;

/// The JSON document, and the length of the binary buffer.
fn document(parts: &[Part<'_>], options: &GlbOptions, extras: &str) -> (String, u64) {
    let mut buffer = Buffer::default();
    let (mut meshes, mut nodes) = (Vec::new(), Vec::new());
    for (index, part) in parts.iter().enumerate() {
        let name = match part.level {
            0 => quoted(part.node.name),
            level => quoted(&format!("{} LOD{level}", part.node.name)),
        };
        let mut node = format!("{{\"name\":{name}");
        if let Some(primitive) = primitive(part, &mut buffer) {
            let _ = write!(node, ",\"mesh\":{}", meshes.len());
            meshes.push(format!("{{\"name\":{name},\"primitives\":[{primitive}]}}"));
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
    if !meshes.is_empty() {
        let matte = "{\"name\":\"matte\",\"doubleSided\":true,\
                     \"pbrMetallicRoughness\":{\"metallicFactor\":0,\"roughnessFactor\":0.8}}";
        list("materials", &[matte.to_owned()]);
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

/// The parts of the buffer that have been given away.
#[derive(Default)]
struct Buffer {
    views: Vec<String>,
    accessors: Vec<String>,
    length: u64,
}

impl Buffer {
    /// Takes room for `count` elements and returns the accessor's index. Elements fill whole words, so all stays aligned.
    fn take(&mut self, count: usize, component: u32, kind: &str, bytes: u64, target: u32, more: &str) -> usize {
        let (view, size) = (self.views.len(), count as u64 * bytes);
        let offset = self.length;
        self.views.push(format!("{{\"buffer\":0,\"byteOffset\":{offset},\"byteLength\":{size},\"target\":{target}}}"));
        self.accessors.push(format!(
            "{{\"bufferView\":{view},\"componentType\":{component},\"count\":{count},\"type\":\"{kind}\"{more}}}"
        ));
        self.length += size;
        view
    }
}

/// The one primitive of a mesh, `None` without vertices.
fn primitive(part: &Part<'_>, buffer: &mut Buffer) -> Option<String> {
    const INDICES: u32 = 34963;
    const VERTICES: u32 = 34962;
    let mesh = part.mesh;
    let count = mesh.positions.len();
    if count == 0 {
        return None;
    }
    let mut indices = String::new();
    if !mesh.triangles.is_empty() {
        let view = buffer.take(3 * mesh.triangles.len(), UNSIGNED_INT, "SCALAR", 4, INDICES, "");
        indices = format!(",\"indices\":{view}");
    }
    let [lo, hi] = part.bounds;
    let bounds = format!(",\"min\":[{},{},{}],\"max\":[{},{},{}]", lo.x, lo.y, lo.z, hi.x, hi.y, hi.z);
    let view = buffer.take(count, FLOAT, "VEC3", 12, VERTICES, &bounds);
    let mut attributes = format!("\"POSITION\":{view}");
    if !part.normals.is_empty() {
        let view = buffer.take(count, FLOAT, "VEC3", 12, VERTICES, "");
        let _ = write!(attributes, ",\"NORMAL\":{view}");
    }
    if part.colour.is_some() {
        let view = buffer.take(count, UNSIGNED_SHORT, "VEC4", 8, VERTICES, ",\"normalized\":true");
        let _ = write!(attributes, ",\"COLOR_0\":{view}");
    }
    if part.texture.is_some() {
        let view = buffer.take(count, FLOAT, "VEC2", 8, VERTICES, "");
        let _ = write!(attributes, ",\"TEXCOORD_0\":{view}");
    }
    for (name, data) in &part.custom {
        let view = match data {
            AttributeData::Colour(_) => buffer.take(count, UNSIGNED_BYTE, "VEC4", 4, VERTICES, ",\"normalized\":true"),
            _ => buffer.take(count, FLOAT, "SCALAR", 4, VERTICES, ""),
        };
        let _ = write!(attributes, ",{}:{view}", quoted(name));
    }
    // 4: triangles, 0: points.
    let mode = if mesh.triangles.is_empty() { 0 } else { 4 };
    Some(format!("{{\"attributes\":{{{attributes}}}{indices},\"material\":0,\"mode\":{mode}}}"))
}

/// A JSON string.
fn quoted(text: &str) -> String {
    let mut out = String::from('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if c < ' ' => {
                let _ = write!(out, "\\u{:04x}", c as u32);
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

fn pad(mut bytes: Vec<u8>, with: u8) -> Vec<u8> {
    bytes.resize(bytes.len().next_multiple_of(4), with);
    bytes
}

/// Writes to the file and counts.
struct Sink<'a, 'o, 'p> {
    out: BufWriter<&'a mut Output<'o>>,
    path: &'a Path,
    progress: &'a Progress<'p>,
}

impl Sink<'_, '_, '_> {
    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.out.write_all(bytes).map_err(|e| Error::io(self.path, e))
    }

    /// Writes every item as `convert` has it.
    fn all<T, const N: usize, W: bytemuck::NoUninit>(
        &mut self,
        items: &[T],
        convert: impl Fn(&T) -> [W; N],
    ) -> Result<()> {
        for items in items.chunks(CHUNK) {
            for item in items {
                self.put(bytemuck::cast_slice(&convert(item)))?;
            }
            self.progress.advance((items.len() * N * size_of::<W>()) as u64)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
