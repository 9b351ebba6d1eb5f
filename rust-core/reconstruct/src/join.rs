//! Open surfaces, continued: parts are joined across gaps.
//!
//! First over facets a few times as large as the sampling allows, then over larger ones that continue a part smoothly. What lies further
//! apart stays apart: nothing says that there is a surface between.
//! Only facets between two parts count, so that borders stay where the samples end. Each part has grown with an orientation of
//! its own: where two meet the other way round, the smaller one is turned over.

use super::grow::{Front, Reach};
use base::error::Result;
use base::progress::{Pace, Progress};

impl<F: FnMut([u32; 3]) -> f64> Front<'_, F> {
    /// Joins parts. Facets may be `times` as large as the sampling allows before only smooth ones count.
    pub(super) fn join_parts(&mut self, times: u32, progress: &Progress<'_>) -> Result<()> {
        let mut pace = Pace::new(progress);
        for triangle in 0..self.triangles.len() {
            pace.after(1)?;
            let part = self.part(self.triangles[triangle][0]);
            self.members.entry(part).or_default().push(triangle as u32);
        }
        for reach in [Reach::Times(times), Reach::Smooth(times)] {
            if self.members.len() > 1 {
                self.reach = reach;
                self.run(0, progress)?;
            }
        }
        self.reach = Reach::Sampling;
        self.members.clear();
        Ok(())
    }

    /// Makes the parts of two vertices one.
    pub(super) fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.part(a), self.part(b));
        if a == b {
            return;
        }
        let (first, second) = (a.min(b), a.max(b));
        self.parts[second as usize] = first;
        if !self.members.is_empty() {
            let [mut more, mut fewer] = [first, second].map(|part| self.members.remove(&part).unwrap_or_default());
            if more.len() < fewer.len() {
                std::mem::swap(&mut more, &mut fewer);
            }
            more.extend(fewer);
            self.members.insert(first, more);
        }
    }

    /// Whether a part may be turned over so that the facet between an edge and an apex fits: two parts meet at it, and it has turned none
    /// since a triangle was added last. Of facets that want two parts the other way round than each other, one gives in, so that turning
    /// ends.
    pub(super) fn may_turn(&mut self, edge: [u32; 2], apex: u32) -> bool {
        !self.members.is_empty()
            && self.part(edge[0]) != self.part(apex)
            && !self.turned.contains(&(undirected(edge), apex))
    }

    /// Turns a part over so that the facet between an edge and an apex fits.
    pub(super) fn turn_for(&mut self, edge: [u32; 2], apex: u32) {
        let [from, to] = edge;
        self.turned.insert((undirected(edge), apex));
        self.turn_smaller(from, apex);
        self.enqueue([from, to]);
        self.enqueue([to, from]);
    }

    /// Turns the smaller one of the parts of two vertices over.
    fn turn_smaller(&mut self, a: u32, b: u32) {
        let (a, b) = (self.part(a), self.part(b));
        let part = if self.members[&a].len() < self.members[&b].len() { a } else { b };
        let mut vertices: Vec<u32> = Vec::with_capacity(3 * self.members[&part].len());
        for &triangle in &self.members[&part] {
            let triangle = &mut self.triangles[triangle as usize];
            triangle.swap(0, 1);
            vertices.extend(*triangle);
        }
        vertices.sort_unstable();
        vertices.dedup();
        let on_border = |&vertex: &u32| Some((vertex, self.border.next(vertex)?, self.beside[vertex as usize]));
        let edges: Vec<(u32, u32, [u32; 2])> = vertices.iter().filter_map(on_border).collect();
        for &(from, to, beside) in &edges {
            self.border.link(to, from);
            self.beside[to as usize] = beside;
        }
        for (from, to, _) in edges {
            self.enqueue([to, from]);
        }
    }
}

/// An edge as it is from both its sides: turned parts have theirs the other way round.
fn undirected([from, to]: [u32; 2]) -> [u32; 2] {
    [from.min(to), from.max(to)]
}
