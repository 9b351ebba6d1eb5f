//! Colours of the surface from those of the scans that cross it.
//!
//! Of the scans that cross an edge of the grid a few are kept as **members**, each with its own colour. So one that is too bright can be
//! corrected when all are known ([`crate::colour::gains`]), and highlights can be outvoted. A number made of the member's own content
//! decides which are kept. So neither the order of scans, nor how they are shared among threads, nor where bricks begin can matter. A
//! thousand scans take as much as four. Weights have no say in it: a surface that faces its camera weighs most, and reflects the camera's
//! lamp.

use bytemuck::{Pod, Zeroable};
use mesh::srgb;
use rustc_hash::FxHashMap;

use super::scan_order::ScanOrder;

/// Members kept of an edge: two highlights among them are outvoted.
pub const KEPT: usize = 4;
const WORDS: usize = 3;

/// Members as they are kept, in three words of 16 bits each: bits 0 to 3 number of the weight, 4 to 23 scan, 24 to 47 colour. Those that
/// there are come first, rising.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Members([[u16; WORDS]; KEPT]);

const WEIGHT_BITS: u32 = 4;
const SCAN_BITS: u32 = 20;
/// Weights by number: 0 is none, others rise by 2 in two steps.
const WEIGHTS: [u32; 1 << WEIGHT_BITS] = [0, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256];

/// The colour of a scan at an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Member {
    /// Number of the scan.
    pub scan: u32,
    /// Its weight, 2 to 256.
    pub weight: u32,
    /// sRGB.
    pub colour: [u8; 3],
}

impl Members {
    /// One, of a weight from 0 to 1. None if alpha is 0.
    pub fn of(scan: u32, [red, green, blue, alpha]: [u8; 4], weight: f64) -> Self {
        let mut members = Members::default();
        if alpha > 0 {
            let weight = (weight * f64::from(alpha) * (256.0 / 255.0)) as u32;
            let number = WEIGHTS.partition_point(|&of| of <= weight).clamp(2, WEIGHTS.len()) as u64 - 1;
            let colour = u64::from(u32::from_le_bytes([red, green, blue, 0]));
            members.0[0] = words(number | u64::from(scan) << WEIGHT_BITS | colour << (WEIGHT_BITS + SCAN_BITS));
        }
        members
    }

    /// Whether there is none.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.0[0] == [0; WORDS]
    }

    fn packed(&self) -> impl Iterator<Item = u64> {
        self.0
            .iter()
            .map(|&[a, b, c]| u64::from(a) | u64::from(b) << 16 | u64::from(c) << 32)
            .take_while(|&bits| bits > 0)
    }

    /// Those there are.
    pub fn iter(&self) -> impl Iterator<Item = Member> {
        self.packed().map(|bits| {
            let [red, green, blue, _] = ((bits >> (WEIGHT_BITS + SCAN_BITS)) as u32).to_le_bytes();
            Member {
                scan: (bits >> WEIGHT_BITS) as u32 & ((1 << SCAN_BITS) - 1),
                weight: WEIGHTS[bits as usize & (WEIGHTS.len() - 1)],
                colour: [red, green, blue],
            }
        })
    }

    /// Adds others of the same edge.
    #[inline]
    pub fn add(&mut self, other: &Members) {
        if other.is_empty() {
            return;
        }
        if self.is_empty() {
            *self = *other;
            return;
        }
        let mut all = [0_u64; 2 * KEPT];
        let mut count = 0;
        for bits in self.packed().chain(other.packed()) {
            all[count] = bits;
            count += 1;
        }
        if count > KEPT {
            all[..count].sort_unstable_by_key(|&bits| (mixed(bits), bits));
            count = KEPT;
        }
        all[..count].sort_unstable();
        (0..KEPT).for_each(|i| self.0[i] = if i < count { words(all[i]) } else { [0; WORDS] });
    }

    /// A number that follows from nothing but the members.
    pub fn hash(&self) -> u64 {
        self.packed().fold(0, |hash, bits| mixed(hash ^ bits))
    }
}

fn words(bits: u64) -> [u16; WORDS] {
    [bits as u16, (bits >> 16) as u16, (bits >> 32) as u16]
}

fn mixed(bits: u64) -> u64 {
    let bits = bits.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (bits ^ bits >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93)
}

/// Factors of the light of each scan. Nothing if scans agree.
#[derive(Default)]
pub struct Gains {
    /// By the scan's number, in units of 1 / 2^16.
    of_scan: FxHashMap<u32, [u32; 3]>,
}

const ONE: f64 = 65_536.0;
/// Light that is as good as infinite: sixteen times white.
const BRIGHTEST: u64 = 1 << 20;

impl Gains {
    /// From the factors of each scan of the order, or none.
    pub fn new(factors: &[[f64; 3]], scan_order: &ScanOrder<'_>) -> Self {
        let of_scan = |(&number, of): (&u32, &[f64; 3])| (number, of.map(|factor| (factor * ONE).round() as u32));
        Gains { of_scan: scan_order.numbers().iter().zip(factors).map(of_scan).collect() }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.of_scan.is_empty()
    }

    /// Those of the scan of a number.
    pub fn of(&self, number: u32) -> Option<[u32; 3]> {
        self.of_scan.get(&number).copied()
    }

    /// Whether they agree on all scans that both know, and on whether there are any.
    pub fn agree_with(&self, other: &Gains) -> bool {
        let is_same = |(number, of): (&u32, &[u32; 3])| other.of_scan.get(number).is_none_or(|known| known == of);
        self.is_empty() == other.is_empty() && self.of_scan.iter().all(is_same)
    }

    /// The light of a member as all scans would have it.
    #[inline]
    pub fn equalized(&self, member: &Member) -> [u64; 3] {
        let light = member.colour.map(|byte| u64::from(srgb::light(byte)));
        match self.of_scan.get(&member.scan) {
            None => light,
            Some(gains) => [0, 1, 2].map(|i| ((light[i] * u64::from(gains[i]) + (1 << 15)) >> 16).min(BRIGHTEST)),
        }
    }
}

/// A colour that is more than so many times as bright as the middle one, of two the darker one, is a highlight: those only add light. A
/// little more is none, however dark the place is.
const BRIGHTER: u64 = 9;
const BRIGHTER_THAN: u64 = 8;
const NO_HIGHLIGHT: u64 = 200;
/// Shares of the channels in brightness (ITU-R BT.709), of 10,000.
const SHARES: [u64; 3] = [2126, 7152, 722];

/// The members of all edges that tell the colour of a vertex.
#[derive(Default)]
pub struct Poll {
    members: Vec<Lit>,
}

/// A member's colour as light, made equally bright.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Lit {
    brightness: u64,
    light: [u64; 3],
    weight: u64,
}

/// Edges count with as many crossings as they have, but no more than these.
const MOST_CROSSINGS: u32 = 1 << 16;
/// A multiple of each number of members, by which the crossings of their edge are divided.
const DIVISIBLE: u64 = 12;

impl Poll {
    /// Adds the members of an edge with so many crossings.
    pub fn add(&mut self, members: &Members, crossings: u32, gains: &Gains) {
        let count = members.packed().count() as u64;
        for member in members.iter() {
            let light = gains.equalized(&member);
            let brightness = (0..3).map(|channel| SHARES[channel] * light[channel]).sum::<u64>() / 10_000;
            let share = u64::from(crossings.min(MOST_CROSSINGS)) * DIVISIBLE / count;
            self.members.push(Lit { brightness, light, weight: share * u64::from(member.weight) });
        }
    }

    /// The mean colour without highlights. Alpha is 0 where nobody has a say. Forgets all.
    pub fn decide(&mut self) -> [u8; 4] {
        if self.members.is_empty() {
            return [0; 4];
        }
        self.members.sort_unstable();
        let middle = self.members[(self.members.len() - 1) / 2].brightness;
        let most = middle * BRIGHTER / BRIGHTER_THAN + NO_HIGHLIGHT;
        let (mut light, mut total) = ([0_u64; 3], 0);
        for member in self.members.drain(..).filter(|member| member.brightness <= most) {
            total += member.weight;
            (0..3).for_each(|channel| light[channel] += member.weight * member.light[channel]);
        }
        let [red, green, blue] =
            light.map(|sum| srgb::byte(((sum + total / 2) / total).min(srgb::WHITE.into()) as u16));
        [red, green, blue, u8::MAX]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn sum(list: &[Members]) -> Members {
        let mut all = Members::default();
        list.iter().for_each(|members| all.add(members));
        all
    }

    /// The colour of a vertex where scans have these grey bytes.
    fn decided(bytes: &[u8]) -> u8 {
        let list = bytes.iter().zip(0..).map(|(&byte, scan)| Members::of(scan, [byte, byte, byte, 255], 1.0));
        let mut poll = Poll::default();
        poll.add(&sum(&list.collect::<Vec<_>>()), bytes.len() as u32, &Gains::default());
        poll.decide()[0]
    }

    #[test]
    fn a_member_is_what_it_was_made_of() {
        let [low, high] = [0.001, 1.0].map(|weight| Members::of((1 << SCAN_BITS) - 1, [1, 2, 255, 255], weight));
        for (members, weight) in [(low, 2), (high, 256)] {
            let expected = Member { scan: (1 << SCAN_BITS) - 1, weight, colour: [1, 2, 255] };
            assert_eq!(members.iter().collect::<Vec<_>>(), [expected]);
        }
        assert!(Members::of(0, [0, 0, 0, 1], 0.0).iter().eq([Member { scan: 0, weight: 2, colour: [0; 3] }]));
        assert!(Members::of(3, [1, 2, 3, 0], 1.0).is_empty());
    }

    #[test]
    fn highlights_are_outvoted_and_of_two_scans_the_darker_counts() {
        for bytes in [[100, 100, 255], [255, 100, 100], [100, 255, 100]] {
            assert_eq!(decided(&bytes), 100);
        }
        assert_eq!(decided(&[100, 255, 100, 255]), 100);
        assert_eq!(decided(&[0, 0, 255]), 0);
        assert_eq!(decided(&[255, 100]), 100);
        // Noise is averaged.
        assert_eq!(decided(&[100, 104, 102]), 102);
        assert_eq!(decided(&[100, 104]), 102);
    }

    #[test]
    fn many_scans_are_represented_alike() {
        let mut counts = [0; 20];
        for edge in 0..500_u32 {
            let list = (0..20).map(|scan| {
                let weight = if scan % 2 == 0 { 1.0 } else { 0.25 };
                Members::of(scan, [edge as u8, (edge >> 8) as u8, 7, 255], weight)
            });
            sum(&list.collect::<Vec<_>>()).iter().for_each(|member| counts[member.scan as usize] += 1);
        }
        assert_eq!(counts.iter().sum::<usize>(), 500 * KEPT);
        assert!(counts.iter().all(|count| (60..140).contains(count)), "{counts:?}");
    }

    proptest! {
        #[test]
        fn neither_order_nor_splits_matter(
            of in prop::collection::vec((0_u32..9, any::<[u8; 4]>(), 0.0..1.0_f64), 0..30),
            cut in 0..30_usize,
        ) {
            let list: Vec<Members> = of.iter().map(|&(scan, colour, weight)| Members::of(scan, colour, weight)).collect();
            let expected = sum(&list);
            let mut turned = list.clone();
            turned.reverse();
            prop_assert_eq!(sum(&turned), expected);
            let (first, second) = list.split_at(cut.min(list.len()));
            prop_assert_eq!(sum(&[sum(second), sum(first)]), expected);
            let decided = |edges: [&Members; 2]| {
                let mut poll = Poll::default();
                edges.iter().for_each(|members| poll.add(members, 5, &Gains::default()));
                poll.decide()
            };
            let [first, second] = [sum(first), sum(second)];
            prop_assert_eq!(decided([&first, &second]), decided([&second, &first]));
        }

        #[test]
        fn equal_colours_stay_as_they_are(colour: [u8; 3], weights in prop::collection::vec(0.0..1.0_f64, 1..12)) {
            let [red, green, blue] = colour;
            let list = weights.iter().zip(0..).map(|(&weight, scan)| Members::of(scan, [red, green, blue, 255], weight));
            let mut poll = Poll::default();
            list.for_each(|members| poll.add(&members, 1, &Gains::default()));
            prop_assert_eq!(poll.decide(), [red, green, blue, 255]);
        }
    }
}
