//! The rich shape of the demo: a horned serpent around a fluted column on an ornate pedestal, 234 mm high.
//!
//! | file | what |
//! |---|---|
//! | `field` | smooth unions, round cones and other parts of a distance field |
//! | `serpent` | the body along its spine, with scales, belly plates and fins |
//! | `head` | skull, jaw, horns, teeth, whiskers |
//! | `column` | pedestal, fluted shaft, capital, pearl |
//! | `polygonize` | from the field to triangles |
//!
//! Nothing is read or drawn at random: the same mesh everywhere. It has what makes scanning hard: fine relief, deep
//! concavities, parts that hide each other, and fins and whiskers hardly thicker than a triangle.

mod column;
mod field;
mod head;
mod polygonize;
mod serpent;

use glam::DVec3;

use base::error::{Error, Result};
use base::memory;
use base::progress::Progress;
use field::Part;
use mesh::{Attribute, TriMesh};
use polygonize::Field;

/// Edge of the lattice's cubes that gives about 400,000 triangles.
pub const CELL: f64 = 1.8;

/// Finest lattice that its packed coordinates hold.
const FINEST: f64 = 0.5;

struct Sculpture {
    serpent: serpent::Serpent,
    head: head::Head,
}

impl Sculpture {
    fn new() -> Self {
        let serpent = serpent::Serpent::new();
        let head = head::Head::new(serpent.head_frame());
        Sculpture { serpent, head }
    }

    /// The nearest part and its colour. With `coloured` false, the colour is left out.
    fn part(&self, p: DVec3, coloured: bool) -> Part {
        let stone = column::part(p, coloured);
        let body = self.serpent.part(p, coloured);
        let head = self.head.part(p, coloured);
        body.blend(head, 3.0).blend(stone, 0.8)
    }
}

impl Field for Sculpture {
    const STEEPEST: f64 = 1.5;

    fn value(&self, p: DVec3) -> f64 {
        self.part(p, false).distance
    }
}

/// At the peak, for cells of 1 mm. Measured.
const BYTES: f64 = 225e6;

/// Makes the sculpture with a lattice of edge `cell` in millimetres. [`CELL`] gives about 400,000 triangles, half of it four times as many.
/// The mesh is closed, stands on the plane z = 0, and has the vertex attribute `colour`.
///
/// # Errors
/// [`Error::Input`] if `cell` is not between 0.5 and 20. [`Error::OutOfMemory`]. [`Error::Cancelled`].
pub fn sculpture(cell: f64, threads: usize, progress: &Progress<'_>) -> Result<TriMesh> {
    if !(FINEST..=20.0).contains(&cell) {
        return Err(Error::input(format!("the sculpture's cell must be >= {FINEST} and <= 20, got {cell} mm")));
    }
    memory::expect(BYTES / (cell * cell), || format!("a sculpture of {cell} mm cells"), "use larger cells")?;
    progress.plan(polygonize::PLAN);
    let pool = base::threads::pool(threads)?;
    progress.run(&pool, || {
        let shape = Sculpture::new();
        let (lo, hi) = (DVec3::new(-75.0, -75.0, -4.0), DVec3::new(75.0, 75.0, 238.0));
        let mut mesh = polygonize::polygonize(&shape, lo, hi, cell, progress)?;
        let colours = polygonize::in_parallel(&mesh.positions, |&p| shape.part(p, true).srgb(), progress)?;
        mesh.vertex_attributes.push(Attribute::colour("colour", colours));
        Ok(mesh)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_one_closed_surface_and_the_same_for_any_number_of_threads() {
        let mesh = sculpture(4.0, 1, &Progress::none()).unwrap();
        let report = mesh::check(&mesh);
        assert!(report.is_closed() && report.non_finite_vertices == 0, "{report}");
        assert!(mesh::measure::enclosed_volume(&mesh) > 0.0);
        assert!(mesh == sculpture(4.0, 8, &Progress::none()).unwrap());
        assert!(sculpture(0.1, 1, &Progress::none()).is_err() && sculpture(f64::NAN, 1, &Progress::none()).is_err());
    }

    /// The rule that lets the polygonizer skip space: a value of x promises that no surface is nearer than x / STEEPEST.
    #[test]
    fn its_field_is_no_larger_than_the_distance_allows() {
        let shape = Sculpture::new();
        let mesh = sculpture(4.0, 2, &Progress::none()).unwrap();
        let mut worst: f64 = 0.0;
        for (i, &on) in mesh.positions.iter().enumerate() {
            let unit = |k: usize| ((i * k) % 65_521) as f64 / 65_521.0 - 0.5;
            let direction = DVec3::new(unit(40_503), unit(30_011), unit(20_023)).normalize_or_zero();
            let way = [0.5, 2.0, 5.0, 12.0, 25.0][i % 5];
            worst = worst.max((shape.value(on + direction * way).abs() - shape.value(on).abs()) / way);
        }
        assert!(worst < Sculpture::STEEPEST, "{worst}");
    }
}
