//! Nodes of the tree, triangles in the order of its leaves, and the frame of its boxes.

use glam::{DVec3, Vec3};

/// Growth of boxes beyond their triangles, in the frame in which the whole mesh spans [-1, 1].
///
/// It covers the following, with a factor of two to spare: rounding of a box to f32 (2^-24), of a ray's origin (|o| < 2, 2^-24), and five
/// relative roundings of a slab distance of at most 2.75 (5 * 2.75 * 2^-24).
pub(super) const GROWTH: f64 = 1.0 / (1 << 19) as f64;

/// Deepest level at which the surface area heuristic is followed. Below it, halving keeps the tree finite-stacked.
pub(super) const HEURISTIC_DEPTH: usize = 56;
/// Entries of a traversal stack: `HEURISTIC_DEPTH` levels, and 32 halvings of at most 2^32 triangles.
pub(super) const STACK: usize = HEURISTIC_DEPTH + 34;

/// A node: a box, and either two children (the left one follows it, `link` is the right one) or triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub(super) struct Node {
    pub(super) lo: [f32; 3],
    /// Index of the right child, for an inner node. First slot, for a leaf.
    pub(super) link: u32,
    pub(super) hi: [f32; 3],
    /// Triangles of a leaf. 0 for an inner node.
    pub(super) count: u32,
}

const _: () = assert!(size_of::<Node>() == 32);

/// A triangle in the order of the leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slot {
    pub(super) corners: [u32; 3],
    pub(super) triangle: u32,
}

/// The frame of the boxes: the mesh's box, moved to the origin and scaled by a power of two into [-1, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub(super) centre: DVec3,
    pub(super) scale: f64,
}

impl Frame {
    pub(super) fn around(lo: DVec3, hi: DVec3) -> Self {
        let centre = lo * 0.5 + hi * 0.5;
        // Never smaller than a few units in the last place of the coordinates, so that theirs stay small in the frame.
        let ulps = lo.abs().max(hi.abs()).max_element() / (1u64 << 44) as f64;
        let half = (hi - centre).max(centre - lo).max_element().max(ulps);
        // Power of two: scaling rounds nothing.
        let exponent = if half > 0.0 { half.log2().ceil().max(-1000.0) } else { 0.0 };
        Frame { centre, scale: (-exponent).exp2() }
    }

    pub(super) fn to_frame(self, point: DVec3) -> DVec3 {
        (point - self.centre) * self.scale
    }
}

impl Node {
    pub(super) fn lo(&self) -> Vec3 {
        Vec3::from_array(self.lo)
    }

    pub(super) fn hi(&self) -> Vec3 {
        Vec3::from_array(self.hi)
    }

    pub(super) fn slots<'s>(&self, slots: &'s [Slot]) -> &'s [Slot] {
        &slots[self.link as usize..self.link as usize + self.count as usize]
    }
}
