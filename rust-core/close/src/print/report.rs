//! Report of the checks for printing, with the findings and their remedies.

use glam::DVec3;

use base::error::Shown;
use base::progress::Seconds;
use base::report::Remark;
use mesh::{CheckReport, TriMesh};

use super::params::{PrintParams, TooShort};
use super::walls::{END, Wall};
use crate::bodies::{Bodies, Body, Lies};

base::choices! {
    /// Kinds of faults that a printer, or its slicer, stumbles over.
    pub enum Fault {
        /// Edges of three faces, faces that are turned, or other places that bound no body.
        NotManifold = "not_manifold" "Not a manifold",
        /// Openings: the mesh bounds no body.
        Open = "open" "Open",
        /// Faces that cross each other.
        Crossing = "crossing" "Crossing faces",
        /// Bodies whose outside is inside. Cavities are no such bodies.
        InsideOut = "inside_out" "Inside out",
        /// Closed, but nothing is inside.
        NoVolume = "no_volume" "No volume",
        /// Larger than the printer.
        TooLarge = "too_large" "Too large",
        /// Walls thinner than the printer makes.
        Thin = "thin" "Thin walls",
        /// Faces that hang over.
        Overhang = "overhang" "Overhangs",
        /// Bodies in the solid of others.
        Nested = "nested" "Body in a body",
        /// Several bodies that hang together nowhere.
        SeveralBodies = "several_bodies" "Several bodies",
    }
}

impl Fault {
    /// The step that mends it.
    const fn remedy(self) -> &'static str {
        match self {
            Fault::NotManifold => "Merge its scans again, or repair these places",
            Fault::Open => "Close them",
            Fault::Crossing => "Move or remove these faces",
            Fault::InsideOut => "Flip their faces",
            Fault::NoVolume => "Give it a thickness",
            Fault::TooLarge => "Scale it, or cut it into parts",
            Fault::Thin => "Thicken it there, or print it larger",
            Fault::Overhang => "Turn the object, or print it with supports",
            Fault::Nested => "Remove them, or flip the faces of those that are cavities",
            Fault::SeveralBodies => "Remove those that are not to be printed",
        }
    }
}

/// A fault that was found, for a person.
pub type Finding = Remark<Fault>;

base::report! {
    /// The figures of the checks for printing.
    #[derive(Default)]
    pub struct PrintReport {
        /// Faults with their remedies. There are none if the mesh can be printed as it is.
        findings: Vec<Finding> = warning("Findings", Fault::CHOICES).since("0.2"),
        /// Whether the mesh is an oriented manifold without openings.
        is_closed: bool = flag("Closed").since("0.2"),
        /// Whether it is an oriented manifold, with or without openings.
        is_manifold: bool = flag("Manifold").since("0.2"),
        /// Openings: groups of open edges that hang together.
        openings: usize = count("Openings").since("0.2"),
        /// Edges of one face.
        open_edges: usize = count("Open edges").since("0.2"),
        /// Edges of more than two faces.
        non_manifold_edges: usize = count("Non-manifold edges").since("0.2"),
        /// Vertices at which more than one fan of faces meets.
        non_manifold_vertices: usize = count("Non-manifold vertices").since("0.2"),
        /// Edges whose two faces are turned against each other.
        misoriented_edges: usize = count("Misoriented edges").since("0.2"),
        /// Pairs of faces that cross. This is exact.
        crossing_pairs: usize = count("Crossing pairs of faces").since("0.2"),
        /// Faces that cross another.
        crossing_faces: usize = count("Crossing faces").since("0.2"),
        /// Bodies: faces joined over edges. A cavity is a body, too.
        bodies: usize = count("Bodies").since("0.2"),
        /// Size along x, y and z.
        size: [f64; 3] = length("Size").parts(&[
            ("size_x", "Size along x."),
            ("size_y", "Size along y."),
            ("size_z", "Size along z."),
        ]).since("0.2"),
        /// Whether it fits into the printer, as it is or turned by a quarter about the vertical.
        is_fitting: bool = flag("Fits into the printer").since("0.2"),
        /// Volume of all bodies together, in the cube of the unit of the mesh. There is none unless the mesh is closed.
        volume: Option<f64> = number("Volume").optional().since("0.2"),
        /// Volume times density. There is none without either.
        weight: Option<f64> = number("Weight").optional().since("0.2"),
        /// Thickness up to which walls are measured.
        wall_limit: f64 = length("Walls measured up to").since("0.2"),
        /// Thickness of the thinnest wall. There is none if no wall is thinner than they are measured.
        thinnest_wall: Option<f64> = length("Thinnest wall").optional().since("0.2"),
        /// Number of the face in front of the thinnest wall, counted from 0. There is none without such a wall.
        thinnest_face: Option<usize> = count("Face of the thinnest wall").optional().since("0.2"),
        /// Faces whose walls are thinner than the thinnest wall that the printer makes, by more than the error of measuring, 2 %.
        thin_faces: usize = count("Faces with thin walls").since("0.2"),
        /// Largest distance of a corner from the centre of its face. Walls are measured at centres. Where faces are larger than walls are
        /// thick, a wall may be thinner between them.
        wall_spacing: f64 = length("Walls measured every").since("0.2"),
        /// Faces that hang over and do not lie on the ground.
        overhang_faces: usize = count("Overhanging faces").since("0.2"),
        /// Area of the faces that hang over, in the square of the unit of the mesh.
        overhang_area: f64 = number("Area of overhangs").since("0.2"),
        /// Wall-clock seconds by the name of the stage.
        seconds: Seconds = stages().since("0.2"),
    }
    besides {
        /// All that is known of the topology.
        topology: CheckReport,
        /// The pairs of faces that cross, the smaller number first, rising.
        crossings: Vec<[u32; 2]>,
        /// The bodies in the order of their first faces.
        body_list: Vec<Body>,
        /// Thickness of the wall behind the centre of each face. Infinite if nothing lies behind it, and behind a face without area.
        walls: Vec<Wall>,
    }
}

impl PrintReport {
    /// Takes over what is known of the topology.
    pub(super) fn set_topology(&mut self, topology: CheckReport) {
        self.is_closed = topology.is_closed();
        self.is_manifold = topology.is_manifold();
        self.openings = topology.boundary_loops;
        self.open_edges = topology.boundary_edges;
        self.non_manifold_edges = topology.non_manifold_edges;
        self.non_manifold_vertices = topology.non_manifold_vertices;
        self.misoriented_edges = topology.misoriented_edges;
        self.topology = topology;
    }

    /// Takes over the walls.
    pub(super) fn set_walls(&mut self, walls: Vec<Wall>, min_wall: Option<f64>) {
        let least = |least: Option<usize>, t: usize| match least {
            Some(other) if walls[other].thickness <= walls[t].thickness => Some(other),
            _ => Some(t),
        };
        // The first of several.
        self.thinnest_face = (0..walls.len()).filter(|&t| walls[t].thickness < self.wall_limit).fold(None, least);
        self.thinnest_wall = self.thinnest_face.map(|t| walls[t].thickness);
        let is_thin = |wall: &&Wall, min: f64| wall.thickness < min * (1.0 - END);
        self.thin_faces = min_wall.map_or(0, |min| walls.iter().filter(|wall| is_thin(wall, min)).count());
        self.walls = walls;
    }

    /// Writes the findings, from all other figures.
    ///
    /// `first_fault` is the first vertex beside which the mesh is no oriented manifold.
    pub(super) fn find(&mut self, mesh: &TriMesh, bodies: Bodies, first_fault: Option<u32>, params: &PrintParams) {
        let mut findings = Vec::new();
        let mut find = |kind: Fault, fault: String| {
            findings.push(Finding { kind, text: format!("{fault}. {}.", kind.remedy()) });
        };
        if !self.is_manifold {
            let places = format!("Places where the mesh is no oriented manifold: {}", self.bad_places());
            find(
                Fault::NotManifold,
                match first_fault {
                    Some(vertex) => format!("{places}. The first is at {}", shown(mesh.positions[vertex as usize])),
                    None => places,
                },
            );
        } else if self.open_edges > 0 {
            find(Fault::Open, format!("Openings of the mesh: {}", self.openings));
        }
        if let Some(&[one, other]) = self.crossings.first() {
            let place = shown(centre(mesh, one as usize));
            let count = self.crossing_pairs;
            find(
                Fault::Crossing,
                format!("Pairs of faces that cross: {count}. The first are {one} and {other}, at {place}"),
            );
        }
        if self.is_closed {
            let lying = Lying::of(&bodies, &self.crossings);
            if let Some((count, first)) = lying.those(Lies::InsideOut) {
                find(
                    Fault::InsideOut,
                    format!("Bodies that are inside out: {count}. The first is at {}", shown(first.place)),
                );
            }
            if let Some((count, first)) = lying.those(Lies::Nested) {
                find(
                    Fault::Nested,
                    format!("Bodies in the solid of another: {count}. The first is at {}", shown(first.place)),
                );
            }
            if let Some((count, smallest)) = lying.several() {
                let (volume, place) = (Shown::digits(smallest.volume, 3), shown(smallest.place));
                find(
                    Fault::SeveralBodies,
                    format!(
                        "Bodies that hang together nowhere: {count}. The smallest has a volume of {volume}, at {place}"
                    ),
                );
            }
        }
        if self.volume == Some(0.0) {
            find(Fault::NoVolume, "The mesh encloses no volume".to_owned());
        }
        for length in params.too_short(self.size) {
            let [x, y, z] = self.size.map(|length| Shown::digits(length, 4));
            // A sentence each is easier to translate than one in pieces.
            let fault = match length {
                TooShort::Base { width, depth } => {
                    let (width, depth) = (Shown(width), Shown(depth));
                    format!(
                        "The mesh is {x} x {y} x {z}: too large for the printer's width and depth of {width} x {depth}"
                    )
                }
                TooShort::Width(width) => {
                    format!("The mesh is {x} x {y} x {z}: too large for the printer's width of {}", Shown(width))
                }
                TooShort::Depth(depth) => {
                    format!("The mesh is {x} x {y} x {z}: too large for the printer's depth of {}", Shown(depth))
                }
                TooShort::Height(height) => {
                    format!("The mesh is {x} x {y} x {z}: too large for the printer's height of {}", Shown(height))
                }
            };
            find(Fault::TooLarge, fault);
        }
        if let (Some(min), Some(thinnest), Some(face)) = (params.min_wall, self.thinnest_wall, self.thinnest_face)
            && self.thin_faces > 0
        {
            let (place, count) = (shown(centre(mesh, face)), self.thin_faces);
            let (min, thinnest) = (Shown(min), Shown::digits(thinnest, 3));
            find(
                Fault::Thin,
                format!("Faces with walls thinner than {min}: {count}. The thinnest is {thinnest}, at {place}"),
            );
        }
        if self.overhang_faces > 0 {
            let (count, degrees) = (self.overhang_faces, Shown::digits(params.overhang.to_degrees(), 3));
            find(Fault::Overhang, format!("Faces that hang over by more than {degrees} degrees: {count}"));
        }
        self.findings = findings;
        self.body_list = bodies.list;
    }

    /// Places that make the mesh no oriented manifold.
    fn bad_places(&self) -> usize {
        let topology = &self.topology;
        topology.degenerate_triangles
            + topology.duplicate_triangles
            + topology.non_manifold_edges
            + topology.misoriented_edges
            + topology.non_manifold_vertices
    }
}

/// Bodies and their kinds, but for those that cross others: these lie nowhere.
struct Lying<'a> {
    bodies: &'a [Body],
    kinds: Vec<Option<Lies>>,
}

impl<'a> Lying<'a> {
    fn of(bodies: &'a Bodies, crossings: &[[u32; 2]]) -> Self {
        let mut kinds: Vec<Option<Lies>> = bodies.list.iter().map(|body| Some(body.lies())).collect();
        for pair in crossings {
            let [one, other] = pair.map(|t| bodies.of[t as usize] as usize);
            if one != other {
                (kinds[one], kinds[other]) = (None, None);
            }
        }
        Lying { bodies: &bodies.list, kinds }
    }

    fn all(&self, kind: Lies) -> impl Iterator<Item = &'a Body> {
        self.bodies.iter().zip(&self.kinds).filter(move |(_, own)| **own == Some(kind)).map(|(body, _)| body)
    }

    /// How many are of a kind, and the first.
    fn those(&self, kind: Lies) -> Option<(usize, &'a Body)> {
        Some((self.all(kind).count(), self.all(kind).next()?))
    }

    /// How many are solids of their own, and the smallest, if they are several.
    fn several(&self) -> Option<(usize, &'a Body)> {
        let count = self.all(Lies::Outer).count();
        let smallest = self.all(Lies::Outer).min_by(|a, b| a.volume.total_cmp(&b.volume))?;
        (count > 1).then_some((count, smallest))
    }
}

fn centre(mesh: &TriMesh, face: usize) -> DVec3 {
    let [a, b, c] = mesh.corners(face);
    (a + b + c) / 3.0
}

/// A place for a person.
fn shown(place: DVec3) -> String {
    let [x, y, z] = place.to_array().map(|x| Shown::digits(x, 4));
    format!("({x}, {y}, {z})")
}

/// Result of the checks.
#[derive(Clone, Debug, PartialEq)]
pub struct Checked {
    /// The mesh with three more face attributes: `wall`, the thickness behind the face, `crossing`, whether the face crosses another, and
    /// `overhang`, whether it hangs over. Where a wall is thicker than is measured, or nothing lies behind a face, `wall` is
    /// [`PrintReport::wall_limit`].
    pub mesh: TriMesh,
    /// Figures of the run.
    pub report: PrintReport,
}
