//! Coordinates in single precision, as STL and 3MF hold them.
//!
//! A mesh whose coordinates single precision holds keeps that: each step rounds its vertices before it looks for crossings. So files hold
//! what was looked at. They are multiples of one step, the smallest that single precision knows at the largest coordinate: two vertices that
//! differ are at least that far apart, also near the origin, where single precision is finer than any tool for printing. Vertices too close
//! together for it, and far from the origin, stay in double precision.

use glam::DVec3;

use base::error::{Result, Shown, counted};
use base::progress::{Pace, Progress};
use close::crossing;
use mesh::{AttributeData, TriMesh};

use super::made::PART;
use super::report::{PrepareProblem, PrepareReport};

/// Numbers that coordinates are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Precision {
    /// Multiples of a step.
    Single {
        step: f64,
    },
    Double,
}

impl Precision {
    /// That of a mesh.
    pub fn of(mesh: &TriMesh) -> Self {
        let is_single = mesh.positions.iter().all(|place| place.as_vec3().as_dvec3() == *place);
        if is_single { Precision::single(mesh) } else { Precision::Double }
    }

    /// Single precision, whether the mesh has it or not.
    pub fn single(mesh: &TriMesh) -> Self {
        let largest = mesh.positions.iter().fold(0.0_f64, |most, place| most.max(place.abs().max_element()));
        let largest = (largest as f32).max(f32::MIN_POSITIVE);
        Precision::Single { step: f64::from(largest) - f64::from(largest.next_down()) }
    }

    /// The nearest number.
    pub fn number(self, x: f64) -> f64 {
        match self {
            // Beyond the largest coordinate single precision is coarser.
            Precision::Single { step } => f64::from(((x / step).round() * step) as f32),
            Precision::Double => x,
        }
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
    let rounded = rounded(mesh);
    if rounded == mesh.positions {
        return Ok(());
    }
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
    let precision = Precision::single(mesh);
    mesh.positions.iter().map(|&place| precision.place(place)).collect()
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
