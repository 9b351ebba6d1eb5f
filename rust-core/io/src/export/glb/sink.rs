//! The bytes of a binary glTF file.

use std::io::{BufWriter, Write};
use std::path::Path;

use crate::export::atomic::Output;
use base::error::{Error, Result};
use base::progress::Progress;

/// Elements that are written between two looks at the progress.
pub const CHUNK: usize = 1 << 14;

/// Writes to the file and counts.
pub struct GlbSink<'a, 'o, 'p> {
    pub out: BufWriter<&'a mut Output<'o>>,
    pub path: &'a Path,
    pub progress: &'a Progress<'p>,
}

impl GlbSink<'_, '_, '_> {
    pub fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.out.write_all(bytes).map_err(|e| Error::io(self.path, e))
    }

    /// Writes every item as `convert` has it.
    pub fn all<T, const N: usize, W: bytemuck::NoUninit>(
        &mut self,
        items: &[T],
        convert: impl Fn(&T) -> [W; N],
    ) -> Result<()> {
        for items in items.chunks(CHUNK) {
            for item in items {
                self.put(bytemuck::cast_slice(&convert(item)))?;
            }
            self.progress.advance((items.len() * N * size_of::<W>()) as u64)?;
        }
        Ok(())
    }
}
