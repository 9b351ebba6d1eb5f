//! Oriented points: what any scan, image, mesh or cloud, comes down to where only its surface counts.

use glam::{DAffine3, DVec3};

use crate::range_image::samples::SampleGrid;
use crate::range_image::spacing::{EdgeLimit, Spacing};
use crate::range_image::{RangeImage, Viewing, repeats};
use base::error::{Error, Result};
use base::magnitude;
use base::progress::Progress;
use geom::neighbours::KdTree;
use mesh::point_cloud::PointCloud;
use mesh::{AttributeData, TriMesh};

/// Points of a surface, each with the piece of it that it stands for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OrientedPoints {
    /// In the scan's own frame.
    pub positions: Vec<DVec3>,
    /// A vector area a point: normal, outward, times the area of the surface around it. Sums of neighbours' are the vector
    /// area of the patch, in which noise within the patch cancels.
    pub areas: Vec<DVec3>,
    /// sRGB with straight alpha, one per point.
    pub colour: Option<Vec<[u8; 4]>>,
    /// Strength of the returned signal, one per point, in the sensor's own unit.
    pub intensity: Option<Vec<f32>>,
    /// From where they were seen, if that is known.
    pub viewing: Option<Viewing>,
    /// Median distance of neighbours. The larger one of rows and columns if pixels are not square.
    pub spacing: f64,
    /// Places them in the world.
    pub world_from_points: DAffine3,
}

impl OrientedPoints {
    /// The valid pixels of an image that lie on a surface: with a neighbour along the row and one along the column that is no
    /// jump away. O(pixels).
    ///
    /// # Errors
    /// An attribute of the wrong length, more than 2^32 - 2 pixels, a coordinate larger than [`magnitude::LARGEST`]. Cancelled.
    pub fn of_image(image: &RangeImage, progress: &Progress<'_>) -> Result<Self> {
        image.validate()?;
        let own_size = repeats::undone(image);
        let image = own_size.as_ref().unwrap_or(image);
        let grid = SampleGrid::new(image, progress)?;
        magnitude::points("sample", &grid.positions)?;
        let spacing = Spacing::of(image, &grid, progress)?;
        let limit = EdgeLimit::from_data(image, &grid, spacing, progress)?;
        let mut points = OrientedPoints {
            viewing: Some(match image.projection().eye() {
                Some(eye) => Viewing::From(eye),
                None => Viewing::Parallel(image.projection().view_direction(DVec3::ZERO)),
            }),
            spacing: spacing.larger(),
            world_from_points: image.world_from_sensor,
            colour: image.colour.as_ref().map(|_| Vec::new()),
            intensity: image.intensity.as_ref().map(|_| Vec::new()),
            ..OrientedPoints::default()
        };
        for block in progress.ranges(grid.len()) {
            for k in block? {
                let here = grid.positions[k];
                let [left, right, up, down] = limit.allowed(&grid, k).map(|n| n.map(|n| grid.positions[n] - here));
                let mut sum = DVec3::ZERO;
                for (first, second) in [(right, down), (down, left), (left, up), (up, right)] {
                    if let (Some(first), Some(second)) = (first, second) {
                        sum += first.cross(second);
                    }
                }
                if sum == DVec3::ZERO {
                    continue;
                }
                let away = sum.dot(image.projection().view_direction(here)) > 0.0;
                points.positions.push(here);
                points.areas.push(if away { -0.25 * sum } else { 0.25 * sum });
                if let (Some(all), Some(colour)) = (&mut points.colour, &image.colour) {
                    all.push(colour[grid.pixels[k] as usize]);
                }
                if let (Some(all), Some(intensity)) = (&mut points.intensity, &image.intensity) {
                    all.push(intensity[grid.pixels[k] as usize]);
                }
            }
        }
        Ok(points)
    }

    /// The vertices of a mesh that have a face, each with a third of its faces.
    ///
    /// # Errors
    /// An index out of range, a coordinate that is not finite or too large.
    pub fn of_mesh(mesh: &TriMesh, world_from_mesh: DAffine3) -> Result<Self> {
        mesh.validate()?;
        magnitude::points("vertex", &mesh.positions)?;
        let mut areas = vec![DVec3::ZERO; mesh.positions.len()];
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
            let share = (b - a).cross(c - a) / 6.0;
            triangle.iter().for_each(|&v| areas[v as usize] += share);
        }
        let colour = match mesh.vertex_attribute("colour") {
            Some(AttributeData::Colour(colour)) => Some(colour),
            _ => None,
        };
        let intensity = match mesh.vertex_attribute("intensity") {
            Some(AttributeData::F32(intensity)) => Some(intensity),
            _ => None,
        };
        let used = |v: &usize| areas[*v] != DVec3::ZERO;
        Ok(OrientedPoints {
            positions: (0..areas.len()).filter(used).map(|v| mesh.positions[v]).collect(),
            colour: colour.map(|colour| (0..areas.len()).filter(used).map(|v| colour[v]).collect()),
            intensity: intensity.map(|intensity| (0..areas.len()).filter(used).map(|v| intensity[v]).collect()),
            areas: areas.iter().copied().filter(|&area| area != DVec3::ZERO).collect(),
            viewing: None,
            spacing: mesh.median_edge(),
            world_from_points: world_from_mesh,
        })
    }

    /// The points of a cloud that has normals. O(n log n).
    ///
    /// # Errors
    /// A cloud without normals. A coordinate too large.
    pub fn of_cloud(cloud: &PointCloud, world_from_points: DAffine3) -> Result<Self> {
        magnitude::points("point", &cloud.positions)?;
        let Some(normals) = &cloud.normals else {
            return Err(Error::input(
                "the cloud has no normals, so that it is not known which side of its surface is outside: reconstruct its \
                 surface first",
            ));
        };
        let spacing = cloud_spacing(&cloud.positions);
        let normal = |k: usize| DVec3::from(normals[k].map(f64::from)).normalize_or_zero() * spacing * spacing;
        let used: Vec<usize> = (0..cloud.positions.len()).filter(|&k| normal(k) != DVec3::ZERO).collect();
        Ok(OrientedPoints {
            positions: used.iter().map(|&k| cloud.positions[k]).collect(),
            areas: used.iter().map(|&k| normal(k)).collect(),
            colour: cloud.colour.as_ref().map(|colour| used.iter().map(|&k| colour[k]).collect()),
            intensity: cloud.intensity.as_ref().map(|intensity| used.iter().map(|&k| intensity[k]).collect()),
            viewing: None,
            spacing,
            world_from_points,
        })
    }
}

/// One in so many points looks for its nearest neighbour among the others.
const LOOKING: usize = 20;

/// Median distance of nearest neighbours. 0 if there are fewer than two points.
fn cloud_spacing(points: &[DVec3]) -> f64 {
    let (looking, rest): (Vec<_>, Vec<_>) = points.iter().enumerate().partition(|(k, _)| k % LOOKING == 0);
    let tree = KdTree::new(&rest.into_iter().map(|(_, p)| *p).collect::<Vec<_>>());
    let nearest = looking.into_iter().filter_map(|(_, p)| tree.nearest(*p).map(|(_, distance)| distance));
    let mut distances: Vec<f64> = nearest.collect();
    distances.sort_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied().unwrap_or(0.0)
}
