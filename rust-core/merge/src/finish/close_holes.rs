//! Stage 9: holes up to a length, in windows: those whose surroundings have something in common are closed together, with what lies around
//! them in memory. \[MI04, sec. 3.4\] Ours besides: a hole that a scan sees through stays open.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use super::retry_holes::{self, Attempt, Retried};
use super::seen_fills::{SeeingRule, seen_through};
use super::{components, refuse_nothing};
use crate::crossings::lattice::Lattice;
use crate::params::MergeParams;
use crate::report::MergeReport;
use crate::stages::CLOSING;
use crate::surface::extract::{self, Row, Surface};
use crate::surface::numbering::{GONE, NONE};
use crate::surface::tile::{Part, Tiles};
use crate::surface::whole::{Whole, Window};
use crate::visibility::eyes::Eyes;
use ::close::Openings;
use base::error::Result;
use base::progress::Progress;
use glam::DVec3;
use mesh::connected::parts;
use mesh::holes::{self, Bounds, HoleReason, successors, walk};

/// By default holes are closed up to a boundary of this many voxels ...
const HOLE_VOXELS: f64 = 100.0;
/// ... and of at most this share of the diagonal of the bounding box of the part they are in.
const HOLE_SHARE: f64 = 0.2;

/// Bytes that a triangle near a hole takes, with its vertices.
const BYTES_A_TRIANGLE: f64 = 200.0;
/// No triangle of the tiles is longer, in cells.
const LONGEST: f64 = 2.0;

/// The longest boundary to close.
#[derive(Clone, Copy)]
pub enum Limit {
    /// World units.
    Length(f64),
    /// World units, but at most this share of the diagonal of the bounding box of the connected part the hole is in: the
    /// rim of a part is no hole.
    OfPart(f64, f64),
}

impl Limit {
    /// As asked for, or the default for what is of this size. Said in the report.
    pub fn of(params: &MergeParams, report: &mut MergeReport, size: DVec3) -> Self {
        let given = if params.close == Openings::Holes { params.max_hole_length } else { Some(0.0) };
        let length = given.unwrap_or((HOLE_VOXELS * report.voxel).min(HOLE_SHARE * size.length()));
        report.max_hole_length = length;
        match given {
            Some(length) => Limit::Length(length),
            None => Limit::OfPart(length, HOLE_SHARE),
        }
    }

    /// The limit of a part.
    pub fn of_part(&self, part: &Part) -> f64 {
        match *self {
            Limit::Length(length) => length,
            Limit::OfPart(length, share) => length.min(share * part.low.distance(part.high)),
        }
    }

    /// The limit of no part.
    pub fn length(&self) -> f64 {
        let (Limit::Length(length) | Limit::OfPart(length, _)) = *self;
        length
    }
}

/// Limits on what may be in memory at a time.
#[derive(Clone, Copy)]
pub struct Room {
    /// Bytes of what lies around holes.
    pub held: f64,
    /// Bricks along each side of a tile: holes follow each other as tiles do.
    pub side: i32,
}

impl Room {
    /// For all there is.
    pub const ALL: Room = Room { held: f64::INFINITY, side: 1 };
}

/// The sides of triangles that have no second one.
struct Boundary {
    /// Ends are places in `vertices`.
    sides: Vec<[u32; 2]>,
    /// Numbers, rising.
    vertices: Vec<u64>,
    /// Their places, and their parts.
    at: Vec<(DVec3, u32)>,
}

/// A vertex of an addition: one there was, or from [`NEW`] on one of its own.
type Corner = u64;
const NEW: Corner = 1 << 63;

/// Content that is added in one place.
struct Addition {
    /// Additions are in this order.
    order: u64,
    vertices: Surface,
    triangles: Vec<[Corner; 3]>,
}

/// Closes the holes that `params` name, or up to the default length, where no scan of `eyes` sees through.
///
/// # Errors
/// A tile can't be read. A scan can't be loaded any more. Nothing is left. Cancelled.
pub fn close<T: Tiles>(
    whole: &mut Whole<T>,
    eyes: &Eyes<'_>,
    lattice: &Lattice,
    params: &MergeParams,
    room: Room,
    report: &mut MergeReport,
    progress: &Progress<'_>,
) -> Result<()> {
    progress.stage(CLOSING, 1);
    let limit = Limit::of(params, report, whole.chosen.size);
    let mut boundary = Boundary::of(whole, progress)?;
    let of_part = |part: Option<u32>| match part {
        Some(part) => limit.of_part(&whole.chosen.parts.list[part as usize]),
        None => limit.length(),
    };
    let limit_of = |vertices: &[u32]| of_part(vertices.first().map(|&v| boundary.at[v as usize].1));
    let (wanted, mut open) = holes::sort_out(&boundary.sides, |v| boundary.at[v as usize].0, limit_of);
    let regions: Vec<Bounds> = wanted.iter().map(|hole| holes::region(boundary.bounds(hole))).collect();
    let shortest = extract::APART * lattice.voxel;
    let mut additions = Vec::new();
    let mut rims = BTreeMap::new();
    for batch in batches(&regions, 0.0, lattice.voxel, room, progress)? {
        let window = whole.window(&pick(&regions, &batch), progress)?;
        let holes: Vec<&Vec<u32>> = batch.iter().map(|&hole| &wanted[hole]).collect();
        open.extend(fill(window, &boundary, &holes, shortest, &mut additions, &mut rims, progress)?);
    }
    let rule = SeeingRule::of(lattice.voxel, report.merge_distance);
    let seen = seen_through(&additions, |fill| fill.corners(&rims), eyes, rule, progress)?;
    let refused = take_out(&mut additions, &seen);
    let mut stays: Vec<(u32, bool)> =
        open.iter().map(|open| (open.vertex, open.reason == HoleReason::Crossing)).collect();
    stays.extend(refused.iter().map(|fill| (boundary.local(fill.order), false)));
    stays.sort_unstable();
    let closed = additions.len() as u64;
    whole.add(additions, rims);
    let next = successors(&boundary.sides);
    boundary.sides.clear();
    let mut stuck: Vec<Vec<u32>> = Vec::new();
    for &(vertex, is_stuck) in &stays {
        let sides = walk(vertex, &next);
        boundary.sides.extend(&sides);
        if is_stuck {
            stuck.push(sides.iter().map(|side| side[0]).collect());
        }
    }
    let least = components::least(&whole.chosen.parts.list, params.min_component_share);
    let (pastes, rims) = retry(whole, &boundary, &stuck, limit, least, lattice, room, progress)?;
    let seen = seen_through(&pastes, |paste| paste.addition.corners(&rims), eyes, rule, progress)?;
    let (retried, left_seen) = paste(whole, pastes, &seen, rims);
    report.holes = [closed + retried.closed, stays.len() as u64 - retried.holes];
    report.holes_seen_through = refused.len() as u64 + left_seen;
    (0..2).for_each(|i| report.dropped_components[i] += retried.dropped[i]);
    let left = whole.triangles() - whole.changes.removed.len() as u64;
    refuse_nothing(left, report.voxel, params.min_component_share)
}

impl Boundary {
    fn of<T: Tiles>(whole: &Whole<T>, progress: &Progress<'_>) -> Result<Self> {
        let (mut sides, mut at) = (Vec::new(), FxHashMap::default());
        for i in 0..whole.tiles.count() {
            progress.check()?;
            let numbered = whole.tile(i)?;
            let tile = &numbered.tile;
            for side in tile.surface.boundary.iter().map(|side| side.map(|v| v as usize)) {
                let ends = side.map(|v| numbered.vertex(v));
                if ends[0] == GONE {
                    continue;
                }
                sides.push(ends);
                for (v, end) in side.into_iter().zip(ends) {
                    at.insert(end, (tile.surface.positions[v], whole.chosen.part(i, tile.part_of[v])));
                }
            }
        }
        let mut vertices: Vec<u64> = at.keys().copied().collect();
        vertices.sort_unstable();
        let at = vertices.iter().map(|v| at[v]).collect();
        let mut boundary = Boundary { sides: Vec::new(), vertices, at };
        boundary.sides = sides.iter().map(|ends: &[u64; 2]| ends.map(|v| boundary.local(v))).collect();
        Ok(boundary)
    }

    /// The local number of a vertex that it has.
    fn local(&self, vertex: u64) -> u32 {
        self.vertices.binary_search(&vertex).expect("it is of the boundary") as u32
    }

    /// Numbers, in a window, of vertices of it that the window has.
    fn in_window(&self, window: &Window, vertices: &[u32]) -> Vec<u32> {
        let local = |&v: &u32| window.local(self.vertices[v as usize]).expect("its triangles are near");
        vertices.iter().map(local).collect()
    }

    fn bounds(&self, vertices: &[u32]) -> Bounds {
        Bounds::of(vertices.iter().map(|&v| self.at[v as usize].0))
    }
}

fn pick<T: Copy>(list: &[T], places: &[usize]) -> Vec<T> {
    places.iter().map(|&place| list[place]).collect()
}

/// Regions in batches that memory holds. Those that meet, or come as near to each other as `apart`, are in one.
fn batches(regions: &[Bounds], apart: f64, voxel: f64, room: Room, progress: &Progress<'_>) -> Result<Vec<Vec<usize>>> {
    let grown: Vec<(usize, Bounds)> = regions.iter().map(|region| region.grown(0.5 * apart)).enumerate().collect();
    let links: Vec<[u32; 3]> =
        holes::meeting(&grown, progress)?.into_iter().map(|(a, b)| [a as u32, b as u32, b as u32]).collect();
    let mut groups: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (place, lowest) in parts(regions.len(), &links, progress)?.into_iter().enumerate() {
        groups.entry(lowest).or_default().push(place);
    }
    // Those that lie beside each other follow each other, so that a batch needs few tiles.
    let mut groups: Vec<Vec<usize>> = groups.into_values().collect();
    let key = |group: &Vec<usize>| {
        let block = f64::from(room.side << crate::crossings::lattice::BRICK_BITS) * voxel;
        (regions[group[0]].min / block).floor().to_array().map(|x| x as i64)
    };
    groups.sort_by_cached_key(key);
    let bytes = |place: &usize| {
        let [x, y, z] = ((regions[*place].max - regions[*place].min) / voxel + 2.0).to_array();
        BYTES_A_TRIANGLE * 2.0 * (x * y + y * z + z * x)
    };
    let mut batches: Vec<Vec<usize>> = Vec::new();
    let mut held = 0.0;
    for group in groups {
        let more: f64 = group.iter().map(bytes).sum();
        if batches.is_empty() || held + more > room.held {
            batches.push(Vec::new());
            held = 0.0;
        }
        held += more;
        batches.last_mut().expect("the first begins one").extend(group);
    }
    // In the order of the holes.
    batches.iter_mut().for_each(|batch| batch.sort_unstable());
    Ok(batches)
}

/// Closes holes in a window. Those that can't be closed are returned.
fn fill(
    mut window: Window,
    boundary: &Boundary,
    wanted: &[&Vec<u32>],
    shortest: f64,
    additions: &mut Vec<Addition>,
    rims: &mut BTreeMap<u64, Row>,
    progress: &Progress<'_>,
) -> Result<Vec<holes::OpenLoop>> {
    let wanted: Vec<Vec<u32>> = wanted.iter().map(|hole| boundary.in_window(&window, hole)).collect();
    let surface = &mut window.surface;
    let report = holes::close_loops(&mut surface.positions, &mut surface.triangles, &wanted, shortest, progress)?;
    surface.adopt_fill(&report);
    let (mut vertex, mut triangle) = (report.first_vertex, report.first_triangle);
    for filled in &report.fills {
        let (of_vertices, of_triangles) = (vertex..vertex + filled.points, triangle..triangle + filled.faces);
        (vertex, triangle) = (of_vertices.end, of_triangles.end);
        let order = window.vertices[filled.vertex as usize];
        additions.push(Addition::new(order, surface, of_vertices, of_triangles, &window.vertices, rims));
    }
    let open = |mut open: holes::OpenLoop| {
        open.vertex = boundary.local(window.vertices[open.vertex as usize]);
        open
    };
    Ok(report.open.into_iter().map(open).collect())
}

impl Addition {
    /// Of some vertices and triangles of a surface. Others of its vertices have these numbers.
    fn new(
        order: u64,
        surface: &Surface,
        vertices: std::ops::Range<usize>,
        triangles: std::ops::Range<usize>,
        numbers: &[u64],
        rims: &mut BTreeMap<u64, Row>,
    ) -> Self {
        let mut corner = |v: u32| match numbers.get(v as usize) {
            None => NEW + Corner::from(v) - vertices.start as Corner,
            Some(&number) => {
                rims.entry(number).or_insert_with(|| surface.row(v as usize));
                number
            }
        };
        let mut added = Surface { cases: surface.cases[triangles.clone()].to_vec(), ..Surface::default() };
        let triangles = surface.triangles[triangles].iter().map(|t| t.map(&mut corner)).collect();
        added.append_vertices(surface, vertices);
        Addition { order, vertices: added, triangles }
    }
}

impl Addition {
    /// Corners of its triangles. `rims` are the vertices there were.
    fn corners<'a>(&'a self, rims: &'a BTreeMap<u64, Row>) -> impl Iterator<Item = [DVec3; 3]> + 'a {
        let place = |corner: Corner| match corner.checked_sub(NEW) {
            Some(new) => self.vertices.positions[new as usize],
            None => rims[&corner].position,
        };
        self.triangles.iter().map(move |t| t.map(place))
    }
}

/// Takes those out that go, in their order.
fn take_out<T>(list: &mut Vec<T>, goes: &[bool]) -> Vec<T> {
    let (gone, stay): (Vec<_>, Vec<_>) = std::mem::take(list).into_iter().zip(goes).partition(|of| *of.1);
    list.extend(stay.into_iter().map(|of| of.0));
    gone.into_iter().map(|of| of.0).collect()
}

impl<T: Tiles> Whole<T> {
    /// Adds in order. `rims` are the vertices there were.
    fn add(&mut self, mut additions: Vec<Addition>, rims: BTreeMap<u64, Row>) {
        additions.sort_by_key(|addition| addition.order);
        for Addition { vertices, triangles, .. } in additions {
            let first = self.vertices();
            self.corners.extend(triangles.iter().map(|t| t.map(|corner| numbered(corner, first))));
            self.added.cases.extend_from_slice(&vertices.cases);
            self.added.append_vertices(&vertices, 0..vertices.positions.len());
        }
        let known = self.numbers.vertices;
        self.rims.extend(rims.into_iter().filter(|of| of.0 < known));
    }
}

/// A second chance for holes whose surroundings stand in the way: what would be added, with the vertices there were.
#[expect(clippy::too_many_arguments, reason = "what a stage is told")]
fn retry<T: Tiles>(
    whole: &Whole<T>,
    boundary: &Boundary,
    stuck: &[Vec<u32>],
    limit: Limit,
    least: f64,
    lattice: &Lattice,
    room: Room,
    progress: &Progress<'_>,
) -> Result<(Vec<Paste>, BTreeMap<u64, Row>)> {
    let windows: Vec<Bounds> =
        stuck.iter().map(|hole| retry_holes::window(boundary.bounds(hole), lattice.voxel)).collect();
    let mut pastes: Vec<Paste> = Vec::new();
    let mut rims = BTreeMap::new();
    // Two windows may have a triangle in common that is as long as this.
    let longest = whole.longest_added().max(LONGEST * lattice.voxel);
    for batch in batches(&windows, longest, lattice.voxel, room, progress)? {
        let mut window = whole.window(&pick(&windows, &batch), progress)?;
        let local = |v: u32| window.local(boundary.vertices[v as usize]);
        let sides = boundary.sides.iter().filter_map(|&[a, b]| Some([local(a)?, local(b)?]));
        window.surface.boundary = sides.collect();
        let holes: Vec<Vec<u32>> = batch.iter().map(|&hole| boundary.in_window(&window, &stuck[hole])).collect();
        let limit_of = |vertices: &[u32]| {
            let part = vertices.iter().map(|&v| window.part_of[v as usize]).find(|&part| part != NONE);
            part.map_or(limit.length(), |part| limit.of_part(&whole.chosen.parts.list[part as usize]))
        };
        for attempt in retry_holes::attempts(&window.surface, &holes, limit_of, least, lattice, progress)? {
            let first = batch[attempt.first] as u64;
            pastes.push(Paste::of(&attempt, first, &window, &mut rims));
        }
    }
    pastes.sort_by_key(|paste| paste.addition.order);
    Ok((pastes, rims))
}

/// Adds what was found, but for those that go. Says what was closed so, and how many holes stay open for those.
fn paste<T: Tiles>(
    whole: &mut Whole<T>,
    mut pastes: Vec<Paste>,
    goes: &[bool],
    rims: BTreeMap<u64, Row>,
) -> (Retried, u64) {
    let left = take_out(&mut pastes, goes).iter().map(|paste| paste.counts.holes).sum();
    let mut retried = Retried::default();
    let mut first = whole.vertices();
    for paste in &mut pastes {
        retried.add(&paste.counts);
        whole.changes.moved.extend(std::mem::take(&mut paste.moved));
        whole.changes.removed.extend(std::mem::take(&mut paste.removed));
        whole.changes.bare.extend(paste.bare.iter().map(|&corner| numbered(corner, first)));
        let renamed = paste.renamed.iter().map(|(t, corners)| (*t, corners.map(|corner| numbered(corner, first))));
        whole.changes.renamed.extend(renamed);
        first += paste.addition.vertices.positions.len() as u64;
    }
    whole.changes.bare.sort_unstable();
    whole.add(pastes.into_iter().map(|paste| paste.addition).collect(), rims);
    (retried, left)
}

/// The number of a corner. Those of its own follow `first`.
fn numbered(corner: Corner, first: u64) -> u64 {
    corner.checked_sub(NEW).map_or(corner, |new| first + new)
}

/// The surface that an attempt makes.
struct Paste {
    addition: Addition,
    /// The holes that it closes.
    counts: Retried,
    /// Vertices that lie elsewhere, and whether they are on a scan still.
    moved: Vec<(u64, (DVec3, i32))>,
    /// Triangles that are gone.
    removed: Vec<u64>,
    /// Triangles with other corners.
    renamed: Vec<(u64, [Corner; 3])>,
    /// Vertices without a triangle.
    bare: Vec<Corner>,
}

impl Paste {
    fn of(attempt: &Attempt, order: u64, window: &Window, rims: &mut BTreeMap<u64, Row>) -> Self {
        let numbers: Vec<u64> = attempt.cut.vertices.iter().map(|&v| window.vertices[v as usize]).collect();
        let known = numbers.len();
        let (before, now) = (&attempt.cut.surface, &attempt.surface);
        let is_moved = |v: &usize| before.positions[*v] != now.positions[*v] || before.scan[*v] != now.scan[*v];
        let moved = (0..known).filter(is_moved).map(|v| (numbers[v], (now.positions[v], now.scan[v]))).collect();
        let triangle = |t: u32| window.triangles[attempt.cut.triangles[t as usize] as usize];
        let addition = Addition::new(
            order,
            now,
            known..now.positions.len(),
            attempt.origin.len()..now.triangles.len(),
            &numbers,
            rims,
        );
        let (mut renamed, mut removed) = (Vec::new(), Vec::new());
        // New vertices have no number yet; those there were keep theirs.
        let corner = |v: u32| numbers.get(v as usize).map_or(NEW + Corner::from(v) - known as Corner, |&v| v);
        let mut origin = attempt.origin.iter().zip(&now.triangles).peekable();
        for t in 0..before.triangles.len() as u32 {
            match origin.next_if(|of| *of.0 == t) {
                None => removed.push(triangle(t)),
                Some((_, corners)) if *corners != before.triangles[t as usize] => {
                    renamed.push((triangle(t), corners.map(corner)));
                }
                Some(_) => {}
            }
        }
        let bare = attempt.bare().into_iter().map(corner).collect();
        Paste { addition, counts: Retried::of(attempt), moved, removed, renamed, bare }
    }
}
