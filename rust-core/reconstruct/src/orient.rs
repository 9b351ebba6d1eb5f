//! The side of each part of the surface that is shown: outwards, or as normals or sensors say.

use glam::DVec3;

use base::error::Result;
use base::progress::Progress;

/// Sources that tell the outside.
pub(super) enum Witness<'a> {
    /// Nothing: what divides inside from outside looks outwards already, other parts turn away from their middle.
    None,
    /// The direction in which each vertex was seen from, or its normal. Zero if there is neither.
    Fronts(&'a dyn Fn(u32) -> DVec3),
}

/// Turns the parts of a surface, those joined over edges, that the witness sees from behind. Returns how many.
pub(super) fn orient(
    points: &[DVec3],
    triangles: &mut [[u32; 3]],
    is_outward: bool,
    witness: &Witness<'_>,
    progress: &Progress<'_>,
) -> Result<usize> {
    if is_outward && matches!(witness, Witness::None) {
        return Ok(0);
    }
    let (part, count) = parts(points.len(), triangles, progress)?;
    let mut votes = vec![0.0_f64; count];
    let mut middles = vec![(DVec3::ZERO, 0.0_f64); count];
    for range in progress.ranges(triangles.len()) {
        let range = range?;
        for (triangle, &part) in triangles[range.clone()].iter().zip(&part[range]) {
            let [a, b, c] = triangle.map(|v| points[v as usize]);
            let area = (b - a).cross(c - a).length();
            middles[part as usize].0 += (a + b + c) * area;
            middles[part as usize].1 += 3.0 * area;
        }
    }
    for range in progress.ranges(triangles.len()) {
        let range = range?;
        for (triangle, &part) in triangles[range.clone()].iter().zip(&part[range]) {
            let [a, b, c] = triangle.map(|v| points[v as usize]);
            let normal = (b - a).cross(c - a);
            votes[part as usize] += match witness {
                Witness::Fronts(of) => triangle.iter().map(|&v| normal.dot(of(v))).sum(),
                Witness::None => {
                    let (sum, weight) = middles[part as usize];
                    normal.dot(((a + b + c) / 3.0 - sum / weight.max(f64::MIN_POSITIVE)).normalize_or_zero())
                }
            };
        }
    }
    if matches!(witness, Witness::None) {
        // A sheet turns as much towards its middle as away from it: then up counts.
        let mut up = vec![(0.0_f64, 0.0_f64); count];
        for (triangle, &part) in triangles.iter().zip(&part) {
            let [a, b, c] = triangle.map(|v| points[v as usize]);
            let normal = (b - a).cross(c - a);
            up[part as usize].0 += normal.z;
            up[part as usize].1 += normal.length();
        }
        for (vote, (up, area)) in votes.iter_mut().zip(up) {
            if up.abs() > 0.5 * area {
                *vote = up;
            }
        }
    }
    for (triangle, &part) in triangles.iter_mut().zip(&part) {
        if votes[part as usize] < 0.0 {
            triangle.swap(1, 2);
        }
    }
    Ok(votes.iter().filter(|vote| **vote < 0.0).count())
}

/// The part of each triangle, and how many parts there are. Triangles with a common vertex are of one part: on a manifold
/// these are the ones joined over edges.
fn parts(vertices: usize, triangles: &[[u32; 3]], progress: &Progress<'_>) -> Result<(Vec<u32>, usize)> {
    let mut parents: Vec<u32> = (0..vertices as u32).collect();
    fn root(parents: &mut [u32], mut v: u32) -> u32 {
        while parents[v as usize] != v {
            parents[v as usize] = parents[parents[v as usize] as usize];
            v = parents[v as usize];
        }
        v
    }
    for block in progress.blocks(triangles) {
        for &[a, b, c] in block? {
            for other in [b, c] {
                let (x, y) = (root(&mut parents, a), root(&mut parents, other));
                parents[x.max(y) as usize] = x.min(y);
            }
        }
    }
    let mut number = vec![u32::MAX; vertices];
    let mut count = 0;
    let part = triangles
        .iter()
        .map(|triangle| {
            let place = root(&mut parents, triangle[0]) as usize;
            if number[place] == u32::MAX {
                number[place] = count;
                count += 1;
            }
            number[place]
        })
        .collect();
    progress.check()?;
    Ok((part, count as usize))
}
