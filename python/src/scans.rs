//! Opening and reading files.

use std::path::PathBuf;

use pyo3::exceptions::{PyIndexError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyIterator, PyList, PySlice, PyTuple};
use surfrecon::Progress;
use surfrecon::error::{counted, meant};
use surfrecon::export::{self, Holding, PlyOptions, write_points_ply};
use surfrecon::import::{self, Camera, ReadOptions, Taking};
use surfrecon::merge::{ScanSource, common_crs};

use crate::background::{Background, made};
use crate::crs::{self, CrsText};
use crate::edit::{Edit, edits};
use crate::errors::{input_error, reworded, to_python};
use crate::frame::{self, Scan};
use crate::job::Job;
use crate::memory_folder::Place;
use crate::mesh::{Mesh, ending_of, provenance_of};
use crate::params::{no_others, params};
use crate::paths::{self, FsPath};
use crate::pickling::{self, Reduced};
use crate::point_cloud::PointCloud;
use crate::progress::Watch;
use crate::range_image::{RangeImage, write_together};
use crate::similarity::Given;

/// Opens scans without reading their samples.
///
/// Scans are PLY, height maps and depth images (PNG, PGM, PFM, TIFF, NPY, ESRI grids, SRTM tiles), points in text and
/// more: ``formats`` lists all. A camera's file among the paths makes the images depth images. A trajectory among them,
/// or a file ``NAME.xf``, ``NAME.tf`` or ``NAME.pose.txt`` beside a scan, places them. Scans that a trajectory has no pose of are passed
/// over, if it names them or their names have numbers that are its times. A folder that has one list opens as the scans of that, and
/// ``notes`` name the others in it.
///
/// Recordings of depth cameras and phones open as ``Frame`` objects, which merge and align as other scans do: folders or zip
/// archives of 7-Scenes, TUM RGB-D, ICL-NUIM, Open3D, Redwood, nerfstudio, Polycam (raw data), Record3D (also ``.r3d``), 3D
/// Scanner App, Stray Scanner and COLMAP (dense workspaces), and ``.sens`` files of ScanNet. No frame is decoded but a few, to see
/// how they overlap.
///
/// >>> scans = surfrecon.open("folder of scans")
/// >>> [scan.name for scan in scans[:2]]
/// ['view0', 'view1']
/// >>> both = surfrecon.open(["view0.ply", "view1.ply"])  # files, in this order
///
/// Args:
///     paths: a file - a scan, or a side file that places several (``.conf``) -, a folder, or any iterable of them, in its order.
///     camera: fx, fy, cx, cy in pixels: makes images depth images.
///     crs: the coordinate reference system that all lie in, whatever the files name: well-known text, or a code as ``EPSG:25832``.
#[doc = include_str!("params/open.txt")]
///
/// Returns:
///     A ``ScanSet``. Its ``notes`` say how the files were understood.
///
/// Raises:
///     FileError: a file can't be read.
///     FormatError: a file does not hold what its format promises. The text names file, place and remedy.
///     ParameterError: an option out of its range.
///     InputError: a ``crs`` that is neither well-known text nor a code, nor what PROJ calls one.
#[pyfunction]
// options: open
#[pyo3(signature = (paths, *, camera = None, crs = None, **options), text_signature = "(paths, *, scale=None, offset=0.0, step=None, invalid=None, depth='planar', pixels='auto', max_decoded_gib=4.0, allow_outside=False, poses='auto', axes='auto', camera=None, crs=None)")]
pub fn open(
    py: Python<'_>,
    paths: &Bound<'_, PyAny>,
    camera: Option<&Bound<'_, PyAny>>,
    crs: Option<CrsText>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<ScanSet> {
    let call = OpenCall::new(paths, camera, crs, options)?;
    let set = Watch::new(None).run(py, |progress| call.run(progress))?;
    ScanSet::new(py, set)
}

/// Opens scans as ``open`` does, for a command: one of several that is damaged is left out where all are read. ``unplaced`` are to be
/// aligned: of a folder all scans, whatever list of poses lies in it.
#[pyfunction]
#[pyo3(signature = (paths, *, unplaced = false, camera = None, crs = None, **options))]
pub fn _open_many(
    py: Python<'_>,
    paths: &Bound<'_, PyAny>,
    unplaced: bool,
    camera: Option<&Bound<'_, PyAny>>,
    crs: Option<CrsText>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<ScanSet> {
    let taking = Taking { unplaced, many: true };
    let call = OpenCall { taking, ..OpenCall::new(paths, camera, crs, options)? };
    let set = Watch::new(None).run(py, |progress| call.run(progress))?;
    ScanSet::new(py, set)
}

/// The scans to be opened, free of Python.
pub struct OpenCall {
    paths: Vec<Place>,
    options: ReadOptions,
    taking: Taking,
}

impl OpenCall {
    /// Checks and takes the arguments of Python's `open`.
    ///
    /// # Errors
    /// `ParameterError`, `InputError`, `TypeError`.
    pub fn new(
        paths: &Bound<'_, PyAny>,
        camera: Option<&Bound<'_, PyAny>>,
        crs: Option<CrsText>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        // A file object is iterable, too: its lines are no paths.
        let is_one = paths::of(paths).is_ok() || paths.hasattr("read")?;
        let paths = match paths.try_iter() {
            Ok(all) if !is_one => all.map(|one| Place::to_read(&one?)).collect::<PyResult<_>>()?,
            _ => vec![Place::to_read(paths)?],
        };
        let camera = camera.map(of_four).transpose()?;
        let crs = crs::told(crs)?;
        Ok(OpenCall {
            paths,
            options: ReadOptions { camera, crs, ..params("open", options)? },
            taking: Taking::default(),
        })
    }

    /// Opens them.
    ///
    /// # Errors
    /// See [`import::open_as`].
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<import::ScanSet> {
        let set = import::open_as(&self.paths, &self.options, self.taking, progress)?;
        set.tell();
        Ok(set)
    }
}

/// The camera of four numbers.
fn of_four(camera: &Bound<'_, PyAny>) -> PyResult<Camera> {
    let [fx, fy, cx, cy]: [f64; 4] = camera.extract().map_err(|error| {
        reworded(error, || PyTypeError::new_err(format!("camera must be fx, fy, cx, cy in pixels, got {camera}")))
    })?;
    Ok(Camera::new([fx, fy], [cx, cy]))
}

/// The folder of the recording that a file is of, or ``None``: what to open when one image or list of a recording
/// is at hand. Looks at names of files alone.
///
/// >>> folder = surfrecon.recording_of("export of a phone/depths/00000.png")
/// >>> len(surfrecon.open(folder))
/// 6
///
/// Args:
///     path: a file in the folder of a recording, or in a folder of it.
///
/// Raises:
///     FileError: a folder above it can't be listed.
#[pyfunction]
pub fn recording_of(py: Python<'_>, path: FsPath) -> PyResult<Option<PathBuf>> {
    Watch::new(None).run(py, |progress| import::recording_of(&path.0, progress))
}

/// Reads a file that holds one scan: a ``RangeImage``, a ``Mesh`` or a ``PointCloud``.
///
/// >>> image = surfrecon.read("view0.ply")
/// >>> type(image).__name__
/// 'RangeImage'
///
/// Args:
///     path: the file.
///     options: the keyword arguments of ``open``.
///
/// Raises:
///     FileError: the file can't be read.
///     FormatError: it does not hold what its format promises.
///     InputError: it holds several scans: use ``open``.
#[pyfunction]
#[pyo3(signature = (path, **options))]
pub fn read<'py>(
    py: Python<'py>,
    path: &Bound<'py, PyAny>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let open = wrap_pyfunction!(open, py)?.call((PyTuple::new(py, [path])?,), options)?;
    let set = open.cast::<ScanSet>()?.get();
    match set.scans.as_slice() {
        [scan] => scan.get().read(py, None, None),
        scans => Err(input_error(format!("{} holds {} scans: open it with surfrecon.open", path.str()?, scans.len()))),
    }
}

/// Writes range images with their poses: as ``.ptx`` or ``.e57`` into one file, or as Stanford range grids, a file each
/// named like the image, and the ``.conf`` that places them.
///
/// >>> images = [scan.read() for scan in scans]
/// >>> surfrecon.write_scans("placed.conf", images)
/// >>> len(surfrecon.open("placed.conf"))
/// 6
///
/// Args:
///     path: ends in ``.conf`` (the grids go into its folder), ``.ptx`` or ``.e57``.
///     images: range images, for ``.conf`` with different names.
///     provenance: what an ``.e57`` says of where it is from, as for ``Mesh.write``. The others have no place for it. An ``.e57`` also
///         says the images' ``crs``.
///     progress: called with the stage's name and the share of the call that is done. ``False`` cancels.
///
/// Raises:
///     InputError: a name that can't be a file's, or is there twice, rays that go round more than half a sphere, an ``.e57`` of images
///         in different coordinate reference systems.
///     FileError: writing failed. No file is left, and those that were there are untouched.
///     Cancelled: the callback said so. Files are as after a failure.
#[pyfunction]
#[pyo3(signature = (path, images, *, provenance = None, progress = None, **others),
    text_signature = "(path, images, *, provenance=None, progress=None)")]
pub fn write_scans(
    py: Python<'_>,
    path: Place,
    images: Vec<Bound<'_, RangeImage>>,
    provenance: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<()> {
    no_others("write_scans", others)?;
    let images: Vec<_> = images.iter().map(|image| image.get().image()).collect();
    let ending = ending_of(&path, Holding::Images)?;
    write_together(py, path, ending, &images, provenance_of(provenance)?, progress)
}

/// Writes what ``read`` gives, by the ending of the name: a ``Mesh`` (``.ply``, ``.glb``, ``.obj``, ``.stl``, ``.3mf``), a
/// ``RangeImage`` (``.ply``, ``.conf``, ``.ptx``, ``.e57``) or a list of them (the last three), a ``PointCloud`` (``.ply``, with
/// normals, colours and intensities).
///
/// >>> surfrecon.write("points.ply", image.to_cloud())
/// >>> surfrecon.write("surface.glb", image.triangulate(), metres_per_unit=0.001)  # of millimetres
///
/// Args:
///     path: the file.
///     content: what is written.
///     provenance: what the file says of where it is from, as for ``Mesh.write``. Of range images ``.e57`` has a place for it.
///     progress: called with the stage's name and the share of the call that is done. ``False`` cancels.
///     options: for a mesh the keyword arguments of ``Mesh.write``.
///
/// Raises:
///     InputError: an ending that doesn't fit the content, or what the format can't hold.
///     FileError: writing failed. No file is left, and one that was there is untouched.
///     Cancelled: the callback said so. Files are as after a failure.
///     TypeError: content of another type.
#[pyfunction]
#[pyo3(signature = (path, content, *, provenance = None, progress = None, **options))]
pub fn write(
    py: Python<'_>,
    path: &Bound<'_, PyAny>,
    content: &Bound<'_, PyAny>,
    provenance: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<()> {
    if content.cast::<Mesh>().is_ok() {
        let options = options.map_or_else(|| Ok(PyDict::new(py)), |options| options.copy())?;
        options.set_item("provenance", provenance)?;
        options.set_item("progress", progress)?;
        return content.call_method("write", (path,), Some(&options)).map(|_| ());
    }
    if options.is_some_and(|options| !options.is_empty()) {
        return Err(PyTypeError::new_err("options must be left out: only meshes are written with them"));
    }
    if let Ok(cloud) = content.cast::<PointCloud>() {
        let path: Place = path.extract()?;
        ending_of(&path, Holding::Points)?;
        let cloud = cloud.get().cloud.clone();
        let options = PlyOptions { provenance: provenance_of(provenance)?, ..PlyOptions::default() };
        return Watch::new(progress).run(py, move |progress| write_points_ply(&path, &cloud, options, progress));
    }
    if content.cast::<RangeImage>().is_ok() {
        let options = PyDict::new(py);
        options.set_item("provenance", provenance)?;
        options.set_item("progress", progress)?;
        return content.call_method("write", (path,), Some(&options)).map(|_| ());
    }
    let images = content.extract::<Vec<Bound<'_, RangeImage>>>().map_err(|error| {
        let given = content.get_type();
        reworded(error, || {
            PyTypeError::new_err(format!("content must be a Mesh, RangeImage(s) or PointCloud, got {given}"))
        })
    })?;
    write_scans(py, path.extract()?, images, provenance, progress, None)
}

/// The provenance in a file that this library wrote: ``.ply``, ``.obj``, ``.glb``, ``.e57``. ``None`` where it says nothing.
///
/// >>> mesh.write("vase.ply", provenance={"found in": "trench 4"})
/// >>> surfrecon.provenance("vase.ply")["found in"]
/// 'trench 4'
///
/// Args:
///     path: the file.
///
/// Raises:
///     FileError: it can't be read.
#[pyfunction]
pub fn provenance<'py>(py: Python<'py>, path: &Bound<'py, PyAny>) -> PyResult<Option<Bound<'py, PyAny>>> {
    let path = Place::to_read(path)?;
    let said = Watch::new(None).run(py, move |_| import::provenance(&path))?;
    said.map(|said| py.import("json")?.call_method1("loads", (said.to_json(),))).transpose()
}

/// A note, in words, on the part of a content's coordinate reference system that a file of that name can't hold. ``None`` where nothing is
/// lost.
///
/// >>> surfrecon.crs_note("terrain.ply", "mesh", "EPSG:25832") is None
/// True
/// >>> surfrecon.crs_note("terrain.stl", "mesh", "EPSG:25832").partition(",")[0]
/// '.stl has no place for the coordinate reference system'
///
/// Args:
///     path: the file.
///     content: what is written: ``"mesh"``, ``"quads"``, ``"points"``, ``"image"`` or ``"images"``.
///     crs: the system of the content, if it has one.
///
/// Raises:
///     InputError: ``content`` is none of these, or ``crs`` names no system.
#[pyfunction]
pub fn crs_note(path: FsPath, content: &str, crs: Option<CrsText>) -> PyResult<Option<String>> {
    Ok(export::crs_note(&path.0, holding(content, "content")?, crs::crs_of(crs)?.as_ref()))
}

/// The endings of the names of files that can be read, without the dot, by the format's name.
///
/// >>> any("las" in endings for endings in surfrecon.formats().values())  # .las can be read
/// True
/// >>> sum(surfrecon.formats(written="images").values(), [])
/// ['conf', 'ptx', 'e57']
///
/// Args:
///     written: asks for what can be written instead: ``"mesh"``, ``"quads"``, ``"points"``, ``"image"`` (one) or
///         ``"images"`` (with their poses).
///
/// Raises:
///     InputError: ``written`` is none of these.
#[pyfunction]
#[pyo3(signature = (*, written = None, **others), text_signature = "(*, written=None)")]
pub fn formats<'py>(
    py: Python<'py>,
    written: Option<&str>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<Bound<'py, PyDict>> {
    no_others("formats", others)?;
    let dict = PyDict::new(py);
    let Some(written) = written else {
        for format in import::formats() {
            dict.set_item(format.name, format.extensions)?;
        }
        return Ok(dict);
    };
    let holding = holding(written, "written")?;
    for format in import::formats() {
        if let Some((ending, _)) = format.written.filter(|(_, all)| all.contains(&holding)) {
            dict.set_item(format.name, [ending])?;
        }
    }
    Ok(dict)
}

/// The kind of content that a word names.
fn holding(word: &str, argument: &str) -> PyResult<Holding> {
    Holding::named(word).ok_or_else(|| {
        let known: Vec<&str> = Holding::CHOICES.iter().map(|choice| choice.name).collect();
        let (meant, known) = (meant(word, known.iter().copied()), known.join("\", \""));
        input_error(format!("{argument} must be one of \"{known}\", got {word:?}{meant}"))
    })
}

/// Scans opened together, in the order of the files: a sequence of ``Scan``. A slice of it is a ``ScanSet`` with the same notes.
///
/// >>> scans = surfrecon.open("bun.conf")
/// >>> len(scans), scans[0].name, len(scans[1:4])
/// (6, 'view0', 3)
#[pyclass(frozen, sequence, module = "surfrecon")]
pub struct ScanSet {
    scans: Vec<Py<Scan>>,
    /// Notes for people on how the files were understood, for example on the quaternion convention used. Of a recording
    /// they say what was found, what is missing and what is left out.
    #[pyo3(get)]
    notes: Vec<String>,
}

impl ScanSet {
    /// Scans that were opened, as Python objects.
    ///
    /// # Errors
    /// None but of Python itself.
    pub fn new(py: Python<'_>, set: import::ScanSet) -> PyResult<Self> {
        let scans = set.scans.into_iter().map(|scan| frame::to_object(py, scan)).collect::<PyResult<_>>()?;
        Ok(ScanSet { scans, notes: set.notes })
    }

    /// A set of scans that are Python objects already.
    pub fn of(scans: Vec<Py<Scan>>, notes: Vec<String>) -> Self {
        ScanSet { scans, notes }
    }

    /// How many scans there are.
    pub fn count(&self) -> usize {
        self.scans.len()
    }

    /// The set with an edit for each of its scans.
    ///
    /// # Errors
    /// See [`Edit::of_scan`].
    pub fn edited(&self, py: Python<'_>, edits: &[Edit]) -> PyResult<Self> {
        let scans =
            self.scans.iter().zip(edits).map(|(scan, edit)| frame::to_object(py, edit.of_scan(&scan.get().scan)?));
        Ok(ScanSet { scans: scans.collect::<PyResult<_>>()?, notes: self.notes.clone() })
    }
}

#[pymethods]
impl ScanSet {
    /// The coordinate reference system that all scans which name one lie in: well-known text, or a code as ``EPSG:25832``. ``None``
    /// where none does.
    ///
    /// Raises:
    ///     InputError: scans of different systems, or in degrees, in which nothing can be measured.
    ///     FileError: a file can't be read.
    #[getter]
    fn crs(&self) -> PyResult<Option<String>> {
        let sources: Vec<&dyn ScanSource> = self.scans.iter().map(|scan| &scan.get().scan as &dyn ScanSource).collect();
        Ok(crs::text_of(common_crs(&sources).map_err(|error| to_python(&error))?.as_ref()))
    }

    /// The set with what a region holds of each scan, whenever it is read, merged or aligned: see ``surfrecon.keep``.
    ///
    /// Args:
    ///     region: a ``Box``, a ``Plane``, or a list of one mask a scan, ``None`` for those that stay whole.
    ///
    /// Raises:
    ///     InputError: another number of masks than of scans. One of another size is one when its scan is read.
    ///     TypeError: what is no region.
    fn keep(&self, py: Python<'_>, region: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.edited(py, &edits(region, true, self.count())?)
    }

    /// The set without what a region holds of each scan. Works as ``keep``.
    fn remove(&self, py: Python<'_>, region: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.edited(py, &edits(region, false, self.count())?)
    }

    /// The set in another size and place: poses now, samples whenever they are read. See ``surfrecon.transformed``.
    fn transformed(&self, py: Python<'_>, similarity: Given) -> PyResult<Self> {
        self.edited(py, &vec![Edit::transform(&similarity.0); self.count()])
    }

    fn __len__(&self) -> usize {
        self.scans.len()
    }

    fn __getitem__<'py>(&self, py: Python<'py>, index: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let length = self.scans.len() as isize;
        if let Ok(slice) = index.cast::<PySlice>() {
            let range = slice.indices(length)?;
            let chosen = (0..range.slicelength).map(|i| &self.scans[(range.start + i as isize * range.step) as usize]);
            let scans = chosen.map(|scan| scan.clone_ref(py)).collect();
            return Ok(Bound::new(py, ScanSet::of(scans, self.notes.clone()))?.into_any());
        }
        let index: isize = index.extract()?;
        let at = if index < 0 { index + length } else { index };
        match usize::try_from(at).ok().and_then(|i| self.scans.get(i)) {
            Some(scan) => Ok(scan.bind(py).clone().into_any()),
            None => Err(PyIndexError::new_err(format!("scan {index} of {length}"))),
        }
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyIterator>> {
        PyList::new(py, &self.scans)?.try_iter()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        pickling::of_scans(py, &self.scans, &self.notes)
    }

    fn __copy__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: PyRef<'py, Self>, _memo: &Bound<'py, PyAny>) -> PyRef<'py, Self> {
        slf
    }

    fn __repr__(&self) -> String {
        format!("<ScanSet of {}>", counted(self.scans.len() as u64, "scan", "scans"))
    }
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.open`` with the same arguments.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``open``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: open
    #[pyo3(signature = (paths, *, camera = None, crs = None, **options), text_signature = "(paths, *, scale=None, offset=0.0, step=None, invalid=None, depth='planar', pixels='auto', max_decoded_gib=4.0, allow_outside=False, poses='auto', axes='auto', camera=None, crs=None)")]
    fn open(
        paths: &Bound<'_, PyAny>,
        camera: Option<&Bound<'_, PyAny>>,
        crs: Option<CrsText>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let call = OpenCall::new(paths, camera, crs, options)?;
        Job::of(Background::start(move |progress| {
            progress.plan(&[("opening", 1.0)]);
            made(call.run(progress)?, |py, set| Ok(Bound::new(py, ScanSet::new(py, set)?)?.into_any()))
        }))
    }
}
