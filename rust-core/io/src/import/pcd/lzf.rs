//! LZF, as the Point Cloud Library packs points with it.

use crate::import::window::Window;

/// Most bytes that LZF makes out of one: three bytes name a run of 264.
pub(super) const RATIO: u64 = 88;

/// Farthest that LZF looks back.
const HISTORY: usize = 1 << 13;

/// Bytes packed by LZF: runs of plain bytes, and runs that repeat bytes up to 8 KiB back.
pub(super) struct Lzf<'a> {
    pub window: Window<'a>,
    /// Packed bytes that are left.
    packed: u64,
    /// The last bytes unpacked: at least the history, if there are as many.
    out: Vec<u8>,
    /// The next byte of `out` to be used.
    at: usize,
}

impl<'a> Lzf<'a> {
    /// Unpacks that many bytes of what follows.
    pub fn new(window: Window<'a>, packed: u64) -> Self {
        Lzf { window, packed, out: Vec::with_capacity(4 * HISTORY), at: 0 }
    }

    /// The next bytes. `None` if the data ends or is damaged.
    #[inline(always)]
    pub fn take(&mut self, into: &mut [u8]) -> Option<()> {
        while self.out.len() - self.at < into.len() {
            self.unpack()?;
        }
        into.copy_from_slice(&self.out[self.at..self.at + into.len()]);
        self.at += into.len();
        Some(())
    }

    /// Unpacks one run.
    fn unpack(&mut self) -> Option<()> {
        if self.at > 3 * HISTORY {
            // Bytes that were used and are out of reach go.
            let kept = self.at - HISTORY;
            self.out.drain(..kept);
            self.at = HISTORY;
        }
        let control = usize::from(self.byte()?);
        if control < 32 {
            for _ in 0..=control {
                let byte = self.byte()?;
                self.out.push(byte);
            }
            return Some(());
        }
        let mut length = control >> 5;
        if length == 7 {
            length += usize::from(self.byte()?);
        }
        let back = ((control & 31) << 8) + usize::from(self.byte()?) + 1;
        let from = self.out.len().checked_sub(back)?;
        // One by one: a run may repeat itself.
        for i in 0..length + 2 {
            self.out.push(self.out[from + i]);
        }
        Some(())
    }

    #[inline(always)]
    fn byte(&mut self) -> Option<u8> {
        if self.packed == 0 || !self.window.ensure(1) {
            return None;
        }
        self.packed -= 1;
        let byte = self.window.padded()[self.window.at];
        self.window.at += 1;
        Some(byte)
    }
}
