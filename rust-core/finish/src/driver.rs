//! The driver: the steps in their order.

use base::error::Result;
use base::progress::{Plan, Progress};
use close::{CloseParams, Openings};
use cluster::{ClusterParams, Resolution};
use image::photo::Photo;
use image::source::ScanSource;
use mesh::{TriMesh, check};
use texture::{TextureParams, Textured};
use unwrap::{UnwrapParams, UnwrapReport};

use super::params::{FinishParams, Lightness};
use super::parts;
use super::report::{FinishReport, Finished, FinishedLevel, TexturedLevel};

/// The stages of the operations that it consists of. Closing takes no time unless it is asked for.
const PLAN: Plan = &[
    (close::PLAN[0].0, 0.02),
    (close::PLAN[1].0, 0.02),
    (close::PLAN[2].0, 0.1),
    (close::PLAN[3].0, 0.05),
    (close::PLAN[4].0, 0.01),
    (cluster::PLAN[0].0, 0.2),
    (unwrap::PLAN[0].0, 0.06),
    (unwrap::PLAN[1].0, 0.01),
    (unwrap::PLAN[2].0, 0.03),
    (unwrap::PLAN[3].0, 0.01),
    (texture::PLAN[0].0, 0.05),
    (texture::PLAN[1].0, 0.1),
    (texture::PLAN[2].0, 0.09),
    (texture::PLAN[3].0, 0.2),
    (texture::PLAN[4].0, 0.05),
];
/// Places of their first stages.
const CLOSING: usize = 0;
const REDUCING: usize = CLOSING + close::PLAN.len();
const UNWRAPPING: usize = REDUCING + cluster::PLAN.len();
const TEXTURING: usize = UNWRAPPING + unwrap::PLAN.len();

/// Triangles of the first level, unless something else is asked for.
const TRIANGLES: u32 = 10_000;
/// Each level has this part of the triangles of the one before.
const FEWER: u32 = 4;
/// The smallest number of triangles that is asked of a level.
const LEAST: u32 = 4;

/// Makes a light model with textures of a merged surface.
///
/// Small parts are dropped. Openings are closed if that is asked for: `scans` say where nothing is. The rest is the detailed surface. Light
/// meshes of it get texture coordinates. Their images show the photos, or where no photo sees the colours of the surface's vertices.
///
/// # Guarantees
/// * The distance of each level from the detailed surface is certified, both ways.
/// * No triangle is flipped in the images, and no two overlap.
/// * The same model for any number of threads and any order of the scans and photos.
///
/// # Cost
/// It costs what [`close::close`] and [`cluster::levels`] cost, and for each level [`unwrap::unwrap`] and [`texture::run`].
///
/// # Errors
/// Parameters out of range, or of no use with the others. Those of the operations named above. [`base::Error::OutOfMemory`].
/// [`base::Error::Cancelled`].
pub fn finish(
    surface: &TriMesh,
    scans: &[&dyn ScanSource],
    photos: &[&dyn Photo],
    params: &FinishParams,
    progress: &Progress<'_>,
) -> Result<Finished> {
    params.validate()?;
    params.go_together()?;
    surface.validate()?;
    texture::refuse_colourless(surface, photos)?;
    progress.plan(PLAN);
    progress.watch_operations(|| steps(surface, scans, photos, params, progress))
}

fn steps(
    surface: &TriMesh,
    scans: &[&dyn ScanSource],
    photos: &[&dyn Photo],
    params: &FinishParams,
    progress: &Progress<'_>,
) -> Result<Finished> {
    let mut report = FinishReport::default();
    let (mut detail, dropped) = parts::without_small(surface, params.min_component_share, progress)?;
    report.dropped_components = dropped;
    progress.lap("parts");
    if params.close != Openings::None {
        let closed = close::close(&detail, scans, &closing(params), &progress.part(CLOSING))?;
        (detail, report.closed) = (closed.mesh, closed.report.closed);
        progress.lap("closing");
    }
    (report.detail, report.is_closed) = (detail.triangles.len(), check(&detail).is_closed());
    let reducing = ClusterParams { threads: params.threads, ..ClusterParams::default() };
    let light = cluster::levels(&detail, &resolutions(params), &reducing, &progress.part(REDUCING))?;
    progress.lap("reducing");
    let mut finished = Finished::default();
    for (number, light) in light.into_iter().enumerate() {
        // The first level takes most of the time.
        let part = |first: usize| if number == 0 { progress.part(first) } else { progress.unseen() };
        let size = params.texture >> number;
        let bare = TriMesh { vertex_attributes: Vec::new(), face_attributes: Vec::new(), ..light.mesh };
        let unwrapped = unwrap::unwrap(&bare, &unwrapping(size, params), &part(UNWRAPPING))?;
        let mut mesh = unwrapped.mesh;
        mesh.vertex_attributes.retain(|of| mesh::texture::has_name(&of.name));
        mesh.face_attributes.clear();
        progress.lap("unwrapping");
        let textured = texture::run(&mesh, &detail, photos, &texturing(size, params), &part(TEXTURING))?;
        progress.lap("texturing");
        let errors = [light.report.max_error, light.report.rms_error];
        report.levels.push(figures(&mesh, errors, &unwrapped.report, &textured));
        if number == 0 {
            report.photos = textured.report.photos;
            report.differences = textured.report.differences;
            finished.world_from_camera = textured.world_from_camera;
        }
        finished.levels.push(TexturedLevel { mesh, images: textured.images });
    }
    report.seconds = progress.seconds();
    Ok(Finished { detail, report, ..finished })
}

fn closing(params: &FinishParams) -> CloseParams {
    let &FinishParams { close: openings, flat_base, base_up, threads, .. } = params;
    CloseParams { openings, flat_base, base_up, threads, ..CloseParams::default() }
}

/// How fine each level is.
fn resolutions(params: &FinishParams) -> Vec<Resolution> {
    let of_level = |number: u32| match params.lightness {
        Lightness::MaxError(error) => Resolution::MaxError(error * f64::from(1 << number)),
        Lightness::Triangles(count) => fewer(count, number),
        Lightness::Usual => fewer(TRIANGLES, number),
    };
    (0..params.levels).map(of_level).collect()
}

fn fewer(triangles: u32, level: u32) -> Resolution {
    Resolution::Triangles((triangles / FEWER.pow(level)).max(LEAST))
}

fn unwrapping(size: u32, params: &FinishParams) -> UnwrapParams {
    UnwrapParams { size, padding: params.padding, threads: params.threads, ..UnwrapParams::default() }
}

fn texturing(size: u32, params: &FinishParams) -> TextureParams {
    TextureParams {
        size,
        refine_cameras: params.refine_cameras,
        match_exposure: params.match_exposure,
        drop_highlights: params.drop_highlights,
        normal_map: params.normal_map,
        height_map: false,
        occlusion_rays: params.occlusion_rays,
        threads: params.threads,
    }
}

fn figures(
    mesh: &TriMesh,
    [max_error, rms_error]: [f64; 2],
    charts: &UnwrapReport,
    textured: &Textured,
) -> FinishedLevel {
    let &UnwrapReport { charts, used, texels_per_unit, stretch_p95, .. } = charts;
    let [seen, texels] = [textured.report.seen, textured.report.texels].map(|count| count as f64);
    FinishedLevel {
        triangles: mesh.triangles.len(),
        max_error,
        rms_error,
        size: textured.images.size as usize,
        charts,
        used,
        texels_per_unit,
        stretch_p95,
        unseen: if texels > 0.0 { 1.0 - seen / texels } else { 0.0 },
    }
}
