//! Many rays at once: 64 rays walk the tree together, four to a vector. \[ORM08\], \[WBW13\]
//!
//! Rays that run close together (neighbouring pixels) visit the same nodes, so a node is fetched once for all of them.
//! A node is skipped if the first ray that was still alive misses it, an interval test over all rays misses it, and then
//! every other ray misses it. In a leaf an f32 test, loosened by its own rounding, picks the pairs of ray and triangle
//! that [`Sheared::meet`] then decides in f64.

use glam::{DVec3, Vec3, Vec4};

use super::hierarchy::Bvh;
use super::node::{GROWTH, Node, STACK};
use super::ray::{FLAT, Hit, Ray, Sheared};

/// Rays a packet.
pub const PACKET: usize = 64;
/// Vectors a packet.
const GROUPS: usize = PACKET / 4;

/// Loosening of the f32 triangle test relative to the triangle's size. An edge function of a triangle of size e, seen from at most 3.5 away
/// in the frame, is off by at most about 20 * 2^-24 * e.
const LOOSE: f32 = 1.0 / (1 << 18) as f32;
/// The same for what does not shrink with the triangle: the product of two roundings.
const LOOSE_FLOOR: f32 = 1.0 / (1u64 << 40) as f32;

/// Four rays a vector, component by component, in the boxes' frame.
#[derive(Clone, Copy)]
struct Group {
    origin: [Vec4; 3],
    direction: [Vec4; 3],
    inverse: [Vec4; 3],
    from: Vec4,
    to: Vec4,
}

impl Group {
    /// Rays that meet nothing: `from` is beyond `to`.
    const IDLE: Group = Group {
        origin: [Vec4::ZERO; 3],
        direction: [Vec4::ZERO; 3],
        inverse: [Vec4::ONE; 3],
        from: Vec4::INFINITY,
        to: Vec4::NEG_INFINITY,
    };

    /// The rays of the four that meet the box, as a bit each.
    #[inline]
    fn meets(&self, node: &Node) -> u32 {
        let (mut near, mut far) = (self.from, self.to);
        for axis in 0..3 {
            let a = (Vec4::splat(node.lo[axis]) - self.origin[axis]) * self.inverse[axis];
            let b = (Vec4::splat(node.hi[axis]) - self.origin[axis]) * self.inverse[axis];
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        near.cmple(far).bitmask()
    }
}

/// Bounds over all rays of the packet, to reject a box at once.
struct Hull {
    origin: [Vec3; 2],
    /// Bounds of the inverse directions. An axis on which they differ in sign is left unbounded.
    inverse: [Vec3; 2],
    from: f32,
    bounded: [bool; 3],
}

impl Hull {
    /// Whether every ray surely misses the box.
    #[inline]
    fn misses(&self, node: &Node) -> bool {
        let (mut near, mut far) = (self.from, f32::INFINITY);
        for axis in 0..3 {
            if !self.bounded[axis] {
                continue;
            }
            let [o_lo, o_hi] = [self.origin[0][axis], self.origin[1][axis]];
            let [i_lo, i_hi] = [self.inverse[0][axis], self.inverse[1][axis]];
            let (enter, leave) = if i_lo > 0.0 {
                (node.lo[axis] - o_hi, node.hi[axis] - o_lo)
            } else {
                (node.hi[axis] - o_lo, node.lo[axis] - o_hi)
            };
            // The smallest product of `enter` and the largest of `leave` with any of the inverses.
            let enter = (enter * i_lo).min(enter * i_hi);
            let leave = (leave * i_lo).max(leave * i_hi);
            near = near.max(enter);
            far = far.min(leave);
        }
        near > far
    }
}

/// A triangle in the frame for the f32 test.
struct Filter {
    corner: [Vec4; 3],
    edge1: [Vec4; 3],
    edge2: [Vec4; 3],
    normal: [Vec4; 3],
    loose: Vec4,
}

impl Filter {
    fn new(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners.map(DVec3::as_vec3);
        let (edge1, edge2) = (b - a, c - a);
        let splat = |v: Vec3| v.to_array().map(Vec4::splat);
        let size = edge1.abs().element_sum() + edge2.abs().element_sum();
        Filter {
            corner: splat(a),
            edge1: splat(edge1),
            edge2: splat(edge2),
            normal: splat(edge1.cross(edge2)),
            loose: Vec4::splat(size * LOOSE + LOOSE_FLOOR),
        }
    }

    /// The rays of the four that may meet the triangle: never fewer than do.
    #[inline]
    fn candidates(&self, g: &Group) -> u32 {
        // With s = origin - corner = b1 e1 + b2 e2 - t d and q = s x d: b1 D = q . e2, b2 D = -q . e1, D = -d . n.
        let s = [g.origin[0] - self.corner[0], g.origin[1] - self.corner[1], g.origin[2] - self.corner[2]];
        let q = cross(&s, &g.direction);
        let u = dot(&q, &self.edge2);
        let v = -dot(&q, &self.edge1);
        let w = -dot(&g.direction, &self.normal) - u - v;
        let (low, high) = (u.min(v).min(w), u.max(v).max(w));
        low.cmpge(-self.loose).bitmask() | high.cmple(self.loose).bitmask()
    }
}

#[inline]
fn cross(a: &[Vec4; 3], b: &[Vec4; 3]) -> [Vec4; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline]
fn dot(a: &[Vec4; 3], b: &[Vec4; 3]) -> Vec4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Up to [`PACKET`] rays on their way through the tree.
struct Packet {
    groups: [Group; GROUPS],
    used_groups: usize,
    hull: Hull,
    /// Any direction that most rays share: decides which child is nearer.
    heading: Vec3,
    rays: [Option<Sheared>; PACKET],
    /// Length of each direction in the frame.
    lengths: [f64; PACKET],
}

impl Packet {
    /// `None` if no ray reaches the mesh.
    fn new(rays: &[Ray], t_min: f64, t_max: f64, bvh: &Bvh<'_>) -> Option<Self> {
        let mut packet = Packet {
            groups: [Group::IDLE; GROUPS],
            used_groups: rays.len().div_ceil(4),
            hull: Hull {
                origin: [Vec3::INFINITY, Vec3::NEG_INFINITY],
                inverse: [Vec3::INFINITY, Vec3::NEG_INFINITY],
                from: f32::INFINITY,
                bounded: [false; 3],
            },
            heading: Vec3::ZERO,
            rays: [None; PACKET],
            lengths: [0.0; PACKET],
        };
        let mut any = false;
        for (i, ray) in rays.iter().enumerate() {
            let Some(sheared) = Sheared::new(ray, t_min, t_max, &bvh.frame) else { continue };
            any = true;
            packet.add(i, ray.direction, sheared, bvh);
        }
        if !any {
            return None;
        }
        let hull = &mut packet.hull;
        for axis in 0..3 {
            hull.bounded[axis] = hull.inverse[0][axis] > 0.0 || hull.inverse[1][axis] < 0.0;
        }
        Some(packet)
    }

    fn add(&mut self, i: usize, direction: DVec3, sheared: Sheared, bvh: &Bvh<'_>) {
        let length = direction.length();
        let origin = bvh.frame.to_frame(sheared.origin).as_vec3();
        let unit = (direction / length).as_vec3();
        let inverse = unit.map(|d| if d.abs() < FLAT as f32 { (FLAT as f32).copysign(d) } else { d }).recip();
        let length = length * bvh.frame.scale;
        let from = down(sheared.along(sheared.t_min, length));
        let (group, lane) = (&mut self.groups[i / 4], i % 4);
        for axis in 0..3 {
            group.origin[axis][lane] = origin[axis];
            group.direction[axis][lane] = unit[axis];
            group.inverse[axis][lane] = inverse[axis];
        }
        group.from[lane] = from;
        group.to[lane] = up(sheared.along(sheared.t_max, length));
        let hull = &mut self.hull;
        hull.origin = [hull.origin[0].min(origin), hull.origin[1].max(origin)];
        hull.inverse = [hull.inverse[0].min(inverse), hull.inverse[1].max(inverse)];
        hull.from = hull.from.min(from);
        self.heading += unit;
        self.lengths[i] = length;
        self.rays[i] = Some(sheared);
    }

    /// First group from `first` on of which a ray meets the node.
    #[inline]
    fn first_alive(&self, node: &Node, first: usize) -> Option<usize> {
        if self.groups[first].meets(node) != 0 {
            return Some(first);
        }
        if self.hull.misses(node) {
            return None;
        }
        (first + 1..self.used_groups).find(|&g| self.groups[g].meets(node) != 0)
    }

    fn run(&mut self, bvh: &Bvh<'_>, hits: &mut [Option<Hit>]) {
        let mut stack = [(0u32, 0u32); STACK + 1];
        let mut used = 1;
        while used > 0 {
            used -= 1;
            let (index, first) = stack[used];
            let node = &bvh.nodes[index as usize];
            let Some(first) = self.first_alive(node, first as usize) else { continue };
            if node.count > 0 {
                self.leaf(node, first, bvh, hits);
                continue;
            }
            let (left, right) = (index + 1, node.link);
            let [l, r] = [left, right].map(|n| &bvh.nodes[n as usize]);
            let toward_right = (r.lo() + r.hi() - l.lo() - l.hi()).dot(self.heading);
            let (near, far) = if toward_right >= 0.0 { (left, right) } else { (right, left) };
            stack[used] = (far, first as u32);
            stack[used + 1] = (near, first as u32);
            used += 2;
        }
    }

    fn leaf(&mut self, node: &Node, first: usize, bvh: &Bvh<'_>, hits: &mut [Option<Hit>]) {
        let mut alive = [0u32; GROUPS];
        for g in first..self.used_groups {
            alive[g] = self.groups[g].meets(node);
        }
        for slot in node.slots(&bvh.slots) {
            let corners = bvh.corners(slot);
            let filter = Filter::new(corners.map(|p| bvh.frame.to_frame(p)));
            for g in first..self.used_groups {
                if alive[g] == 0 {
                    continue;
                }
                let mut candidates = filter.candidates(&self.groups[g]) & alive[g];
                while candidates != 0 {
                    let lane = candidates.trailing_zeros() as usize;
                    candidates &= candidates - 1;
                    self.decide(4 * g + lane, &corners, slot.triangle, hits);
                }
            }
        }
    }

    #[inline]
    fn decide(&mut self, ray: usize, corners: &[DVec3; 3], triangle: u32, hits: &mut [Option<Hit>]) {
        let Some(sheared) = &self.rays[ray] else { return };
        if let Some(hit) = sheared.meet(corners, triangle)
            && hit.keep_best(&mut hits[ray])
        {
            self.groups[ray / 4].to[ray % 4] = up(sheared.along(hit.t, self.lengths[ray]));
        }
    }
}

/// Rounded down, with room for the rounding of what came before.
fn down(t: f64) -> f32 {
    (t - GROWTH) as f32
}

/// Rounded up, with room for the rounding of what came before.
fn up(t: f64) -> f32 {
    (t + GROWTH) as f32
}

impl Bvh<'_> {
    /// [`Bvh::first_hit`] of many rays. Fastest when rays that follow each other run close together, [`PACKET`] at a time.
    ///
    /// `hits[i]` receives the hit of `rays[i]`, the same as from `first_hit`, to the bit.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn first_hits(&self, rays: &[Ray], t_min: f64, t_max: f64, hits: &mut [Option<Hit>]) {
        assert_eq!(rays.len(), hits.len(), "one hit a ray");
        hits.fill(None);
        if self.nodes.is_empty() {
            return;
        }
        for (rays, hits) in rays.chunks(PACKET).zip(hits.chunks_mut(PACKET)) {
            if let Some(mut packet) = Packet::new(rays, t_min, t_max, self) {
                packet.run(self, hits);
            }
        }
    }
}
