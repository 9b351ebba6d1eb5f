//! Scans with noise, folds and poses that are off.

use super::*;

/// Slopes of the planes of [`noisy_patch`] along x and y.
const LEAN: [f64; 2] = [0.1, 0.03];

/// A plane that leans a little, seen from above: 120 x 120 pixels of size 1, moved up, with noise.
pub(super) fn noisy_patch(number: usize, up: f64, sigma: f64) -> RangeImage {
    leaning_patch(number, LEAN, up, sigma)
}

fn leaning_patch(number: usize, lean: [f64; 2], up: f64, sigma: f64) -> RangeImage {
    let side = 120;
    let height = |i: usize| {
        let (x, y) = ((i % side) as f64 + 0.25, (i / side) as f64 + 0.25);
        let uniform = |k: usize| {
            let mix = |z: u64, shift: u32, factor: u64| (z ^ (z >> shift)).wrapping_mul(factor);
            let z = ((12 * (number * side * side + i) + k + 1) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let z = mix(mix(z, 30, 0xbf58_476d_1ce4_e5b9), 27, 0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 12) as f64 / (1_u64 << 52) as f64
        };
        // Twelve uniform numbers have variance 1.
        let normal = (0..12).map(uniform).sum::<f64>() - 6.0;
        lean[0] * x + lean[1] * y + up + sigma * normal
    };
    let projection = Projection::Orthographic { first: [0.25, 0.25], step: [1.0, 1.0] };
    let mut image = RangeImage::from_values(side, side, (0..side * side).map(height).collect(), projection).unwrap();
    image.name = format!("patch {number:03}");
    image
}

/// Without what is near the border of [`noisy_patch`], where few samples tell of the surface.
fn inner_part(mesh: &TriMesh) -> TriMesh {
    let is_inner = |&v: &u32| {
        let p = mesh.positions[v as usize];
        [p.x, p.y].iter().all(|x| (10.0..=110.0).contains(x))
    };
    let triangles = mesh.triangles.iter().copied().filter(|t| t.iter().all(is_inner)).collect();
    TriMesh { positions: mesh.positions.clone(), triangles, ..TriMesh::default() }
}

/// RMS distance of the inner vertices to the plane of [`noisy_patch`] that lies `up`, and the connected parts.
fn off_plane(mesh: &TriMesh, up: f64) -> (f64, usize) {
    let inner = inner_part(mesh);
    let normal = DVec3::new(-LEAN[0], -LEAN[1], 1.0).normalize();
    let off = |p: &DVec3| (*p - DVec3::new(0.0, 0.0, up)).dot(normal);
    let corners = inner.triangles.as_flattened();
    let squares: f64 = corners.iter().map(|&v| off(&inner.positions[v as usize]).powi(2)).sum();
    ((squares / corners.len() as f64).sqrt(), check(&inner).components)
}

#[test]
fn a_single_clean_scan_is_as_the_paper_has_it() {
    for shape in [Shape::Torus { major: 1.0, minor: 0.4 }, Shape::Cuboid { half: DVec3::new(1.0, 0.75, 0.5) }] {
        let scan = &clean_scans(shape, 120)[1];
        let ours = merge_scans(std::slice::from_ref(scan), &plain(0.041)).mesh;
        let paper = reference::run(&[scan], &plain(0.041), &Progress::none()).unwrap().mesh;
        let key = |p: &DVec3| p.to_array().map(f64::to_bits);
        let known: std::collections::HashSet<_> = paper.positions.iter().map(key).collect();
        let same = ours.positions.iter().filter(|p| known.contains(&key(p))).count();
        // Artificial vertices along the border aside.
        assert!(same * 100 > 98 * known.len(), "{same} of {}", known.len());
        assert!(ours.positions.len().abs_diff(paper.positions.len()) * 100 < known.len());
    }
}

#[test]
fn noise_of_many_scans_averages_out() {
    let error = |count: usize, sigma: f64| {
        let scans: Vec<_> = (0..count).map(|i| noisy_patch(i, 0.0, sigma)).collect();
        let (rms, parts) = off_plane(&merge_scans(&scans, &plain(2.0)).mesh, 0.0);
        assert_eq!(parts, 1, "{count} scans, noise of {sigma}");
        rms / sigma
    };
    for sigma in [0.5, 2.0, 6.0] {
        let [one, nine] = [1, 9].map(|count| error(count, sigma));
        assert!(one < 0.7 && nine < 0.45 * one, "{sigma}: {one} {nine}");
    }
}

#[test]
fn shifted_scans_leave_no_layers() {
    // Half a cell of shift, as badly placed scans have it.
    for count in [2, 10, 60, 400] {
        let shift = |i: usize| ((i * 7919) % 101) as f64 / 50.0 - 1.0;
        let scans: Vec<_> = (0..count).map(|i| noisy_patch(i, shift(i), 0.0)).collect();
        let mean = (0..count).map(shift).sum::<f64>() / count as f64;
        let (rms, parts) = off_plane(&merge_scans(&scans, &plain(2.0)).mesh, mean);
        assert!(parts == 1 && rms < 0.25, "{count}: {rms}, {parts} parts");
    }
}

#[test]
fn sheets_one_and_a_half_cells_apart_stay_two() {
    // Half a turn about y keeps how a plane leans along x, and turns over how it leans along y.
    let from_below = |number: usize| {
        let mut scan = leaning_patch(number, [LEAN[0], -LEAN[1]], 0.0, 0.5);
        let along = 120.0;
        let place = DAffine3::from_translation(DVec3::new(along, 0.0, LEAN[0] * along - 3.0));
        scan.world_from_sensor = place * DAffine3::from_rotation_y(std::f64::consts::PI);
        scan
    };
    let scans: Vec<_> = (0..8).map(|i| if i < 4 { noisy_patch(i, 0.0, 0.5) } else { from_below(i) }).collect();
    let inner = inner_part(&merge_scans(&scans, &plain(2.0)).mesh);
    let report = check(&inner);
    assert!(report.is_manifold() && report.components == 2 && report.boundary_loops == 2, "{report}");
    let upper = |p: &DVec3| p.z - LEAN[0] * p.x - LEAN[1] * p.y > -1.5;
    for sheet in [0.0, -3.0] {
        let of_sheet = |p: &&DVec3| upper(p) == (sheet == 0.0);
        let of_sheet = |t: &&[u32; 3]| of_sheet(&&inner.positions[t[0] as usize]);
        let triangles = inner.triangles.iter().filter(of_sheet).copied().collect();
        let (rms, parts) = off_plane(&TriMesh { triangles, ..inner.clone() }, sheet);
        assert!(rms < 0.3 && parts == 1, "{sheet}: {rms}, {parts} parts");
    }
}

/// Both sides of a slab whose upper side lies at `top`, seen by three scans each.
fn slab(top: f64, thickness: f64, sigma: f64) -> Vec<RangeImage> {
    let side = |i: usize| {
        let mut scan = leaning_patch(i, [0.0; 2], 0.0, sigma);
        scan.world_from_sensor = DAffine3::from_translation(DVec3::new(0.0, 0.0, top));
        if i % 2 == 1 {
            let under = DAffine3::from_translation(DVec3::new(120.0, 0.0, top - thickness));
            scan.world_from_sensor = under * DAffine3::from_rotation_y(std::f64::consts::PI);
        }
        scan
    };
    (0..6).map(side).collect()
}

#[test]
fn both_sides_of_a_thin_slab_stay_where_they_are() {
    for sigma in [0.0, 0.2, 0.5] {
        for (top, thickness) in [(1.5, 4.5), (0.1, 4.5), (0.5, 4.5), (2.9, 4.5), (0.1, 6.0), (1.7, 6.0), (0.5, 15.0)] {
            let inner = inner_part(&merge_scans(&slab(top, thickness, sigma), &plain(3.0)).mesh);
            assert_eq!(check(&inner).components, 2, "{sigma}: {top} {thickness}");
            let corners = || inner.triangles.as_flattened().iter().map(|&v| inner.positions[v as usize].z);
            for (z, upper) in [(top, true), (top - thickness, false)] {
                let mut of_side: Vec<f64> = corners().filter(|c| (*c > top - 0.5 * thickness) == upper).collect();
                of_side.sort_by(f64::total_cmp);
                let median = of_side[of_side.len() / 2];
                assert!((median - z).abs() < 0.02 + 0.2 * sigma, "{sigma}: {top} {thickness}: {z} is at {median}");
            }
        }
    }
}

#[test]
fn confidences_stay_positive_however_large() {
    for confidence in [1e-12, 1e5, 1e9, 3e30] {
        let scans: Vec<_> = (0..3)
            .map(|i| {
                let mut scan = noisy_patch(i, 0.0, 0.5);
                scan.confidence = Some(vec![confidence; scan.len()]);
                scan
            })
            .collect();
        let merged = merge_scans(&scans, &plain(3.0));
        let Some(AttributeData::F32(trust)) = merged.mesh.vertex_attribute("confidence") else { panic!() };
        assert!(trust.iter().all(|&trust| trust >= 0.0), "{confidence}");
    }
}

#[test]
fn noise_is_told_in_any_cell() {
    for voxel in [0.1, 1.0, 8.0] {
        let mut scan = noisy_patch(0, 0.0, 0.3);
        // A tenth of the image is enough for a tenth of the cell.
        let values: Vec<f64> = (0..scan.len()).map(|i| scan.range(i)).collect();
        let kept = if voxel < 1.0 { 40 } else { 120 };
        let cut = (0..kept * kept).map(|i| values[i / kept * 120 + i % kept]).collect();
        scan = RangeImage::from_values(kept, kept, cut, *scan.projection()).unwrap();
        let noise = merge_scans(&[scan], &plain(voxel)).report.noise;
        assert!((noise / 0.3 - 1.0).abs() < 0.25, "{voxel}: {noise}");
    }
}

#[test]
fn a_precise_scan_is_not_spoilt_by_a_coarse_one() {
    let scans = [noisy_patch(0, 0.0, 0.02), noisy_patch(1, 0.0, 2.0), noisy_patch(2, 0.0, 2.0)];
    let (rms, parts) = off_plane(&merge_scans(&scans, &plain(2.0)).mesh, 0.0);
    assert!(rms < 0.05 && parts == 1, "{rms}, {parts} parts");
}

#[test]
fn what_noise_is_measured_is_told() {
    for sigma in [0.0, 0.2, 1.0, 4.0] {
        let merged = merge_scans(&[noisy_patch(0, 0.0, sigma)], &plain(2.0));
        assert!((merged.report.noise - sigma).abs() <= 0.15 * sigma, "{sigma}: {}", merged.report.noise);
        let Some(AttributeData::F32(noise)) = merged.mesh.vertex_attribute("noise") else { panic!() };
        assert_eq!(noise.iter().all(|&n| n == 0.0), sigma == 0.0);
        assert_eq!((merged.report.noise_step, merged.report.noise_correlation), (0.0, 1.0), "{sigma}");
    }
    let stepped = |i: usize| {
        let scan = noisy_patch(i, 0.0, 0.0);
        let values = (0..scan.len()).map(|k| (scan.range(k) / 0.75).round() * 0.75).collect();
        let mut image = RangeImage::from_values(120, 120, values, *scan.projection()).unwrap();
        image.name = scan.name;
        image
    };
    let report = merge_scans(&[stepped(0), stepped(1), stepped(2)], &plain(2.0)).report;
    assert!((report.noise_step - 0.75).abs() < 1e-9, "{}", report.noise_step);
}

#[test]
fn the_same_scan_four_hundred_times_is_itself() {
    // Nowhere through a node, where rounding would decide.
    let scan = noisy_patch(0, 0.0137, 0.0);
    let once = merge_scans(std::slice::from_ref(&scan), &plain(2.0)).mesh;
    let copies: Vec<_> = (0..400)
        .map(|i| {
            let mut copy = scan.clone();
            copy.name = format!("{i}");
            copy
        })
        .collect();
    let many = merge_scans(&copies, &plain(2.0)).mesh;
    assert!(once.triangles == many.triangles);
    assert!(once.positions.iter().zip(&many.positions).all(|(a, b)| a.distance(*b) < 1e-6));
}

#[test]
fn noisy_scans_give_the_same_bytes_for_any_threads_and_order() {
    let mut scans: Vec<_> = (0..7).map(|i| noisy_patch(i, 0.1 * i as f64, 1.5)).collect();
    let params = MergeParams { voxel: Some(2.0), ..MergeParams::default() };
    let expected = bytes(&merge_scans(&scans, &MergeParams { threads: 1, ..params }));
    scans.rotate_left(3);
    assert!(bytes(&merge_scans(&scans, &MergeParams { threads: 4, ..params })) == expected);
    scans.reverse();
    assert!(bytes(&merge_scans(&scans, &params)) == expected);
}

#[test]
fn crossings_added_up_give_the_same_bytes() {
    let scans: Vec<_> = (0..9).map(|i| noisy_patch(i, 0.1 * i as f64, if i % 2 == 0 { 0.0 } else { 1.5 })).collect();
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let params = MergeParams { merge_distance: Some(3.0), ..plain(2.0) };
    let kept = |kept| {
        let setup = Setup { kept, ..Setup::default() };
        let merged = by_setup(&sources, &params, &setup, &Progress::none()).unwrap();
        assert!(merged.report.intersections > 30_000);
        bytes(&merged)
    };
    // Less than all, so that distances between scans are measured by the same sample.
    let expected = kept(30_000);
    assert!(kept(0) == expected && kept(20_000) == expected);
}

#[test]
fn noise_alone_is_merged_or_refused_in_words() {
    let noise = noisy_patch(0, 0.0, 60.0);
    match merge(&[&noise], &plain(2.0), Run::default(), &Progress::none()) {
        Ok(merged) => assert!(check(&merged.mesh).is_manifold()),
        Err(error) => assert!(error.to_string().starts_with("nothing is left"), "{error}"),
    }
}

/// A clean scan of the plane of [`noisy_patch`] whose columns run forward, back and forward again: it folds.
fn folded_patch(number: usize) -> RangeImage {
    let flat = noisy_patch(number, 0.0, 0.0);
    let points = (0..flat.len()).map(|i| {
        let col = (i % 120) as f64;
        let x = if (50.0..70.0).contains(&col) {
            col + 8.0 * ((col - 50.0) * std::f64::consts::TAU / 20.0).sin()
        } else {
            col
        };
        let y = (i / 120) as f64;
        [x + 0.25, y + 0.25, LEAN[0] * (x + 0.25) + LEAN[1] * (y + 0.25)].map(|x| x as f32)
    });
    let mut folded = RangeImage::from_points(120, 120, points.collect(), Viewing::ALONG_MINUS_Z).unwrap();
    folded.name = flat.name;
    folded
}

#[test]
fn a_fold_in_one_scan_makes_none_in_the_result() {
    for folded in 0..5 {
        let scans: Vec<_> =
            (0..5).map(|i| if i == folded { folded_patch(i) } else { noisy_patch(i, 0.0, 0.0) }).collect();
        let mesh = merge_scans(&scans, &plain(2.0)).mesh;
        let (rms, parts) = off_plane(&mesh, 0.0);
        assert!(parts == 1 && rms < 0.05, "{folded}: {rms}, {parts} parts");
        let inner = inner_part(&mesh);
        let up = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| inner.positions[v as usize]);
            (b - a).cross(c - a).z > 0.0
        };
        assert!(check(&inner).boundary_loops == 1 && inner.triangles.iter().all(up), "{folded}");
    }
}

#[test]
fn a_scan_of_one_pixel_changes_nothing_and_scans_that_share_nothing_stay_as_they_are() {
    let scan = noisy_patch(0, 0.0, 1.0);
    let alone = merge_scans(std::slice::from_ref(&scan), &plain(2.0)).mesh;
    let projection = Projection::Orthographic { first: [50.0, 50.0], step: [1.0, 1.0] };
    let mut pixel = RangeImage::from_values(1, 1, vec![3.0], projection).unwrap();
    pixel.name = "pixel".to_owned();
    assert!(merge_scans(&[scan.clone(), pixel], &plain(2.0)).mesh.positions == alone.positions);
    let mut far = noisy_patch(1, 0.0, 1.0);
    far.world_from_sensor = DAffine3::from_translation(DVec3::new(1e4, 0.0, 0.0));
    let other = merge_scans(std::slice::from_ref(&far), &plain(2.0)).mesh;
    let both = merge_scans(&[scan, far], &plain(2.0)).mesh;
    assert_eq!(both.triangles.len(), alone.triangles.len() + other.triangles.len());
}

#[test]
fn smoothed_surfaces_are_the_same_for_any_split_into_bricks() {
    // So noisy and so few that means are smoothed twice.
    let scans: Vec<_> = (0..3).map(|i| noisy_patch(i, 3.0 * i as f64, 3.0)).collect();
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let split = |corner: [i64; 3]| {
        let setup = Setup { corner, ..Setup::default() };
        let merged = by_setup(&sources, &plain(2.0), &setup, &Progress::none()).unwrap();
        assert!(merged.report.overlap_residual.is_some_and(|d| d > 0.6));
        canonical(&merged.mesh)
    };
    let expected = split([0; 3]);
    assert!(expected.len() > 3000);
    for corner in [[16, 16, 16], [1, 0, 0], [-3, 7, 29], [31, 31, 31], [30, 2, 15]] {
        assert!(split(corner) == expected, "bricks from {corner:?}");
    }
}
