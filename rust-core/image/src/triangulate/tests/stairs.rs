//! Depths that are multiples of a step.

use super::*;

/// An image whose values are rounded by a function.
fn rounded(image: &RangeImage, round: impl Fn(f64) -> f64) -> RangeImage {
    let Samples::Values(values) = image.samples() else { unreachable!() };
    let values = values.iter().map(|&value| round(value)).collect();
    RangeImage::from_values(image.rows(), image.cols(), values, *image.projection()).unwrap()
}

#[test]
fn stairs_of_rounded_depths_are_no_jumps() {
    // Pixels are 1 / 30 wide at depth 8. Steps of five and seven times that, and those of disparities, which grow with depth.
    let rules: [fn(f64) -> f64; 3] = [
        |depth| (depth / 0.17).round() * 0.17,
        |depth| (depth / 0.25).round() * 0.25,
        |depth| 1.0 / ((250.0 / depth).round() / 250.0),
    ];
    for projection in [
        Projection::Pinhole { focal: [240.0; 2], centre: [59.5, 44.5], depth: DepthKind::Planar },
        Projection::Spherical { first: [-0.25, 0.2], step: [1.0 / 240.0, -1.0 / 240.0] },
    ] {
        let towards = ahead(&projection).normalize();
        let sideways = projection.ray(0, 60, DVec3::NAN).1.cross(towards).normalize();
        // Level along columns, along rows, and along neither.
        for slope in [
            0.8 * sideways,
            1.2 * sideways,
            0.8 * sideways.cross(towards),
            1.2 * sideways.cross(towards),
            0.7 * (sideways + sideways.cross(towards)),
        ] {
            let normal = towards + slope;
            let image = render(90, 120, projection, plane(8.0 * towards, normal));
            for (k, round) in rules.into_iter().enumerate() {
                let surface = run(&rounded(&image, round));
                assert_eq!(surface.triangles.len(), 2 * 89 * 119, "{projection:?}, slope {slope:?}, rule {k}");
            }
        }
        // A card before a wall: a jump of four steps at least, at all of its border.
        let card = |o: DVec3, d: DVec3| {
            let near = plane(6.0 * towards, towards)(o, d)?;
            let at = o + near * d;
            if at.reject_from(towards).length() < 1.0 {
                Some(near)
            } else {
                plane(8.0 * towards, towards + 0.5 * DVec3::Z.cross(towards) + 0.5 * DVec3::Y.cross(towards))(o, d)
            }
        };
        let surface = run(&rounded(&render(90, 120, projection, card), rules[0]));
        let depth = |&v: &u32| surface.positions[v as usize].dot(towards);
        let is_on_card = |v: &u32| depth(v) < 6.2;
        let bridges = |t: &&[u32; 3]| t.iter().any(is_on_card) && !t.iter().all(is_on_card);
        assert_eq!(surface.triangles.iter().find(bridges), None, "{projection:?}");
    }
}
