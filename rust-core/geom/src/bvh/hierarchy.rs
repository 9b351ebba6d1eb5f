//! The hierarchy over a mesh.

use glam::DVec3;

use super::build::build;
use super::node::{Frame, Node, Slot};
use base::error::{Error, Result};
use base::magnitude;
use base::memory;
use base::progress::Progress;

/// At the peak. Measured.
const BYTES_A_TRIANGLE: f64 = 115.0;

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
    pub(super) positions: &'a [DVec3],
    pub(super) nodes: Vec<Node>,
    pub(super) slots: Vec<Slot>,
    pub(super) frame: Frame,
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

    /// [`Bvh::build`] that stops when it is cancelled. It counts nothing. On a worker of any pool it works in that pool, whatever `threads` says.
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
        // A worker builds in its own pool: all threads of another one may wait for it.
        let (frame, nodes, slots) = match rayon::current_thread_index() {
            Some(_) => build(positions, triangles, progress)?,
            None => {
                let pool = base::threads::pool(threads)?;
                progress.watch(|| pool.install(|| build(positions, triangles, progress)))?
            }
        };
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

    /// The triangles in the order of the leaves. Most neighbours in it are neighbours in space. It is the same for any thread count.
    pub fn order(&self) -> impl Iterator<Item = u32> + '_ {
        self.slots.iter().map(|slot| slot.triangle)
    }

    pub(super) fn corners(&self, slot: &Slot) -> [DVec3; 3] {
        slot.corners.map(|v| self.positions[v as usize])
    }
}
