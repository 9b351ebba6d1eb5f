//! The black rim that undistorting an image leaves around it.

use super::ColourImage;

/// Brightest channel of a pixel that counts as black: compression leaves no more on areas of one colour.
const BLACK: u8 = 4;

/// Compression smears the rim's edge over a block of this many pixels.
const SMEARED: usize = 8;

/// Widest rim as a share of the image's side, 1 in so many: what is dark further in is the scene.
const WIDEST: usize = 8;

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

    /// Whether a pixel is of the rim.
    pub(super) fn holds(&self, row: usize, col: usize) -> bool {
        let ([left, right], [top, bottom]) = (self.rows[row], self.cols[col]);
        !((left..right).contains(&col) && (top..bottom).contains(&row))
    }
}
