//! Folders in memory: files that never see a disk.

use std::collections::BTreeMap;
use std::sync::Mutex;

use super::*;

fn folder(sink: Option<&FileSink>) -> Handle {
    let mut folder = Handle::NULL;
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_folder_create)(sink.map_or(std::ptr::null(), std::ptr::from_ref), &mut folder) });
    folder
}

fn path(folder: Handle, name: &CStr) -> *const c_char {
    let mut path = std::ptr::null();
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_folder_path)(folder, name.as_ptr(), &mut path) });
    path
}

fn held(folder: Handle, name: &CStr) -> Vec<u8> {
    let (mut bytes, mut count) = (std::ptr::null(), 0);
    // SAFETY: as the header wants it; they are there until they are asked for again.
    unsafe {
        api().ok((api().srf_folder_bytes)(folder, name.as_ptr(), &mut bytes, &mut count));
        std::slice::from_raw_parts(bytes.cast::<u8>(), count).to_vec()
    }
}

fn opened(path: *const c_char) -> Handle {
    let mut scans = Handle::NULL;
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_scans_open)([path].as_ptr(), 1, std::ptr::null(), std::ptr::null(), &mut scans) });
    scans
}

/// Reads the mesh of a set of one. The status and the mesh.
fn read(scans: Handle) -> (i32, Handle) {
    let (mut content, mut image, mut mesh, mut cloud) = (0, Handle::NULL, Handle::NULL, Handle::NULL);
    // SAFETY: as the header wants it.
    let status =
        unsafe { (api().srf_scans_read)(scans, 0, std::ptr::null(), &mut content, &mut image, &mut mesh, &mut cloud) };
    (status, mesh)
}

/// A file that is written, copied and read, and what is listed of it. The scans keep what they were opened in.
#[test]
pub(super) fn what_is_written_to_memory_comes_back() {
    let api = api();
    let (mesh, first, second) = (octahedron(), folder(None), folder(None));
    let disk = tempfile::tempdir().unwrap();
    let real = CString::new(disk.path().join("mesh.glb").to_str().unwrap()).unwrap();
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        for place in [path(first, c"deep/mesh.glb"), real.as_ptr()] {
            api.ok((api.srf_mesh_write)(mesh, place, std::ptr::null(), std::ptr::null()));
        }
        let file = held(first, c"deep/mesh.glb");
        assert!(file == std::fs::read(disk.path().join("mesh.glb")).unwrap() && file.len() > 100);
        let (mut count, mut name) = (0, std::ptr::null());
        api.ok((api.srf_folder_count)(first, &mut count));
        api.ok((api.srf_folder_name)(first, 0, &mut name));
        assert_eq!((count, text(name).as_str()), (1, "deep/mesh.glb"));
        api.refused((api.srf_folder_name)(first, 1, &mut name), PARAMETER, "index must be < 1, got 1");

        let ply = path(second, c"mesh.ply");
        api.ok((api.srf_mesh_write_ply)(mesh, ply, 2, std::ptr::null()));
        let file = held(second, c"mesh.ply");
        api.ok((api.srf_folder_put)(second, c"copy.ply".as_ptr(), file.as_ptr().cast(), file.len()));
        let scans = opened(path(second, c"copy.ply"));
        let mut removed = 7;
        api.ok((api.srf_folder_remove)(second, c"mesh.ply".as_ptr(), &mut removed));
        assert_eq!(removed, 1);
        api.ok((api.srf_folder_remove)(second, c"mesh.ply".as_ptr(), &mut removed));
        assert_eq!(removed, 0);
        let (mut there, mut size) = (std::ptr::null(), 0);
        let gone = (api.srf_folder_bytes)(second, c"mesh.ply".as_ptr(), &mut there, &mut size);
        api.refused(gone, INPUT, "mesh.ply: this folder holds no bytes of such a file");
        api.ok((api.srf_folder_free)(second));
        let (status, back) = read(scans);
        api.ok(status);
        assert!(bytes(back) == bytes(mesh));
        for end in [(api.srf_mesh_free)(back), (api.srf_mesh_free)(mesh), (api.srf_scans_free)(scans)] {
            api.ok(end);
        }
        for wrong in [c"", c"../a", c"/a", c"a/", c"a\\b"] {
            let put = (api.srf_folder_put)(first, wrong.as_ptr(), std::ptr::null(), 0);
            api.refused(put, INPUT, "a file in memory is called like one on a disk");
        }
        api.refused((api.srf_folder_put)(first, c"a".as_ptr(), std::ptr::null(), 3), NULL, "bytes must not be NULL");
        api.ok((api.srf_folder_free)(first));
        api.refused((api.srf_folder_count)(first, &mut count), HANDLE, "folder is not a handle");
    }
}

/// A set of images as a list and its grids, which opens as what it was.
#[test]
pub(super) fn lists_lie_in_memory_with_their_scans() {
    let api = api();
    let (mesh, memory) = (octahedron(), folder(None));
    let image = scan(mesh);
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_image_set_name)(image, c"front".as_ptr()));
        let list = path(memory, c"set.conf");
        api.ok((api.srf_images_write_conf)([image].as_ptr().cast(), 1, list, 2, std::ptr::null()));
        let mut count = 0;
        api.ok((api.srf_folder_count)(memory, &mut count));
        assert_eq!(count, 2);
        // The folder stands for its only list.
        let mut root = std::ptr::null();
        api.ok((api.srf_folder_path)(memory, std::ptr::null(), &mut root));
        for place in [list, root] {
            let scans = opened(place);
            let mut name = std::ptr::null();
            api.ok((api.srf_scans_describe)(scans, 0, &mut name, std::ptr::null_mut()));
            assert_eq!(text(name), "front");
            api.ok((api.srf_scans_free)(scans));
        }
        for end in [(api.srf_image_free)(image), (api.srf_mesh_free)(mesh), (api.srf_folder_free)(memory)] {
            api.ok(end);
        }
    }
}

/// Files behind functions that fail from one of their calls on.
#[derive(Default)]
struct Behind {
    good: usize,
    has_refused: bool,
    status: i32,
    text: Option<&'static CStr>,
    bytes: Vec<u8>,
    taken: BTreeMap<String, Vec<u8>>,
    complete: Vec<String>,
    released: usize,
}

impl Behind {
    fn refuses(&mut self) -> bool {
        assert!(!self.has_refused || !self.bytes.is_empty(), "a sink is called again after it failed");
        let refuses = self.good == 0;
        self.has_refused = refuses;
        self.good = self.good.saturating_sub(1);
        if refuses && let Some(text) = self.text {
            // SAFETY: as the header wants it.
            api().ok(unsafe { (api().srf_set_last_error)(text.as_ptr()) });
        }
        refuses
    }
}

/// The file behind the pointer that the library hands back.
fn behind<'a>(user: *mut c_void) -> std::sync::MutexGuard<'a, Behind> {
    // SAFETY: the one handed in, which outlives the folder; never two at once, or this would wait for ever.
    unsafe { &*user.cast::<Mutex<Behind>>() }.try_lock().expect("never on two threads at once")
}

unsafe extern "C" fn read_some(user: *mut c_void, at: u64, buffer: *mut c_void, count: usize, out: *mut usize) -> i32 {
    let mut file = behind(user);
    if file.refuses() {
        return file.status;
    }
    let from = &file.bytes[at as usize..];
    let some = count.min(from.len()).min(700);
    assert!(some > 0, "no more is asked for than there is");
    // SAFETY: room for as many; the number of them has room too.
    unsafe {
        std::ptr::copy_nonoverlapping(from.as_ptr(), buffer.cast(), some);
        *out = some;
    }
    OK
}

unsafe extern "C" fn take_some(user: *mut c_void, name: *const c_char, bytes: *const c_void, count: usize) -> i32 {
    let mut file = behind(user);
    if file.refuses() {
        return file.status;
    }
    let name = text(name);
    if bytes.is_null() {
        file.complete.push(name);
    } else {
        // SAFETY: as many bytes as are named.
        let piece = unsafe { std::slice::from_raw_parts(bytes.cast::<u8>(), count) };
        file.taken.entry(name).or_default().extend(piece);
    }
    OK
}

unsafe extern "C" fn release(user: *mut c_void) {
    behind(user).released += 1;
}

/// Theorem: whichever call of a function fails, reading and writing end with its status and words, nothing is complete, and what it was
/// handed is released once.
#[test]
pub(super) fn functions_that_fail_at_any_call_are_heard() {
    let api = api();
    let (mesh, memory) = (octahedron(), folder(None));
    // SAFETY: as the header wants it.
    unsafe {
        let ply = path(memory, c"mesh.ply");
        api.ok((api.srf_mesh_write_ply)(mesh, ply, 3, std::ptr::null()));
        let whole = held(memory, c"mesh.ply");
        let answers = [(3, Some(c"the line is dead"), IO, "the line is dead"), (5, None, 5, "not enough memory")];
        for (status, said, expected, words) in answers {
            for good in 0.. {
                let file = Behind { good, status, text: said, bytes: whole.clone(), ..Behind::default() };
                let file = Mutex::new(file);
                let user = std::ptr::from_ref(&file).cast_mut().cast();
                let source =
                    FileSource { length: whole.len() as u64, read: Some(read_some), release: Some(release), user };
                let lazy = folder(None);
                api.ok((api.srf_folder_put_source)(lazy, c"mesh.ply".as_ptr(), &source));
                let mut scans = Handle::NULL;
                let there = path(lazy, c"mesh.ply");
                let opened = (api.srf_scans_open)([there].as_ptr(), 1, std::ptr::null(), std::ptr::null(), &mut scans);
                let (outcome, read) = if opened == OK { read(scans) } else { (opened, Handle::NULL) };
                if outcome != OK {
                    api.refused(outcome, expected, words);
                } else {
                    assert!(bytes(read) == bytes(mesh) && good > 3);
                }
                api.ok((api.srf_mesh_free)(read));
                api.ok((api.srf_folder_free)(lazy));
                // Scans keep their folder.
                let kept = usize::from(scans == Handle::NULL);
                assert_eq!(file.lock().unwrap().released, kept);
                api.ok((api.srf_scans_free)(scans));
                assert_eq!(file.lock().unwrap().released, 1);
                if outcome == OK {
                    break;
                }
            }
            for name in [c"mesh.ply", c"mesh.glb", c"mesh.obj", c"mesh.stl"] {
                let known = name.to_str().unwrap();
                for good in 0.. {
                    let file = Mutex::new(Behind { good, status, text: said, ..Behind::default() });
                    let user = std::ptr::from_ref(&file).cast_mut().cast();
                    let sink = folder(Some(&FileSink { write: Some(take_some), release: Some(release), user }));
                    let outcome = match known {
                        "mesh.ply" => (api.srf_mesh_write_ply)(mesh, path(sink, name), 3, std::ptr::null()),
                        _ => (api.srf_mesh_write)(mesh, path(sink, name), std::ptr::null(), std::ptr::null()),
                    };
                    api.ok((api.srf_folder_free)(sink));
                    let file = file.lock().unwrap();
                    assert_eq!(file.released, 1);
                    if outcome == OK {
                        assert!(known != "mesh.ply" || file.taken[known] == whole);
                        assert!(file.complete == [known] && good > 1);
                        break;
                    }
                    assert!(file.complete.is_empty());
                    api.refused(outcome, expected, words);
                }
            }
        }
        let nothing = FileSource { length: 3, read: None, release: Some(release), user: std::ptr::null_mut() };
        let put = api.srf_folder_put_source;
        api.refused(put(memory, c"a".as_ptr(), &nothing), NULL, "source.read must not be NULL");
        api.refused(put(memory, c"a".as_ptr(), std::ptr::null()), NULL, "source must not be NULL");
        // On errors nothing is released: the user is none that could be.
        let source = FileSource { read: Some(read_some), ..nothing };
        api.refused(put(memory, c"../a".as_ptr(), &source), INPUT, "called like one on a disk");
        let mut made = Handle::NULL;
        let no_sink = FileSink { write: None, release: Some(release), user: std::ptr::null_mut() };
        api.refused((api.srf_folder_create)(&no_sink, &mut made), NULL, "sink.write must not be NULL");
        assert_eq!(made, Handle::NULL);
        api.ok((api.srf_mesh_free)(mesh));
        api.ok((api.srf_folder_free)(memory));
    }
}

/// Folders of their own on eight threads, and one that all share.
#[test]
pub(super) fn eight_threads_write_and_read() {
    let (mesh, shared) = (octahedron(), folder(None));
    let expected = bytes(mesh);
    std::thread::scope(|scope| {
        for number in 0..8 {
            let expected = &expected;
            scope.spawn(move || {
                let api = api();
                let name = CString::new(format!("{number}.ply")).unwrap();
                for _ in 0..20 {
                    let own = folder(None);
                    for memory in [own, shared] {
                        // SAFETY: as the header wants it.
                        unsafe {
                            api.ok((api.srf_mesh_write_ply)(mesh, path(memory, &name), 2, std::ptr::null()));
                            let scans = opened(path(memory, &name));
                            let (status, back) = read(scans);
                            api.ok(status);
                            assert!(bytes(back) == *expected);
                            api.ok((api.srf_mesh_free)(back));
                            api.ok((api.srf_scans_free)(scans));
                        }
                    }
                    // SAFETY: as the header wants it.
                    api.ok(unsafe { (api.srf_folder_free)(own) });
                }
            });
        }
    });
    // SAFETY: as the header wants it.
    unsafe {
        api().ok((api().srf_mesh_free)(mesh));
        api().ok((api().srf_folder_free)(shared));
    }
}
