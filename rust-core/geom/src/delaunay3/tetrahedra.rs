//! The tetrahedra of a set of points.

/// The vertex at infinity: it closes the cells outside of the convex hull, one for each facet of the hull.
pub const INFINITE: u32 = u32::MAX;

/// A tetrahedron, or one with the vertex at infinity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    /// Positively oriented: det(b - a, c - a, d - a) > 0. A vertex at infinity is the last, and the others turn counter-clockwise seen from
    /// outside of the hull.
    pub vertices: [u32; 4],
    /// The cell opposite to each vertex.
    pub neighbours: [u32; 4],
}

/// The Delaunay tetrahedralization of a set of points: no point is inside of the sphere around any cell. It fills their
/// convex hull, and every point is a vertex but for exact copies.
///
/// If more than four points lie on a sphere, a symbolic perturbation by coordinates chooses. The cells are the same, but for their numbers,
/// for any order of the points and any number of threads.
///
/// Source: \[Bow81, Wat81\] for the insertion, \[ACR03\] for its order, \[DT11\] for the perturbation, \[MPR19\] for regions
/// of threads.
#[derive(Clone, Debug)]
pub struct Delaunay3 {
    pub(super) cells: Vec<Cell>,
    pub(super) finite: usize,
    pub(super) duplicates: Vec<[u32; 2]>,
}

impl Delaunay3 {
    /// All cells: those of the convex hull, then those at infinity.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Number of cells that aren't at infinity.
    pub fn finite_count(&self) -> usize {
        self.finite
    }

    /// Points that are no vertices since another has the same coordinates: the point, and the vertex that stands for it,
    /// the first of all equal ones. In ascending order.
    pub fn duplicates(&self) -> &[[u32; 2]] {
        &self.duplicates
    }
}
