//! Numbers in text, read exactly: the same bits as `str::parse` gives, several times faster.
//!
//! The common shapes (sign, up to 19 digits with a point, small exponent) are read eight digits at a time. Everything else, and every case
//! where rounding could be in doubt, goes through `str::parse`. All functions want [`PAD`] bytes of white space after the text: numbers end
//! at a blank, and eight bytes are looked at at once.
//!
//! [`PAD`]: crate::import::window::PAD
//!
//! *Rounding.* For f64: digits below 2^53 and a power of ten up to 10^22 are both exact, so one division or product rounds once, correctly
//! (Clinger 1990). For f32: a product in f64 is off by at most two units in its last place. Rounding it to f32 is right unless the midpoint
//! of two f32 lies that close, which the low 29 bits show.

/// 10^0 to 10^22: all exact.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// 10^0 to 10^-22, each rounded to nearest.
const INVERSE_POWERS: [f64; 23] = [
    1e0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14, 1e-15, 1e-16, 1e-17,
    1e-18, 1e-19, 1e-20, 1e-21, 1e-22,
];

const WHOLE_POWERS: [u64; 9] = [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000, 100_000_000];

/// 10^0 to 10^15.
const LONG_POWERS: [u64; 16] = {
    let mut powers = [1; 16];
    let mut i = 1;
    while i < 16 {
        powers[i] = powers[i - 1] * 10;
        i += 1;
    }
    powers
};

/// Sign, digits and power of ten of a number: `(-1)^negative * digits * 10^exponent`.
struct Decimal {
    negative: bool,
    digits: u64,
    exponent: i32,
    end: usize,
}

/// Whether a byte separates tokens.
#[inline(always)]
pub(crate) fn is_blank(byte: u8) -> bool {
    byte <= b' '
}

/// Eight bytes from `at`. Zeros past the end.
#[inline(always)]
fn eight(text: &[u8], at: usize) -> u64 {
    match text.get(at..).and_then(|rest| rest.first_chunk::<8>()) {
        Some(bytes) => u64::from_le_bytes(*bytes),
        None => 0,
    }
}

/// Number of leading digits among eight bytes and their value.
#[inline(always)]
fn leading_digits(bytes: u64) -> (usize, u64) {
    let x = bytes ^ 0x3030_3030_3030_3030;
    // A byte above 9 sets its high bit here; a carry can only touch bytes after the first such one.
    let other = (x.wrapping_add(0x7676_7676_7676_7676) | x) & 0x8080_8080_8080_8080;
    let count = (other.trailing_zeros() / 8) as usize;
    if count == 0 {
        return (0, 0);
    }
    // The digits move to the high bytes; zeros before them change nothing.
    let x = x << (64 - 8 * count as u32);
    let pairs = x.wrapping_mul(10).wrapping_add(x >> 8);
    let low = (pairs & 0x0000_00FF_0000_00FF).wrapping_mul(0x000F_4240_0000_0064);
    let high = ((pairs >> 16) & 0x0000_00FF_0000_00FF).wrapping_mul(0x0000_2710_0000_0001);
    (count, u64::from((low.wrapping_add(high) >> 32) as u32))
}

/// Reads sign, digits, point and exponent. `None` if the number isn't of the common shape.
#[inline(always)]
fn decimal(text: &[u8], start: usize) -> Option<Decimal> {
    let mut at = start;
    let first = *text.get(at)?;
    let negative = first == b'-';
    at += usize::from(negative | (first == b'+'));
    let (mut whole, mut digits) = leading_digits(eight(text, at));
    at += whole;
    if whole == 8 {
        let (more, value) = leading_digits(eight(text, at));
        digits = digits * WHOLE_POWERS[more] + value;
        at += more;
        whole += more;
        if more == 8 {
            return None;
        }
    }
    let mut fraction = 0;
    if text.get(at) == Some(&b'.') {
        at += 1;
        let (count, value) = leading_digits(eight(text, at));
        if whole + count > 19 {
            return None;
        }
        digits = digits * WHOLE_POWERS[count] + value;
        at += count;
        fraction = count;
        if count == 8 {
            let (more, value) = leading_digits(eight(text, at));
            if whole + 8 + more > 19 || more == 8 {
                return None;
            }
            digits = digits * WHOLE_POWERS[more] + value;
            at += more;
            fraction += more;
        }
    }
    if whole + fraction == 0 {
        return None;
    }
    let mut exponent = -(fraction as i32);
    let mut next = *text.get(at)?;
    if next | 0x20 == b'e' {
        at += 1;
        let sign = *text.get(at)?;
        at += usize::from(sign == b'-' || sign == b'+');
        let (count, value) = leading_digits(eight(text, at));
        if count == 0 || count > 3 {
            return None;
        }
        at += count;
        exponent += if sign == b'-' { -(value as i32) } else { value as i32 };
        next = *text.get(at)?;
    }
    if !is_blank(next) {
        return None;
    }
    Some(Decimal { negative, digits, exponent, end: at })
}

/// Rounds digits times a power of ten to f32. `None` if that could be wrong.
#[inline(always)]
fn round_f32(negative: bool, digits: u64, exponent: i32) -> Option<f32> {
    let power = exponent.unsigned_abs() as usize;
    let factor = if exponent < 0 { *INVERSE_POWERS.get(power)? } else { *POWERS.get(power)? };
    // A signed whole number becomes a float in one instruction.
    let wide = i64::try_from(digits).ok()? as f64 * factor;
    let from_midpoint = (wide.to_bits() as u32 & 0x1FFF_FFFF).abs_diff(0x1000_0000);
    // Below the normal f32 the midpoints lie elsewhere. 10^-22 keeps everything but zero far above that.
    (from_midpoint > 8).then_some(if negative { -(wide as f32) } else { wide as f32 })
}

/// A number of the commonest shape only: a sign or none, one digit, a point, up to 15 digits. Else `None`.
#[inline(always)]
pub(super) fn read_plain_f32(text: &[u8], start: usize) -> Option<(f32, usize)> {
    let negative = *text.get(start)? == b'-';
    let at = start + usize::from(negative);
    let head = eight(text, at);
    let whole = (head & 0xFF).wrapping_sub(u64::from(b'0'));
    if whole > 9 || head & 0xFF00 != u64::from(b'.') << 8 {
        return None;
    }
    let (mut places, mut fraction) = leading_digits(eight(text, at + 2));
    if places == 8 {
        let (more, value) = leading_digits(eight(text, at + 10));
        if more == 8 {
            return None;
        }
        fraction = fraction * WHOLE_POWERS[more] + value;
        places += more;
    }
    let digits = whole * LONG_POWERS[places & 15] + fraction;
    // Below 2^53: one rounding less than in general.
    let value = round_f32(negative, digits, -(places as i32))?;
    Some((value, at + 2 + places))
}

/// The f32 that starts at `start` and the place after it. `None` if there is no number.
#[inline(always)]
pub(crate) fn read_f32(text: &[u8], start: usize) -> Option<(f32, usize)> {
    if let Some(d) = decimal(text, start)
        && let Some(value) = round_f32(d.negative, d.digits, d.exponent)
    {
        return Some((value, d.end));
    }
    slow(text, start, |token| token.parse::<f32>().ok(), f32::NAN)
}

/// The f64 that starts at `start` and the place after it. `None` if there is no number.
#[inline(always)]
pub(crate) fn read_f64(text: &[u8], start: usize) -> Option<(f64, usize)> {
    if let Some(d) = decimal(text, start) {
        let power = d.exponent.unsigned_abs() as usize;
        if power < 23 && d.digits <= 1 << 53 {
            let whole = d.digits as f64;
            let value = if d.exponent < 0 { whole / POWERS[power] } else { whole * POWERS[power] };
            return Some((if d.negative { -value } else { value }, d.end));
        }
    }
    slow(text, start, |token| token.parse::<f64>().ok(), f64::NAN)
}

/// The whole number that starts at `start` and the place after it. `None` if there is none or it is beyond +-10^15.
#[inline(always)]
pub(crate) fn read_integer(text: &[u8], start: usize) -> Option<(i64, usize)> {
    let first = *text.get(start)?;
    let mut at = start + usize::from((first == b'-') | (first == b'+'));
    let (count, mut digits) = leading_digits(eight(text, at));
    at += count;
    if count == 8 {
        let (more, value) = leading_digits(eight(text, at));
        if more == 8 {
            return None;
        }
        digits = digits * WHOLE_POWERS[more] + value;
        at += more;
    }
    if count == 0 || !is_blank(*text.get(at)?) {
        return None;
    }
    Some((if first == b'-' { -(digits as i64) } else { digits as i64 }, at))
}

/// Up to seven digits from `start`, and the place after them. Else `None`.
#[inline(always)]
pub(super) fn read_plain_index(text: &[u8], start: usize) -> Option<(u64, usize)> {
    let (count, value) = leading_digits(eight(text, start));
    (count > 0 && count < 8).then_some((value, start + count))
}

/// The end of the token that starts at `start`.
pub(crate) fn token_end(text: &[u8], start: usize) -> usize {
    text[start..].iter().position(|&b| is_blank(b)).map_or(text.len(), |n| start + n)
}

#[cold]
#[inline(never)]
fn slow<T: Copy>(text: &[u8], start: usize, parse: impl Fn(&str) -> Option<T>, nan: T) -> Option<(T, usize)> {
    let end = token_end(text, start);
    let token = std::str::from_utf8(&text[start..end]).ok()?;
    if let Some(value) = parse(token) {
        return Some((value, end));
    }
    // C libraries print this for values that aren't numbers.
    let bare = token.trim_start_matches(['-', '+']);
    let known = ["nan(", "1.#ind", "1.#qnan", "1.#snan", "1.#inf"];
    let not_finite = known.iter().any(|k| bare.get(..k.len()).is_some_and(|b| b.eq_ignore_ascii_case(k)));
    not_finite.then_some((nan, end))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::window::PAD;
    use proptest::prelude::*;

    fn padded(text: &str) -> Vec<u8> {
        let mut bytes = text.as_bytes().to_vec();
        bytes.extend([b'\n'; PAD]);
        bytes
    }

    /// Theorem: what we read has the same bits as what the standard library reads.
    fn agrees(text: &str) {
        let bytes = padded(text);
        if let Some((value, end)) = read_plain_f32(&bytes, 0) {
            assert_eq!(Ok(value.to_bits()), text[..end].parse::<f32>().map(f32::to_bits), "plain {text}");
        }
        let expected = text.parse::<f64>().ok().map(|v| (v.to_bits(), text.len()));
        assert_eq!(read_f64(&bytes, 0).map(|(v, end)| (v.to_bits(), end)), expected, "f64 {text}");
        let expected = text.parse::<f32>().ok().map(|v| (v.to_bits(), text.len()));
        assert_eq!(read_f32(&bytes, 0).map(|(v, end)| (v.to_bits(), end)), expected, "f32 {text}");
    }

    #[test]
    fn odd_shapes() {
        for text in [
            "0",
            "-0",
            "+0",
            "0.0",
            "-0.0",
            ".5",
            "5.",
            "1e5",
            "1E+5",
            "1e-5",
            "1e",
            "1e+",
            "-",
            "+",
            ".",
            "",
            "e5",
            "1.5e",
            "--1",
            "1..2",
            "1.2.3",
            "0x10",
            "1,5",
            "abc",
            "1a",
            "nan",
            "NaN",
            "-nan",
            "inf",
            "-Infinity",
            "1e400",
            "-1e400",
            "1e-400",
            "12345678",
            "123456789",
            "1234567812345678",
            "12345678123456781",
            "123456781234567812",
            "1234567890123456789",
            "12345678901234567890",
            "9999999999999999999",
            "0.1234567812345678",
            "0.12345678123456781",
            "123456789.123456789012345",
            "9007199254740993",
            "9007199254740993e0",
            "16777217",
            "16777217.0",
            "16777219",
            "0.000000000000000000000000000001",
            "3.4028235677973366e38",
            "3.4028235677973365e38",
            "3.4028236e38",
            "1.1754943e-38",
            "1e-45",
            "7.0e-46",
            "7.1e-46",
            "1.401298464324817e-45",
            "1e22",
            "1e23",
            "8.41e21",
            "1e-22",
            "1e-23",
            "00000000000000000000001",
            "0.00000000000000000000001e23",
            "1e0000000001",
            "1e-0005",
            "1_000",
            "１",
        ] {
            agrees(text);
        }
    }

    #[test]
    fn values_that_are_not_numbers_as_c_prints_them() {
        for text in ["-nan(ind)", "nan(0x8000)", "1.#QNAN", "-1.#IND", "1.#INF00"] {
            assert!(read_f64(&padded(text), 0).unwrap().0.is_nan(), "{text}");
        }
        assert!(read_f64(&padded("1.#x"), 0).is_none());
    }

    #[test]
    fn midpoints_of_f32_round_as_the_standard_library_does() {
        // Printed exactly, a midpoint of two f32 is the worst case of rounding twice.
        for bits in (0x3000_0000_u32..0x5000_0000).step_by(999_983) {
            let (a, b) = (f64::from(f32::from_bits(bits)), f64::from(f32::from_bits(bits + 1)));
            let middle = (a + b) / 2.0;
            for value in [middle, f64::from_bits(middle.to_bits() + 1), f64::from_bits(middle.to_bits() - 1)] {
                agrees(&format!("{value}"));
                agrees(&format!("{value:e}"));
                agrees(&format!("-{value:.19}"));
            }
        }
    }

    #[test]
    fn whole_numbers() {
        for (text, value) in [("0", 0), ("-1", -1), ("+7", 7), ("12345678", 12_345_678), ("4294967295", 4_294_967_295)]
        {
            assert_eq!(read_integer(&padded(text), 0), Some((value, text.len())));
        }
        for text in ["", "-", "1.0", "1e3", "x", "99999999999999999999"] {
            assert_eq!(read_integer(&padded(text), 0), None, "{text}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(if cfg!(miri) { 10 } else { base::tier::cases(20_000) }))]

        #[test]
        fn shortest_f32(bits: u32) {
            let value = f32::from_bits(bits);
            prop_assume!(value.is_finite());
            agrees(&format!("{value}"));
            agrees(&format!("{value:e}"));
        }

        #[test]
        fn shortest_f64(bits: u64) {
            let value = f64::from_bits(bits);
            prop_assume!(value.is_finite());
            agrees(&format!("{value}"));
            agrees(&format!("{value:e}"));
        }

        #[test]
        fn as_scanners_print(value in -1000.0..1000.0_f64, places in 0..12_usize) {
            agrees(&format!("{value:.places$}"));
        }

        #[test]
        fn any_digits(text in "[+-]?[0-9]{0,25}(\\.[0-9]{0,25})?([eE][+-]?[0-9]{0,4})?") {
            agrees(&text);
        }

        #[test]
        fn any_text(text in "[-+0-9.eEnainf]{0,12}") {
            agrees(&text);
        }
    }
}
