//! Between stages 6 and 7, ours: vertices just beside the surface move onto it.
//!
//! A quad with a corner on the background is no use to anybody: without this step the mesh would end in stairs up to a quad
//! wide. A vertex on an invalid pixel moves to the nearest valid one, at most halfway to its neighbours, if the quads around
//! it stay sound.

use rayon::prelude::*;

use super::stitch::Net;
use base::error::Result;
use base::progress::Progress;
use image::range_image::RangeImage;

/// Moves the vertices. Returns how many. Vertices on the image's border stay on it. O(pixels).
pub(super) fn snap(image: &RangeImage, net: &mut Net, progress: &Progress<'_>) -> Result<usize> {
    let mut count = 0;
    // Of vertices whose rows and columns are both even, or ..., none is a neighbour of another: each is moved as if alone.
    for colour in 0..4 {
        let fixed: &Net = net;
        let moves: Vec<(usize, [u32; 2])> = (0..fixed.rows)
            .into_par_iter()
            .filter(|i| i % 2 == colour / 2)
            .map(|i| {
                progress.check()?;
                let own = (0..fixed.cols).filter(|j| j % 2 == colour % 2);
                Ok(own.filter_map(|j| Some((i * fixed.cols + j, nearest(image, fixed, i, j)?))).collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>>>()?
            .concat();
        count += moves.len();
        for (v, site) in moves {
            net.sites[v] = site;
        }
    }
    Ok(count)
}

/// The nearest valid pixel that a vertex on the background may move to. The first one of several.
fn nearest(image: &RangeImage, net: &Net, i: usize, j: usize) -> Option<[u32; 2]> {
    let at = |i: usize, j: usize| net.sites[i * net.cols + j];
    let [row, col] = at(i, j);
    if image.is_valid(row as usize * image.cols() + col as usize) {
        return None;
    }
    let span = |here: u32, index: usize, count: usize, neighbour: &dyn Fn(usize) -> u32| {
        if index == 0 || index + 1 == count {
            return here..=here;
        }
        (here - (here - neighbour(index - 1)) / 2)..=(here + (neighbour(index + 1) - here) / 2)
    };
    let rows = span(row, i, net.rows, &|i| at(i, j)[0]);
    let cols = span(col, j, net.cols, &|j| at(i, j)[1]);
    let mut best = None;
    let mut best_distance = u64::MAX;
    for r in rows {
        let down = u64::from(r.abs_diff(row)).pow(2);
        if down >= best_distance {
            continue;
        }
        for c in cols.clone() {
            let distance = down + u64::from(c.abs_diff(col)).pow(2);
            if distance < best_distance
                && image.is_valid(r as usize * image.cols() + c as usize)
                && net.fits(i, j, [r, c])
            {
                (best, best_distance) = (Some([r, c]), distance);
            }
        }
    }
    best
}
