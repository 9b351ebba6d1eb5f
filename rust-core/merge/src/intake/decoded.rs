//! Scans of files, decoded once where memory allows: the cell is measured on some of them, all are discretized, and images are asked what
//! they see. Each of these loads its scan, and reading a file of text costs as much as the rest of the work on it.

use std::borrow::Cow;
use std::path::Path;
use std::sync::OnceLock;

use glam::DVec3;

use base::error::Result;
use base::memory;
use base::progress::Progress;
use image::oriented::OrientedPoints;
use image::places::Places;
use image::range_image::RangeImage;
use image::source::{Decoded, Loading, Moment, OrientedSurface, ScanSource};
use image::triangulate::TriangulateParams;
use mesh::Crs;

/// All decoded scans together take no more bytes than this: fifty depth images of 640 x 480.
const MOST: u64 = 128 << 20;
/// Nor more than this share of the memory that there is. No estimate of a merge's memory counts them.
const SHARE: f64 = 1.0 / 16.0;

/// A scan whose file is decoded when it is first loaded, and not again if all scans of its size may stay decoded.
pub struct DecodedOnce<'a> {
    scan: &'a dyn ScanSource,
    decoded: OnceLock<Decoded>,
    /// Bytes that it may take decoded.
    most: u64,
}

impl<'a> DecodedOnce<'a> {
    /// Of each of the scans of a merge that is allowed so much memory. None if no scan is read from a file.
    pub fn all(scans: &[&'a dyn ScanSource], memory: Option<u64>) -> Vec<Self> {
        let (there, _) = memory::available();
        let limits = [memory, memory::limit_of_calls()].into_iter().flatten().map(|bytes| bytes as f64);
        let most = MOST.min((SHARE * limits.fold(there, f64::min)) as u64);
        Self::within(most, scans)
    }

    fn within(most: u64, scans: &[&'a dyn ScanSource]) -> Vec<Self> {
        let files = scans.iter().filter(|scan| scan.file().is_some()).count() as u64;
        if files == 0 {
            return Vec::new();
        }
        let most = most / files;
        scans.iter().map(|&scan| DecodedOnce { scan, decoded: OnceLock::new(), most }).collect()
    }

    /// Gives what `of` makes of the decoded scan. `None` if it is none that can be decoded.
    fn with<T>(&self, progress: &Progress<'_>, of: impl FnOnce(&Decoded) -> Result<T>) -> Result<Option<T>> {
        if self.scan.file().is_none() {
            return Ok(None);
        }
        if let Some(decoded) = self.decoded.get() {
            return of(decoded).map(Some);
        }
        let Some(decoded) = self.scan.decoded(progress)? else { return Ok(None) };
        if decoded.bytes() > self.most {
            return of(&decoded).map(Some);
        }
        // Another thread may have decoded it meanwhile.
        of(self.decoded.get_or_init(|| decoded)).map(Some)
    }
}

impl ScanSource for DecodedOnce<'_> {
    fn name(&self) -> &str {
        self.scan.name()
    }

    fn load(&self, loading: &Loading, progress: &Progress<'_>) -> Result<OrientedSurface> {
        let loaded = self.with(progress, |decoded| decoded.load(loading, progress))?;
        loaded.map_or_else(|| self.scan.load(loading, progress), Ok)
    }

    fn image(&self, progress: &Progress<'_>) -> Result<Option<Cow<'_, RangeImage>>> {
        match self.decoded.get() {
            Some(decoded) => Ok(decoded.image().map(Cow::Borrowed)),
            None => self.scan.image(progress),
        }
    }

    fn crs(&self) -> Result<Option<Crs>> {
        self.scan.crs()
    }

    fn oriented_points(&self, progress: &Progress<'_>) -> Result<OrientedPoints> {
        self.scan.oriented_points(progress)
    }

    fn file(&self) -> Option<&Path> {
        self.scan.file()
    }

    fn moment(&self) -> Option<Moment<'_>> {
        self.scan.moment()
    }

    fn up(&self) -> Option<DVec3> {
        self.scan.up()
    }

    fn damage(&self) -> Option<String> {
        self.scan.damage()
    }

    fn places(&self, progress: &Progress<'_>) -> Result<Places> {
        self.scan.places(progress)
    }

    fn content(&self, triangulation: &TriangulateParams, progress: &Progress<'_>) -> Result<u64> {
        self.scan.content(triangulation, progress)
    }

    fn version(&self, triangulation: &TriangulateParams, progress: &Progress<'_>) -> Result<u64> {
        self.scan.version(triangulation, progress)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use glam::DAffine3;

    use super::*;
    use crate::params::MergeParams;
    use crate::report::MergeReport;
    use crate::run::memory::Memory;
    use crate::run::started::{started, surface};
    use image::range_image::{DepthKind, Projection};

    /// A scan in a file, which counts how often that is decoded.
    struct Counted {
        image: RangeImage,
        decoded: AtomicUsize,
    }

    impl ScanSource for Counted {
        fn name(&self) -> &str {
            &self.image.name
        }

        fn load(&self, loading: &Loading, progress: &Progress<'_>) -> Result<OrientedSurface> {
            self.decoded.fetch_add(1, Ordering::Relaxed);
            self.image.load(loading, progress)
        }

        fn image(&self, _: &Progress<'_>) -> Result<Option<Cow<'_, RangeImage>>> {
            self.decoded.fetch_add(1, Ordering::Relaxed);
            Ok(Some(Cow::Borrowed(&self.image)))
        }

        fn decoded(&self, _: &Progress<'_>) -> Result<Option<Decoded>> {
            self.decoded.fetch_add(1, Ordering::Relaxed);
            Ok(Some(Decoded::Image(self.image.clone())))
        }

        fn file(&self) -> Option<&Path> {
            Some(Path::new("scan.ptx"))
        }
    }

    /// Three views of a wavy wall, each from its own place.
    fn scans() -> Vec<Counted> {
        let scan = |number: usize| {
            let depth = |pixel: usize| 2.0 + 0.1 * (pixel as f64 / 7.0).sin();
            let projection = Projection::Pinhole { focal: [60.0; 2], centre: [23.5, 17.5], depth: DepthKind::Planar };
            let mut image = RangeImage::from_values(36, 48, (0..36 * 48).map(depth).collect(), projection).unwrap();
            image.name = format!("scan {number}");
            image.world_from_sensor = DAffine3::from_translation(DVec3::X * (0.1 + 0.2 * number as f64));
            Counted { image, decoded: AtomicUsize::new(0) }
        };
        (0..3).map(scan).collect()
    }

    /// The merge within so many bytes of decoded scans, and how often each scan is decoded for it.
    fn merged(most: u64) -> (mesh::TriMesh, MergeReport, Vec<usize>) {
        let counted = scans();
        let sources: Vec<&dyn ScanSource> = counted.iter().map(|scan| scan as &dyn ScanSource).collect();
        let once = DecodedOnce::within(most, &sources);
        let sources: Vec<&dyn ScanSource> = once.iter().map(|scan| scan as &dyn ScanSource).collect();
        let (params, setup, progress) =
            (MergeParams::default(), crate::intake::setup::Setup::default(), Progress::none());
        let work = || surface(&mut Memory::new(&sources, &params, &setup), &params, &progress);
        let merged = started(&sources, &params, &progress, work).unwrap();
        (merged.mesh, merged.report, counted.iter().map(|scan| scan.decoded.load(Ordering::Relaxed)).collect())
    }

    #[test]
    fn scans_of_files_are_decoded_once_where_memory_allows() {
        let bytes = scans()[0].image.bytes() as u64;
        assert_eq!(bytes, 8 * 36 * 48);
        let (mesh, report, decoded) = merged(3 * bytes);
        assert_eq!(decoded, [1, 1, 1]);
        // One byte less holds none of them.
        let (others_mesh, others_report, decoded) = merged(3 * bytes - 1);
        assert!(decoded.iter().all(|&times| times > 1), "{decoded:?}");
        assert!(mesh == others_mesh && report.voxel == others_report.voxel);
        assert!(!mesh.triangles.is_empty());
    }
}
