//! Makes a surface through points from a file of little-endian doubles: the program that `make bench ONLY=scattered`
//! measures.

use std::io::Write;
use std::path::PathBuf;

use clap::Parser;
use surfrecon::mesh::AttributeData;
use surfrecon::reconstruct::{self, ReconstructParams};
use surfrecon::{PointCloud, Progress};

#[derive(Parser)]
struct Options {
    /// x, y, z of each point, as doubles, least byte first.
    points: PathBuf,
    /// Receives the number of triangles and, for each, the indices of its three points, all as 32-bit integers.
    triangles: PathBuf,
    /// Receives x, y, z of each vertex, which smoothing may have moved. Triangles then have indices of these.
    #[arg(long)]
    vertices: Option<PathBuf>,
    /// Worker threads, 0 for one per core.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Makes the threshold on the perimeters of facets larger, 1 to 2.
    #[arg(long, default_value_t = ReconstructParams::default().factor)]
    factor: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = Options::parse();
    let positions = bytemuck::pod_collect_to_vec(&std::fs::read(&options.points)?);
    let cloud = PointCloud { positions, ..PointCloud::default() };
    let params = ReconstructParams { threads: options.threads, factor: options.factor, ..Default::default() };
    let made = reconstruct::run_owned(cloud, &params, &Progress::none())?;
    let Some(AttributeData::I32(points)) = made.mesh.vertex_attribute("source_point") else {
        return Err("the mesh does not say which points it goes through".into());
    };
    if let Some(file) = &options.vertices {
        std::fs::write(file, bytemuck::cast_slice(&made.mesh.positions))?;
    }
    let mut out = std::io::BufWriter::new(std::fs::File::create(&options.triangles)?);
    out.write_all(&(made.mesh.triangles.len() as u32).to_le_bytes())?;
    for &vertex in made.mesh.triangles.as_flattened() {
        let index = if options.vertices.is_some() { vertex } else { points[vertex as usize] as u32 };
        out.write_all(&index.to_le_bytes())?;
    }
    out.flush()?;
    Ok(())
}
