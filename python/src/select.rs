//! Keeps, removes and transforms scans of every kind. Finds the dominant plane.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use surfrecon::Progress;
use surfrecon::plane::{DominantPlane, PlaneParams, dominant};
use surfrecon::source::{PlacedCloud, PlacedMesh};

use crate::background::{Background, made_class};
use crate::edit::{Edit, edits};
use crate::job::Job;
use crate::params::{no_others, params};
use crate::progress::Watch;
use crate::regions::Plane;
use crate::scans::ScanSet;
use crate::similarity::Given;
use crate::sources::{self, Clouds, Source, as_dyn, sources};

/// A scan of any kind with an edit. Errors name it.
fn of_source(edit: &Edit, source: Source, progress: &Progress<'_>) -> surfrecon::Result<Source> {
    let named = |name: &str, error| match error {
        surfrecon::Error::Input(text) => surfrecon::Error::Input(format!("{name}: {text}")),
        other => other,
    };
    Ok(match source {
        Source::Read(mut scan) => {
            match edit {
                Edit::Select(selection) => scan.select(selection.clone()),
                Edit::Transform(similarity) => scan.transform(similarity)?,
                Edit::Nothing => {}
            }
            Source::Read(scan)
        }
        Source::Image(image) => {
            Source::Image(Arc::new(edit.of_image(&image, progress).map_err(|error| named(&image.name, error))?))
        }
        Source::Mesh(PlacedMesh { name, mesh, world_from_mesh }) => {
            let edited = edit.of_mesh(&mesh, world_from_mesh, progress);
            let (mesh, world_from_mesh) = edited.map_err(|error| named(&name, error))?;
            Source::Mesh(PlacedMesh { name, mesh: Arc::new(mesh), world_from_mesh })
        }
        Source::Cloud(PlacedCloud { name, cloud, .. }) => {
            let cloud = edit.of_cloud(&cloud, progress).map_err(|error| named(&name, error))?;
            let world_from_cloud = cloud.world_from_cloud;
            Source::Cloud(PlacedCloud { name, cloud: Arc::new(cloud), world_from_cloud })
        }
    })
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
                let edited = of_source(edit, source, progress)?;
                progress.advance(1).map(|()| edited)
            };
            sources.into_iter().zip(&edits).map(one).collect::<surfrecon::Result<Vec<_>>>()
        })
    })?;
    let placed = edited.iter().map(|source| sources::placed(py, source, source.world_from_scan()));
    Ok(PyList::new(py, placed.collect::<PyResult<Vec<_>>>()?)?.into_any())
}

/// Keeps what a region holds of each scan. All else goes. The place of samples in the world decides. Samples on the border are inside.
///
/// Range images keep grid, projection and pose: removed samples become missing pixels, through which a merge does not see. Meshes keep faces of
/// which all vertices stay. Scans in files are not read now: the kept part is read when they are read, merged or aligned.
///
/// >>> upper = surfrecon.keep(scans, surfrecon.Box.between((-100, -100, 0), (100, 100, 120)))
/// >>> len(upper)
/// 6
///
/// Args:
///     scans: a ``ScanSet`` or a list, as for ``align``.
///     region: a ``Box``, a ``Plane``, or a list of one mask a scan, ``None`` for those that stay whole: bool, (rows, cols) for a range
///         image, (n,) for a mesh's vertices or a cloud's points.
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///
/// Returns:
///     The scans in their order, as ``merge`` and ``align`` take them: a ``ScanSet`` for one, else a list. A mesh as (``Mesh``, matrix,
///     name). Some may have no samples left: ``merge`` passes over these.
///
/// Raises:
///     InputError: another number of masks than of scans, or one of another size than its scan.
///     TypeError: what is no scan, or no region.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
#[pyo3(signature = (scans, region, *, progress = None, **others), text_signature = "(scans, region, *, progress=None)")]
pub fn keep<'py>(
    scans: &Bound<'py, PyAny>,
    region: &Bound<'py, PyAny>,
    progress: Option<Py<PyAny>>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    no_others("keep", others)?;
    edited(scans, |count| edits(region, true, count), progress)
}

/// Removes what a region holds of each scan: the opposite of ``keep``, with the same arguments, result and errors.
///
/// >>> scans = surfrecon.remove(scans, surfrecon.dominant_plane(scans))  # the table and what is below
#[pyfunction]
#[pyo3(signature = (scans, region, *, progress = None, **others), text_signature = "(scans, region, *, progress=None)")]
pub fn remove<'py>(
    scans: &Bound<'py, PyAny>,
    region: &Bound<'py, PyAny>,
    progress: Option<Py<PyAny>>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    no_others("remove", others)?;
    edited(scans, |count| edits(region, false, count), progress)
}

/// Gives all scans another size and place. Poses stay rigid: samples are scaled. Scans in files are, whenever they are read.
///
/// >>> metres = surfrecon.transformed(scans, surfrecon.Similarity(np.diag([0.001, 0.001, 0.001, 1])))
/// >>> bool(surfrecon.merge(metres).mesh.bounds.max() < 1)
/// True
///
/// Args:
///     scans: a ``ScanSet`` or a list, as for ``align``.
///     similarity: of ``true_size``, of ``ground``, or both: ``size @ ground`` where the plane was found in the old size.
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
#[pyo3(signature = (scans, similarity, *, progress = None, **others),
    text_signature = "(scans, similarity, *, progress=None)")]
pub fn transformed<'py>(
    scans: &Bound<'py, PyAny>,
    similarity: Given,
    progress: Option<Py<PyAny>>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    no_others("transformed", others)?;
    edited(scans, |count| Ok(vec![Edit::transform(&similarity.0); count]), progress)
}

/// A plane to be found, free of Python.
pub struct PlaneCall {
    sources: Vec<Source>,
    params: PlaneParams,
}

impl PlaneCall {
    /// Checks and takes the arguments of Python's `dominant_plane`.
    ///
    /// # Errors
    /// `ParameterError`, `TypeError`.
    pub fn new(scans: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        Ok(PlaneCall { params: params("dominant_plane", options)?, sources: sources(scans, Clouds::Taken)? })
    }

    /// Finds the plane.
    ///
    /// # Errors
    /// See [`dominant`].
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<DominantPlane> {
        dominant(&as_dyn(&self.sources), &self.params, progress)
    }
}

/// Finds the plane that most samples lie on: a table, a turntable, the ground. The same for any order of the scans and any number of
/// threads.
///
/// >>> scans = surfrecon.remove(scans, surfrecon.dominant_plane(scans))
///
/// Args:
///     scans: a ``ScanSet`` or a list, as for ``align``. Clouds need no normals. Where they lie counts: align them first.
#[doc = include_str!("params/plane.txt")]
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///
/// Options that are ``None`` take their defaults.
///
/// Returns:
///     A ``Plane`` with ``share`` and ``spread``. Above is the side that its samples were seen from. If that is not known, it is the
///     side that most of the others lie on.
///
/// Raises:
///     ParameterError: an option out of its range.
///     InputError, FormatError, FileError: no plane that stands out, with the remedy, a scan that can't be used or read.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
// options: plane
#[pyo3(signature = (scans, *, progress = None, **options), text_signature = "(scans, *, tolerance=None, min_share=0.05, margin=None, threads=0, progress=None)")]
pub fn dominant_plane(
    py: Python<'_>,
    scans: &Bound<'_, PyAny>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Plane> {
    let call = PlaneCall::new(scans, options)?;
    Ok(Watch::new(progress).run(py, |progress| call.run(progress))?.into())
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.dominant_plane`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``dominant_plane``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: plane
    #[pyo3(signature = (scans, **options), text_signature = "(scans, *, tolerance=None, min_share=0.05, margin=None, threads=0)")]
    fn dominant_plane(scans: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = PlaneCall::new(scans, options)?;
        Job::of(Background::start(move |progress| made_class(Plane::from(call.run(progress)?))))
    }
}
