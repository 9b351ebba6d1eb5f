//! Coordinates in single precision, as STL and 3MF hold them.
//!
//! A mesh whose coordinates single precision holds keeps that: each step rounds its vertices before it looks for crossings. So files hold
//! what was looked at. Vertices too close together for it, and far from the origin, stay in double precision.

use glam::DVec3;

use base::error::{Result, Shown, counted};
use base::progress::{Pace, Progress};
use close::crossing;
use mesh::{AttributeData, TriMesh};

use super::made::PART;
use super::report::{PrepareProblem, PrepareReport};

/// Numbers that coordinates are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    Single,
    Double,
}

impl Precision {
    /// That of a mesh.
    pub fn of(mesh: &TriMesh) -> Self {
        let is_single = mesh.positions.iter().all(|&place| Precision::Single.place(place) == place);
        if is_single { Precision::Single } else { Precision::Double }
    }

    /// The nearest number.
    pub fn number(self, x: f64) -> f64 {
        if self == Precision::Single { f64::from(x as f32) } else { x }
    }

    /// The nearest place.
    pub fn place(self, place: DVec3) -> DVec3 {
        place.map(|x| self.number(x))
    }
}

/// Rounds all vertices to single precision, unless vertices would meet or faces cross that do not.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn round(mesh: &mut TriMesh, progress: &Progress<'_>) -> Result<()> {
    if Precision::of(mesh) == Precision::Single {
        return Ok(());
    }
    let rounded = rounded(mesh);
    if shared(&rounded, mesh, progress)?.len() > shared(&mesh.positions, mesh, progress)?.len() {
        return Ok(());
    }
    if crossing::pairs(&rounded, &mesh.triangles, |_| true, progress)?.is_empty() {
        mesh.positions = rounded;
        mesh.rounding_room = None;
    }
    Ok(())
}

fn rounded(mesh: &TriMesh) -> Vec<DVec3> {
    mesh.positions.iter().map(|&place| Precision::Single.place(place)).collect()
}

/// The vertices that lie where another one of the same part does, by their places.
fn shared(places: &[DVec3], mesh: &TriMesh, progress: &Progress<'_>) -> Result<Vec<u32>> {
    // Adding zero makes -0 and 0 one.
    let bits = |place: DVec3| (place + 0.0).to_array().map(f64::to_bits);
    let mut part_of = vec![0; places.len()];
    if let Some(AttributeData::I32(parts)) = mesh.face_attribute(PART) {
        mesh.triangles.iter().zip(parts).for_each(|(t, &part)| t.iter().for_each(|&v| part_of[v as usize] = part));
    }
    let mut pace = Pace::new(progress);
    let mut all: Vec<([u64; 3], i32, u32)> = Vec::with_capacity(places.len());
    for (v, &place) in places.iter().enumerate() {
        pace.after(1)?;
        all.push((bits(place), part_of[v], v as u32));
    }
    progress.sort(&mut all, &|a, b| a.cmp(b))?;
    let groups = all.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).filter(|group| group.len() > 1);
    Ok(groups.flatten().map(|of| of.2).collect())
}

/// Says how many vertices single precision does not tell apart, and whether faces cross in it.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn tell(mesh: &TriMesh, report: &mut PrepareReport, progress: &Progress<'_>) -> Result<()> {
    let touching = shared(&mesh.positions, mesh, progress)?;
    let near = if touching.is_empty() { shared(&rounded(mesh), mesh, progress)? } else { Vec::new() };
    let of = |vertices: &[u32]| {
        let [x, y, z] = mesh.positions[vertices[0] as usize].to_array().map(|x| Shown::digits(x, 4));
        let count = counted(vertices.len() as u64, "vertex lies", "vertices lie");
        (count, format!("({x}, {y}, {z})"))
    };
    let text = if !touching.is_empty() {
        let (count, place) = of(&touching);
        format!(
            "{count} where others do, the first at {place}. STL joins bodies that touch: move them apart, or give another height"
        )
    } else if !near.is_empty() {
        let (count, place) = of(&near);
        format!(
            "{count} where others do in single precision, the first at {place}. STL and 3MF join them: give another size or cell, or move the mesh to the origin"
        )
    } else if Precision::of(mesh) == Precision::Double {
        "Faces cross in single precision, which STL and 3MF hold: move the mesh to the origin, or make it with a larger cell".to_owned()
    } else {
        return Ok(());
    };
    report.note(PrepareProblem::TooFine, text);
    Ok(())
}
