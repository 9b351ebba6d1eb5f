//! Folders in memory.

use std::collections::BTreeMap;
use std::ffi::{CString, c_char, c_void};
use std::io::ErrorKind;
use std::sync::{Arc, Mutex, PoisonError};

use surfrecon::memory_folder::{MemoryFolder, Sink, Source};
use surfrecon::threads::Turns;

use crate::guard::guard;
use crate::handle::{self, handle};
use crate::status::{self, Failure, srf_status, srf_status::*};
use crate::text::c_text;
use crate::{fork, last_error, pointer};

/// A folder whose files lie in memory, or behind functions of yours. Each of its files has a path (srf_folder_path()), which every function
/// that takes the path of a file takes. So scans, lists of scans and whole recordings are read from memory, and all files can be written
/// there. Released with srf_folder_free(). Scans that were opened in it keep it.
#[allow(non_camel_case_types)]
pub struct srf_folder {
    _opaque: [u8; 0],
}

handle!(srf_folder, Folder);

/// A folder, with what its user was given of it.
pub struct Folder {
    folder: MemoryFolder,
    lent: Mutex<Lent>,
}

#[derive(Default)]
struct Lent {
    texts: BTreeMap<String, CString>,
    bytes: BTreeMap<String, Arc<Vec<u8>>>,
}

impl Folder {
    /// Works with what was lent.
    fn lent<R>(&self, work: impl FnOnce(&mut Lent) -> R) -> R {
        let _fork = fork::prevent();
        work(&mut self.lent.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Gives a text that stays as long as the folder.
    fn give_text(&self, name: &str, out: *mut *const c_char, text: &str) -> Result<(), Failure> {
        let kept = self.lent(|lent| lent.texts.entry(text.to_owned()).or_insert_with(|| c_text(text)).as_ptr());
        pointer::write(name, out, kept)
    }
}

/// Reads bytes of a file for srf_folder_put_source(). user: as given there. at: the place of the first byte. buffer: receives them. count:
/// the most that are wanted, at least 1. out_count: receives how many there are now, at least 1. No more is asked for than the file has.
/// Called on any thread, for one file never on two at once. Answer SRF_OK, or the status of what went wrong. The call that reads then ends
/// with SRF_ERR_IO, or SRF_ERR_OUT_OF_MEMORY for that, and says what srf_last_error_message() says on the thread of this function
/// (srf_set_last_error() says it). Must not unwind, nor leave by longjmp(). Must not call functions with handles of what is being read.
#[allow(non_camel_case_types)]
pub type srf_read_fn = Option<
    unsafe extern "C" fn(user: *mut c_void, at: u64, buffer: *mut c_void, count: usize, out_count: *mut usize) -> i32,
>;

/// Takes what is written into a folder. user: as given in srf_file_sink. name: of the file within the folder. bytes: the next ones, or NULL
/// if the file is complete. count: how many. Files of a set may take turns, and its list is complete last. A file whose call ended with an
/// error is not complete, and its bytes are to be discarded. Called on any thread, never on two at once. Answers are those of srf_read_fn,
/// as is what it must not do. Nor must it write into its own folder.
#[allow(non_camel_case_types)]
pub type srf_write_fn =
    Option<unsafe extern "C" fn(user: *mut c_void, name: *const c_char, bytes: *const c_void, count: usize) -> i32>;

/// Called once, on any thread, when nobody needs user any more.
#[allow(non_camel_case_types)]
pub type srf_release_fn = Option<unsafe extern "C" fn(user: *mut c_void)>;

/// Source of the bytes of a file.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct srf_file_source {
    /// Number of bytes. Must not change.
    pub length: u64,
    /// Reads them. Not NULL.
    pub read: srf_read_fn,
    /// NULL if there is nothing to release.
    pub release: srf_release_fn,
    /// Handed to both as it is.
    pub user: *mut c_void,
}

/// Receiver of the bytes of files.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct srf_file_sink {
    /// Takes them. Not NULL.
    pub write: srf_write_fn,
    /// NULL if there is nothing to release.
    pub release: srf_release_fn,
    /// Handed to both as it is.
    pub user: *mut c_void,
}

/// The caller's pointer, as a number that goes back to where it came from, on whatever thread. Released when it is dropped.
struct User {
    number: usize,
    release: srf_release_fn,
}

impl User {
    fn new(user: *mut c_void, release: srf_release_fn) -> Self {
        User { number: user.expose_provenance(), release }
    }

    fn pointer(&self) -> *mut c_void {
        std::ptr::with_exposed_provenance_mut(self.number)
    }
}

impl Drop for User {
    fn drop(&mut self) {
        if let Some(release) = self.release {
            pointer::call_release(release, self.pointer());
        }
    }
}

/// The caller's answer, as an error of reading or writing.
fn answered(answer: i32, text: &str) -> std::io::Result<()> {
    if answer == SRF_OK as i32 {
        return Ok(());
    }
    let why = if text.is_empty() { last_error::short_text(answer) } else { text };
    let kind = if answer == SRF_ERR_OUT_OF_MEMORY as i32 { ErrorKind::OutOfMemory } else { ErrorKind::Other };
    Err(std::io::Error::new(kind, why.to_owned()))
}

struct Bytes {
    length: u64,
    read: unsafe extern "C" fn(*mut c_void, u64, *mut c_void, usize, *mut usize) -> i32,
    user: User,
    turns: Turns,
}

impl Source for Bytes {
    fn length(&self) -> u64 {
        self.length
    }

    fn read_at(&self, at: u64, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.turns.take(|| {
            let mut count = 0;
            let user = self.user.pointer();
            let (answer, text) = status::said(|| pointer::call_read(self.read, user, at, buffer, &mut count));
            answered(answer, &text).map(|()| count)
        })
    }
}

struct Files {
    write: unsafe extern "C" fn(*mut c_void, *const c_char, *const c_void, usize) -> i32,
    user: User,
}

impl Files {
    fn hand(&self, name: &str, bytes: Option<&[u8]>) -> std::io::Result<()> {
        let name = c_text(name);
        let (answer, text) = status::said(|| pointer::call_write(self.write, self.user.pointer(), &name, bytes));
        answered(answer, &text)
    }
}

impl Sink for Files {
    fn piece(&mut self, name: &str, bytes: &[u8]) -> std::io::Result<()> {
        if bytes.is_empty() { Ok(()) } else { self.hand(name, Some(bytes)) }
    }

    fn complete(&mut self, name: &str) -> std::io::Result<()> {
        self.hand(name, None)
    }
}

/// Creates an empty folder.
/// sink        where what is written into it goes. NULL: the folder keeps it. On SRF_OK only, its user is released once the folder is freed
///             and nothing is being written into it
/// out_folder  receives a new handle on SRF_OK only. Not NULL
/// returns     SRF_OK, SRF_ERR_NULL also for a sink without write. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_folder_create(sink: *const srf_file_sink, out_folder: *mut *mut srf_folder) -> srf_status {
    guard(|| {
        pointer::writable("out_folder", out_folder)?;
        let folder = match pointer::read_struct(sink) {
            None => MemoryFolder::new(),
            Some(sink) => {
                let write = sink.write.ok_or_else(|| Failure::new(SRF_ERR_NULL, "sink.write must not be NULL"))?;
                MemoryFolder::to_sink(Files { write, user: User::new(sink.user, sink.release) })
            }
        };
        handle::give("out_folder", out_folder, Folder { folder, lent: Mutex::default() })
    })
}

/// Releases a folder, and its files once no scan needs them.
/// folder     NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_folder_free(folder: *mut srf_folder) -> srf_status {
    guard(|| handle::free("folder", folder))
}

/// The path of a file in a folder, whether it is there or not, for every function that takes a path.
/// folder     not NULL
/// name       of the file, UTF-8, with / between folders: "scan.ply", "depth/00001.png". NULL for the folder itself
/// out_path   receives a text that stays until the folder is freed, on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_INPUT for a name that is no file's within the folder, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_folder_path(
    folder: *const srf_folder,
    name: *const c_char,
    out_path: *mut *const c_char,
) -> srf_status {
    guard(|| {
        pointer::writable("out_path", out_path)?;
        let folder = handle::get("folder", folder)?;
        let path =
            if name.is_null() { folder.folder.root() } else { folder.folder.path(pointer::text("name", name)?)? };
        folder.give_text("out_path", out_path, &path.to_string_lossy())
    })
}

/// Puts a file into a folder, in place of one of that name. The bytes are copied.
/// folder     not NULL
/// name       of the file, as in srf_folder_path(). Not NULL
/// bytes      not NULL unless count is 0
/// count      number of bytes
/// returns    SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_folder_put(
    folder: *const srf_folder,
    name: *const c_char,
    bytes: *const c_void,
    count: usize,
) -> srf_status {
    guard(|| {
        let (folder, name) = (handle::get("folder", folder)?, pointer::text("name", name)?);
        let given = pointer::bytes("bytes", bytes.cast(), count)?;
        let mut kept = Vec::new();
        if kept.try_reserve_exact(count).is_err() {
            return Err(Failure::new(SRF_ERR_OUT_OF_MEMORY, format!("not enough memory: {name} takes {count} bytes")));
        }
        kept.extend_from_slice(given);
        folder.folder.put(name, kept)?;
        Ok(())
    })
}

/// Puts a file into a folder whose bytes are asked for when they are read, in place of one of that name.
/// folder     not NULL
/// name       of the file, as in srf_folder_path(). Not NULL
/// source     where its bytes come from. Its user is released once the file is replaced or removed or the folder has gone, and nobody reads
///            it. Not NULL
/// returns    SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL also for a source without read. On errors nothing is released. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_folder_put_source(
    folder: *const srf_folder,
    name: *const c_char,
    source: *const srf_file_source,
) -> srf_status {
    guard(|| {
        let (folder, name) = (handle::get("folder", folder)?, pointer::text("name", name)?);
        let Some(source) = pointer::read_struct(source) else {
            return Err(Failure::new(SRF_ERR_NULL, "source must not be NULL"));
        };
        let read = source.read.ok_or_else(|| Failure::new(SRF_ERR_NULL, "source.read must not be NULL"))?;
        // A wrong name must not release what stays the caller's.
        folder.folder.path(name)?;
        let user = User::new(source.user, source.release);
        folder
            .folder
            .put_source(name, Arc::new(Bytes { length: source.length, read, user, turns: Turns::default() }))?;
        Ok(())
    })
}

/// Takes a file out of a folder. Who reads it just then reads on.
/// folder       not NULL
/// name         of the file. Not NULL
/// out_removed  receives 1 if it was there, else 0. NULL if not wanted
/// returns      SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_INPUT. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_folder_remove(
    folder: *const srf_folder,
    name: *const c_char,
    out_removed: *mut u32,
) -> srf_status {
    guard(|| {
        let (folder, name) = (handle::get("folder", folder)?, pointer::text("name", name)?);
        let removed = folder.folder.remove(name);
        let lent = folder.lent(|lent| lent.bytes.remove(name));
        drop(lent);
        if out_removed.is_null() { Ok(()) } else { pointer::write("out_removed", out_removed, removed.into()) }
    })
}

/// Number of files in a folder, those in folders within it too.
/// folder     not NULL
/// out_count  not NULL
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_folder_count(folder: *const srf_folder, out_count: *mut usize) -> srf_status {
    guard(|| pointer::write("out_count", out_count, handle::get("folder", folder)?.folder.names().len()))
}

/// Name of a file in a folder, in the order of names.
/// folder     not NULL
/// index      less than the number of files
/// out_name   receives a text that stays until the folder is freed, on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_folder_name(
    folder: *const srf_folder,
    index: usize,
    out_name: *mut *const c_char,
) -> srf_status {
    guard(|| {
        pointer::writable("out_name", out_name)?;
        let folder = handle::get("folder", folder)?;
        let names = folder.folder.names();
        folder.give_text("out_name", out_name, crate::files::at(&names, index)?)
    })
}

/// The bytes that were written or put into a file.
/// folder     not NULL
/// name       of the file. Not NULL
/// out_bytes  receives where they are, until this function or srf_folder_remove() is called for the file again or the folder is freed,
///            whatever is written meanwhile. On SRF_OK only. Not NULL
/// out_count  receives how many. Not NULL
/// returns    SRF_OK, SRF_ERR_INPUT if there is no such file or its bytes lie behind a function, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_folder_bytes(
    folder: *const srf_folder,
    name: *const c_char,
    out_bytes: *mut *const c_void,
    out_count: *mut usize,
) -> srf_status {
    guard(|| {
        pointer::writable("out_bytes", out_bytes)?;
        pointer::writable("out_count", out_count)?;
        let (folder, name) = (handle::get("folder", folder)?, pointer::text("name", name)?);
        let Some(bytes) = folder.folder.bytes(name) else {
            return Err(Failure::new(
                SRF_ERR_INPUT,
                format!(
                    "{name}: this folder holds no bytes of such a file: put \
                them there, or write to it first"
                ),
            ));
        };
        pointer::write("out_count", out_count, bytes.len())?;
        pointer::write("out_bytes", out_bytes, bytes.as_ptr().cast())?;
        let former = folder.lent(|lent| lent.bytes.insert(name.to_owned(), bytes));
        drop(former);
        Ok(())
    })
}
