//! Numbers of twice the precision of a double: what is left where the leading digits of products cancel. \[Dek71\]

use std::ops::{Add, Mul, Sub};

use glam::DVec3;

/// A number as the unevaluated sum of two doubles, about 106 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DoubleDouble {
    high: f64,
    /// At most half of the last bit of `high`.
    low: f64,
}

impl DoubleDouble {
    /// The sum, exact unless it overflows.
    fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let b_part = high - a;
        DoubleDouble { high, low: (a - (high - b_part)) + (b - b_part) }
    }

    /// The difference, exact unless it overflows.
    pub fn difference(a: f64, b: f64) -> Self {
        DoubleDouble::sum(a, -b)
    }

    /// Rounded to a double.
    pub fn value(self) -> f64 {
        self.high
    }
}

impl Add for DoubleDouble {
    type Output = DoubleDouble;

    fn add(self, other: DoubleDouble) -> DoubleDouble {
        let (high, low) = (DoubleDouble::sum(self.high, other.high), DoubleDouble::sum(self.low, other.low));
        let high = DoubleDouble::sum(high.high, high.low + low.high);
        DoubleDouble::sum(high.high, high.low + low.low)
    }
}

impl Sub for DoubleDouble {
    type Output = DoubleDouble;

    fn sub(self, other: DoubleDouble) -> DoubleDouble {
        self + DoubleDouble { high: -other.high, low: -other.low }
    }
}

impl Mul for DoubleDouble {
    type Output = DoubleDouble;

    fn mul(self, other: DoubleDouble) -> DoubleDouble {
        let high = self.high * other.high;
        let lost = self.high.mul_add(other.high, -high);
        DoubleDouble::sum(high, lost + (self.high * other.low + self.low * other.high))
    }
}

/// A vector of such numbers.
pub type Vector = [DoubleDouble; 3];

/// `a - b`, exact unless it overflows.
pub fn difference(a: DVec3, b: DVec3) -> Vector {
    [0, 1, 2].map(|k| DoubleDouble::difference(a[k], b[k]))
}

/// The inner product.
pub fn dot(a: Vector, b: Vector) -> DoubleDouble {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector product.
pub fn cross(a: Vector, b: Vector) -> Vector {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A number of up to 100 bits, and the same as an integer.
    fn number() -> impl Strategy<Value = (DoubleDouble, i128)> {
        (any::<i32>(), -(1_i64 << 50)..1 << 50).prop_map(|(high, low)| {
            let high = i128::from(high) << 60;
            (DoubleDouble::sum(high as f64, low as f64), high + i128::from(low))
        })
    }

    proptest! {
        #[test]
        fn sums_and_products_keep_a_hundred_bits((a, exact_a) in number(), (b, exact_b) in number(), small in -999_i32..1000) {
            let difference = |found: DoubleDouble, exact: i128| (found - DoubleDouble::sum(exact as f64, 0.0)).value();
            let close = |found: DoubleDouble, exact: i128| {
                let rest = exact - exact as f64 as i128;
                (difference(found, exact) - rest as f64).abs() <= exact.abs() as f64 * 2.0_f64.powi(-100)
            };
            prop_assert!(close(a + b, exact_a + exact_b));
            prop_assert!(close(a - b, exact_a - exact_b));
            prop_assert!(close(a * DoubleDouble::sum(small.into(), 0.0), exact_a * i128::from(small)));
        }

        /// Binomial formula, whose doubles cancel where the numbers are nearly the same.
        #[test]
        fn what_cancels_is_kept(a in -1e9..1e9, b in -1e9..1e9) {
            let square = DoubleDouble::difference(a, b) * DoubleDouble::difference(a, b);
            let expanded = DoubleDouble::difference(a, 0.0) * DoubleDouble::difference(a, 2.0 * b) + DoubleDouble::difference(b, 0.0) * DoubleDouble::difference(b, 0.0);
            prop_assert!((square - expanded).value().abs() <= (a * a + b * b) * 2.0_f64.powi(-98));
        }
    }
}
