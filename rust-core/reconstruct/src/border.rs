//! The border of an oriented surface of which every vertex has one fan of triangles: so each vertex of the border has one
//! edge of it before and one after.

/// No vertex.
const NONE: u32 = u32::MAX;
/// A vertex that has no triangle yet.
const UNUSED: u32 = u32::MAX - 1;

/// Cycles of directed edges. The direction is that of the triangle beside the edge.
pub(super) struct Border {
    next: Vec<u32>,
    previous: Vec<u32>,
}

impl Border {
    /// No triangle yet.
    pub(super) fn new(vertices: usize) -> Self {
        Border { next: vec![UNUSED; vertices], previous: vec![UNUSED; vertices] }
    }

    pub(super) fn is_used(&self, vertex: u32) -> bool {
        self.next[vertex as usize] != UNUSED
    }

    /// Takes a vertex that has no triangle yet inside.
    pub(super) fn enclose(&mut self, vertex: u32) {
        (self.next[vertex as usize], self.previous[vertex as usize]) = (NONE, NONE);
    }

    /// Whether triangles are all around a vertex.
    pub(super) fn is_inside(&self, vertex: u32) -> bool {
        self.next[vertex as usize] == NONE
    }

    /// The vertex after one of the border.
    pub(super) fn next(&self, vertex: u32) -> Option<u32> {
        Some(self.next[vertex as usize]).filter(|&next| next < UNUSED)
    }

    /// The vertex before one of the border.
    pub(super) fn previous(&self, vertex: u32) -> Option<u32> {
        Some(self.previous[vertex as usize]).filter(|&previous| previous < UNUSED)
    }

    pub(super) fn has(&self, [from, to]: [u32; 2]) -> bool {
        self.next[from as usize] == to
    }

    pub(super) fn link(&mut self, from: u32, to: u32) {
        self.next[from as usize] = to;
        self.previous[to as usize] = from;
    }

    /// Takes a triangle of a part all of whose triangles are known to `has_triangle`, which knows directed edges.
    pub(super) fn enter(&mut self, [a, b, c]: [u32; 3], has_triangle: impl Fn([u32; 2]) -> bool) {
        for vertex in [a, b, c] {
            if !self.is_used(vertex) {
                self.enclose(vertex);
            }
        }
        for [from, to] in [[a, b], [b, c], [c, a]] {
            if !has_triangle([to, from]) {
                self.link(from, to);
            }
        }
    }

    /// Takes a triangle that shares one, two or three edges with the border, and no vertex alone.
    pub(super) fn attach(&mut self, [a, b, c]: [u32; 3]) {
        let edges = [[a, b], [b, c], [c, a]];
        let is_shared = edges.map(|[from, to]| self.has([to, from]));
        for ([from, to], is_shared) in edges.into_iter().zip(is_shared) {
            if is_shared {
                self.next[to as usize] = NONE;
                self.previous[from as usize] = NONE;
            }
        }
        for ([from, to], is_shared) in edges.into_iter().zip(is_shared) {
            if !is_shared {
                self.link(from, to);
            }
        }
    }

    /// Takes two triangles at once. The first shares its first edge with the border and touches it with its last vertex. The second lies
    /// between it and an edge of the border at that vertex, and may close an ear beyond.
    pub(super) fn glue(&mut self, [to, from, apex]: [u32; 3], twin: [u32; 3]) {
        let (next, previous) = (self.next[apex as usize], self.previous[apex as usize]);
        if twin == [next, apex, from] {
            // The edge from `apex` to `next` is covered; `from` is joined to `next`.
            self.link(apex, to);
            self.join(from, next);
        } else {
            debug_assert_eq!(twin, [apex, previous, to]);
            self.link(from, apex);
            self.join(previous, to);
        }
    }

    /// Puts an edge onto the border, or takes the opposite one off it.
    fn join(&mut self, from: u32, to: u32) {
        if self.has([to, from]) {
            // All around `from` and `to` on this side is covered.
            self.next[from as usize] = NONE;
            self.previous[to as usize] = NONE;
            self.next[to as usize] = NONE;
            self.previous[from as usize] = NONE;
        } else {
            self.link(from, to);
        }
    }
}
