//! Marching tetrahedra on the body-centred lattice, then a few steps that even out the triangles. \[Bloomenthal94\]
//!
//! All tetrahedra are congruent and nearly regular, and the surface in each depends on its four signs alone, so the result
//! is a closed oriented manifold whatever the field. Only blocks that the surface can reach are looked at.
//!
//! Lattice points have doubled coordinates: all even for the corners of the cubes, all odd for their centres. A
//! tetrahedron has two centres of cubes that share a side, and two neighbouring corners of that side.

use glam::{DVec3, IVec3};
use rayon::prelude::*;

use base::error::Result;
use base::progress::{Plan, Progress};
use mesh::TriMesh;

/// Cubes along the edge of a block.
const BLOCK: i32 = 8;
/// Rounds of evening out.
const ROUNDS: usize = 3;

/// A field that is polygonized: negative inside, and no larger than [`Field::STEEPEST`] times the distance from its surface.
pub(super) trait Field: Sync {
    /// Largest ratio of the value to the distance from the surface.
    const STEEPEST: f64;

    fn value(&self, p: DVec3) -> f64;
}

/// Stages with their shares of the time. The last is the caller's.
pub(super) const PLAN: Plan = &[("marching", 0.3), ("placing vertices", 0.2), ("evening out", 0.4), ("colouring", 0.1)];

/// Vertices between two looks at the progress: fields take microseconds per place.
const CHUNK: usize = 1 << 8;

/// The results of `of` for each, in their order.
pub(super) fn in_parallel<T: Sync, R: Send>(
    all: &[T],
    of: impl Fn(&T) -> R + Sync,
    progress: &Progress<'_>,
) -> Result<Vec<R>> {
    let chunks = all.par_chunks(CHUNK).map(|some| progress.check().map(|()| some.iter().map(&of).collect::<Vec<_>>()));
    Ok(chunks.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect())
}

/// The surface of the field between `lo` and `hi`, cubes of edge `cell`. The field must be positive on the border.
pub(super) fn polygonize<F: Field>(
    field: &F,
    lo: DVec3,
    hi: DVec3,
    cell: f64,
    progress: &Progress<'_>,
) -> Result<TriMesh> {
    let lattice = Lattice { lo, half: 0.5 * cell };
    let blocks = ((hi - lo) / (cell * f64::from(BLOCK))).ceil().as_ivec3();
    let count = blocks.x * blocks.y * blocks.z;
    progress.stage(0, count as u64);
    let pieces: Vec<Vec<[u64; 3]>> = (0..count)
        .into_par_iter()
        .map(|b| {
            let block = IVec3::new(b % blocks.x, b / blocks.x % blocks.y, b / blocks.x / blocks.y);
            let piece = march(field, &lattice, block * BLOCK);
            progress.advance(1).map(|()| piece)
        })
        .collect::<Result<_>>()?;
    progress.stage(1, 1);
    let corners: Vec<[u64; 3]> = pieces.concat();
    let mut edges: Vec<u64> = corners.as_flattened().to_vec();
    edges.par_sort_unstable();
    edges.dedup();
    let positions = in_parallel(&edges, |&e| lattice.crossing(field, e), progress)?;
    let index = |e: u64| edges.binary_search(&e).expect("every edge was collected") as u32;
    let triangles = in_parallel(&corners, |t| t.map(index), progress)?;
    let mut mesh = largest_part(TriMesh::new(positions, triangles));
    progress.stage(2, ROUNDS as u64);
    for _ in 0..ROUNDS {
        even_out(field, &mut mesh, cell, progress)?;
        progress.advance(1)?;
    }
    progress.stage(3, 1);
    Ok(mesh)
}

/// The part with the most triangles, the first of several: without closed cavities and specks that stray from the lattice.
fn largest_part(mesh: TriMesh) -> TriMesh {
    let mut parent: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    fn root(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            parent[v as usize] = parent[parent[v as usize] as usize];
            v = parent[v as usize];
        }
        v
    }
    for t in &mesh.triangles {
        for k in 0..3 {
            let (a, b) = (root(&mut parent, t[k]), root(&mut parent, t[(k + 1) % 3]));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    let mut sizes = vec![0usize; mesh.positions.len()];
    for t in &mesh.triangles {
        sizes[root(&mut parent, t[0]) as usize] += 1;
    }
    let largest = (0..sizes.len()).fold(0, |best, v| if sizes[v] > sizes[best] { v } else { best }) as u32;
    let mut kept = TriMesh::default();
    let mut index = vec![u32::MAX; mesh.positions.len()];
    for v in 0..mesh.positions.len() {
        if root(&mut parent, v as u32) == largest {
            index[v] = kept.positions.len() as u32;
            kept.positions.push(mesh.positions[v]);
        }
    }
    kept.triangles = mesh.triangles.iter().map(|t| t.map(|v| index[v as usize])).filter(|t| t[0] != u32::MAX).collect();
    kept
}

struct Lattice {
    lo: DVec3,
    /// World length of one doubled coordinate.
    half: f64,
}

impl Lattice {
    fn place(&self, point: IVec3) -> DVec3 {
        self.lo + point.as_dvec3() * self.half
    }

    /// The place on the edge where the field crosses zero. Not at its ends, so that no triangle collapses.
    fn crossing<F: Field>(&self, field: &F, edge: u64) -> DVec3 {
        let (a, b) = (self.place(unpack((edge >> 32) as u32)), self.place(unpack(edge as u32)));
        let (fa, fb) = (field.value(a), field.value(b));
        a.lerp(b, (fa / (fa - fb)).clamp(0.05, 0.95))
    }
}

/// Doubled coordinates below 1024 in one word, in an order that has neighbours near each other.
fn pack(p: IVec3) -> u32 {
    (p.z as u32) << 20 | (p.y as u32) << 10 | p.x as u32
}

fn unpack(p: u32) -> IVec3 {
    IVec3::new((p & 1023) as i32, (p >> 10 & 1023) as i32, (p >> 20) as i32)
}

fn edge(a: IVec3, b: IVec3) -> u64 {
    let (a, b) = (pack(a), pack(b));
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

/// Triangles of the block of cubes from `first` on. Their corners are edges of the lattice.
fn march<F: Field>(field: &F, lattice: &Lattice, first: IVec3) -> Vec<[u64; 3]> {
    let mut out = Vec::new();
    let middle = lattice.place(2 * first + BLOCK + 1);
    // The block reaches one cube further than its own: to the centres beyond its sides.
    let reach = f64::from(BLOCK + 1) * lattice.half * 3f64.sqrt();
    if field.value(middle).abs() > reach * F::STEEPEST {
        return out;
    }
    let n = (BLOCK + 1) as usize;
    let at = |i: IVec3| (i.z as usize * n + i.y as usize) * n + i.x as usize;
    let mut inside = [vec![false; n * n * n], vec![false; n * n * n]];
    // By twos each way: far from the surface the value in the middle tells all 16 signs.
    let within = 1.5 * lattice.half * 3f64.sqrt() * F::STEEPEST;
    for z in (0..n).step_by(2) {
        for y in (0..n).step_by(2) {
            for x in (0..n).step_by(2) {
                let corner = IVec3::new(x as i32, y as i32, z as i32);
                let middle = field.value(lattice.place(2 * (first + corner)) + 1.5 * lattice.half);
                for k in 0..16 {
                    let i = corner + IVec3::new(k & 1, k >> 1 & 1, k >> 2 & 1);
                    let odd = k >> 3;
                    if i.max_element() < n as i32 {
                        inside[odd as usize][at(i)] = if middle.abs() > within {
                            middle < 0.0
                        } else {
                            field.value(lattice.place(2 * (first + i) + odd)) < 0.0
                        };
                    }
                }
            }
        }
    }
    let is_inside = |p: IVec3| inside[(p.x & 1) as usize][at(p / 2 - first)];
    for z in 0..BLOCK {
        for y in 0..BLOCK {
            for x in 0..BLOCK {
                let centre = 2 * (first + IVec3::new(x, y, z)) + 1;
                for axis in 0..3 {
                    let step = |k: usize| IVec3::AXES[(axis + k) % 3];
                    let side = centre + step(0);
                    // Corners of the side, counter-clockwise about the axis.
                    let [u, v] = [step(1), step(2)];
                    let ring = [side + u + v, side - u + v, side - u - v, side + u - v];
                    for k in 0..4 {
                        let tet = [centre, centre + 2 * step(0), ring[k], ring[(k + 1) % 4]];
                        tetrahedron(tet, tet.map(is_inside), &mut out);
                    }
                }
            }
        }
    }
    out
}

/// The surface in one tetrahedron `(a, b, c, d)` with `det(b - a, c - a, d - a) > 0`, facing outward.
fn tetrahedron(tet: [IVec3; 4], inside: [bool; 4], out: &mut Vec<[u64; 3]>) {
    // Even permutations that bring the corners inside, or the only one outside, to the front.
    const SINGLE: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 0, 1, 3], [3, 0, 2, 1]];
    const PAIRS: [[usize; 4]; 6] = [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]];
    let between = |i: usize, j: usize| edge(tet[i], tet[j]);
    match inside.iter().filter(|&&i| i).count() {
        count @ (1 | 3) => {
            let alone = inside.iter().position(|&i| i == (count == 1)).expect("one differs");
            let [a, b, c, d] = SINGLE[alone];
            let (second, third) = if count == 1 { (c, d) } else { (d, c) };
            out.push([between(a, b), between(a, second), between(a, third)]);
        }
        2 => {
            let [a, b, c, d] = *PAIRS.iter().find(|p| inside[p[0]] && inside[p[1]]).expect("a pair is inside");
            let quad = [between(a, c), between(a, d), between(b, d), between(b, c)];
            out.push([quad[0], quad[1], quad[2]]);
            out.push([quad[0], quad[2], quad[3]]);
        }
        _ => {}
    }
}

/// Moves every vertex half the way to the mean of its neighbours, along the surface, and back onto the surface.
fn even_out<F: Field>(field: &F, mesh: &mut TriMesh, cell: f64, progress: &Progress<'_>) -> Result<()> {
    // Sum and number of the neighbours, and the normal by area.
    let mut stars = vec![(DVec3::ZERO, 0.0, DVec3::ZERO); mesh.positions.len()];
    for t in 0..mesh.triangles.len() {
        let corners = mesh.corners(t);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        for k in 0..3 {
            // Each neighbour is met in two triangles.
            let star = &mut stars[mesh.triangles[t][k] as usize];
            *star = (star.0 + corners[(k + 1) % 3] + corners[(k + 2) % 3], star.1 + 2.0, star.2 + normal);
        }
    }
    let chunks = mesh.positions.par_chunks_mut(CHUNK).zip(stars.par_chunks(CHUNK));
    chunks.try_for_each(|(positions, stars)| {
        for (p, &(sum, count, normal)) in positions.iter_mut().zip(stars) {
            let normal = normal.normalize_or_zero();
            let way = (sum / count - *p) * 0.5;
            let moved = *p + (way - normal * way.dot(normal));
            let reach = 0.25 * cell;
            // One step as if the field were a distance, then one by the slope that it shows.
            let first = field.value(moved);
            let step = first.clamp(-reach, reach);
            let second = field.value(moved - normal * step);
            let slope = (first - second) / step;
            let more = if slope > 0.3 { (second / slope).clamp(-reach, reach) } else { 0.0 };
            *p = moved - normal * (step + more);
        }
        progress.check()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes::Shape;

    impl Field for Shape {
        const STEEPEST: f64 = 1.0;

        fn value(&self, p: DVec3) -> f64 {
            self.distance(p)
        }
    }

    #[test]
    fn the_surface_is_closed_outward_and_on_the_field() {
        for shape in [Shape::Sphere { radius: 1.0 }, Shape::Torus { major: 0.8, minor: 0.2 }] {
            let mesh = polygonize(&shape, DVec3::splat(-1.3), DVec3::splat(1.3), 0.07, &Progress::none()).unwrap();
            let report = mesh::check(&mesh);
            assert!(report.is_closed() && report.components == 1, "{report}");
            assert_eq!(report.genus(), Some(i64::from(matches!(shape, Shape::Torus { .. }))));
            assert!(mesh::measure::enclosed_volume(&mesh) > 0.0);
            assert!(mesh.positions.iter().all(|&p| shape.distance(p).abs() < 1e-3));
            let quality = mesh::measure::quality(&mesh);
            assert!(quality.mean_smallest_angle > 0.6 && quality.smallest_angle > 0.05, "{quality:?}");
        }
    }
}
