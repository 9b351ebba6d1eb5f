//! Closed surfaces of which the sensors saw one side only. The samples of a single view enclose a room behind it, or before it, and the
//! rest of the surface is a lid.
//!
//! A place from which samples are said to be seen, that need not be one: of a whole object someone may name any, to have it turned
//! towards that. Then lines of sight pass through the object.

use super::complex::Complex;
use super::facet_scale::TRUSTED;
use super::lines::Lines;
use super::seeds::seeds;
use super::seen::Sighted;
use super::spacing;
use base::error::Result;
use base::progress::Progress;

/// Share of the surface, as large as it looks from where its samples were seen, that shows its back whichever side is its front. Of what
/// one sensor saw from outside it is a half with any lid. Of a surface seen all round, what sensors did not see.
const BACKS: f64 = 0.2;

/// Share of the facets between neighbouring samples, as large as they look, through which lines of sight pass, from which no sensor is
/// where it is said to be. From a place beside a whole object these pass through all facets of the side towards it but for those that no
/// line happens to meet: a fifth to a half.
const PASSED: f64 = 0.1;

/// Whether the samples of a closed surface were seen from one side of it only. Not where no sensors are known.
pub(super) fn is_one_sided(
    complex: Complex<'_>,
    triangles: &[[u32; 3]],
    sighted: Sighted<'_>,
    progress: &Progress<'_>,
) -> Result<bool> {
    if sighted.seen.sensors.is_empty() {
        return Ok(false);
    }
    let points = complex.points;
    // Twice the area that a triangle has from where its samples were seen: positive for its front. None from a sensor that is not known.
    let areas = |triangle: [u32; 3]| {
        let [a, b, c] = triangle.map(|v| points[v as usize]);
        let normal = (b - a).cross(c - a);
        triangle.map(|v| normal.dot(sighted.toward_sensor(v as usize).normalize_or_zero()))
    };
    let (mut fronts, mut backs) = (0.0, 0.0);
    for block in progress.blocks(triangles) {
        for area in block?.iter().flat_map(|&triangle| areas(triangle)) {
            fronts += f64::max(area, 0.0);
            backs += f64::max(-area, 0.0);
        }
    }
    if f64::min(fronts, backs) <= BACKS * (fronts + backs) {
        return Ok(false);
    }
    let spacings = spacing::all(complex, progress)?;
    let lines = Lines::of(sighted, |sample| 3.0 * TRUSTED * spacings[sample as usize], progress)?;
    let (mut looked_at, mut passed) = (0.0, 0.0);
    for triangle in seeds(triangles.len()).map(|seed| triangles[seed]) {
        progress.check()?;
        if complex.perimeter(triangle) <= TRUSTED * triangle.iter().map(|&v| spacings[v as usize]).sum::<f64>() {
            let area = areas(triangle).iter().sum::<f64>().abs();
            looked_at += area;
            passed += if lines.pass(points, triangle) { area } else { 0.0 };
        }
    }
    Ok(passed <= PASSED * looked_at)
}
