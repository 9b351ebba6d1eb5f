//! Edits of a scan: samples kept or removed, another size and place.

use std::sync::Arc;

use glam::DAffine3;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use surfrecon::import::FileScan as CoreScan;
use surfrecon::select::{self, Mask, Region, Selection};
use surfrecon::{PointCloud, Progress, RangeImage, TriMesh};

use crate::arrays;
use crate::errors::{guarded, input_error, reworded, to_python};
use crate::regions::{OrientedBox, Plane};
use crate::similarity::Similarity;

/// An edit of a scan.
#[derive(Clone)]
pub enum Edit {
    Select(Selection),
    Transform(select::Similarity),
    Nothing,
}

impl Edit {
    /// Keeping or removing what a Python object says: a `Box`, a `Plane` or a mask.
    ///
    /// # Errors
    /// `TypeError` for another object, `InputError` for a mask that is neither a list nor a grid.
    pub fn select(region: &Bound<'_, PyAny>, keep: bool) -> PyResult<Self> {
        let region = if let Ok(known) = region.cast::<OrientedBox>() {
            Region::Box(known.get().region.clone())
        } else if let Ok(plane) = region.cast::<Plane>() {
            Region::Below(plane.get().plane)
        } else {
            Region::Mask(Arc::new(guarded(|| mask(region))?))
        };
        Ok(Edit::Select(Selection { region, keep }))
    }

    /// True size and ground.
    pub fn transform(similarity: &Similarity) -> Self {
        Edit::Transform(similarity.similarity)
    }

    /// The scan of a file with the edit, which is made whenever it is read.
    ///
    /// # Errors
    /// See [`CoreScan::transform`].
    pub fn of_scan(&self, scan: &CoreScan) -> PyResult<CoreScan> {
        let mut scan = scan.clone();
        match self {
            Edit::Select(selection) => scan.select(selection.clone()),
            Edit::Transform(similarity) => scan.transform(similarity).map_err(|e| to_python(&e))?,
            Edit::Nothing => {}
        }
        Ok(scan)
    }

    /// Of an image.
    ///
    /// # Errors
    /// A mask that does not fit. Samples that become too large or too small. Cancelled.
    pub fn of_image(&self, image: &RangeImage, progress: &Progress<'_>) -> surfrecon::Result<RangeImage> {
        let mut image = image.clone();
        match self {
            Edit::Select(selection) => drop(selection.of_image(&mut image, progress)?),
            Edit::Transform(similarity) => similarity.of_image(&mut image)?,
            Edit::Nothing => {}
        }
        Ok(image)
    }

    /// Of a cloud.
    ///
    /// # Errors
    /// As [`Edit::of_image`].
    pub fn of_cloud(&self, cloud: &PointCloud, progress: &Progress<'_>) -> surfrecon::Result<PointCloud> {
        let mut cloud = cloud.clone();
        match self {
            Edit::Select(selection) => drop(selection.of_cloud(&mut cloud, progress)?),
            Edit::Transform(similarity) => similarity.of_cloud(&mut cloud)?,
            Edit::Nothing => {}
        }
        Ok(cloud)
    }

    /// Of a mesh that is placed, with its new place: only the scale goes into the vertices.
    ///
    /// # Errors
    /// As [`Edit::of_image`].
    pub fn of_mesh(
        &self,
        mesh: &TriMesh,
        world_from_mesh: DAffine3,
        progress: &Progress<'_>,
    ) -> surfrecon::Result<(TriMesh, DAffine3)> {
        let mut mesh = mesh.clone();
        let mut place = world_from_mesh;
        match self {
            Edit::Select(selection) => drop(selection.of_mesh(&mut mesh, world_from_mesh, progress)?),
            Edit::Transform(similarity) => {
                place = similarity.of_pose(world_from_mesh)?;
                select::scale_mesh(&mut mesh, similarity.scale())?;
            }
            Edit::Nothing => {}
        }
        Ok((mesh, place))
    }
}

/// A mask: (rows, cols) of an image, (n,) of a mesh or a cloud.
fn mask(given: &Bound<'_, PyAny>) -> PyResult<Mask> {
    let (marks, shape) = arrays::marks(given, "region").map_err(|error| {
        reworded(error, || {
            PyTypeError::new_err(format!(
                "region must be a Box, a Plane or a mask (an array of bool), got {}",
                given.get_type()
            ))
        })
    })?;
    match *shape.as_slice() {
        [_] => Ok(Mask::of_list(&marks)),
        [rows, cols] => Mask::of_image(rows, cols, &marks).map_err(|e| to_python(&e)),
        _ => Err(input_error(format!("a mask must have shape (rows, cols) or (n,), got {} dimensions", shape.len()))),
    }
}

/// One edit a scan: the same region for all, or a mask or `None` for each.
///
/// # Errors
/// Another number of masks than of scans, and what [`Edit::select`] refuses.
pub fn edits(region: &Bound<'_, PyAny>, keep: bool, count: usize) -> PyResult<Vec<Edit>> {
    if region.cast::<OrientedBox>().is_ok() || region.cast::<Plane>().is_ok() {
        return Ok(vec![Edit::select(region, keep)?; count]);
    }
    let masks = region.try_iter().map_err(|error| {
        reworded(error, || {
            let given = region.get_type();
            PyTypeError::new_err(format!("region must be a Box, a Plane or a list of one mask a scan, got {given}"))
        })
    })?;
    let one = |mask: PyResult<Bound<'_, PyAny>>| {
        let mask = mask?;
        if mask.is_none() { Ok(Edit::Nothing) } else { Edit::select(&mask, keep) }
    };
    let edits = masks.map(one).collect::<PyResult<Vec<_>>>()?;
    if edits.len() != count {
        return Err(input_error(format!("{} masks for {count} scans: give one a scan, None for none", edits.len())));
    }
    Ok(edits)
}
