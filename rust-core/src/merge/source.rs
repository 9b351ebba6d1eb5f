//! Where the merge gets its scans from: each is loaded when its turn comes and dropped afterwards.

use glam::{DAffine3, DVec3};

use crate::error::{Error, Result};
use crate::mesh::{AttributeData, TriMesh};
use crate::range_image::RangeImage;
use crate::triangulate::{self, TriangulateParams};

/// One scan to merge: something that can be loaded as an oriented surface, more than once.
pub trait ScanSource: Sync {
    /// Name for messages; also what ties are broken by, so that the order of the scans does not matter.
    fn name(&self) -> &str;

    /// Reads the scan.
    ///
    /// # Errors
    /// Whatever reading or triangulating can meet.
    fn load(&self, triangulation: &TriangulateParams) -> Result<OrientedSurface>;
}

/// An oriented triangle surface placed in the world, with a weight a vertex: a triangulated scan or any mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OrientedSurface {
    /// Vertices in the surface's own frame.
    pub positions: Vec<DVec3>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Places the surface in the world.
    pub world_from_surface: DAffine3,
    /// Trust in each vertex, >= 0.
    pub confidence: Vec<f32>,
    /// sRGB with straight alpha, one a vertex.
    pub colour: Option<Vec<[u8; 4]>>,
    /// Median distance of neighbouring samples.
    pub spacing: f64,
}

/// A range image in memory.
impl ScanSource for RangeImage {
    fn name(&self) -> &str {
        &self.name
    }

    fn load(&self, triangulation: &TriangulateParams) -> Result<OrientedSurface> {
        named(&self.name, OrientedSurface::from_range_image(self, triangulation))
    }
}

/// A mesh in memory, with its name and its place in the world.
#[derive(Clone, Debug)]
pub struct PlacedMesh<'a> {
    /// Name for messages.
    pub name: String,
    /// The mesh; its vertex attributes `confidence` and `colour` are used if there.
    pub mesh: &'a TriMesh,
    /// Places it in the world.
    pub world_from_mesh: DAffine3,
}

impl ScanSource for PlacedMesh<'_> {
    fn name(&self) -> &str {
        &self.name
    }

    fn load(&self, _: &TriangulateParams) -> Result<OrientedSurface> {
        named(&self.name, OrientedSurface::from_mesh(self.mesh, self.world_from_mesh))
    }
}

/// Says of which scan an error is.
fn named<T>(name: &str, outcome: Result<T>) -> Result<T> {
    match outcome {
        Err(Error::Input(text)) if !name.is_empty() => Err(Error::Input(format!("{name}: {text}"))),
        other => other,
    }
}

impl OrientedSurface {
    /// Triangulates a range image.
    ///
    /// # Errors
    /// See [`triangulate::triangulate`].
    pub fn from_range_image(image: &RangeImage, triangulation: &TriangulateParams) -> Result<Self> {
        let surface = triangulate::triangulate(image, triangulation)?;
        let colour = image.colour.as_ref().map(|c| surface.pixels.iter().map(|&p| c[p as usize]).collect());
        Ok(OrientedSurface {
            positions: surface.positions,
            triangles: surface.triangles,
            world_from_surface: image.world_from_sensor,
            confidence: surface.confidence,
            colour,
            spacing: surface.spacing,
        })
    }

    /// Takes a mesh as it is: confidence 1 where it has none.
    ///
    /// # Errors
    /// An index out of range, a coordinate that is not finite, an attribute of the wrong length.
    pub fn from_mesh(mesh: &TriMesh, world_from_mesh: DAffine3) -> Result<Self> {
        mesh.validate()?;
        let confidence = match mesh.vertex_attribute("confidence") {
            Some(AttributeData::F32(c)) => c.iter().map(|&c| if c >= 0.0 && c.is_finite() { c } else { 0.0 }).collect(),
            _ => vec![1.0; mesh.positions.len()],
        };
        let colour = match mesh.vertex_attribute("colour") {
            Some(AttributeData::Colour(c)) => Some(c.clone()),
            _ => None,
        };
        Ok(OrientedSurface {
            positions: mesh.positions.clone(),
            triangles: mesh.triangles.clone(),
            world_from_surface: world_from_mesh,
            confidence,
            colour,
            spacing: mesh.median_edge(),
        })
    }
}
