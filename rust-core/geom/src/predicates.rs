//! Signs of determinants, exact: the one place where topology is decided.
//!
//! A sign is 1, 0 or -1. The floating-point arithmetic is that of the crate `robust` (adaptive precision behind a filter, after Shewchuk
//! 1997), exact for coordinates whose products of five neither overflow nor underflow. [`Arithmetic`] says which arithmetic a set of points
//! needs. Big integers take the rest.

use glam::{DVec2, DVec3, Vec3Swizzles};
use num_bigint::{BigInt, Sign};
use robust::{Coord, Coord3D};

use super::wide;

fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

/// 1 if a, b, c turn counter-clockwise, -1 if clockwise, 0 if they lie on a line.
pub fn orient2d(a: DVec2, b: DVec2, c: DVec2) -> i8 {
    let [a, b, c] = [a, b, c].map(|p| Coord { x: p.x, y: p.y });
    sign(robust::orient2d(a, b, c))
}

/// 1 if d lies on the side of the plane of a, b, c from which these turn clockwise, -1 if on the other, 0 if in the plane.
pub fn orient3d(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> i8 {
    let [a, b, c, d] = [a, b, c, d].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    sign(robust::orient3d(a, b, c, d))
}

/// The cheapest arithmetic that finds all signs of a set of points exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Arithmetic {
    /// Plain doubles: points of so small a lattice that no determinant is ever rounded.
    Double,
    /// Integers of 320 bits if the differences of the coordinates, multiplied by `scale`, have at most 62 bits. They have in range images,
    /// in single precision and wherever the points of one sign are close to each other. Sums of doubles elsewhere.
    Adaptive {
        /// A power of two that makes all coordinates integers.
        scale: f64,
    },
    /// Integers of any length.
    Big {
        /// Whether doubles approximate the determinants at all, so that a filter may be put before.
        normal: bool,
    },
}

/// Exponents of the least bits between which the products of five doubles neither overflow nor underflow.
const LEAST_BIT: i32 = -200;

impl Arithmetic {
    /// The arithmetic that `points` need, none of which is NaN or infinite, and the power of two to multiply them by first.
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> (Self, f64) {
        let (mut lowest, mut highest, mut largest) = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0.0_f64);
        let mut least_bit = i32::MAX;
        for p in points {
            (lowest, highest) = (lowest.min(p), highest.max(p));
            largest = largest.max(p.abs().max_element());
            for x in p.to_array() {
                least_bit = least_bit.min(exponent_of_least_bit(x));
            }
        }
        if least_bit == i32::MAX {
            return (Arithmetic::Double, 1.0);
        }
        // Largest below 1 afterwards, by a factor that is a number.
        let shift = (-exponent(largest) - 1).min(1000);
        if least_bit + shift < -1074 {
            return (Arithmetic::Big { normal: false }, 1.0);
        }
        let factor = power_of_two(shift);
        let lattice = power_of_two(-(least_bit + shift).max(-1000));
        let steps = (highest * factor - lowest * factor) * lattice;
        let arithmetic = if least_bit + shift < LEAST_BIT {
            Arithmetic::Big { normal: true }
        } else if 24.0 * steps.x * steps.y * steps.z * steps.length_squared() < 9e15 {
            Arithmetic::Double
        } else {
            Arithmetic::Adaptive { scale: lattice }
        };
        (arithmetic, factor)
    }
}

/// Sign of the volume of the tetrahedron a, b, c, d. It is 1 if a, b, c turn counter-clockwise seen from d's other side, that is if det(b -
/// a, c - a, d - a) > 0.
pub fn volume_sign(points: [DVec3; 4], arithmetic: Arithmetic) -> i8 {
    let [a, b, c, d] = points;
    match arithmetic {
        Arithmetic::Adaptive { scale } => match integers([a, b, c], d, scale) {
            Some(relative) => -wide::determinant_sign(&relative),
            None => -orient3d(a, b, c, d),
        },
        Arithmetic::Big { .. } => {
            let [a, b, c, d] = points.map(big);
            let [a, b, c] = [a, b, c].map(|p| difference(&p, &d));
            -sign_of(&determinant(&a, &b, &c))
        }
        Arithmetic::Double => -orient3d(a, b, c, d),
    }
}

/// Whether three points lie on one line.
pub fn are_collinear(points: [DVec3; 3], arithmetic: Arithmetic) -> bool {
    let [a, b, c] = points;
    if matches!(arithmetic, Arithmetic::Big { .. }) {
        let [a, b, c] = points.map(big);
        let (u, v) = (difference(&b, &a), difference(&c, &a));
        return [(0, 1), (1, 2), (2, 0)].iter().all(|&(i, j)| &u[i] * &v[j] == &u[j] * &v[i]);
    }
    orient2d(a.truncate(), b.truncate(), c.truncate()) == 0
        && orient2d(a.zxy().truncate(), b.zxy().truncate(), c.zxy().truncate()) == 0
        && orient2d(a.yzx().truncate(), b.yzx().truncate(), c.yzx().truncate()) == 0
}

/// 1 if the last point lies inside the sphere through the other four, which are positively oriented ([`volume_sign`]), -1
/// if outside, 0 if on it.
pub fn sphere_sign(points: [DVec3; 5], arithmetic: Arithmetic) -> i8 {
    match arithmetic {
        Arithmetic::Adaptive { scale } => {
            let [a, b, c, d, p] = points;
            match integers([a, b, c, d], p, scale) {
                Some(relative) => wide::sphere_sign(&relative),
                None => insphere(points),
            }
        }
        Arithmetic::Big { .. } => {
            let p = big(points[4]);
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| difference(&big(points[i]), &p));
            sign_of(&lifted(&a, &b, &c, &d))
        }
        Arithmetic::Double => insphere(points),
    }
}

fn insphere(points: [DVec3; 5]) -> i8 {
    let [a, b, c, d, p] = points.map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    -sign(robust::insphere(a, b, c, d, p))
}

/// `points - origin` in steps of the lattice, exact. `None` if that takes more than 62 bits.
fn integers<const N: usize>(points: [DVec3; N], origin: DVec3, scale: f64) -> Option<[wide::Vector; N]> {
    const LIMIT: f64 = (1_i64 << (wide::BITS - 1)) as f64;
    let mut largest = 0.0_f64;
    let mut relative = [[0; 3]; N];
    for (relative, p) in relative.iter_mut().zip(points) {
        for (k, to) in relative.iter_mut().enumerate() {
            // The difference and what its rounding took away (Shewchuk 1997, theorem 7): multiples of the lattice's step, both.
            let (a, b) = (p[k], origin[k]);
            let difference = a - b;
            let b_part = a - difference;
            let rounded_away = (a - (difference + b_part)) + (b_part - b);
            largest = largest.max((difference * scale).abs());
            // Overflows only where the limit is passed, and nothing is returned.
            *to = ((difference * scale) as i64).wrapping_add((rounded_away * scale) as i64);
        }
    }
    (largest < LIMIT).then_some(relative)
}

/// The coordinates as integers, in units of the smallest double.
fn big(p: DVec3) -> [BigInt; 3] {
    p.to_array().map(|x| {
        let (mantissa, exponent) = decode(x);
        BigInt::from(mantissa) << (exponent + 1074) as usize
    })
}

fn difference(a: &[BigInt; 3], b: &[BigInt; 3]) -> [BigInt; 3] {
    [0, 1, 2].map(|i| &a[i] - &b[i])
}

fn sign_of(x: &BigInt) -> i8 {
    match x.sign() {
        Sign::Minus => -1,
        Sign::NoSign => 0,
        Sign::Plus => 1,
    }
}

fn determinant<T>(a: &[T; 3], b: &[T; 3], c: &[T; 3]) -> T
where
    T: std::ops::Add<Output = T> + std::ops::Sub<Output = T>,
    for<'a> &'a T: std::ops::Mul<Output = T>,
{
    let minor = |i: usize, j: usize| &b[i] * &c[j] - &b[j] * &c[i];
    &a[0] * &minor(1, 2) + &a[1] * &minor(2, 0) + &a[2] * &minor(0, 1)
}

/// The determinant of the sphere through a, b, c, d around the origin.
fn lifted<T>(a: &[T; 3], b: &[T; 3], c: &[T; 3], d: &[T; 3]) -> T
where
    T: std::ops::Add<Output = T> + std::ops::Sub<Output = T>,
    for<'a> &'a T: std::ops::Mul<Output = T>,
{
    let square = |v: &[T; 3]| &v[0] * &v[0] + &v[1] * &v[1] + &v[2] * &v[2];
    &square(a) * &determinant(b, c, d) - &square(b) * &determinant(a, c, d) + &square(c) * &determinant(a, b, d)
        - &square(d) * &determinant(a, b, c)
}

/// Mantissa and exponent: `x = mantissa * 2^exponent`.
fn decode(x: f64) -> (i64, i32) {
    let bits = x.to_bits();
    let fraction = (bits & ((1 << 52) - 1)) as i64;
    let biased = (bits >> 52 & 0x7ff) as i32;
    let (mantissa, exponent) = if biased == 0 { (fraction, -1074) } else { (fraction | 1 << 52, biased - 1075) };
    (if x < 0.0 { -mantissa } else { mantissa }, exponent)
}

fn exponent_of_least_bit(x: f64) -> i32 {
    let (mantissa, exponent) = decode(x);
    if mantissa == 0 { i32::MAX } else { exponent + mantissa.trailing_zeros() as i32 }
}

/// Of the highest bit of a positive number.
fn exponent(x: f64) -> i32 {
    let (mantissa, exponent) = decode(x);
    exponent + 63 - mantissa.leading_zeros() as i32
}

fn power_of_two(exponent: i32) -> f64 {
    // In two steps, for the powers that only denormal numbers need.
    let half = exponent / 2;
    2.0_f64.powi(half) * 2.0_f64.powi(exponent - half)
}
