//! The triangles around each vertex, and where they do not form a single fan.

/// The triangles at each vertex of a list of triangles.
pub(super) struct Corners {
    first: Vec<u32>,
    /// Three times the triangle plus the place of the vertex in it.
    corners: Vec<u32>,
}

impl Corners {
    pub(super) fn new(triangles: &[[u32; 3]], vertices: usize) -> Self {
        let mut first = vec![0_u32; vertices + 2];
        for vertex in triangles.as_flattened() {
            first[*vertex as usize + 2] += 1;
        }
        for v in 2..first.len() {
            first[v] += first[v - 1];
        }
        let mut corners = vec![0; 3 * triangles.len()];
        for (corner, vertex) in triangles.as_flattened().iter().enumerate() {
            let place = &mut first[*vertex as usize + 1];
            corners[*place as usize] = corner as u32;
            *place += 1;
        }
        Corners { first, corners }
    }

    pub(super) fn of(&self, vertex: u32) -> &[u32] {
        &self.corners[self.first[vertex as usize] as usize..self.first[vertex as usize + 1] as usize]
    }

    pub(super) fn vertices(&self) -> u32 {
        self.first.len() as u32 - 2
    }
}

/// The two other vertices of a corner's triangle, in its turn.
fn ends(triangles: &[[u32; 3]], corner: u32) -> [u32; 2] {
    let triangle = triangles[corner as usize / 3];
    let place = corner as usize % 3;
    [triangle[(place + 1) % 3], triangle[(place + 2) % 3]]
}

/// Whether the triangles at a vertex are one fan, open or closed, turning one way. Without triangles they are.
pub(super) fn is_one_fan(triangles: &[[u32; 3]], corners: &[u32]) -> bool {
    let Some(&first) = corners.first() else { return true };
    let from = |vertex: u32| corners.iter().filter(move |&&c| ends(triangles, c)[0] == vertex);
    let to = |vertex: u32| corners.iter().filter(move |&&c| ends(triangles, c)[1] == vertex);
    for &corner in corners {
        let [next, previous] = ends(triangles, corner);
        if from(next).count() > 1 || to(previous).count() > 1 {
            return false;
        }
    }
    let mut count = 1;
    let mut here = ends(triangles, first);
    while let Some(&corner) = from(here[1]).next() {
        if corner == first {
            return count == corners.len();
        }
        here = ends(triangles, corner);
        count += 1;
    }
    let mut here = ends(triangles, first);
    while let Some(&corner) = to(here[0]).next() {
        here = ends(triangles, corner);
        count += 1;
    }
    count == corners.len()
}

/// The fans at a vertex: over an edge of more than two triangles nothing is joined. Each as places in `corners`, the
/// largest first.
fn fans(triangles: &[[u32; 3]], corners: &[u32]) -> Vec<Vec<usize>> {
    let mut left: Vec<usize> = (0..corners.len()).collect();
    let at = |place: usize| ends(triangles, corners[place]);
    let joins = |edge: u32, a: usize, b: usize| {
        let at_edge = (0..corners.len()).filter(|&p| at(p).contains(&edge)).count();
        at_edge == 2 && ((at(a)[0] == edge && at(b)[1] == edge) || (at(a)[1] == edge && at(b)[0] == edge))
    };
    let mut fans: Vec<Vec<usize>> = Vec::new();
    while !left.is_empty() {
        let mut fan = vec![left.remove(0)];
        let mut next = 0;
        while next < fan.len() {
            let here = fan[next];
            next += 1;
            left.retain(|&other| {
                let joined = at(here).into_iter().any(|edge| joins(edge, here, other));
                if joined {
                    fan.push(other);
                }
                !joined
            });
        }
        fans.push(fan);
    }
    fans.sort_by_key(|fan| std::cmp::Reverse(fan.len()));
    fans
}

/// Removes triangles until those at each vertex are one fan; `key` orders triangles where fans are equally large, the
/// smaller stays. Returns how many were removed.
pub(super) fn keep_largest(triangles: &mut Vec<[u32; 3]>, vertices: usize, key: impl Fn([u32; 3]) -> f64) -> usize {
    let before = triangles.len();
    loop {
        let corners = Corners::new(triangles, vertices);
        let mut removed = vec![false; triangles.len()];
        let mut any = false;
        for vertex in 0..corners.vertices() {
            let around = corners.of(vertex);
            if is_one_fan(triangles, around) {
                continue;
            }
            let mut fans = fans(triangles, around);
            let worth = |fan: &Vec<usize>| {
                let mut keys: Vec<f64> = fan.iter().map(|&p| key(triangles[around[p] as usize / 3])).collect();
                keys.sort_unstable_by(f64::total_cmp);
                keys
            };
            fans.sort_by(|a, b| {
                let (x, y) = (worth(a), worth(b));
                b.len().cmp(&a.len()).then_with(|| x.partial_cmp(&y).unwrap_or(std::cmp::Ordering::Equal))
            });
            for place in fans.iter().skip(1).flatten() {
                removed[around[*place] as usize / 3] = true;
                any = true;
            }
        }
        if !any {
            return before - triangles.len();
        }
        let mut index = 0;
        triangles.retain(|_| {
            index += 1;
            !removed[index - 1]
        });
    }
}
