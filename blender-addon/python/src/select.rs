//! What of scans is kept or removed, and what size and place they are given.

use std::sync::Arc;

use glam::DAffine3;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyList;
use surfrecon::import::Scan as CoreScan;
use surfrecon::select::{self, Mask, Region, Selection};
use surfrecon::{PointCloud, Progress, RangeImage, TriMesh};

use crate::arrays;
use crate::errors::{guarded, input_error, reworded, to_python};
use crate::progress::Watch;
use crate::regions::{OrientedBox, Plane};
use crate::scans::ScanSet;
use crate::similarity::Similarity;
use crate::sources::{Clouds, Source, sources};

/// What becomes of a scan.
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
    /// A mask that does not fit; samples that become too large or too small; cancelled.
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

    fn of_source(&self, source: Source, progress: &Progress<'_>) -> surfrecon::Result<Source> {
        let named = |name: &str, error| match error {
            surfrecon::Error::Input(text) => surfrecon::Error::Input(format!("{name}: {text}")),
            other => other,
        };
        Ok(match source {
            Source::File(mut scan) => {
                match self {
                    Edit::Select(selection) => scan.select(selection.clone()),
                    Edit::Transform(similarity) => scan.transform(similarity)?,
                    Edit::Nothing => {}
                }
                Source::File(scan)
            }
            Source::Image(image) => {
                Source::Image(Arc::new(self.of_image(&image, progress).map_err(|error| named(&image.name, error))?))
            }
            Source::Mesh { name, mesh, world_from_mesh } => {
                let edited = self.of_mesh(&mesh, world_from_mesh, progress);
                let (mesh, world_from_mesh) = edited.map_err(|error| named(&name, error))?;
                Source::Mesh { name, mesh: Arc::new(mesh), world_from_mesh }
            }
            Source::Cloud { name, cloud } => {
                let cloud = self.of_cloud(&cloud, progress).map_err(|error| named(&name, error))?;
                Source::Cloud { name, cloud: Arc::new(cloud) }
            }
        })
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

fn edited<'py>(
    scans: &Bound<'py, PyAny>,
    edits: impl FnOnce(usize) -> PyResult<Vec<Edit>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = scans.py();
    if let Ok(set) = scans.cast::<ScanSet>() {
        let edits = edits(set.get().count())?;
        return Ok(Bound::new(py, set.get().edited(py, &edits)?)?.into_any());
    }
    let sources = sources(scans, Clouds::Taken)?;
    let edits = edits(sources.len())?;
    let edited = Watch::new(progress).run(py, move |progress| {
        progress.plan(&[("selecting", 1.0)]);
        progress.watch(|| {
            progress.stage(0, sources.len() as u64);
            let one = |(source, edit): (Source, &Edit)| {
                let edited = edit.of_source(source, progress)?;
                progress.advance(1).map(|()| edited)
            };
            sources.into_iter().zip(&edits).map(one).collect::<surfrecon::Result<Vec<_>>>()
        })
    })?;
    let placed = edited.iter().map(|source| source.placed(py, source.world_from_scan()));
    Ok(PyList::new(py, placed.collect::<PyResult<Vec<_>>>()?)?.into_any())
}

/// Keeps what a region holds of each scan; all else goes. Where samples lie decides, in the world; what lies on the border is inside.
///
/// Range images keep grid, projection and pose: what goes are missing pixels, through which a merge does not see. Meshes keep faces of
/// which all vertices stay. Scans in files are not read: what is kept of them is, whenever they are read, merged or aligned.
///
/// Args:
///     scans: a ``ScanSet`` or a list, as for ``align``.
///     region: a ``Box``, a ``Plane``, or a list of one mask a scan, ``None`` for those that stay whole: bool, (rows, cols) for a range
///         image, (n,) for a mesh's vertices or a cloud's points.
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread; ``False`` cancels.
///
/// Returns:
///     The scans in their order, as ``merge`` and ``align`` take them: a ``ScanSet`` for one, else a list; a mesh as (``Mesh``, matrix,
///     name). Some may have no samples left: ``merge`` passes over these.
///
/// Raises:
///     InputError: another number of masks than of scans, or one of another size than its scan.
///     TypeError: what is no scan, or no region.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
#[pyo3(signature = (scans, region, *, progress = None))]
pub fn keep<'py>(
    scans: &Bound<'py, PyAny>,
    region: &Bound<'py, PyAny>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    edited(scans, |count| edits(region, true, count), progress)
}

/// Removes what a region holds of each scan: the opposite of ``keep``, with the same arguments, result and errors.
///
/// >>> scans = surfrecon.remove(scans, surfrecon.dominant_plane(scans))  # the table and what is below
#[pyfunction]
#[pyo3(signature = (scans, region, *, progress = None))]
pub fn remove<'py>(
    scans: &Bound<'py, PyAny>,
    region: &Bound<'py, PyAny>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    edited(scans, |count| edits(region, false, count), progress)
}

/// Gives all scans another size and place. Poses stay rigid: samples are scaled. Scans in files are, whenever they are read.
///
/// Args:
///     scans: a ``ScanSet`` or a list, as for ``align``.
///     similarity: of ``true_size``, of ``ground``, or both: ``ground @ size``.
///     progress: as for ``keep``.
///
/// Returns:
///     The scans in their order, as ``keep`` gives them.
///
/// Raises:
///     InputError: samples that become too large or too small.
///     TypeError: what is no scan.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
#[pyo3(signature = (scans, similarity, *, progress = None))]
pub fn transformed<'py>(
    scans: &Bound<'py, PyAny>,
    similarity: &Similarity,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    edited(scans, |count| Ok(vec![Edit::transform(similarity); count]), progress)
}
