//! Aligning scans whose poses are unknown or rough: one pose each, in one frame.

use std::ffi::c_char;
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use surfrecon::Progress;
use surfrecon::align::{AlignParams, Axis, Constraints, Pick, Prepared};

use crate::alignment::srf_alignment;
use crate::cloud::srf_cloud;
use crate::files::srf_scans;
use crate::guard::guard;
use crate::handle::{self, handle};
use crate::image::srf_image;
use crate::image_source::srf_image_source;
use crate::mesh::srf_mesh;
use crate::params::align::srf_align_params;
use crate::pose::{self, srf_pose};
use crate::progress::{srf_progress, watched};
use crate::sources::{self, Source};
use crate::status::{Failure, flag, srf_status, srf_status::*};
use crate::{params, pointer, sized};

/// State of an alignment so far.
#[derive(Clone, Default)]
pub struct Aligner {
    sources: Vec<Source>,
    constraints: Constraints,
    ready: Option<Ready>,
}

/// The scans made ready.
#[derive(Clone)]
struct Ready {
    scans: Arc<Prepared>,
    /// The process that did so. In one that was forked from it, a lock within may be held by a thread that does not exist there.
    process: u32,
}

impl Aligner {
    /// The scans made ready, where this process has done so.
    fn ready(&self) -> Option<Arc<Prepared>> {
        self.ready.as_ref().filter(|ready| ready.process == std::process::id()).map(|ready| ready.scans.clone())
    }

    /// The scans in the order of adding.
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// The poses that a caller hands over, or those of adding. None of scans that are left out.
    pub fn poses(&self, given: *const srf_pose, count: usize) -> Result<Vec<Option<DAffine3>>, Failure> {
        if given.is_null() && count == 0 {
            return Ok(self.sources.iter().map(|source| Some(source.world_from_scan())).collect());
        }
        pose::read_all("world_from_scan", given, count, self.sources.len())
    }
}

/// The scans of an aligner made ready: by a call before, or now, to be kept for the next one. No call waits for another that reads,
/// which might be below it, on the same thread: then both read.
pub fn prepared(
    handle: *const srf_aligner,
    aligner: &Aligner,
    threads: usize,
    progress: &Progress<'_>,
) -> Result<Arc<Prepared>, Failure> {
    if let Some(scans) = aligner.ready() {
        return Ok(scans);
    }
    let scans = Arc::new(Prepared::read(&sources::borrowed(&aligner.sources), threads, progress)?);
    let keep = |now: &mut Aligner| {
        // Scans are added and never taken away: as many are the same ones.
        if now.sources.len() == aligner.sources.len() && now.ready().is_none() {
            now.ready = Some(Ready { scans: scans.clone(), process: std::process::id() });
        }
        Ok(())
    };
    // One that was freed meanwhile keeps nothing.
    let _ = handle::change("aligner", handle, keep);
    Ok(scans)
}

/// An alignment being put together: scans are added, known facts about them are said, then it is run, as often as wanted. Scans are
/// numbered from 0 in the order of adding. They are read when srf_aligner_run(), srf_aligner_snap() or srf_aligner_misfit() first needs
/// them. What these compare is kept, 1 to 2.5 MB per scan, until scans are added. Released with srf_aligner_free().
#[allow(non_camel_case_types)]
pub struct srf_aligner {
    _opaque: [u8; 0],
}

handle!(srf_aligner, Aligner);

/// A point that two scans show. Starts with its size. Prepared by srf_pick_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_pick {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 1 if the normals are known: two picks with normals already give a pose. 0, the default, if not.
    pub has_normals: u32,
    /// Numbers of the scans.
    pub scans: [u32; 2],
    /// The place of the point, in each scan's own frame.
    pub points: [[f64; 3]; 2],
    /// Outward normals there, in the scans' frames, of any length but 0.
    pub normals: [[f64; 3]; 2],
    /// Its weight: at 1, the default, as much as a two-thousandth of the smaller scan's surface. > 0.
    pub weight: f64,
}

impl srf_pick {
    fn unset() -> Self {
        srf_pick { struct_size: size_of::<Self>() as u32, weight: 1.0, ..bytemuck::Zeroable::zeroed() }
    }
}

/// Prepares a struct for srf_aligner_pick(): without normals, of weight 1. Call srf_pick_init(pick), which adds the size that this
/// header knows.
/// pick     not NULL
/// size     sizeof(srf_pick): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_pick_init_sized(pick: *mut srf_pick, size: usize) -> srf_status {
    guard(|| sized::init("pick", pick, size, srf_pick::unset()))
}

/// Begins an alignment without scans.
/// out_aligner  receives a new handle on SRF_OK only. Not NULL
/// returns      SRF_OK, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_create(out_aligner: *mut *mut srf_aligner) -> srf_status {
    guard(|| handle::give("out_aligner", out_aligner, Aligner::default()))
}

/// Releases an alignment being put together. All that was added to it and that it found stays.
/// aligner    NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_free(aligner: *mut srf_aligner) -> srf_status {
    guard(|| handle::free("aligner", aligner))
}

fn change(aligner: *mut srf_aligner, change: impl FnOnce(&mut Aligner) -> Result<(), Failure>) -> Result<(), Failure> {
    handle::change("aligner", aligner.cast_const(), change)
}

fn add(aligner: *mut srf_aligner, added: impl IntoIterator<Item = Source>) -> Result<(), Failure> {
    let mut outdated = None;
    // Megabytes are given back after the handle is free for others again.
    change(aligner, |aligner| {
        aligner.sources.extend(added);
        outdated = aligner.ready.take();
        Ok(())
    })
}

/// Adds a range image as it is now. It may be freed or changed afterwards. Its own frame is its sensor's.
/// aligner    not NULL
/// image      not NULL
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_add_image(aligner: *mut srf_aligner, image: *const srf_image) -> srf_status {
    guard(|| add(aligner, [sources::of_image(image)?]))
}

/// Adds an oriented mesh as it is now.
/// aligner          not NULL
/// mesh             not NULL
/// world_from_mesh  places it, rigid. NULL for the identity
/// name             what texts call it and ties are broken by, UTF-8. Not NULL
/// returns          SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_add_mesh(
    aligner: *mut srf_aligner,
    mesh: *const srf_mesh,
    world_from_mesh: *const srf_pose,
    name: *const c_char,
) -> srf_status {
    guard(|| add(aligner, [sources::of_mesh(mesh, world_from_mesh, name)?]))
}

/// Adds points as they are now, by their normals. Their place is the cloud's.
/// aligner    not NULL
/// cloud      with normals, without which a run is refused. Not NULL
/// name       what texts call it and ties are broken by, UTF-8. Not NULL
/// returns    SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_add_cloud(
    aligner: *mut srf_aligner,
    cloud: *const srf_cloud,
    name: *const c_char,
) -> srf_status {
    guard(|| add(aligner, [sources::of_cloud(cloud, name)?]))
}

/// Adds all scans of a set. They are read once, when they are first needed, one per thread at a time, and their samples are not kept. What
/// becomes of the files afterwards is not noticed until scans are added.
/// aligner    not NULL
/// scans      not NULL
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_add_scans(aligner: *mut srf_aligner, scans: *const srf_scans) -> srf_status {
    guard(|| add(aligner, sources::of_scans(scans)?))
}

/// Adds a scan whose range image a function makes: it is made when it is first needed, one per thread at a time, and its samples are not
/// kept.
/// aligner            not NULL
/// source             makes it. The struct is copied. Not NULL
/// world_from_sensor  places it, whatever pose its image has, a rotation and a translation. NULL for the identity
/// name               what texts call it and ties are broken by, UTF-8. Not NULL
/// returns            SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_add_source(
    aligner: *mut srf_aligner,
    source: *const srf_image_source,
    world_from_sensor: *const srf_pose,
    name: *const c_char,
) -> srf_status {
    guard(|| add(aligner, [sources::of_source(source, world_from_sensor, name)?]))
}

/// Number of scans that were added.
/// aligner    not NULL
/// out_scans  not NULL
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_count(aligner: *const srf_aligner, out_scans: *mut usize) -> srf_status {
    guard(|| pointer::write("out_scans", out_scans, handle::get("aligner", aligner)?.sources.len()))
}

/// Refuses a number that no scan has.
pub fn known(aligner: &Aligner, name: &str, scan: usize) -> Result<usize, Failure> {
    let count = aligner.sources.len();
    if scan < count {
        return Ok(scan);
    }
    Err(Failure::new(SRF_ERR_PARAMETER, format!("{name} must be < {count}, the number of scans added, got {scan}")))
}

/// Two different scans that were added.
fn pair(aligner: &Aligner, names: [&str; 2], [a, b]: [usize; 2]) -> Result<[usize; 2], Failure> {
    let pair = [known(aligner, names[0], a)?, known(aligner, names[1], b)?];
    if a == b {
        let text = format!("{} and {} must be two scans, got {a} twice", names[0], names[1]);
        return Err(Failure::new(SRF_ERR_PARAMETER, text));
    }
    Ok(pair)
}

/// Says that a scan stays where it is. Where none is fixed the largest one stays.
/// aligner    not NULL
/// scan       number of a scan that was added
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_fix(aligner: *mut srf_aligner, scan: usize) -> srf_status {
    guard(|| {
        change(aligner, |aligner| {
            let scan = known(aligner, "scan", scan)?;
            aligner.constraints.fixed.push(scan);
            Ok(())
        })
    })
}

/// Says that two scans show the same point.
/// aligner    not NULL
/// pick       initialized by srf_pick_init(). Not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_pick(aligner: *mut srf_aligner, pick: *const srf_pick) -> srf_status {
    guard(|| {
        if pick.is_null() {
            return Err(Failure::new(SRF_ERR_NULL, "pick must not be NULL"));
        }
        let given = sized::read("pick", pick, srf_pick::unset())?;
        change(aligner, |aligner| {
            let pick = pick_of(aligner, &given)?;
            aligner.constraints.picks.push(pick);
            Ok(())
        })
    })
}

fn pick_of(aligner: &Aligner, given: &srf_pick) -> Result<Pick, Failure> {
    let refused = |text: String| Err(Failure::new(SRF_ERR_PARAMETER, text));
    let names = ["pick.scans[0]", "pick.scans[1]"];
    let scans = pair(aligner, names, given.scans.map(|scan| scan as usize))?;
    let has_normals = flag("pick.has_normals", given.has_normals)?;
    if !given.points.as_flattened().iter().all(|x| x.is_finite()) {
        return refused("pick.points must have finite numbers".to_owned());
    }
    let normals = has_normals.then(|| given.normals.map(DVec3::from));
    if normals.is_some_and(|normals| normals.iter().any(|n| !(n.is_finite() && n.length() > 0.0))) {
        return refused("pick.normals must be finite and not 0".to_owned());
    }
    if !(given.weight.is_finite() && given.weight > 0.0) {
        return refused(format!("pick.weight must be a finite number > 0, got {}", given.weight));
    }
    Ok(Pick { scans, points: given.points.map(DVec3::from), normals, weight: given.weight })
}

/// Says that two scans touch: what fits them best is used, even if it is not sure.
/// aligner    not NULL
/// a, b       numbers of two scans that were added
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_trust(aligner: *mut srf_aligner, a: usize, b: usize) -> srf_status {
    guard(|| {
        change(aligner, |aligner| {
            let pair = pair(aligner, ["a", "b"], [a, b])?;
            aligner.constraints.trusted.push(pair);
            Ok(())
        })
    })
}

/// Says that two scans must not be compared.
/// aligner    not NULL
/// a, b       numbers of two scans that were added
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_reject(aligner: *mut srf_aligner, a: usize, b: usize) -> srf_status {
    guard(|| {
        change(aligner, |aligner| {
            let pair = pair(aligner, ["a", "b"], [a, b])?;
            aligner.constraints.rejected.push(pair);
            Ok(())
        })
    })
}

/// Says how a table turned the object before a sensor that stood still: then only turns about its axis are looked for, whatever the
/// parameter turntable says. Replaces what was said of it before.
/// aligner    not NULL
/// point      3 doubles: a point of the axis, in the frame that all scans were taken in. NULL where the axis is to be found
/// direction  3 doubles: its direction, of any length but 0. NULL if point is
/// angles     by how much it was turned when each scan was taken, in the order of adding, counter-clockwise where the axis points to the
///            viewer, either way round without an axis. NULL where that is not known
/// count      scans that were added, 0 if angles is NULL
/// returns    SRF_OK, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_turn(
    aligner: *mut srf_aligner,
    point: *const f64,
    direction: *const f64,
    angles: *const f64,
    count: usize,
) -> srf_status {
    guard(|| {
        let axis = match (point.is_null(), direction.is_null()) {
            (true, true) => None,
            _ => Some(Axis { point: triple("point", point)?, direction: triple("direction", direction)? }),
        };
        let angles = pointer::numbers("angles", angles, count)?;
        change(aligner, |aligner| {
            let told = Constraints { axis, angles, ..Constraints::default() };
            told.validate(aligner.sources.len())?;
            (aligner.constraints.axis, aligner.constraints.angles) = (told.axis, told.angles);
            Ok(())
        })
    })
}

/// The 3 doubles behind a pointer.
fn triple(name: &str, numbers: *const f64) -> Result<DVec3, Failure> {
    Ok(DVec3::from_array(pointer::read(name, numbers.cast::<[f64; 3]>())?))
}

/// Brings what was added to one frame: that of the fixed scans, or of the largest one. A scan is placed only where overlap, how it is held
/// and uniqueness are sure. The others are told with the reason. Poses the scans have are used where they are fixed and where start says
/// that they are rough. The same to the bit for any number of threads and any order of adding. Blocks.
/// aligner        not NULL
/// params         NULL for the defaults
/// progress       NULL for none
/// out_alignment  receives a new handle on SRF_OK only. Not NULL
/// returns        SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for fewer than two scans, a pose that is not rigid, a pair that is both
///                trusted and rejected or angles for another number of scans, SRF_ERR_FORMAT, SRF_ERR_IO,
///                SRF_ERR_OUT_OF_MEMORY, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_run(
    aligner: *const srf_aligner,
    params: *const srf_align_params,
    progress: *const srf_progress,
    out_alignment: *mut *mut srf_alignment,
) -> srf_status {
    guard(|| {
        pointer::writable("out_alignment", out_alignment)?;
        let told = handle::get("aligner", aligner)?;
        let params: AlignParams = params::read("params", params)?;
        told.constraints.validate(told.sources.len())?;
        watched(progress, |progress| {
            let scans = prepared(aligner, &told, params.threads, progress)?;
            let found = scans.align(&params, &told.constraints, progress)?;
            handle::give("out_alignment", out_alignment, found.report.into())
        })
    })
}
