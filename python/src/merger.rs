//! Scans that are merged again as they change.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyIterator, PyList};
use surfrecon::error::counted;
use surfrecon::merge::incremental::{self, Renewed};
use surfrecon::threads::Exclusive;

use crate::background::{Background, made};
use crate::incremental::Incremental;
use crate::job::Job;
use crate::merge::{MergeCall, MergeResult, store};
use crate::paths::FsPath;
use crate::sources::{Clouds, Source, object, source, sources};

/// Scans that are merged again and again while they are added, replaced and removed: each merge keeps what it found out for the
/// next, which then reads and counts only those scans that are new to it, and renews what these have a part in. The result
/// is that of ``surfrecon.merge``, to the bit.
///
/// Of files that change on the disk nothing is noticed: put the scan in its place again. If the measured voxel or merge distance
/// differs, since a scan has changed, all follows from it anew. Giving both as options makes that rarer. The kept state takes about 125 bytes
/// for each intersection of a scan with the grid.
///
/// ``len(merger)`` is the number of scans, ``merger[i]`` is one of them, ``merger[i] = scan`` replaces one, ``del merger[i]`` removes one,
/// ``insert`` and ``add`` put one between them or at the end.
/// ``merger[i]`` and iterating give objects of their own, of a mesh ``(Mesh, world_from_mesh, name)``: changing them changes
/// nothing here until they are put back. ``Job.merge`` takes a merger in the place of scans.
///
/// >>> merger = surfrecon.Merger(scans)
/// >>> preview = merger.merge().mesh
/// >>> merger[3] = scans[2]  # another, in its place
/// >>> mesh = merger.merge().mesh
///
/// Args:
///     scans: as for ``surfrecon.merge``. Changing the objects later changes nothing here.
#[pyclass(frozen, module = "surfrecon")]
pub struct Merger {
    scans: Mutex<Scans>,
    kept: Arc<Exclusive<incremental::Merger>>,
}

/// The scans, each with its number among all there ever were.
#[derive(Default)]
struct Scans {
    list: Vec<(u64, Arc<Source>)>,
    ever: u64,
}

impl Scans {
    fn numbered(&mut self, source: Source) -> (u64, Arc<Source>) {
        self.ever += 1;
        (self.ever, source.into())
    }

    fn place(&self, index: isize) -> PyResult<usize> {
        let count = self.list.len();
        let place = if index < 0 { index.checked_add_unsigned(count) } else { Some(index) };
        let place = place.and_then(|place| usize::try_from(place).ok()).filter(|&place| place < count);
        place.ok_or_else(|| PyIndexError::new_err(format!("there are {count} scans and none at {index}")))
    }
}

impl Merger {
    fn scans(&self) -> MutexGuard<'_, Scans> {
        self.scans.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The state that a merge needs of its scans as they are now.
    pub fn call(&self) -> Incremental {
        Incremental { scans: self.scans().list.clone(), kept: self.kept.clone() }
    }
}

#[pymethods]
impl Merger {
    #[new]
    #[pyo3(signature = (scans = None))]
    fn new(scans: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let mut all = Scans::default();
        for source in scans.map_or_else(|| Ok(Vec::new()), |scans| sources(scans, Clouds::Refused))? {
            let numbered = all.numbered(source);
            all.list.push(numbered);
        }
        Ok(Merger { scans: Mutex::new(all), kept: Arc::default() })
    }

    /// Adds a scan after the others.
    ///
    /// >>> merger = surfrecon.Merger(scans[:5])
    /// >>> merger.add(scans[5])
    /// 5
    ///
    /// Args:
    ///     scan: a ``Scan``, ``RangeImage``, ``Mesh``, ``(Mesh, world_from_mesh)`` or ``(Mesh, world_from_mesh, name)``.
    ///
    /// Returns:
    ///     Its index.
    fn add(&self, scan: &Bound<'_, PyAny>) -> PyResult<usize> {
        let index = self.scans().list.len();
        let source = source(index, scan, Clouds::Refused)?;
        let mut scans = self.scans();
        let numbered = scans.numbered(source);
        scans.list.push(numbered);
        Ok(scans.list.len() - 1)
    }

    /// Puts a scan before another, as ``list.insert`` does: before the first where ``index`` is too small, after the last where it is too
    /// large. Those after it move up.
    ///
    /// >>> merger = surfrecon.Merger(scans[1:])
    /// >>> merger.insert(0, scans[0])
    /// >>> len(merger), merger[0].name
    /// (6, 'view0')
    ///
    /// Args:
    ///     index: where it is afterwards. A negative one counts from the end.
    ///     scan: as for ``add``.
    fn insert(&self, index: isize, scan: &Bound<'_, PyAny>) -> PyResult<()> {
        let place = |count: usize| match usize::try_from(index) {
            Ok(index) => index.min(count),
            Err(_) => count.saturating_sub(index.unsigned_abs()),
        };
        let source = source(place(self.scans().list.len()), scan, Clouds::Refused)?;
        let mut scans = self.scans();
        let numbered = scans.numbered(source);
        let place = place(scans.list.len());
        scans.list.insert(place, numbered);
        Ok(())
    }

    fn __len__(&self) -> usize {
        self.scans().list.len()
    }

    fn __getitem__<'py>(&self, py: Python<'py>, index: isize) -> PyResult<Bound<'py, PyAny>> {
        let scan = {
            let scans = self.scans();
            scans.list[scans.place(index)?].1.clone()
        };
        object(py, &scan)
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyIterator>> {
        // As they are now: others may be added and removed meanwhile.
        let list = self.scans().list.clone();
        PyList::new(py, list.iter().map(|scan| object(py, &scan.1)).collect::<PyResult<Vec<_>>>()?)?.try_iter()
    }

    fn __setitem__(&self, index: isize, scan: &Bound<'_, PyAny>) -> PyResult<()> {
        let place = self.scans().place(index)?;
        let source = source(place, scan, Clouds::Refused)?;
        let replaced = {
            let mut scans = self.scans();
            // Another thread may have removed some meanwhile.
            let place = scans.place(index)?;
            let numbered = scans.numbered(source);
            std::mem::replace(&mut scans.list[place], numbered)
        };
        // Only now: a scan may be behind functions of Python's, and what deletes these may ask for the scans.
        drop(replaced);
        Ok(())
    }

    fn __delitem__(&self, index: isize) -> PyResult<()> {
        let removed = {
            let mut scans = self.scans();
            let place = scans.place(index)?;
            scans.list.remove(place)
        };
        drop(removed);
        Ok(())
    }

    /// Merges the scans. Options, result and errors as of ``surfrecon.merge``. A merge in files keeps nothing. With ``files="if_needed"``
    /// the kept state is given back where it does not fit into memory.
    ///
    /// >>> merger = surfrecon.Merger(scans)
    /// >>> mesh = merger.merge(voxel=4.0, merge_distance=6.0).mesh
    /// >>> merger[3] = scans[2]
    /// >>> mesh = merger.merge(voxel=4.0, merge_distance=6.0).mesh  # with the same options less is to be done
    // options: $self merge
    #[pyo3(signature = (*, measure = false, files = None, max_memory = None, workspace = None, progress = None, **options), text_signature = "($self, *, voxel=None, merge_distance=None, max_hole_length=None, min_component_share=0.0, match_exposure=True, close='holes', flat_base=False, base_up='z', edge_limit=None, grazing_limit=1.5707963267948966, threads=0, measure=False, files=None, max_memory=None, workspace=None, progress=None)")]
    #[expect(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn merge(
        &self,
        py: Python<'_>,
        measure: bool,
        files: Option<&str>,
        max_memory: Option<&Bound<'_, PyAny>>,
        workspace: Option<FsPath>,
        progress: Option<Py<PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<MergeResult> {
        MergeCall::incremental(self.call(), measure, store(files, max_memory, workspace)?, options)?
            .result(py, progress)
    }

    /// How many bricks of space, of 32 cells a side, the last merge had to do anew, and how many there are: ``(0, 0)`` before
    /// the first, or while one is running on another thread.
    #[getter]
    fn renewed(&self) -> (usize, usize) {
        let renewed = self.kept.take().map_or_else(|_| Renewed::default(), |kept| kept.renewed());
        (renewed.bricks, renewed.of)
    }

    /// Gives back the memory of what is kept: the next merge finds out everything.
    ///
    /// >>> merger = surfrecon.Merger(scans)
    /// >>> mesh = merger.merge().mesh
    /// >>> merger.forget()
    fn forget(&self) {
        if let Ok(mut kept) = self.kept.take() {
            kept.forget();
        }
    }

    fn __repr__(&self) -> String {
        format!("<Merger of {}>", counted(self.__len__() as u64, "scan", "scans"))
    }
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.merge`` with the same arguments but ``progress``, or ``Merger.merge``, of a ``Merger`` in the place of scans.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``merge``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: merge
    #[pyo3(signature = (scans, *, measure = false, files = None, max_memory = None, workspace = None, **options), text_signature = "(scans, *, voxel=None, merge_distance=None, max_hole_length=None, min_component_share=0.0, match_exposure=True, close='holes', flat_base=False, base_up='z', edge_limit=None, grazing_limit=1.5707963267948966, threads=0, measure=False, files=None, max_memory=None, workspace=None)")]
    fn merge(
        scans: &Bound<'_, PyAny>,
        measure: bool,
        files: Option<&str>,
        max_memory: Option<&Bound<'_, PyAny>>,
        workspace: Option<FsPath>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let store = store(files, max_memory, workspace)?;
        let call = match scans.cast::<Merger>() {
            Ok(merger) => MergeCall::incremental(merger.get().call(), measure, store, options),
            Err(_) => MergeCall::new(scans, measure, store, options),
        }?;
        Job::of(Background::start_calls(&[call.merging(), 1.0 - call.merging()], move |calls| {
            let merged = call.run(calls.begin(0))?;
            made(call.measured(merged, calls.begin(1))?, |py, merged| {
                Ok(Bound::new(py, MergeResult::new(py, merged)?)?.into_any())
            })
        }))
    }
}
