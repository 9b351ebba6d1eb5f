//! Inserting a point: the cells whose spheres hold it make way for a star of new ones \[Bow81, Wat81\].

use super::cells::{CONFLICT, Cells, FACETS, GHOST};
use super::locate::{Place, locate};
use super::region::Region;
use super::signs::{Seen, Signs, volumes};

/// Most vertices around a point for which edges are found in a table: 16 KB, which stay in the cache.
const SIDE: usize = 64;

/// Outcome for a point.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Outcome {
    Inserted,
    /// It is equal to this vertex.
    Duplicate(u32),
    /// Its cells belong to another thread. Nothing has changed.
    Foreign,
    /// Cells on the way to it do. Nothing has changed.
    Unreached,
    /// There is no room for its cells. Nothing has changed.
    Full,
}

/// A facet of the border of the cavity, seen from inside.
#[derive(Clone, Copy)]
struct Wall {
    /// The cell inside the cavity, with the new point in the place of the vertex opposite to the wall: the new cell.
    vertices: [u32; 4],
    /// Facet of the cell outside.
    outside: u32,
    /// Place of the new point in `vertices`.
    slot: u8,
    /// Local numbers of the vertices of `FACETS[slot]`.
    local: [u32; 3],
}

/// One thread's means to insert points. They are kept from point to point so that nothing is allocated on the way.
pub(super) struct Inserter {
    /// Start of the next walk.
    pub(super) hint: u32,
    pub(super) free: Vec<u32>,
    /// First the cells in conflict, then the new ones, one per wall.
    cavity: Vec<u32>,
    /// Of each cell in conflict, the local numbers of its vertices.
    cavity_local: Vec<[u32; 4]>,
    /// Of each cell in conflict, the slot of the facet through which it was reached.
    entries: Vec<u32>,
    walls: Vec<Wall>,
    vertices: LocalVertices,
    /// At `from * SIDE + to`: the facet of the new cell beside the directed edge of the cavity's border.
    links: Box<[u32; SIDE * SIDE]>,
    sorted_links: Vec<(u64, u32)>,
}

impl Inserter {
    pub(super) fn new(hint: u32) -> Self {
        Inserter {
            hint,
            free: Vec::new(),
            cavity: Vec::new(),
            cavity_local: Vec::new(),
            entries: Vec::new(),
            walls: Vec::new(),
            vertices: LocalVertices::new(),
            links: Box::new([0; SIDE * SIDE]),
            sorted_links: Vec::new(),
        }
    }

    /// The cells around the point inserted last.
    pub(super) fn star(&self) -> &[u32] {
        &self.cavity
    }

    /// Inserts point `p`. All cells changed belong to `region`.
    pub(super) fn insert<R: Region>(&mut self, cells: &Cells, signs: &Signs<'_>, region: &R, p: u32) -> Outcome {
        let (start, planes) = match locate(cells, signs, region, self.hint, p) {
            Place::Cell { cell, planes } => (cell, planes),
            Place::Foreign => return Outcome::Unreached,
        };
        // A point in three planes of a cell that holds it is a vertex of that cell.
        if planes >= 3 {
            let at = |v: &u32| signs.points[*v as usize] == signs.points[p as usize];
            let twin = cells.vertices(start).into_iter().find(at);
            return Outcome::Duplicate(twin.expect("three facets of a cell meet in a vertex"));
        }
        if !self.find_cavity(cells, signs, region, start, p) {
            self.abandon(cells);
            return Outcome::Foreign;
        }
        let more = self.walls.len().saturating_sub(self.cavity.len());
        if self.free.len() < more && !cells.supply(&mut self.free, more) {
            self.abandon(cells);
            return Outcome::Full;
        }
        self.fill_cavity(cells);
        Outcome::Inserted
    }

    /// Collects the cells in conflict with `p`, from `start`, which is one, and the walls around them. False if one of
    /// them is another thread's.
    #[inline(never)]
    fn find_cavity<R: Region>(&mut self, cells: &Cells, signs: &Signs<'_>, region: &R, start: u32, p: u32) -> bool {
        let point = signs.points[p as usize];
        self.cavity.clear();
        self.cavity_local.clear();
        self.entries.clear();
        self.walls.clear();
        self.vertices.clear();
        let vertices = cells.vertices(start);
        let local = vertices.map(|v| self.vertices.local(v, point, signs));
        self.cavity.push(start);
        self.cavity_local.push(local);
        self.entries.push(0);
        cells.mark(start, vertices[0] | CONFLICT);
        let mut next = 0;
        while next < self.cavity.len() {
            let cell = self.cavity[next];
            let cell_local = self.cavity_local[next];
            let entry = self.entries[next];
            let cell_vertices = cells.vertices(cell);
            let neighbours = cells.neighbours(cell);
            next += 1;
            // All facets of the first cell, but of others not the one through which they were reached.
            let (from, facets) = if next == 1 { (0, 4) } else { (entry + 1, 3) };
            for slot in from..from + facets {
                let slot = slot as usize & 3;
                let outside = neighbours[slot];
                let other = outside >> 2;
                let marked = cells.marked_vertices(other);
                if marked[0] & CONFLICT != 0 {
                    continue;
                }
                let facet = FACETS[slot];
                let facet_local = [cell_local[facet[0]], cell_local[facet[1]], cell_local[facet[2]]];
                let opposite = (outside & 3) as usize;
                let apex = marked[opposite] & GHOST;
                let is_in_conflict = if marked[3] == GHOST {
                    ghost_is_in_conflict(cells, signs, other, p)
                } else {
                    // The cell beyond the facet, its vertices so ordered that those of the facet need not be looked up.
                    let apex_seen = Seen::new(signs.points[apex as usize], point);
                    let bound = self.vertices.bound_within(apex_seen.w, signs);
                    let at = |k: usize| &self.vertices.seen[facet_local[k] as usize];
                    let seen = [&apex_seen, at(0), at(2), at(1)];
                    let volumes = volumes(seen);
                    let determinant = (seen[0].w * volumes[0] + seen[1].w * volumes[1])
                        + (seen[2].w * volumes[2] + seen[3].w * volumes[3]);
                    if determinant > bound {
                        true
                    } else if determinant < -bound {
                        false
                    } else {
                        let vertices =
                            [apex, cell_vertices[facet[0]], cell_vertices[facet[2]], cell_vertices[facet[1]]];
                        signs.is_inside(determinant, volumes, seen, vertices, p)
                    }
                };
                if !is_in_conflict {
                    let mut vertices = cell_vertices;
                    vertices[slot] = p;
                    self.walls.push(Wall { vertices, outside, slot: slot as u8, local: facet_local });
                    continue;
                }
                // The three others are those of a cell of the region.
                if !region.has(apex, signs.points) {
                    return false;
                }
                cells.mark(other, marked[0] | CONFLICT);
                let apex_local = self.vertices.local(apex, point, signs);
                let mut local = [apex_local; 4];
                for (local, vertex) in local.iter_mut().zip(marked) {
                    for k in 0..3 {
                        if vertex == cell_vertices[facet[k]] {
                            *local = facet_local[k];
                        }
                    }
                }
                self.cavity.push(other);
                self.cavity_local.push(local);
                self.entries.push(outside & 3);
            }
        }
        true
    }

    /// Takes back all marks.
    fn abandon(&mut self, cells: &Cells) {
        for &cell in &self.cavity {
            cells.unmark(cell);
        }
    }

    /// Puts a new cell between the point and each wall.
    fn fill_cavity(&mut self, cells: &Cells) {
        // Numbers of new cells: those of the cavity again, then others.
        while self.cavity.len() < self.walls.len() {
            self.cavity.push(self.free.pop().expect("supplied beforehand"));
        }
        for &cell in &self.cavity[self.walls.len()..] {
            cells.release(cell);
            self.free.push(cell);
        }
        self.cavity.truncate(self.walls.len());
        self.hint = self.cavity[0];
        if self.vertices.ids.len() <= SIDE {
            self.link_by_table(cells);
        } else {
            self.link_by_sorting(cells);
        }
    }

    fn link_by_table(&mut self, cells: &Cells) {
        for (wall, &cell) in self.walls.iter().zip(&self.cavity) {
            let slot = wall.slot as usize & 3;
            cells.set_neighbour(wall.outside, cell << 2 | slot as u32);
            let opposite = FACETS[slot];
            for k in 0..3 {
                let edge = wall.local[k] as usize * SIDE + wall.local[(k + 1) % 3] as usize;
                self.links[edge % (SIDE * SIDE)] = cell << 2 | opposite[(k + 2) % 3] as u32;
            }
        }
        for (wall, &cell) in self.walls.iter().zip(&self.cavity) {
            let slot = wall.slot as usize & 3;
            let opposite = FACETS[slot];
            let mut neighbours = [wall.outside; 4];
            for k in 0..3 {
                let edge = wall.local[(k + 1) % 3] as usize * SIDE + wall.local[k] as usize;
                neighbours[opposite[(k + 2) % 3]] = self.links[edge % (SIDE * SIDE)];
            }
            cells.set(cell, wall.vertices, neighbours);
        }
    }

    /// For any number of vertices.
    #[cold]
    fn link_by_sorting(&mut self, cells: &Cells) {
        self.sorted_links.clear();
        for (wall, &cell) in self.walls.iter().zip(&self.cavity) {
            let slot = wall.slot as usize & 3;
            cells.set_neighbour(wall.outside, cell << 2 | slot as u32);
            cells.set(cell, wall.vertices, [wall.outside; 4]);
            let opposite = FACETS[slot];
            for k in 0..3 {
                let (from, to) = (wall.local[k], wall.local[(k + 1) % 3]);
                let edge = u64::from(from.min(to)) << 32 | u64::from(from.max(to));
                self.sorted_links.push((edge, cell << 2 | opposite[(k + 2) % 3] as u32));
            }
        }
        self.sorted_links.sort_unstable();
        for pair in self.sorted_links.chunks_exact(2) {
            debug_assert_eq!(pair[0].0, pair[1].0);
            cells.set_neighbour(pair[0].1, pair[1].1);
            cells.set_neighbour(pair[1].1, pair[0].1);
        }
    }
}

/// A ghost stands for all that lies beyond its facet. In the facet's plane it stands for the inside of the facet's circle, which the sphere
/// of the cell behind it cuts out of that plane.
#[cold]
#[inline(never)]
fn ghost_is_in_conflict(cells: &Cells, signs: &Signs<'_>, ghost: u32, p: u32) -> bool {
    let point = signs.points[p as usize];
    let see = |v: u32| if v == GHOST { Seen::default() } else { Seen::new(signs.points[v as usize], point) };
    let vertices = cells.vertices(ghost);
    let seen = vertices.map(see);
    let seen = seen.each_ref();
    match signs.side(volumes(seen)[3], seen, vertices, 3, p) {
        0 => {
            let behind = cells.vertices(cells.neighbour(ghost, 3) >> 2);
            let seen = behind.map(see);
            let seen = seen.each_ref();
            let volumes = volumes(seen);
            let determinant = (0..4).map(|k| seen[k].w * volumes[k]).sum();
            signs.is_inside(determinant, volumes, seen, behind, p)
        }
        side => side > 0,
    }
}

/// The vertices met while one point is inserted, numbered as they are met. Number 0 is the vertex at infinity.
struct LocalVertices {
    ids: Vec<u32>,
    seen: Vec<Seen>,
    /// Bound on the error of the determinant of a sphere through any of them.
    bound: f64,
    farthest: f64,
    /// Open addressing: epoch << 32 | id, and the number.
    keys: Vec<u64>,
    numbers: Vec<u32>,
    epoch: u64,
}

impl LocalVertices {
    fn new() -> Self {
        let size = 256;
        LocalVertices {
            ids: Vec::new(),
            seen: Vec::new(),
            bound: 0.0,
            farthest: -1.0,
            keys: vec![0; size],
            numbers: vec![0; size],
            epoch: 0,
        }
    }

    fn clear(&mut self) {
        self.ids.clear();
        self.seen.clear();
        self.ids.push(GHOST);
        self.seen.push(Seen::default());
        self.farthest = -1.0;
        self.epoch += 1 << 32;
    }

    /// The local number of `id`.
    #[inline(always)]
    fn local(&mut self, id: u32, point: glam::DVec3, signs: &Signs<'_>) -> u32 {
        if id == GHOST {
            return 0;
        }
        let key = self.epoch | u64::from(id);
        let mask = self.keys.len() - 1;
        let mut at = id as usize & mask;
        loop {
            if self.keys[at] == key {
                return self.numbers[at];
            }
            if self.keys[at] < self.epoch {
                return self.meet(at, key, point, signs);
            }
            at = (at + 1) & mask;
        }
    }

    /// Bound on the error of the determinant of a sphere through vertices that were met or lie at that squared distance.
    #[inline(always)]
    fn bound_within(&mut self, distance_squared: f64, signs: &Signs<'_>) -> f64 {
        if !(distance_squared <= self.farthest) {
            self.farthest = distance_squared;
            self.bound = signs.sphere_bound(distance_squared);
        }
        self.bound
    }

    #[inline(never)]
    fn meet(&mut self, at: usize, key: u64, point: glam::DVec3, signs: &Signs<'_>) -> u32 {
        let number = self.ids.len() as u32;
        let id = key as u32;
        self.keys[at] = key;
        self.numbers[at] = number;
        let seen = Seen::new(signs.points[id as usize], point);
        self.ids.push(id);
        self.seen.push(seen);
        self.bound_within(seen.w, signs);
        if self.ids.len() * 4 > self.keys.len() {
            self.grow();
        }
        number
    }

    #[cold]
    fn grow(&mut self) {
        let size = self.keys.len() * 4;
        self.keys = vec![0; size];
        self.numbers = vec![0; size];
        for (number, &id) in self.ids.iter().enumerate().skip(1) {
            let mut at = id as usize & (size - 1);
            while self.keys[at] != 0 {
                at = (at + 1) & (size - 1);
            }
            self.keys[at] = self.epoch | u64::from(id);
            self.numbers[at] = number as u32;
        }
    }
}
