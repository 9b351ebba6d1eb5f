//! Doubts about a surface and its scans: a surface that seems to be inside out, and scans that do not meet it. They go into the log, and into
//! the report.

use glam::DVec3;

use base::error::{Error, Result, Shown};
use base::log::{self, Level};
use base::progress::Progress;
use mesh::TriMesh;
use mesh::holes::Bounds;
use mesh::measure::area;

use super::report::{CloseReport, CloseWarning, Doubt};
use super::surface::normal;
use super::visibility::{Scans, Visibility};

/// Faces that are looked at before and behind.
const FACES: usize = 2000;
/// Merge distances from a face at which scans are asked.
const BESIDE: f64 = 3.0;
/// Share of the faces beside which scans saw through that must lie before such space. Beside thin walls they saw through on both sides, and
/// the few other faces decide nothing.
const MANY: f64 = 0.25;

/// Puts a doubt into words, and into the log.
fn told(kind: Doubt, text: String) -> CloseWarning {
    log::tell(Level::Warning, &text);
    CloseWarning { kind, text }
}

/// Scans that know where nothing is, but do not meet the surface.
///
/// # Errors
/// [`Error::Input`] if none of them meets it.
pub fn elsewhere(mesh: &TriMesh, scans: &Scans, merge_distance: f64) -> Result<Vec<CloseWarning>> {
    let own = Bounds::of(mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize])).grown(merge_distance);
    let elsewhere: Vec<&(String, Bounds)> = scans.boxes().iter().filter(|(_, bounds)| !bounds.meets(&own)).collect();
    let Some((name, bounds)) = elsewhere.first() else { return Ok(Vec::new()) };
    if elsewhere.len() == scans.boxes().len() {
        return Err(Error::input(format!(
            "no scan meets the surface: {} lies around {}, the surface around {}: give the scans that it was merged of, with their poses",
            if name.is_empty() { "the first" } else { name },
            middle(bounds),
            middle(&own)
        )));
    }
    let of = |name: &str| {
        format!("{name}: this scan does not meet the surface: leave it out if the surface was not merged of it")
    };
    Ok(elsewhere.into_iter().map(|(name, _)| told(Doubt::Elsewhere, of(name))).collect())
}

fn middle(bounds: &Bounds) -> String {
    let [x, y, z] = (0.5 * (bounds.min + bounds.max)).to_array().map(|x| Shown::digits(x, 4));
    format!("({x}, {y}, {z})")
}

/// A surface whose outside seems to be inside: scans saw through behind it more often than before it. Without scans it is told by
/// where its faces look: away from their middle, or toward it.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn turned(
    mesh: &TriMesh,
    visibility: &dyn Visibility,
    report: &CloseReport,
    progress: &Progress<'_>,
) -> Result<Option<CloseWarning>> {
    let is_filled = report.added[1] > 0;
    if visibility.is_blind() && is_filled && looks_inward((0..mesh.triangles.len()).map(|t| mesh.corners(t))) {
        let text = "the surface looks toward its own middle: flip its faces and close it again, unless it is the inside of a thing";
        return Ok(Some(told(Doubt::LooksInward, text.to_owned())));
    }
    if !visibility.is_blind() && is_seen_from_behind(mesh, visibility, report.merge_distance, progress)? {
        let text = "the surface seems to be inside out: flip its faces, and close it again";
        return Ok(Some(told(Doubt::InsideOut, text.to_owned())));
    }
    Ok(None)
}

/// Whether faces look toward their own middle.
pub fn looks_inward(faces: impl Iterator<Item = [DVec3; 3]> + Clone) -> bool {
    let centre = |[a, b, c]: [DVec3; 3]| (a + b + c) / 3.0;
    let whole: f64 = faces.clone().map(area).sum();
    let middle = faces.clone().map(|corners| centre(corners) * area(corners)).sum::<DVec3>() / whole;
    let outward = |corners| (centre(corners) - middle).dot(normal(corners)) * area(corners);
    faces.map(outward).sum::<f64>() < 0.0
}

fn is_seen_from_behind(
    mesh: &TriMesh,
    visibility: &dyn Visibility,
    merge_distance: f64,
    progress: &Progress<'_>,
) -> Result<bool> {
    let [mut before, mut behind, mut known] = [0, 0, 0];
    for t in (0..mesh.triangles.len()).step_by(mesh.triangles.len().div_ceil(FACES).max(1)) {
        progress.check()?;
        let corners = mesh.corners(t);
        let (centre, way) = (corners.iter().sum::<DVec3>() / 3.0, BESIDE * merge_distance * normal(corners));
        let [front, back] = [way, -way].map(|way| visibility.is_empty_at(centre + way, merge_distance));
        before += u32::from(front && !back);
        behind += u32::from(back && !front);
        known += u32::from(front || back);
    }
    Ok(behind > before && f64::from(behind) > MANY * f64::from(known))
}
