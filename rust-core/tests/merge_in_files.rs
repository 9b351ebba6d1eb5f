//! Merges in files into a surface in memory, asked for or where memory is short.
#![allow(clippy::unwrap_used)]

use std::borrow::Cow;
use std::path::Path;
use std::sync::OnceLock;

use glam::{DAffine3, DVec3};
use surfrecon::context::{Context, choose};
use surfrecon::geom::bvh::Bvh;
use surfrecon::memory;
use surfrecon::merge::incremental::Merger;
use surfrecon::merge::{
    self, Loading, MergeParams, MergeReport, Merged, OrientedSurface, PlacedMesh, Reuse, Run, ScanSource, Store,
    VoxelReason,
};
use surfrecon::mesh::shapes::Shape;
use surfrecon::scan::{ScanParams, TurntableViews, bounds, scan, turntable};
use surfrecon::{Error, Progress, RangeImage, Result};
use surfrecon_allocator::Account;

#[global_allocator]
static ALLOCATOR: Account = Account(std::alloc::System);

fn scans() -> &'static [RangeImage] {
    static SCANS: OnceLock<Vec<RangeImage>> = OnceLock::new();
    SCANS.get_or_init(made)
}

fn made() -> Vec<RangeImage> {
    let shape = Shape::Torus { major: 1.0, minor: 0.3 }.mesh(40);
    let tree = Bvh::build(&shape.positions, &shape.triangles, 0).unwrap();
    let table = TurntableViews { around: 64, above: 1, below: 1, pixels: 200, ..TurntableViews::default() };
    let noisy = ScanParams { noise: 0.002, ..ScanParams::default() };
    let cameras = turntable(bounds(&shape.positions).unwrap(), &table, &Progress::none()).unwrap();
    cameras.iter().map(|camera| scan(&shape, &tree, camera, &noisy, &Progress::none()).unwrap()).collect()
}

fn sources(scans: &[RangeImage]) -> Vec<&dyn ScanSource> {
    scans.iter().map(|scan| scan as &dyn ScanSource).collect()
}

fn params(voxel: Option<f64>) -> MergeParams {
    MergeParams { voxel, threads: 1, ..MergeParams::default() }
}

const VOXEL: Option<f64> = Some(0.012);

/// The store in which a merge works, and its bytes of memory.
type Way = (Store, Option<u64>);

fn if_needed(folder: &Path) -> Way {
    (Store::MemoryOrFiles { workspace: Some(folder.to_owned()) }, None)
}

fn merged(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    (store, memory): &Way,
    progress: &Progress<'_>,
) -> Result<Merged> {
    merge::merge(sources, params, Run { store: store.clone(), memory: *memory, reuse: None }, progress)
}

/// Merges scans that were merged before, of which each is its own version.
fn merged_again(
    merger: &mut Merger,
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    (store, memory): &Way,
) -> Result<Merged> {
    let versions: Vec<u64> = (0..sources.len() as u64).collect();
    let reuse = Some(Reuse { merger, versions: &versions });
    merge::merge(sources, params, Run { store: store.clone(), memory: *memory, reuse }, &Progress::none())
}

/// The mesh to the bit, and what of the report does not depend on the way.
fn known(merged: &Merged) -> (Vec<[u64; 3]>, &[[u32; 3]], String, String) {
    let report = MergeReport { working_bytes: 0, in_files: false, seconds: Vec::new(), ..merged.report.clone() };
    let bits = merged.mesh.positions.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
    let attributes = format!("{:?} {:?}", merged.mesh.vertex_attributes, merged.mesh.face_attributes);
    (bits, &merged.mesh.triangles, attributes, format!("{report:?} {:?}", merged.mesh.crs))
}

fn assert_same(one: &Merged, other: &Merged) {
    let (one, other) = (known(one), known(other));
    assert_eq!(one.3, other.3);
    assert!(one == other && !one.1.is_empty());
}

fn is_empty(folder: &Path) -> bool {
    std::fs::read_dir(folder).unwrap().next().is_none()
}

/// A call of a host that allows so many bytes: more are refused.
fn allowing<R>(bytes: u64, call: impl FnOnce() -> Result<R>) -> Result<R> {
    let context = Context::new().unwrap();
    context.set_memory_limit(Some(bytes));
    let before = choose(Some(context));
    let outcome = memory::guarded(call);
    choose(before);
    outcome
}

#[test]
fn the_surface_is_the_one_of_a_merge_in_memory() {
    let scans = scans();
    let merged = merge::merge(&sources(scans), &params(VOXEL), Run::default(), &Progress::none()).unwrap();
    assert!(!merged.report.in_files && merged.report.grid.iter().max().unwrap() > &(4 * 32));
    let folder = tempfile::tempdir().unwrap();
    let here = Store::Files { workspace: Some(folder.path().to_owned()) };
    for way in [(here, Some(merge::out_of_core::LEAST)), (Store::Files { workspace: None }, None)] {
        let found = self::merged(&sources(scans), &params(VOXEL), &way, &Progress::none()).unwrap();
        assert!(found.report.in_files && is_empty(folder.path()));
        assert_same(&found, &merged);
    }
}

#[test]
fn where_memory_is_short_it_goes_by_files_and_nothing_else_changes() {
    let (scans, folder) = (scans(), tempfile::tempdir().unwrap());
    let sources = sources(scans);
    let way = if_needed(folder.path());
    for voxel in [VOXEL, None] {
        let params = params(voxel);
        let run = || merged(&sources, &params, &way, &Progress::none());
        let expected = run().unwrap();
        assert!(!expected.report.in_files);
        let mut merger = Merger::default();
        let mut again = || merged_again(&mut merger, &sources, &params, &way);
        assert_same(&again().unwrap(), &expected);
        const LITTLE: u64 = 14_000_000;
        let coarser = allowing(LITTLE, || merge::merge(&sources, &params, Run::default(), &Progress::none()));
        match voxel {
            Some(_) => assert!(matches!(coarser, Err(Error::OutOfMemory(_)))),
            None => assert_eq!(coarser.unwrap().report.voxel_reason, VoxelReason::Memory),
        }
        let found = allowing(LITTLE, run);
        let found = found.unwrap();
        assert!(found.report.in_files);
        assert_same(&found, &expected);
        // Kept memory was taken before; but a voxel that is measured has to fit as if nothing was.
        let found = allowing(LITTLE, &mut again);
        let found = found.unwrap();
        assert_eq!(found.report.in_files, voxel.is_none());
        assert_same(&found, &expected);
        assert_eq!(merger.renewed().bricks, 0);
        let found = allowing(LITTLE, || {
            merger.forget();
            merged_again(&mut merger, &sources, &params, &way)
        });
        let found = found.unwrap();
        assert!(found.report.in_files);
        assert_same(&found, &expected);
        assert_eq!(merger.renewed().of, 0);
        // Without a limit it is told what there is.
        let way = (way.0.clone(), Some(LITTLE));
        let found = merged(&sources, &params, &way, &Progress::none()).unwrap();
        assert!(found.report.in_files);
        assert_same(&found, &expected);
        assert!(is_empty(folder.path()));
    }
}

#[test]
fn what_files_do_not_help_is_told_at_once_and_measured_cells_are_larger() {
    let (scans, folder) = (scans(), tempfile::tempdir().unwrap());
    let sources = sources(scans);
    let way = if_needed(folder.path());
    let run = |voxel, way: &Way| merged(&sources, &params(voxel), way, &Progress::none());
    // A slip of the unit: not even the surface would fit.
    let text = run(Some(1e-6), &way).unwrap_err().to_string();
    assert!(text.starts_with("not enough memory: a voxel of 0.000001 ") && text.ends_with(" fits"), "{text}");
    // Less than files need.
    let coarser = allowing(10_000_000, || run(None, &way));
    let report = coarser.unwrap().report;
    assert!(report.voxel_reason == VoxelReason::Memory && !report.in_files);
    let error = allowing(10_000_000, || run(VOXEL, &way));
    let text = error.unwrap_err().to_string();
    assert!(
        text.starts_with("not enough memory: merging in files needs 12 MB at least, 12 MB for each of 1"),
        "{text}"
    );
    let nowhere = (Store::Files { workspace: Some(folder.path().join("none")) }, None);
    let text = run(VOXEL, &nowhere).unwrap_err().to_string();
    assert!(text.ends_with("none: the workspace must be a folder that exists"), "{text}");
    assert!(is_empty(folder.path()));
}

#[test]
fn progress_never_falls_and_cancelled_anywhere_it_leaves_nothing() {
    let (scans, folder) = (scans(), tempfile::tempdir().unwrap());
    let sources = sources(scans);
    let way = (if_needed(folder.path()).0, Some(12_000_000));
    let (mut last, mut stages) = (0.0, Vec::new());
    let watch = Progress::new(|tick| {
        assert!(tick.fraction >= last, "{} {last}", tick.fraction);
        last = tick.fraction;
        stages.push(tick.stage);
        std::ops::ControlFlow::Continue(())
    });
    let found = merged(&sources, &params(VOXEL), &way, &watch).unwrap();
    drop(watch);
    assert!(found.report.in_files && last > 0.5, "{last} {stages:?}");
    let (mut checks, mut most) = (0, 0);
    loop {
        match merged(&sources, &params(VOXEL), &way, &Progress::cancel_after(checks)) {
            Err(Error::Cancelled) => assert!(is_empty(folder.path())),
            Ok(_) => break,
            Err(other) => panic!("{other}"),
        }
        most = checks;
        checks += 1 + checks / 2;
    }
    assert!(most > 100 && is_empty(folder.path()), "{most}");
}

/// A few scans, whose merge takes some megabytes.
fn few() -> &'static [RangeImage] {
    static SCANS: OnceLock<Vec<RangeImage>> = OnceLock::new();
    SCANS.get_or_init(|| {
        let shape = Shape::Torus { major: 1.0, minor: 0.4 }.mesh(24);
        let tree = Bvh::build(&shape.positions, &shape.triangles, 0).unwrap();
        let table = TurntableViews { around: 10, above: 0, below: 0, pixels: 60, ..TurntableViews::default() };
        let cameras = turntable(bounds(&shape.positions).unwrap(), &table, &Progress::none()).unwrap();
        let scan = |camera| scan(&shape, &tree, camera, &ScanParams::default(), &Progress::none()).unwrap();
        cameras.iter().map(scan).collect()
    })
}

/// A scan that takes so much memory while it is loaded that two at a time are too many.
struct Greedy<'a>(&'a RangeImage);

impl ScanSource for Greedy<'_> {
    fn name(&self) -> &str {
        &self.0.name
    }

    fn load(&self, loading: &Loading, progress: &Progress<'_>) -> Result<OrientedSurface> {
        let taken = vec![1_u8; 3 << 20];
        std::thread::sleep(std::time::Duration::from_millis(3));
        assert_eq!(std::hint::black_box(&taken).len(), 3 << 20);
        self.0.load(loading, progress)
    }

    fn image(&self, _: &Progress<'_>) -> Result<Option<Cow<'_, RangeImage>>> {
        Ok(Some(Cow::Borrowed(self.0)))
    }
}

#[test]
fn where_memory_chooses_the_cell_equal_calls_give_equal_surfaces() {
    let folder = tempfile::tempdir().unwrap();
    let way = if_needed(folder.path());
    let (mesh, none) = (Shape::Torus { major: 1.0, minor: 0.4 }.mesh(48), Progress::none());
    let place = |i: usize| PlacedMesh {
        name: format!("torus {i}"),
        mesh: &mesh,
        world_from_mesh: DAffine3::from_translation(DVec3::new(3.0, 0.2, 0.1) * i as f64),
    };
    let scans: Vec<PlacedMesh<&surfrecon::TriMesh>> = (0..7).map(place).collect();
    let mut sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let as_given = sources.clone();
    let params = |threads| MergeParams { threads, ..MergeParams::default() };
    let before = choose(Some(Context::new().unwrap()));
    let whole = memory::guarded(|| merge::merge(&sources, &params(1), Run::default(), &none)).unwrap();
    let foreseen = memory::foreseen();
    choose(before);
    let limit = foreseen / 10 * 9;
    assert!(limit < merge::out_of_core::LEAST, "{limit}");
    let expected = allowing(limit, || merge::merge(&sources, &params(1), Run::default(), &none)).unwrap();
    let MergeReport { voxel, voxel_reason, .. } = expected.report;
    assert!(voxel_reason == VoxelReason::Memory && voxel > whole.report.voxel, "{limit}: {voxel}");
    for threads in [2, 3] {
        sources.rotate_left(3);
        assert_same(
            &allowing(limit, || merge::merge(&sources, &params(threads), Run::default(), &none)).unwrap(),
            &expected,
        );
    }
    // Less than files need, and than what a merger keeps.
    assert_same(&allowing(limit, || merged(&sources, &params(3), &way, &none)).unwrap(), &expected);
    let mut merger = Merger::default();
    for threads in [1, 3] {
        let again = allowing(limit, || merged_again(&mut merger, &as_given, &params(threads), &(Store::Memory, None)));
        assert_same(&again.unwrap(), &expected);
    }
    let again = || merged_again(&mut merger, &as_given, &params(3), &way);
    assert_same(&allowing(limit, again).unwrap(), &expected);
}

#[test]
fn what_fits_on_one_thread_is_merged_on_many() {
    let scans: Vec<Greedy<'_>> = few().iter().map(Greedy).collect();
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let params = |threads| MergeParams { threads, voxel: Some(0.2), ..MergeParams::default() };
    let run =
        |threads| allowing(5_000_000, || merge::merge(&sources, &params(threads), Run::default(), &Progress::none()));
    let expected = run(1).unwrap();
    assert_same(&run(4).unwrap(), &expected);
}

#[test]
#[expect(deprecated, reason = "programs that use them go on working")]
fn former_names_give_the_same() {
    use surfrecon::merge::again::Versioned;
    use surfrecon::{InFiles, merge_again_in_files, merge_in_files};
    let (scans, params, none) = (few(), params(Some(0.2)), Progress::none());
    let sources = sources(scans);
    let expected = merge::merge(&sources, &params, Run::default(), &none).unwrap();
    let versioned: Vec<_> = (0..).zip(&sources).map(|(version, &scan)| Versioned { scan, version }).collect();
    let mut merger = Merger::default();
    let (always, if_needed) = (InFiles::default(), InFiles { only_if_needed: true, ..InFiles::default() });
    for found in [
        merge::run(&sources, &params, &none),
        merge::run_within(&sources, &params, Some(1 << 30), &none),
        merge::run_if_it_fits(&sources, &params, None, &none).map(Option::unwrap),
        merger.run(&versioned, &params, &none),
        merger.run_if_it_fits(&versioned, &params, None, &none).map(Option::unwrap),
        merge_in_files(&sources, &params, &always, &none),
        merge_in_files(&sources, &params, &if_needed, &none),
        merge_again_in_files(&mut merger, &versioned, &params, &always, &none),
    ] {
        assert_same(&found.unwrap(), &expected);
    }
    assert!(merger.renewed().bricks == 0 && merge::disk::LEAST == merge::out_of_core::LEAST);
}
