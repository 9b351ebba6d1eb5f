//! Writes JPEG files for tests: baseline, a colour a block of 8 x 8 pixels.

/// Standard table of the lengths of brightness' first coefficients: how many codes of each length, and what they stand
/// for.
const DC_COUNTS: [u8; 16] = [0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0];
const DC_VALUES: [u8; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];

/// Bits, most significant first, with the zero byte that follows each 255.
#[derive(Default)]
struct Bits {
    bytes: Vec<u8>,
    held: u32,
    count: u32,
}

impl Bits {
    fn put(&mut self, value: u32, count: u32) {
        for k in (0..count).rev() {
            self.held = (self.held << 1) | ((value >> k) & 1);
            self.count += 1;
            if self.count == 8 {
                self.bytes.push(self.held as u8);
                if self.held as u8 == 0xFF {
                    self.bytes.push(0);
                }
                (self.held, self.count) = (0, 0);
            }
        }
    }
}

/// The code of a length of brightness' first coefficients.
fn code(length: u8) -> (u32, u32) {
    let (mut code, mut k) = (0, 0);
    for (bits, &count) in DC_COUNTS.iter().enumerate() {
        for _ in 0..count {
            if DC_VALUES[k] == length {
                return (code, bits as u32 + 1);
            }
            (code, k) = (code + 1, k + 1);
        }
        code <<= 1;
    }
    unreachable!("all lengths have a code")
}

fn segment(marker: u8, content: &[u8]) -> Vec<u8> {
    let length = (content.len() as u16 + 2).to_be_bytes();
    [&[0xFF, marker][..], &length, content].concat()
}

/// A JPEG file of an image whose blocks have the colour of their middle.
pub(super) fn written([cols, rows]: [usize; 2], pixels: &[[u8; 3]]) -> Vec<u8> {
    let mut bytes = vec![0xFF, 0xD8];
    // The first coefficient is eight times the mean; all tables of ones.
    bytes.extend(segment(0xDB, &[&[0][..], &[1; 64]].concat()));
    let size = [(rows as u16).to_be_bytes(), (cols as u16).to_be_bytes()].concat();
    bytes.extend(segment(0xC0, &[&[8][..], &size, &[3, 1, 0x11, 0, 2, 0x11, 0, 3, 0x11, 0]].concat()));
    bytes.extend(segment(0xC4, &[&[0x00][..], &DC_COUNTS, &DC_VALUES].concat()));
    // Of further coefficients there is none: one code of one bit, which ends a block.
    bytes.extend(segment(0xC4, &[&[0x10, 1][..], &[0; 15], &[0]].concat()));
    bytes.extend(segment(0xDA, &[3, 1, 0x00, 2, 0x00, 3, 0x00, 0, 63, 0]));
    let mut bits = Bits::default();
    let mut before = [0_i32; 3];
    for row in (0..rows).step_by(8) {
        for col in (0..cols).step_by(8) {
            let [r, g, b] = pixels[(row + 3).min(rows - 1) * cols + (col + 3).min(cols - 1)].map(f64::from);
            let y = 0.299 * r + 0.587 * g + 0.114 * b;
            let channels = [y - 128.0, 0.564 * (b - y), 0.713 * (r - y)];
            for (before, channel) in before.iter_mut().zip(channels) {
                let value = (8.0 * channel).round() as i32;
                let change = value - *before;
                *before = value;
                let length = 32 - change.unsigned_abs().leading_zeros();
                let (code, code_bits) = code(length as u8);
                bits.put(code, code_bits);
                let shown = if change < 0 { change + (1 << length) - 1 } else { change };
                bits.put(shown as u32, length);
                bits.put(0, 1);
            }
        }
    }
    bits.put(0x7F, 7);
    [bytes, bits.bytes, vec![0xFF, 0xD9]].concat()
}
