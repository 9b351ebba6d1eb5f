//! Any points, from small lattices full of ties to doubles of any size: a Delaunay tetrahedralization that passes its own
//! check, or an error that the points deserve.

#![no_main]

use glam::DVec3;
use libfuzzer_sys::fuzz_target;
use surfrecon::geom::delaunay3::Delaunay3;
use surfrecon::progress::Progress;

fuzz_target!(|bytes: &[u8]| {
    let Some((&kind, bytes)) = bytes.split_first() else { return };
    let coordinates: Vec<f64> = match kind % 3 {
        0 => bytes.iter().map(|&b| f64::from(b % 5)).collect(),
        1 => bytes.chunks_exact(2).map(|b| f64::from(i16::from_le_bytes([b[0], b[1]])) / 10.0).collect(),
        _ => bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect(),
    };
    let points: Vec<DVec3> = coordinates.as_chunks().0.iter().map(|&p| DVec3::from(p)).collect();
    match Delaunay3::new(&points, 1, &Progress::none()) {
        Ok(delaunay) => delaunay.check(&points).expect("Delaunay"),
        Err(error) => {
            let text = error.to_string();
            assert!(["no points", "equal", "line", "plane", "finite"].iter().any(|why| text.contains(why)), "{text}");
        }
    }
});
