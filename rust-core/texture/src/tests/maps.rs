//! Normal map, height map, ambient occlusion, tiles.

use glam::{DVec2, DVec3};

use mesh::TriMesh;
use mesh::shapes::Shape;
use unwrap::{ChartScale, UnwrapParams};

use super::kit::{PLAIN, SIZE, covered, shot, sphere, textured, unwrapped, waves};
use crate::TextureParams;

/// Distance of a place from the ridge, with its side.
fn from_ridge(p: DVec3) -> f64 {
    (0.8 * p.x + 0.6 * p.y) * 1.2
}

/// A plane with a slanted ridge, a third as high as it is wide.
fn ridge() -> TriMesh {
    let mut mesh = Shape::Plane { half: DVec2::ONE }.mesh(40);
    mesh.positions.iter_mut().for_each(|p| p.z = (0.1 - 0.25 * from_ridge(*p).abs()).max(0.0));
    mesh
}

#[test]
fn normals_and_heights_of_a_ridge() {
    let flat = unwrapped(&Shape::Plane { half: DVec2::ONE }.mesh(1));
    let detail = ridge();
    let shots = [shot("above", &detail, DVec3::Z * 4.0, &waves)];
    let params = TextureParams { normal_map: true, height_map: true, ..PLAIN };
    let done = textured(&flat, &detail, &shots, &params).unwrap();
    let (tile, tangents) = (&done.images.tiles[0], done.images.tangents.as_ref().unwrap());
    let [low, high] = done.images.heights.unwrap();
    assert!(low > -1e-6 && (0.08..0.101).contains(&high), "{low} {high}");
    let tangent = DVec3::from(std::array::from_fn(|k| f64::from(tangents[0][0][k])));
    for (place, point) in covered(&flat) {
        let height = low + (high - low) * f64::from(tile.height.as_ref().unwrap()[place]) / 65_535.0;
        let x = from_ridge(point).abs();
        // Between the facets of the ridge and at its foot the closest point lies elsewhere.
        if x > 0.55 || (0.1..0.28).contains(&x) {
            let slope = if x > 0.4 { 0.0 } else { 0.3 * from_ridge(point).signum() };
            let expected = DVec3::new(0.8 * slope, 0.6 * slope, 1.0).normalize();
            let coded = tile.normal.as_ref().unwrap()[place].map(|byte| (f64::from(byte) - 128.0) / 127.0);
            let normal = tangent * coded[0]
                + DVec3::Z.cross(tangent) * coded[1] * f64::from(tangents[0][0][3])
                + DVec3::Z * coded[2];
            assert!(normal.distance(expected) < 0.05, "{point}: {normal}, not {expected}");
            let near = 0.01;
            assert!((height - (0.1 - 0.25 * x).max(0.0)).abs() < near + 0.005, "{point}: {height}");
        }
    }
}

#[test]
fn flat_is_flat_and_open() {
    let mesh = sphere();
    let flat = unwrapped(&mesh);
    let shots = [shot("one", &mesh, DVec3::X * 4.0, &waves)];
    let params = TextureParams { normal_map: true, occlusion_rays: 16, ..PLAIN };
    let done = textured(&flat, &mesh, &shots, &params).unwrap();
    let tile = &done.images.tiles[0];
    for (place, _) in covered(&flat) {
        let [x, y, z] = tile.normal.as_ref().unwrap()[place];
        assert!(x.abs_diff(128) < 4 && y.abs_diff(128) < 4 && z > 250, "{x} {y} {z}");
        assert!(tile.occlusion.as_ref().unwrap()[place] > 250);
    }
}

#[test]
fn the_inside_of_a_pit_is_dark() {
    let mut mesh = Shape::Sphere { radius: 1.0 }.mesh(6);
    // A deep dent.
    mesh.positions.iter_mut().filter(|p| p.z > 0.8).for_each(|p| p.z = -0.6);
    let flat = unwrapped(&mesh);
    let shots = [shot("one", &mesh, DVec3::X * 4.0, &waves)];
    let done = textured(&flat, &mesh, &shots, &TextureParams { occlusion_rays: 32, ..PLAIN }).unwrap();
    let open = done.images.tiles[0].occlusion.as_ref().unwrap();
    let mean = |is: &dyn Fn(DVec3) -> bool| {
        let there: Vec<f64> = covered(&flat).iter().filter(|(_, p)| is(*p)).map(|(i, _)| f64::from(open[*i])).collect();
        there.iter().sum::<f64>() / there.len() as f64
    };
    let (pit, outside) = (mean(&|p| (p.z + 0.6).abs() < 0.05 && p.truncate().length() < 0.3), mean(&|p| p.z < -0.7));
    assert!(pit < 120.0 && outside > 200.0, "{pit} {outside}");
}

#[test]
fn several_tiles_are_as_one() {
    let mesh = sphere();
    let params =
        UnwrapParams { size: SIZE, padding: 2, extent: ChartScale::Tiles(3), threads: 1, ..UnwrapParams::default() };
    let flat = unwrap::unwrap(&mesh, &params, &base::Progress::none()).unwrap();
    assert!(flat.report.tiles > 1);
    let shots = [shot("one", &mesh, DVec3::X * 4.0, &|_| [1, 200, 100])];
    let done = textured(&flat, &mesh, &shots, &TextureParams { height_map: true, ..PLAIN }).unwrap();
    assert_eq!(done.images.tiles.len(), flat.report.tiles);
    let covered = |tile: &mesh::Tile| tile.mask.iter().flatten().filter(|&&of| of > 0).count();
    assert!(done.images.tiles.iter().all(|tile| covered(tile) > 100 && tile.height.is_some()));
    assert_eq!(done.images.tiles.iter().map(covered).sum::<usize>() as u64, done.report.texels);
}
