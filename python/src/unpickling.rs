//! Objects made again of what [`crate::pickling`] gave pickle, to the bit.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::import::{FileScan as CoreScan, Kept};
use surfrecon::mesh::{Attribute, AttributeData, Crs};
use surfrecon::range_image::Projection;
use surfrecon::{PointCloud as CoreCloud, RangeImage as CoreImage, TriMesh};

use crate::arrays::{self, Extent};
use crate::constraints::Pick;
use crate::errors::{guarded, input_error, to_python};
use crate::frame::{self, Scan};
use crate::mesh::Mesh;
use crate::point_cloud::PointCloud;
use crate::progress::Watch;
use crate::projection;
use crate::range_image::RangeImage;
use crate::regions::{OrientedBox, Plane};
use crate::scan::Camera;
use crate::scans::ScanSet;

/// The frame that was made last: others of its recording share what is known of it. Locked by those alone who hold the interpreter's lock.
static LAST: Mutex<Option<CoreScan>> = Mutex::new(None);

/// Makes the object again that ``pickle`` was given.
///
/// Raises:
///     InputError: parts that no object of this version has.
#[pyfunction]
pub fn _again<'py>(py: Python<'py>, kind: &str, parts: &Bound<'py, PyDict>) -> PyResult<Bound<'py, PyAny>> {
    let parts = Parts(parts);
    Ok(match kind {
        "mesh" => Bound::new(py, Mesh::from(guarded(|| parts.mesh())?))?.into_any(),
        "cloud" => Bound::new(py, PointCloud { cloud: Arc::new(guarded(|| parts.cloud())?) })?.into_any(),
        "image" => Bound::new(py, RangeImage::from(guarded(|| parts.image())?))?.into_any(),
        "camera" => Bound::new(py, parts.camera()?)?.into_any(),
        "box" => Bound::new(py, OrientedBox::of_numbers(parts.taken("numbers")?, parts.taken("text")?)?)?.into_any(),
        "plane" => {
            let found = (parts.taken("share")?, parts.taken("spread")?);
            Bound::new(py, Plane::of_numbers(parts.taken("numbers")?, found)?)?.into_any()
        }
        "pick" => {
            let [a, b, point_a, point_b] = ["a", "b", "point_a", "point_b"].map(|name| parts.item(name));
            let normals = parts.given("normals")?;
            let pick = Pick::new(&a?, &b?, &point_a?, &point_b?, normals.as_ref(), parts.taken("weight")?, None)?;
            Bound::new(py, pick)?.into_any()
        }
        "scan" => parts.scan(py)?.into_bound(py).into_any(),
        "scans" => Bound::new(py, ScanSet::of(parts.taken("scans")?, parts.taken("notes")?))?.into_any(),
        _ => {
            return Err(input_error(format!(
                "there is no kind {kind:?} of object: read it with the newer version that wrote it"
            )));
        }
    })
}

/// Parts that an object is made of.
struct Parts<'a, 'py>(&'a Bound<'py, PyDict>);

impl<'py> Parts<'_, 'py> {
    fn item(&self, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let lacking =
            || input_error(format!("the part '{name}' is missing: read the object with the version that wrote it"));
        self.0.get_item(name)?.ok_or_else(lacking)
    }

    /// A part that may be `None`.
    fn given(&self, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        Ok(Some(self.item(name)?).filter(|part| !part.is_none()))
    }

    fn taken<T>(&self, name: &str) -> PyResult<T>
    where
        T: for<'a> FromPyObject<'a, 'py, Error: Into<PyErr>>,
    {
        self.item(name)?.extract().map_err(Into::into)
    }

    fn floats(&self, name: &str, shape: &[Extent]) -> PyResult<Option<Vec<f32>>> {
        let part = self.given(name)?;
        part.map(|part| arrays::of_type(&part, name, "float32", shape)).transpose()
    }

    fn colour(&self, shape: &[Extent]) -> PyResult<Option<Vec<[u8; 4]>>> {
        let part = self.given("colour")?;
        part.map(|part| four(&part, "colour", shape)).transpose()
    }

    fn crs(&self) -> PyResult<Option<Crs>> {
        let Some((text, degrees)) = self.taken::<Option<(String, bool)>>("crs")? else { return Ok(None) };
        let crs = Crs::new(&text).map_err(|error| to_python(&error))?;
        Ok(Some(crs.with_degrees(degrees)))
    }

    fn positions(&self) -> PyResult<Vec<DVec3>> {
        Ok(arrays::vectors(arrays::of_type(&self.item("positions")?, "positions", "float64", &[None, Some(3)])?))
    }

    fn mesh(&self) -> PyResult<TriMesh> {
        let triangles = arrays::of_type::<u32>(&self.item("triangles")?, "triangles", "uint32", &[None, Some(3)])?;
        let mesh = TriMesh {
            vertex_attributes: self.attributes("vertex_attributes")?,
            face_attributes: self.attributes("face_attributes")?,
            rounding_room: self.taken("rounding_room")?,
            crs: self.crs()?,
            ..TriMesh::new(self.positions()?, triangles.as_chunks().0.to_vec())
        };
        mesh.validate().map_err(|error| to_python(&error))?;
        Ok(mesh)
    }

    fn attributes(&self, name: &str) -> PyResult<Vec<Attribute>> {
        let all = self.item(name)?;
        let one = |(name, entries): (Bound<'py, PyAny>, Bound<'py, PyAny>)| {
            let name: String = name.extract()?;
            let kind: String = entries.getattr("dtype")?.getattr("name")?.extract()?;
            let data = match kind.as_str() {
                "float32" => AttributeData::F32(arrays::of_type(&entries, &name, &kind, &[None])?),
                "int32" => AttributeData::I32(arrays::of_type(&entries, &name, &kind, &[None])?),
                "bool" => AttributeData::Bool(arrays::of_type(&entries, &name, &kind, &[None])?),
                _ => AttributeData::Colour(four(&entries, &name, &[None])?),
            };
            Ok(Attribute { name, data })
        };
        all.cast::<PyDict>()?.iter().map(one).collect()
    }

    fn cloud(&self) -> PyResult<CoreCloud> {
        let positions = self.positions()?;
        let points = Some(positions.len());
        let sensor = self.given("sensor")?;
        Ok(CoreCloud {
            normals: self.floats("normals", &[points, Some(3)])?.map(|all| all.as_chunks().0.to_vec()),
            colour: self.colour(&[points])?,
            intensity: self.floats("intensity", &[points])?,
            sensor: sensor.map(|sensor| arrays::vector(&sensor, "sensor")).transpose()?,
            world_from_cloud: arrays::any_affine(&self.item("world_from_cloud")?, "world_from_cloud")?,
            crs: self.crs()?,
            positions,
        })
    }

    fn image(&self) -> PyResult<CoreImage> {
        let [rows, cols]: [usize; 2] = [self.taken("rows")?, self.taken("cols")?];
        let size = [Some(rows), Some(cols)];
        let image = match projection::parsed(self.item("projection")?.cast()?)? {
            Projection::PointGrid(viewing) => {
                let shape = [Some(rows), Some(cols), Some(3)];
                let points = arrays::of_type::<f32>(&self.item("points")?, "points", "float32", &shape)?;
                CoreImage::from_points(rows, cols, points.as_chunks().0.to_vec(), viewing)
            }
            seen => {
                let values = arrays::of_type(&self.item("values")?, "values", "float64", &size)?;
                CoreImage::from_values(rows, cols, values, seen)
            }
        };
        let mut image = image.map_err(|error| to_python(&error))?;
        image.name = self.taken("name")?;
        image.world_from_sensor = arrays::any_affine(&self.item("world_from_sensor")?, "world_from_sensor")?;
        image.colour = self.colour(&size)?;
        image.intensity = self.floats("intensity", &size)?;
        image.confidence = self.floats("confidence", &size)?;
        image.crs = self.crs()?;
        image.validate().map_err(|error| to_python(&error))?;
        Ok(image)
    }

    fn camera(&self) -> PyResult<Camera> {
        let camera = surfrecon::scan::VirtualCamera {
            rows: self.taken("rows")?,
            cols: self.taken("cols")?,
            projection: projection::parsed(self.item("projection")?.cast()?)?,
            world_from_sensor: arrays::any_affine(&self.item("world_from_sensor")?, "world_from_sensor")?,
        };
        camera.validate().map_err(|error| to_python(&error))?;
        Ok(Camera { camera })
    }

    fn scan(&self, py: Python<'py>) -> PyResult<Py<Scan>> {
        let recording: Option<PathBuf> = self.taken("recording")?;
        let kept = Kept { path: self.taken("path")?, recording, text: self.taken("text")? };
        let last = || LAST.lock().unwrap_or_else(PoisonError::into_inner);
        let known = last().clone();
        let scan = Watch::new(None).run(py, move |progress| CoreScan::of_kept(&kept, known.as_ref(), progress))?;
        if scan.is_frame() {
            let former = last().replace(scan.clone());
            drop(former);
        }
        frame::to_object(py, scan)
    }
}

/// Colours with alpha, as they are.
fn four(entries: &Bound<'_, PyAny>, name: &str, shape: &[Extent]) -> PyResult<Vec<[u8; 4]>> {
    let shape = [shape, &[Some(4)]].concat();
    let bytes = arrays::of_type::<u8>(entries, name, "uint8", &shape)?;
    Ok(bytes.as_chunks().0.to_vec())
}
