//! Doubts about a surface and its scans: a surface that seems to be inside out, and scans that do not meet it.

use glam::DVec3;

use base::error::{Error, Result, Shown};
use base::log::{self, Level};
use base::progress::Progress;
use mesh::TriMesh;
use mesh::holes::Bounds;
use mesh::measure::area;

use super::report::Closed;
use super::surface::normal;
use super::visibility::{Scans, Visibility};

/// Faces that are looked at before and behind.
const FACES: usize = 2000;
/// Merge distances from a face at which scans are asked.
const BESIDE: f64 = 3.0;

/// Tells of scans that know where nothing is, but do not meet the surface.
///
/// # Errors
/// [`Error::Input`] if none of them meets it.
pub fn tell_elsewhere(mesh: &TriMesh, scans: &Scans, merge_distance: f64) -> Result<()> {
    let own = Bounds::of(mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize])).grown(merge_distance);
    let elsewhere: Vec<&(String, Bounds)> = scans.boxes().iter().filter(|(_, bounds)| !bounds.meets(&own)).collect();
    let Some((name, bounds)) = elsewhere.first() else { return Ok(()) };
    if elsewhere.len() == scans.boxes().len() {
        return Err(Error::input(format!(
            "no scan meets the surface: {name} lies around {}, the surface around {}: give the scans that it was merged of, with their poses",
            middle(bounds),
            middle(&own)
        )));
    }
    for (name, _) in elsewhere {
        let text =
            format!("{name}: this scan does not meet the surface: leave it out if the surface was not merged of it");
        log::tell(Level::Warning, &text);
    }
    Ok(())
}

fn middle(bounds: &Bounds) -> String {
    let [x, y, z] = (0.5 * (bounds.min + bounds.max)).to_array().map(|x| Shown::digits(x, 4));
    format!("({x}, {y}, {z})")
}

/// Tells of a surface whose outside seems to be inside: scans saw through behind it more often than before it. Without scans it is told by
/// where its faces look: away from their middle, or toward it.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn tell_turned(
    mesh: &TriMesh,
    visibility: &dyn Visibility,
    closed: &Closed,
    progress: &Progress<'_>,
) -> Result<()> {
    let filled = closed.report.added[1] > 0;
    if visibility.is_blind() && filled && looks_inward((0..mesh.triangles.len()).map(|t| mesh.corners(t))) {
        let text = "the surface looks toward its own middle: flip its faces and close it again, unless it is the inside of a thing";
        log::tell(Level::Warning, text);
    } else if !visibility.is_blind() && is_seen_from_behind(mesh, visibility, closed.report.merge_distance, progress)? {
        log::tell(Level::Warning, "the surface seems to be inside out: flip its faces, and close it again");
    }
    Ok(())
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
    let (mut before, mut behind) = (0, 0);
    for t in (0..mesh.triangles.len()).step_by(mesh.triangles.len().div_ceil(FACES).max(1)) {
        progress.check()?;
        let corners = mesh.corners(t);
        let (centre, way) = (corners.iter().sum::<DVec3>() / 3.0, BESIDE * merge_distance * normal(corners));
        let [front, back] = [way, -way].map(|way| visibility.is_empty_at(centre + way, merge_distance));
        before += usize::from(front && !back);
        behind += usize::from(back && !front);
    }
    Ok(behind > before)
}
