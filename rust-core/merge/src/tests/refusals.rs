//! Scans that can't be merged, and what is said then.

use super::*;

#[test]
fn empty_and_degenerate_scans_change_nothing_or_say_so() {
    let good = scans(Shape::Sphere { radius: 1.0 }, 40);
    let expected = merge_scans(&good, &plain(0.1)).mesh.triangles;
    let image = |rows: usize, cols: usize, point: [f32; 3]| {
        RangeImage::from_points(rows, cols, vec![point; rows * cols], Viewing::ALONG_MINUS_Z).unwrap()
    };
    for bad in [
        image(0, 0, [0.0; 3]),
        image(1, 1, [0.5; 3]),
        image(1, 50, [0.25; 3]),
        image(20, 20, [f32::NAN; 3]),
        image(20, 20, [f32::INFINITY; 3]),
        image(20, 20, [0.5; 3]),
    ] {
        let mut all = good.clone();
        all.push(bad.clone());
        assert_eq!(merge_scans(&all, &plain(0.1)).mesh.triangles, expected);
        let error = merge(&[&bad], &MergeParams::default(), Run::default(), &Progress::none()).unwrap_err();
        assert!(error.to_string().contains("nothing to merge"), "{error}");
    }
    let error = merge(&[], &MergeParams::default(), Run::default(), &Progress::none()).unwrap_err();
    assert!(error.to_string().contains("no scan"), "{error}");
}

/// The limit that leaves no triangle is the one to raise.
#[test]
fn limits_that_leave_no_triangle_are_named() {
    let scan = &scans(Shape::Sphere { radius: 1.0 }, 20)[0];
    let said = |edge_limit: Option<f64>, grazing_limit: f64| {
        let triangulation = TriangulateParams { edge_limit, grazing_limit };
        let params = MergeParams { triangulation, ..MergeParams::default() };
        merge(&[scan], &params, Run::default(), &Progress::none()).unwrap_err().to_string()
    };
    let all = TriangulateParams::default().grazing_limit;
    let grazing = "grazing_limit, which is 0.01 degrees";
    assert!(said(None, 0.01_f64.to_radians()).ends_with(&format!("or raise {grazing}.")));
    assert!(said(Some(1e-9), all).ends_with("or raise edge_limit, which is 1e-9."));
    assert!(
        said(Some(1e-9), 0.01_f64.to_radians())
            .ends_with(&format!("or raise {grazing}, or edge_limit, which is 1e-9."))
    );
}

#[test]
fn a_voxel_too_large_or_far_too_small_is_refused_with_a_remedy() {
    let mesh = Shape::Sphere { radius: 0.1 }.mesh(8);
    let pose = DAffine3::from_translation(DVec3::splat(50.0));
    let placed = PlacedMesh { name: "sphere".to_owned(), mesh: &mesh, world_from_mesh: pose };
    let refused =
        |voxel: f64| merge(&[&placed], &plain(voxel), Run::default(), &Progress::none()).unwrap_err().to_string();
    assert!(refused(1e6).starts_with("nothing is left of the surface: choose a voxel smaller than 1000000"));
    let error = refused(1e-9);
    assert!(error.starts_with("not enough memory: a voxel of 1e-9 ") && error.ends_with(" fits"), "{error}");
}

#[test]
fn scans_out_of_reach_are_named() {
    let mut mesh = Shape::Sphere { radius: 1.0 }.mesh(4);
    mesh.positions.iter_mut().for_each(|p| *p += DVec3::splat(1e16));
    let placed = PlacedMesh { name: "stray".to_owned(), mesh: &mesh, world_from_mesh: DAffine3::IDENTITY };
    assert!(
        merge(&[&placed], &plain(0.1), Run::default(), &Progress::none())
            .unwrap_err()
            .to_string()
            .contains("larger voxel")
    );
    let near = Shape::Sphere { radius: 1.0 }.mesh(4);
    let base = PlacedMesh { name: "base".to_owned(), mesh: &near, world_from_mesh: DAffine3::IDENTITY };
    let far = DAffine3::from_translation(DVec3::splat(1e9));
    let placed = PlacedMesh { name: "stray".to_owned(), mesh: &near, world_from_mesh: far };
    let error = merge(&[&base, &placed], &plain(0.01), Run::default(), &Progress::none()).unwrap_err().to_string();
    assert!(error.contains("vertex 0"), "{error}");
}

#[test]
fn bad_parameters_name_value_range_and_unit() {
    let scan = &scans(Shape::Sphere { radius: 1.0 }, 20)[0];
    let text =
        |params: MergeParams| merge(&[scan], &params, Run::default(), &Progress::none()).unwrap_err().to_string();
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = text(MergeParams { voxel: Some(value), ..MergeParams::default() });
        assert_eq!(error, format!("voxel must be a finite number > 0, got {value} (in the unit of the scans)"));
    }
    assert!(text(MergeParams { merge_distance: Some(-2.0), ..MergeParams::default() }).contains(">= 0, got -2"));
    assert!(text(MergeParams { min_component_share: 1.5, ..MergeParams::default() }).contains("<= 1, got 1.5"));
    assert!(text(MergeParams { max_hole_length: Some(f64::NAN), ..MergeParams::default() }).contains("NaN"));
    let steep = TriangulateParams { grazing_limit: 3.0, ..TriangulateParams::default() };
    assert!(text(MergeParams { triangulation: steep, ..MergeParams::default() }).contains("grazing_limit"));
}
