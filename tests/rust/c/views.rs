//! Views of a statue as a scanner gives them that knows no poses.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use glam::DAffine3;
use surfrecon::geom::bvh::Bvh;
use surfrecon::scan::{ScanParams, TurntableViews, VirtualCamera, bounds, scan, sculpture::sculpture, turntable};
use surfrecon::{Progress, RangeImage, export};

/// Four neighbours of nine around it, where they were taken.
pub fn views() -> &'static [RangeImage] {
    static VIEWS: OnceLock<Vec<RangeImage>> = OnceLock::new();
    VIEWS.get_or_init(|| {
        let none = Progress::none();
        let mesh = sculpture(3.0, 0, &none).unwrap();
        let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 0).unwrap();
        let table = TurntableViews { around: 9, above: 0, below: 0, pixels: 150, ..TurntableViews::default() };
        let cameras = turntable(bounds(&mesh.positions).unwrap(), &table, &none).unwrap();
        let see = |(k, camera): (usize, &VirtualCamera)| {
            let mut image = scan(&mesh, &bvh, camera, &ScanParams::default(), &none).unwrap();
            image.name = format!("view{k}");
            image
        };
        cameras[..4].iter().enumerate().map(see).collect()
    })
}

/// Writes them as a list that places none, into a folder. Its path.
pub fn without_poses(folder: &Path) -> PathBuf {
    let mut lost = views().to_vec();
    lost.iter_mut().for_each(|view| view.world_from_sensor = DAffine3::IDENTITY);
    let path = folder.join("views.conf");
    let encoding = export::PlyEncoding::BinaryLittleEndian;
    export::write_scan_list(&path, &lost.iter().collect::<Vec<_>>(), encoding, &Progress::none()).unwrap();
    path
}
