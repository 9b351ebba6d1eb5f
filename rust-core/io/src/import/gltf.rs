//! glTF 2.0, binary and text: the triangles of all meshes of the scene as one mesh, placed by their nodes, with the
//! colours of their vertices. Buffers lie in the file, in the text (base64) or in the file's folder; a name that leads
//! out of it is refused unless the options allow it. Triangle strips and fans are triangles; points and lines are passed
//! over.
//!
//! The `gltf` crate knows the schema. Three things are ours: chunks, as its reader of them panics on short lengths; nodes'
//! transforms, which it rounds to 32 bits where surveyed coordinates have more digits; and elements, whose bounds it trusts.
//!
//! Cost: the file and its buffers in memory, and the result.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use glam::{DMat4, DQuat, DVec3};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::scene::Node;
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index, Mesh, Root, deserialize};
use gltf::mesh::Semantic;
use serde_json::Value;
use serde_json::value::RawValue;

use super::file::{self, Input, reserve};
use super::{Content, Scan, conf};
use base::error::{Error, Result};
use base::memory;
use base::progress::Progress;
use mesh::{Attribute, TriMesh};

/// Deepest tree of nodes.
const DEEPEST: usize = 256;

/// Whether a file that starts like this is one.
pub(super) fn sniff(start: &[u8]) -> bool {
    if start.starts_with(b"glTF") {
        return true;
    }
    let text = String::from_utf8_lossy(start);
    let has = |key: &str| text.contains(&format!("\"{key}\""));
    text.trim_start().starts_with('{') && (has("asset") || has("accessors") || has("bufferViews"))
}

pub(super) fn parse(input: &mut dyn Input, length: u64, scan: &Scan, progress: &Progress<'_>) -> Result<Content> {
    let size =
        usize::try_from(length).map_err(|_| Error::OutOfMemory(format!("{}: {length} bytes", scan.path.display())))?;
    let mut bytes = reserve(size, &scan.path)?;
    input.take(length).read_to_end(&mut bytes).map_err(|e| Error::io(&scan.path, e))?;
    let (json, mut blob) = chunks(&bytes, scan)?;
    let not_gltf = |e: serde_json::Error| {
        let problem = format!("this is neither glTF's JSON nor a binary glTF: {e}");
        Error::format(&scan.path, "start of file", problem)
    };
    let members: Members = serde_json::from_slice(json).map_err(not_gltf)?;
    check_version(&members, scan)?;
    let root: Root = deserialize::from_slice(json).map_err(not_gltf)?;
    let transforms = transforms(&members).map_err(not_gltf)?;
    let fail = |at: String, problem: String| Err(Error::format(&scan.path, at, problem));
    if let Some(name) = root.extensions_required.first() {
        return fail("extensionsRequired".to_owned(), format!("it needs {name}, which is not read"));
    }
    let mut buffers = Vec::new();
    for (index, buffer) in root.buffers.iter().enumerate() {
        let data = match &buffer.uri {
            Some(uri) => Cow::Owned(outside(uri, scan)?),
            None => Cow::Borrowed(std::mem::take(&mut blob)),
        };
        let wanted = buffer.byte_length.0;
        if (data.len() as u64) < wanted {
            return fail(format!("buffer {index}"), format!("it has {} bytes of {wanted}", data.len()));
        }
        buffers.push(data);
    }
    let visited = vec![false; root.nodes.len()];
    let mut reader =
        Reader { scan, root: &root, transforms, buffers, mesh: TriMesh::default(), colours: None, visited, progress };
    reader.foresee()?;
    match root.scenes.get(root.scene.map_or(0, |scene| scene.value())) {
        Some(scene) => {
            for &node in &scene.nodes {
                reader.node(node, DMat4::IDENTITY, 0)?;
            }
        }
        None => {
            for index in 0..root.meshes.len() {
                reader.mesh(Index::new(index as u32), DMat4::IDENTITY)?;
            }
        }
    }
    let Reader { mut mesh, colours, .. } = reader;
    // A file without meshes is an empty one; meshes without triangles are something else.
    if mesh.triangles.is_empty() && !root.meshes.is_empty() {
        return Err(Error::format(&scan.path, "scene", "there is no triangle"));
    }
    mesh.vertex_attributes.extend(colours.map(|colours| Attribute::colour("colour", colours)));
    Ok(Content::Mesh(mesh))
}

/// The JSON of a file and the buffer in it.
fn chunks<'a>(bytes: &'a [u8], scan: &Scan) -> Result<(&'a [u8], &'a [u8])> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, &[]));
    }
    let fail = |at: usize, problem: &str| Err(Error::format(&scan.path, format!("byte {at}"), problem));
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    match word(4) {
        Some(2) => {}
        Some(version) => return Err(other_version(&format!("{version}.0"), scan)),
        None => return fail(4, "the file ends"),
    }
    let (mut json, mut blob, mut at) = (None, &[][..], 12);
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let Some(chunk) = bytes.get(at + 8..).and_then(|rest| rest.get(..length as usize)) else {
            return fail(at, &format!("a chunk of {length} bytes goes beyond the end of the file"));
        };
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if blob.is_empty() => blob = chunk,
            _ => {}
        }
        at += 8 + length as usize;
    }
    match json {
        Some(json) => Ok((json, blob)),
        None => fail(at, "there is no JSON chunk"),
    }
}

/// The members of the document, each as text.
type Members = BTreeMap<String, Box<RawValue>>;

/// Refuses versions that are not read. What says none and has names instead of numbers is older than those that say it.
fn check_version(members: &Members, scan: &Scan) -> Result<()> {
    let asset = members.get("asset").and_then(|asset| serde_json::from_str::<Value>(asset.get()).ok());
    let version = asset.as_ref().and_then(|asset| asset.get("version")?.as_str());
    let major = version.and_then(|version| version.split('.').next()?.parse::<u32>().ok());
    let has_names = |key: &str| members.get(key).is_some_and(|value| value.get().starts_with('{'));
    match (version, major) {
        (Some(version), Some(major)) if major != 2 => Err(other_version(version, scan)),
        (None, _) if has_names("accessors") || has_names("meshes") => Err(other_version("1.0 or older", scan)),
        _ => Ok(()),
    }
}

fn other_version(version: &str, scan: &Scan) -> Error {
    let problem = format!("this is glTF {version}; glTF 2.0 is read: write it anew as glTF 2.0");
    Error::format(&scan.path, "asset", problem)
}

/// The transforms of all nodes, with all their digits.
fn transforms(members: &Members) -> serde_json::Result<Vec<DMat4>> {
    let nodes: Vec<Value> = members.get("nodes").map_or(Ok(Vec::new()), |nodes| serde_json::from_str(nodes.get()))?;
    Ok(nodes.iter().map(transform).collect())
}

fn transform(node: &Value) -> DMat4 {
    match numbers::<16>(node, "matrix") {
        Some(matrix) => DMat4::from_cols_array(&matrix),
        None => DMat4::from_scale_rotation_translation(
            DVec3::from_array(numbers(node, "scale").unwrap_or([1.0; 3])),
            DQuat::from_array(numbers(node, "rotation").unwrap_or([0.0, 0.0, 0.0, 1.0])),
            DVec3::from_array(numbers(node, "translation").unwrap_or([0.0; 3])),
        ),
    }
}

/// So many numbers by their key.
fn numbers<const N: usize>(value: &Value, key: &str) -> Option<[f64; N]> {
    let list = value.get(key)?.as_array()?;
    let mut all = [0.0; N];
    if list.len() != N {
        return None;
    }
    for (number, entry) in all.iter_mut().zip(list) {
        *number = entry.as_f64()?;
    }
    Some(all)
}

/// An accessor's elements.
struct Elements<'a> {
    data: &'a [u8],
    stride: usize,
    count: usize,
    component: ComponentType,
    channels: usize,
}

/// The bytes that a URI names.
fn outside(uri: &str, scan: &Scan) -> Result<Vec<u8>> {
    let shown: String = uri.chars().take(60).collect();
    let fail = |problem: &str| Err(Error::format(&scan.path, format!("buffer {shown}"), problem));
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((_, text)) = data.split_once(";base64,") else { return fail("only base64 is known") };
        return match base64(text.as_bytes()) {
            Some(bytes) => Ok(bytes),
            None => fail("this is not base64"),
        };
    }
    let folder = scan.path.parent().unwrap_or(Path::new(""));
    let name = unescaped(uri);
    let path = match conf::named(folder, &name, &scan.options) {
        Ok(path) => path,
        Err(problem) => return fail(&problem),
    };
    if !path.is_file() {
        return fail("there is no such file; buffers are in the file itself or in files beside it");
    }
    file::read_bytes(&path)
}

/// A URI's name with its %XX.
fn unescaped(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let hex = after.get(..2).and_then(|h| u8::from_str_radix(std::str::from_utf8(h).ok()?, 16).ok());
        match (first, hex) {
            (b'%', Some(byte)) => {
                bytes.push(byte);
                rest = &after[2..];
            }
            _ => {
                bytes.push(first);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let text = text.strip_suffix(b"==").or_else(|| text.strip_suffix(b"=")).unwrap_or(text);
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 3);
    for quad in text.chunks(4) {
        let mut bits = 0_u32;
        for &c in quad {
            let digit = match c {
                b'A'..=b'Z' => c - b'A',
                b'a'..=b'z' => c - b'a' + 26,
                b'0'..=b'9' => c - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return None,
            };
            bits = (bits << 6) | u32::from(digit);
        }
        let whole = (bits << (6 * (4 - quad.len()))).to_be_bytes();
        bytes.extend(&whole[1..quad.len().max(1)]);
    }
    Some(bytes)
}

struct Reader<'a, 'p> {
    scan: &'a Scan,
    root: &'a Root,
    /// Of the nodes, in their parents.
    transforms: Vec<DMat4>,
    buffers: Vec<Cow<'a, [u8]>>,
    mesh: TriMesh,
    colours: Option<Vec<[u8; 4]>>,
    /// Nodes seen: each has one parent, whatever a damaged file says.
    visited: Vec<bool>,
    progress: &'a Progress<'p>,
}

/// What the meshes of a file come to, each counted as often as nodes place it.
#[derive(Default)]
struct Amount {
    vertices: usize,
    corners: usize,
    /// Of the largest primitive.
    most: [usize; 2],
}

impl<'a> Reader<'a, '_> {
    /// Makes room for what the nodes place, and refuses more than may be: what the file does not hold is said when it is read.
    fn foresee(&mut self) -> Result<()> {
        let mut placed = vec![0_usize; self.root.meshes.len()];
        match self.root.scenes.get(self.root.scene.map_or(0, |scene| scene.value())) {
            Some(scene) => {
                let mut next = scene.nodes.clone();
                let mut seen = vec![false; self.root.nodes.len()];
                while let Some(index) = next.pop().map(|node| node.value()) {
                    let Some(node) = self.root.nodes.get(index) else { continue };
                    if std::mem::replace(&mut seen[index], true) {
                        continue;
                    }
                    let count = node.mesh.and_then(|mesh| placed.get_mut(mesh.value()));
                    count.into_iter().for_each(|count| *count += 1);
                    next.extend(node.children.iter().flatten().copied());
                }
            }
            None => placed.fill(1),
        }
        let mut amount = Amount::default();
        for (mesh, &times) in self.root.meshes.iter().zip(&placed) {
            for primitive in &mesh.primitives {
                let position = primitive.attributes.get(&Checked::Valid(Semantic::Positions)).copied();
                let count = |accessor| self.elements(accessor).map_or(0, |elements| elements.count);
                let vertices = position.map_or(0, count);
                let corners = primitive.indices.map_or(vertices, count);
                amount.vertices = amount.vertices.saturating_add(vertices.saturating_mul(times));
                amount.corners = amount.corners.saturating_add(corners.saturating_mul(times));
                amount.most = [amount.most[0].max(vertices), amount.most[1].max(corners)];
            }
        }
        let limit = self.scan.options.max_decoded_bytes() / size_of::<DVec3>() as u64;
        if amount.vertices as u64 > limit || amount.corners as u64 > 6 * limit {
            let problem = format!(
                "{} vertices and {} corners of triangles are placed, more than max_decoded_gib allows; raise it",
                amount.vertices, amount.corners
            );
            return self.fail("scene", problem);
        }
        let while_reading = amount.most[0] * size_of::<DVec3>() + amount.most[1] * size_of::<u32>();
        memory::expect_each(
            amount.vertices,
            size_of::<DVec3>() as f64,
            (while_reading + amount.corners / 3 * size_of::<[u32; 3]>()) as f64,
            "reading",
            "vertices",
        )?;
        self.mesh.positions = reserve(amount.vertices, &self.scan.path)?;
        self.mesh.triangles = reserve(amount.corners / 3, &self.scan.path)?;
        Ok(())
    }

    fn fail<T>(&self, at: &str, problem: impl Into<String>) -> Result<T> {
        Err(Error::format(&self.scan.path, at, problem))
    }

    fn node(&mut self, node: Index<Node>, world: DMat4, depth: usize) -> Result<()> {
        let index = node.value();
        let at = format!("node {index}");
        let Some(node) = self.root.nodes.get(index) else { return self.fail(&at, "there is no such node") };
        if depth > DEEPEST {
            return self.fail(&at, format!("the tree of nodes is deeper than {DEEPEST}"));
        }
        if std::mem::replace(&mut self.visited[index], true) {
            return self.fail(&at, "it has two parents");
        }
        let world = world * self.transforms[index];
        if !world.is_finite() {
            return self.fail(&at, "its transform is not finite");
        }
        if let Some(mesh) = node.mesh {
            self.mesh(mesh, world)?;
        }
        for &child in node.children.iter().flatten() {
            self.node(child, world, depth + 1)?;
        }
        Ok(())
    }

    fn mesh(&mut self, mesh: Index<Mesh>, world: DMat4) -> Result<()> {
        let index = mesh.value();
        let Some(mesh) = self.root.meshes.get(index) else {
            return self.fail(&format!("mesh {index}"), "there is no such mesh");
        };
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            self.primitive(primitive, world, &format!("mesh {index}, primitive {k}"))?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, world: DMat4, at: &str) -> Result<()> {
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let mode = match primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
            Checked::Valid(_) => return Ok(()),
            Checked::Invalid => return self.fail(at, "its mode is unknown; there are 0 to 6"),
        };
        let Some(positions) = attribute(Semantic::Positions) else { return Ok(()) };
        self.progress.check()?;
        let positions = self.elements(positions)?;
        if (positions.component, positions.channels) != (ComponentType::F32, 3) {
            return self.fail(at, "positions must be three floats");
        }
        let (first, count) = (self.mesh.positions.len(), positions.count);
        let limit = self.scan.options.max_decoded_bytes();
        // Nodes may share a mesh: what they make of it together is checked as well.
        if (first as u64 + count as u64).saturating_mul(24) > limit || first + count > u32::MAX as usize {
            return self.fail(at, "the vertices are more than max_decoded_gib allows; raise it");
        }
        let mut points: Vec<DVec3> = reserve(count, &self.scan.path)?;
        for block in self.progress.ranges(count) {
            for i in block? {
                let [x, y, z] = [0, 1, 2].map(|k| positions.value(i, k));
                points.push(world.transform_point3(DVec3::new(x, y, z)));
            }
        }
        if let Some(i) = points.iter().position(|p| !p.is_finite()) {
            return self.fail(at, format!("vertex {i} has a coordinate that is not finite"));
        }
        let colours = attribute(Semantic::Colors(0)).map(|c| self.read_colours(c, count, at)).transpose()?;
        let corners: Vec<u32> = match primitive.indices {
            Some(indices) => self.indices(indices, at)?,
            None => (0..count as u32).collect(),
        };
        if let Some(bad) = corners.iter().find(|&&i| i as usize >= count) {
            return self.fail(at, format!("an index is {bad}, but there are only {count} vertices"));
        }
        if (self.mesh.triangles.len() as u64 + corners.len() as u64).saturating_mul(12) > limit {
            return self.fail(at, "the triangles are more than max_decoded_gib allows; raise it");
        }
        if colours.is_some() || self.colours.is_some() {
            let all = self.colours.get_or_insert_default();
            all.resize(first, [255; 4]);
            all.extend(colours.unwrap_or_default());
            all.resize(first + count, [255; 4]);
        }
        self.mesh.positions.extend(points);
        let mirrored = world.determinant() < 0.0;
        let mut add = |a: u32, b: u32, c: u32| {
            let triangle = if mirrored { [a, c, b] } else { [a, b, c] };
            self.mesh.triangles.push(triangle.map(|v| v + first as u32));
        };
        match mode {
            Mode::TriangleStrip => (2..corners.len()).for_each(|i| {
                let [a, b, c] = [corners[i - 2], corners[i - 1], corners[i]];
                let (a, b) = if i % 2 == 0 { (a, b) } else { (b, a) };
                // Strips turn corners by repeating vertices.
                if a != b && b != c && c != a {
                    add(a, b, c);
                }
            }),
            Mode::TriangleFan => (2..corners.len()).for_each(|i| add(corners[0], corners[i - 1], corners[i])),
            _ => corners.as_chunks::<3>().0.iter().for_each(|&[a, b, c]| add(a, b, c)),
        }
        Ok(())
    }

    /// The elements of an accessor, all within their buffer.
    fn elements(&self, accessor: Index<Accessor>) -> Result<Elements<'_>> {
        let at = format!("accessor {}", accessor.value());
        let Some(accessor) = self.root.accessors.get(accessor.value()) else {
            return self.fail(&at, "there is no such accessor");
        };
        if accessor.sparse.is_some() {
            return self.fail(&at, "sparse accessors are not read; write the mesh without");
        }
        let component = match accessor.component_type {
            Checked::Valid(kind) if !matches!(kind.0, ComponentType::I8 | ComponentType::I16) => kind.0,
            _ => return self.fail(&at, "components must be floats, or whole numbers without a sign"),
        };
        let bytes = component.size();
        let channels = match accessor.type_ {
            Checked::Valid(Type::Scalar) => 1,
            Checked::Valid(Type::Vec3) => 3,
            Checked::Valid(Type::Vec4) => 4,
            _ => return self.fail(&at, "its type must be SCALAR, VEC3 or VEC4"),
        };
        let size = bytes * channels;
        let Some(view) = accessor.buffer_view.and_then(|view| self.root.buffer_views.get(view.value())) else {
            return self.fail(&at, "it needs a buffer view");
        };
        let count = accessor.count.0;
        let stride = view.byte_stride.map_or(size, |stride| stride.0);
        let data = (|| {
            let whole = |number: u64| usize::try_from(number).ok();
            let offset = whole(accessor.byte_offset.unwrap_or_default().0)?;
            let last = whole(count)?.checked_sub(1);
            let length = last.map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size))?;
            let end = offset.checked_add(length).filter(|end| *end as u64 <= view.byte_length.0)?;
            let start = whole(view.byte_offset.unwrap_or_default().0)?;
            let buffer = self.buffers.get(view.buffer.value())?;
            buffer.get(start.checked_add(offset)?..start.checked_add(end)?)
        })();
        match data {
            // Elements in one place would make any number of them out of nothing.
            Some(data) if stride >= size => Ok(Elements { data, stride, count: count as usize, component, channels }),
            _ => self.fail(&at, format!("its {count} elements don't fit their buffer")),
        }
    }

    fn indices(&self, accessor: Index<Accessor>, at: &str) -> Result<Vec<u32>> {
        let elements = self.elements(accessor)?;
        if elements.component == ComponentType::F32 || elements.channels != 1 {
            return self.fail(at, "indices must be whole numbers");
        }
        let mut all = reserve(elements.count, &self.scan.path)?;
        all.extend((0..elements.count).map(|i| elements.value(i, 0) as u32));
        Ok(all)
    }

    /// Linear colours of three or four channels, as sRGB.
    fn read_colours(&self, accessor: Index<Accessor>, count: usize, at: &str) -> Result<Vec<[u8; 4]>> {
        let elements = self.elements(accessor)?;
        if elements.channels == 1 || elements.component == ComponentType::U32 {
            return self.fail(at, "a colour has three or four channels of bytes, 16 bits or floats");
        }
        if elements.count != count {
            return self.fail(at, format!("{} colours for {count} vertices", elements.count));
        }
        let one = match elements.component {
            ComponentType::U8 => 255.0,
            ComponentType::U16 => 65535.0,
            _ => 1.0,
        };
        let mut all = reserve(count, &self.scan.path)?;
        for i in 0..count {
            let mut colour = [255; 4];
            for (k, value) in colour.iter_mut().enumerate().take(elements.channels) {
                let linear = elements.value(i, k) / one;
                let shown = match linear {
                    _ if k == 3 => linear,
                    ..=0.003_130_8 => 12.92 * linear,
                    _ => 1.055 * linear.powf(1.0 / 2.4) - 0.055,
                };
                *value = (255.0 * shown).round() as u8;
            }
            all.push(colour);
        }
        Ok(all)
    }
}

impl Elements<'_> {
    /// One component of an element.
    #[inline(always)]
    fn value(&self, element: usize, channel: usize) -> f64 {
        let b = &self.data[element * self.stride..];
        match self.component {
            ComponentType::U8 => b[channel].into(),
            ComponentType::U16 => u16::from_le_bytes([b[2 * channel], b[2 * channel + 1]]).into(),
            kind => {
                let bits = [0, 1, 2, 3].map(|k| b[4 * channel + k]);
                if kind == ComponentType::U32 {
                    u32::from_le_bytes(bits).into()
                } else {
                    f32::from_le_bytes(bits).into()
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::damage;
    use super::*;
    use crate::export::{GlbNode, GlbOptions, write_glb};
    use base::Progress;

    fn glb() -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.glb");
        let mut mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], vec![[0, 2, 1], [0, 1, 3]]);
        mesh.vertex_attributes.push(Attribute::colour("colour", (0..4).map(|i| [i * 60, 255, 7, 255]).collect()));
        let moved = glam::DAffine3::from_translation(DVec3::new(0.0, 10.0, 0.0));
        let nodes = [("a", glam::DAffine3::IDENTITY), ("b", moved)].map(|(name, world_from_mesh)| GlbNode {
            name,
            mesh: &mesh,
            world_from_mesh,
            coarser: &[],
        });
        write_glb(&path, &nodes, &GlbOptions::default(), &Progress::none()).unwrap();
        std::fs::read(&path).unwrap()
    }

    fn scan() -> Scan {
        Scan::new(Path::new("x.glb"))
    }

    #[test]
    fn what_we_write_is_read_in_its_place() {
        let Content::Mesh(mesh) = damage::read(parse, &glb(), &scan()).unwrap() else { panic!("no mesh") };
        assert_eq!(mesh.triangles, [[0, 2, 1], [0, 1, 3], [4, 6, 5], [4, 5, 7]]);
        assert_eq!((mesh.positions[3], mesh.positions[6]), (DVec3::Z, DVec3::new(0.0, 11.0, 0.0)));
        let Some(mesh::AttributeData::Colour(colours)) = mesh.vertex_attribute("colour") else { panic!("none") };
        for (i, colour) in colours.iter().enumerate() {
            let expected = [(i % 4 * 60) as u8, 255, 7, 255];
            assert!(colour.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 1), "{colour:?} {expected:?}");
        }
        damage::endure(parse, &glb(), &scan());
    }

    /// Theorem: room is made for what the scene places, however many other nodes there are.
    #[test]
    fn nodes_outside_of_the_scene_take_nothing() {
        let bytes = glb();
        let (both, second) = (b"\"nodes\":[0,1]", b"\"nodes\":[1  ]");
        let at = bytes.windows(both.len()).position(|some| some == both).unwrap();
        let mut one = bytes.clone();
        one[at..at + second.len()].copy_from_slice(second);
        for (bytes, count) in [(bytes, 8), (one, 4)] {
            let Content::Mesh(mesh) = damage::read(parse, &bytes, &scan()).unwrap() else { panic!("no mesh") };
            assert_eq!(
                (mesh.positions.len(), mesh.positions.capacity(), mesh.triangles.capacity()),
                (count, count, count / 2)
            );
        }
    }

    /// Two nodes of four vertices each are refused before the first is read where six vertices may be unpacked.
    #[test]
    fn more_than_may_be_placed_is_refused_at_once() {
        let mut scan = scan();
        let vertices = |count: f64| count * size_of::<DVec3>() as f64 / f64::from(1 << 30);
        scan.options = crate::import::ReadOptions { max_decoded_gib: vertices(6.0), ..Default::default() }.into();
        let text = damage::read(parse, &glb(), &scan).unwrap_err().to_string();
        let expected =
            "scene: 8 vertices and 12 corners of triangles are placed, more than max_decoded_gib allows; raise it";
        assert!(text.contains(expected), "{text}");
        scan.options = crate::import::ReadOptions { max_decoded_gib: vertices(8.0), ..Default::default() }.into();
        assert!(damage::read(parse, &glb(), &scan).is_ok());
    }

    fn text(uri: &str) -> String {
        format!(
            r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0, "scale": [-2, 2, 2]}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "mode": 5}}]}}],
            "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0,0,0], "max": [1,1,0]}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 48}}], "buffers": [{{"byteLength": 48, "uri": "{uri}"}}]}}"#
        )
    }

    #[test]
    fn strips_mirrors_and_buffers_elsewhere() {
        let floats = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0_f32];
        let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a b.bin"), &bytes).unwrap();
        let path = folder.path().join("a.gltf");
        let read = |uri: &str| {
            std::fs::write(&path, text(uri)).unwrap();
            crate::import::open(&path).and_then(|set| set.scans[0].read())
        };
        let packed = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAACAPwAAgD8AAAAA";
        for uri in ["missing.bin", "https://example.org/a.bin"] {
            let error = read(uri).unwrap_err().to_string();
            assert!(error.contains(&format!("a.gltf: buffer {uri}: ")), "{error}");
            assert!(error.ends_with("buffers are in the file itself or in files beside it"), "{error}");
        }
        for uri in ["a%20b.bin", &format!("data:application/octet-stream;base64,{packed}")] {
            let Content::Mesh(mesh) = read(uri).unwrap() else { panic!("no mesh") };
            assert_eq!(mesh.positions[3], DVec3::new(-2.0, 2.0, 0.0));
            // Mirrored: turned over, so that the outside stays outside.
            assert_eq!(mesh.triangles, [[0, 2, 1], [2, 3, 1]].map(|[a, b, c]: [u32; 3]| [a, b, c]));
        }
        for (uri, problem) in [
            ("../a.bin", "leads out of the folder"),
            ("%2e%2e/a.bin", "leads out of the folder"),
            ("/etc/passwd", "leads out of the folder"),
            ("none.bin", "none.bin"),
            ("data:text/plain,x", "only base64 is known"),
            ("data:;base64,!!", "this is not base64"),
            ("data:;base64,AAAA", "it has 3 bytes of 48"),
        ] {
            let error = read(uri).unwrap_err().to_string();
            assert!(error.contains(problem), "{error}");
        }
    }
}
