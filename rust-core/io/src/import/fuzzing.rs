//! Functions that the fuzz targets call.

use std::path::Path;
use std::sync::Arc;

use base::error::Error;
use base::progress::Progress;

/// Checks what a PLY file in memory reads as.
pub fn ply(bytes: &[u8]) {
    super::ply::examine(bytes);
    named(bytes);
}

/// Checks what a file in memory reads as, in every format that its first bytes could be of, and as an SRTM tile and a
/// binary STL file, which have no mark.
pub fn scan(bytes: &[u8]) {
    use super::*;
    type Sniff = fn(&[u8]) -> bool;
    let formats: [(Sniff, file::Parse); 15] = [
        (ptx::sniff, ptx::parse),
        (pcd::sniff, pcd::parse),
        (e57::sniff, e57::parse),
        (las::sniff, las::parse),
        (gltf::sniff, gltf::parse),
        (|_| true, stl::parse),
        (obj::sniff, obj::parse),
        (raster::png::sniff, raster::png::parse),
        (raster::pgm::sniff, raster::pgm::parse),
        (raster::pfm::sniff, raster::pfm::parse),
        (raster::exr::sniff, raster::exr::parse),
        (raster::tiff::sniff, raster::tiff::parse),
        (raster::npy::sniff, raster::npy::parse),
        (raster::esri::sniff, raster::esri::parse),
        (|_| true, raster::hgt::parse),
    ];
    // Little, so that what unpacks to much is refused.
    let options = ReadOptions { max_decoded_gib: 0.125, ..ReadOptions::default() };
    let scan = FileScan { options: Arc::new(options), ..FileScan::new(Path::new("fuzz/scan.bin")) };
    for (sniff, parse) in formats {
        if sniff(bytes) {
            damage::sound(&damage::read(parse, bytes, &scan), &scan);
        }
    }
    if three_mf::sniff(bytes) {
        let folder = crate::memory_folder::MemoryFolder::new();
        let path = folder.put("scan.3mf", bytes.to_vec()).expect("the folder is empty");
        let scan = FileScan { path, ..scan };
        match three_mf::read(&scan, &Progress::none()) {
            // The path of a damaged member is its place in the archive.
            Err(Error::Format { path, at, .. }) => assert!(path.starts_with(&scan.path) && !at.is_empty(), "{at}"),
            outcome => damage::sound(&outcome, &scan),
        }
    }
    named(bytes);
}

/// Checks what a file is said to be in and from: a file in memory can always be read.
fn named(bytes: &[u8]) {
    use super::*;
    let folder = crate::memory_folder::MemoryFolder::new();
    let Ok(path) = folder.put("scan.bin", bytes.to_vec()) else { return };
    let outcome = crs::of_file(&FileScan::new(&path));
    assert!(matches!(outcome, Ok(_) | Err(Error::Format { .. })), "{outcome:?}");
    // UTF-16 is refused.
    let outcome = provenance(&path);
    assert!(matches!(outcome, Ok(_) | Err(Error::Format { .. })), "{outcome:?}");
}

/// Checks what lists, places or describes scans: read or refused with its name.
pub fn side(bytes: &[u8]) {
    use super::*;
    let path = Path::new("fuzz/side.txt");
    let _ = camera::parse(bytes, path);
    let _ = pose::parse(bytes);
    let _ = trajectory::parse(text::Lines::new(bytes, bytes.len() as u64, path));
    let _ = project::parse_mlp(bytes, path);
    let _ = project::parse_aln(text::Lines::new(bytes, bytes.len() as u64, path));
}

/// Checks what the bytes read as in each way that frames come. Files for it are written into `folder`.
pub fn frames(bytes: &[u8], folder: &Path) {
    super::frames::examine(bytes, folder);
}

/// Checks what a file of points in text reads as.
pub fn points(bytes: &[u8]) {
    super::points::examine(bytes);
}

/// Checks what a `.conf` file in memory reads as. Its scans are looked for in `folder`. True if it is accepted.
pub fn conf(bytes: &[u8], folder: &Path) -> bool {
    super::conf::examine(bytes, folder)
}
