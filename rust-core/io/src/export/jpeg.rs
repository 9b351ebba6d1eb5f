//! JPEG, baseline (ITU-T T.81): colours or grey of 8 bits, without subsampling.
//!
//! Our own: the crate for it has a licence that `deny.toml` does not allow, and the one that does not brings colour management that compiles
//! longer than all else here.

use base::error::{Error, Result};
use base::progress::Progress;

/// Most columns and rows.
pub(super) const MOST: u32 = 65_535;
/// Pixels of a side of a block.
const SIDE: usize = 8;
const BLOCK: usize = SIDE * SIDE;

/// Steps of the coefficients at quality 50, row by row: table K.1 for brightness, K.2 for colours.
const STEPS: [[u8; BLOCK]; 2] = [
    [
        16, 11, 10, 16, 24, 40, 51, 61, 12, 12, 14, 19, 26, 58, 60, 55, 14, 13, 16, 24, 40, 57, 69, 56, 14, 17, 22, 29,
        51, 87, 80, 62, 18, 22, 37, 56, 68, 109, 103, 77, 24, 35, 55, 64, 81, 104, 113, 92, 49, 64, 78, 87, 103, 121,
        120, 101, 72, 92, 95, 98, 112, 100, 103, 99,
    ],
    [
        17, 18, 24, 47, 99, 99, 99, 99, 18, 21, 26, 66, 99, 99, 99, 99, 24, 26, 56, 99, 99, 99, 99, 99, 47, 66, 99, 99,
        99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99,
        99, 99, 99, 99, 99, 99, 99, 99,
    ],
];

/// Order in which a block's coefficients are written, as places row by row.
const ZIGZAG: [u8; BLOCK] = [
    0, 1, 8, 16, 9, 2, 3, 10, 17, 24, 32, 25, 18, 11, 4, 5, 12, 19, 26, 33, 40, 48, 41, 34, 27, 20, 13, 6, 7, 14, 21,
    28, 35, 42, 49, 56, 57, 50, 43, 36, 29, 22, 15, 23, 30, 37, 44, 51, 58, 59, 52, 45, 38, 31, 39, 46, 53, 60, 61, 54,
    47, 55, 62, 63,
];

/// Codes of the lengths of first coefficients (table K.3): how many have each number of bits, and what they stand for.
const FIRST: ([u8; 16], &[u8]) =
    ([0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0], &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);

/// Codes of the others (table K.5): zeros before in the upper four bits, the length in the lower.
const OTHERS: ([u8; 16], &[u8]) = (
    [0, 2, 1, 3, 3, 2, 4, 3, 5, 5, 4, 4, 0, 0, 1, 125],
    &[
        0x01, 0x02, 0x03, 0x00, 0x04, 0x11, 0x05, 0x12, 0x21, 0x31, 0x41, 0x06, 0x13, 0x51, 0x61, 0x07, 0x22, 0x71,
        0x14, 0x32, 0x81, 0x91, 0xA1, 0x08, 0x23, 0x42, 0xB1, 0xC1, 0x15, 0x52, 0xD1, 0xF0, 0x24, 0x33, 0x62, 0x72,
        0x82, 0x09, 0x0A, 0x16, 0x17, 0x18, 0x19, 0x1A, 0x25, 0x26, 0x27, 0x28, 0x29, 0x2A, 0x34, 0x35, 0x36, 0x37,
        0x38, 0x39, 0x3A, 0x43, 0x44, 0x45, 0x46, 0x47, 0x48, 0x49, 0x4A, 0x53, 0x54, 0x55, 0x56, 0x57, 0x58, 0x59,
        0x5A, 0x63, 0x64, 0x65, 0x66, 0x67, 0x68, 0x69, 0x6A, 0x73, 0x74, 0x75, 0x76, 0x77, 0x78, 0x79, 0x7A, 0x83,
        0x84, 0x85, 0x86, 0x87, 0x88, 0x89, 0x8A, 0x92, 0x93, 0x94, 0x95, 0x96, 0x97, 0x98, 0x99, 0x9A, 0xA2, 0xA3,
        0xA4, 0xA5, 0xA6, 0xA7, 0xA8, 0xA9, 0xAA, 0xB2, 0xB3, 0xB4, 0xB5, 0xB6, 0xB7, 0xB8, 0xB9, 0xBA, 0xC2, 0xC3,
        0xC4, 0xC5, 0xC6, 0xC7, 0xC8, 0xC9, 0xCA, 0xD2, 0xD3, 0xD4, 0xD5, 0xD6, 0xD7, 0xD8, 0xD9, 0xDA, 0xE1, 0xE2,
        0xE3, 0xE4, 0xE5, 0xE6, 0xE7, 0xE8, 0xE9, 0xEA, 0xF1, 0xF2, 0xF3, 0xF4, 0xF5, 0xF6, 0xF7, 0xF8, 0xF9, 0xFA,
    ],
);

/// An image as a JPEG file. `pixels` are `channels` bytes each, 3 of sRGB or 1 of grey. `quality` is 1 to 100, as libjpeg counts it.
///
/// # Errors
/// [`Error::Input`] for more columns or rows than [`MOST`]. [`Error::Cancelled`].
pub(crate) fn encoded(
    [columns, rows]: [u32; 2],
    channels: usize,
    pixels: &[u8],
    quality: u32,
    progress: &Progress<'_>,
) -> Result<Vec<u8>> {
    if columns.max(rows) > MOST {
        return Err(Error::input(format!(
            "a JPEG file holds at most {MOST} columns and rows, got {columns} x {rows}: write PNG"
        )));
    }
    let tables = if channels == 3 { 2 } else { 1 };
    let steps: Vec<[u8; BLOCK]> = STEPS[..tables].iter().map(|steps| scaled(steps, quality)).collect();
    let mut file = vec![0xFF, 0xD8];
    for (number, steps) in steps.iter().enumerate() {
        let in_order = ZIGZAG.map(|place| steps[usize::from(place)]);
        segment(&mut file, 0xDB, &[&[number as u8][..], &in_order].concat());
    }
    let parts = 1..=channels as u8;
    let size = [(rows as u16).to_be_bytes(), (columns as u16).to_be_bytes()].concat();
    let frame = parts.clone().flat_map(|part| [part, 0x11, u8::from(part > 1)]);
    segment(&mut file, 0xC0, &[8].into_iter().chain(size).chain([channels as u8]).chain(frame).collect::<Vec<_>>());
    for (class, (counts, values)) in [(0x00, FIRST), (0x10, OTHERS)] {
        segment(&mut file, 0xC4, &[&[class][..], &counts, values].concat());
    }
    let scan = parts.flat_map(|part| [part, 0]);
    segment(&mut file, 0xDA, &[channels as u8].into_iter().chain(scan).chain([0, 63, 0]).collect::<Vec<_>>());
    let image = Image { size: [columns as usize, rows as usize], channels, pixels };
    image.write(&steps, &mut file, progress)?;
    file.extend([0xFF, 0xD9]);
    Ok(file)
}

fn segment(file: &mut Vec<u8>, marker: u8, content: &[u8]) {
    file.extend([0xFF, marker]);
    file.extend((content.len() as u16 + 2).to_be_bytes());
    file.extend(content);
}

/// Steps for a quality, as libjpeg scales them.
fn scaled(steps: &[u8; BLOCK], quality: u32) -> [u8; BLOCK] {
    let quality = quality.clamp(1, 100);
    let percent = if quality < 50 { 5000 / quality } else { 200 - 2 * quality };
    steps.map(|step| ((u32::from(step) * percent + 50) / 100).clamp(1, 255) as u8)
}

struct Image<'a> {
    size: [usize; 2],
    channels: usize,
    pixels: &'a [u8],
}

impl Image<'_> {
    fn write(&self, steps: &[[u8; BLOCK]], file: &mut Vec<u8>, progress: &Progress<'_>) -> Result<()> {
        let (first, others) = (codes(FIRST), codes(OTHERS));
        let mut bits = Bits { file, held: 0, count: 0 };
        let mut before = [0; 3];
        for row in (0..self.size[1]).step_by(SIDE) {
            progress.check()?;
            for column in (0..self.size[0]).step_by(SIDE) {
                let blocks = self.block(row, column);
                for (part, block) in blocks.iter().enumerate().take(self.channels) {
                    let levels = levels(block, &steps[part.min(1)]);
                    let change = levels[0] - before[part];
                    before[part] = levels[0];
                    bits.put(first[usize::from(length(change))]);
                    bits.number(change);
                    bits.others(&levels, &others);
                }
            }
        }
        // Ones fill the last byte.
        bits.put((0x7F, 7));
        Ok(())
    }

    /// Brightness and two colours of a block, or grey, about zero. Pixels beyond the border are as the last ones.
    fn block(&self, row: usize, column: usize) -> [[f32; BLOCK]; 3] {
        let mut block = [[0.0; BLOCK]; 3];
        for place in 0..BLOCK {
            let row = (row + place / SIDE).min(self.size[1] - 1);
            let column = (column + place % SIDE).min(self.size[0] - 1);
            let first = (row * self.size[0] + column) * self.channels;
            let pixel = &self.pixels[first..first + self.channels];
            if let [r, g, b] = *pixel {
                let [r, g, b] = [r, g, b].map(f32::from);
                block[0][place] = 0.299 * r + 0.587 * g + 0.114 * b - 128.0;
                block[1][place] = -0.168_736 * r - 0.331_264 * g + 0.5 * b;
                block[2][place] = 0.5 * r - 0.418_688 * g - 0.081_312 * b;
            } else {
                block[0][place] = f32::from(pixel[0]) - 128.0;
            }
        }
        block
    }
}

/// Levels of a block's coefficients in the order of the file: its cosine transform in steps.
fn levels(block: &[f32; BLOCK], steps: &[u8; BLOCK]) -> [i32; BLOCK] {
    let coefficients = transposed_transform(&transposed_transform(block));
    ZIGZAG.map(|place| {
        let place = usize::from(place);
        (coefficients[place] / f32::from(steps[place])).round() as i32
    })
}

/// The cosine transform of each row, as a column.
fn transposed_transform(block: &[f32; BLOCK]) -> [f32; BLOCK] {
    let mut turned = [0.0; BLOCK];
    for (row, values) in block.as_chunks::<SIDE>().0.iter().enumerate() {
        for (frequency, cosines) in COSINES.iter().enumerate() {
            turned[frequency * SIDE + row] = values.iter().zip(cosines).map(|(value, cosine)| value * cosine).sum();
        }
    }
    turned
}

/// `cos((2 x + 1) u pi / 16) / 2`, for frequency 0 by the root of two less: rows of the transform. Written out, so that all machines have
/// the same.
const COSINES: [[f32; SIDE]; SIDE] = {
    const C: [f32; SIDE] =
        [0.353_553_4, 0.490_392_65, 0.461_939_77, 0.415_734_8, 0.353_553_4, 0.277_785_12, 0.191_341_72, 0.097_545_16];
    let mut rows = [[C[0]; SIDE]; SIDE];
    let mut u = 1;
    while u < SIDE {
        let mut x = 0;
        while x < SIDE {
            // The angle in sixteenths of pi, of which the cosine repeats after 32.
            let angle = ((2 * x + 1) * u) % 32;
            let folded = if angle > 16 { 32 - angle } else { angle };
            rows[u][x] = match folded {
                8 => 0.0,
                0..8 => C[folded],
                _ => -C[16 - folded],
            };
            x += 1;
        }
        u += 1;
    }
    rows
};

/// The code of each value, and its number of bits.
fn codes((counts, values): ([u8; 16], &[u8])) -> [(u32, u32); 256] {
    let mut codes = [(0, 0); 256];
    let (mut code, mut values) = (0, values.iter());
    for (bits, &count) in (1..).zip(&counts) {
        for &value in values.by_ref().take(usize::from(count)) {
            codes[usize::from(value)] = (code, bits);
            code += 1;
        }
        code <<= 1;
    }
    codes
}

/// Number of bits of a value without its sign.
fn length(value: i32) -> u8 {
    (32 - value.unsigned_abs().leading_zeros()) as u8
}

/// Bits, the most significant first, with the zero byte that follows each 255.
struct Bits<'a> {
    file: &'a mut Vec<u8>,
    held: u64,
    count: u32,
}

impl Bits<'_> {
    fn put(&mut self, (code, bits): (u32, u32)) {
        self.held = (self.held << bits) | u64::from(code);
        self.count += bits;
        while self.count >= 8 {
            self.count -= 8;
            let byte = (self.held >> self.count) as u8;
            self.file.push(byte);
            if byte == 0xFF {
                self.file.push(0);
            }
        }
    }

    /// The bits of a value. Those of a negative one are of it less one.
    fn number(&mut self, value: i32) {
        let bits = u32::from(length(value));
        let shown = if value < 0 { value - 1 } else { value };
        self.put((shown as u32 & ((1 << bits) - 1), bits));
    }

    /// All coefficients but the first, in runs of zeros.
    fn others(&mut self, levels: &[i32; BLOCK], codes: &[(u32, u32); 256]) {
        let mut zeros = 0;
        for &level in &levels[1..] {
            if level == 0 {
                zeros += 1;
                continue;
            }
            while zeros > 15 {
                self.put(codes[0xF0]);
                zeros -= 16;
            }
            self.put(codes[zeros << 4 | usize::from(length(level))]);
            self.number(level);
            zeros = 0;
        }
        if zeros > 0 {
            self.put(codes[0]);
        }
    }
}

#[cfg(test)]
mod tests {
    use zune_core::bytestream::ZCursor;
    use zune_core::colorspace::ColorSpace;
    use zune_core::options::DecoderOptions;
    use zune_jpeg::JpegDecoder;

    use super::*;

    fn decoded(file: &[u8], space: ColorSpace) -> ([usize; 2], Vec<u8>) {
        let options = DecoderOptions::default().jpeg_set_out_colorspace(space).set_strict_mode(true);
        let mut decoder = JpegDecoder::new_with_options(ZCursor::new(file), options);
        let pixels = decoder.decode().unwrap();
        let (columns, rows) = decoder.dimensions().unwrap();
        ([columns, rows], pixels)
    }

    /// Waves, an edge, and noise in one corner.
    fn picture([columns, rows]: [u32; 2], channels: usize) -> Vec<u8> {
        let mut pixels = Vec::new();
        let mut noise = 1_u32;
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            for channel in 0..channels as u32 {
                noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let wave = (f64::from(row * (channel + 1) + 2 * column) * 0.1).sin() * 100.0 + 128.0;
                let value = if row < 16 && column < 16 { f64::from(noise >> 24) } else { wave };
                pixels.push(if column * 3 > columns * 2 { 255 - channel as u8 * 127 } else { value as u8 });
            }
        }
        pixels
    }

    #[test]
    fn another_decoder_reads_what_was_written() {
        for (size, channels, space) in
            [([64, 40], 3, ColorSpace::RGB), ([61, 43], 3, ColorSpace::RGB), ([33, 1], 1, ColorSpace::Luma)]
        {
            let pixels = picture(size, channels);
            let mut lengths = Vec::new();
            for (quality, most) in [(100, 2.0), (90, 8.0), (50, 20.0), (1, 80.0)] {
                let file = encoded(size, channels, &pixels, quality, &Progress::none()).unwrap();
                let (found, read) = decoded(&file, space);
                assert_eq!((found.map(|n| n as u32), read.len()), (size, pixels.len()));
                let squares = pixels.iter().zip(&read).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
                let rms = (squares.sum::<f64>() / pixels.len() as f64).sqrt();
                assert!(rms < most, "{size:?} at {quality}: {rms}");
                lengths.push(file.len());
            }
            assert!(lengths.is_sorted_by(|a, b| a > b), "{lengths:?}");
        }
    }

    #[test]
    fn too_large_and_cancelled() {
        let error = encoded([MOST + 1, 1], 1, &[], 90, &Progress::none()).unwrap_err().to_string();
        assert!(error.ends_with("got 65536 x 1: write PNG"), "{error}");
        let pixels = picture([16, 32], 3);
        let outcome = encoded([16, 32], 3, &pixels, 90, &Progress::cancel_after(2));
        assert!(matches!(outcome, Err(Error::Cancelled)));
    }
}
