//! Regions of space in which a thread may change cells.

use glam::DVec3;

use super::cells::GHOST;

pub(super) trait Region: Sync {
    /// Whether all vertices, but for the one at infinity, lie in the region.
    fn owns(&self, vertices: [u32; 4], points: &[DVec3]) -> bool;

    /// Whether a vertex, if it isn't the one at infinity, lies in the region.
    fn has(&self, vertex: u32, points: &[DVec3]) -> bool;
}

/// All of space, for a thread alone.
pub(super) struct Everywhere;

impl Region for Everywhere {
    #[inline(always)]
    fn owns(&self, _: [u32; 4], _: &[DVec3]) -> bool {
        true
    }

    #[inline(always)]
    fn has(&self, _: u32, _: &[DVec3]) -> bool {
        true
    }
}

/// Points p with `low <= p < high` in all coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) low: DVec3,
    pub(super) high: DVec3,
}

impl Block {
    pub(super) fn everywhere() -> Self {
        Block { low: DVec3::NEG_INFINITY, high: DVec3::INFINITY }
    }

    /// Those of the points that lie in it.
    pub(super) fn of<'a>(&'a self, ids: &'a [u32], points: &'a [DVec3]) -> impl Iterator<Item = u32> + 'a {
        ids.iter().copied().filter(|&p| self.holds(points[p as usize]))
    }

    #[inline(always)]
    pub(super) fn holds(&self, p: DVec3) -> bool {
        (p.cmpge(self.low) & p.cmplt(self.high)).all()
    }
}

impl Region for Block {
    #[inline(always)]
    fn owns(&self, vertices: [u32; 4], points: &[DVec3]) -> bool {
        vertices.into_iter().all(|v| self.has(v, points))
    }

    #[inline(always)]
    fn has(&self, vertex: u32, points: &[DVec3]) -> bool {
        vertex == GHOST || self.holds(points[vertex as usize])
    }
}
