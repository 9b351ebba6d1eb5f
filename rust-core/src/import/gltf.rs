//! glTF 2.0, binary and text: the triangles of all meshes of the scene as one mesh, placed by their nodes, with the
//! colours of their vertices. Buffers lie in the file, in the text (base64) or in the file's folder; a name that leads
//! out of it is refused unless the options allow it. Triangle strips and fans are triangles; points and lines are passed
//! over.
//!
//! Cost: the file and its buffers in memory, and the result.

use std::io::Read;
use std::path::Path;

use glam::{DMat4, DQuat, DVec3};
use serde_json::Value;

use super::file::{self, Input, reserve};
use super::{Content, Scan, conf};
use crate::error::{Error, Result};
use crate::mesh::{Attribute, TriMesh};
use crate::progress::Progress;

/// Deepest tree of nodes.
const DEEPEST: usize = 256;

/// Numbers of the format: types of components, kinds of primitives.
const U8: u64 = 5121;
const U16: u64 = 5123;
const U32: u64 = 5125;
const F32: u64 = 5126;
const TRIANGLES: u64 = 4;
const STRIP: u64 = 5;
const FAN: u64 = 6;

/// Whether a file that starts like this is one.
pub(super) fn sniff(start: &[u8]) -> bool {
    if start.starts_with(b"glTF") {
        return true;
    }
    let text = String::from_utf8_lossy(start);
    let has = |key: &str| text.contains(&format!("\"{key}\""));
    text.trim_start_matches('\u{feff}').trim_start().starts_with('{')
        && (has("asset") || has("accessors") || has("bufferViews"))
}

pub(super) fn parse(input: &mut dyn Input, length: u64, scan: &Scan, _: &Progress<'_>) -> Result<Content> {
    let size =
        usize::try_from(length).map_err(|_| Error::OutOfMemory(format!("{}: {length} bytes", scan.path.display())))?;
    let mut bytes = reserve(size, &scan.path)?;
    input.take(length).read_to_end(&mut bytes).map_err(|e| Error::io(&scan.path, e))?;
    let (json, mut blob) = chunks(&bytes, scan)?;
    let root: Value = serde_json::from_slice(json).map_err(|e| {
        let problem = format!("this is neither glTF's JSON nor a binary glTF: {e}");
        Error::format(&scan.path, "start of file", problem)
    })?;
    let fail = |at: String, problem: String| Err(Error::format(&scan.path, at, problem));
    if let Some(name) = list(&root, "extensionsRequired").first() {
        return fail("extensionsRequired".to_owned(), format!("it needs {name}, which is not read"));
    }
    let mut buffers = Vec::new();
    for (index, buffer) in list(&root, "buffers").iter().enumerate() {
        let data = match buffer.get("uri").and_then(Value::as_str) {
            Some(uri) => outside(uri, scan)?,
            None => std::mem::take(&mut blob).to_vec(),
        };
        let wanted = number(buffer, "byteLength").unwrap_or(usize::MAX);
        if data.len() < wanted {
            return fail(format!("buffer {index}"), format!("it has {} bytes of {wanted}", data.len()));
        }
        buffers.push(data);
    }
    let nodes = list(&root, "nodes").len();
    let mut reader =
        Reader { scan, root: &root, buffers, mesh: TriMesh::default(), colours: None, visited: vec![false; nodes] };
    let scene = list(&root, "scenes").get(number(&root, "scene").unwrap_or(0));
    match scene {
        Some(scene) => {
            for node in list(scene, "nodes") {
                reader.node(whole(node), DMat4::IDENTITY, 0)?;
            }
        }
        None => {
            for index in 0..list(&root, "meshes").len() {
                reader.mesh(index, DMat4::IDENTITY)?;
            }
        }
    }
    let Reader { mut mesh, colours, .. } = reader;
    if mesh.triangles.is_empty() {
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
        Some(version) => return fail(4, &format!("version {version} is unknown; known is 2")),
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

/// The entries of a list, none if there is no list.
fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// A whole number, or one that is beyond every list.
fn whole(value: &Value) -> usize {
    value.as_u64().and_then(|number| usize::try_from(number).ok()).unwrap_or(usize::MAX)
}

/// A whole number by its key; anything else that stands there is beyond every list.
fn number(value: &Value, key: &str) -> Option<usize> {
    value.get(key).map(whole)
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
    component: u64,
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
    let path = match conf::inside(folder, &name) {
        Ok(path) => path,
        Err(_) if scan.options.allow_outside && !name.contains('\0') => folder.join(&name),
        Err(problem) => return fail(&problem),
    };
    if !path.is_file() {
        return fail("there is no such file; buffers are in the file itself or in files beside it");
    }
    file::read(&path)
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

struct Reader<'a> {
    scan: &'a Scan,
    root: &'a Value,
    buffers: Vec<Vec<u8>>,
    mesh: TriMesh,
    colours: Option<Vec<[u8; 4]>>,
    /// Nodes seen: each has one parent, whatever a damaged file says.
    visited: Vec<bool>,
}

impl<'a> Reader<'a> {
    fn fail<T>(&self, at: &str, problem: impl Into<String>) -> Result<T> {
        Err(Error::format(&self.scan.path, at, problem))
    }

    fn node(&mut self, index: usize, world: DMat4, depth: usize) -> Result<()> {
        let at = format!("node {index}");
        let Some(node) = list(self.root, "nodes").get(index) else { return self.fail(&at, "there is no such node") };
        if depth > DEEPEST {
            return self.fail(&at, format!("the tree of nodes is deeper than {DEEPEST}"));
        }
        if std::mem::replace(&mut self.visited[index], true) {
            return self.fail(&at, "it has two parents");
        }
        let local = match numbers::<16>(node, "matrix") {
            Some(matrix) => DMat4::from_cols_array(&matrix),
            None => DMat4::from_scale_rotation_translation(
                DVec3::from_array(numbers(node, "scale").unwrap_or([1.0; 3])),
                DQuat::from_array(numbers(node, "rotation").unwrap_or([0.0, 0.0, 0.0, 1.0])),
                DVec3::from_array(numbers(node, "translation").unwrap_or([0.0; 3])),
            ),
        };
        let world = world * local;
        if !world.is_finite() {
            return self.fail(&at, "its transform is not finite");
        }
        if let Some(mesh) = number(node, "mesh") {
            self.mesh(mesh, world)?;
        }
        for child in list(node, "children") {
            self.node(whole(child), world, depth + 1)?;
        }
        Ok(())
    }

    fn mesh(&mut self, index: usize, world: DMat4) -> Result<()> {
        let Some(mesh) = list(self.root, "meshes").get(index) else {
            return self.fail(&format!("mesh {index}"), "there is no such mesh");
        };
        for (k, primitive) in list(mesh, "primitives").iter().enumerate() {
            let at = format!("mesh {index}, primitive {k}");
            let mode = primitive.get("mode").map_or(Some(TRIANGLES), Value::as_u64);
            let attribute = |name: &str| primitive.get("attributes").and_then(|a| number(a, name));
            match mode {
                Some(TRIANGLES | STRIP | FAN) => {}
                Some(0..=3) => continue,
                _ => return self.fail(&at, "its mode is unknown; there are 0 to 6"),
            }
            let Some(positions) = attribute("POSITION") else { continue };
            let positions = self.elements(positions)?;
            if (positions.component, positions.channels) != (F32, 3) {
                return self.fail(&at, "positions must be three floats");
            }
            let (first, count) = (self.mesh.positions.len(), positions.count);
            let limit = self.scan.options.max_decoded_bytes();
            // Nodes may share a mesh: what they make of it together is checked as well.
            if (first as u64 + count as u64).saturating_mul(24) > limit || first + count > u32::MAX as usize {
                return self.fail(&at, "the vertices are more than max_decoded_gib allows; raise it");
            }
            let mut points: Vec<DVec3> = reserve(count, &self.scan.path)?;
            for i in 0..count {
                let [x, y, z] = [0, 1, 2].map(|k| positions.value(i, k));
                points.push(world.transform_point3(DVec3::new(x, y, z)));
            }
            if let Some(i) = points.iter().position(|p| !p.is_finite()) {
                return self.fail(&at, format!("vertex {i} has a coordinate that is not finite"));
            }
            let colours = attribute("COLOR_0").map(|c| self.read_colours(c, count, &at)).transpose()?;
            let corners: Vec<u32> = match number(primitive, "indices") {
                Some(indices) => self.indices(indices, &at)?,
                None => (0..count as u32).collect(),
            };
            if let Some(bad) = corners.iter().find(|&&i| i as usize >= count) {
                return self.fail(&at, format!("an index is {bad}, but there are only {count} vertices"));
            }
            if (self.mesh.triangles.len() as u64 + corners.len() as u64).saturating_mul(12) > limit {
                return self.fail(&at, "the triangles are more than max_decoded_gib allows; raise it");
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
                Some(STRIP) => (2..corners.len()).for_each(|i| {
                    let [a, b, c] = [corners[i - 2], corners[i - 1], corners[i]];
                    let (a, b) = if i % 2 == 0 { (a, b) } else { (b, a) };
                    // Strips turn corners by repeating vertices.
                    if a != b && b != c && c != a {
                        add(a, b, c);
                    }
                }),
                Some(FAN) => (2..corners.len()).for_each(|i| add(corners[0], corners[i - 1], corners[i])),
                _ => corners.as_chunks::<3>().0.iter().for_each(|&[a, b, c]| add(a, b, c)),
            }
        }
        Ok(())
    }

    /// The elements of an accessor, all within their buffer.
    fn elements(&self, index: usize) -> Result<Elements<'_>> {
        let at = format!("accessor {index}");
        let Some(accessor) = list(self.root, "accessors").get(index) else {
            return self.fail(&at, "there is no such accessor");
        };
        if accessor.get("sparse").is_some() {
            return self.fail(&at, "sparse accessors are not read; write the mesh without");
        }
        let view = number(accessor, "bufferView").and_then(|view| list(self.root, "bufferViews").get(view));
        let component = accessor.get("componentType").and_then(Value::as_u64).unwrap_or(0);
        let bytes = match component {
            U8 => 1,
            U16 => 2,
            U32 | F32 => 4,
            _ => return self.fail(&at, format!("components of type {component} are not read")),
        };
        let channels = match accessor.get("type").and_then(Value::as_str) {
            Some("SCALAR") => 1,
            Some("VEC3") => 3,
            Some("VEC4") => 4,
            _ => return self.fail(&at, "its type must be SCALAR, VEC3 or VEC4"),
        };
        let size = bytes * channels;
        let (Some(view), Some(count)) = (view, number(accessor, "count")) else {
            return self.fail(&at, "it needs a count and a buffer view");
        };
        let stride = number(view, "byteStride").unwrap_or(size);
        let data = (|| {
            let offset = number(accessor, "byteOffset").unwrap_or(0);
            let length = count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size))?;
            let end = offset.checked_add(length).filter(|end| *end <= number(view, "byteLength").unwrap_or(0))?;
            let buffer = self.buffers.get(number(view, "buffer")?)?;
            let start = number(view, "byteOffset").unwrap_or(0);
            buffer.get(start.checked_add(offset)?..start.checked_add(end)?)
        })();
        match data {
            // Elements in one place would make any number of them out of nothing.
            Some(data) if stride >= size => Ok(Elements { data, stride, count, component, channels }),
            _ => self.fail(&at, format!("its {count} elements don't fit their buffer")),
        }
    }

    fn indices(&self, accessor: usize, at: &str) -> Result<Vec<u32>> {
        let elements = self.elements(accessor)?;
        if elements.component == F32 || elements.channels != 1 {
            return self.fail(at, "indices must be whole numbers");
        }
        let mut all = reserve(elements.count, &self.scan.path)?;
        all.extend((0..elements.count).map(|i| elements.value(i, 0) as u32));
        Ok(all)
    }

    /// Linear colours of three or four channels, as sRGB.
    fn read_colours(&self, accessor: usize, count: usize, at: &str) -> Result<Vec<[u8; 4]>> {
        let elements = self.elements(accessor)?;
        if elements.channels == 1 || elements.component == U32 {
            return self.fail(at, "a colour has three or four channels of bytes, 16 bits or floats");
        }
        if elements.count != count {
            return self.fail(at, format!("{} colours for {count} vertices", elements.count));
        }
        let one = match elements.component {
            U8 => 255.0,
            U16 => 65535.0,
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
            U8 => b[channel].into(),
            U16 => u16::from_le_bytes([b[2 * channel], b[2 * channel + 1]]).into(),
            kind => {
                let bits = [0, 1, 2, 3].map(|k| b[4 * channel + k]);
                if kind == U32 { u32::from_le_bytes(bits).into() } else { f32::from_le_bytes(bits).into() }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::damage;
    use super::*;
    use crate::Progress;
    use crate::export::{GlbNode, GlbOptions, write_glb};

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
        let Some(crate::mesh::AttributeData::Colour(colours)) = mesh.vertex_attribute("colour") else { panic!("none") };
        for (i, colour) in colours.iter().enumerate() {
            let expected = [(i % 4 * 60) as u8, 255, 7, 255];
            assert!(colour.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 1), "{colour:?} {expected:?}");
        }
        damage::endure(parse, &glb(), &scan());
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
