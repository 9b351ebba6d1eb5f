//! The mesh with its vertices split at seams, and the figures of its coordinates.

use glam::DVec2;

use mesh::{Attribute, TriMesh, texture};

use super::charts::{Charts, NONE};
use super::join::{area_vector, stretches};
use super::params::UnwrapParams;
use super::report::{UnwrapReport, Unwrapped};

/// Attribute of vertices: the vertex of the input.
const SOURCE: &str = "source_vertex";
/// Attribute of triangles: their charts.
const CHART: &str = "chart";

/// The mesh with the coordinates of `charts`, and what is measured of them.
pub fn finish(input: &TriMesh, mut charts: Charts, params: &UnwrapParams, mut report: UnwrapReport) -> Unwrapped {
    report.charts = charts.renumber();
    measure(input, &charts, params, &mut report);
    let Charts { uv, vertex, corners, of } = charts;
    let (uv, source, triangles) = without_unused(&uv, &vertex, corners);
    let places: Vec<usize> = source.iter().map(|&v| v as usize).collect();
    let chart: Vec<i32> = of.iter().map(|&chart| if chart == NONE { -1 } else { chart as i32 }).collect();
    let is_other = |a: &&Attribute| ![texture::S, texture::T, SOURCE, CHART].contains(&a.name.as_str());
    let mut vertex_attributes: Vec<_> =
        input.vertex_attributes.iter().filter(is_other).map(|a| a.gather(&places)).collect();
    vertex_attributes.extend([
        Attribute::f32(texture::S, uv.iter().map(|at| at.x as f32).collect()),
        Attribute::f32(texture::T, uv.iter().map(|at| at.y as f32).collect()),
        Attribute::i32(SOURCE, source.iter().map(|&v| v as i32).collect()),
    ]);
    let mut face_attributes: Vec<_> = input.face_attributes.iter().filter(is_other).cloned().collect();
    face_attributes.push(Attribute::i32(CHART, chart.clone()));
    let mesh = TriMesh {
        positions: places.iter().map(|&v| input.positions[v]).collect(),
        triangles,
        vertex_attributes,
        face_attributes,
        rounding_room: input.rounding_room,
        crs: input.crs.clone(),
    };
    Unwrapped { mesh, uv, source, chart, report }
}

/// Share of the tiles, texels per unit, stretch, and what has no area.
fn measure(input: &TriMesh, charts: &Charts, params: &UnwrapParams, report: &mut UnwrapReport) {
    let (mut covered, mut area, mut lost) = (0.0, 0.0, 0.0);
    for t in 0..charts.of.len() {
        let on_surface = area_vector(input.corners(t)).length() / 2.0;
        if charts.of[t] == NONE {
            report.collapsed += 1;
            lost += on_surface;
            continue;
        }
        let [a, b, c] = charts.triangle(t);
        covered += (b - a).perp_dot(c - a) / 2.0;
        area += on_surface;
    }
    report.used = covered / report.tiles.max(1) as f64;
    report.collapsed_area = if lost > 0.0 { lost / (lost + area) } else { 0.0 };
    let per_unit = if area > 0.0 { (covered / area).sqrt() } else { 0.0 };
    report.texels_per_unit = per_unit * f64::from(params.size);
    let mut stretched = Vec::new();
    for t in (0..charts.of.len()).filter(|&t| charts.of[t] != NONE) {
        let uv = charts.triangle(t).map(|at| at / per_unit);
        if let Some([most, least]) = stretches(input.corners(t), uv).filter(|[_, least]| *least > 0.0) {
            stretched.push((most.max(1.0 / least), area_vector(input.corners(t)).length()));
        }
    }
    stretched.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole: f64 = stretched.iter().map(|(_, area)| area).sum();
    if whole > 0.0 {
        report.stretch = stretched.iter().map(|(stretch, area)| stretch * area).sum::<f64>() / whole;
        let mut below = 0.0;
        let at = stretched.iter().find(|(_, area)| {
            below += area;
            below >= 0.95 * whole
        });
        report.stretch_p95 = at.map_or(1.0, |(stretch, _)| *stretch);
    }
}

/// Places that triangles use, in the order of the vertices they belong to.
fn without_unused(uv: &[DVec2], vertex: &[u32], mut triangles: Vec<[u32; 3]>) -> (Vec<DVec2>, Vec<u32>, Vec<[u32; 3]>) {
    let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    used.sort_by_key(|&place| (vertex[place as usize], place));
    let mut number = vec![NONE; uv.len()];
    for (new, &place) in used.iter().enumerate() {
        number[place as usize] = new as u32;
    }
    triangles.iter_mut().flatten().for_each(|place| *place = number[*place as usize]);
    let at = used.iter().map(|&place| uv[place as usize]).collect();
    (at, used.iter().map(|&place| vertex[place as usize]).collect(), triangles)
}
