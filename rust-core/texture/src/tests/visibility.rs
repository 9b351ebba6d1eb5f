//! Places that photos see, and places that they do not.

use glam::{DVec2, DVec3};

use geom::bvh::{Bvh, Ray};
use mesh::shapes::Shape;
use mesh::{Attribute, TriMesh, srgb};

use super::kit::{PLAIN, SIZE, apart, around, covered, light_at, shot, source, sphere, textured, unwrapped, waves};
use crate::mask;

/// A ball with a smaller one before it, which hides part of it.
fn two_balls() -> TriMesh {
    let mut mesh = sphere();
    let small = Shape::Sphere { radius: 0.35 }.mesh(3);
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(small.positions.iter().map(|p| *p + DVec3::new(1.5, 0.3, 0.2)));
    mesh.triangles.extend(small.triangles.iter().map(|t| t.map(|v| v + first)));
    mesh
}

#[test]
fn texels_are_what_a_naive_twin_makes_of_each_photo_and_each_ray() {
    let mesh = two_balls();
    let flat = unwrapped(&mesh);
    let colour = |p: DVec3| if p.distance(DVec3::new(1.5, 0.3, 0.2)) < 0.4 { [220, 30, 30] } else { waves(p) };
    let shots: Vec<_> =
        around(7, 4.0).iter().enumerate().map(|(i, &eye)| shot(&format!("{i}"), &mesh, eye, &colour)).collect();
    let done = textured(&flat, &mesh, &shots, &PLAIN).unwrap();
    let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 1).unwrap();
    let normals = mesh::normals::smooth(&mesh, &base::Progress::none()).unwrap();
    let (mut wrong, mut unseen, mut differ) = (0, 0, 0);
    let texels = covered(&flat);
    for &(place, point) in &texels {
        let closest = bvh.closest_point(point).unwrap();
        let corners = mesh.triangles[closest.triangle as usize];
        let normal: DVec3 = (0..3).map(|k| normals[corners[k] as usize] * closest.barycentric[k]).sum();
        let (mut light, mut weights) = ([0.0; 3], 0.0);
        for shot in &shots {
            let to_eye = shot.world_from_camera.translation - point;
            let cosine = normal.normalize().dot(to_eye.normalize());
            let p = shot.world_from_camera.inverse().transform_point3(point);
            let at = DVec2::from(shot.camera.focal) * p.truncate() / p.z + DVec2::from(shot.camera.centre);
            let ray = Ray { origin: shot.world_from_camera.translation, direction: -to_eye };
            if cosine > 0.1 && bvh.first_hit(&ray, 0.0, 0.999).is_none() {
                let weight = cosine * cosine / (p.z * p.z);
                let of = light_at(shot, at);
                (0..3).for_each(|k| light[k] += weight * of[k]);
                weights += weight;
            }
        }
        let is_seen = source(&done.images.tiles[0], place) == mask::SEEN;
        differ += usize::from(is_seen != (weights > 0.0));
        if weights == 0.0 || !is_seen {
            unseen += 1;
            continue;
        }
        let expected = light.map(|sum| srgb::byte((sum / weights) as u16));
        wrong += usize::from(apart(expected, done.images.tiles[0].colour[place]) > 6);
    }
    // Weights at edges and the image's border differ from the twin's.
    let count = texels.len();
    assert!(count > 3000 && unseen < count / 10, "{unseen} of {count} are unseen");
    assert!(differ * 200 < count, "{differ} of {count} are seen by one alone");
    assert!(wrong * 50 < count, "{wrong} of {count} differ");
}

#[test]
fn what_hides_a_place_does_not_colour_it() {
    let mesh = two_balls();
    let flat = unwrapped(&mesh);
    let small = |p: DVec3| p.distance(DVec3::new(1.5, 0.3, 0.2)) < 0.4;
    let colour = |p: DVec3| if small(p) { [255, 0, 0] } else { [0, 0, 200] };
    let shots =
        [shot("a", &mesh, DVec3::new(4.0, 0.0, 0.0), &colour), shot("b", &mesh, DVec3::new(0.0, 4.0, 1.0), &colour)];
    let done = textured(&flat, &mesh, &shots, &PLAIN).unwrap();
    let mut red = 0;
    for (place, point) in covered(&flat) {
        let [r, _, b] = done.images.tiles[0].colour[place];
        if source(&done.images.tiles[0], place) == mask::SEEN && !small(point) {
            red += usize::from(r > b);
        }
    }
    assert!(red < 20, "{red} texels of the large ball are red");
}

#[test]
fn a_thin_sheet_has_its_own_colour_on_either_side() {
    // Two millimetres of a metre, and a coarse mesh that lies off it by as much.
    let half = DVec3::new(1.0, 0.002, 1.0);
    let detail = Shape::Cuboid { half }.mesh(3);
    let mut light = Shape::Cuboid { half }.mesh(1);
    light.positions.iter_mut().for_each(|p| p.y += 0.003);
    let flat = unwrapped(&light);
    let colour = |p: DVec3| if p.y > 0.0 { [250, 250, 10] } else { [10, 10, 250] };
    let eyes = [DVec3::new(0.5, 4.0, 0.5), DVec3::new(-0.5, -4.0, 0.5)];
    let both: Vec<_> = eyes.iter().enumerate().map(|(i, &eye)| shot(&i.to_string(), &detail, eye, &colour)).collect();
    for shots in [&both[..], &both[..1]] {
        let done = textured(&flat, &detail, shots, &PLAIN).unwrap();
        let (mut front, mut back) = (0, 0);
        for (place, point) in covered(&flat).into_iter().filter(|(_, p)| p.x.abs() < 0.9 && p.z.abs() < 0.9) {
            let (colour, of) = (done.images.tiles[0].colour[place], source(&done.images.tiles[0], place));
            if point.y > 0.003 {
                front += 1;
                assert_eq!((of, colour), (mask::SEEN, [250, 250, 10]));
            } else if shots.len() == 2 {
                back += 1;
                assert_eq!((of, colour), (mask::SEEN, [10, 10, 250]));
            } else {
                assert_eq!(of, mask::FILLED);
            }
        }
        assert!(front > 1000 && (shots.len() == 1 || back > 1000), "{front}, {back}");
    }
}

#[test]
fn what_no_photo_sees_is_filled_and_marked() {
    let mut detail = sphere();
    let flat = unwrapped(&detail);
    let one = [shot("one", &detail, DVec3::X * 4.0, &|_| [200, 100, 50])];
    let done = textured(&flat, &detail, &one, &PLAIN).unwrap();
    let tile = &done.images.tiles[0];
    for (place, point) in covered(&flat) {
        // At the rim a pixel shows the background, too.
        let is_at_rim = (0.0..0.5).contains(&point.x);
        let apart = apart(tile.colour[place], [200, 100, 50]);
        assert!(apart < if is_at_rim { 90 } else { 2 }, "{point}: {:?}", tile.colour[place]);
        if point.x < 0.0 {
            assert_eq!(source(tile, place), mask::FILLED);
        } else if point.x > 0.5 {
            assert_eq!(source(tile, place), mask::SEEN);
        }
    }
    assert!(done.report.seen > 0 && done.report.seen < done.report.texels);
    // Of vertices, where they have colours.
    detail.vertex_attributes.push(Attribute::colour("colour", vec![[10, 20, 30, 255]; detail.positions.len()]));
    let with = textured(&flat, &detail, &one, &PLAIN).unwrap();
    let bare = textured(&flat, &detail, &[], &PLAIN).unwrap();
    for (place, point) in covered(&flat) {
        assert!(point.x > -0.1 || with.images.tiles[0].colour[place] == [10, 20, 30]);
        assert_eq!(
            (bare.images.tiles[0].colour[place], source(&bare.images.tiles[0], place)),
            ([10, 20, 30], mask::FILLED)
        );
    }
    // Nothing is black between the charts.
    assert!(done.images.tiles[0].colour.iter().all(|&colour| apart(colour, [200, 100, 50]) < 90));
    assert_eq!(tile.mask.iter().flatten().filter(|&&of| of != mask::BACKGROUND).count() as u64, done.report.texels);
}

#[test]
fn a_mirrored_object_has_its_colours_mirrored() {
    let colour = |p: DVec3| waves(p);
    let mirror = |p: DVec3| DVec3::new(-p.x, p.y, p.z);
    let mesh = two_balls();
    let mut mirrored = mesh.clone();
    mirrored.positions.iter_mut().for_each(|p| *p = mirror(*p));
    mirrored.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let flat = unwrapped(&mirrored);
    let eyes = around(6, 4.0);
    let seen = |p: DVec3| colour(mirror(p));
    let shots: Vec<_> = eyes.iter().enumerate().map(|(i, &eye)| shot(&i.to_string(), &mirrored, eye, &seen)).collect();
    let done = textured(&flat, &mirrored, &shots, &PLAIN).unwrap();
    let texels = covered(&flat);
    let wrong = |(place, point): &&(usize, DVec3)| apart(done.images.tiles[0].colour[*place], seen(*point)) > 12;
    let wrong = texels.iter().filter(wrong).count();
    assert!(wrong * 20 < texels.len(), "{wrong} of {}", texels.len());
    assert_eq!(done.images.size, SIZE);
}
