//! Determinants of integers of up to 62 bits, exact: on the stack, with no loop whose length depends on the numbers.
//!
//! Coordinates of scanners, of range images and of single precision are integers of so many bits once multiplied by a
//! power of two, and relative to a point nearby. Their determinants have up to 317 bits.

/// Bits of the largest absolute value a coordinate may have.
pub(super) const BITS: i32 = 62;

/// A vector of integers below `2^BITS` in absolute value.
pub(super) type Vector = [i64; 3];

/// `low + high * 2^64`, of 192 bits.
#[derive(Clone, Copy)]
struct I192 {
    low: u64,
    high: i128,
}

impl I192 {
    fn product(a: i128, b: i64) -> Self {
        let below = i128::from(a as u64) * i128::from(b);
        I192 { low: below as u64, high: i128::from((a >> 64) as i64) * i128::from(b) + (below >> 64) }
    }

    fn plus(self, other: Self) -> Self {
        let (low, carry) = self.low.overflowing_add(other.low);
        I192 { low, high: self.high + other.high + i128::from(carry) }
    }

    fn sign(self) -> i8 {
        if self.high == 0 { i8::from(self.low != 0) } else { self.high.signum() as i8 }
    }
}

/// A sum of products, by digits of 64 bits whose carries wait.
#[derive(Default)]
struct Sum([i128; 5]);

impl Sum {
    fn add_product(&mut self, a: i128, b: I192) {
        let (a0, a1) = (a as u64, (a >> 64) as i64);
        let (b0, b1, b2) = (b.low, b.high as u64, (b.high >> 64) as i64);
        for (digit, x, y) in [(0, a0, b0), (1, a0, b1)] {
            let product = u128::from(x) * u128::from(y);
            self.0[digit] += i128::from(product as u64);
            self.0[digit + 1] += i128::from((product >> 64) as u64);
        }
        let signed = [
            (1, i128::from(a1) * i128::from(b0)),
            (2, i128::from(a1) * i128::from(b1)),
            (2, i128::from(a0) * i128::from(b2)),
            (3, i128::from(a1) * i128::from(b2)),
        ];
        for (digit, product) in signed {
            self.0[digit] += i128::from(product as u64);
            self.0[digit + 1] += product >> 64;
        }
    }

    fn sign(self) -> i8 {
        let mut carry = 0;
        let mut digits = 0;
        for digit in &self.0[..4] {
            let digit = digit + carry;
            digits |= digit as u64;
            carry = digit >> 64;
        }
        let top = self.0[4] + carry;
        if top == 0 { i8::from(digits != 0) } else { top.signum() as i8 }
    }
}

/// a x b of the first two coordinates.
fn minor(a: &Vector, b: &Vector) -> i128 {
    i128::from(a[0]) * i128::from(b[1]) - i128::from(a[1]) * i128::from(b[0])
}

/// A determinant by its last column: the sum of three products.
fn expansion([a, b, c]: [(i64, i128); 3]) -> I192 {
    I192::product(a.1, a.0).plus(I192::product(b.1, b.0)).plus(I192::product(c.1, c.0))
}

/// Sign of det(a, b, c).
pub(super) fn determinant_sign([a, b, c]: &[Vector; 3]) -> i8 {
    expansion([(a[2], minor(b, c)), (b[2], minor(c, a)), (c[2], minor(a, b))]).sign()
}

/// 1 if the origin lies inside of the sphere through a, b, c, d, positively oriented, -1 if outside, 0 if on it.
pub(super) fn sphere_sign([a, b, c, d]: &[Vector; 4]) -> i8 {
    let (ab, ac, ad, bc, bd, cd) = (minor(a, b), minor(a, c), minor(a, d), minor(b, c), minor(b, d), minor(c, d));
    let square = |v: &Vector| v.iter().map(|&x| i128::from(x) * i128::from(x)).sum::<i128>();
    let mut sum = Sum::default();
    sum.add_product(square(a), expansion([(b[2], cd), (c[2], -bd), (d[2], bc)]));
    sum.add_product(square(b), expansion([(c[2], ad), (a[2], -cd), (d[2], -ac)]));
    sum.add_product(square(c), expansion([(a[2], bd), (b[2], -ad), (d[2], ab)]));
    sum.add_product(square(d), expansion([(b[2], ac), (a[2], -bc), (c[2], -ab)]));
    sum.sign()
}

#[cfg(test)]
mod tests {
    use num_bigint::{BigInt, Sign};
    use proptest::prelude::*;

    use super::*;

    fn sign_of(x: &BigInt) -> i8 {
        match x.sign() {
            Sign::Minus => -1,
            Sign::NoSign => 0,
            Sign::Plus => 1,
        }
    }

    fn determinant(rows: &[[BigInt; 3]; 3]) -> BigInt {
        let [a, b, c] = rows;
        let minor = |i: usize, j: usize| &b[i] * &c[j] - &b[j] * &c[i];
        &a[0] * minor(1, 2) + &a[1] * minor(2, 0) + &a[2] * minor(0, 1)
    }

    fn big(v: &Vector) -> [BigInt; 3] {
        v.map(BigInt::from)
    }

    /// Of all magnitudes, with the extremes and small numbers, whose determinants are often zero.
    fn coordinate() -> impl Strategy<Value = i64> {
        let limit = (1_i64 << BITS) - 1;
        prop_oneof![
            (0_u32..62, any::<i64>()).prop_map(|(shift, x)| (x >> 2) >> shift),
            -2_i64..3,
            prop::sample::select(vec![limit, -limit, 1 << 61, -(1 << 61), (1 << 32) - 1, 1 << 32]),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(base::tier::cases(4000)))]

        #[test]
        fn signs_are_those_of_integers_without_limit(
            v in prop::array::uniform4(prop::array::uniform3(coordinate()))
        ) {
            let [a, b, c, d] = v.each_ref().map(big);
            let square = |v: &[BigInt; 3]| v.iter().map(|x| x * x).sum::<BigInt>();
            let volume = |p: &[BigInt; 3], q: &[BigInt; 3], r: &[BigInt; 3]| {
                determinant(&[p.clone(), q.clone(), r.clone()])
            };
            prop_assert_eq!(determinant_sign(&[v[0], v[1], v[2]]), sign_of(&volume(&a, &b, &c)));
            let lifted = square(&a) * volume(&b, &c, &d) - square(&b) * volume(&a, &c, &d)
                + square(&c) * volume(&a, &b, &d) - square(&d) * volume(&a, &b, &c);
            prop_assert_eq!(sphere_sign(&v), sign_of(&lifted));
        }

        /// Five points of a lattice on one sphere, and the least step away from it.
        #[test]
        fn a_step_off_the_sphere_is_seen(shift in 1_u32..60, by in -1_i64..2) {
            let s = 1_i64 << shift;
            // The cube's corners 0 and s; the last of five is moved along x.
            let p = [s + by, s, s];
            let corners = [[0, 0, 0], [s, 0, 0], [0, s, 0], [0, 0, s]];
            let relative = corners.map(|v| [v[0] - p[0], v[1] - p[1], v[2] - p[2]]);
            prop_assert_eq!(sphere_sign(&relative), -by.signum() as i8);
        }
    }
}
