//! Colours as light: bytes of sRGB are even to the eye. The light that they stand for can be added.
//!
//! Means of colours are formed here, and nowhere else: of whole numbers, so that no order matters, and a mean of equal
//! colours is that colour.

use std::sync::LazyLock;

/// The light of white, byte 255. Bytes of the darkest colours lie 20 units apart.
pub const WHITE: u16 = u16::MAX;

/// Bits of light that one first guess of its byte holds for: no two bytes begin in as short a range.
const GUESS_BITS: u32 = 4;

struct Tables {
    light: [u16; 256],
    /// The least light that is rounded to each byte.
    least: [u16; 256],
    /// The byte of the first light of each range.
    guesses: [u8; 1 << (16 - GUESS_BITS)],
}

static TABLES: LazyLock<Tables> = LazyLock::new(|| {
    let of = |byte: f64| f64::from(WHITE) * light_of_share(byte / 255.0);
    let light = std::array::from_fn(|byte| of(byte as f64).round() as u16);
    let least: [u16; 256] = std::array::from_fn(|byte| of((byte as f64 - 0.5).max(0.0)).ceil() as u16);
    let guess = |range: usize| least.partition_point(|&least| usize::from(least) <= range << GUESS_BITS) - 1;
    Tables { light, least, guesses: std::array::from_fn(|range| guess(range) as u8) }
});

/// IEC 61966-2-1.
fn light_of_share(share: f64) -> f64 {
    if share <= 0.040_45 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
}

/// The light that a byte of sRGB stands for, of [`WHITE`].
#[inline]
pub fn light(byte: u8) -> u16 {
    TABLES.light[usize::from(byte)]
}

/// The byte of sRGB that stands for the light nearest to this one, to the eye.
#[inline]
pub fn byte(light: u16) -> u8 {
    let guess = TABLES.guesses[usize::from(light >> GUESS_BITS)];
    let next = TABLES.least[usize::from(guess.saturating_add(1))];
    guess + u8::from(guess < u8::MAX && light >= next)
}

/// A mean of colours in the making, in linear light. A colour counts with its weight times its alpha: of alpha 0 it is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mix {
    light: [u64; 3],
    /// Sum of weights times alpha.
    present: u64,
    weight: u64,
}

impl Mix {
    /// Adds a colour, sRGB with straight alpha. The weights of all may come to 2^40.
    #[inline]
    pub fn add(&mut self, [red, green, blue, alpha]: [u8; 4], weight: u32) {
        let present = u64::from(alpha) * u64::from(weight);
        self.weight += u64::from(weight);
        self.present += present;
        for (sum, of) in self.light.iter_mut().zip([red, green, blue]) {
            *sum += present * u64::from(light(of));
        }
    }

    /// The mean. Alpha is the mean alpha. Black of alpha 0 if there is no colour.
    pub fn colour(&self) -> [u8; 4] {
        let Mix { light, present, weight } = *self;
        if present == 0 {
            return [0; 4];
        }
        let [red, green, blue] = light.map(|sum| byte(((sum + present / 2) / present) as u16));
        [red, green, blue, ((present + weight / 2) / weight) as u8]
    }

    /// The mean of three colours by shares that add up to 1, such as those of a place on a triangle.
    #[inline]
    pub fn of_triangle(colours: [[u8; 4]; 3], shares: [f32; 3]) -> [u8; 4] {
        if colours[0] == colours[1] && colours[0] == colours[2] {
            return colours[0];
        }
        let mut mix = Mix::default();
        (0..3).for_each(|i| mix.add_share(colours[i], shares[i]));
        mix.colour()
    }

    /// Adds a colour by its share of the whole. Less than a 65536th counts as none.
    #[inline]
    pub fn add_share(&mut self, colour: [u8; 4], share: f32) {
        self.add(colour, (share * 65_536.0 + 0.5) as u32);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn bytes_are_themselves_again_and_light_goes_to_the_nearest() {
        for byte_of in 0..=255 {
            assert_eq!(byte(light(byte_of)), byte_of);
        }
        assert_eq!((light(0), light(255)), (0, WHITE));
        // Published values of sRGB: a byte of 128 is 0.215861 of full light, one of 10 is 0.003035.
        assert_eq!([light(128), light(10)], [14146, 199]);
        let share =
            |light: f64| if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
        for of in 0..=WHITE {
            let exact = 255.0 * share(f64::from(of) / f64::from(WHITE));
            assert!((exact - f64::from(byte(of))).abs() <= 0.5 + 1e-3, "{of}: {exact}");
        }
    }

    #[test]
    fn black_and_white_are_mixed_as_light() {
        let mut mix = Mix::default();
        mix.add([0, 0, 0, 255], 7);
        mix.add([255, 255, 255, 255], 7);
        assert_eq!(mix.colour(), [188, 188, 188, 255]);
    }

    proptest! {
        #[test]
        fn equal_colours_stay_as_they_are(colour: [u8; 3], alphas in prop::collection::vec((1_u8.., 1_u32..1 << 20), 1..20)) {
            let mut mix = Mix::default();
            alphas.iter().for_each(|&(alpha, weight)| mix.add([colour[0], colour[1], colour[2], alpha], weight));
            prop_assert_eq!(&mix.colour()[..3], &colour[..]);
        }

        #[test]
        fn what_is_not_there_darkens_nothing(colour: [u8; 3], other: [u8; 3], weights: [u16; 2], shares in [0.01_f32..1.0, 0.0..0.5_f32]) {
            let [full, none] = [[colour[0], colour[1], colour[2], 255], [other[0], other[1], other[2], 0]];
            let mut mix = Mix::default();
            mix.add(full, 1 + u32::from(weights[0]));
            mix.add(none, weights[1].into());
            prop_assert_eq!(&mix.colour()[..3], &colour[..]);
            let shares = [shares[0], shares[1], 1.0 - shares[0] - shares[1]];
            prop_assert_eq!(&Mix::of_triangle([full, none, none], shares)[..3], &colour[..]);
        }

        #[test]
        fn no_order_matters(colours in prop::collection::vec((any::<[u8; 4]>(), any::<u16>()), 0..20)) {
            let mixed = |order: &mut dyn Iterator<Item = &([u8; 4], u16)>| {
                let mut mix = Mix::default();
                order.for_each(|&(colour, weight)| mix.add(colour, weight.into()));
                mix.colour()
            };
            prop_assert_eq!(mixed(&mut colours.iter()), mixed(&mut colours.iter().rev()));
        }
    }
}
