//! Whole places in rows along x, to be found by their coordinates.

/// No place.
pub const NONE: u32 = u32::MAX;

/// Places with whole coordinates, rising with x fastest. Memory: 12 bytes per place and 4 per row of their box.
pub struct Rows {
    /// Coordinates are below these.
    counts: [u32; 3],
    places: Vec<[u32; 3]>,
    /// The first place of each row, and the end of the last one.
    starts: Vec<u32>,
}

impl Rows {
    /// Of rising places below `counts`.
    pub fn new(counts: [u32; 3], places: Vec<[u32; 3]>) -> Self {
        let rows = counts[1] as usize * counts[2] as usize;
        let mut starts = vec![0; rows + 1];
        for &[_, j, k] in &places {
            starts[j as usize + counts[1] as usize * k as usize + 1] += 1;
        }
        for row in 0..rows {
            starts[row + 1] += starts[row];
        }
        Rows { counts, places, starts }
    }

    pub fn places(&self) -> &[[u32; 3]] {
        &self.places
    }

    /// Numbers of the places of a row.
    pub fn row(&self, j: u32, k: u32) -> std::ops::Range<usize> {
        let row = j as usize + self.counts[1] as usize * k as usize;
        self.starts[row] as usize..self.starts[row + 1] as usize
    }

    /// Number of a place, or [`NONE`].
    pub fn find(&self, [i, j, k]: [u32; 3]) -> u32 {
        if i >= self.counts[0] || j >= self.counts[1] || k >= self.counts[2] {
            return NONE;
        }
        let row = self.row(j, k);
        let places = &self.places[row.clone()];
        let Some(first) = places.first().filter(|first| first[0] <= i) else { return NONE };
        // There is at most one place per step along x.
        let most = ((i - first[0]) as usize).min(places.len() - 1);
        let at = match places[most][0] == i {
            true => most,
            false => places[..most].partition_point(|place| place[0] < i),
        };
        if places[at][0] == i { (row.start + at) as u32 } else { NONE }
    }

    /// Numbers of the places beside each place: -x, +x, -y, +y, -z, +z.
    pub fn neighbours(&self) -> Vec<[u32; 6]> {
        let beside = |number: usize, to: usize, by: u32| match self.places.get(to) {
            Some(&[i, j, k]) if self.places[number] == [i.wrapping_add(by), j, k] => to as u32,
            _ => NONE,
        };
        let of = |(number, &[i, j, k]): (usize, &[u32; 3])| {
            [
                beside(number, number.wrapping_sub(1), 1),
                beside(number, number + 1, u32::MAX),
                self.find([i, j.wrapping_sub(1), k]),
                self.find([i, j + 1, k]),
                self.find([i, j, k.wrapping_sub(1)]),
                self.find([i, j, k + 1]),
            ]
        };
        self.places.iter().enumerate().map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every third place or so of a box, looked up in all ways.
    #[test]
    fn places_are_found_as_in_a_list() {
        let counts = [9, 7, 5];
        let all = (0..5).flat_map(|k| (0..7).flat_map(move |j| (0..9).map(move |i| [i, j, k])));
        let places: Vec<[u32; 3]> = all.clone().filter(|[i, j, k]| (i * 7 + j * 5 + k * 11) % 8 < 3).collect();
        let rows = Rows::new(counts, places.clone());
        let listed = |place: [u32; 3]| places.iter().position(|&p| p == place).map_or(NONE, |at| at as u32);
        for place in all {
            assert_eq!(rows.find(place), listed(place), "{place:?}");
        }
        assert_eq!([rows.find([9, 0, 0]), rows.find([0, 7, 0]), rows.find([u32::MAX, 0, 0])], [NONE; 3]);
        for (&[i, j, k], beside) in places.iter().zip(rows.neighbours()) {
            let sides: [[u32; 3]; 6] = [
                [i.wrapping_sub(1), j, k],
                [i + 1, j, k],
                [i, j.wrapping_sub(1), k],
                [i, j + 1, k],
                [i, j, k.wrapping_sub(1)],
                [i, j, k + 1],
            ];
            assert_eq!(beside, sides.map(listed));
        }
    }
}
