//! A mesh as one primitive: triangles or points with one material.

use std::borrow::Cow;
use std::fmt::Write as _;

use glam::{DVec3, Vec3};

use super::buffer::{Buffer, FLOAT, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT, quoted};
use super::sink::{CHUNK, GlbSink};
use base::error::Result;
use mesh::{Attribute, AttributeData, TriMesh, texture};

/// Triangles or points that are drawn at once.
pub struct Primitive<'a> {
    pub mesh: Cow<'a, TriMesh>,
    /// Taken off all positions.
    pub origin: DVec3,
    /// Bounds of the positions as written.
    pub bounds: [Vec3; 2],
    /// None of points.
    pub normals: Vec<[f32; 3]>,
    pub tangents: Option<Vec<[f32; 4]>>,
    /// Tile whose images it shows, if it shows any.
    pub tile: Option<u32>,
}

impl Primitive<'_> {
    /// Colours, unless images have them: glTF multiplies both.
    fn colour(&self) -> Option<&[[u8; 4]]> {
        match self.mesh.vertex_attribute(COLOUR) {
            Some(AttributeData::Colour(colours)) if self.tile.is_none() => Some(colours),
            _ => None,
        }
    }

    /// Its JSON, with that material. `None` without vertices.
    pub fn json(&self, material: usize, buffer: &mut Buffer) -> Option<String> {
        const INDICES: u32 = 34963;
        const VERTICES: u32 = 34962;
        let mesh = &self.mesh;
        let count = mesh.positions.len();
        if count == 0 {
            return None;
        }
        let mut indices = String::new();
        if !mesh.triangles.is_empty() {
            let view = buffer.take(3 * mesh.triangles.len(), UNSIGNED_INT, "SCALAR", 4, INDICES, "");
            indices = format!(",\"indices\":{view}");
        }
        let [lo, hi] = self.bounds;
        let bounds = format!(",\"min\":[{},{},{}],\"max\":[{},{},{}]", lo.x, lo.y, lo.z, hi.x, hi.y, hi.z);
        let mut attributes = String::new();
        let mut take = |name: &str, component: u32, kind: &str, bytes: u64, more: &str| {
            let view = buffer.take(count, component, kind, bytes, VERTICES, more);
            let comma = if attributes.is_empty() { "" } else { "," };
            let _ = write!(attributes, "{comma}{}:{view}", quoted(name));
        };
        take("POSITION", FLOAT, "VEC3", 12, &bounds);
        if !self.normals.is_empty() {
            take("NORMAL", FLOAT, "VEC3", 12, "");
        }
        if self.tangents.is_some() {
            take("TANGENT", FLOAT, "VEC4", 16, "");
        }
        if self.colour().is_some() {
            take("COLOR_0", UNSIGNED_SHORT, "VEC4", 8, ",\"normalized\":true");
        }
        if texture::coordinates(mesh).is_some() {
            take("TEXCOORD_0", FLOAT, "VEC2", 8, "");
        }
        for attribute in custom(mesh) {
            let name = written_name(attribute);
            match attribute.data {
                AttributeData::Colour(_) => take(&name, UNSIGNED_BYTE, "VEC4", 4, ",\"normalized\":true"),
                _ => take(&name, FLOAT, "SCALAR", 4, ""),
            }
        }
        // 4: triangles, 0: points.
        let mode = if mesh.triangles.is_empty() { 0 } else { 4 };
        Some(format!("{{\"attributes\":{{{attributes}}}{indices},\"material\":{material},\"mode\":{mode}}}"))
    }

    /// Writes what [`Primitive::json`] has announced, in the same order.
    pub fn write(&self, sink: &mut GlbSink<'_, '_, '_>) -> Result<()> {
        let mesh = &self.mesh;
        let single = |v: Vec3| v.to_array().map(|x| x.to_bits().to_le());
        sink.all(&mesh.triangles, |t| t.map(u32::to_le))?;
        sink.all(&mesh.positions, |&p| single((p - self.origin).as_vec3()))?;
        sink.all(&self.normals, |n| n.map(|x| x.to_bits().to_le()))?;
        sink.all(self.tangents.as_deref().unwrap_or_default(), |t| t.map(|x| x.to_bits().to_le()))?;
        if let Some(colour) = self.colour() {
            let linear = linear_table();
            sink.all(colour, |&[r, g, b, a]| {
                let [r, g, b] = [r, g, b].map(|x| linear[x as usize].to_le());
                [r, g, b, (u16::from(a) * 257).to_le()]
            })?;
        }
        if let Some([s, t]) = texture::coordinates(mesh) {
            for (s, t) in s.chunks(CHUNK).zip(t.chunks(CHUNK)) {
                let pairs: Vec<[f32; 2]> = s.iter().zip(t).map(|(&s, &t)| [s, t]).collect();
                // glTF counts from the top.
                sink.all(&pairs, |&[s, t]| [s, 1.0 - t].map(|x| x.to_bits().to_le()))?;
            }
        }
        for attribute in custom(mesh) {
            match &attribute.data {
                AttributeData::F32(v) => sink.all(v, |x| [x.to_bits().to_le()])?,
                AttributeData::I32(v) => sink.all(v, |&x| [(x as f32).to_bits().to_le()])?,
                AttributeData::Bool(v) => sink.all(v, |&x| [f32::from(u8::from(x)).to_bits().to_le()])?,
                AttributeData::Colour(v) => sink.all(v, |&x| x)?,
            }
        }
        Ok(())
    }
}

/// Attribute that glTF has a place for.
const COLOUR: &str = "colour";

/// Attributes that glTF has no place of its own for.
pub fn custom(mesh: &TriMesh) -> impl Iterator<Item = &Attribute> {
    let is_textured = texture::coordinates(mesh).is_some();
    let has_place = move |of: &Attribute| match &of.data {
        AttributeData::Colour(_) => of.name == COLOUR,
        _ => is_textured && texture::has_name(&of.name),
    };
    mesh.vertex_attributes.iter().filter(move |of| !has_place(of))
}

/// Name of such an attribute in the file.
pub fn written_name(attribute: &Attribute) -> String {
    format!("_{}", attribute.name.to_uppercase())
}

/// From an sRGB byte to a linear value in 16 bits.
fn linear_table() -> [u16; 256] {
    std::array::from_fn(|i| {
        let x = i as f64 / 255.0;
        let linear = if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
        (linear * 65535.0).round() as u16
    })
}
