//! Loops that nothing else closes: a fan around one vertex that is moved to where the fan neither crosses anything nor lies in seen space.

use std::collections::BTreeMap;

use glam::DVec3;

use base::error::Result;
use base::progress::Progress;
use geom::triangles::cross;
use mesh::holes;

use super::crossing::Crossed;
use super::retreat::is_in_seen_space;
use super::stitch::Growing;
use super::surface::normal;
use super::visibility::Envelope;

/// Loops of more edges stay open: one vertex is no shape for them.
const MOST_EDGES: usize = 64;
/// Places at which the vertex is tried, in cells along the normal from the loop's middle: outwards last.
const TRIED: [f64; 10] = [0.0, -0.25, -0.5, -1.0, -1.5, -2.0, -3.0, 0.25, 0.5, 1.0];

/// Closes the loops for which a place is found. A fan adds no edge that was there before.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn close_loops(
    surface: &mut Growing,
    envelope: Option<Envelope<'_>>,
    cell: f64,
    progress: &Progress<'_>,
) -> Result<()> {
    let measured = surface.measured[0];
    let open = surface.open_with_triangles(progress)?;
    if open.is_empty() {
        return Ok(());
    }
    let normals: BTreeMap<u32, DVec3> = open
        .iter()
        .map(|(edge, triangle)| (edge[0], normal(triangle.map(|v| surface.positions[v as usize]))))
        .collect();
    let edges: Vec<[u32; 2]> = open.iter().map(|open| open.0).collect();
    let (loops, _) = holes::sort_out(&edges, |v| surface.positions[v as usize], |_| f64::INFINITY);
    let crossed = Crossed::new(&surface.positions, &surface.triangles, progress)?;
    let mut fans: Vec<[DVec3; 3]> = Vec::new();
    let mut added = Vec::new();
    for vertices in loops.iter().filter(|vertices| vertices.len() <= MOST_EDGES) {
        progress.check()?;
        let places: Vec<DVec3> = vertices.iter().map(|&v| surface.positions[v as usize]).collect();
        let middle = places.iter().sum::<DVec3>() / places.len() as f64;
        let up = vertices.iter().filter_map(|v| normals.get(v)).sum::<DVec3>().normalize_or_zero();
        let fan = |apex: DVec3| -> Vec<[DVec3; 3]> {
            (0..places.len()).map(|i| [places[i], places[(i + 1) % places.len()], apex]).collect()
        };
        let fits = |apex: &DVec3| -> Result<bool> {
            let own = fan(*apex);
            for (i, &triangle) in own.iter().enumerate() {
                let meets = own[..i].iter().chain(&fans).any(|&other| cross(triangle, other));
                let is_measured = [i, (i + 1) % own.len()].map(|k| (vertices[k] as usize) < measured);
                let is_measured = [is_measured[0], is_measured[1], false];
                let is_seen = envelope.is_some_and(|envelope| is_in_seen_space(triangle, is_measured, envelope, cell));
                if normal(triangle) == DVec3::ZERO || meets || is_seen || crossed.is_met(triangle, progress)? {
                    return Ok(false);
                }
            }
            Ok(true)
        };
        for offset in TRIED {
            let apex = middle + offset * cell * up;
            if fits(&apex)? {
                fans.extend(fan(apex));
                added.push((vertices.clone(), apex));
                break;
            }
        }
    }
    for (vertices, apex) in added {
        let centre = surface.positions.len() as u32;
        surface.positions.push(apex);
        let next = vertices.iter().cycle().skip(1);
        surface.triangles.extend(vertices.iter().zip(next).map(|(&a, &b)| [a, b, centre]));
    }
    Ok(())
}
