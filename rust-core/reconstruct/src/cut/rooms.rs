//! Deep places of empty space, and on which side of the surface they are.
//!
//! A cell is deep if its ball is larger than any gap that samples at random leave in a surface. Deep cells joined by facets as wide are one
//! room. Most samples whose two poles lie in two rooms have the surface between these. If it is known from which side samples were seen,
//! they say of the rooms of their poles which are outside and which inside. A room of which many say either is one that noise or a gap tore
//! the surface of, and is left to the cut.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::poles::{Poles, spacing, towards};
use crate::balls::Balls;
use crate::complex::Complex;
use crate::seen::Fronts;
use crate::separate::Groups;
use base::error::Result;
use base::progress::Progress;
use geom::delaunay3::INFINITE;

/// Clearance of deep places, in spacings. A million samples at random over a plane leave gaps of 2.4.
pub(super) const DEEP: f32 = 2.5;

/// Fewest samples that put two rooms on different sides.
const VOTES: u32 = 12;

/// Share of the samples that contradict the others about a room, from which its surface is torn.
const TORN: f64 = 0.05;
/// Cosine between the directions of a pole and of a front, from which the one tells of the other.
const TELLING: f64 = 0.3;

/// The room of the cells outside the hull.
const OUTSIDE: u32 = 0;
/// In no room.
const NONE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Outside,
    Inside,
}

impl Side {
    pub(super) fn other(self) -> Side {
        if self == Side::Outside { Side::Inside } else { Side::Outside }
    }
}

/// Deep places.
pub(super) struct Rooms {
    /// Of each cell.
    rooms: Vec<u32>,
    /// Of each room. `None` if too few samples tell.
    sides: Vec<Option<Side>>,
    /// Samples with both poles in the same room.
    pub(super) through: u32,
    /// Whether fronts show the side that is inside: of a room that was seen from within, or normals that look inwards.
    pub(super) are_fronts_inside: bool,
    /// Number of the first cell outside the hull.
    outer: u32,
}

impl Rooms {
    pub(super) fn find(
        complex: Complex<'_>,
        balls: &Balls,
        poles: &[Poles],
        fronts: &Fronts,
        progress: &Progress<'_>,
    ) -> Result<Rooms> {
        let rooms = joined(complex, balls, poles, progress)?;
        let names = names(complex, &rooms, progress)?;
        let mut contacts: FxHashMap<[u32; 2], u32> = FxHashMap::default();
        // Of each room, samples that say that it is on the side of their front, and on the other.
        let mut told = vec![[0; 2]; names.len()];
        let mut through = 0;
        for range in progress.ranges(poles.len()) {
            for vertex in range? {
                let cells = poles[vertex].cells;
                let [a, b] = cells.map(|cell| rooms.get(cell as usize).copied().unwrap_or(NONE));
                let front = fronts.at(vertex);
                for (cell, room) in cells.into_iter().zip([a, b]).filter(|(_, room)| *room != NONE) {
                    let pole = towards(complex, complex.points[vertex], cell).normalize_or_zero();
                    if pole.dot(front).abs() > TELLING {
                        told[room as usize][usize::from(pole.dot(front) < 0.0)] += 1;
                    }
                }
                if a == NONE || b == NONE {
                    continue;
                }
                if a == b {
                    through += 1;
                } else if front == DVec3::ZERO {
                    *contacts.entry([a.min(b), a.max(b)]).or_insert(0) += 1;
                }
            }
        }
        let are_fronts_inside = told[OUTSIDE as usize][1] > told[OUTSIDE as usize][0];
        if are_fronts_inside {
            told.iter_mut().for_each(|told| told.swap(0, 1));
        }
        let mut is_torn = vec![false; names.len()];
        // The rooms, whether they are on different sides, and how many samples say so.
        let mut relations: Vec<([u32; 2], bool, u32)> = Vec::new();
        for (room, [outside, inside]) in (0..).zip(told) {
            let fewer: u32 = outside.min(inside);
            if fewer >= VOTES && f64::from(fewer) > TORN * f64::from(outside.max(inside)) {
                is_torn[room as usize] = true;
            } else {
                relations.push(([OUTSIDE, room], inside > outside, outside.abs_diff(inside)));
            }
        }
        relations.extend(contacts.into_iter().map(|(rooms, votes)| (rooms, true, votes)));
        relations.retain(|relation| relation.2 >= VOTES);
        let name = |rooms: [u32; 2]| {
            let mut both = rooms.map(|room| names[room as usize]);
            both.sort_unstable();
            both
        };
        relations.sort_unstable_by(|a, b| b.2.cmp(&a.2).then_with(|| name(a.0).cmp(&name(b.0))).then(a.1.cmp(&b.1)));
        let mut groups = Groups::new(names.len());
        for ([a, b], is_different, _) in relations {
            groups.join(a, b, is_different);
        }
        let outside = groups.find(OUTSIDE);
        let side = |room: u32| {
            let (root, side) = groups.find(room);
            let known = if side == outside.1 { Side::Outside } else { Side::Inside };
            (root == outside.0 && !is_torn[room as usize]).then_some(known)
        };
        let sides = (0..names.len() as u32).map(side).collect();
        Ok(Rooms { rooms, sides, through, are_fronts_inside, outer: complex.finite as u32 })
    }

    /// The side of a cell, if it is known.
    pub(super) fn side(&self, cell: u32) -> Option<Side> {
        match self.rooms[cell as usize] {
            _ if cell >= self.outer => Some(Side::Outside),
            NONE => None,
            room => self.sides[room as usize],
        }
    }

    pub(super) fn has_inside(&self) -> bool {
        self.sides.contains(&Some(Side::Inside))
    }
}

/// The room of each deep cell, in the order of the cells. That of the outside is [`OUTSIDE`].
fn joined(complex: Complex<'_>, balls: &Balls, poles: &[Poles], progress: &Progress<'_>) -> Result<Vec<u32>> {
    let mut rooms = vec![NONE; complex.len()];
    rooms.par_iter_mut().enumerate().for_each(|(cell, room)| {
        let is_deep = || balls.radii[cell] > DEEP * spacing(poles, &complex.vertices(cell as u32));
        if complex.is_outer(cell as u32) || is_deep() {
            *room = cell as u32;
        }
    });
    // Each cell carries another of its room, or itself.
    let mut wide = Vec::new();
    for range in progress.ranges(complex.len()) {
        let range = range?;
        wide.clear();
        let rooms_before = &rooms;
        wide.par_extend(range.into_par_iter().flat_map_iter(|cell| {
            let (cell, rooms) = (cell as u32, rooms_before);
            let is_deep = rooms[cell as usize] != NONE;
            (0..4).filter(move |_| is_deep).filter_map(move |slot| {
                let beyond = complex.neighbour(cell, slot);
                let is_wide = || {
                    let facet = complex.facet(cell, slot);
                    facet.contains(&INFINITE) || balls.clearance(complex, cell, slot) > DEEP * spacing(poles, &facet)
                };
                (beyond > cell && rooms[beyond as usize] != NONE && is_wide()).then_some([cell, beyond])
            })
        }));
        for &pair in &wide {
            let [a, b] = pair.map(|cell| root(&mut rooms, cell));
            rooms[a.max(b) as usize] = a.min(b);
        }
    }
    let mut count = OUTSIDE + 1;
    let outside = if complex.finite < complex.len() { root(&mut rooms, complex.finite as u32) } else { NONE };
    // Roots come before what leads to them.
    let mut numbers = vec![NONE; complex.len()];
    for range in progress.ranges(complex.len()) {
        for cell in range?.filter(|&cell| rooms[cell] != NONE) {
            let to = rooms[cell] as usize;
            numbers[cell] = if to != cell {
                numbers[to]
            } else if cell as u32 == outside {
                OUTSIDE
            } else {
                count += 1;
                count - 1
            };
        }
    }
    Ok(numbers)
}

fn root(rooms: &mut [u32], mut cell: u32) -> u32 {
    while rooms[cell as usize] != cell {
        let next = rooms[rooms[cell as usize] as usize];
        rooms[cell as usize] = next;
        cell = next;
    }
    cell
}

/// Names of rooms, whatever the numbers of their cells: the first name of a cell.
fn names(complex: Complex<'_>, rooms: &[u32], progress: &Progress<'_>) -> Result<Vec<[u32; 4]>> {
    let mut names = vec![[u32::MAX; 4]];
    for range in progress.ranges(rooms.len()) {
        for cell in range?.filter(|&cell| rooms[cell] != NONE) {
            let room = rooms[cell] as usize;
            if room >= names.len() {
                names.resize(room + 1, [u32::MAX; 4]);
            }
            names[room] = names[room].min(complex.name(cell as u32));
        }
    }
    Ok(names)
}
