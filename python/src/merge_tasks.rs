//! A merge that several processes do: what `surfrecon.distributed` is made of.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::merge::MergeParams;
use surfrecon::merge::out_of_core::Stage;
use surfrecon::{Progress, TaskFolder, end_merge_tasks, merge_task, merge_tasks_to_file};

use crate::errors::input_error;
use crate::memory_folder::Place;
use crate::merge_to_file::written;
use crate::params::params;
use crate::progress::Watch;
use crate::report;
use crate::sources::{Clouds, Source, as_dyn, sources};

/// The stages of a merge whose stages have so many tasks: their names and how many tasks each has. The surface is written after them.
#[pyfunction]
pub fn _merge_stages(tasks: u32) -> Vec<(&'static str, u32)> {
    Stage::ALL.iter().map(|stage| (stage.name(), stage.tasks(tasks))).collect()
}

/// Does a task of a merge.
#[pyfunction]
#[pyo3(signature = (scans, folder, stage, number, *, tasks, keep = false, has_a_part = false, max_memory = None, progress = None, **options))]
#[expect(clippy::too_many_arguments, reason = "Python's keyword arguments")]
pub fn _merge_task(
    py: Python<'_>,
    scans: &Bound<'_, PyAny>,
    folder: PathBuf,
    stage: &str,
    number: u32,
    tasks: u32,
    keep: bool,
    has_a_part: bool,
    max_memory: Option<u64>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<()> {
    let stage = Stage::named(stage).ok_or_else(|| {
        input_error(format!(
            "there is no stage {stage:?} of a merge: take \
        one that the plan names"
        ))
    })?;
    let call = TaskCall::new(scans, folder, (tasks, keep, has_a_part), max_memory, options)?;
    Watch::new(progress).run(py, move |progress| call.run((stage, number), progress))
}

/// Writes the surface once all tasks are done. Gives the report.
#[pyfunction]
#[pyo3(signature = (scans, folder, path, *, tasks, keep = false, has_a_part = false, max_memory = None, encoding = None, part_triangles = None, provenance = None, progress = None, **options))]
#[expect(clippy::too_many_arguments, reason = "Python's keyword arguments")]
pub fn _merge_tasks_to_file<'py>(
    py: Python<'py>,
    scans: &Bound<'py, PyAny>,
    folder: PathBuf,
    path: Place,
    tasks: u32,
    keep: bool,
    has_a_part: bool,
    max_memory: Option<u64>,
    encoding: Option<&str>,
    part_triangles: Option<&Bound<'_, PyAny>>,
    provenance: Option<&Bound<'py, PyAny>>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let call = TaskCall::new(scans, folder, (tasks, keep, has_a_part), max_memory, options)?;
    let write = written(encoding, part_triangles, provenance)?;
    let merged = Watch::new(progress).run(py, move |progress| {
        let TaskCall { sources, params, .. } = &call;
        merge_tasks_to_file(&as_dyn(sources), &path, params, call.folder(), &write, progress)
    })?;
    report::of(py, &merged)
}

/// Once it is noted that the surface is written: what is kept loses what nobody needs any more.
#[pyfunction]
#[pyo3(signature = (scans, folder, *, tasks, keep = false, has_a_part = false, max_memory = None, **options))]
#[expect(clippy::too_many_arguments, reason = "Python's keyword arguments")]
pub fn _end_merge_tasks(
    py: Python<'_>,
    scans: &Bound<'_, PyAny>,
    folder: PathBuf,
    tasks: u32,
    keep: bool,
    has_a_part: bool,
    max_memory: Option<u64>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<()> {
    let call = TaskCall::new(scans, folder, (tasks, keep, has_a_part), max_memory, options)?;
    Watch::new(None).run(py, move |progress| {
        let TaskCall { sources, params, .. } = &call;
        end_merge_tasks(&as_dyn(sources), params, call.folder(), progress)
    })
}

/// The arguments that all tasks of a merge take, free of Python.
struct TaskCall {
    sources: Vec<Arc<Source>>,
    params: MergeParams,
    folder: PathBuf,
    max_memory: Option<u64>,
    tasks: u32,
    keep: bool,
    has_a_part: bool,
}

impl TaskCall {
    fn new(
        scans: &Bound<'_, PyAny>,
        folder: PathBuf,
        (tasks, keep, has_a_part): (u32, bool, bool),
        max_memory: Option<u64>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let params = params("merge", options)?;
        let sources = sources(scans, Clouds::Refused)?.into_iter().map(Arc::new).collect();
        Ok(TaskCall { sources, params, folder, max_memory, tasks, keep, has_a_part })
    }

    fn folder(&self) -> TaskFolder<'_> {
        let &TaskCall { ref folder, max_memory, tasks, keep, has_a_part, .. } = self;
        TaskFolder { folder, max_memory, tasks, keep, has_a_part }
    }

    fn run(&self, task: (Stage, u32), progress: &Progress<'_>) -> surfrecon::Result<()> {
        merge_task(&as_dyn(&self.sources), &self.params, self.folder(), task, progress)
    }
}
