//! Deviation: how far points lie from scans. It is the rest between a merged surface and the scans that it was merged from.

use glam::DVec3;
use rayon::prelude::*;

use base::error::{Error, Result};
use base::progress::Progress;
use image::source::{Loading, OrientedSurface, ScanSource, common_crs};
use image::triangulate::TriangulateParams;
use mesh::TriMesh;
use mesh::measure::{self, Deviation, Side};

/// Exact distances of `points`, in the world, to the nearest point of the scans' surfaces, with `threads` threads, 0 for
/// one per core. All scans are held in memory at once.
///
/// # Cost
/// As [`measure::deviation`] with the triangles of all scans. The result is the same for any number of threads.
///
/// # Errors
/// A scan can't be loaded. No scan has a triangle. Coordinates that aren't finite. Scans of different coordinate reference systems, or in
/// degrees. [`Error::Cancelled`].
pub fn deviation(
    points: &[DVec3],
    sources: &[&dyn ScanSource],
    triangulation: &TriangulateParams,
    side: Side,
    threads: usize,
    progress: &Progress<'_>,
) -> Result<Deviation> {
    common_crs(sources)?;
    progress.plan(&[("reading the scans", 0.2), ("measuring", 0.8)]);
    progress.stage(0, sources.len() as u64);
    let pool = base::threads::pool(threads)?;
    progress.run(&pool, || {
        let scans = union(sources, triangulation, progress)?;
        progress.stage(1, measure::chunks(points.len()));
        measure::deviation_within(points, &scans, side, 1, progress)
    })
}

/// All scans as one mesh in the world.
fn union(sources: &[&dyn ScanSource], triangulation: &TriangulateParams, progress: &Progress<'_>) -> Result<TriMesh> {
    let surfaces = sources
        .par_iter()
        .map(|source| {
            progress.check()?;
            let surface = source.load(&Loading { triangulation: *triangulation, cell: 0.0 }, progress)?;
            progress.advance(1)?;
            Ok(surface)
        })
        .collect::<Result<Vec<_>>>()?;
    let mut whole = TriMesh::default();
    for surface in surfaces {
        append(&mut whole, &surface, progress)?;
    }
    Ok(whole)
}

fn append(whole: &mut TriMesh, surface: &OrientedSurface, progress: &Progress<'_>) -> Result<()> {
    let (first, world) = (whole.positions.len(), surface.world_from_surface);
    let Ok(first) = u32::try_from(first + surface.positions.len()).map(|_| first as u32) else {
        return Err(Error::OutOfMemory("the scans have more than 2^32 vertices: measure against fewer".to_owned()));
    };
    for block in progress.ranges(surface.positions.len()) {
        whole.positions.extend(surface.positions[block?].iter().map(|&p| world.transform_point3(p)));
    }
    // A point in front of a mirrored surface stays in front of it.
    let mirrored = world.matrix3.determinant() < 0.0;
    for block in progress.ranges(surface.triangles.len()) {
        whole.triangles.extend(surface.triangles[block?].iter().map(|&[a, b, c]| {
            let corners = if mirrored { [a, c, b] } else { [a, b, c] };
            corners.map(|v| first + v)
        }));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, dvec3};

    use super::*;
    use image::source::PlacedMesh;

    /// A square of side 2 around the origin, facing up.
    fn square() -> TriMesh {
        let corners = vec![dvec3(-1., -1., 0.), dvec3(1., -1., 0.), dvec3(1., 1., 0.), dvec3(-1., 1., 0.)];
        TriMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]])
    }

    fn placed(mesh: &TriMesh, world_from_mesh: DAffine3) -> PlacedMesh<&TriMesh> {
        PlacedMesh { name: String::new(), mesh, world_from_mesh }
    }

    #[test]
    fn distances_are_to_the_nearest_scan_where_it_stands() {
        let mesh = square();
        let scans = [
            placed(&mesh, DAffine3::IDENTITY),
            placed(&mesh, DAffine3::from_translation(dvec3(0.0, 0.0, 10.0))),
            placed(&mesh, DAffine3::from_scale(dvec3(3.0, 1.0, -1.0)) * DAffine3::from_translation(dvec3(0., 0., 5.))),
        ];
        let sources: Vec<&dyn ScanSource> = scans.iter().map(|s| s as &dyn ScanSource).collect();
        let points =
            [dvec3(0., 0., 2.), dvec3(0., 0., 8.5), dvec3(2.5, 0., -6.), dvec3(5., 0., -5.), dvec3(0., 0., 10.)];
        let run = |side, threads, progress: &Progress<'_>| {
            deviation(&points, &sources, &TriangulateParams::default(), side, threads, progress)
        };
        let none = Progress::none();
        assert_eq!(run(Side::Ignored, 1, &none).unwrap().distances, [2.0, 1.5, 1.0, 2.0, 0.0]);
        // The mirrored square, at z = -5, faces down.
        assert_eq!(run(Side::Signed, 2, &none).unwrap().distances[..3], [2.0, -1.5, 1.0]);
        for check in 0.. {
            match run(Side::Ignored, 1, &Progress::cancel_after(check)) {
                Err(error) => assert!(matches!(error, Error::Cancelled), "{error}"),
                Ok(_) => return assert!(check > 5, "{check} checks"),
            }
        }
    }

    #[test]
    fn scans_of_two_systems_are_not_measured_against() {
        let named = |code| TriMesh { crs: Some(mesh::Crs::new(code).unwrap()), ..square() };
        let refused = |codes: [&'static str; 2]| {
            let meshes = codes.map(named);
            let scans =
                [0, 1].map(|k| PlacedMesh { name: codes[k].to_owned(), ..placed(&meshes[k], DAffine3::IDENTITY) });
            let sources: Vec<&dyn ScanSource> = scans.iter().map(|s| s as &dyn ScanSource).collect();
            let (triangulation, none) = (TriangulateParams::default(), Progress::none());
            deviation(&[DVec3::ZERO], &sources, &triangulation, Side::Ignored, 1, &none).unwrap_err().to_string()
        };
        let error = refused(["EPSG:1", "EPSG:2"]);
        assert!(error.starts_with("EPSG:1 is in EPSG:1, EPSG:2 in EPSG:2: transform one of them"), "{error}");
        assert!(refused(["EPSG:1", "EPSG:4326"]).contains("its coordinates are degrees"));
    }

    #[test]
    fn nothing_to_measure_against_is_an_error() {
        let empty = TriMesh::default();
        let scans: [&dyn ScanSource; 1] = [&placed(&empty, DAffine3::IDENTITY)];
        let none = Progress::none();
        for sources in [&scans[..], &[]] {
            let found = deviation(&[DVec3::ZERO], sources, &TriangulateParams::default(), Side::Ignored, 0, &none);
            assert!(found.unwrap_err().to_string().contains("no triangle"));
        }
    }
}
