//! A loop triangulated over its own vertices, of triangles that are clear of everything else: of all such triangulations that of least area.

use glam::DVec3;

use base::error::Result;
use base::progress::{Pace, Progress};
use geom::triangles::cross;

use super::surface::normal;

/// Loops of more edges are not tried: the number of their triangles is cubic.
const MOST_EDGES: usize = 40;

/// Triangles over the places of a loop, running through its edges forward. `may_connect` is asked for pairs that are no edge of the loop,
/// the smaller first, `is_clear` for triangles by their corners, rising. `None` if there are none, or if those of least area cross each
/// other.
///
/// # Errors
/// [`base::Error::Cancelled`], or what `is_clear` gives.
pub fn triangulate(
    places: &[DVec3],
    may_connect: impl Fn(usize, usize) -> bool,
    mut is_clear: impl FnMut([usize; 3]) -> Result<bool>,
    progress: &Progress<'_>,
) -> Result<Option<Vec<[usize; 3]>>> {
    let n = places.len();
    if !(3..=MOST_EDGES).contains(&n) {
        return Ok(None);
    }
    let corners = |t: [usize; 3]| t.map(|v| places[v]);
    // Of each chain from i to j, closed by the edge between them: the least area, and the corner between. Infinite where there is none.
    let mut best = vec![(f64::INFINITY, 0); n * n];
    (0..n - 1).for_each(|i| best[i * n + i + 1].0 = 0.0);
    let mut pace = Pace::new(progress);
    for span in 2..n {
        for i in 0..n - span {
            let j = i + span;
            if span < n - 1 && !may_connect(i, j) {
                continue;
            }
            for middle in i + 1..j {
                let triangle = [i, middle, j];
                let [a, b, c] = corners(triangle);
                let own = 0.5 * (b - a).cross(c - a).length();
                let area = best[i * n + middle].0 + best[middle * n + j].0 + own;
                if area < best[i * n + j].0 && normal([a, b, c]) != DVec3::ZERO {
                    pace.after(16)?;
                    if is_clear(triangle)? {
                        best[i * n + j] = (area, middle);
                    }
                }
            }
        }
    }
    if best[n - 1].0 == f64::INFINITY {
        return Ok(None);
    }
    let (mut left, mut triangles) = (vec![(0, n - 1)], Vec::with_capacity(n - 2));
    while let Some((i, j)) = left.pop() {
        if j > i + 1 {
            let middle = best[i * n + j].1;
            triangles.push([i, middle, j]);
            left.extend([(middle, j), (i, middle)]);
        }
    }
    for (i, &triangle) in triangles.iter().enumerate() {
        pace.after(triangles.len())?;
        if triangles[..i].iter().any(|&other| cross(corners(triangle), corners(other))) {
            return Ok(None);
        }
    }
    Ok(Some(triangles))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A loop along a square of about 5 x 5 with one corner bent up.
    fn places() -> Vec<DVec3> {
        let flat = [[0.0, 0.0], [2.0, 0.0], [5.0, 0.0], [5.5, 3.0], [5.0, 5.0], [0.0, 5.0]];
        flat.map(|[x, y]| DVec3::new(x, y, if x == 2.0 { 0.5 } else { 0.0 })).to_vec()
    }

    fn area(triangles: &[[usize; 3]]) -> f64 {
        let places = places();
        triangles.iter().map(|t| t.map(|v| places[v])).map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
    }

    /// All triangulations of a chain.
    fn all(i: usize, j: usize) -> Vec<Vec<[usize; 3]>> {
        if j == i + 1 {
            return vec![Vec::new()];
        }
        let with = |middle: usize| {
            let right = all(middle, j);
            let both = move |left: Vec<[usize; 3]>| {
                right.iter().map(|right| [&left[..], right, &[[i, middle, j]]].concat()).collect::<Vec<_>>()
            };
            all(i, middle).into_iter().flat_map(both).collect::<Vec<_>>()
        };
        (i + 1..j).flat_map(with).collect()
    }

    #[test]
    fn of_all_that_are_clear_the_least_area_is_taken() {
        let places = places();
        let candidates = all(0, 5);
        assert_eq!(candidates.len(), 14);
        // Any one triangle in the way, and any one pair connected already.
        let triangles: Vec<[usize; 3]> =
            (0..6).flat_map(|a| (a + 1..6).flat_map(move |b| (b + 1..6).map(move |c| [a, b, c]))).collect();
        for &barred in &triangles {
            for taken in [[0, 2], [1, 3], [1, 4], [0, 3], [2, 4]] {
                let found =
                    triangulate(&places, |a, b| [a, b] != taken, |t| Ok(t != barred), &Progress::none()).unwrap();
                let is_allowed = |t: &[usize; 3]| *t != barred && !(t.contains(&taken[0]) && t.contains(&taken[1]));
                let least = candidates.iter().filter(|c| c.iter().all(is_allowed)).map(|c| area(c));
                let least = least.fold(f64::INFINITY, f64::min);
                let found = found.unwrap();
                assert!(
                    found.iter().all(is_allowed) && area(&found) < least + 1e-9,
                    "{found:?}, {barred:?}, {taken:?}"
                );
            }
        }
        assert_eq!(triangulate(&places, |_, _| false, |_| Ok(true), &Progress::none()).unwrap(), None);
    }
}
