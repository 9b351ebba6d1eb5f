//! Stage 2, initial removal: details of one scan that are finer than a cell. [MI04, sec. 3.2]

use super::bundles::Crossing;

/// Drops pairs of crossings of the same scan, with opposite signs, on the same cell edge (the paper's condition, read as
/// `floor(ic1) = floor(ic2)`). `line` is sorted along the line.
pub fn remove_fine_details(line: &mut Vec<Crossing>) {
    let mut i = 0;
    while i + 1 < line.len() {
        let partner = (i + 1..line.len())
            .take_while(|&j| line[j].cell == line[i].cell)
            .find(|&j| line[j].scan() == line[i].scan() && line[j].enters() != line[i].enters());
        match partner {
            Some(j) => {
                line.remove(j);
                line.remove(i);
                // An earlier crossing of the cell may now have found its partner.
                while i > 0 && i < line.len() && line[i - 1].cell == line[i].cell {
                    i -= 1;
                }
            }
            None => i += 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crossing(scan: u32, at: f64, sign: f32) -> Crossing {
        Crossing::new(0, scan, at.floor() as i32, at.fract() as f32, sign, 1.0, [255; 4])
    }

    #[test]
    fn removes_pairs_of_one_scan_on_one_edge_only() {
        let mut line = vec![
            crossing(0, 1.1, 1.0),
            crossing(1, 1.2, -1.0),
            crossing(0, 1.3, -1.0),
            crossing(0, 2.1, 1.0),
            crossing(0, 3.1, -1.0),
        ];
        remove_fine_details(&mut line);
        let left: Vec<_> = line.iter().map(|c| (c.scan(), c.cell)).collect();
        assert_eq!(left, [(1, 1), (0, 2), (0, 3)]);
    }

    #[test]
    fn an_odd_crossing_keeps_its_sign() {
        let mut line: Vec<_> = [1.0, -1.0, 1.0, -1.0, 1.0].iter().map(|&s| crossing(3, 0.5, s)).collect();
        remove_fine_details(&mut line);
        assert_eq!(line.len(), 1);
        assert!(!line[0].enters());
    }
}
