//! Folders that lie in memory or behind functions of the caller, each with a path of its own. Every function that takes paths reads and
//! writes the files in them. Among these are lists with the scans that they name, and whole recordings.
//!
//! As GDAL has it with `/vsimem/`, but a folder belongs to whoever made it and goes with its last user.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io::{Cursor, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use base::error::{Error, IN_MEMORY as ROOT, Result};
use base::fork::{self, Prevented};
use base::memory;
use base::threads::{Exclusive, Turns};

/// Most bytes that a [`Sink`] is handed at once of a file that had to be finished before.
const PIECE: usize = 1 << 20;

/// Those that somebody has, by their numbers.
static FOLDERS: Mutex<BTreeMap<u64, Weak<Inner>>> = Mutex::new(BTreeMap::new());

/// Source of a file, wherever its bytes are. Sources that lie in memory are one by themselves.
pub trait Source: Send + Sync {
    /// Number of bytes. Must not change.
    fn length(&self) -> u64;

    /// Reads bytes from a place on, any number of them but 0 before the end. Several threads may ask at once.
    ///
    /// # Errors
    /// Whatever keeps them from being read. The file's reader hands it on.
    fn read_at(&self, at: u64, buffer: &mut [u8]) -> std::io::Result<usize>;
}

impl<T: AsRef<[u8]> + Send + Sync> Source for T {
    fn length(&self) -> u64 {
        self.as_ref().len() as u64
    }

    fn read_at(&self, at: u64, buffer: &mut [u8]) -> std::io::Result<usize> {
        let rest = usize::try_from(at).ok().and_then(|at| self.as_ref().get(at..)).unwrap_or_default();
        let count = rest.len().min(buffer.len());
        buffer[..count].copy_from_slice(&rest[..count]);
        Ok(count)
    }
}

/// Receiver of what is written, instead of its being kept. It must not write into the same folder.
pub trait Sink: Send {
    /// The next bytes of a file. Those of several files may take turns.
    ///
    /// # Errors
    /// The reason that keeps it from taking them. The writer ends with it, and the file is not complete. Nor is the list of a set then,
    /// which is told last.
    fn piece(&mut self, name: &str, bytes: &[u8]) -> std::io::Result<()>;

    /// All of a file was handed over. What has had pieces and is not complete when its writer has ended is to be discarded.
    ///
    /// # Errors
    /// As [`Sink::piece`].
    fn complete(&mut self, name: &str) -> std::io::Result<()>;
}

/// A folder of files in memory. Clones are the same folder. It is there as long as one of them is, or a scan that was opened in it.
#[derive(Clone)]
pub struct MemoryFolder(Arc<Inner>);

struct Inner {
    number: u64,
    files: Mutex<BTreeMap<String, Held>>,
    sink: Option<Outlet>,
}

/// A sink, which one thread at a time hands something.
struct Outlet {
    turns: Turns,
    sink: Exclusive<Box<dyn Sink>>,
}

impl Outlet {
    fn hand(&self, what: impl FnOnce(&mut dyn Sink) -> std::io::Result<()>) -> std::io::Result<()> {
        self.turns.take(|| match self.sink.take() {
            Ok(mut sink) => what(&mut **sink),
            Err(_) => Err(std::io::Error::other(
                "this process was forked while another thread wrote into this folder: make another folder",
            )),
        })
    }
}

/// A table that threads look at for a moment.
struct Table<'t, T> {
    // Dropped in this order.
    locked: MutexGuard<'t, T>,
    _fork: Prevented,
}

impl<'t, T> Table<'t, T> {
    fn lock(table: &'t Mutex<T>) -> Self {
        let fork = fork::prevent();
        Table { locked: table.lock().unwrap_or_else(PoisonError::into_inner), _fork: fork }
    }
}

impl<T> std::ops::Deref for Table<'_, T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.locked
    }
}

impl<T> std::ops::DerefMut for Table<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.locked
    }
}

#[derive(Clone)]
enum Held {
    Bytes(Arc<Vec<u8>>),
    Source(Arc<dyn Source>),
}

impl Drop for Inner {
    fn drop(&mut self) {
        folders().remove(&self.number);
    }
}

impl fmt::Debug for MemoryFolder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MemoryFolder").field("path", &self.root()).field("names", &self.names()).finish()
    }
}

impl Default for MemoryFolder {
    fn default() -> Self {
        MemoryFolder::new()
    }
}

fn folders() -> Table<'static, BTreeMap<u64, Weak<Inner>>> {
    Table::lock(&FOLDERS)
}

impl MemoryFolder {
    /// An empty folder.
    pub fn new() -> Self {
        MemoryFolder::made(None)
    }

    /// An empty folder that keeps nothing of what is written into it: `sink` is handed that.
    pub fn to_sink(sink: impl Sink + 'static) -> Self {
        MemoryFolder::made(Some(Outlet { turns: Turns::default(), sink: Exclusive::new(Box::new(sink)) }))
    }

    fn made(sink: Option<Outlet>) -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let inner = Arc::new(Inner { number, files: Mutex::default(), sink });
        folders().insert(number, Arc::downgrade(&inner));
        MemoryFolder(inner)
    }

    /// The folder that a path leads into. `None` for paths of the system, and for folders that have gone.
    pub fn of(path: &Path) -> Option<Self> {
        place_of(path).map(|place| place.folder)
    }

    /// The path of the folder.
    pub fn root(&self) -> PathBuf {
        Path::new(ROOT).join(self.0.number.to_string())
    }

    /// The path of a file in it, whether it is there or not. Names may lead through folders, `depth/00001.png`.
    ///
    /// # Errors
    /// [`Error::Input`] for a name that is no file's within the folder.
    pub fn path(&self, name: &str) -> Result<PathBuf> {
        let parts = || name.split('/');
        if name.contains(['\\', '\0']) || parts().any(|part| matches!(part, "" | "." | "..")) {
            let shown = name.replace(char::is_control, "\u{fffd}");
            let remedy = "a file in memory is called like one on a disk, `scan.ply` or `depth/00001.png`, with / between folders";
            return Err(Error::input(format!("{shown:?}: {remedy}")));
        }
        Ok(parts().fold(self.root(), |path, part| path.join(part)))
    }

    /// Puts a file into the folder, in place of one of that name. Its path.
    ///
    /// # Errors
    /// As [`MemoryFolder::path`].
    pub fn put(&self, name: &str, bytes: impl Into<Arc<Vec<u8>>>) -> Result<PathBuf> {
        self.hold(name, Held::Bytes(bytes.into()))
    }

    /// As [`MemoryFolder::put`], for bytes that lie elsewhere: each reader asks for those that it needs.
    ///
    /// # Errors
    /// As [`MemoryFolder::path`].
    pub fn put_source(&self, name: &str, source: Arc<dyn Source>) -> Result<PathBuf> {
        self.hold(name, Held::Source(source))
    }

    fn hold(&self, name: &str, held: Held) -> Result<PathBuf> {
        let path = self.path(name)?;
        let replaced = {
            let mut files = self.files();
            refuse_within(&files, name)?;
            files.insert(name.to_owned(), held)
        };
        // Only now: letting go of a source may call its owner, who may look into the folder.
        drop(replaced);
        Ok(path)
    }

    /// The bytes that were written or put into a file. `None` if it is not there, or lies elsewhere.
    pub fn bytes(&self, name: &str) -> Option<Arc<Vec<u8>>> {
        match self.files().get(name) {
            Some(Held::Bytes(bytes)) => Some(bytes.clone()),
            _ => None,
        }
    }

    /// All bytes of a file, wherever they lie.
    ///
    /// # Errors
    /// [`Error::Io`] if it is not there or can't be read. [`Error::Input`] as [`MemoryFolder::path`]. [`Error::OutOfMemory`].
    pub fn read(&self, name: &str) -> Result<Vec<u8>> {
        let path = self.path(name)?;
        let io = |e| Error::io(&path, e);
        let mut file = Place { folder: self.clone(), name: name.to_owned() }.open().map_err(io)?;
        let mut bytes =
            memory::reserved(usize::try_from(file.length).unwrap_or(usize::MAX), || format!("reading {name}"))?;
        file.read_to_end(&mut bytes).map_err(io)?;
        Ok(bytes)
    }

    /// Takes a file away. Returns whether it was there. Whoever reads it just then reads on.
    pub fn remove(&self, name: &str) -> bool {
        let removed = self.files().remove(name);
        removed.is_some()
    }

    /// The names of all files, in order.
    pub fn names(&self) -> Vec<String> {
        self.files().keys().cloned().collect()
    }

    fn files(&self) -> Table<'_, BTreeMap<String, Held>> {
        Table::lock(&self.0.files)
    }
}

/// Refuses a file where a folder is, and one within a file.
fn refuse_within(files: &BTreeMap<String, Held>, name: &str) -> Result<()> {
    let below = format!("{name}/");
    if files.range(below.clone()..).next().is_some_and(|(other, _)| other.starts_with(&below)) {
        return Err(Error::input(format!("{name}: this is a folder: give the name of a file in it")));
    }
    match name.match_indices('/').map(|(at, _)| &name[..at]).find(|above| files.contains_key(*above)) {
        Some(above) => Err(Error::input(format!("{name}: {above} is a file, but must be a folder"))),
        None => Ok(()),
    }
}

/// Whether a name begins like the path of a folder in memory.
pub(crate) fn begins_in_memory(name: &str) -> bool {
    name.split(['/', '\\']).next() == Some(ROOT)
}

/// A place in a folder in memory.
pub(crate) struct Place {
    folder: MemoryFolder,
    /// Of the file or folder. Empty for the folder itself.
    name: String,
}

/// The place of a path in a folder that is there. `None` for paths of the system.
pub(crate) fn place_of(path: &Path) -> Option<Place> {
    let mut parts = path.components();
    let (Some(Component::Normal(root)), Some(Component::Normal(number))) = (parts.next(), parts.next()) else {
        return None;
    };
    if root != ROOT {
        return None;
    }
    let number: u64 = number.to_str()?.parse().ok()?;
    let folder = MemoryFolder(folders().get(&number)?.upgrade()?);
    let mut names: Vec<&str> = Vec::new();
    for part in parts {
        match part {
            Component::Normal(name) => names.push(name.to_str()?),
            Component::ParentDir => drop(names.pop()?),
            Component::CurDir => {}
            _ => return None,
        }
    }
    Some(Place { name: names.join("/"), folder })
}

/// Reason why nothing is found at a path: a folder in memory goes with its last user, and no path leads out of one.
pub(crate) fn explained(path: &Path, error: std::io::Error) -> std::io::Error {
    match path.components().next() {
        Some(Component::Normal(root)) if root == ROOT => {
            let is_there = path.ancestors().any(|above| place_of(above).is_some());
            let words = if is_there {
                "this path leads out of its folder in memory"
            } else {
                "this folder in memory has gone: keep it as long as its paths are used"
            };
            std::io::Error::new(error.kind(), words)
        }
        _ => error,
    }
}

impl Place {
    pub(crate) fn is_file(&self) -> bool {
        self.folder.files().contains_key(&self.name)
    }

    pub(crate) fn is_dir(&self) -> bool {
        self.name.is_empty() || !self.children().is_empty()
    }

    /// The names in a folder, without what lies deeper.
    pub(crate) fn children(&self) -> BTreeSet<String> {
        let below = if self.name.is_empty() { String::new() } else { format!("{}/", self.name) };
        let files = self.folder.files();
        let names = files.range(below.clone()..).map_while(|(name, _)| name.strip_prefix(&below));
        names.filter_map(|rest| rest.split('/').next()).map(str::to_owned).collect()
    }

    /// The file, to be read.
    pub(crate) fn open(&self) -> std::io::Result<Reading> {
        let source: Arc<dyn Source> = match self.folder.files().get(&self.name) {
            Some(Held::Bytes(bytes)) => Arc::new(Shared(bytes.clone())),
            Some(Held::Source(source)) => source.clone(),
            None => {
                return Err(std::io::Error::new(
                    ErrorKind::NotFound,
                    "there is no such file in this folder in memory: put it there first",
                ));
            }
        };
        Ok(Reading { length: source.length(), source, at: 0 })
    }

    /// The file, to be written. Pieces are handed to a sink at once, unless the writer goes back in what it has written.
    pub(crate) fn write(self, goes_back: bool) -> Result<Writing> {
        refuse_within(&self.folder.files(), &self.name)?;
        let hands_on = self.folder.0.sink.is_some() && !goes_back;
        Ok(Writing { place: self, bytes: Cursor::default(), hands_on, has_failed: false })
    }
}

struct Shared(Arc<Vec<u8>>);

impl AsRef<[u8]> for Shared {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

/// A file in memory that is being read.
pub(crate) struct Reading {
    source: Arc<dyn Source>,
    length: u64,
    at: u64,
}

impl Reading {
    pub(crate) fn length(&self) -> u64 {
        self.length
    }
}

impl Read for Reading {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let left = usize::try_from(self.length.saturating_sub(self.at)).unwrap_or(usize::MAX);
        let most = buffer.len().min(left);
        if most == 0 {
            return Ok(0);
        }
        let count = self.source.read_at(self.at, &mut buffer[..most])?;
        if count == 0 || count > most {
            let answer = format!(
                "{count} bytes were read at byte {} of {}, where 1 to {most} were asked for",
                self.at, self.length
            );
            return Err(std::io::Error::new(ErrorKind::UnexpectedEof, answer));
        }
        self.at += count as u64;
        Ok(count)
    }
}

impl Seek for Reading {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        let place = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(by) => self.length.checked_add_signed(by),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
        };
        self.at = place.ok_or(ErrorKind::InvalidInput)?;
        Ok(self.at)
    }
}

/// A file in memory that is being written. Dropped, it is gone.
pub(crate) struct Writing {
    place: Place,
    bytes: Cursor<Vec<u8>>,
    hands_on: bool,
    /// Whether the sink has refused some: who buffers tries again when it is dropped, and the sink must not hear of it.
    has_failed: bool,
}

impl Writing {
    /// Puts the file into its folder, or tells the sink that it is complete.
    pub(crate) fn keep(self) -> std::io::Result<()> {
        let Place { folder, name } = self.place;
        let bytes = self.bytes.into_inner();
        match &folder.0.sink {
            None => {
                let replaced = folder.files().insert(name, Held::Bytes(bytes.into()));
                drop(replaced);
                Ok(())
            }
            Some(_) if self.has_failed => Err(refused_before()),
            Some(sink) => sink.hand(|sink| {
                bytes.chunks(PIECE).try_for_each(|piece| sink.piece(&name, piece))?;
                sink.complete(&name)
            }),
        }
    }
}

fn refused_before() -> std::io::Error {
    std::io::Error::other("the folder's sink refused an earlier write: use another folder")
}

impl Write for Writing {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        if self.hands_on
            && let Some(sink) = &self.place.folder.0.sink
        {
            if self.has_failed {
                return Err(refused_before());
            }
            let handed = sink.hand(|sink| sink.piece(&self.place.name, bytes));
            self.has_failed = handed.is_err();
            return handed.map(|()| bytes.len());
        }
        let beyond =
            (self.bytes.position() as usize).saturating_add(bytes.len()).saturating_sub(self.bytes.get_ref().len());
        self.bytes.get_mut().try_reserve(beyond).map_err(|_| ErrorKind::OutOfMemory)?;
        self.bytes.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Read for Writing {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.bytes.read(buffer)
    }
}

impl Seek for Writing {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        debug_assert!(!self.hands_on, "what was handed on can't be gone back to");
        self.bytes.seek(to)
    }
}

#[cfg(test)]
mod tests;
