//! The scans of a merge: added, replaced, removed, and what is kept of them from run to run.

use std::ffi::c_char;
use std::path::Path;
use std::sync::{Arc, MutexGuard};

use surfrecon::context::Owned;
use surfrecon::merge::incremental;
use surfrecon::merge::{self, MergeParams, MergeReport, Merged, Reuse, Run, Store};
use surfrecon::threads::Exclusive;
use surfrecon::{IntoFile, Progress};

use crate::files::srf_scans;
use crate::guard::guard;
use crate::handle::{self, handle};
use crate::image::srf_image;
use crate::image_source::srf_image_source;
use crate::mesh::srf_mesh;
use crate::pointer;
use crate::pose::srf_pose;
use crate::sources::{self, Source};
use crate::status::{Failure, flag, srf_status, srf_status::*};

/// State of a merge so far.
#[derive(Clone, Default)]
pub struct Merger {
    sources: Vec<Source>,
    /// Of each its number among all there ever were.
    versions: Vec<u64>,
    /// Number of all that there ever were.
    ever: u64,
    /// Findings that runs leave for the next, if that is asked for.
    kept: Option<Arc<Exclusive<Owned<incremental::Merger>>>>,
}

/// A merge being put together: scans are added, replaced and removed, and it is run as often as wanted. Released with srf_merger_free().
#[allow(non_camel_case_types)]
pub struct srf_merger {
    _opaque: [u8; 0],
}

handle!(srf_merger, Merger);

impl Merger {
    /// The scans in the order of adding.
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    fn add(&mut self, source: Source) {
        self.sources.push(source);
        self.versions.push(self.ever);
        self.ever += 1;
    }

    /// Puts a source in the place of another one, which it becomes.
    fn replace(&mut self, index: usize, source: &mut Source) -> Result<(), Failure> {
        self.check(index)?;
        std::mem::swap(&mut self.sources[index], source);
        self.versions[index] = self.ever;
        self.ever += 1;
        Ok(())
    }

    fn remove(&mut self, index: usize) -> Result<Source, Failure> {
        self.check(index)?;
        self.versions.remove(index);
        Ok(self.sources.remove(index))
    }

    fn check(&self, index: usize) -> Result<(), Failure> {
        let count = self.sources.len();
        if index < count {
            return Ok(());
        }
        Err(Failure::new(SRF_ERR_PARAMETER, format!("index must be < {count}, the number of scans, got {index}")))
    }

    /// Merges the scans, with at most so many bytes.
    ///
    /// # Errors
    /// Those of [`merge::merge`].
    pub fn run(
        &self,
        params: &MergeParams,
        (store, memory): (Store, Option<u64>),
        progress: &Progress<'_>,
    ) -> surfrecon::Result<Merged> {
        let mut kept = if matches!(store, Store::Files { .. }) { None } else { self.kept() };
        let reuse = kept.as_mut().map(|kept| Reuse { merger: kept, versions: &self.versions });
        merge::merge(&sources::borrowed(&self.sources), params, Run { store, memory, reuse }, progress)
    }

    /// The kept findings. Nothing if another thread runs it, too: this run neither takes nor leaves anything then.
    fn kept(&self) -> Option<MutexGuard<'_, Owned<incremental::Merger>>> {
        let mut kept = self.kept.as_ref()?.take().ok()?;
        // Findings of the calls of another context stay on its account.
        if !kept.is_of_this_thread() {
            *kept = Owned::default();
        }
        Some(kept)
    }

    /// Merges the scans into a file.
    ///
    /// # Errors
    /// Those of [`surfrecon::merge_to_file`].
    pub fn write(
        &self,
        path: &Path,
        params: &MergeParams,
        into: &IntoFile,
        progress: &Progress<'_>,
    ) -> surfrecon::Result<MergeReport> {
        surfrecon::merge_to_file(&sources::borrowed(&self.sources), path, params, into, progress)
    }
}

fn change<R>(merger: *mut srf_merger, change: impl FnOnce(&mut Merger) -> Result<R, Failure>) -> Result<R, Failure> {
    handle::change("merger", merger.cast_const(), change)
}

fn replace(merger: *mut srf_merger, index: usize, mut source: Source) -> Result<(), Failure> {
    change(merger, |merger| merger.replace(index, &mut source))
}

fn add(merger: *mut srf_merger, added: impl IntoIterator<Item = Source>) -> Result<(), Failure> {
    change(merger, |merger| {
        added.into_iter().for_each(|source| merger.add(source));
        Ok(())
    })
}

/// Begins a merge without scans.
/// out_merger  receives a new handle on SRF_OK only. Not NULL
/// returns     SRF_OK, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_create(out_merger: *mut *mut srf_merger) -> srf_status {
    guard(|| handle::give("out_merger", out_merger, Merger::default()))
}

/// Releases a merge. All that was added to it stays.
/// merger     NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_free(merger: *mut srf_merger) -> srf_status {
    guard(|| handle::free("merger", merger))
}

/// Adds a range image as it is now. It may be freed or changed afterwards.
/// merger     not NULL
/// image      not NULL
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_add_image(merger: *mut srf_merger, image: *const srf_image) -> srf_status {
    guard(|| add(merger, [sources::of_image(image)?]))
}

/// Adds an oriented mesh as it is now. Its vertex attributes confidence and colour are used if there.
/// merger           not NULL
/// mesh             not NULL
/// world_from_mesh  places it. NULL for the identity
/// name             what ties are broken by, so that the order of adding does not matter, UTF-8. Not NULL
/// returns          SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_add_mesh(
    merger: *mut srf_merger,
    mesh: *const srf_mesh,
    world_from_mesh: *const srf_pose,
    name: *const c_char,
) -> srf_status {
    guard(|| add(merger, [sources::of_mesh(mesh, world_from_mesh, name)?]))
}

/// Adds all scans of a set. They are read when the merge runs, one per thread at a time, and not kept.
/// merger     not NULL
/// scans      not NULL
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_add_scans(merger: *mut srf_merger, scans: *const srf_scans) -> srf_status {
    guard(|| add(merger, sources::of_scans(scans)?))
}

/// Adds a scan of a set. It is read when the merge runs, and not kept.
/// merger     not NULL
/// scans      not NULL
/// of_set     number of the scan in the set
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_add_scan(
    merger: *mut srf_merger,
    scans: *const srf_scans,
    of_set: usize,
) -> srf_status {
    guard(|| add(merger, [sources::of_scan(scans, "of_set", of_set)?]))
}

/// Adds a scan whose range image a function makes: it is made when the merge runs, one per thread at a time, and not kept.
/// merger             not NULL
/// source             makes it. The struct is copied. Not NULL
/// world_from_sensor  places it, whatever pose its image has, a rotation and a translation. NULL for the identity
/// name               what texts call it and ties are broken by, UTF-8. Not NULL
/// returns            SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_add_source(
    merger: *mut srf_merger,
    source: *const srf_image_source,
    world_from_sensor: *const srf_pose,
    name: *const c_char,
) -> srf_status {
    guard(|| add(merger, [sources::of_source(source, world_from_sensor, name)?]))
}

/// Number of scans. They are counted from 0 in the order of adding. Those after one that is removed move up.
/// merger     not NULL
/// out_scans  not NULL
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_count(merger: *const srf_merger, out_scans: *mut usize) -> srf_status {
    guard(|| pointer::write("out_scans", out_scans, handle::get("merger", merger)?.sources.len()))
}

/// Removes a scan.
/// merger     not NULL
/// index      number of the scan
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_remove(merger: *mut srf_merger, index: usize) -> srf_status {
    guard(|| change(merger, |merger| merger.remove(index)).map(drop))
}

/// Puts a range image as it is now in the place of a scan: another measurement, or the same at another pose.
/// merger     not NULL
/// index      number of the scan
/// image      not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_replace_by_image(
    merger: *mut srf_merger,
    index: usize,
    image: *const srf_image,
) -> srf_status {
    guard(|| replace(merger, index, sources::of_image(image)?))
}

/// Puts an oriented mesh as it is now in the place of a scan. It is added as by srf_merger_add_mesh().
/// merger           not NULL
/// index            number of the scan
/// mesh             not NULL
/// world_from_mesh  places it. NULL for the identity
/// name             UTF-8. Not NULL
/// returns          SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_replace_by_mesh(
    merger: *mut srf_merger,
    index: usize,
    mesh: *const srf_mesh,
    world_from_mesh: *const srf_pose,
    name: *const c_char,
) -> srf_status {
    guard(|| replace(merger, index, sources::of_mesh(mesh, world_from_mesh, name)?))
}

/// Puts a scan of a set in the place of a scan. It is read when the merge runs.
/// merger     not NULL
/// index      number of the scan
/// scans      not NULL
/// of_set     number of the scan in the set
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_replace_by_scan(
    merger: *mut srf_merger,
    index: usize,
    scans: *const srf_scans,
    of_set: usize,
) -> srf_status {
    guard(|| replace(merger, index, sources::of_scan(scans, "of_set", of_set)?))
}

/// Puts a scan whose range image a function makes in the place of a scan. It is added as by srf_merger_add_source().
/// merger             not NULL
/// index              number of the scan
/// source             makes it. The struct is copied. Not NULL
/// world_from_sensor  places it, a rotation and a translation. NULL for the identity
/// name               UTF-8. Not NULL
/// returns            SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_replace_by_source(
    merger: *mut srf_merger,
    index: usize,
    source: *const srf_image_source,
    world_from_sensor: *const srf_pose,
    name: *const c_char,
) -> srf_status {
    guard(|| replace(merger, index, sources::of_source(source, world_from_sensor, name)?))
}

/// Says whether each run keeps what it found out for the next. That one then loads and counts only those scans that are new to it, and
/// renews what these have a part in. The result is that of a first run, to the bit. It does not notice files that change on the disk, nor
/// functions that would make another image: the scan has to be replaced, by itself if need be. A run keeps nothing for those under another
/// context. If the measured cell or merge distance differs, since a scan has changed, all follows anew. Giving both as parameters makes
/// that rarer. Of two runs at a time the second keeps nothing. Memory: about 125 bytes for each intersection of a scan with the grid, until
/// srf_merger_free().
/// merger     not NULL
/// keep       1 to keep. 0, the default, gives back what is kept
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_keep(merger: *mut srf_merger, keep: u32) -> srf_status {
    guard(|| {
        let keep = flag("keep", keep)?;
        let given_back = change(merger, |merger| {
            if !keep {
                return Ok(merger.kept.take());
            }
            merger.kept.get_or_insert_with(|| Arc::new(Exclusive::new(Owned::default())));
            Ok(None)
        })?;
        drop(given_back);
        Ok(())
    })
}

/// Amount that the last run that kept something had to renew: bricks of 32 cells a side that scans speak of. It is 0 of 0 without
/// srf_merger_keep() and before the first run with it. Nothing is kept then, and each run finds out everything.
/// merger       not NULL
/// out_renewed  bricks labelled anew. NULL if not wanted
/// out_bricks   all bricks. NULL if not wanted
/// returns      SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_renewed(
    merger: *const srf_merger,
    out_renewed: *mut usize,
    out_bricks: *mut usize,
) -> srf_status {
    guard(|| {
        let merger = handle::get("merger", merger)?;
        let renewed = match &merger.kept {
            None => incremental::Renewed::default(),
            Some(kept) => match kept.take() {
                Ok(kept) => kept.renewed(),
                Err(_) => return Err(Failure::new(SRF_ERR_INPUT, "merger is running: wait for it")),
            },
        };
        for (name, out, bricks) in
            [("out_renewed", out_renewed, renewed.bricks), ("out_bricks", out_bricks, renewed.of)]
        {
            if !out.is_null() {
                pointer::write(name, out, bricks)?;
            }
        }
        Ok(())
    })
}
