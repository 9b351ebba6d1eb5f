//! Charts by normal cones, each flattened by least squares conformal maps and made as rigid as possible: crate `uvunwrap`.
//! \[LPRM02\], \[LZX08\]

use uvunwrap::{Density, MeshInput, Options, Packing, generate_with_progress};

use base::error::{Error, Result};
use base::progress::Progress;
use glam::DVec2;

use super::charts::{Charts, NONE};
use super::params::UnwrapParams;
use super::surface::Surface;

/// Texels per unit at which charts are handed over: places do not matter yet, only that there is a page for them.
const DENSITY: f32 = 64.0;

/// Charts of the surface, flattened to their size in the unit box.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn flatten(surface: &Surface, params: &UnwrapParams, progress: &Progress<'_>) -> Result<Charts> {
    let positions: Vec<[f32; 3]> = surface.positions.iter().map(|p| p.as_vec3().to_array()).collect();
    let options = Options {
        max_chart_angle: params.cone.to_degrees() as f32,
        max_area_distortion: params.max_stretch as f32,
        density: Density::Fixed { texels_per_unit: DENSITY, page_size: None },
        padding: 0,
        packing: Packing::Fast,
        ..Options::default()
    };
    generated(&positions, surface.triangles.as_flattened(), None, &options, progress).map(|flat| flat.charts)
}

/// The result that the crate returned.
pub struct Generated {
    /// Its charts, in its units before they were scaled to texels.
    pub charts: Charts,
    /// Page of each triangle.
    pub page: Vec<u32>,
    /// Pages.
    pub pages: u32,
    /// Texels per unit.
    pub density: f64,
}

/// Coordinates that charts have already: of each vertex, and the chart of each triangle.
pub struct Known<'a> {
    /// Coordinates.
    pub uv: &'a [[f32; 2]],
    /// Charts.
    pub chart: &'a [u32],
    /// Triangles without one.
    pub ignored: &'a [bool],
}

/// Runs the crate. Progress counts triangles.
///
/// # Errors
/// [`Error::Cancelled`]. [`Error::Input`] if the charts do not fit.
pub fn generated(
    positions: &[[f32; 3]],
    indices: &[u32],
    known: Option<&Known<'_>>,
    options: &Options,
    progress: &Progress<'_>,
) -> Result<Generated> {
    let mut input = MeshInput::new(positions, indices);
    if let Some(known) = known {
        input.existing_uvs = Some(known.uv);
        input.face_materials = Some(known.chart);
        input.ignored_faces = Some(known.ignored);
    }
    let watch = |seen: uvunwrap::Progress| {
        if seen.stage == uvunwrap::Stage::Parameterizing {
            progress.reach(seen.done as u64);
        }
        progress.check().is_ok()
    };
    let mut atlas = generate_with_progress(&[input], options, watch).map_err(told)?;
    progress.check()?;
    let out = std::mem::take(&mut atlas.meshes[0]);
    let density = f64::from(atlas.texels_per_unit);
    let scale = DVec2::new(f64::from(atlas.width), f64::from(atlas.height)) / density;
    let corners = out.indices.as_chunks::<3>().0.to_vec();
    let vertex = out.vertices.iter().map(|v| v.xref).collect();
    let uv: Vec<DVec2> = out.vertices.iter().map(|v| DVec2::from(v.uv.map(f64::from)) * scale).collect();
    let first = |t: &[u32; 3]| &out.vertices[t[0] as usize];
    let has_area = |t: &[u32; 3]| uv[t[0] as usize] != uv[t[1] as usize] || uv[t[0] as usize] != uv[t[2] as usize];
    let chart = |t: &[u32; 3]| first(t).chart.filter(|_| has_area(t)).unwrap_or(NONE);
    let of = corners.iter().map(chart).collect();
    let page = corners.iter().map(|t| first(t).page.unwrap_or(0)).collect();
    Ok(Generated { charts: Charts { uv, vertex, corners, of }, page, pages: atlas.page_count, density })
}

/// The crate's errors as ours.
fn told(error: uvunwrap::Error) -> Error {
    match error {
        uvunwrap::Error::Cancelled => Error::Cancelled,
        uvunwrap::Error::ChartTooLarge { width, height, page_size } => Error::input(format!(
            "a chart takes {width} x {height} texels with its padding, but a tile has {page_size} x {page_size}. Use larger tiles, \
             fewer texels per unit, less padding or a smaller cone."
        )),
        uvunwrap::Error::AtlasTooLarge { texels } => Error::input(format!(
            "the charts would take {texels} texels, more than 2^30: use fewer texels per unit or smaller tiles"
        )),
        other => Error::input(format!("the mesh can't be unwrapped: {other}")),
    }
}
