//! Closes merges of virtual scans of closed shapes, of which a known share was not seen, and says how far the filled part lies from the
//! truth.
//!
//! ```sh
//! cargo run --release -p surfrecon --example close_figures -- FOLDER            # writes FOLDER/*.merged.ply and the figures
//! python rust-core/examples/close_poisson.py FOLDER                                   # Screened Poisson of the same surfaces
//! cargo run --release -p surfrecon --example close_figures -- FOLDER            # once more: both side by side
//! ```
//!
//! Filled is what lies farther than 1.5 cells from the merged surface. It is in seen space where a scan sees past it by more than the merge
//! distance and half a cell, in all of 3 x 3 pixels. Heads and figures are read from the folder that `SURFRECON_DATA` names, if there is
//! one. Every figure is of one thread. The judge shares no code with what it judges.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::path::{Path, PathBuf};

use glam::DVec3;

use base::error::{Error, Result};
use base::progress::Progress;
use close::CloseParams;
use geom::bvh::Bvh;
use image::range_image::{Projection, RangeImage, Samples};
use io::export::{PlyEncoding, write_ply};
use io::import::{self, Content};
use merge::{MergeParams, ScanSource};
use mesh::TriMesh;
use mesh::measure::{Side, bounds, deviation};
use scan::shapes::Shape;
use scan::{ScanParams, VirtualCamera, scan};

/// Longest side of each object, mm.
const SIZE: f64 = 220.0;
const PIXELS: usize = 260;
const DISTANCE: f64 = 500.0;

struct Case {
    name: &'static str,
    /// Azimuths and elevations of the views, degrees.
    views: Vec<[f64; 2]>,
    /// In cells.
    noise: f64,
    /// Whether it is closed with a flat base.
    stands: bool,
}

fn ring(count: usize, first: f64, elevation: f64) -> impl Iterator<Item = [f64; 2]> {
    (0..count).map(move |i| [first + 360.0 * i as f64 / count as f64, elevation])
}

fn cases() -> Vec<Case> {
    let few = || ring(8, 0.0, 10.0).chain(ring(4, 20.0, 50.0)).collect::<Vec<_>>();
    let some = || ring(4, 20.0, 20.0).collect::<Vec<_>>();
    let half = || vec![[0.0, 20.0], [75.0, 15.0], [150.0, 25.0]];
    let of = |name, views, noise| Case { name, views, noise, stands: false };
    vec![
        of("ball few", few(), 0.0),
        of("ball half", half(), 0.0),
        of("torus few", few(), 0.0),
        of("torus half", half(), 0.0),
        of("igea few", few(), 0.0),
        of("igea some", some(), 0.0),
        of("igea some, noise", some(), 0.5),
        of("igea half", half(), 0.0),
        of("armadillo few", few(), 0.0),
        of("armadillo some", some(), 0.0),
        of("armadillo half", half(), 0.0),
        of("sculpture few", few(), 0.0),
        Case { stands: true, ..of("sculpture few, flat base", few(), 0.0) },
        Case { stands: true, ..of("sculpture some, flat base", some(), 0.0) },
    ]
}

fn truth(name: &str) -> Result<Option<TriMesh>> {
    let data = |file: &str| -> Result<Option<TriMesh>> {
        let Some(folder) = std::env::var_os("SURFRECON_DATA") else { return Ok(None) };
        let set = import::open(&PathBuf::from(folder).join("meshes").join(file))?;
        match set.scans.first().map(|scan| scan.read()).transpose()? {
            Some(Content::Mesh(mesh)) => Ok(Some(mesh)),
            _ => Err(Error::input(format!("{file} holds no mesh"))),
        }
    };
    let mut mesh = match name.split(' ').next().unwrap_or_default() {
        "ball" => Shape::Sphere { radius: 1.0 }.mesh(60),
        "torus" => Shape::Torus { major: 1.0, minor: 0.4 }.mesh(60),
        "sculpture" => scan::sculpture::sculpture(1.5, 0, &Progress::none())?,
        "igea" => match data("igea.ply")? {
            Some(mesh) => mesh,
            None => return Ok(None),
        },
        _ => match data("libigl_armadillo.obj")? {
            // It stands along y.
            Some(mut mesh) => {
                mesh.positions.iter_mut().for_each(|p| *p = DVec3::new(p.x, -p.z, p.y));
                mesh
            }
            None => return Ok(None),
        },
    };
    let (lo, hi) = bounds(&mesh.positions).ok_or_else(|| Error::input("no vertices"))?;
    let scale = SIZE / (hi - lo).max_element();
    mesh.positions.iter_mut().for_each(|p| *p = (*p - 0.5 * (lo + hi)) * scale);
    mesh.vertex_attributes.clear();
    mesh.face_attributes.clear();
    Ok(Some(mesh))
}

fn cameras(case: &Case) -> Result<Vec<VirtualCamera>> {
    let place = |&[azimuth, elevation]: &[f64; 2]| {
        let (a, e) = (azimuth.to_radians(), elevation.to_radians());
        let eye = DISTANCE * DVec3::new(a.cos() * e.cos(), a.sin() * e.cos(), e.sin());
        VirtualCamera::pinhole(PIXELS, PIXELS, 2.0 * (0.62 * SIZE / DISTANCE).atan(), eye, DVec3::ZERO, DVec3::Z)
    };
    case.views.iter().map(place).collect()
}

fn scans(case: &Case, truth: &TriMesh, cell: f64) -> Result<Vec<RangeImage>> {
    let bvh = Bvh::build(&truth.positions, &truth.triangles, 0)?;
    let params = |seed| ScanParams { noise: case.noise * cell, seed, ..ScanParams::default() };
    let shoot = |(i, camera): (usize, VirtualCamera)| scan(truth, &bvh, &camera, &params(i as u64), &Progress::none());
    cameras(case)?.into_iter().enumerate().map(shoot).collect()
}

/// Points all over a mesh, at the pitch or finer, with the area that each stands for.
fn sprinkle(mesh: &TriMesh, pitch: f64) -> Vec<(DVec3, f64)> {
    let mut points = Vec::new();
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let n = (longest / pitch).ceil().clamp(1.0, 400.0) as usize;
        let area = 0.5 * (b - a).cross(c - a).length() / (n * n) as f64;
        for i in 0..n {
            for j in 0..n - i {
                let at = |x: f64, y: f64| a + (b - a) * (x / n as f64) + (c - a) * (y / n as f64);
                let (x, y) = (i as f64, j as f64);
                points.push((at(x + 1.0 / 3.0, y + 1.0 / 3.0), area));
                if j + 1 < n - i {
                    points.push((at(x + 2.0 / 3.0, y + 2.0 / 3.0), area));
                }
            }
        }
    }
    points
}

/// Whether an image sees past a place by more than `slack`, in all of 3 x 3 pixels: marched by itself, without lines of sight.
fn is_past(image: &RangeImage, place: DVec3, slack: f64) -> bool {
    let (Projection::Pinhole { focal, centre, .. }, Samples::Values(values)) = (*image.projection(), image.samples())
    else {
        return false;
    };
    let at = image.world_from_sensor.inverse().transform_point3(place);
    let (col, row) = (centre[0] + focal[0] * at.x / at.z, centre[1] + focal[1] * at.y / at.z);
    let (row, col) = (row.round() as i64, col.round() as i64);
    (-1..=1).all(|r| {
        (-1..=1).all(|c| {
            let (row, col) = (row + r, col + c);
            let inside = row >= 0 && col >= 0 && row < image.rows() as i64 && col < image.cols() as i64;
            inside && values[row as usize * image.cols() + col as usize] > at.z + slack * at.z / at.length()
        })
    })
}

/// Seconds of all threads of this process, where the system tells. Else of the clock.
fn cpu_seconds() -> f64 {
    let ticks = || -> Option<f64> {
        let text = std::fs::read_to_string("/proc/self/stat").ok()?;
        let fields: Vec<&str> = text.rsplit(')').next()?.split_whitespace().collect();
        Some(fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?)
    };
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    let elapsed = START.get_or_init(std::time::Instant::now).elapsed().as_secs_f64();
    ticks().map_or(elapsed, |ticks| ticks / 100.0)
}

/// Pairs of triangles that cross, of which one at least was filled.
fn crossings(mesh: &TriMesh, first: usize) -> Result<usize> {
    let pairs = close::crossing_pairs(mesh, &Progress::none())?;
    Ok(pairs.iter().filter(|pair| pair[1] as usize >= first).count())
}

struct Judged {
    filled: f64,
    seen: f64,
    rms: f64,
    worst: f64,
    all: f64,
    open: usize,
    parts: usize,
}

fn judge(
    result: &TriMesh,
    merged: &TriMesh,
    truth: &TriMesh,
    images: &[RangeImage],
    cell: f64,
    slack: f64,
) -> Result<Judged> {
    let points = sprinkle(result, 0.5 * cell);
    let places: Vec<DVec3> = points.iter().map(|p| p.0).collect();
    let quiet = Progress::none();
    let to_merged = deviation(&places, merged, Side::Ignored, 0, &quiet)?.distances;
    let to_truth = deviation(&places, truth, Side::Ignored, 0, &quiet)?.distances;
    let (mut area, mut seen, mut squares, mut all, mut all_squares, mut worst) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0_f64);
    for (i, &(place, share)) in points.iter().enumerate() {
        all += share;
        all_squares += share * to_truth[i] * to_truth[i];
        if to_merged[i] <= 1.5 * cell {
            continue;
        }
        area += share;
        squares += share * to_truth[i] * to_truth[i];
        worst = worst.max(to_truth[i]);
        if images.iter().any(|image| is_past(image, place, slack)) {
            seen += share;
        }
    }
    let report = mesh::check(result);
    Ok(Judged {
        filled: area / all,
        seen: seen / area.max(1e-300),
        rms: (squares / area.max(1e-300)).sqrt(),
        worst,
        all: (all_squares / all).sqrt(),
        open: report.boundary_edges,
        parts: report.components,
    })
}

fn say(tool: &str, judged: &Judged, seconds: f64) {
    println!(
        "  {tool:10} filled {:5.1} %  rms {:6.3} mm  worst {:6.2}  whole {:6.3}  seen {:6.3} %  open {:4}  parts {:2}  {:6.2} s",
        100.0 * judged.filled,
        judged.rms,
        judged.worst,
        judged.all,
        100.0 * judged.seen,
        judged.open,
        judged.parts,
        seconds
    );
}

fn run_case(case: &Case, folder: &Path) -> Result<()> {
    let Some(truth) = truth(case.name)? else { return Ok(()) };
    let stem = case.name.replace([' ', ','], "_");
    let images = scans(case, &truth, 1.65)?;
    let sources: Vec<&dyn ScanSource> = images.iter().map(|image| image as &dyn ScanSource).collect();
    let params = MergeParams { max_hole_length: Some(0.0), threads: 1, ..MergeParams::default() };
    let start = cpu_seconds();
    let merged = merge::merge(&sources, &params, merge::Run::default(), &Progress::none())?;
    let merge_seconds = cpu_seconds() - start;
    let (cell, distance) = (merged.report.voxel, merged.report.merge_distance);
    let merged = merged.mesh;
    let file = folder.join(format!("{stem}.merged.ply"));
    if !file.exists() {
        let bare = TriMesh::new(merged.positions.clone(), merged.triangles.clone());
        write_ply(&file, &bare, PlyEncoding::BinaryLittleEndian, &Progress::none())?;
    }
    let points = sprinkle(&truth, 1.5);
    let places: Vec<DVec3> = points.iter().map(|p| p.0).collect();
    let far = deviation(&places, &merged, Side::Ignored, 0, &Progress::none())?.distances;
    let unseen: f64 = points.iter().zip(&far).filter(|(_, d)| **d > 1.5 * cell).map(|(p, _)| p.1).sum();
    let all: f64 = points.iter().map(|p| p.1).sum();
    println!(
        "{}: {:.1} % unseen, cell {cell:.2}, merge distance {distance:.2}, {} triangles, {} open edges, merged in {merge_seconds:.2} s",
        case.name,
        100.0 * unseen / all,
        merged.triangles.len(),
        mesh::check(&merged).boundary_edges
    );
    let slack = distance + 0.5 * cell;
    let progress = Progress::none();
    let start = cpu_seconds();
    let visibility = base::threads::pool(1)?.install(|| close::Scans::of_images(&images, &progress))?;
    let params = CloseParams {
        cell: Some(cell),
        merge_distance: Some(distance),
        threads: 1,
        flat_base: case.stands,
        ..CloseParams::default()
    };
    let closed = close::close_seen_by(&merged, &visibility, &params, &progress)?;
    let seconds = cpu_seconds() - start;
    for (opening, reason) in closed.report.left_open() {
        println!("  open: {} edges, {:.1} mm: {}", opening.edges, opening.length, reason.name());
    }
    println!("  {:?}", closed.report.seconds);
    let moved = merged.positions.iter().zip(&closed.mesh.positions).filter(|(a, b)| a != b).count();
    println!(
        "  {} openings closed, {moved} measured vertices moved, {} crossings",
        closed.report.closed,
        crossings(&closed.mesh, merged.triangles.len())?
    );
    let closed = closed.mesh;
    write_ply(&folder.join(format!("{stem}.closed.ply")), &closed, PlyEncoding::BinaryLittleEndian, &Progress::none())?;
    say("close", &judge(&closed, &merged, &truth, &images, cell, slack)?, seconds);
    let poisson = folder.join(format!("{stem}.poisson.ply"));
    if poisson.exists()
        && let Some(Content::Mesh(mesh)) = import::open(&poisson)?.scans.first().map(|scan| scan.read()).transpose()?
    {
        say("poisson 8", &judge(&mesh, &merged, &truth, &images, cell, slack)?, 0.0);
    }
    Ok(())
}

fn main() -> std::process::ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let Some(folder) = arguments.next().map(PathBuf::from) else {
        eprintln!("usage: close_figures FOLDER [CASE...]");
        return std::process::ExitCode::FAILURE;
    };
    let only: Vec<String> = arguments.map(|a| a.to_string_lossy().into_owned()).collect();
    let result = std::fs::create_dir_all(&folder).map_err(|e| Error::io(&folder, e)).and_then(|()| {
        cases()
            .iter()
            .filter(|case| only.is_empty() || only.iter().any(|o| case.name.contains(o.as_str())))
            .try_for_each(|case| run_case(case, &folder))
    });
    match result {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            std::process::ExitCode::FAILURE
        }
    }
}
