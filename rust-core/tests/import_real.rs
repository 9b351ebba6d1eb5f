//! Reads the real scan sets named in the environment variable SURFRECON_DATA.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::path::PathBuf;

use surfrecon::geom::neighbours::KdTree;
use surfrecon::import::{self, Content};
use surfrecon::mesh::check;

fn data() -> Option<PathBuf> {
    let data = std::env::var_os("SURFRECON_DATA").map(PathBuf::from);
    if data.is_none() {
        println!("SKIPPED: SURFRECON_DATA is not set");
    }
    data
}

/// Opens a set, checks that its quaternions are found to rotate world to scan, and counts the samples of each scan.
fn samples(conf: &str) -> Option<Vec<(String, usize)>> {
    let set = import::open(&data()?.join(conf)).unwrap();
    let note = set.notes.last().unwrap();
    println!("{note}");
    assert!(note.contains(".conf: quaternions read as (x y z w) rotating world to scan (median overlap distance"));
    Some(
        set.scans
            .iter()
            .map(|scan| {
                let Content::RangeImage(image) = scan.read().unwrap() else {
                    panic!("{} is no range image", scan.name)
                };
                assert_eq!(image.name, scan.name);
                assert_eq!(image.world_from_sensor, scan.world_from_sensor);
                let preview = scan.preview_points(1000).unwrap();
                assert!((800..=1200).contains(&preview.len()), "{}: {} points", scan.name, preview.len());
                (scan.name.clone(), image.valid_count())
            })
            .collect(),
    )
}

#[test]
fn bunny() {
    let Some(samples) = samples("stanford_bunny/bun.conf") else { return };
    let expected = [
        ("bun000", 40_256),
        ("bun045", 40_097),
        ("bun090", 30_379),
        ("bun180", 40_251),
        ("bun270", 31_701),
        ("top2", 38_298),
        ("top3", 36_023),
        ("bun315", 35_336),
        ("chin", 37_738),
        ("ear_back", 32_193),
    ];
    assert_eq!(samples, expected.map(|(name, count)| (name.to_owned(), count)));
}

#[test]
fn dragon() {
    let Some(samples) = samples("stanford_dragon_stand/dragonStandRight.conf") else { return };
    assert_eq!((samples.len(), samples.iter().map(|s| s.1).sum::<usize>()), (15, 469_193));
}

#[test]
fn happy() {
    let Some(samples) = samples("stanford_happy_stand/happyStandRight.conf") else { return };
    assert_eq!((samples.len(), samples.iter().map(|s| s.1).sum::<usize>()), (15, 1_099_005));
}

#[test]
fn meshes() {
    let Some(data) = data() else { return };
    let files = [
        ("stanford_bunny/bun_zipper.ply", 35_947, 69_451, &["confidence", "intensity"][..]),
        ("meshes/dragon_vrip_res2.ply", 100_250, 202_520, &[]),
        ("meshes/igea.ply", 134_345, 268_686, &[]),
        ("meshes/horse.ply", 48_485, 96_966, &[]),
        ("points/bunny70k.ply", 34_834, 69_451, &[]),
        ("meshlab_rangemaps/lato000.ply", 44_461, 86_766, &["quality"]),
    ];
    for (file, vertices, triangles, attributes) in files {
        let set = import::open(&data.join(file)).unwrap();
        let Content::Mesh(mesh) = set.scans[0].read().unwrap() else { panic!("{file} is no mesh") };
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (vertices, triangles), "{file}");
        assert_eq!(mesh.vertex_attributes.iter().map(|a| a.name.as_str()).collect::<Vec<_>>(), attributes);
        mesh.validate().unwrap();
    }
}

/// The values are those that NumPy, Pillow and rasterio give.
#[test]
fn height_maps() {
    let Some(data) = data() else { return };
    let read = |file: &str| match import::open(&data.join(file)).unwrap().scans[0].read().unwrap() {
        Content::RangeImage(image) => image,
        other => panic!("{file}: {other:?}"),
    };
    let etna = read("dem/N37E014.hgt");
    assert_eq!((etna.rows(), etna.cols(), etna.valid_count()), (1201, 1201, 1201 * 1201));
    let sea = (0..etna.len()).filter(|&i| etna.range(i) == 0.0).count();
    assert_eq!(sea, 38_868);
    let fuji = read("dem/fuji.png");
    let highest = (0..fuji.len()).map(|i| fuji.range(i)).fold(0.0, f64::max);
    assert!((3700.0..3780.0).contains(&highest), "Fuji is 3776 m high, not {highest}");
    let error = import::open(&data.join("dem/autzen-height.tif")).unwrap().scans[0].read().unwrap_err().to_string();
    assert!(
        error.contains("3 channels a pixel, but a height map or depth image has one, of whole numbers or floats"),
        "{error}"
    );
}

/// Placed depth images of one scene lie on each other: the poses, the camera and the unit are understood.
#[test]
fn depth_sequences() {
    let Some(data) = data() else { return };
    let depth = |folder: &str, name: &dyn Fn(usize) -> String, count: usize| -> Vec<PathBuf> {
        (0..count).map(|i| data.join(folder).join(name(i))).collect()
    };
    let mut living_room = depth("rgbd_open3d/depth", &|i| format!("{i:05}.png"), 5);
    living_room.push(data.join("rgbd_open3d/camera_primesense.json"));
    living_room.push(data.join("rgbd_open3d/trajectory.log"));
    let mut heads = depth("rgbd_7scenes", &|i| format!("frame-000{}.depth.png", 150 + 5 * i), 3);
    heads.push(data.join("rgbd_7scenes/camera-intrinsics.txt"));
    for (paths, apart) in [(living_room, 0.015), (heads, 0.02)] {
        let set = import::open_many(&paths).unwrap();
        println!("{:?}", set.notes);
        let points: Vec<Vec<glam::DVec3>> = set
            .scans
            .iter()
            .map(|scan| {
                let Content::RangeImage(image) = scan.read().unwrap() else { panic!("no range image") };
                (0..image.len()).step_by(7).filter(|&i| image.is_valid(i)).map(|i| image.point_in_world(i)).collect()
            })
            .collect();
        let tree = KdTree::new(&points[0]);
        let mut far: Vec<f64> = points[1].iter().step_by(20).filter_map(|p| Some(tree.nearest(*p)?.1)).collect();
        far.sort_by(f64::total_cmp);
        let median = far[far.len() / 2];
        println!("median distance to the first image: {median}");
        assert!(median < apart, "{median}");
    }
}

/// Counts from the files' headers and from PCL's and PDAL's own tests.
#[test]
fn scanners_grids() {
    let Some(data) = data() else { return };
    let images = |file: &str| -> Vec<surfrecon::RangeImage> {
        let set = import::open(&data.join(file)).unwrap();
        let content = set.scans.iter().map(|scan| match scan.read().unwrap() {
            Content::RangeImage(image) => image,
            other => panic!("{file}: {other:?}"),
        });
        content.collect()
    };
    let sizes = |file: &str| -> Vec<(usize, usize, usize)> {
        images(file).iter().map(|image| (image.rows(), image.cols(), image.valid_count())).collect()
    };
    assert_eq!(sizes("ptx/complex-transform.ptx"), [(6, 2, 4)]);
    assert_eq!(sizes("ptx/1.2-with-color.ptx"), [(71, 15, 1065)]);
    assert_eq!(sizes("ptx/multiple-and-transform.ptx").len(), 2);
    let far = &images("ptx/1.2-with-color.ptx")[0];
    // Single precision beside an origin in double: a hundredth of a millimetre at 849 km.
    assert!((far.point_in_world(0) - glam::DVec3::new(637_012.24, 849_028.31, 431.66)).length() < 1e-4);
    for (file, valid) in [("learn0", 150_000..307_200), ("milk_cartoon_all_small_clorox", 100_000..307_200)] {
        let image = &images(&format!("organized_pcd/{file}.pcd"))[0];
        assert_eq!((image.rows(), image.cols()), (480, 640));
        assert!(valid.contains(&image.valid_count()), "{file}: {}", image.valid_count());
        let surface =
            surfrecon::triangulate::triangulate(image, &Default::default(), &surfrecon::Progress::none()).unwrap();
        // The grid's neighbours are neighbours in space: most cells of valid pixels have both triangles.
        assert!(surface.triangles.len() > image.valid_count(), "{file}: {}", surface.triangles.len());
    }
    for (file, points) in [("milk", 12_575), ("model", 100_000), ("room_scan1", 112_586)] {
        let set = import::open(&data.join(format!("organized_pcd/{file}.pcd"))).unwrap();
        let Content::Points(cloud) = set.scans[0].read().unwrap() else { panic!("{file} is no cloud") };
        assert_eq!(cloud.positions.len(), points);
    }
}

#[test]
fn clouds_meshes_and_projects() {
    let Some(data) = data() else { return };
    for (file, points) in [("bunnyFloat", 30_571), ("bunnyInt24", 30_571), ("tinyCartesianFloatRgb", 2090)] {
        let set = import::open(&data.join(format!("e57/{file}.e57"))).unwrap();
        let Content::Points(cloud) = set.scans[0].read().unwrap() else { panic!("{file} is no cloud") };
        println!("{file}: {} points", cloud.positions.len());
        assert_eq!(cloud.positions.len(), points, "{file}");
        assert_eq!(cloud.colour.is_some(), file.ends_with("Rgb"));
    }
    let set = import::open(&data.join("meshes/libigl_armadillo.obj")).unwrap();
    let Content::Mesh(armadillo) = set.scans[0].read().unwrap() else { panic!("no mesh") };
    assert_eq!((armadillo.positions.len(), armadillo.triangles.len()), (43_243, 86_482));
    assert!(check(&armadillo).is_closed());
    let error = import::open(&data.join("meshlab_rangemaps/partial.mlp")).unwrap_err().to_string();
    assert!(error.contains("10 of 12 files are missing: lato225.ply, lato135.ply"), "{error}");
}
