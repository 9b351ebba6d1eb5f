//! Files that are no files of the system: folders in memory, and Python's file objects where a path is expected.

use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::exceptions::{PyBlockingIOError, PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyIterator, PyList, PyMemoryView};
use surfrecon::memory_folder::{self, Sink, Source};

use crate::calling;
use crate::errors::{reworded, to_python};
use crate::params::count;
use crate::paths;

/// A folder whose files lie in memory: ``folder / "scan.ply"`` is a path for whatever takes one, the folder itself too.
///
/// So scans, lists of scans and whole recordings are read from memory, and whatever can be written is written there.
///
/// It works like a ``dict`` of names and ``bytes``. Names have / between folders. Scans that were opened in it keep it. Where one file is
/// read or written, a binary file object with a ``name`` does as well, a ``io.BytesIO`` that was given one too.
///
/// >>> from pathlib import Path
/// >>> folder = surfrecon.MemoryFolder()
/// >>> folder["scan.ply"] = Path("view0.ply").read_bytes()
/// >>> image = surfrecon.read(folder / "scan.ply")
/// >>> image.triangulate().write(folder / "mesh.glb")
/// >>> folder["mesh.glb"][:4]
/// b'glTF'
///
/// Args:
///     sink: called with the name of a file and its next bytes, or ``None`` once it is complete, instead of keeping what is written. On any
///         thread, never on two at once, so that it must not write into the folder itself. An exception of it comes out of the call that
///         writes, and the file is not complete then, nor the list of a set, which is told last. It is kept as long as the folder.
///         So it must not keep the folder itself.
#[pyclass(frozen, mapping, module = "surfrecon")]
pub struct MemoryFolder {
    folder: memory_folder::MemoryFolder,
}

#[pymethods]
impl MemoryFolder {
    #[new]
    #[pyo3(signature = (sink = None))]
    fn new(py: Python<'_>, sink: Option<Py<PyAny>>) -> PyResult<Self> {
        let folder = match sink {
            None => memory_folder::MemoryFolder::new(),
            Some(sink) if sink.bind(py).is_callable() => memory_folder::MemoryFolder::to_sink(Callable(sink)),
            Some(other) => {
                let given = other.bind(py).get_type();
                return Err(PyTypeError::new_err(format!("sink must be callable with a name and bytes, got {given}")));
            }
        };
        Ok(MemoryFolder { folder })
    }

    /// The path of a file in the folder, whether it is there or not.
    ///
    /// Raises:
    ///     InputError: a name that is no file's within the folder.
    fn __truediv__(&self, name: &Bound<'_, PyAny>) -> PyResult<MemoryPath> {
        self.at(name.extract()?)
    }

    fn __fspath__(&self) -> String {
        self.folder.root().to_string_lossy().into_owned()
    }

    /// Puts a file into the folder whose bytes are asked for when they are read.
    ///
    /// >>> from pathlib import Path
    /// >>> content = Path("view0.ply").read_bytes()  # or what a server sends, part by part
    /// >>> folder = surfrecon.MemoryFolder()
    /// >>> path = folder.put_source("scan.ply", len(content), lambda first, most: content[first : first + most])
    /// >>> image = surfrecon.read(path)
    ///
    /// Args:
    ///     name: of the file.
    ///     length: number of bytes.
    ///     read: called with the place of the first byte and the most that are wanted, at least 1. Gives up to as many bytes, at least 1. On
    ///         any thread. An exception of it comes out of the call that reads.
    ///
    /// Raises:
    ///     InputError: a name that is no file's within the folder.
    fn put_source(
        &self,
        py: Python<'_>,
        name: &str,
        length: &Bound<'_, PyAny>,
        read: Py<PyAny>,
    ) -> PyResult<MemoryPath> {
        let length = count("length", length, 0, "Give the number of bytes of the file.")? as u64;
        if !read.bind(py).is_callable() {
            let given = read.bind(py).get_type();
            return Err(PyTypeError::new_err(format!("read must be callable with a place and a count, got {given}")));
        }
        self.folder.put_source(name, Arc::new(Reader { length, read })).map_err(|error| to_python(&error))?;
        self.at(name)
    }

    fn __setitem__(&self, name: &str, content: &Bound<'_, PyAny>) -> PyResult<()> {
        let bytes = bytes_of(content)?;
        self.folder.put_source(name, Arc::new(Held(bytes))).map(drop).map_err(|error| to_python(&error))
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyBytes>> {
        self.content(py, name)?.ok_or_else(|| PyKeyError::new_err(name.to_owned()))
    }

    /// The bytes of a file, or ``default`` if it is not there.
    #[pyo3(signature = (name, default = None))]
    fn get<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        default: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        Ok(self.content(py, name)?.map(Bound::into_any).or(default))
    }

    /// Names and bytes of all files, in the order of names.
    fn items<'py>(&self, py: Python<'py>) -> PyResult<Vec<(String, Bound<'py, PyBytes>)>> {
        let one = |name: String| Ok(self.content(py, &name)?.map(|bytes| (name, bytes)));
        self.folder.names().into_iter().filter_map(|name| one(name).transpose()).collect()
    }

    /// The bytes of all files, in the order of names.
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyBytes>>> {
        Ok(self.items(py)?.into_iter().map(|(_, bytes)| bytes).collect())
    }

    fn __delitem__(&self, name: &str) -> PyResult<()> {
        if self.folder.remove(name) { Ok(()) } else { Err(PyKeyError::new_err(name.to_owned())) }
    }

    fn __contains__(&self, name: &Bound<'_, PyAny>) -> bool {
        name.extract::<String>().is_ok_and(|name| self.has(&name))
    }

    fn __len__(&self) -> usize {
        self.folder.names().len()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyIterator>> {
        PyList::new(py, self.folder.names())?.try_iter()
    }

    /// The names of all files, in order.
    fn keys(&self) -> Vec<String> {
        self.folder.names()
    }

    fn __repr__(&self) -> String {
        format!("<MemoryFolder {} of {} files>", self.folder.root().display(), self.folder.names().len())
    }
}

impl MemoryFolder {
    fn at(&self, name: &str) -> PyResult<MemoryPath> {
        self.folder.path(name).map_err(|error| to_python(&error))?;
        Ok(MemoryPath { folder: self.folder.clone(), name: name.to_owned() })
    }

    fn content<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Bound<'py, PyBytes>>> {
        if let Some(bytes) = self.folder.bytes(name) {
            return Ok(Some(PyBytes::new(py, &bytes)));
        }
        if !self.has(name) {
            return Ok(None);
        }
        let whole = py.detach(|| self.folder.read(name)).map_err(|error| to_python(&error))?;
        Ok(Some(PyBytes::new(py, &whole)))
    }

    fn has(&self, name: &str) -> bool {
        self.folder.names().iter().any(|known| known == name)
    }
}

/// The path of a file in a ``MemoryFolder``, which it keeps.
///
/// >>> path = surfrecon.MemoryFolder() / "meshes/part.ply"
/// >>> mesh.write(path)
/// >>> path.name, len(surfrecon.read(path).triangles) == len(mesh.triangles)
/// ('meshes/part.ply', True)
#[pyclass(frozen, module = "surfrecon")]
pub struct MemoryPath {
    folder: memory_folder::MemoryFolder,
    /// The name in the folder.
    #[pyo3(get)]
    name: String,
}

#[pymethods]
impl MemoryPath {
    fn __fspath__(&self) -> String {
        self.folder.root().join(&self.name).to_string_lossy().into_owned()
    }

    fn __str__(&self) -> String {
        self.__fspath__()
    }

    fn __repr__(&self) -> String {
        format!("<MemoryPath {}>", self.__fspath__())
    }
}

/// The bytes of an object that has some, or of a file object, which is read to its end.
fn bytes_of(content: &Bound<'_, PyAny>) -> PyResult<PyBackedBytes> {
    let py = content.py();
    if let Ok(bytes) = content.extract::<PyBackedBytes>() {
        return Ok(bytes);
    }
    let given = if content.hasattr("read")? { content.call_method0("read")? } else { content.clone() };
    // The bytes of a buffer of any kind.
    let view = PyMemoryView::from(&given);
    let bytes =
        view.and_then(|view| py.get_type::<PyBytes>().call1((view,))?.extract::<PyBackedBytes>().map_err(PyErr::from));
    bytes.map_err(|error| {
        reworded(error, || {
            let given = given.get_type();
            PyTypeError::new_err(format!("a file must be bytes or a binary file object, got {given}"))
        })
    })
}

/// The place of a file: a path, or a file object, which lies in a folder of its own while it is needed.
pub struct Place {
    path: PathBuf,
    _folder: Option<memory_folder::MemoryFolder>,
}

impl Deref for Place {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.path
    }
}

impl AsRef<Path> for Place {
    fn as_ref(&self) -> &Path {
        self
    }
}

impl Place {
    /// A file that is read.
    ///
    /// # Errors
    /// A value that is no path and no file object. An exception while it is read.
    pub fn to_read(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        Place::of(given, "read", |folder, name| {
            let bytes = bytes_of(given)?;
            folder.put_source(name, Arc::new(Held(bytes))).map_err(|error| to_python(&error))
        })
    }

    fn of(
        given: &Bound<'_, PyAny>,
        method: &str,
        make: impl FnOnce(&memory_folder::MemoryFolder, &str) -> PyResult<PathBuf>,
    ) -> PyResult<Self> {
        match paths::of(given) {
            Ok(path) => return Ok(Place { _folder: memory_folder::MemoryFolder::of(&path), path }),
            Err(error) if error.is_instance_of::<PyTypeError>(given.py()) => {}
            Err(error) => return Err(error),
        }
        if !given.hasattr(method)? {
            let expected = match method {
                "read" => "paths must be a path, a binary file object, or a list or another iterable of these",
                _ => "path must be a path or a binary file object",
            };
            return Err(PyTypeError::new_err(format!("{expected}, got {}", given.get_type())));
        }
        let name = name_of(given)?;
        let folder = match method {
            "write" => {
                memory_folder::MemoryFolder::to_sink(FileObject { file: given.clone().unbind(), name: name.clone() })
            }
            _ => memory_folder::MemoryFolder::new(),
        };
        Ok(Place { path: make(&folder, &name)?, _folder: Some(folder) })
    }
}

/// A file that is written.
impl<'py> FromPyObject<'_, 'py> for Place {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        Place::of(&given, "write", |folder, name| folder.path(name).map_err(|error| to_python(&error)))
    }
}

/// The name of a file object. Its ending says the format where the content does not.
fn name_of(file: &Bound<'_, PyAny>) -> PyResult<String> {
    let decoded =
        |name: Bound<'_, PyAny>| file.py().import("os")?.call_method1("fsdecode", (name,))?.extract::<PathBuf>();
    let given = file.getattr("name").and_then(decoded).ok();
    let name = given.as_deref().and_then(Path::file_name).map(|name| name.to_string_lossy().replace('\\', "_"));
    name.filter(|name| !name.is_empty()).ok_or_else(|| {
        PyValueError::new_err(format!(
            "{file} has no name that says the format: give it one, file.name = \"mesh.ply\", or use a surfrecon.MemoryFolder"
        ))
    })
}

struct Held(PyBackedBytes);

impl AsRef<[u8]> for Held {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

/// A Python function that gives bytes.
struct Reader {
    length: u64,
    read: Py<PyAny>,
}

impl Source for Reader {
    fn length(&self) -> u64 {
        self.length
    }

    fn read_at(&self, at: u64, buffer: &mut [u8]) -> std::io::Result<usize> {
        let read = |py: Python<'_>| -> PyResult<usize> {
            let bytes = bytes_of(&self.read.bind(py).call1((at, buffer.len()))?)?;
            let count = bytes.len();
            if count == 0 || count > buffer.len() {
                let wanted = buffer.len();
                return Err(PyValueError::new_err(format!(
                    "read({at}, {wanted}) must give 1 to {wanted} bytes, got {count}"
                )));
            }
            buffer[..count].copy_from_slice(&bytes);
            Ok(count)
        };
        calling::attached(read)
    }
}

/// A Python function that takes names and bytes.
struct Callable(Py<PyAny>);

impl Callable {
    fn call(&self, name: &str, bytes: Option<&[u8]>) -> std::io::Result<()> {
        calling::attached(|py| self.0.bind(py).call1((name, bytes.map(|bytes| PyBytes::new(py, bytes)))).map(drop))
    }
}

impl Sink for Callable {
    fn piece(&mut self, name: &str, bytes: &[u8]) -> std::io::Result<()> {
        self.call(name, Some(bytes))
    }

    fn complete(&mut self, name: &str) -> std::io::Result<()> {
        self.call(name, None)
    }
}

/// A Python file object that is written to.
struct FileObject {
    file: Py<PyAny>,
    name: String,
}

impl Sink for FileObject {
    fn piece(&mut self, name: &str, bytes: &[u8]) -> std::io::Result<()> {
        let write = |py: Python<'_>| -> PyResult<()> {
            if name != self.name {
                return Err(PyValueError::new_err(format!(
                    "{} is a list with files beside it, which one file object can't hold: use a surfrecon.MemoryFolder",
                    self.name
                )));
            }
            let mut rest = bytes;
            while !rest.is_empty() {
                let file = self.file.bind(py);
                let written = file.call_method1("write", (PyBytes::new(py, rest),))?;
                let is_raw = || file.is_instance(&py.import("io")?.getattr("RawIOBase")?);
                if written.is_none() {
                    // Unbuffered files take nothing now; some that are no files say nothing and take all.
                    if is_raw()? {
                        let words =
                            format!("{} takes no bytes now: it must not be in the non-blocking mode", self.name);
                        return Err(PyBlockingIOError::new_err(words));
                    }
                    return Ok(());
                }
                let count = written.extract::<usize>().ok().filter(|count| (1..=rest.len()).contains(count));
                let wrong = || {
                    PyValueError::new_err(format!("{}: write() took {written:?} of {} bytes", self.name, rest.len()))
                };
                rest = &rest[count.ok_or_else(wrong)?..];
            }
            Ok(())
        };
        calling::attached(write)
    }

    fn complete(&mut self, _: &str) -> std::io::Result<()> {
        Ok(())
    }
}
