//! meshoptimizer as a peer of `bench/sculpt.py`: a mesh of every sample, collapsed to an error of its own measure.
//!
//! `surfrecon-bench-meshopt POSITIONS TRIANGLES ERROR OUT`: three floats per vertex, three 32-bit indices per triangle, the largest error
//! in the unit of the positions. OUT receives the indices that are left. Prints the wall-clock seconds of the collapse as JSON.

use std::error::Error;
use std::time::Instant;

use meshopt::{SimplifyOptions, VertexDataAdapter};

fn main() -> Result<(), Box<dyn Error>> {
    let [_, positions, triangles, error, out] = &std::env::args().collect::<Vec<_>>()[..] else {
        return Err("usage: surfrecon-bench-meshopt POSITIONS TRIANGLES ERROR OUT".into());
    };
    let positions = std::fs::read(positions)?;
    let triangles: Vec<u32> = bytemuck::pod_collect_to_vec(&std::fs::read(triangles)?);
    let vertices = VertexDataAdapter::new(&positions, 12, 0)?;
    let start = Instant::now();
    let options = SimplifyOptions::ErrorAbsolute | SimplifyOptions::LockBorder;
    let left = meshopt::simplify(&triangles, &vertices, 0, error.parse()?, options, None);
    println!("{{\"wall_s\": {}}}", start.elapsed().as_secs_f64());
    std::fs::write(out, bytemuck::cast_slice::<u32, u8>(&left))?;
    Ok(())
}
