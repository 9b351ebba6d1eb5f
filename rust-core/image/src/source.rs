//! Sources of scans for the merge: each scan is loaded when its turn comes and dropped afterwards.

use std::borrow::{Borrow, Cow};
use std::hash::Hasher as _;
use std::path::Path;

use bytemuck::NoUninit;
use glam::{DAffine3, DVec3};
use rustc_hash::FxHasher;

use crate::oriented::OrientedPoints;
use crate::places::Places;
use crate::range_image::noise::Noise;
use crate::range_image::smooth::{self, Smoothed};
use crate::range_image::{Projection, RangeImage, Samples, blocks, repeats};
use crate::triangulate::{self, RangeSurface, TriangulateParams};
use crate::visibility::LinesOfSight;
use base::error::{Error, Result};
use base::magnitude;
use base::progress::Progress;
use mesh::point_cloud::PointCloud;
use mesh::{Attribute, AttributeData, Crs, TriMesh};

/// Purpose of loading a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loading {
    /// Triangulation of range images.
    pub triangulation: TriangulateParams,
    /// Size of the cells that the surface is meant for, in the unit of the scan: pixels that are finer and noisy are averaged.
    /// 0: every sample is wanted.
    pub cell: f64,
}

/// A moment of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment<'a> {
    /// The recording, by the path of its file or folder.
    pub recording: &'a Path,
    /// The number of the frame in it, or its time.
    pub at: f64,
}

/// One scan to merge: something that can be loaded as an oriented surface, more than once.
pub trait ScanSource: Sync {
    /// Name for messages. Ties are broken by it, then by content, so that the order of the scans does not matter.
    fn name(&self) -> &str;

    /// Reads the scan.
    ///
    /// # Errors
    /// Whatever reading or triangulating can meet. [`Error::Cancelled`].
    fn load(&self, loading: &Loading, progress: &Progress<'_>) -> Result<OrientedSurface>;

    /// The system of the world that it lies in, if it is known. Cheap beside loading.
    ///
    /// # Errors
    /// A file that can't be read.
    fn crs(&self) -> Result<Option<Crs>> {
        Ok(None)
    }

    /// The range image that the scan is, as it was measured: its lines of sight tell where nothing is. `None` for a mesh.
    ///
    /// # Errors
    /// Those of [`ScanSource::load`].
    fn image(&self, _: &Progress<'_>) -> Result<Option<Cow<'_, RangeImage>>> {
        Ok(None)
    }

    /// The content of its file, for a caller that loads it more than once. `None` for a scan in memory, and for points.
    ///
    /// # Errors
    /// Those of [`ScanSource::load`].
    fn decoded(&self, _: &Progress<'_>) -> Result<Option<Decoded>> {
        Ok(None)
    }

    /// The scan as points of its surface, in its own frame.
    ///
    /// # Errors
    /// Those of [`ScanSource::load`].
    fn oriented_points(&self, progress: &Progress<'_>) -> Result<OrientedPoints> {
        if let Some(image) = self.image(progress)? {
            return named(self.name(), OrientedPoints::of_image(&image, progress));
        }
        let surface = self.load(&Loading::default(), progress)?;
        let colour =
            surface.colour.map(|colour| Attribute { name: "colour".to_owned(), data: AttributeData::Colour(colour) });
        let mesh = TriMesh {
            positions: surface.positions,
            triangles: surface.triangles,
            vertex_attributes: colour.into_iter().collect(),
            ..TriMesh::default()
        };
        named(self.name(), OrientedPoints::of_mesh(&mesh, surface.world_from_surface))
    }

    /// The file that it is read from whenever it is loaded. `None` if it is in memory.
    fn file(&self) -> Option<&Path> {
        None
    }

    /// The moment that it was taken at. `None` where it is no frame of a recording, or the recording's frames have no order in time.
    fn moment(&self) -> Option<Moment<'_>> {
        None
    }

    /// Direction of up in its own frame, of length 1, where the sensor measured gravity: it holds whether the pose is known or not. `None`
    /// where nothing is known of it.
    fn up(&self) -> Option<DVec3> {
        None
    }

    /// Damage of its files that loading met and left out, after the scan's name: "is skipped: depth_3.png: ...". `None` where there was
    /// none so far.
    fn damage(&self) -> Option<String> {
        None
    }

    /// The places of its samples, whether it can be merged or not.
    ///
    /// # Errors
    /// Those of [`ScanSource::load`].
    fn places(&self, progress: &Progress<'_>) -> Result<Places> {
        if let Some(image) = self.image(progress)? {
            return named(self.name(), Places::of_image(&image, progress));
        }
        Ok(self.oriented_points(progress)?.into())
    }

    /// A number that follows from what the scan holds and where it lies, the same for equal scans only, but for one chance in 2^64. It
    /// breaks ties between scans of one name. It is asked for if there are such. O(samples).
    ///
    /// # Errors
    /// Those of [`ScanSource::load`].
    fn content(&self, triangulation: &TriangulateParams, progress: &Progress<'_>) -> Result<u64> {
        let surface = self.load(&Loading { triangulation: *triangulation, cell: 0.0 }, progress)?;
        let mut content = Content::of(&surface.world_from_surface);
        content.add(&surface.positions);
        content.add(&surface.triangles);
        content.add(&surface.confidence);
        content.add_some(surface.colour.as_deref());
        Ok(content.0.finish())
    }

    /// A number for what the scan is: the same as long as nothing of it changes that a merge depends on. Of files it may be told by their
    /// sizes and times.
    ///
    /// # Errors
    /// Those of [`ScanSource::load`].
    fn version(&self, triangulation: &TriangulateParams, progress: &Progress<'_>) -> Result<u64> {
        self.content(triangulation, progress)
    }
}

/// The content of a scan's file.
#[derive(Clone, Debug)]
pub enum Decoded {
    /// A range image, placed in the world.
    Image(RangeImage),
    /// A mesh, and the transform that places it in the world.
    Mesh(TriMesh, DAffine3),
}

impl Decoded {
    /// The scan as an oriented surface.
    ///
    /// # Errors
    /// Those of triangulating, or a mesh that can't be used. [`Error::Cancelled`].
    pub fn load(&self, loading: &Loading, progress: &Progress<'_>) -> Result<OrientedSurface> {
        match self {
            Decoded::Image(image) => OrientedSurface::from_range_image(image, loading, progress),
            Decoded::Mesh(mesh, world_from_mesh) => OrientedSurface::from_mesh(mesh, *world_from_mesh),
        }
    }

    /// The range image. `None` for a mesh.
    pub fn image(&self) -> Option<&RangeImage> {
        match self {
            Decoded::Image(image) => Some(image),
            Decoded::Mesh(..) => None,
        }
    }

    /// Bytes of its samples, or of its vertices and triangles.
    pub fn bytes(&self) -> u64 {
        let bytes = match self {
            Decoded::Image(image) => image.bytes(),
            Decoded::Mesh(mesh, _) => {
                let attributes = mesh.vertex_attributes.iter().chain(&mesh.face_attributes);
                size_of_val(&mesh.positions[..])
                    + size_of_val(&mesh.triangles[..])
                    + attributes.map(|attribute| attribute.data.bytes()).sum::<usize>()
            }
        };
        bytes as u64
    }
}

/// The system that scans of one world lie in.
///
/// # Errors
/// Scans of different systems, or in degrees, in which nothing can be measured. A file that can't be read.
pub fn common_crs(sources: &[&dyn ScanSource]) -> Result<Option<Crs>> {
    let named: Vec<_> = sources.iter().map(|scan| Ok((scan.name(), scan.crs()?))).collect::<Result<_>>()?;
    Crs::common(named)
}

/// The hash that [`ScanSource::content`] is made with.
struct Content(FxHasher);

impl Content {
    fn of(place: &DAffine3) -> Self {
        let mut content = Content(FxHasher::default());
        content.add(&place.to_cols_array());
        content
    }

    fn add<T: NoUninit>(&mut self, values: &[T]) {
        self.0.write_usize(values.len());
        self.0.write(bytemuck::cast_slice(values));
    }

    fn add_some<T: NoUninit>(&mut self, values: Option<&[T]>) {
        self.0.write_u8(values.is_some().into());
        self.add(values.unwrap_or_default());
    }
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
    /// sRGB with straight alpha, one per vertex.
    pub colour: Option<Vec<[u8; 4]>>,
    /// Median distance of neighbouring samples.
    pub spacing: f64,
    /// The effect of its noise on each vertex. `None` for a surface that is taken as it is.
    pub noise: Option<SampleNoise>,
    /// Measures of the range image that it is of.
    pub measured: Option<Measured>,
    /// Whether it is of a depth image that nobody has placed: its sensor stands at the origin and looks along z.
    pub is_unplaced: bool,
}

/// Measures of a range image beside its samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Its noise.
    pub noise: Noise,
    /// Whether places can be looked up in it ([`ScanSource::image`], [`LinesOfSight`]).
    pub has_lines_of_sight: bool,
}

/// The noise of a scan at the vertices of its surface. That surface is smoothed, so that it does not fold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampleNoise {
    /// From each vertex to where the surface is without the bias of smoothing, in the surface's frame.
    pub residual: Vec<[f32; 3]>,
    /// Standard deviation of the sample along its ray, as measured.
    pub deviation: Vec<f32>,
}

impl SampleNoise {
    /// Of the vertices of a surface whose pixels are among `pixels`, those of the samples that were smoothed.
    fn of(image: &RangeImage, smoothed: &Smoothed, pixels: &[u32], surface: &RangeSurface) -> Self {
        let mut noise = SampleNoise::default();
        let mut k = 0;
        for (&pixel, &position) in surface.pixels.iter().zip(&surface.positions) {
            while pixels[k] < pixel {
                k += 1;
            }
            let direction = image.projection().view_direction(position);
            let residual = direction * (smoothed.place[k] - smoothed.facing[k]);
            noise.residual.push(residual.as_vec3().to_array());
            noise.deviation.push(smoothed.deviation[k]);
        }
        noise
    }
}

/// A range image in memory.
impl ScanSource for RangeImage {
    fn name(&self) -> &str {
        &self.name
    }

    fn load(&self, loading: &Loading, progress: &Progress<'_>) -> Result<OrientedSurface> {
        named(&self.name, OrientedSurface::from_range_image(self, loading, progress))
    }

    fn crs(&self) -> Result<Option<Crs>> {
        Ok(self.crs.clone())
    }

    fn image(&self, _: &Progress<'_>) -> Result<Option<Cow<'_, RangeImage>>> {
        Ok(Some(Cow::Borrowed(self)))
    }

    fn content(&self, _: &TriangulateParams, _: &Progress<'_>) -> Result<u64> {
        let mut content = Content::of(&self.world_from_sensor);
        // Numbers of the projection in words: these are few, and their kinds differ.
        content.add(format!("{:?} {} {}", self.projection(), self.rows(), self.cols()).as_bytes());
        match self.samples() {
            Samples::Values(values) => content.add(values),
            Samples::Points(points) => content.add(points),
        }
        content.add_some(self.confidence.as_deref());
        content.add_some(self.colour.as_deref());
        Ok(content.0.finish())
    }
}

/// A mesh in memory, with its name and its place in the world.
#[derive(Clone, Debug)]
pub struct PlacedMesh<M> {
    /// Name for messages.
    pub name: String,
    /// The mesh. Its vertex attributes `confidence` and `colour` are used if there.
    pub mesh: M,
    /// Places it in the world.
    pub world_from_mesh: DAffine3,
}

impl<M: Borrow<TriMesh> + Sync> ScanSource for PlacedMesh<M> {
    fn name(&self) -> &str {
        &self.name
    }

    fn load(&self, _: &Loading, _: &Progress<'_>) -> Result<OrientedSurface> {
        named(&self.name, OrientedSurface::from_mesh(self.mesh.borrow(), self.world_from_mesh))
    }

    fn crs(&self) -> Result<Option<Crs>> {
        Ok(self.mesh.borrow().crs.clone().filter(|_| self.world_from_mesh == DAffine3::IDENTITY))
    }

    fn content(&self, _: &TriangulateParams, _: &Progress<'_>) -> Result<u64> {
        let mesh = self.mesh.borrow();
        let mut content = Content::of(&self.world_from_mesh);
        content.add(&mesh.positions);
        content.add(&mesh.triangles);
        for name in ["confidence", "colour"] {
            match mesh.vertex_attribute(name) {
                Some(AttributeData::F32(values)) => content.add(values),
                Some(AttributeData::Colour(values)) => content.add(values),
                _ => content.add::<u8>(&[]),
            }
        }
        Ok(content.0.finish())
    }
}

/// A point cloud as a scan that can be aligned. Merging takes a surface.
#[derive(Clone, Debug)]
pub struct PlacedCloud<C> {
    /// Name for messages.
    pub name: String,
    /// The points, with normals.
    pub cloud: C,
    /// Places them in the world.
    pub world_from_cloud: DAffine3,
}

impl<C: Borrow<PointCloud> + Sync> ScanSource for PlacedCloud<C> {
    fn name(&self) -> &str {
        &self.name
    }

    fn load(&self, _: &Loading, _: &Progress<'_>) -> Result<OrientedSurface> {
        named(&self.name, Err(Error::input("points without a grid or triangles are no surface: reconstruct one first")))
    }

    fn crs(&self) -> Result<Option<Crs>> {
        Ok(self.cloud.borrow().crs.clone())
    }

    fn oriented_points(&self, _: &Progress<'_>) -> Result<OrientedPoints> {
        named(&self.name, OrientedPoints::of_cloud(self.cloud.borrow(), self.world_from_cloud))
    }

    fn places(&self, progress: &Progress<'_>) -> Result<Places> {
        named(&self.name, Places::of_cloud(self.cloud.borrow(), self.world_from_cloud, progress))
    }
}

/// A scan that is read, or made, whenever it is needed.
pub trait Read {
    /// As merging and aligning take it.
    fn as_source(&self) -> &dyn ScanSource;

    /// The pose that it has.
    fn world_from_scan(&self) -> DAffine3;
}

/// A scan as a host hands it in: owned, named and placed. The host's objects may change or vanish while the work runs.
///
/// How a host shares images (`I`), meshes (`M`) and clouds (`C`) is its matter, such as by [`std::sync::Arc`]. `R` are its scans that are
/// read or made.
#[derive(Clone, Debug)]
pub enum Scan<I, M, C, R> {
    /// A range image in memory.
    Image(I),
    /// A mesh in memory.
    Mesh(PlacedMesh<M>),
    /// A point cloud in memory.
    Cloud(PlacedCloud<C>),
    /// One that is read, or made, when its turn comes.
    Read(R),
}

impl<I, M, C, R> Scan<I, M, C, R>
where
    I: Borrow<RangeImage>,
    M: Borrow<TriMesh> + Sync,
    C: Borrow<PointCloud> + Sync,
    R: Read,
{
    /// As merging and aligning take it.
    pub fn as_source(&self) -> &dyn ScanSource {
        match self {
            Scan::Image(image) => image.borrow(),
            Scan::Mesh(mesh) => mesh,
            Scan::Cloud(cloud) => cloud,
            Scan::Read(scan) => scan.as_source(),
        }
    }

    /// The pose that it has.
    pub fn world_from_scan(&self) -> DAffine3 {
        match self {
            Scan::Image(image) => image.borrow().world_from_sensor,
            Scan::Mesh(mesh) => mesh.world_from_mesh,
            Scan::Cloud(cloud) => cloud.world_from_cloud,
            Scan::Read(scan) => scan.world_from_scan(),
        }
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
    pub fn from_range_image(image: &RangeImage, loading: &Loading, progress: &Progress<'_>) -> Result<Self> {
        let Loading { triangulation, cell } = loading;
        triangulate::expect(image, triangulation)?;
        let own_size = repeats::undone(image);
        let image = own_size.as_ref().unwrap_or(image);
        let noise = Noise::measure(image, progress)?;
        let side = blocks::side(image, &noise, *cell);
        let averaged = match side {
            1 => None,
            _ => Some(blocks::averaged(image, &noise, side, progress)?),
        };
        let image = averaged.as_ref().unwrap_or(image);
        let mut grid = triangulate::samples(image, triangulation, progress)?;
        let smoothed = smooth::smoothed(image, &grid, &noise, side, progress)?;
        let pixels = smoothed.as_ref().map(|_| grid.pixels.clone());
        if let Some(smoothed) = &smoothed {
            grid.move_samples(|k, at| at + image.projection().view_direction(at) * smoothed.facing[k]);
        }
        let surface = triangulate::triangulate_samples(image, grid, triangulation, progress)?;
        let colour = image.colour.as_ref().map(|c| surface.pixels.iter().map(|&p| c[p as usize]).collect());
        let measured = Measured { noise, has_lines_of_sight: LinesOfSight::are_known(image.projection()) };
        let noise =
            (smoothed.zip(pixels)).map(|(smoothed, pixels)| SampleNoise::of(image, &smoothed, &pixels, &surface));
        Ok(OrientedSurface {
            positions: surface.positions,
            triangles: surface.triangles,
            world_from_surface: image.world_from_sensor,
            confidence: surface.confidence,
            colour,
            spacing: surface.spacing,
            noise,
            measured: Some(measured),
            is_unplaced: matches!(image.projection(), Projection::Pinhole { .. })
                && image.world_from_sensor == DAffine3::IDENTITY,
        })
    }

    /// Takes a mesh as it is: confidence 1 where it has none.
    ///
    /// # Errors
    /// An index out of range, a coordinate that is not finite or larger than [`magnitude::LARGEST`], an attribute of the wrong
    /// length.
    pub fn from_mesh(mesh: &TriMesh, world_from_mesh: DAffine3) -> Result<Self> {
        mesh.validate()?;
        magnitude::points("vertex", &mesh.positions)?;
        let m = world_from_mesh;
        for column in [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis, m.translation] {
            magnitude::place("each column of the transform that places the mesh", column)?;
        }
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
            noise: None,
            measured: None,
            is_unplaced: false,
        })
    }
}

#[cfg(test)]
mod tests {
    use mesh::shapes::Shape;

    use super::*;

    #[test]
    fn numbers_too_large_are_refused_by_name() {
        let mut mesh = Shape::Cuboid { half: DVec3::ONE }.mesh(2);
        let far = DAffine3::from_scale(DVec3::new(1.0, 1e200, 1.0));
        let text = |mesh: &TriMesh, place| OrientedSurface::from_mesh(mesh, place).unwrap_err().to_string();
        assert!(text(&mesh, far).contains("(0, 1e200, 0)"));
        mesh.positions[7].z = -1e200;
        assert!(text(&mesh, DAffine3::IDENTITY).starts_with("vertex 7 lies at "));
    }
}
