//! Memory that reading takes, counted by an allocator of its own: one test, so that nothing else allocates meanwhile.
#![allow(unsafe_code, clippy::unwrap_used)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use surfrecon::export::{GlbOptions, PlyEncoding, Up, write_3mf, write_ply, write_range_grid_ply};
use surfrecon::import::{Content, FileScan, ReadOptions, open_with};
use surfrecon::range_image::Viewing;
use surfrecon::{Progress, RangeImage, TriMesh};

struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is handed on to the system's allocator unchanged; only numbers are kept beside it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        PEAK.fetch_max(NOW.fetch_add(layout.size(), Relaxed) + layout.size(), Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller keeps the contract of `dealloc`, and `alloc` got the pointer from the system.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Most bytes allocated at once during a call, beyond those before it.
fn peak<R>(call: impl FnOnce() -> R) -> (usize, R) {
    let before = NOW.load(Relaxed);
    PEAK.store(before, Relaxed);
    let result = call();
    (PEAK.load(Relaxed) - before, result)
}

const MIB: usize = 1 << 20;

#[test]
fn memory_follows_the_file_and_the_result() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.ply");
    hostile(&path);
    bomb(&folder.path().join("bomb.3mf"));
    claims(folder.path());
    reading(&path);
    writing(&path);
}

/// Theorem: what a header claims costs nothing. Only bytes that are there do.
fn hostile(path: &Path) {
    let scan = FileScan::new(path);
    let header = |format: &str, counts: [&str; 2], lists: &str| {
        format!(
            "ply\nformat {format} 1.0\nobj_info num_cols 1000000\nobj_info num_rows 1000000\nelement vertex {}\n\
            property float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n\
            property uchar blue\nproperty float confidence\nproperty float intensity\nelement {} {}\n\
            property list {lists} vertex_indices\nend_header\n",
            counts[0],
            if lists == "int int" { "tristrips" } else { "range_grid" },
            counts[1],
        )
    };
    let claims = ["1000000000000", "4294967295", "18446744073709551615"];
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for claim in claims {
            for counts in [[claim, "1000000000000"], ["0", claim], ["1", "1000000000000"]] {
                let text = header(format, counts, "uchar int") + "0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n";
                std::fs::write(path, text).unwrap();
                let (bytes, outcome) = peak(|| (scan.read().is_err(), scan.preview_points(1000).is_err()));
                assert!(outcome.0, "{format} {counts:?} was read");
                assert!(bytes < MIB, "{format} {counts:?}: {bytes} bytes");
            }
        }
        // Zeros: as many cells as bytes, the most that a byte can become.
        let mut body =
            header(format, ["0", "1000000"], "uchar int").replace("num_cols 1000000", "num_cols 1").into_bytes();
        body.resize(body.len() + 1_000_000, 0);
        std::fs::write(path, &body).unwrap();
        let (bytes, _) = peak(|| scan.read());
        assert!(bytes < 32 * body.len() + MIB, "{format}: {bytes} bytes");
        // A strip that claims two thousand million entries.
        let mut body = header(format, ["0", "1"], "int int").into_bytes();
        body.extend_from_slice(if format == "ascii" { b"2000000000 0 1 2\n" } else { &[0x77; 17] });
        std::fs::write(path, &body).unwrap();
        let (bytes, outcome) = peak(|| scan.read());
        assert!(outcome.is_err() && bytes < MIB, "{format}: {bytes} bytes");
    }
    // A header of a hundred thousand lines without an end.
    let text = "ply\nformat ascii 1.0\nelement vertex 1\n".to_owned() + &"property float x\n".repeat(100_000);
    std::fs::write(path, &text).unwrap();
    let (bytes, outcome) = peak(|| scan.read());
    assert!(outcome.is_err() && bytes < 8 * text.len(), "{bytes} bytes for a header of {}", text.len());
}

/// Theorem: half a gigabyte of zeros in half a megabyte takes no memory of that size.
fn bomb(path: &Path) {
    let mut zip = zip::ZipWriter::new(std::fs::File::create(path).unwrap());
    let options = zip::write::SimpleFileOptions::default();
    zip.start_file("_rels/.rels", options).unwrap();
    let relation = "<Relationships><Relationship Target=\"/a.model\" Id=\"0\" Type=\"a/3dmodel\"/></Relationships>";
    zip.write_all(relation.as_bytes()).unwrap();
    zip.start_file("a.model", options).unwrap();
    let zeros = vec![b'0'; MIB];
    (0..512).for_each(|_| zip.write_all(&zeros).unwrap());
    zip.finish().unwrap();
    assert!(std::fs::metadata(path).unwrap().len() < MIB as u64);
    let (bytes, outcome) = peak(|| FileScan::new(path).read().map(drop));
    let error = outcome.unwrap_err().to_string();
    assert!(error.contains("a tag or a text is longer than 16 MiB") && bytes < 64 * MIB, "{bytes} bytes: {error}");
}

/// Theorem: in no format do numbers that are too large, wherever they stand, make reading take more than 64 MiB and sixteen
/// times the file's bytes, as long as what may be unpacked is limited to less.
fn claims(folder: &Path) {
    let options = ReadOptions { max_decoded_gib: 0.02, ..ReadOptions::default() };
    let mut files = 0;
    for kind in ["import_scan", "import_ply", "import_points"] {
        let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(kind);
        for seed in std::fs::read_dir(seeds).unwrap() {
            let seed = seed.unwrap().path();
            let bytes = std::fs::read(&seed).unwrap();
            let path = folder.join(seed.file_name().unwrap());
            let read = |bytes: &[u8]| {
                std::fs::write(&path, bytes).unwrap();
                let (took, _) = peak(|| {
                    let set = open_with(&[&path], &options, &Progress::none())?;
                    set.scans.iter().try_for_each(|scan| scan.read().map(drop))
                });
                assert!(took < 64 * MIB + 16 * bytes.len(), "{}: {took} bytes", path.display());
            };
            read(&bytes);
            let step = 1 + bytes.len() / 100;
            for at in (0..bytes.len().saturating_sub(8)).step_by(step) {
                for claim in
                    [&[0xFF; 4][..], &[0xFF, 0xFF, 0xFF, 0x7F], &[0x7F, 0xFF, 0xFF, 0xFF], &[0xFF; 8], &[0, 0, 0, 0x10]]
                {
                    let mut damaged = bytes.clone();
                    damaged[at..at + claim.len()].copy_from_slice(claim);
                    read(&damaged);
                }
                // In text, numbers grow.
                if bytes[at].is_ascii_digit() {
                    for digits in [&b"99999999"[..], b"4294967295", b"18446744073709551615"] {
                        read(&[&bytes[..at], digits, &bytes[at..]].concat());
                    }
                }
            }
            std::fs::remove_file(&path).unwrap();
            files += 1;
        }
    }
    assert!(files > 25, "{files} seeds");
}

/// Theorem: reading takes the result, one list of vertices for a grid, and a fixed amount.
fn reading(path: &Path) {
    let scan = FileScan::new(path);
    let (rows, cols) = (800, 1000);
    let points = (0..rows * cols).map(|i| if i % 3 == 0 { [i as f32, 0.5, -1.5] } else { [f32::NAN; 3] });
    let image = RangeImage::from_points(rows, cols, points.collect(), Viewing::ALONG_MINUS_Z).unwrap();
    let side = 600;
    let positions = (0..side * side).map(|i| glam::DVec3::new((i % side).into(), (i / side).into(), 0.5)).collect();
    let corner = |i: u32| [[i, i + 1, i + side], [i + 1, i + side + 1, i + side]];
    let mesh = TriMesh::new(positions, (0..side * (side - 1) - 1).flat_map(corner).collect());
    for encoding in [PlyEncoding::Ascii, PlyEncoding::BinaryLittleEndian, PlyEncoding::BinaryBigEndian] {
        write_range_grid_ply(path, &image, encoding, &Progress::none()).unwrap();
        let (bytes, read) = peak(|| scan.read());
        assert!(matches!(read.unwrap(), Content::RangeImage(read) if read.valid_count() == image.valid_count()));
        let needed = rows * cols * 12 + image.valid_count() * 12;
        assert!(bytes < needed + MIB, "{encoding:?}: {bytes} bytes, needed {needed}");
        write_ply(path, &mesh, encoding, &Progress::none()).unwrap();
        let (bytes, read) = peak(|| scan.read());
        assert!(matches!(read.unwrap(), Content::Mesh(read) if read == mesh));
        let needed = mesh.positions.len() * 24 + mesh.triangles.len() * 12;
        assert!(bytes < needed + MIB, "{encoding:?}: {bytes} bytes, needed {needed}");
        let (bytes, _) = peak(|| scan.preview_points(1000).unwrap());
        assert!(bytes < MIB / 4, "{encoding:?}: a preview took {bytes} bytes");
    }
    // The objects, whose lists grow, and the result. The text, of about 35 bytes a triangle, is not kept.
    let path = path.with_extension("3mf");
    let options = GlbOptions { up: Up::Z, ..GlbOptions::default() };
    write_3mf(&path, "mesh", &mesh, &options, &Progress::none()).unwrap();
    let (bytes, read) = peak(|| FileScan::new(&path).read());
    assert!(matches!(read.unwrap(), Content::Mesh(read) if read == mesh));
    let needed = mesh.positions.len() * 24 + mesh.triangles.len() * 12;
    assert!(bytes < 3 * needed + MIB, "3MF: {bytes} bytes, needed {needed}");
}

/// Theorem: writing takes a fixed amount.
fn writing(path: &Path) {
    let mesh = TriMesh::new(vec![glam::DVec3::ONE; 500_000], vec![[0, 1, 2]; 1_000_000]);
    for encoding in [PlyEncoding::Ascii, PlyEncoding::BinaryLittleEndian, PlyEncoding::BinaryBigEndian] {
        let (bytes, outcome) = peak(|| write_ply(path, &mesh, encoding, &Progress::none()));
        assert!(outcome.is_ok() && bytes < 2 * MIB, "{encoding:?}: {bytes} bytes");
    }
    let (bytes, outcome) = peak(|| write_3mf(path, "mesh", &mesh, &GlbOptions::default(), &Progress::none()));
    assert!(outcome.is_ok() && bytes < 2 * MIB, "3MF: {bytes} bytes");
}
