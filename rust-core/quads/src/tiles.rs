//! Stage 3: V x H tiles that share a line of pixels. \[GSB97, sec. 2.2\]

use base::error::{Error, Result};

/// The tiles and the vertices each of them gets.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout {
    /// Pixel rows on the tiles' borders: 0, ..., the last row. Strictly rising.
    pub row_lines: Vec<usize>,
    /// Pixel columns on the tiles' borders.
    pub col_lines: Vec<usize>,
    /// Steps from vertex to vertex down a tile.
    pub steps_down: usize,
    /// Steps from vertex to vertex across a tile.
    pub steps_across: usize,
}

/// The pixel nearest to the `i`-th of `parts` equal parts of 0..=`last`. The earlier one of two.
pub(super) fn evenly(i: usize, parts: usize, last: usize) -> usize {
    let (i, parts, last) = (i as u128, parts as u128, last as u128);
    // Rounds halves down.
    ((2 * i * last + parts - 1) / (2 * parts)) as usize
}

impl Layout {
    /// Tiles of an image of `pixels` = [rows, columns], with `vertices` along each side of a tile.
    ///
    /// # Errors
    /// [`Error::Input`] if the image has too few pixels for every vertex to have its own.
    pub fn new(pixels: [usize; 2], tiles: [usize; 2], vertices: [usize; 2]) -> Result<Self> {
        let side = |axis: usize| {
            let (line, per_tile) = [("rows", "tiles_down"), ("columns", "tiles_across")][axis];
            let wanted = (vertices[axis] - 1).checked_mul(tiles[axis]);
            match wanted {
                Some(steps) if steps < pixels[axis] => {
                    Ok((0..=tiles[axis]).map(|i| evenly(i, tiles[axis], pixels[axis] - 1)).collect())
                }
                _ => Err(Error::input(format!(
                    "{} {line} a tile in {} tiles need {} {line} of pixels, but the image has {}: ask for fewer {line} or a \
                     smaller {per_tile}",
                    vertices[axis],
                    tiles[axis],
                    wanted.map_or("too many".to_owned(), |w| (w + 1).to_string()),
                    pixels[axis]
                ))),
            }
        };
        Ok(Layout {
            row_lines: side(0)?,
            col_lines: side(1)?,
            steps_down: vertices[0] - 1,
            steps_across: vertices[1] - 1,
        })
    }

    /// Rows of vertices of the whole grid.
    pub fn rows(&self) -> usize {
        self.steps_down * (self.row_lines.len() - 1) + 1
    }

    /// Columns of vertices of the whole grid.
    pub fn cols(&self) -> usize {
        self.steps_across * (self.col_lines.len() - 1) + 1
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn lines_rise_and_leave_room_for_every_vertex(pixels in 2..500_usize, tiles in 1..40_usize, steps in 1..40_usize) {
            match Layout::new([pixels, pixels], [tiles, 1], [steps + 1, 2]) {
                Ok(layout) => {
                    let lines = &layout.row_lines;
                    prop_assert_eq!((lines[0], lines[tiles], layout.rows()), (0, pixels - 1, steps * tiles + 1));
                    prop_assert!(lines.windows(2).all(|w| w[1] - w[0] >= steps));
                    // Tiles' borders are vertices of the uniform grid as well.
                    for (i, &line) in lines.iter().enumerate() {
                        prop_assert_eq!(line, evenly(i * steps, steps * tiles, pixels - 1));
                    }
                }
                Err(error) => {
                    prop_assert!(steps * tiles >= pixels, "{}", error);
                }
            }
        }
    }

    #[test]
    fn the_paper_s_sizes() {
        // 4 x 6 tiles of 10 x 10 (H x V) make 55 x 37; 4 x 4 of 9 make 33, not the 31 that the paper shows.
        let layout = Layout::new([399, 263], [6, 4], [10, 10]).unwrap();
        assert_eq!((layout.rows(), layout.cols()), (55, 37));
        assert_eq!(Layout::new([154, 183], [4, 4], [9, 9]).unwrap().rows(), 33);
        let error = Layout::new([20, 20], [4, 4], [9, 9]).unwrap_err().to_string();
        assert_eq!(
            error,
            "9 rows a tile in 4 tiles need 33 rows of pixels, but the image has 20: ask for fewer rows or a smaller tiles_down"
        );
        assert!(Layout::new([20, 20], [usize::MAX, 1], [9, 2]).is_err());
    }
}
