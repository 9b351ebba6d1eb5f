//! Constraints of the caller that are wrong.

use base::progress::Progress;
use glam::{DAffine3, DQuat, DVec3};
use image::RangeImage;
use mesh::shapes::Shape;
use surfrecon_align::{AlignParams, Alignment, Constraints, Pick, ScanSource, ScanState, Start, Turntable, run};

use crate::reach::{room, tour};
use crate::scans::{Known, aligned, around, errors, look, placed, sources, statue, without_poses};

fn lines(alignment: &Alignment) -> String {
    alignment.report.lines().join("\n")
}

/// Points of the surface that both scans show, as their sensors have them.
fn common(images: &[RangeImage], a: usize, b: usize, count: usize) -> Vec<Pick> {
    let points = |k: usize| -> Vec<DVec3> {
        let own = images[k].oriented_points(&Progress::none()).unwrap().positions;
        own.iter().map(|p| images[k].world_from_sensor.transform_point3(*p)).collect()
    };
    let (first, second) = (points(a), points(b));
    let spacing = 0.01;
    let near = first.iter().filter(|p| p.is_finite()).step_by(37).filter_map(|p| {
        let q = second.iter().filter(|q| q.is_finite()).min_by(|x, y| x.distance(*p).total_cmp(&y.distance(*p)))?;
        (q.distance(*p) < spacing).then_some((*p, *q))
    });
    let near: Vec<(DVec3, DVec3)> = near.collect();
    let own = |k: usize, at: DVec3| images[k].world_from_sensor.inverse().transform_point3(at);
    (0..count)
        .map(|k| near[k * (near.len() - 1) / (count - 1)])
        .map(|(p, q)| Pick { scans: [a, b], points: [own(a, p), own(b, q)], normals: None, weight: 1.0 })
        .collect()
}

#[test]
fn picks_that_do_not_belong_together_place_nothing() {
    let images = around(statue(), 5, 0.0)[..2].to_vec();
    let mut picks = common(&images, 0, 1, 3);
    picks[2].points[1] += DVec3::new(0.4, 0.2, 0.0);
    let alignment = aligned(&without_poses(&images), &Constraints { picks, ..Constraints::default() });
    assert_eq!(alignment.report.placed(), 0, "{}", lines(&alignment));
    assert!(lines(&alignment).contains("3 points picked"), "{}", lines(&alignment));
}

/// Picks that were refused do not pull scans from where others hold them.
#[test]
fn picks_that_do_not_belong_together_pull_nothing() {
    let images = around(statue(), 8, 0.0);
    let mut picks = common(&images, 0, 1, 3);
    picks[2].points[1] += DVec3::new(0.4, 0.2, 0.0);
    let alignment = aligned(&without_poses(&images), &Constraints { picks, ..Constraints::default() });
    let off = errors(&images, &alignment);
    assert!(off.iter().all(|off| off.is_some_and(|off| off < 1.0)), "{off:?} {}", lines(&alignment));
    assert!(lines(&alignment).contains("no place was found for the 3 points picked"), "{}", lines(&alignment));
}

#[test]
fn picks_a_little_off_choose_the_place_and_shape_the_rest() {
    let images = around(statue(), 6, 0.0)[..2].to_vec();
    let mut picks = common(&images, 0, 1, 4);
    picks.iter_mut().enumerate().for_each(|(k, pick)| pick.points[1] += 0.01 * DVec3::new(1.0, k as f64 % 2.0, -1.0));
    let alignment = aligned(&without_poses(&images), &Constraints { picks, ..Constraints::default() });
    let off = errors(&images, &alignment);
    assert!(off.iter().all(|off| off.is_some_and(|off| off < 1.5)), "{off:?} {}", lines(&alignment));
}

#[test]
fn trusting_what_may_turn_is_said() {
    let ball = Shape::Sphere { radius: 1.0 }.mesh(64);
    let images = [look(&ball, DVec3::new(1.0, 0.3, 0.5), 0.2, 0.0), look(&ball, DVec3::new(0.7, 0.8, 0.45), 1.3, 0.0)];
    let trusted = Constraints { trusted: vec![[0, 1]], ..Constraints::default() };
    let alignment = aligned(&without_poses(&images), &trusted);
    let text = lines(&alignment);
    assert!(text.contains("may turn or slide on each other"), "{text}");
    let moved = alignment.report.scans.iter().find(|scan| scan.reason.is_empty() && !scan.freedoms.is_empty());
    assert!(moved.is_some_and(|scan| scan.freedoms.len() == 3 && scan.deviation > 0.5), "{text}");
}

#[test]
fn fixed_scans_that_contradict_each_other_are_named() {
    let images = around(statue(), 6, 0.0);
    let mut given = without_poses(&images);
    for (k, shift) in [(0, 0.0), (3, 1.0)] {
        let by = DAffine3::from_translation(DVec3::new(shift, 0.0, 0.0));
        given[k] = placed(&images[k], by * images[k].world_from_sensor);
    }
    let alignment = aligned(&given, &Constraints { fixed: vec![0, 3], ..Constraints::default() });
    assert!(lines(&alignment).contains("fixed scans contradict each other"), "{}", lines(&alignment));
}

#[test]
fn angles_beside_equal_steps_are_refused() {
    let images = around(statue(), 3, 0.0);
    let params = AlignParams { turntable: Turntable::Equal, ..AlignParams::default() };
    let constraints = Constraints { angles: vec![0.0, 1.0, 2.0], ..Constraints::default() };
    let error = run(&sources(&images), &params, &constraints, &Progress::none()).unwrap_err();
    assert!(error.to_string().contains("choose one"), "{error}");
}

/// Theorem: pairs that are sure, and that say the same, win against one that the caller names, whether trusted or by points.
#[test]
fn a_wrong_pair_does_not_win_against_right_neighbours() {
    let images = around(statue(), 8, 0.0);
    let given = without_poses(&images);
    // Opposite sides of the statue share nothing.
    let own = |k: usize| given[k].oriented_points(&Progress::none()).unwrap().positions;
    let [first, second] =
        [own(0), own(4)].map(|points| points.into_iter().filter(|p| p.is_finite()).collect::<Vec<_>>());
    let middle = |points: &[DVec3]| points.iter().sum::<DVec3>() / points.len() as f64;
    let nearest = |points: &[DVec3], to: DVec3| {
        points.iter().copied().min_by(|a, b| a.distance(to).total_cmp(&b.distance(to))).unwrap()
    };
    // Points of both that lie alike in front of the sensors, as somebody picks them who takes one side for the other.
    let off = [DVec3::new(0.2, 0.0, 0.0), DVec3::new(-0.2, 0.1, 0.0), DVec3::new(0.0, -0.25, 0.0)];
    let picks = off.map(|off| {
        let points = [nearest(&first, middle(&first) + off), nearest(&second, middle(&second) + off)];
        Pick { scans: [0, 4], points, normals: None, weight: 1.0 }
    });
    let trusted = Constraints { trusted: vec![[0, 4]], ..Constraints::default() };
    let picked = Constraints { picks: picks.to_vec(), ..Constraints::default() };
    for constraints in [trusted, picked] {
        let alignment = aligned(&given, &constraints);
        let off = errors(&images, &alignment);
        assert!(off.iter().all(|off| off.is_some_and(|off| off < 1.0)), "{off:?} {}", lines(&alignment));
        let wrong = [&images[0].name, &images[4].name];
        let said = alignment.report.messages.iter().find(|text| wrong.iter().all(|name| text.contains(*name)));
        assert!(said.is_some(), "{}", lines(&alignment));
    }
}

/// Theorem: fixed scans that contradict each other are named, and by how much. Nothing is taken for bent or of another size for that.
#[test]
fn fixed_scans_that_contradict_each_other_are_named_with_how_far_they_are_off() {
    let images = around(statue(), 8, 0.0);
    for shift in [0.03, 0.12, 0.4] {
        let mut given = without_poses(&images);
        for (k, by) in [(0, 0.0), (1, shift), (5, 0.0)] {
            let by = DAffine3::from_translation(DVec3::new(0.0, 0.0, by));
            given[k] = placed(&images[k], by * images[k].world_from_sensor);
        }
        let alignment = aligned(&given, &Constraints { fixed: vec![0, 1, 5], ..Constraints::default() });
        let text = lines(&alignment);
        let said = alignment.report.messages.iter().find(|text| text.starts_with("fixed scans contradict each other"));
        let said = said.unwrap_or_else(|| panic!("{shift}: {text}"));
        assert!(said.contains(&format!("{:?}", images[1].name)), "{shift}: {text}");
        for wrong in ["times as large", "is bent", "has moved"] {
            assert!(!text.contains(wrong), "{shift}: {text}");
        }
        let far = said.split(" by ").nth(1).unwrap().split([',', '.']).take(2).collect::<Vec<_>>().join(".");
        let far: f64 = far.trim().parse().unwrap_or_else(|_| panic!("{said}"));
        assert!((far - shift).abs() < 0.3 * shift, "{shift}: {said}");
    }
    // Right ones are not.
    let alignment = aligned(&images, &Constraints { fixed: vec![0, 1, 5], ..Constraints::default() });
    assert!(!lines(&alignment).contains("contradict"), "{}", lines(&alignment));
}

/// The reason of a scan is the true one where its pairs are rejected, and where a turntable's axis is wrong.
#[test]
fn what_was_not_compared_does_not_share_too_little() {
    let images = around(statue(), 4, 0.0);
    let rejected = vec![[0, 3], [1, 3], [2, 3]];
    let alignment = aligned(&without_poses(&images), &Constraints { rejected, ..Constraints::default() });
    assert!(
        alignment.report.scans[3].reason.contains("all its pairs with other scans are rejected"),
        "{}",
        lines(&alignment)
    );
    let params = AlignParams { start: Start::Sequence, ..AlignParams::default() };
    let rejected = Constraints { rejected: vec![[0, 1]], ..Constraints::default() };
    let images = around(statue(), 5, 0.0);
    let mut given = without_poses(&images);
    let nothing = image::range_image::Samples::Values(vec![f64::NAN; given[2].rows() * given[2].cols()]);
    let image::range_image::Samples::Values(nothing) = nothing else { panic!("these are values") };
    given[2] = RangeImage::from_values(given[2].rows(), given[2].cols(), nothing, *given[2].projection()).unwrap();
    let alignment = run(&sources(&given), &params, &rejected, &Progress::none()).unwrap();
    let text = alignment.report.messages.join("\n");
    assert!(text.contains("the pair is rejected"), "{text}");
    assert!(text.contains("one of them has no surface"), "{text}");
}

/// A tolerance below the noise is named, and what noise does is not taken for warp.
#[test]
fn a_tolerance_below_the_noise_is_named() {
    let images = around(statue(), 5, 0.5);
    let by = |tolerance| {
        let params = AlignParams { tolerance, ..AlignParams::default() };
        lines(&run(&sources(&without_poses(&images)), &params, &Constraints::default(), &Progress::none()).unwrap())
    };
    let text = by(Some(1e-5));
    assert!(
        text.contains("tolerance, 1.0e-5, is smaller than the noise") || text.contains("tolerance, 0.00001"),
        "{text}"
    );
    assert!(text.contains("which noise explains") && !text.contains("shares less than a third"), "{text}");
    assert!(!by(None).contains("tolerance") && !by(Some(0.1)).contains("tolerance"));
}

/// Picks about which scans may turn are refused, and fewer than three where shape does not choose either.
#[test]
fn picks_that_give_no_pose_are_refused() {
    let images = around(statue(), 5, 0.0)[..2].to_vec();
    let picks = common(&images, 0, 1, 3);
    let refusal = |picks: Vec<Pick>| {
        let constraints = Constraints { picks, ..Constraints::default() };
        run(&sources(&images), &AlignParams::default(), &constraints, &Progress::none()).err().map(|e| e.to_string())
    };
    let mut in_line = picks.clone();
    for side in 0..2 {
        in_line[2].points[side] = in_line[0].points[side].lerp(in_line[1].points[side], 0.4);
    }
    let text = refusal(in_line.clone()).unwrap();
    assert!(text.contains("the 3 picks of scans 0 and 1 lie in a line in scan 0."), "{text}");
    // In one of the two scans, named the other way round.
    in_line[2].points[0] = picks[2].points[0];
    for pick in &mut in_line {
        pick.scans.reverse();
        pick.points.reverse();
    }
    assert!(refusal(in_line).unwrap().contains("lie in a line in scan 1"));
    let mut equal = picks.clone();
    equal[1].points[1] = equal[0].points[1];
    assert!(refusal(equal).unwrap().contains("picks 0 and 1 are the same point of scan 1"));
    assert_eq!(refusal(picks), None);
    let ball = Shape::Sphere { radius: 1.0 }.mesh(64);
    let images = [look(&ball, DVec3::new(1.0, 0.3, 0.5), 0.2, 0.0), look(&ball, DVec3::new(0.7, 0.8, 0.45), 1.3, 0.0)];
    for count in [1, 2] {
        let picks = common(&images, 0, 1, 3)[..count].to_vec();
        let alignment = aligned(&without_poses(&images), &Constraints { picks, ..Constraints::default() });
        let text = lines(&alignment);
        assert!(alignment.report.placed() == 0 && text.contains("too few points are picked"), "{text}");
    }
}

/// Scans that are there several times are named once, by groups, and those of one name with their numbers.
#[test]
fn equal_scans_are_named_in_one_message() {
    let images = around(statue(), 3, 0.0);
    let given: Vec<RangeImage> = [0, 1, 2, 0, 1, 0, 0].map(|k: usize| without_poses(&images[k..=k]).remove(0)).into();
    let alignment = aligned(&given, &Constraints::default());
    let said: Vec<&String> =
        alignment.report.messages.iter().filter(|text| text.contains("hold the same samples")).collect();
    assert_eq!(said.len(), 1, "{}", lines(&alignment));
    for number in [0, 1, 3, 4, 5, 6] {
        assert!(said[0].contains(&format!("(scan {number})")), "{}", said[0]);
    }
    assert!(said[0].starts_with("2 groups of scans hold the same samples"), "{}", said[0]);
    assert!(alignment.report.scans.iter().all(|scan| !scan.name.contains("(scan")));
    assert!(lines(&alignment).contains("(scan 6): "), "{}", lines(&alignment));
    assert!(alignment.report.scans.iter().all(|scan| scan.state != ScanState::Undecided));
}

/// Theorem: among fixed scans alone, too, those that contradict each other are named, and right ones are not.
#[test]
fn fixed_scans_alone_that_contradict_each_other_are_named() {
    let images = around(statue(), 8, 0.0);
    let fixed = |given: &[RangeImage]| {
        aligned(given, &Constraints { fixed: (0..given.len()).collect(), ..Constraints::default() })
    };
    let half_turn = DAffine3::from_rotation_z(std::f64::consts::PI);
    let far = DAffine3::from_translation(DVec3::new(3.0, 1.0, 0.0));
    for (count, wrong) in [(2, half_turn), (2, far), (8, half_turn), (8, far)] {
        let mut given = images[..count].to_vec();
        given[1] = placed(&images[1], wrong * images[1].world_from_sensor);
        let alignment = fixed(&given);
        let said = alignment.report.messages.iter().find(|text| text.starts_with("fixed scans contradict each other"));
        let name = format!("{:?}", images[1].name);
        assert!(said.is_some_and(|said| said.contains(&name)), "{count}: {}", lines(&alignment));
        let given: Vec<_> = given.iter().map(|image| Some(image.world_from_sensor)).collect();
        assert_eq!(alignment.world_from_scan, given);
    }
    for count in [2, 8] {
        let alignment = fixed(&images[..count]);
        assert!(!lines(&alignment).contains("contradict"), "{count}: {}", lines(&alignment));
    }
}

/// Theorem: fixed frames of a room that lie off by little are named too, though most of what they show are walls along which they slid.
#[test]
fn fixed_frames_that_slid_along_walls_are_named() {
    let images = tour(&room(11, 14), 30, (72, 96), 0.003)[..4].to_vec();
    for axis in [DVec3::Z, DVec3::Y, DVec3::X] {
        let mut given = images.clone();
        given[1] = placed(&images[1], DAffine3::from_translation(0.06 * axis) * images[1].world_from_sensor);
        let alignment = aligned(&given, &Constraints { fixed: vec![0, 1], ..Constraints::default() });
        let text = lines(&alignment);
        let said = ["frame 0", "frame 1", "are off by 0.06"].iter().all(|part| text.contains(part));
        assert!(text.contains("fixed scans contradict each other") && said, "{axis}: {text}");
    }
    let alignment = aligned(&images, &Constraints { fixed: vec![0, 1], ..Constraints::default() });
    assert!(!lines(&alignment).contains("contradict"), "{}", lines(&alignment));
}

/// Theorem: points that are a little off do not pull scans apart that shape holds: poses are as exact as without them, and as sure.
#[test]
fn points_choose_a_place_and_shape_where_in_it() {
    let images = around(statue(), 8, 0.0)[..3].to_vec();
    let given = without_poses(&images);
    let mut picks = common(&images, 0, 1, 4);
    for (k, pick) in picks.iter_mut().enumerate() {
        pick.points[1] +=
            0.03 * DVec3::new([1.0, -0.5, 0.4, -0.8][k], [0.3, 0.9, -1.0, 0.1][k], [0.2, 0.5, 0.8, -1.0][k]);
    }
    let [without, with] =
        [Vec::new(), picks].map(|picks| aligned(&given, &Constraints { picks, ..Constraints::default() }));
    for alignment in [&without, &with] {
        let off = errors(&images, alignment);
        assert!(off.iter().all(|off| off.is_some_and(|off| off < 0.5)), "{off:?} {}", lines(alignment));
    }
    for (without, with) in without.report.scans.iter().zip(&with.report.scans) {
        assert!(with.deviation <= 1.5 * without.deviation, "{} {}", without.deviation, with.deviation);
    }
}

/// Points of one scan, and where a motion takes them, as somebody picks them who is wrong.
fn picked_wrongly(image: &RangeImage, other_from_own: &DAffine3) -> Vec<Pick> {
    let own = image.oriented_points(&Progress::none()).unwrap().positions;
    let own: Vec<DVec3> = own.into_iter().filter(|p| p.is_finite()).collect();
    let points = [own.len() / 9, own.len() / 2, own.len() - own.len() / 7].map(|k| own[k]);
    let pick =
        |p: DVec3| Pick { scans: [0, 1], points: [p, other_from_own.transform_point3(p)], normals: None, weight: 1.0 };
    points.map(pick).to_vec()
}

/// Theorem: points that agree with each other place no scan where its surface lies on no other, and the reason says so.
#[test]
fn points_that_put_a_scan_where_nothing_is_place_it_nowhere() {
    let images = around(statue(), 5, 0.0)[..2].to_vec();
    let given = without_poses(&images);
    let shift = |x: f64| DAffine3::from_translation(DVec3::new(x, 0.0, 0.0));
    let turned = DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_2);
    for wrong in [DAffine3::IDENTITY, turned, shift(1.2), shift(1.6) * turned] {
        let picks = picked_wrongly(&given[0], &wrong);
        let alignment = aligned(&given, &Constraints { picks, ..Constraints::default() });
        let text = lines(&alignment);
        assert_eq!(alignment.report.placed(), 0, "{text}");
        assert!(
            text.contains("not placed: your points place it where it overlaps no other scan: check them"),
            "{wrong}: {text}"
        );
        assert!(text.contains(": stays where it is, and no other scan has a place beside it"), "{text}");
    }
}

/// Theorem: points that tip a scan further than gravity allows are refused, with the reason.
#[test]
fn points_that_tip_a_scan_over_are_refused() {
    let images = around(statue(), 6, 0.0)[..2].to_vec();
    let known: Vec<Known> = images
        .iter()
        .zip(without_poses(&images))
        .map(|(image, given)| {
            let up = image.world_from_sensor.inverse().transform_vector3(DVec3::Z);
            Known { image: given, moment: None, up: Some(up) }
        })
        .collect();
    let sources: Vec<&dyn ScanSource> = known.iter().map(|scan| scan as &dyn ScanSource).collect();
    let by = |picks: Vec<Pick>| {
        let constraints = Constraints { picks, ..Constraints::default() };
        run(&sources, &AlignParams::default(), &constraints, &Progress::none()).unwrap()
    };
    let right = common(&images, 0, 1, 3);
    let off = errors(&images, &by(right.clone()));
    assert!(off.iter().all(|off| off.is_some_and(|off| off < 1.0)), "{off:?}");
    let middle = right.iter().map(|pick| pick.points[1]).sum::<DVec3>() / right.len() as f64;
    let tip = DQuat::from_axis_angle((known[1].up.unwrap()).any_orthonormal_vector(), 0.9);
    let wrong = right.into_iter().map(|mut pick| {
        pick.points[1] = middle + tip * (pick.points[1] - middle);
        pick
    });
    let alignment = by(wrong.collect());
    let text = lines(&alignment);
    assert_eq!(alignment.report.placed(), 0, "{text}");
    assert!(text.contains("not placed: your points would tip it by 53 degrees beside"), "{text}");
    assert!(text.contains("would tip one of them by 53 degrees, and gravity allows 10."), "{text}");
}

/// Theorem: where scans share less than the caller asks for, that is the reason.
#[test]
fn a_least_overlap_that_no_pair_has_is_named() {
    let images = without_poses(&around(statue(), 6, 0.0)[..2]);
    let params = AlignParams { min_overlap: 1.0, ..AlignParams::default() };
    let alignment = run(&sources(&images), &params, &Constraints::default(), &Progress::none()).unwrap();
    let text = lines(&alignment);
    assert!(text.contains("and min_overlap asks for 100 %: lower it"), "{text}");
}

/// Theorem: scans of which none has a surface are refused.
#[test]
fn scans_without_a_surface_are_refused() {
    let image = &around(statue(), 2, 0.0)[0];
    let of = |rows: usize, cols: usize, value: f64| {
        RangeImage::from_values(rows, cols, vec![value; rows * cols], *image.projection()).unwrap()
    };
    for nothing in [of(4, 4, f64::NAN), of(1, 1, 2.0)] {
        let given = [nothing.clone(), nothing];
        let error = run(&sources(&given), &AlignParams::default(), &Constraints::default(), &Progress::none());
        let text = error.unwrap_err().to_string();
        assert!(text.contains("none of the 2 scans has a surface: no sample has neighbours"), "{text}");
        let some = [given[0].clone(), image.clone()];
        run(&sources(&some), &AlignParams::default(), &Constraints::default(), &Progress::none()).unwrap();
    }
}
