use std::collections::BTreeMap;
use std::io::Error as IoError;

use super::*;
use crate::export::faults::writers;
use crate::import;
use crate::import::faults_tests::{outcome_of, sets};
use base::progress::Progress;

/// Puts all files below a folder of the system into one in memory, under the names that they have there.
fn copied(folder: &Path, put: impl Fn(&MemoryFolder, &str, Vec<u8>)) -> MemoryFolder {
    let memory = MemoryFolder::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                put(&memory, &name_in(folder, &path), std::fs::read(&path).unwrap());
            }
        }
    }
    memory
}

fn name_in(folder: &Path, path: &Path) -> String {
    let parts = path.strip_prefix(folder).unwrap().components();
    parts.map(|part| part.as_os_str().to_str().unwrap()).collect::<Vec<_>>().join("/")
}

/// Gives few bytes at a time, fails from the `good`-th question on.
struct Few {
    bytes: Vec<u8>,
    good: AtomicU64,
}

impl Source for Few {
    fn length(&self) -> u64 {
        self.bytes.len() as u64
    }

    fn read_at(&self, at: u64, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.good.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |good| good.checked_sub(1)).is_err() {
            return Err(IoError::other("the line is dead"));
        }
        let most = buffer.len().min(61);
        self.bytes.read_at(at, &mut buffer[..most])
    }
}

/// Theorem: every format, list and recording is read from memory, and from functions, as from files.
#[test]
fn what_lies_in_memory_is_read_as_files_are() {
    let folder = tempfile::tempdir().unwrap();
    let sets = sets(folder.path());
    assert!(sets.len() > 30, "{} sets", sets.len());
    let memory = copied(folder.path(), |memory, name, bytes| drop(memory.put(name, bytes).unwrap()));
    let few = |good| {
        copied(folder.path(), move |memory, name, bytes| {
            memory.put_source(name, Arc::new(Few { bytes, good: AtomicU64::new(good) })).unwrap();
        })
    };
    let slow = few(u64::MAX);
    for paths in sets {
        let expected = outcome_of(&paths).unwrap();
        for memory in [&memory, &slow] {
            let there: Vec<PathBuf> = paths.iter().map(|p| memory.path(&name_in(folder.path(), p)).unwrap()).collect();
            assert_eq!(outcome_of(&there).unwrap(), expected, "{}", paths[0].display());
        }
        for good in [0, 1, 2, 5] {
            let dead = few(good);
            let there: Vec<PathBuf> = paths.iter().map(|p| dead.path(&name_in(folder.path(), p)).unwrap()).collect();
            match outcome_of(&there) {
                Err(Error::Io { path, source }) => {
                    assert!(path.starts_with(dead.root()) && source.to_string() == "the line is dead", "{source}");
                }
                Err(other) => panic!("{}, {good} reads: {other:?}", paths[0].display()),
                Ok(text) => assert!(good > 2 && text == expected, "{}, {good} reads", paths[0].display()),
            }
        }
    }
}

/// Theorem: a folder in memory opens as a folder does.
#[test]
fn a_folder_in_memory_opens_as_a_set() {
    let folder = tempfile::tempdir().unwrap();
    sets(folder.path());
    for name in ["lists/posed", "lists/depth"] {
        let real = folder.path().join(name);
        let memory = copied(&real, |memory, name, bytes| drop(memory.put(name, bytes).unwrap()));
        assert_eq!(outcome_of(&[memory.root()]).unwrap(), outcome_of(&[real]).unwrap(), "{name}");
    }
}

/// Theorem: every format is written into memory, and to a sink, with the bytes that files have. A sink that fails at any call ends the
/// writer with its own error, and no file is complete.
#[test]
fn what_is_written_to_memory_is_what_files_hold() {
    for (name, write) in writers() {
        let folder = tempfile::tempdir().unwrap();
        write(&folder.path().join(name), &Progress::none()).unwrap();
        let files: BTreeMap<String, Vec<u8>> = std::fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap())
            .map(|e| (e.file_name().into_string().unwrap(), std::fs::read(e.path()).unwrap()))
            .collect();
        let memory = MemoryFolder::new();
        write(&memory.path(name).unwrap(), &Progress::none()).unwrap();
        assert_eq!(memory.names(), files.keys().cloned().collect::<Vec<_>>(), "{name}");
        assert!(files.iter().all(|(name, bytes)| memory.bytes(name).unwrap().as_slice() == bytes), "{name}");

        let cancelled = MemoryFolder::new();
        assert!(matches!(write(&cancelled.path(name).unwrap(), &Progress::cancel_after(0)), Err(Error::Cancelled)));
        assert!(cancelled.names().is_empty(), "{name}");

        for good in 0.. {
            let taken = Arc::new(Mutex::new(Taken { good, ..Taken::default() }));
            let sink = MemoryFolder::to_sink(Taking(taken.clone()));
            let outcome = write(&sink.path(name).unwrap(), &Progress::none());
            assert!(sink.names().is_empty());
            let taken = taken.lock().unwrap();
            match outcome {
                Err(Error::Io { path, source }) => {
                    assert!(path.starts_with(sink.root()) && source.to_string() == "full", "{name}: {path:?} {source}");
                    // The list of a set is what makes it one.
                    assert!(!taken.complete.iter().any(|done| done == name), "{name}: {good} calls");
                }
                Err(other) => panic!("{name}: {good} calls: {other:?}"),
                Ok(()) => {
                    assert_eq!(taken.files, files, "{name}");
                    assert_eq!(taken.complete.len(), files.len(), "{name}");
                    assert!(good > 1, "{name}");
                    break;
                }
            }
        }
    }
}

#[derive(Default)]
struct Taken {
    good: u64,
    has_refused: bool,
    files: BTreeMap<String, Vec<u8>>,
    complete: Vec<String>,
}

struct Taking(Arc<Mutex<Taken>>);

impl Taking {
    fn count(&self) -> std::io::Result<MutexGuard<'_, Taken>> {
        let mut taken = self.0.lock().unwrap();
        assert!(!taken.has_refused, "called again after it failed");
        taken.has_refused = taken.good == 0;
        taken.good = taken.good.checked_sub(1).ok_or_else(|| IoError::other("full"))?;
        Ok(taken)
    }
}

impl Sink for Taking {
    fn piece(&mut self, name: &str, bytes: &[u8]) -> std::io::Result<()> {
        let mut taken = self.count()?;
        assert!(!taken.complete.iter().any(|done| done == name), "more of {name}, which was complete");
        taken.files.entry(name.to_owned()).or_default().extend(bytes);
        Ok(())
    }

    fn complete(&mut self, name: &str) -> std::io::Result<()> {
        self.count()?.complete.push(name.to_owned());
        Ok(())
    }
}

const POINT: &[u8] = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n";

#[test]
fn a_scan_keeps_its_folder_and_what_it_opened() {
    let folder = MemoryFolder::new();
    let path = folder.put("a.ply", POINT.to_vec()).unwrap();
    let set = import::open(&path).unwrap();
    drop(folder);
    assert!(set.scans[0].read().is_ok());
    drop(set);
    let words = ": this folder in memory has gone: keep it as long as its paths are used";
    let mesh = mesh::shapes::Shape::Sphere { radius: 1.0 }.mesh(4);
    for error in [import::open(&path).map(drop), crate::export::write_stl(&path, &mesh, 1.0, &Progress::none())] {
        assert!(matches!(&error, Err(e @ Error::Io { .. }) if e.to_string().ends_with(words)), "{error:?}");
    }
    assert!(folders().values().all(|weak| weak.strong_count() > 0));

    let folder = MemoryFolder::new();
    let path = folder.put("a.ply", POINT.to_vec()).unwrap();
    let mut open = place_of(&path).unwrap().open().unwrap();
    assert!(folder.remove("a.ply") && !folder.remove("a.ply"));
    let mut bytes = Vec::new();
    open.read_to_end(&mut bytes).unwrap();
    assert_eq!(bytes, POINT);
    let text = import::open(&path).unwrap_err().to_string();
    assert!(text.contains("a.ply: there is no such file in this folder in memory"), "{text}");
}

#[test]
fn names_are_those_of_files_within() {
    let folder = MemoryFolder::new();
    for name in ["", ".", "..", "/a", "a/", "a//b", "a/../b", "./a", "a\\b", "a\0", "C:\\x"] {
        let text = folder.put(name, Vec::new()).unwrap_err().to_string();
        assert!(text.contains("is called like one on a disk"), "{name:?}: {text}");
    }
    for name in ["a", "a b.ply", "ä/ö.ply", "..a", "memory:"] {
        assert!(place_of(&folder.put(name, Vec::new()).unwrap()).unwrap().is_file(), "{name}");
    }
    let root = folder.root();
    assert!(place_of(&root).unwrap().is_dir() && place_of(&root.join("ä")).unwrap().is_dir());
    assert_eq!(place_of(&root).unwrap().children(), ["..a", "a", "a b.ply", "memory:", "ä"].map(String::from).into());
    for path in ["memory:", "memory:/", "memory:/x", "memory:/99999999999/a", "a/memory:/1", "/memory:/1", "memory/1"] {
        assert!(place_of(Path::new(path)).is_none(), "{path}");
    }
    let outside = root.join("..").join(folder.0.number.to_string());
    assert!(place_of(&outside).is_none());
    let text = import::open(&outside).unwrap_err().to_string();
    assert!(text.ends_with("this path leads out of its folder in memory"), "{text}");
    assert!(place_of(&root.join("ä/../a")).unwrap().is_file());
    // A name is a file's or a folder's.
    for (name, words) in
        [("ä", "this is a folder: give the name"), ("a/b", "a is a file, but"), ("a/b/c", "a is a file, but")]
    {
        let text = folder.put(name, Vec::new()).unwrap_err().to_string();
        assert!(text.contains(words), "{text}");
        let mesh = mesh::shapes::Shape::Sphere { radius: 1.0 }.mesh(4);
        let text = crate::export::write_stl(&folder.path(name).unwrap(), &mesh, 1.0, &Progress::none())
            .unwrap_err()
            .to_string();
        assert!(text.contains(words), "{text}");
    }
    let text = import::open(&root.join("ä")).map(drop).unwrap_err().to_string();
    assert!(text.contains("ä"), "{text}");
}

/// A holder that lets go of a source may look into its folder.
#[test]
fn sources_are_let_go_of_without_the_lock() {
    struct Looks(MemoryFolder, Arc<AtomicU64>);
    impl Source for Looks {
        fn length(&self) -> u64 {
            0
        }

        fn read_at(&self, _: u64, _: &mut [u8]) -> std::io::Result<usize> {
            Ok(0)
        }
    }
    impl Drop for Looks {
        fn drop(&mut self) {
            self.1.fetch_add(self.0.names().len() as u64 + 1, Ordering::Relaxed);
        }
    }
    let (folder, seen) = (MemoryFolder::new(), Arc::new(AtomicU64::new(0)));
    let put = || drop(folder.put_source("a.stl", Arc::new(Looks(folder.clone(), seen.clone()))).unwrap());
    put();
    assert!(folder.remove("a.stl"));
    put();
    folder.put("a.stl", Vec::new()).unwrap();
    put();
    let mesh = mesh::shapes::Shape::Sphere { radius: 1.0 }.mesh(4);
    crate::export::write_stl(&folder.path("a.stl").unwrap(), &mesh, 1.0, &Progress::none()).unwrap();
    assert_eq!(seen.load(Ordering::Relaxed), 1 + 2 + 2);
}

/// A path that options allow leads out of folders within, not out of the memory.
#[test]
fn files_above_a_list_are_found_where_that_is_allowed() {
    let folder = MemoryFolder::new();
    folder.put("a.ply", POINT.to_vec()).unwrap();
    let list = folder.put("deep/s.conf", b"bmesh ../a.ply 0 0 0 0 0 0 1\n".to_vec()).unwrap();
    assert!(import::open(&list).is_err());
    let options = import::ReadOptions { allow_outside: true, ..Default::default() };
    let set = import::open_with(&[&list], &options, &Progress::none()).unwrap();
    assert!(set.scans[0].read().is_ok());
}

/// Theorem: a list names files of its own folder alone, wherever the two lie.
#[test]
fn lists_lead_neither_out_of_memory_nor_into_it() {
    let (folder, other) = (MemoryFolder::new(), MemoryFolder::new());
    let secret = other.put("secret.ply", POINT.to_vec()).unwrap();
    let real = tempfile::tempdir().unwrap();
    std::fs::write(real.path().join("secret.ply"), POINT).unwrap();
    for name in [secret.to_str().unwrap(), "../secret.ply", real.path().join("secret.ply").to_str().unwrap()] {
        let text = format!("bmesh {name} 0 0 0 0 0 0 1\n");
        let path = folder.put("s.conf", text.clone().into_bytes()).unwrap();
        let refused = import::open(&path).unwrap_err().to_string();
        assert!(refused.contains("leads out of the folder"), "{refused}");
        std::fs::write(real.path().join("s.conf"), text).unwrap();
        let refused = import::open(&real.path().join("s.conf")).unwrap_err().to_string();
        assert!(refused.contains("leads out of the folder"), "{refused}");
    }
}

#[test]
fn sources_that_lie_are_told() {
    struct Liar(usize);
    impl Source for Liar {
        fn length(&self) -> u64 {
            1 << 40
        }

        fn read_at(&self, _: u64, buffer: &mut [u8]) -> std::io::Result<usize> {
            Ok(if self.0 == 0 { 0 } else { buffer.len() + self.0 })
        }
    }
    for lie in [0, 1, usize::MAX / 2] {
        let folder = MemoryFolder::new();
        let path = folder.put_source("a.ply", Arc::new(Liar(lie))).unwrap();
        assert!(matches!(import::open(&path), Err(Error::Io { .. })), "{lie}");
    }
}

/// Damaged files do in memory what they do in fuzzing.
#[test]
fn damaged_files_in_memory_are_refused_as_on_disks() {
    let disk = tempfile::tempdir().unwrap();
    let folder = MemoryFolder::new();
    for (cut, end) in [(0, 0), (3, 3), (40, 40), (110, 110), (0, POINT.len() - 3)] {
        let bytes = [&POINT[..cut.min(POINT.len())], &POINT[cut.max(end).min(POINT.len())..]].concat();
        let bytes = if cut == 0 { POINT[..end].to_vec() } else { bytes };
        let name = "scan.ply";
        std::fs::write(disk.path().join(name), &bytes).unwrap();
        let path = folder.put(name, bytes).unwrap();
        let words = |path: &Path, root: &Path| {
            let outcome = outcome_of(&[path.to_owned()]);
            outcome.map_err(|error| {
                error.to_string().replace(&format!("{}{}", root.display(), std::path::MAIN_SEPARATOR), "")
            })
        };
        assert_eq!(words(&path, &folder.root()), words(&disk.path().join(name), disk.path()));
    }
}
