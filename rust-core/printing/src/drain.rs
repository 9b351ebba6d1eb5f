//! The drain: a hole in the base that leads into the cavity, a prism between two flat faces.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use rustc_hash::FxHashSet;

use base::error::{Result, Shown};
use base::progress::{Pace, Progress};
use close::bodies::Bodies;
use mesh::TriMesh;

use super::cap::cap;
use super::cut::Open;
use super::hollow::Cavity;
use super::made::{Made, Origin};
use super::params::PrepareParams;
use super::report::{PrepareProblem, PrepareReport};
use super::section::Section;
use super::single::Precision;
use super::slice::is_sound;

/// Share of the diameter that the hole keeps from the borders of the floor and the base. Its place is found to half of it.
const MARGIN: f64 = 0.02;
/// The most squares that are looked at. Each costs as much as the floor and the base have edges.
const SQUARES: usize = 4000;
/// Angles by which the prism is turned until it meets no other vertex, as shares of a side.
const TURNS: [f64; 3] = [0.0, 0.3, 0.7];

/// Leads a hole from the base into a cavity, where both are widest. If there is no room, nothing changes, and the report says so.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn drain(
    mesh: &mut TriMesh,
    base: Section,
    cavity: &Cavity,
    params: &PrepareParams,
    report: &mut PrepareReport,
    progress: &Progress<'_>,
) -> Result<()> {
    let Some(diameter) = params.drain else { return Ok(()) };
    let Some(floor) = cavity.floor else {
        let text = "The mesh stands on no face that a hole could lead from: give a larger base_height";
        report.note(PrepareProblem::NoDrain, text.to_owned());
        return Ok(());
    };
    let lies = |t: usize, plane: &Section| mesh.corners(t).iter().all(|&p| plane.side(p) == Ordering::Equal);
    let (outer, inner) = (0..cavity.first_face, cavity.first_face..mesh.triangles.len());
    let base_faces: Vec<usize> = outer.filter(|&t| lies(t, &base)).collect();
    let floor_faces: Vec<usize> = inner.filter(|&t| lies(t, &floor)).collect();
    let borders = [Border::of(mesh, &base_faces, base), Border::of(mesh, &floor_faces, base)];
    let (place, radius) = widest(&borders, MARGIN * diameter, progress)?;
    report.drain_room = Some(2.0 * radius);
    if radius < (0.5 + MARGIN) * diameter {
        let text = format!(
            "A hole of {} finds no room in the floor of the cavity, where {} fits: give a smaller drain or a higher base",
            Shown(diameter),
            Shown::digits((radius / (0.5 + MARGIN)).max(0.0), 3)
        );
        report.note(PrepareProblem::NoDrain, text);
        return Ok(());
    }
    let precision = Precision::of(mesh);
    for turn in TURNS {
        let ring = |at: f64| -> Vec<DVec3> {
            let corner = |k: u32| {
                let angle = TAU * (f64::from(k) + turn) / f64::from(params.drain_sides);
                precision.place(lifted(place + 0.5 * diameter * DVec2::from_angle(angle), base, at))
            };
            (0..params.drain_sides).map(corner).collect()
        };
        let rings = [ring(base.at), ring(floor.at)];
        let removed: FxHashSet<usize> = base_faces.iter().chain(&floor_faces).copied().collect();
        let mut made = Made::of(mesh);
        made.retain(|t, _| !removed.contains(&t));
        let rings = rings.map(|ring| ring.iter().map(|&p| made.vertex(p, Origin::New)).collect::<Vec<u32>>());
        tube(&mut made, &rings);
        let is_closed = [(base, &base_faces, &rings[0]), (floor.reversed(), &floor_faces, &rings[1])]
            .into_iter()
            .try_fold(true, |is_closed, (plane, faces, ring)| {
                let in_plane = in_plane(mesh, faces, ring);
                let rims = rims(&made, &in_plane);
                let mut open = Open { made: std::mem::take(&mut made), rims, in_plane };
                let is_capped = is_closed && cap(&mut open, plane, progress)?;
                made = open.made;
                Ok::<bool, base::Error>(is_capped)
            })?;
        made.compact();
        if is_closed && is_sound(&made, progress)? {
            *mesh = made.finish(mesh);
            report.is_drained = true;
            return Ok(());
        }
    }
    let text = "A hole of that diameter would cross the surface beside the base: give a smaller drain or a higher base";
    report.note(PrepareProblem::NoDrain, text.to_owned());
    Ok(())
}

/// The place in a plane that is seen there.
fn lifted(seen: DVec2, base: Section, at: f64) -> DVec3 {
    let mut place = DVec3::ZERO;
    place[(base.axis + 1) % 3] = if base.is_upward { seen.x } else { -seen.x };
    place[(base.axis + 2) % 3] = seen.y;
    place[base.axis] = at;
    place
}

/// The sides of the prism between the ring of the base and that of the floor. They face its axis. Seen from the floor rings turn
/// counter-clockwise.
fn tube(made: &mut Made, [base, floor]: &[Vec<u32>; 2]) {
    for k in 0..base.len() {
        let next = (k + 1) % base.len();
        made.triangle([base[k], floor[next], base[next]], None, true);
        made.triangle([base[k], floor[k], floor[next]], None, true);
    }
}

/// The vertices of some faces, and others.
fn in_plane(mesh: &TriMesh, faces: &[usize], others: &[u32]) -> Vec<u32> {
    let mut all: Vec<u32> = faces.iter().flat_map(|&t| mesh.triangles[t]).chain(others.iter().copied()).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// The edges between some vertices that have a face on one side only, in its direction.
fn rims(made: &Made, vertices: &[u32]) -> Vec<[u32; 2]> {
    let mut is_asked = vec![false; made.positions.len()];
    vertices.iter().for_each(|&v| is_asked[v as usize] = true);
    let sides = made.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let sides: Vec<[u32; 2]> = sides.filter(|ends| ends.iter().all(|&v| is_asked[v as usize])).collect();
    let all: FxHashSet<[u32; 2]> = sides.iter().copied().collect();
    sides.into_iter().filter(|&[a, b]| !all.contains(&[b, a])).collect()
}

/// The border of some faces in a plane.
struct Border(Vec<[DVec2; 2]>);

impl Border {
    fn of(mesh: &TriMesh, faces: &[usize], plane: Section) -> Self {
        let side = |t: usize, k: usize| [mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]];
        let sides = || faces.iter().flat_map(|&t| (0..3).map(move |k| side(t, k)));
        let all: FxHashSet<[u32; 2]> = sides().collect();
        let open = sides().filter(|&[a, b]| !all.contains(&[b, a]));
        Border(open.map(|ends| ends.map(|v| plane.seen(mesh.positions[v as usize]))).collect())
    }

    /// Distance of a place from the border, negative outside.
    fn room(&self, place: DVec2) -> f64 {
        let (mut least, mut is_inside) = (f64::INFINITY, false);
        for &[a, b] in &self.0 {
            let (along, to) = (b - a, place - a);
            let share = (to.dot(along) / along.length_squared()).clamp(0.0, 1.0);
            least = least.min((to - along * share).length_squared());
            let is_across = (a.y > place.y) != (b.y > place.y);
            if is_across && place.x < a.x + (b.x - a.x) * (place.y - a.y) / (b.y - a.y) {
                is_inside = !is_inside;
            }
        }
        if is_inside { least.sqrt() } else { -least.sqrt() }
    }
}

/// A square that may hold the widest place.
struct Square {
    middle: DVec2,
    half: f64,
    room: f64,
    /// No place in it has more.
    most: f64,
}

impl Ord for Square {
    fn cmp(&self, other: &Self) -> Ordering {
        let place = |square: &Square| square.middle;
        let by_place = || place(self).x.total_cmp(&place(other).x).then(place(self).y.total_cmp(&place(other).y));
        self.most.total_cmp(&other.most).then_with(by_place)
    }
}

impl PartialOrd for Square {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Square {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Square {}

/// The place farthest from all borders, inside of all, and its distance from them. Squares are quartered, the most promising first, until
/// none has more by `precision`.
fn widest(borders: &[Border; 2], precision: f64, progress: &Progress<'_>) -> Result<(DVec2, f64)> {
    let mut pace = Pace::new(progress);
    let edges = borders[0].0.len() + borders[1].0.len();
    let corners = || borders[1].0.iter().flatten();
    let lo = corners().fold(DVec2::INFINITY, |lo, &p| lo.min(p));
    let hi = corners().fold(DVec2::NEG_INFINITY, |hi, &p| hi.max(p));
    if !(lo.x < hi.x && lo.y < hi.y) || borders[0].0.is_empty() {
        return Ok((DVec2::ZERO, 0.0));
    }
    let square = |middle: DVec2, half: f64| {
        let room = borders[0].room(middle).min(borders[1].room(middle));
        Square { middle, half, room, most: room + half * std::f64::consts::SQRT_2 }
    };
    let mut left = BinaryHeap::from([square(0.5 * (lo + hi), 0.5 * (hi - lo).max_element())]);
    let mut best = (DVec2::ZERO, 0.0);
    for _ in 0..SQUARES {
        let Some(next) = left.pop() else { break };
        if next.room > best.1 {
            best = (next.middle, next.room);
        }
        if next.most <= best.1 + precision {
            break;
        }
        let half = 0.5 * next.half;
        for (x, y) in [(-half, -half), (half, -half), (-half, half), (half, half)] {
            pace.after(4 * edges)?;
            left.push(square(next.middle + DVec2::new(x, y), half));
        }
    }
    Ok(best)
}

/// Cavities without a way out: bodies of a closed mesh that are turned over.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn shut_cavities(mesh: &TriMesh, progress: &Progress<'_>) -> Result<usize> {
    let bodies = Bodies::new(mesh, false, progress)?;
    Ok(bodies.list.iter().filter(|body| body.volume < 0.0).count())
}
