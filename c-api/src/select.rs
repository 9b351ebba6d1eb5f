//! Selections: the parts of scans that are kept or removed, and the size and place that they are given.

use surfrecon::select::{Selection, Similarity};

use crate::cloud::srf_cloud;
use crate::files::{at, srf_scans};
use crate::guard::guard;
use crate::handle::{self, Handle};
use crate::image::srf_image;
use crate::mesh::srf_mesh;
use crate::pointer;
use crate::pose::{self, srf_pose};
use crate::progress::{srf_progress, watched};
use crate::region::{similarity, srf_region};
use crate::status::{Failure, flag, srf_status};

fn selection(region: *const srf_region, keep: u32) -> Result<Selection, Failure> {
    let keep = flag("keep", keep)?;
    Ok(Selection { region: handle::get("region", region)?.as_ref().clone(), keep })
}

/// Edits what a handle stands for. The work is done on a copy: the caller's progress may look at the handle.
fn edited<H: Handle, T>(
    name: &str,
    handle: *mut H,
    edit: impl FnOnce(&mut H::Inner) -> Result<T, Failure>,
) -> Result<T, Failure>
where
    H::Inner: Clone,
{
    let mut copy = handle::get(name, handle.cast_const())?.as_ref().clone();
    let told = edit(&mut copy)?;
    handle::change(name, handle.cast_const(), |inner| {
        *inner = copy;
        Ok(())
    })?;
    Ok(told)
}

fn removed(out_removed: *mut usize, count: usize) -> Result<(), Failure> {
    if out_removed.is_null() { Ok(()) } else { pointer::write("out_removed", out_removed, count) }
}

/// Keeps or removes the samples of an image that lie in a region. Grid, projection and pose stay: what goes are invalid pixels, through
/// which a merge does not see. Views of the image are gone.
/// image        not NULL
/// region       a mask of the image's size, a box or a plane. Not NULL
/// keep         1: what the region holds stays, all else goes. 0: the other way round
/// progress     NULL for none
/// out_removed  receives the number of samples that went. NULL if not wanted
/// returns      SRF_OK, SRF_ERR_INPUT for a mask of another size, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL,
///              SRF_ERR_OUT_OF_MEMORY. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_select(
    image: *mut srf_image,
    region: *const srf_region,
    keep: u32,
    progress: *const srf_progress,
    out_removed: *mut usize,
) -> srf_status {
    guard(|| {
        let selection = selection(region, keep)?;
        watched(progress, |progress| {
            removed(out_removed, edited("image", image, |image| Ok(selection.of_image(&mut image.image, progress)?))?)
        })
    })
}

/// Keeps or removes the points of a cloud that lie in a region. Views of the cloud are gone.
/// cloud        not NULL
/// region       a mask of as many marks as points, a box or a plane. Not NULL
/// keep         as for srf_image_select()
/// progress     NULL for none
/// out_removed  receives the number of points that went. NULL if not wanted
/// returns      SRF_OK, SRF_ERR_INPUT for a mask of another size, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL.
///              Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_select(
    cloud: *mut srf_cloud,
    region: *const srf_region,
    keep: u32,
    progress: *const srf_progress,
    out_removed: *mut usize,
) -> srf_status {
    guard(|| {
        let selection = selection(region, keep)?;
        watched(progress, |progress| {
            removed(out_removed, edited("cloud", cloud, |cloud| Ok(selection.of_cloud(cloud, progress)?))?)
        })
    })
}

/// Keeps or removes the vertices of a mesh that lie in a region. Faces whose three vertices stay are kept. Order and attributes stay. Views
/// of the mesh are gone.
/// mesh             not NULL
/// world_from_mesh  where the mesh lies. NULL for the identity
/// region           a mask of as many marks as vertices, a box or a plane. Not NULL
/// keep             as for srf_image_select()
/// progress         NULL for none
/// out_removed      receives the number of vertices that went. NULL if not wanted
/// returns          SRF_OK, SRF_ERR_INPUT for a mask of another size, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
///                  SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_select(
    mesh: *mut srf_mesh,
    world_from_mesh: *const srf_pose,
    region: *const srf_region,
    keep: u32,
    progress: *const srf_progress,
    out_removed: *mut usize,
) -> srf_status {
    guard(|| {
        let selection = selection(region, keep)?;
        let place = pose::read("world_from_mesh", world_from_mesh)?;
        watched(progress, |progress| {
            removed(out_removed, edited("mesh", mesh, |mesh| Ok(selection.of_mesh(&mut mesh.mesh, place, progress)?))?)
        })
    })
}

/// Keeps or removes samples of scans of a set, whenever they are read, merged or aligned from now on: nothing is read now. Selections
/// stay with the samples where scans are placed elsewhere later. A scan may end up without samples: merging passes over it.
/// scans      not NULL
/// index      less than the number of scans. SIZE_MAX for all of them
/// region     a box, a plane, or a mask of the scan, whose size is checked when it is read. Not NULL
/// keep       as for srf_image_select()
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scans_select(
    scans: *mut srf_scans,
    index: usize,
    region: *const srf_region,
    keep: u32,
) -> srf_status {
    guard(|| {
        let selection = selection(region, keep)?;
        edited("scans", scans, |scans| {
            if index != usize::MAX {
                at(&scans.set.scans, index)?;
            }
            let chosen = |number: &usize| index == usize::MAX || *number == index;
            for number in (0..scans.set.scans.len()).filter(chosen) {
                scans.set.scans[number].select(selection.clone());
            }
            Ok(())
        })
    })
}

/// Gives all scans of a set another size and place: poses now, samples whenever they are read. Poses stay rigid.
/// scans       not NULL
/// similarity  of srf_true_size(), srf_ground(), or their product: a scale, a rotation and a translation. Not NULL
/// returns     SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scans_transform(scans: *mut srf_scans, similarity: *const srf_pose) -> srf_status {
    guard(|| {
        transformed("scans", scans, similarity, |similarity, scans| {
            scans.set.scans.iter_mut().try_for_each(|scan| scan.transform(similarity))
        })
    })
}

/// Gives an image another size and place: samples are scaled, the pose stays rigid. Views of the image are gone.
/// image       not NULL
/// similarity  as for srf_scans_transform(). Not NULL
/// returns     SRF_OK, SRF_ERR_INPUT for samples that become too large or too small, SRF_ERR_HANDLE, SRF_ERR_NULL,
///             SRF_ERR_OUT_OF_MEMORY. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_transform(image: *mut srf_image, similarity: *const srf_pose) -> srf_status {
    guard(|| transformed("image", image, similarity, |similarity, image| similarity.of_image(&mut image.image)))
}

/// Gives a cloud another size and place: points are scaled, the rest goes into its place in the world. Views of the cloud are gone.
/// cloud       not NULL
/// similarity  as for srf_scans_transform(). Not NULL
/// returns     SRF_OK, SRF_ERR_INPUT for what becomes too large or too small, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_transform(cloud: *mut srf_cloud, similarity: *const srf_pose) -> srf_status {
    guard(|| transformed("cloud", cloud, similarity, |similarity, cloud| similarity.of_cloud(cloud)))
}

/// Scales, turns and shifts the vertices of a mesh, and scales its attributes that are lengths. Views of the mesh are gone.
/// mesh        not NULL
/// similarity  as for srf_scans_transform(). Not NULL
/// returns     SRF_OK, SRF_ERR_INPUT for what becomes too large or too small, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_transform(mesh: *mut srf_mesh, similarity: *const srf_pose) -> srf_status {
    guard(|| transformed("mesh", mesh, similarity, |similarity, mesh| similarity.of_mesh(&mut mesh.mesh)))
}

fn transformed<H: Handle>(
    name: &str,
    handle: *mut H,
    given: *const srf_pose,
    apply: impl FnOnce(&Similarity, &mut H::Inner) -> surfrecon::Result<()>,
) -> Result<(), Failure>
where
    H::Inner: Clone,
{
    edited(name, handle, |inner| Ok(apply(&similarity("similarity", given)?, inner)?))
}
