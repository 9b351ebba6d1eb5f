//! The scans that say where nothing is, once the surface is there.

use std::sync::Arc;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::crossings::scan_order::ScanOrder;
use base::error::Result;
use base::memory;
use base::progress::Progress;
use image::range_image::noise::Noise;
use image::source::Measured;
use image::visibility::LinesOfSight;

/// At most so many scans vote, those of the smallest numbers, which is as good as by chance: more would tell the same.
pub const MOST_VOTERS: usize = 256;

/// Lines of sight by the version of the scan. Some scans have none.
pub type KnownSights = FxHashMap<u64, Option<Arc<LinesOfSight>>>;

/// The scans with lines of sight, at most as many as vote.
#[derive(Default)]
pub struct Eyes<'a> {
    scan_order: ScanOrder<'a>,
    /// Numbers and noise.
    scans: Vec<(u32, Noise)>,
    /// Made already.
    known: KnownSights,
}

impl<'a> Eyes<'a> {
    /// `images` are the measures of those scans that are range images, by number.
    pub fn new(scan_order: ScanOrder<'a>, images: &[(u32, Measured)]) -> Self {
        Eyes { scan_order, scans: owned(&looking(images)), known: KnownSights::default() }
    }

    /// With lines of sight that are made already.
    pub fn knowing(self, known: KnownSights) -> Self {
        Eyes { known, ..self }
    }

    /// How many scans look.
    pub fn count(&self) -> usize {
        self.scans.len()
    }

    /// Calls `look` with the lines of sight of each scan, of which one per thread is in memory.
    ///
    /// # Errors
    /// A scan can't be loaded any more. Those of `look`. Cancelled.
    pub fn each(&self, progress: &Progress<'_>, look: impl Fn(&LinesOfSight) -> Result<()> + Sync) -> Result<()> {
        self.scans.par_iter().with_max_len(1).try_for_each(|scan| match self.sight(scan, progress)? {
            Some(sight) => look(&sight),
            None => Ok(()),
        })
    }

    /// The lines of sight of all scans.
    ///
    /// # Errors
    /// A scan can't be loaded any more. [`base::Error::OutOfMemory`]. Cancelled.
    pub fn all(&self, progress: &Progress<'_>) -> Result<Vec<Arc<LinesOfSight>>> {
        let sight = |scan: &(u32, Noise)| {
            let sight = self.sight(scan, progress)?;
            progress.advance(1)?;
            // Those of the others are of about the same size.
            if let Some(sight) = &sight {
                let bytes = sight.bytes() as f64 * self.scans.len() as f64;
                let what = || format!("looking from {} scans", self.scans.len());
                memory::expect_in_all(bytes, what, "close holes alone, merge fewer scans, or raise the limit")?;
            }
            Ok(sight)
        };
        let all: Vec<_> = self.scans.par_iter().with_max_len(1).map(sight).collect::<Result<_>>()?;
        Ok(all.into_iter().flatten().collect())
    }

    fn sight(&self, (scan, noise): &(u32, Noise), progress: &Progress<'_>) -> Result<Option<Arc<LinesOfSight>>> {
        match self.known.get(&self.scan_order.version(*scan)) {
            Some(known) => Ok(known.clone()),
            None => Ok(lines_of_sight(&self.scan_order, *scan, noise, progress)?.map(Arc::new)),
        }
    }
}

fn owned(scans: &[(u32, &Noise)]) -> Vec<(u32, Noise)> {
    scans.iter().map(|&(scan, noise)| (scan, noise.clone())).collect()
}

/// The numbers of the scans that look, with their noise.
pub fn looking(images: &[(u32, Measured)]) -> Vec<(u32, &Noise)> {
    let with_lines = images.iter().filter(|image| image.1.has_lines_of_sight);
    with_lines.map(|(scan, image)| (*scan, &image.noise)).take(MOST_VOTERS).collect()
}

/// A scan, by its number, made to be asked what it sees.
///
/// # Errors
/// It can't be loaded any more. Cancelled.
pub fn lines_of_sight(
    scan_order: &ScanOrder<'_>,
    number: u32,
    noise: &Noise,
    progress: &Progress<'_>,
) -> Result<Option<LinesOfSight>> {
    let place = scan_order.place(number).expect("it is of a scan of the order");
    match scan_order.sources[place].image(progress)? {
        Some(image) => LinesOfSight::new(&image, noise.clone(), progress),
        None => Ok(None),
    }
}
