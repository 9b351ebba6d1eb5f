//! Files of a workspace: columns of plain numbers, each with its checksum, and a table of where they are.
//!
//! A file is written under a name of its own and gets its name once it is whole, so what has a name is complete. Numbers are written as the
//! machine has them. A workspace is of one machine.

use std::fs::File;
use std::io::{BufWriter, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use bytemuck::{AnyBitPattern, NoUninit, Pod, Zeroable};
use tempfile::NamedTempFile;
use twox_hash::XxHash3_128;

use base::error::{Error, Result};
use base::memory::size;

/// End of a file.
const MARK: [u8; 8] = *b"srfcol02";
/// Bytes handed to the system at a time.
const BUFFER: usize = 1 << 18;

/// Place of a column in its file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Place {
    /// First byte.
    offset: u64,
    /// Bytes.
    bytes: u64,
    /// Of these: tells whether they are damaged, and is another for others but for one chance in 2^128.
    pub content: Content,
}

/// A hash (XXH3) of bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Pod, Zeroable)]
pub struct Content([u64; 2]);

impl Content {
    fn of(bytes: &[u8]) -> Self {
        let hash = XxHash3_128::oneshot(bytes);
        Content([hash as u64, (hash >> 64) as u64])
    }
}

impl Place {
    /// Number of elements of a type.
    pub fn count<T>(&self) -> usize {
        self.bytes as usize / size_of::<T>()
    }
}

/// The end of a file: where its table is.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Tail {
    table: Place,
    mark: [u8; 8],
}

/// A file that is being written.
pub struct Columns {
    file: BufWriter<NamedTempFile>,
    path: PathBuf,
    at: u64,
}

impl Columns {
    /// Begins a file that will have this path.
    ///
    /// # Errors
    /// It can't be made.
    pub fn new(path: &Path) -> Result<Self> {
        let folder = path.parent().unwrap_or(Path::new("."));
        let file = NamedTempFile::with_prefix_in("unfinished-", folder).map_err(|error| Error::io(folder, error))?;
        Ok(Columns { file: BufWriter::with_capacity(BUFFER, file), path: path.to_owned(), at: 0 })
    }

    /// Appends a column.
    ///
    /// # Errors
    /// It can't be written.
    pub fn put<T: NoUninit>(&mut self, column: &[T]) -> Result<Place> {
        let bytes: &[u8] = bytemuck::cast_slice(column);
        self.file.write_all(bytes).map_err(|error| self.failed(error))?;
        let place = Place { offset: self.at, bytes: bytes.len() as u64, content: Content::of(bytes) };
        self.at += place.bytes;
        Ok(place)
    }

    /// Appends the table of what is where, and gives the file its name.
    ///
    /// # Errors
    /// It can't be written.
    pub fn finish<T: NoUninit>(self, table: &[T]) -> Result<()> {
        let (file, path, at) = self.whole(table)?;
        file.persist(&path).map_err(|error| cant_write(&path, at, error.error))?;
        Ok(())
    }

    /// As [`Columns::finish`], with the first of these names that no file has yet. Gives its place among them, nothing where files have
    /// all.
    ///
    /// # Errors
    /// It can't be written.
    pub fn finish_as<T: NoUninit>(self, table: &[T], names: impl Iterator<Item = PathBuf>) -> Result<Option<usize>> {
        let (mut file, _, at) = self.whole(table)?;
        for (place, path) in names.enumerate() {
            match file.persist_noclobber(&path) {
                Ok(_) => return Ok(Some(place)),
                Err(error) if error.error.kind() == std::io::ErrorKind::AlreadyExists => file = error.file,
                Err(error) => return Err(cant_write(&path, at, error.error)),
            }
        }
        Ok(None)
    }

    /// The file once all is written, the path it was begun for, and its bytes.
    fn whole<T: NoUninit>(mut self, table: &[T]) -> Result<(NamedTempFile, PathBuf, u64)> {
        let table = self.put(table)?;
        self.put(&[Tail { table, mark: MARK }])?;
        let Columns { file, path, at } = self;
        let file = file.into_inner().map_err(|error| cant_write(&path, at, error.into_error()))?;
        Ok((file, path, at))
    }

    fn failed(&self, error: std::io::Error) -> Error {
        cant_write(&self.path, self.at, error)
    }
}

/// The error of a write that failed: on full disks with what had been written.
fn cant_write(path: &Path, bytes: u64, error: std::io::Error) -> Error {
    if error.kind() == std::io::ErrorKind::StorageFull {
        let text = format!(
            "the disk is full after {} of this file: free some, or choose another workspace",
            size(bytes as f64)
        );
        return Error::io(path, std::io::Error::new(error.kind(), text));
    }
    Error::io(path, error)
}

/// A file to be read, from several threads.
pub struct Stored {
    path: PathBuf,
    file: Mutex<File>,
}

impl Stored {
    /// Opens a file, with its table.
    ///
    /// # Errors
    /// It is not there, or not whole.
    pub fn open<T: AnyBitPattern + NoUninit>(path: &Path) -> Result<(Self, Vec<T>)> {
        let mut file = File::open(path).map_err(|error| unread(path, error))?;
        let mut tail = [Tail::zeroed()];
        let length = file.metadata().map_err(|error| Error::io(path, error))?.len();
        let begin = length.checked_sub(size_of::<Tail>() as u64).ok_or_else(|| damaged(path))?;
        read_at(&mut file, begin, bytemuck::cast_slice_mut(&mut tail)).map_err(|error| Error::io(path, error))?;
        let [Tail { table, mark }] = tail;
        if mark != MARK || table.offset.checked_add(table.bytes) != Some(begin) {
            return Err(damaged(path));
        }
        let stored = Stored { path: path.to_owned(), file: Mutex::new(file) };
        let table = stored.get(&table)?;
        Ok((stored, table))
    }

    /// Opens a file whose table is known.
    ///
    /// # Errors
    /// It is not there.
    pub fn again(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|error| unread(path, error))?;
        Ok(Stored { path: path.to_owned(), file: Mutex::new(file) })
    }

    /// Reads a column.
    ///
    /// # Errors
    /// It can't be read. It is not what was written.
    pub fn get<T: AnyBitPattern + NoUninit>(&self, place: &Place) -> Result<Vec<T>> {
        let mut column = Vec::new();
        self.append(place, &mut column)?;
        Ok(column)
    }

    /// Reads a column and appends it.
    ///
    /// # Errors
    /// As [`Stored::get`].
    pub fn append<T: AnyBitPattern + NoUninit>(&self, place: &Place, to: &mut Vec<T>) -> Result<()> {
        let before = to.len();
        to.resize(before + place.count::<T>(), T::zeroed());
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut to[before..]);
        let mut file = self.file.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        read_at(&mut file, place.offset, bytes).map_err(|error| Error::io(&self.path, error))?;
        drop(file);
        if Content::of(bytes) != place.content {
            return Err(damaged(&self.path));
        }
        Ok(())
    }
}

fn read_at(file: &mut File, offset: u64, bytes: &mut [u8]) -> std::io::Result<()> {
    file.seek(SeekFrom::Start(offset))?;
    file.read_exact(bytes)
}

/// A file that is not what was written.
pub fn damaged(path: &Path) -> Error {
    Error::format(path, "checksum", format!("the file is damaged: {}", anew(path)))
}

/// A file that can't be read.
fn unread(path: &Path, error: std::io::Error) -> Error {
    match error.kind() {
        std::io::ErrorKind::NotFound => Error::input(format!("{}: the file is gone: {}", path.display(), anew(path))),
        _ => Error::io(path, error),
    }
}

/// Remedy for a file that is not what it was.
fn anew(path: &Path) -> String {
    format!("remove the folder {} and merge, or plan, again", path.parent().unwrap_or(Path::new(".")).display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_what_is_damaged_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("columns");
        let numbers: Vec<u32> = (0..1000).collect();
        let mut file = Columns::new(&path).unwrap();
        let places = [file.put(&numbers).unwrap(), file.put::<u64>(&[]).unwrap(), file.put(&[0.5_f64, -1.0]).unwrap()];
        assert!(!path.exists());
        file.finish(&places).unwrap();
        let (stored, table) = Stored::open::<Place>(&path).unwrap();
        assert_eq!(table, places);
        assert_eq!(stored.get::<u32>(&table[0]).unwrap(), numbers);
        assert!(stored.get::<u64>(&table[1]).unwrap().is_empty());
        assert_eq!(stored.get::<f64>(&table[2]).unwrap(), [0.5, -1.0]);
        assert_eq!(folder.path().read_dir().unwrap().count(), 1);

        let whole = std::fs::read(&path).unwrap();
        let read = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            let (stored, table) = Stored::open::<Place>(&path)?;
            let (numbers, more): (Vec<u32>, Vec<f64>) = (stored.get(&table[0])?, stored.get(&table[2])?);
            Ok((numbers, more))
        };
        assert!(read(&whole).is_ok());
        for at in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[at] ^= 0x10;
            let found: Result<_> = read(&damaged);
            // Bytes beside a place in the table are not looked at.
            if let Ok(found) = found {
                assert_eq!(found, (numbers.clone(), vec![0.5, -1.0]), "byte {at}");
            }
        }
        for length in [0, 10, 40, whole.len() / 2, whole.len() - 1] {
            assert!(read(&whole[..length]).is_err(), "{length} bytes");
        }
    }

    #[test]
    fn a_file_that_is_not_finished_is_not_there() {
        let folder = tempfile::tempdir().unwrap();
        let mut file = Columns::new(&folder.path().join("columns")).unwrap();
        file.put(&[1_u8; 100]).unwrap();
        drop(file);
        assert_eq!(folder.path().read_dir().unwrap().count(), 0);
        // A file that has a name keeps it.
        let names = ["a", "b"].map(|name| folder.path().join(name));
        for expected in [Some(0), Some(1), None] {
            let file = Columns::new(&names[0]).unwrap();
            assert_eq!(file.finish_as::<Place>(&[], names.iter().cloned()).unwrap(), expected);
        }
        assert_eq!(folder.path().read_dir().unwrap().count(), 2);
        let nowhere = folder.path().join("nowhere").join("columns");
        let text = Columns::new(&nowhere).map(|_| ()).unwrap_err().to_string();
        assert!(text.contains("nowhere"), "{text}");
    }
}
