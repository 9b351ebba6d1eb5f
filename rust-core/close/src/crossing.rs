//! Pairs of triangles that cross, exactly.

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::magnitude;
use base::progress::{Pace, Progress};
use geom::triangles::cross;
use mesh::TriMesh;
use mesh::holes::Bounds;

/// Triangles of a leaf.
const LEAF: usize = 4;

/// All pairs of triangles, the smaller number first, rising, that have more in common than corners and edges they share. Only pairs with a
/// triangle that `is_asked` are looked at. Exact for any coordinates: coplanar triangles that overlap cross, those that share a corner or
/// an edge cross if they meet anywhere else, and slivers are no exception. A triangle without area crosses nothing.
///
/// Cost: O(n log n) for n triangles of which few boxes meet.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn pairs(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    is_asked: impl Fn(usize) -> bool + Sync,
    progress: &Progress<'_>,
) -> Result<Vec<[u32; 2]>> {
    let corners = |t: u32| triangles[t as usize].map(|v| positions[v as usize]);
    let asked: Vec<u32> = (0..triangles.len() as u32).filter(|&t| is_asked(t as usize)).collect();
    let tree = Tree::new(asked.iter().map(|&t| (t, Bounds::of(corners(t)))).collect(), progress)?;
    let numbers: Vec<u32> = (0..triangles.len() as u32).collect();
    let found: Vec<Vec<[u32; 2]>> = numbers
        .par_chunks(1024)
        .map(|chunk| {
            progress.check()?;
            let mut pace = Pace::new(progress);
            let mut found = Vec::new();
            for &t in chunk {
                let (own, is_own_asked) = (corners(t), is_asked(t as usize));
                tree.meeting(&Bounds::of(own), &mut |other| {
                    pace.after(16)?;
                    // Those that are both asked for are found once.
                    if other != t && !(is_own_asked && other < t) && cross(own, corners(other)) {
                        found.push([t.min(other), t.max(other)]);
                    }
                    Ok(true)
                })?;
            }
            Ok(found)
        })
        .collect::<Result<_>>()?;
    let mut found = found.concat();
    progress.sort(&mut found, &|a, b| a.cmp(b))?;
    Ok(found)
}

/// All pairs of triangles of a mesh that cross, the smaller number first, rising: they have more in common than corners and edges that they
/// share. Exact for any coordinates. A triangle without area crosses nothing.
///
/// Cost: O(n log n) for n triangles of which few boxes meet.
///
/// # Errors
/// [`base::Error::Input`] for a mesh that is not valid. [`base::Error::Cancelled`].
pub fn crossing_pairs(mesh: &TriMesh, progress: &Progress<'_>) -> Result<Vec<[u32; 2]>> {
    mesh.validate()?;
    magnitude::points("vertex", &mesh.positions)?;
    pairs(&mesh.positions, &mesh.triangles, |_| true, progress)
}

/// Triangles that others may cross.
pub struct Crossed {
    tree: Tree,
    corners: Vec<[DVec3; 3]>,
}

impl Crossed {
    /// Of all triangles.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn new(positions: &[DVec3], triangles: &[[u32; 3]], progress: &Progress<'_>) -> Result<Self> {
        let corners: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.map(|v| positions[v as usize])).collect();
        let boxes = corners.iter().enumerate().map(|(t, &corners)| (t as u32, Bounds::of(corners))).collect();
        Ok(Crossed { tree: Tree::new(boxes, progress)?, corners })
    }

    /// Whether a triangle crosses any, exactly.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn is_met(&self, triangle: [DVec3; 3], progress: &Progress<'_>) -> Result<bool> {
        let (mut met, mut pace) = (false, Pace::new(progress));
        self.tree.meeting(&Bounds::of(triangle), &mut |other| {
            pace.after(16)?;
            met = cross(triangle, self.corners[other as usize]);
            Ok(!met)
        })?;
        Ok(met)
    }
}

/// Boxes with their numbers, by halving.
pub struct Tree {
    nodes: Vec<Node>,
    boxes: Vec<(u32, Bounds)>,
}

/// The left child follows its parent.
struct Node {
    bounds: Bounds,
    right: u32,
    /// The boxes of a leaf. None for others.
    first: u32,
    count: u32,
}

impl Tree {
    pub fn new(boxes: Vec<(u32, Bounds)>, progress: &Progress<'_>) -> Result<Self> {
        let count = boxes.len();
        let mut tree = Tree { nodes: Vec::new(), boxes };
        if count > 0 {
            tree.split(0, count, &mut Pace::new(progress))?;
        }
        Ok(tree)
    }

    fn split(&mut self, first: usize, count: usize, pace: &mut Pace<'_>) -> Result<()> {
        pace.after(count)?;
        let slots = &mut self.boxes[first..first + count];
        let bounds = Bounds::of(slots.iter().flat_map(|slot| [slot.1.min, slot.1.max]));
        let node = self.nodes.len();
        let is_leaf = count <= LEAF;
        self.nodes.push(Node { bounds, right: 0, first: first as u32, count: if is_leaf { count as u32 } else { 0 } });
        if is_leaf {
            return Ok(());
        }
        let size = bounds.max - bounds.min;
        let axis = (0..3).fold(0, |best, axis| if size[axis] > size[best] { axis } else { best });
        let centre = |slot: &(u32, Bounds)| slot.1.min[axis] + slot.1.max[axis];
        let half = count / 2;
        slots.select_nth_unstable_by(half, |a, b| centre(a).total_cmp(&centre(b)).then(a.0.cmp(&b.0)));
        self.split(first, half, pace)?;
        self.nodes[node].right = self.nodes.len() as u32;
        self.split(first + half, count - half, pace)
    }

    /// Calls `each` with the numbers of boxes that meet another, as long as it wants more.
    pub fn meeting(&self, bounds: &Bounds, each: &mut dyn FnMut(u32) -> Result<bool>) -> Result<()> {
        let mut stack = if self.nodes.is_empty() { Vec::new() } else { vec![0_u32] };
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            if !node.bounds.meets(bounds) {
                continue;
            }
            if node.count == 0 {
                stack.extend([at + 1, node.right]);
                continue;
            }
            for (number, own) in &self.boxes[node.first as usize..(node.first + node.count) as usize] {
                if own.meets(bounds) && !each(*number)? {
                    return Ok(());
                }
            }
        }
        Ok(())
    }
}
