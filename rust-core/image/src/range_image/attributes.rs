//! Attributes of pixels besides their samples, as attributes of the vertices they become.

use base::error::Result;
use base::progress::Progress;
use mesh::Attribute;

use super::RangeImage;

impl RangeImage {
    /// Attributes of vertices that are these pixels: `range_row`, `range_col` and, where the image has them, `colour`,
    /// `intensity` and `confidence`. Rows and columns are below 2^31.
    ///
    /// # Errors
    /// [`base::error::Error::Cancelled`].
    pub(crate) fn attributes_of(&self, pixels: &[u32], progress: &Progress<'_>) -> Result<Vec<Attribute>> {
        let cols = self.cols();
        let mut found = vec![
            Attribute::i32("range_row", each(pixels, progress, |pixel| (pixel / cols) as i32)?),
            Attribute::i32("range_col", each(pixels, progress, |pixel| (pixel % cols) as i32)?),
        ];
        if let Some(colour) = &self.colour {
            found.push(Attribute::colour("colour", each(pixels, progress, |pixel| colour[pixel])?));
        }
        for (name, values) in [("intensity", &self.intensity), ("confidence", &self.confidence)] {
            if let Some(values) = values {
                found.push(Attribute::f32(name, each(pixels, progress, |pixel| values[pixel])?));
            }
        }
        Ok(found)
    }
}

fn each<T>(pixels: &[u32], progress: &Progress<'_>, entry: impl Fn(usize) -> T) -> Result<Vec<T>> {
    let mut entries = Vec::with_capacity(pixels.len());
    for block in progress.blocks(pixels) {
        entries.extend(block?.iter().map(|&pixel| entry(pixel as usize)));
    }
    Ok(entries)
}
