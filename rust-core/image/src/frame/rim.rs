//! The black rim that undistorting an image leaves around it.

use super::ColourImage;

/// Brightest channel of a pixel that counts as black: compression leaves no more on areas of one colour.
const BLACK: u8 = 4;

/// Compression smears the rim's edge over a block of this many pixels.
const SMEARED: usize = 8;

/// Widest rim as a share of the image's side, 1 in so many: what is dark further in is the scene.
const WIDEST: usize = 8;

/// Columns and rows, the first and the one behind, of a part of an image without any of the black rim that surrounds it.
pub fn without_rim(image: &ColourImage) -> [[usize; 2]; 2] {
    if image.pixels.is_empty() { image.size().map(|side| [0, side]) } else { Rim::of(image).inner() }
}

/// Reach of the rim into the image from each end of each row and of each column.
pub(super) struct Rim {
    /// First column inside and first one behind, a row.
    rows: Vec<[usize; 2]>,
    /// First row inside and first one behind, a column.
    cols: Vec<[usize; 2]>,
}

impl Rim {
    /// The rim of an image.
    pub(super) fn of(image: &ColourImage) -> Rim {
        let [cols, rows] = image.size();
        let is_black = |row: usize, col: usize| image.pixels[row * cols + col].iter().all(|&channel| channel <= BLACK);
        let inside = |length: usize, is_black: &dyn Fn(usize) -> bool| {
            let widest = length / WIDEST;
            let run = |from_end: bool| {
                let at = |k: usize| if from_end { length - 1 - k } else { k };
                let black = (0..widest).take_while(|&k| is_black(at(k))).count();
                if black == 0 { 0 } else { black + SMEARED }
            };
            [run(false), length.saturating_sub(run(true))]
        };
        Rim {
            rows: (0..rows).map(|row| inside(cols, &|col| is_black(row, col))).collect(),
            cols: (0..cols).map(|col| inside(rows, &|row| is_black(row, col))).collect(),
        }
    }

    /// Columns and rows, the first and the one behind, of a rectangle that holds no pixel of the rim.
    fn inner(&self) -> [[usize; 2]; 2] {
        // The middle of a border first. The rim is wider at its ends, where the rectangle shrinks.
        let middle = |of: &[[usize; 2]]| of[of.len() / 2];
        let ([mut left, mut right], [mut top, mut bottom]) = (middle(&self.rows), middle(&self.cols));
        loop {
            let holds = |rows: std::ops::Range<usize>, col: usize| rows.into_iter().any(|row| self.holds(row, col));
            let in_row = |row: usize| (left..right).any(|col| self.holds(row, col));
            let [at_left, at_right] = [holds(top..bottom, left), holds(top..bottom, right.saturating_sub(1))];
            let [at_top, at_bottom] = [in_row(top), in_row(bottom.saturating_sub(1))];
            if ![at_left, at_right, at_top, at_bottom].contains(&true) || right - left < 3 || bottom - top < 3 {
                return [[left, right], [top, bottom]];
            }
            left += usize::from(at_left);
            right -= usize::from(at_right);
            top += usize::from(at_top);
            bottom -= usize::from(at_bottom);
        }
    }

    /// Whether a pixel is of the rim.
    pub(super) fn holds(&self, row: usize, col: usize) -> bool {
        let ([left, right], [top, bottom]) = (self.rows[row], self.cols[col]);
        !((left..right).contains(&col) && (top..bottom).contains(&row))
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::frame::Camera;

    /// Theorem: the part without a rim has no black pixel, even if the rim is wider in the corners, and loses little else.
    #[test]
    fn the_inner_part_has_no_rim() {
        let [cols, rows] = [160, 120];
        let is_rim = |col: usize, row: usize| col < 5 || row < 3 || col + row < 20;
        let pixel = |i: usize| if is_rim(i % cols, i / cols) { [0; 3] } else { [90, 100, 110] };
        let camera = Camera::sized([100.0; 2], [80.0, 60.0], [cols, rows]);
        let pixels: Vec<[u8; 3]> = (0..cols * rows).map(pixel).collect();
        let mut image = ColourImage { camera, pixels, colour_from_depth: DAffine3::IDENTITY, black_rim: true };
        let [[left, right], [top, bottom]] = without_rim(&image);
        assert!(!(left..right).any(|col| (top..bottom).any(|row| is_rim(col, row))));
        assert!(left + top < 20 + 3 * SMEARED && right == cols && bottom == rows, "{left} {right} {top} {bottom}");
        image.pixels.fill([9; 3]);
        assert_eq!(without_rim(&image), [[0, cols], [0, rows]]);
        // All is dark: something is left.
        image.pixels.fill([0; 3]);
        let [[left, right], [top, bottom]] = without_rim(&image);
        assert!(left < right && top < bottom);
    }
}
