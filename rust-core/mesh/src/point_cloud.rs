//! Points without connectivity.

use glam::{DAffine3, DVec3};

use crate::Crs;

/// Scattered points with optional attributes. Every present attribute has one entry per point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// Coordinates in the cloud's own frame.
    pub positions: Vec<DVec3>,
    /// Unit normals.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Colours, sRGB with straight alpha.
    pub colour: Option<Vec<[u8; 4]>>,
    /// Strength of the returned signal, in the file's own unit.
    pub intensity: Option<Vec<f32>>,
    /// The place that all points were seen from, in the cloud's own frame. `None` if that is not known, or it was not one place.
    pub sensor: Option<DVec3>,
    /// Places the cloud in the world.
    pub world_from_cloud: DAffine3,
    /// The system of the world that it is placed in. `None` if that is not known.
    pub crs: Option<Crs>,
}

impl PointCloud {
    /// The system that its own coordinates are in: the world's, where its pose is the identity.
    pub fn crs_of_frame(&self) -> Option<Crs> {
        self.crs.clone().filter(|_| self.world_from_cloud == DAffine3::IDENTITY)
    }
}
