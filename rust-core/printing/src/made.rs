//! A surface in the making, which knows where each vertex and each face comes from. Attributes follow from that.

use glam::DVec3;

use mesh::srgb::Mix;
use mesh::{Attribute, AttributeData, TriMesh};

/// Name of the attribute of faces that no input has.
pub const ADDED: &str = "added";
/// Name of the attribute of faces that has the number of their part.
pub const PART: &str = "part";
/// At the peak of the steps: the mesh twice, its edges and its boxes.
pub const BYTES_A_TRIANGLE: f64 = 210.0;

/// Source of a vertex, by the numbers of the mesh before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Origin {
    /// A vertex, at its place.
    Kept(u32),
    /// A place between two vertices, at a share of the way.
    Between([u32; 2], f64),
    /// None.
    New,
}

/// Triangles with their sources.
#[derive(Clone, Debug, Default)]
pub struct Made {
    pub positions: Vec<DVec3>,
    pub origins: Vec<Origin>,
    pub triangles: Vec<[u32; 3]>,
    /// The face that a triangle is, or is a piece of. `None` for an added one.
    pub faces: Vec<Option<u32>>,
    /// Whether a triangle lies elsewhere than its source. It may cross others.
    pub is_fresh: Vec<bool>,
}

impl Made {
    /// A mesh as it is.
    pub fn of(mesh: &TriMesh) -> Self {
        Made {
            positions: mesh.positions.clone(),
            origins: (0..mesh.positions.len() as u32).map(Origin::Kept).collect(),
            triangles: mesh.triangles.clone(),
            faces: (0..mesh.triangles.len() as u32).map(Some).collect(),
            is_fresh: vec![false; mesh.triangles.len()],
        }
    }

    /// Adds a vertex, and gives its number.
    pub fn vertex(&mut self, place: DVec3, origin: Origin) -> u32 {
        self.positions.push(place);
        self.origins.push(origin);
        self.positions.len() as u32 - 1
    }

    /// Adds a triangle.
    pub fn triangle(&mut self, corners: [u32; 3], face: Option<u32>, is_fresh: bool) {
        self.triangles.push(corners);
        self.faces.push(face);
        self.is_fresh.push(is_fresh);
    }

    /// Drops the triangles that are not kept.
    pub fn retain(&mut self, is_kept: impl Fn(usize, &[u32; 3]) -> bool) {
        let kept: Vec<usize> = (0..self.triangles.len()).filter(|&t| is_kept(t, &self.triangles[t])).collect();
        self.triangles = kept.iter().map(|&t| self.triangles[t]).collect();
        self.faces = kept.iter().map(|&t| self.faces[t]).collect();
        self.is_fresh = kept.iter().map(|&t| self.is_fresh[t]).collect();
    }

    /// Drops the vertices that no triangle uses. The others keep their order.
    pub fn compact(&mut self) {
        let mut is_used = vec![false; self.positions.len()];
        self.triangles.iter().flatten().for_each(|&v| is_used[v as usize] = true);
        let used: Vec<usize> = (0..is_used.len()).filter(|&v| is_used[v]).collect();
        let mut numbers = vec![u32::MAX; is_used.len()];
        used.iter().enumerate().for_each(|(number, &v)| numbers[v] = number as u32);
        self.positions = used.iter().map(|&v| self.positions[v]).collect();
        self.origins = used.iter().map(|&v| self.origins[v]).collect();
        self.triangles.iter_mut().flatten().for_each(|v| *v = numbers[*v as usize]);
    }

    /// The mesh, with the attributes of the one before. Vertices between others have means. Added faces and new vertices have no confidence,
    /// no scan and no colour of their own.
    pub fn finish(self, before: &TriMesh) -> TriMesh {
        let vertex_attributes = before.vertex_attributes.iter().map(|a| at_vertices(a, &self.origins)).collect();
        let face_attributes = before.face_attributes.iter().map(|a| at_faces(a, &self.faces)).collect();
        TriMesh {
            positions: self.positions,
            triangles: self.triangles,
            vertex_attributes,
            face_attributes,
            rounding_room: None,
            crs: before.crs.clone(),
        }
    }
}

/// Appends the entries of an attribute to those of another of the same kind.
pub fn append(into: &mut AttributeData, from: AttributeData) {
    match (into, from) {
        (AttributeData::F32(into), AttributeData::F32(from)) => into.extend(from),
        (AttributeData::I32(into), AttributeData::I32(from)) => into.extend(from),
        (AttributeData::Bool(into), AttributeData::Bool(from)) => into.extend(from),
        (AttributeData::Colour(into), AttributeData::Colour(from)) => into.extend(from),
        (into, from) => unreachable!("{into:?} and {from:?} were made of one attribute"),
    }
}

/// Marks no face as added.
pub fn mark(mesh: &mut TriMesh) {
    mesh.face_attributes.retain(|attribute| attribute.name != ADDED);
    mesh.face_attributes.push(Attribute::bool(ADDED, vec![false; mesh.triangles.len()]));
}

fn at_vertices(attribute: &Attribute, origins: &[Origin]) -> Attribute {
    /// The nearer end's.
    fn picked<T: Copy>(values: &[T], origins: &[Origin], none: T) -> Vec<T> {
        let pick = |origin: &Origin| match *origin {
            Origin::Kept(v) => values[v as usize],
            Origin::Between(ends, share) => values[ends[usize::from(share > 0.5)] as usize],
            Origin::New => none,
        };
        origins.iter().map(pick).collect()
    }
    let name = attribute.name.as_str();
    let data = match &attribute.data {
        AttributeData::F32(values) => {
            let mean = |origin: &Origin| match *origin {
                Origin::Kept(v) => values[v as usize],
                Origin::Between(ends, share) => {
                    let [a, b] = ends.map(|v| values[v as usize]);
                    if a == b { a } else { (f64::from(a) * (1.0 - share) + f64::from(b) * share) as f32 }
                }
                Origin::New => 0.0,
            };
            AttributeData::F32(origins.iter().map(mean).collect())
        }
        AttributeData::Colour(values) => {
            let mean = |origin: &Origin| match *origin {
                Origin::Kept(v) => values[v as usize],
                Origin::Between(ends, share) => {
                    let [a, b] = ends.map(|v| values[v as usize]);
                    Mix::of_triangle([a, b, b], [1.0 - share as f32, share as f32, 0.0])
                }
                Origin::New => [0; 4],
            };
            AttributeData::Colour(origins.iter().map(mean).collect())
        }
        AttributeData::I32(values) => AttributeData::I32(picked(values, origins, -1)),
        AttributeData::Bool(values) => AttributeData::Bool(picked(values, origins, name == "interpolated")),
    };
    Attribute { name: name.to_owned(), data }
}

fn at_faces(attribute: &Attribute, faces: &[Option<u32>]) -> Attribute {
    fn picked<T: Copy>(values: &[T], faces: &[Option<u32>], none: T) -> Vec<T> {
        faces.iter().map(|face| face.map_or(none, |t| values[t as usize])).collect()
    }
    let name = attribute.name.as_str();
    let data = match &attribute.data {
        AttributeData::F32(values) => AttributeData::F32(picked(values, faces, 0.0)),
        AttributeData::I32(values) => AttributeData::I32(picked(values, faces, -1)),
        AttributeData::Bool(values) => AttributeData::Bool(picked(values, faces, name == ADDED)),
        AttributeData::Colour(values) => AttributeData::Colour(picked(values, faces, [0; 4])),
    };
    Attribute { name: name.to_owned(), data }
}
