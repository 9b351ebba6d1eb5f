//! Bounding volume hierarchy over triangles: nearest hit of rays, closest point.
//!
//! | file | what | source |
//! |---|---|---|
//! | `build` | binned surface area heuristic, in parallel | \[Wald07\] |
//! | `ray` | watertight ray/triangle test in f64 | \[WBW13\] |
//! | `packet` | 64 rays at once: f32 filter in four lanes, decided by `ray` | \[ORM08\], \[WBW13\] |
//! | `closest` | closest point of a triangle and of the whole hierarchy | \[Ericson05, sec. 5.1.5\] |
//!
//! Every answer is decided in f64 on the caller's coordinates. The f32 boxes only choose which triangles are looked at. They are grown by
//! more than their own rounding and that of the rays, so they never hide a triangle. Answers therefore are those of a loop over all
//! triangles, to the bit, and the same for single rays, packets and any thread count.

// 1. the tree
mod build;
// 2. one ray
mod ray;
// 3. many rays
mod packet;
// 4. the closest point
mod closest;

pub use closest::{Closest, Feature};
pub use packet::PACKET;
pub use ray::{Hit, Ray};

use glam::{DVec3, Vec3};

use base::error::{Error, Result};
use base::magnitude;
use base::memory;
use base::progress::Progress;

/// At the peak. Measured.
const BYTES_A_TRIANGLE: f64 = 115.0;

/// Growth of boxes beyond their triangles, in the frame in which the whole mesh spans [-1, 1].
///
/// It covers the following, with a factor of two to spare: rounding of a box to f32 (2^-24), of a ray's origin (|o| < 2, 2^-24), and five
/// relative roundings of a slab distance of at most 2.75 (5 * 2.75 * 2^-24).
const GROWTH: f64 = 1.0 / (1 << 19) as f64;

/// Deepest level at which the surface area heuristic is followed. Below it, halving keeps the tree finite-stacked.
const HEURISTIC_DEPTH: usize = 56;
/// Entries of a traversal stack: `HEURISTIC_DEPTH` levels, and 32 halvings of at most 2^32 triangles.
const STACK: usize = HEURISTIC_DEPTH + 34;

/// A node: a box, and either two children (the left one follows it, `link` is the right one) or triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
struct Node {
    lo: [f32; 3],
    /// Index of the right child, for an inner node. First slot, for a leaf.
    link: u32,
    hi: [f32; 3],
    /// Triangles of a leaf. 0 for an inner node.
    count: u32,
}

const _: () = assert!(size_of::<Node>() == 32);

/// A triangle in the order of the leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Slot {
    corners: [u32; 3],
    triangle: u32,
}

/// The frame of the boxes: the mesh's box, moved to the origin and scaled by a power of two into [-1, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Frame {
    centre: DVec3,
    scale: f64,
}

impl Frame {
    fn around(lo: DVec3, hi: DVec3) -> Self {
        let centre = lo * 0.5 + hi * 0.5;
        // Never smaller than a few units in the last place of the coordinates, so that theirs stay small in the frame.
        let ulps = lo.abs().max(hi.abs()).max_element() / (1u64 << 44) as f64;
        let half = (hi - centre).max(centre - lo).max_element().max(ulps);
        // Power of two: scaling rounds nothing.
        let exponent = if half > 0.0 { half.log2().ceil().max(-1000.0) } else { 0.0 };
        Frame { centre, scale: (-exponent).exp2() }
    }

    fn to_frame(self, point: DVec3) -> DVec3 {
        (point - self.centre) * self.scale
    }
}

/// Bounding volume hierarchy over the triangles of a mesh, which it borrows.
///
/// # Guarantees
/// * No ray slips through an edge or a vertex that triangles share by index or by equal coordinates.
/// * Equal distances are decided by the smaller triangle index.
/// * Triangles without area count as the segments or points they are for the closest point. Rays pass them unless rounding gives them an
///   area, and then meet them where they are.
///
/// # Cost
/// n triangles: O(n log n) time to build, about 80 bytes per triangle. Queries O(log n) on ordinary meshes.
#[derive(Clone, Debug)]
pub struct Bvh<'a> {
    positions: &'a [DVec3],
    nodes: Vec<Node>,
    slots: Vec<Slot>,
    frame: Frame,
}

impl<'a> Bvh<'a> {
    /// Builds the hierarchy with `threads` threads, 0 for one per core.
    ///
    /// # Errors
    /// [`Error::Input`] for a coordinate that isn't finite or is larger than [`magnitude::LARGEST`], or a corner out of range.
    /// [`Error::OutOfMemory`].
    pub fn build(positions: &'a [DVec3], triangles: &[[u32; 3]], threads: usize) -> Result<Self> {
        Self::build_with(positions, triangles, threads, &Progress::none())
    }

    /// [`Bvh::build`] that stops when it is cancelled. It counts nothing.
    ///
    /// # Errors
    /// As [`Bvh::build`]. [`Error::Cancelled`].
    pub fn build_with(
        positions: &'a [DVec3],
        triangles: &[[u32; 3]],
        threads: usize,
        progress: &Progress<'_>,
    ) -> Result<Self> {
        magnitude::points("vertex", positions)?;
        if u32::try_from(triangles.len()).is_err() {
            return Err(Error::input(format!("{} triangles are more than the supported 2^32 - 1", triangles.len())));
        }
        let count = positions.len();
        for (t, corners) in triangles.iter().enumerate() {
            if let Some(v) = corners.iter().find(|&&v| v as usize >= count) {
                return Err(Error::input(format!(
                    "triangle {t} names vertex {v}, but there are only {count} vertices"
                )));
            }
        }
        let bytes = BYTES_A_TRIANGLE * triangles.len() as f64;
        memory::expect(bytes, || format!("searching among {} triangles", triangles.len()), "use fewer")?;
        let pool = base::threads::pool(threads)?;
        let (frame, nodes, slots) = progress.watch(|| pool.install(|| build::build(positions, triangles, progress)))?;
        Ok(Bvh { positions, nodes, slots, frame })
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Whether there is no triangle.
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    fn corners(&self, slot: &Slot) -> [DVec3; 3] {
        slot.corners.map(|v| self.positions[v as usize])
    }
}

impl Node {
    fn lo(&self) -> Vec3 {
        Vec3::from_array(self.lo)
    }

    fn hi(&self) -> Vec3 {
        Vec3::from_array(self.hi)
    }

    fn slots<'s>(&self, slots: &'s [Slot]) -> &'s [Slot] {
        &slots[self.link as usize..self.link as usize + self.count as usize]
    }
}

#[cfg(test)]
mod tests;
