//! Triangle meshes and their attributes.

use glam::DVec3;

use crate::crs::Crs;
use base::error::{Error, Result};

/// A triangle mesh. Triangles turn counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    /// Coordinates of the vertices.
    pub positions: Vec<DVec3>,
    /// Three vertices per triangle.
    pub triangles: Vec<[u32; 3]>,
    /// One entry per vertex each.
    pub vertex_attributes: Vec<Attribute>,
    /// One entry per triangle each.
    pub face_attributes: Vec<Attribute>,
    /// Distance by which each vertex may be moved by rounding its coordinates without breaking what was certified of the mesh, in the unit
    /// of the coordinates. `None` if nothing was. Files that can hold double precision do where single precision would move a vertex
    /// farther.
    pub rounding_room: Option<f64>,
    /// The system that the coordinates are in. `None` if that is not known, or they are in a frame of their own.
    pub crs: Option<Crs>,
}

/// A named attribute. Names in use: `colour` (sRGB with straight alpha), `confidence`, `intensity`, `error` (world units),
/// `range_row`, `range_col`, `source_scan`, `interpolated` (vertices not on any scan), `hole_fill` (faces), `s` and `t` (texture
/// coordinates).
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// Name, the same in files and hosts.
    pub name: String,
    /// The entries.
    pub data: AttributeData,
}

/// The entries of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub enum AttributeData {
    /// One float an element.
    F32(Vec<f32>),
    /// One integer an element.
    I32(Vec<i32>),
    /// A flag an element.
    Bool(Vec<bool>),
    /// A colour an element, sRGB with straight alpha.
    Colour(Vec<[u8; 4]>),
}

impl AttributeData {
    /// Number of entries.
    pub fn len(&self) -> usize {
        match self {
            AttributeData::F32(v) => v.len(),
            AttributeData::I32(v) => v.len(),
            AttributeData::Bool(v) => v.len(),
            AttributeData::Colour(v) => v.len(),
        }
    }

    /// Bytes of all entries.
    pub fn bytes(&self) -> usize {
        self.len() * self.bytes_of_an_entry()
    }

    /// The entries at some places, in their order. A place may come more than once.
    ///
    /// # Panics
    /// If there is no such entry.
    pub fn gather(&self, places: &[usize]) -> Self {
        fn pick<T: Copy>(entries: &[T], places: &[usize]) -> Vec<T> {
            places.iter().map(|&i| entries[i]).collect()
        }
        match self {
            AttributeData::F32(v) => AttributeData::F32(pick(v, places)),
            AttributeData::I32(v) => AttributeData::I32(pick(v, places)),
            AttributeData::Bool(v) => AttributeData::Bool(pick(v, places)),
            AttributeData::Colour(v) => AttributeData::Colour(pick(v, places)),
        }
    }

    /// Whether there is no entry.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Attribute {
    /// An attribute of floats.
    pub fn f32(name: &str, data: Vec<f32>) -> Self {
        Attribute { name: name.to_owned(), data: AttributeData::F32(data) }
    }

    /// An attribute of integers.
    pub fn i32(name: &str, data: Vec<i32>) -> Self {
        Attribute { name: name.to_owned(), data: AttributeData::I32(data) }
    }

    /// The entries at some places, as [`AttributeData::gather`].
    pub fn gather(&self, places: &[usize]) -> Self {
        Attribute { name: self.name.clone(), data: self.data.gather(places) }
    }

    /// An attribute of flags.
    pub fn bool(name: &str, data: Vec<bool>) -> Self {
        Attribute { name: name.to_owned(), data: AttributeData::Bool(data) }
    }

    /// An attribute of colours.
    pub fn colour(name: &str, data: Vec<[u8; 4]>) -> Self {
        Attribute { name: name.to_owned(), data: AttributeData::Colour(data) }
    }
}

impl TriMesh {
    /// A mesh without attributes.
    pub fn new(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        TriMesh { positions, triangles, ..TriMesh::default() }
    }

    /// The vertex attribute of that name.
    pub fn vertex_attribute(&self, name: &str) -> Option<&AttributeData> {
        self.vertex_attributes.iter().find(|a| a.name == name).map(|a| &a.data)
    }

    /// The face attribute of that name.
    pub fn face_attribute(&self, name: &str) -> Option<&AttributeData> {
        self.face_attributes.iter().find(|a| a.name == name).map(|a| &a.data)
    }

    /// Corners of triangle `t`.
    pub fn corners(&self, t: usize) -> [DVec3; 3] {
        self.triangles[t].map(|v| self.positions[v as usize])
    }

    /// Distance by which single precision moves the vertex that it moves farthest. 0 if it holds all coordinates.
    pub fn single_rounding(&self) -> f64 {
        self.positions.iter().map(|p| p.distance(p.as_vec3().as_dvec3())).fold(0.0, f64::max)
    }

    /// Median length of the edges, 0 without triangles.
    pub fn median_edge(&self) -> f64 {
        let mut lengths: Vec<f64> = (0..self.triangles.len())
            .flat_map(|t| {
                let [a, b, c] = self.corners(t);
                [a.distance(b), b.distance(c), c.distance(a)]
            })
            .collect();
        if lengths.is_empty() {
            return 0.0;
        }
        let middle = lengths.len() / 2;
        *lengths.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// Checks that indices are in range, coordinates finite and attributes complete.
    ///
    /// # Errors
    /// [`Error::Input`] naming the first bad element.
    pub fn validate(&self) -> Result<()> {
        if let Some(v) = self.positions.iter().position(|p| !p.is_finite()) {
            return Err(Error::input(format!("vertex {v} has a coordinate that is not finite: {}", self.positions[v])));
        }
        let count = self.positions.len();
        for (t, triangle) in self.triangles.iter().enumerate() {
            if let Some(v) = triangle.iter().find(|&&v| v as usize >= count) {
                return Err(Error::input(format!(
                    "triangle {t} names vertex {v}, but there are only {count} vertices"
                )));
            }
        }
        for (attributes, elements, what) in
            [(&self.vertex_attributes, count, "vertices"), (&self.face_attributes, self.triangles.len(), "triangles")]
        {
            if let Some(a) = attributes.iter().find(|a| a.data.len() != elements) {
                let (name, length) = (&a.name, a.data.len());
                return Err(Error::input(format!(
                    "attribute {name} has {length} entries for {elements} {what}: give one each"
                )));
            }
        }
        Ok(())
    }
}
