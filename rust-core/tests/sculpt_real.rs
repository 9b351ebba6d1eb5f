//! Sculpts the real scans named in the environment variable SURFRECON_DATA.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::path::PathBuf;

use surfrecon::Progress;
use surfrecon::geom::bvh::{Bvh, Ray};
use surfrecon::import::{self, Content};
use surfrecon::mesh::check;
use surfrecon::range_image::{Projection, RangeImage, Viewing};
use surfrecon::sculpt::{SculptParams, Sculpted, Sculptor, Tolerance};

/// All range images of some files.
fn images(files: &[&str]) -> Vec<RangeImage> {
    let Some(data) = std::env::var_os("SURFRECON_DATA").map(PathBuf::from) else {
        println!("SKIPPED: SURFRECON_DATA is not set");
        return Vec::new();
    };
    let mut images = Vec::new();
    for file in files {
        for scan in &import::open(&data.join(file)).unwrap().scans {
            if let Content::RangeImage(image) = scan.read().unwrap() {
                images.push(image);
            }
        }
    }
    assert!(images.len() >= files.len());
    images
}

/// Checks that each covered ray meets the mesh once, within the tolerance, and that all other valid pixels are counted.
fn assert_each_ray_meets_the_mesh_once(image: &RangeImage, sculpted: &Sculpted) {
    let Sculpted { mesh, certificate, report } = sculpted;
    let largest = (0..image.len()).map(|i| image.range(i).abs()).filter(|r| !r.is_nan()).fold(0.0, f64::max);
    let bound = report.tolerance * (1.0 + 1e-9) + 1e-12 * largest;
    assert!(certificate.max_error <= bound, "{}: {} > {bound}", image.name, certificate.max_error);
    assert_eq!(certificate.covered_pixels + report.isolated_pixels, image.valid_count(), "{}", image.name);
    let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 0).unwrap();
    for index in (0..image.len()).filter(|&i| !certificate.error_image[i].is_nan()) {
        let (origin, direction) = image.ray_in_sensor(index);
        let sample = image.point_in_sensor(index);
        // If rays start at the sensor, nothing behind it counts.
        let start = match image.projection() {
            Projection::Orthographic { .. } | Projection::PointGrid(Viewing::Parallel(_)) => f64::NEG_INFINITY,
            _ => -sample.distance(origin),
        };
        let ray = Ray { origin: sample, direction };
        let Some(hit) = bvh.first_hit(&ray, start, f64::INFINITY) else { continue };
        assert!(hit.t.abs() <= 2.0 * bound + 1e-6, "{}: pixel {index} at {}", image.name, hit.t);
        let second = bvh.first_hit(&ray, hit.t + 1e-9 * largest, f64::INFINITY);
        assert_eq!(second.map(|s| s.t), None, "{}: pixel {index} after {}", image.name, hit.t);
    }
}

fn keeps_its_promise(files: &[&str], shares: &[f64]) {
    for image in images(files) {
        let sculptor = Sculptor::new(&image, &SculptParams::default());
        if image.rows().min(image.cols()) < 2 {
            let refused = sculptor.map(|_| ()).unwrap_err().to_string();
            assert!(refused.contains("no triangle comes of its 1 x 4 pixels"), "{refused}");
            continue;
        }
        let sculptor = sculptor.unwrap();
        for &share in shares {
            let sculpted = sculptor.refine(Tolerance::OfDepthExtent(share), &Progress::none()).unwrap();
            let Sculpted { mesh, certificate, report } = &sculpted;
            println!(
                "{} {share}: {} of {} triangles, {} hidden, {} pixels not covered, error {:e} of {:e}",
                image.name,
                report.triangles,
                report.full_triangles,
                report.hidden_triangles,
                report.isolated_pixels,
                certificate.max_error,
                report.tolerance
            );
            assert!(check(mesh).is_manifold());
            assert_each_ray_meets_the_mesh_once(&image, &sculpted);
        }
    }
}

#[test]
fn bunny() {
    keeps_its_promise(&["stanford_bunny/bun.conf"], &[0.0, 0.000_41]);
}

#[test]
fn dragon_and_happy_buddha() {
    keeps_its_promise(&["stanford_dragon_stand/dragonStandRight.conf"], &[0.000_41]);
    keeps_its_promise(&["stanford_happy_stand/happyStandRight_0.ply"], &[0.0]);
}

#[test]
fn scanners_and_cameras() {
    keeps_its_promise(&["ptx/multiple-and-transform.ptx", "ptx/1.2-with-color.ptx", "dem/fuji.png"], &[0.0, 0.000_41]);
    keeps_its_promise(&["organized_pcd/learn0.pcd"], &[0.000_41]);
}
