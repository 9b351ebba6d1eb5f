//! Triangles whose corners are seen on a line are removed. The one beyond their longest edge is cut in two (section 3.5).

use std::collections::BTreeMap;

/// The mesh without triangles seen edge-on. Where two of them share their longest edges they both go as they are.
pub(super) fn remove(triangles: Vec<[u32; 3]>, cols: u32) -> Vec<[u32; 3]> {
    let place = |p: u32| (i64::from(p % cols), i64::from(p / cols));
    let is_flat = |[a, b, c]: [u32; 3]| {
        let ((ax, ay), (bx, by), (cx, cy)) = (place(a), place(b), place(c));
        (bx - ax) * (cy - ay) == (by - ay) * (cx - ax)
    };
    // Flat triangles turned so that the middle corner comes second.
    let middle_second = |[a, b, c]: [u32; 3]| {
        let length = |p: u32, q: u32| {
            let ((px, py), (qx, qy)) = (place(p), place(q));
            (px - qx).pow(2) + (py - qy).pow(2)
        };
        if length(a, c) >= length(a, b).max(length(b, c)) {
            [a, b, c]
        } else if length(a, b) >= length(b, c) {
            [b, c, a]
        } else {
            [c, a, b]
        }
    };
    let (mut flat, mut mesh): (Vec<_>, Vec<_>) = triangles.into_iter().partition(|&t| is_flat(t));
    flat.iter_mut().for_each(|t| *t = middle_second(*t));
    let mut edges: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    let note = |edges: &mut BTreeMap<(u32, u32), u32>, [a, b, c]: [u32; 3], t: u32| {
        for edge in [(a, b), (b, c), (c, a)] {
            edges.insert(edge, t);
        }
    };
    for (t, &triangle) in mesh.iter().enumerate() {
        note(&mut edges, triangle, t as u32);
    }
    // A flat triangle may wait for the one beyond another to be cut: rounds until nothing changes.
    loop {
        let before = flat.len();
        flat.retain(|&[a, b, c]| {
            // Its longest edge runs from c to a: the neighbour has it the other way.
            let Some(t) = edges.remove(&(a, c)) else { return true };
            let [u, v, w] = mesh[t as usize];
            let d = [u, v, w].into_iter().find(|&p| p != a && p != c).unwrap_or(u);
            let halves = [[a, b, d], [b, c, d]];
            mesh[t as usize] = halves[0];
            mesh.push(halves[1]);
            note(&mut edges, halves[0], t);
            note(&mut edges, halves[1], mesh.len() as u32 - 1);
            false
        });
        if flat.len() == before {
            break;
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangle_beyond_is_cut_in_two() {
        // Pixels of a row of ten: 0 and 4 with 2 between, and 14 below.
        let cut = remove(vec![[0, 4, 14], [2, 4, 0]], 10);
        assert_eq!(cut.len(), 2);
        for [a, b, c] in cut {
            assert!([a, b, c].contains(&2) && [a, b, c].contains(&14));
        }
    }

    #[test]
    fn chains_of_flat_triangles_go_as_well() {
        // 1 between 0 and 2, which lie between 0 and 4.
        let cut = remove(vec![[1, 2, 0], [0, 4, 14], [2, 4, 0]], 10);
        assert_eq!(cut.len(), 3);
    }
}
