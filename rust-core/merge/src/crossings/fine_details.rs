//! Stage 2, initial removal: details of one scan that are finer than a cell. [MI04, sec. 3.2]

use std::collections::VecDeque;

use super::crossing::Crossing;

/// Drops pairs of crossings of the same scan, with opposite signs, on the same cell edge (the paper's condition, read as
/// `floor(ic1) = floor(ic2)`). `line` is sorted along the line. O(n log n).
pub fn remove_fine_details(line: &mut Vec<Crossing>) {
    let mut gone: Vec<usize> = Vec::new();
    let mut start = 0;
    while start < line.len() {
        let end = start + line[start..].iter().take_while(|c| c.cell == line[start].cell).count();
        if line[start..end].iter().any(|c| c.enters() != line[start].enters()) {
            let mut by_scan: Vec<usize> = (start..end).collect();
            by_scan.sort_by_key(|&i| line[i].scan());
            for of_scan in by_scan.chunk_by(|&a, &b| line[a].scan() == line[b].scan()) {
                // Those without a partner yet, all of one sign: each pairs with the first of the other sign that follows.
                let mut single: VecDeque<usize> = VecDeque::new();
                for &i in of_scan {
                    match single.front() {
                        Some(&first) if line[first].enters() != line[i].enters() => {
                            single.pop_front();
                            gone.extend([first, i]);
                        }
                        _ => single.push_back(i),
                    }
                }
            }
        }
        start = end;
    }
    if gone.is_empty() {
        return;
    }
    gone.sort_unstable();
    let (mut at, mut next) = (0, gone.into_iter().peekable());
    line.retain(|_| {
        let keep = next.next_if_eq(&at).is_none();
        at += 1;
        keep
    });
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
