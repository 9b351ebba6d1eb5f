//! A naive twin of the search and of the groups: all arrangements of five frames of a room, each judged as a whole.

use std::collections::BTreeSet;

use geom::bvh::Bvh;
use glam::{DAffine3, DVec3};
use image::range_image::RangeImage;
use image::source::ScanSource;
use mesh::TriMesh;
use mesh::shapes::Shape;
use scan::{ScanParams, VirtualCamera, scan};

use crate::assemble::glanced;
use crate::constraints::Constraints;
use crate::finding::{Finding, Limits, fits};
use crate::hypothesise::Effort;
use crate::linear::apart;
use crate::pair::Pair;
use crate::params::AlignParams;
use crate::reach::Bound;
use crate::view::View;
use crate::walls::telling;
use base::progress::Progress;

const FRAMES: usize = 5;
/// Places in which one frame may fit another that are tried.
const PLACES: usize = 4;
/// Of what all sensors can tell, the share that may speak against an arrangement.
const THROUGH: f64 = 0.005;
/// An arrangement explains frames as well as another one if so much of the area fits.
const AS_WELL: f64 = 0.95;
/// Arrangements are the same if no frame is further off than so many coarse cells.
const SAME: f64 = 4.0;

/// Frame `b` in frame `a`.
struct Candidate {
    a: usize,
    b: usize,
    a_from_b: DAffine3,
}

fn candidates(views: &[View], bound: &Bound, limits: &Limits) -> Vec<Candidate> {
    let mut found = Vec::new();
    for a in 0..views.len() {
        for b in a + 1..views.len() {
            let pair = Pair::search(views, a, b, Effort::Thorough, bound, limits);
            let is_right =
                |verdict| matches!(fits([&views[a], &views[b]], verdict, limits), Finding::Sure | Finding::Weak);
            let fitting = pair.modes.iter().filter(|mode| is_right(&mode.verdict)).take(PLACES);
            found.extend(fitting.map(|mode| Candidate { a, b, a_from_b: mode.a_from_b }));
        }
    }
    found
}

/// All arrangements of the frames, each as their poses in the first one's frame.
fn arrangements(candidates: &[Candidate], frames: &[usize]) -> Vec<Vec<DAffine3>> {
    let mut trees: BTreeSet<Vec<usize>> = BTreeSet::new();
    let mut found = Vec::new();
    grow(candidates, frames, &mut Vec::new(), &mut vec![(frames[0], DAffine3::IDENTITY)], &mut trees, &mut found);
    found
}

fn grow(
    candidates: &[Candidate],
    frames: &[usize],
    edges: &mut Vec<usize>,
    poses: &mut Vec<(usize, DAffine3)>,
    trees: &mut BTreeSet<Vec<usize>>,
    found: &mut Vec<Vec<DAffine3>>,
) {
    let mut tree = edges.clone();
    tree.sort_unstable();
    if !trees.insert(tree) {
        return;
    }
    let known = poses.clone();
    let pose = |frame: usize| known.iter().find(|known| known.0 == frame).map(|known| known.1);
    if poses.len() == frames.len() {
        found.push(frames.iter().map(|&frame| pose(frame).unwrap()).collect());
        return;
    }
    for (k, Candidate { a, b, a_from_b }) in candidates.iter().enumerate() {
        let next = match (pose(*a), pose(*b)) {
            (Some(pose), None) if frames.contains(b) => (*b, pose * *a_from_b),
            (None, Some(pose)) if frames.contains(a) => (*a, pose * a_from_b.inverse()),
            _ => continue,
        };
        edges.push(k);
        poses.push(next);
        grow(candidates, frames, edges, poses, trees, found);
        poses.pop();
        edges.pop();
    }
}

/// The area of what stands beside walls and lies on each other. `None` where sensors see through the arrangement.
fn support(views: &[View], frames: &[usize], poses: &[DAffine3]) -> Option<f64> {
    let (mut told, mut touching, mut through) = (0.0, 0.0, 0.0);
    for i in 0..frames.len() {
        for j in i + 1..frames.len() {
            let (both, motion) = ([&views[frames[i]], &views[frames[j]]], poses[i].inverse() * poses[j]);
            let Some(seen) = glanced(both, &motion, 0.0) else { continue };
            touching += seen.touching();
            through += seen.through[0] + seen.through[1];
            told += telling(both, &motion).0;
        }
    }
    (through <= THROUGH * (through + touching)).then_some(told)
}

fn is_same(views: &[View], frames: &[usize], one: &[DAffine3], other: &[DAffine3]) -> bool {
    (0..frames.len()).all(|k| {
        let view = &views[frames[k]];
        let [one, other] = [one, other].map(|poses| poses[0].inverse() * poses[k]);
        apart(&one, &other, view.reduced.radius) < SAME * view.coarse.cell
    })
}

/// Five frames of a room with boxes at its walls, as a camera sees them that turns.
pub(crate) fn frames(seed: u64) -> Vec<RangeImage> {
    let mut room = TriMesh::default();
    let number = |k: u64, lo: f64, hi: f64| {
        let bits = (seed * 131 + k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        lo + (hi - lo) * ((bits ^ (bits >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut put = |half: DVec3, to: DVec3, is_inside_out: bool| {
        let (part, base) = (Shape::Cuboid { half }.mesh(4), room.positions.len() as u32);
        room.positions.extend(part.positions.iter().map(|p| *p + to));
        let corners = |t: &[u32; 3]| if is_inside_out { [t[0], t[2], t[1]] } else { *t };
        room.triangles.extend(part.triangles.iter().map(|t| corners(t).map(|v| v + base)));
    };
    put(DVec3::new(2.5, 2.0, 1.35), DVec3::new(0.0, 0.0, 1.35), true);
    for k in 0..16 {
        let half = DVec3::new(number(4 * k, 0.1, 0.45), number(4 * k + 1, 0.1, 0.45), number(4 * k + 2, 0.1, 0.7));
        let along = number(4 * k + 3, -1.6, 1.6);
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        let to =
            if k / 2 % 2 == 0 { DVec3::new(2.0 * side, along, half.z) } else { DVec3::new(along, 1.5 * side, half.z) };
        put(half, to, false);
    }
    let bvh = Bvh::build(&room.positions, &room.triangles, 0).unwrap();
    let seen = |k: usize| {
        let turn = 0.55 * k as f64 + seed as f64;
        let eye = DVec3::new(0.8 * turn.cos(), 0.6 * turn.sin(), 1.4);
        let target = DVec3::new(2.4 * (turn + 0.5).cos(), 2.0 * (turn + 0.5).sin(), 0.7);
        let camera = VirtualCamera::pinhole(60, 80, 1.2, eye, target, DVec3::Z).unwrap();
        let params = ScanParams { noise: 0.004, seed: k as u64, threads: 1, ..ScanParams::default() };
        let mut image = scan(&room, &bvh, &camera, &params, &Progress::none()).unwrap();
        (image.name, image.world_from_sensor) = (format!("frame {k}"), DAffine3::IDENTITY);
        image
    };
    (0..FRAMES).map(seen).collect()
}

/// Theorem: frames that are placed lie as in the arrangement that explains most, and no other one explains them as well.
#[test]
fn no_arrangement_explains_placed_frames_better_nor_another_as_well() {
    let params = AlignParams::default();
    let limits = Limits::of(&params);
    let mut most = 0;
    for seed in 0..u64::from(base::tier::cases(3)) {
        let images = frames(seed);
        let sources: Vec<&dyn ScanSource> = images.iter().map(|image| image as &dyn ScanSource).collect();
        let alignment = crate::run(&sources, &params, &Constraints::default(), &Progress::none()).unwrap();
        let (views, order) = crate::driver::read(&sources, &Progress::none()).unwrap();
        let inside = Constraints::default().renumbered(&params, &order, &views, None);
        let candidates = candidates(&views, &Bound::of(&views, &params, &inside), &limits);
        let local = |k: usize| DAffine3::from_translation(views[k].reduced.middle);
        let placed: Vec<(usize, DAffine3)> =
            (0..FRAMES).filter_map(|k| Some((k, alignment.world_from_scan[order[k]]? * local(k)))).collect();
        let (placed, poses): (Vec<usize>, Vec<DAffine3>) = placed.into_iter().unzip();
        most = most.max(placed.len());
        if placed.len() < 2 {
            continue;
        }
        let all = arrangements(&candidates, &placed);
        let judged = all.iter().filter_map(|poses| Some((support(&views, &placed, poses)?, poses)));
        let mut judged: Vec<(f64, &Vec<DAffine3>)> = judged.collect();
        judged.sort_by(|x, y| y.0.total_cmp(&x.0));
        let own = support(&views, &placed, &poses).expect("no sensor sees through what is placed");
        let best = judged.first().map_or(0.0, |first| first.0);
        let rival =
            judged.iter().find(|(_, other)| !is_same(&views, &placed, other, &poses)).map_or(0.0, |rival| rival.0);
        assert!(own >= AS_WELL * best, "{seed}: {own} explained, and {best} by another arrangement");
        assert!(rival < AS_WELL * own, "{seed}: {own} explained, and {rival} by another arrangement");
    }
    assert!(most >= 3, "nearly nothing was placed: {most}");
}
