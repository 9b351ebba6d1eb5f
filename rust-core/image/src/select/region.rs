//! Regions of the world, and marks on single samples.

use glam::{DAffine3, DVec3};

use base::error::{Error, Result};
use base::magnitude;

/// A box anywhere in the world, turned and skewed as an affine transform can: three pairs of parallel sides. What lies on a side
/// is inside.
#[derive(Clone, Debug, PartialEq)]
pub struct OrientedBox {
    /// Unit normals of the sides.
    normals: [DVec3; 3],
    /// First and last place of each pair of sides along its normal.
    low: DVec3,
    high: DVec3,
}

impl OrientedBox {
    /// The box that the cube from -1 to 1 along each axis becomes.
    ///
    /// # Errors
    /// Numbers that are not finite or too large. A flat box.
    pub fn new(world_from_box: DAffine3) -> Result<Self> {
        let axes = world_from_box.matrix3;
        let axes = [axes.x_axis, axes.y_axis, axes.z_axis];
        let centre = magnitude::place("the centre of the box", world_from_box.translation)?;
        for (axis, name) in axes.into_iter().zip(["first", "second", "third"]) {
            magnitude::place(&format!("the {name} axis of the box"), axis)?;
        }
        let mut normals = [DVec3::ZERO; 3];
        let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
        for (i, name) in ["first", "second", "third"].into_iter().enumerate() {
            // Normalized first: lengths of thousandths and thousands multiply to anything.
            let across = [(i + 1) % 3, (i + 2) % 3].map(|k| axes[k].normalize_or_zero());
            let normal = across[0].cross(across[1]).normalize_or_zero();
            let half = normal.dot(axes[i]);
            if normal == DVec3::ZERO || half == 0.0 {
                return Err(Error::input(format!(
                    "the box is flat: its {name} axis leads out of the plane of the others by nothing. Give it a thickness."
                )));
            }
            normals[i] = if half > 0.0 { normal } else { -normal };
            let middle = normals[i].dot(centre);
            (low[i], high[i]) = (middle - half.abs(), middle + half.abs());
        }
        Ok(OrientedBox { normals, low, high })
    }

    /// The box along the world's axes between two corners.
    ///
    /// # Errors
    /// Numbers that are not finite or too large. `high` not above `low` along each axis.
    pub fn between(low: DVec3, high: DVec3) -> Result<Self> {
        magnitude::place("the low corner of the box", low)?;
        magnitude::place("the high corner of the box", high)?;
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            if low[axis] >= high[axis] {
                return Err(Error::input(format!(
                    "the box must be lower at its low corner than at its high one along {name}, got {} and {}",
                    low[axis], high[axis]
                )));
            }
        }
        Ok(OrientedBox { normals: DVec3::AXES, low, high })
    }

    /// Numbers of the box: of each side its unit normal, where the box begins along each, and where it ends.
    pub fn numbers(&self) -> [f64; 15] {
        let sides = [self.normals[0], self.normals[1], self.normals[2], self.low, self.high];
        std::array::from_fn(|i| sides[i / 3][i % 3])
    }

    /// The box of [`OrientedBox::numbers`], to the bit.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn of_numbers(numbers: [f64; 15]) -> Result<Self> {
        finite("the box", &numbers)?;
        let [a, b, c, low, high] = std::array::from_fn(|i| DVec3::from_slice(&numbers[3 * i..]));
        Ok(OrientedBox { normals: [a, b, c], low, high })
    }

    /// Whether a place in the world lies in the box or on its sides.
    pub fn contains(&self, at: DVec3) -> bool {
        (0..3).all(|i| {
            let along = self.normals[i].dot(at);
            self.low[i] <= along && along <= self.high[i]
        })
    }
}

/// A plane in the world with two sides, above and below. As a region it is all that lies below, on it, and up to a margin above:
/// a table or the ground, with what noise lifts off it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    normal: DVec3,
    offset: f64,
    margin: f64,
}

impl Plane {
    /// The plane through a point. `normal`, of any length, points above.
    ///
    /// # Errors
    /// Numbers that are not finite or too large, a normal of length 0.
    pub fn new(point: DVec3, normal: DVec3, margin: f64) -> Result<Self> {
        magnitude::place("the point of the plane", point)?;
        magnitude::direction("the normal of the plane", normal)?;
        magnitude::coordinate("the margin of the plane", margin)?;
        // Along an axis exactly, so that heights are the coordinates.
        let longest = normal.abs().max_element();
        let normal = (normal / longest).normalize();
        Ok(Plane { normal, offset: normal.dot(point), margin })
    }

    /// The plane through three points. Above is where they turn counter-clockwise. No margin.
    ///
    /// # Errors
    /// Numbers that are not finite or too large. Points on one line.
    pub fn through([a, b, c]: [DVec3; 3]) -> Result<Self> {
        for (point, name) in [a, b, c].into_iter().zip(["first", "second", "third"]) {
            magnitude::place(&format!("the {name} point of the plane"), point)?;
        }
        let normal = (b - a).normalize_or_zero().cross((c - a).normalize_or_zero());
        if normal == DVec3::ZERO {
            return Err(Error::input("the three points lie on one line: pick points that span a plane"));
        }
        Plane::new(a, normal, 0.0)
    }

    /// Numbers of the plane: its unit normal, its distance from the origin along it, and its margin.
    pub fn numbers(&self) -> [f64; 5] {
        let [x, y, z] = self.normal.to_array();
        [x, y, z, self.offset, self.margin]
    }

    /// The plane of [`Plane::numbers`], to the bit.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn of_numbers(numbers: [f64; 5]) -> Result<Self> {
        finite("the plane", &numbers)?;
        let [x, y, z, offset, margin] = numbers;
        Ok(Plane { normal: DVec3::new(x, y, z), offset, margin })
    }

    /// Unit length, points above.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Points that lie at most so far above belong to the region. Below 0 only points that lie deeper do.
    pub fn margin(&self) -> f64 {
        self.margin
    }

    /// The point of the plane nearest to the origin.
    pub fn point(&self) -> DVec3 {
        self.normal * self.offset
    }

    /// Height of a place above the plane. Negative below.
    pub fn height(&self, at: DVec3) -> f64 {
        self.normal.dot(at) - self.offset
    }

    /// The same plane with above and below exchanged.
    #[must_use]
    pub fn flipped(self) -> Self {
        Plane { normal: -self.normal, offset: -self.offset, ..self }
    }

    /// The same plane with another margin.
    ///
    /// # Errors
    /// One that is not finite or too large.
    pub fn with_margin(self, margin: f64) -> Result<Self> {
        Ok(Plane { margin: magnitude::coordinate("the margin of the plane", margin)?, ..self })
    }

    /// The same plane so that a place lies above.
    ///
    /// # Errors
    /// A place that is not finite, or on the plane.
    pub fn facing(self, place: DVec3) -> Result<Self> {
        let height = self.height(magnitude::place("the place above the plane", place)?);
        match height.partial_cmp(&0.0) {
            Some(std::cmp::Ordering::Greater) => Ok(self),
            Some(std::cmp::Ordering::Less) => Ok(self.flipped()),
            _ => Err(Error::input(
                "the place that tells which side of the plane is above lies on the plane: choose one off it",
            )),
        }
    }

    /// Whether a place in the world lies below the plane, on it, or at most the margin above.
    pub fn contains(&self, at: DVec3) -> bool {
        self.height(at) <= self.margin
    }
}

/// Marks on the samples of one scan: a pixel of a range image, a vertex of a mesh or a point of a cloud each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    rows: usize,
    cols: usize,
    /// Eight samples a byte.
    bits: Vec<u8>,
}

impl Mask {
    /// Of a range image: one mark a pixel, row by row.
    ///
    /// # Errors
    /// Another number of marks than of pixels.
    pub fn of_image(rows: usize, cols: usize, marks: &[bool]) -> Result<Self> {
        if rows.checked_mul(cols) != Some(marks.len()) {
            return Err(Error::input(format!(
                "a mask of {rows} x {cols} pixels needs as many marks, got {}",
                marks.len()
            )));
        }
        let bits = marks.chunks(8).map(|eight| eight.iter().rev().fold(0, |byte, &mark| byte << 1 | u8::from(mark)));
        Ok(Mask { rows, cols, bits: bits.collect() })
    }

    /// Of a mesh or a cloud: one mark a vertex or a point.
    pub fn of_list(marks: &[bool]) -> Self {
        let bits = marks.chunks(8).map(|eight| eight.iter().rev().fold(0, |byte, &mark| byte << 1 | u8::from(mark)));
        Mask { rows: marks.len(), cols: 1, bits: bits.collect() }
    }

    /// Rows and columns of the image that it is of. Of a list its length and 1.
    pub fn size(&self) -> [usize; 2] {
        [self.rows, self.cols]
    }

    /// Its marks, eight a byte, the first in the lowest bit.
    pub fn bits(&self) -> &[u8] {
        &self.bits
    }

    /// The mask of [`Mask::size`] and [`Mask::bits`].
    ///
    /// # Errors
    /// Another number of bytes than the size asks for.
    pub fn of_bits([rows, cols]: [usize; 2], bits: Vec<u8>) -> Result<Self> {
        let wanted = rows.checked_mul(cols).map(|marks| marks.div_ceil(8));
        if wanted == Some(bits.len()) {
            return Ok(Mask { rows, cols, bits });
        }
        Err(Error::input(format!(
            "a mask of {rows} x {cols} samples must have a bit per sample, got {} bytes",
            bits.len()
        )))
    }

    /// Whether a sample is marked.
    ///
    /// # Panics
    /// If there is no such sample.
    pub fn is_marked(&self, index: usize) -> bool {
        assert!(index < self.rows * self.cols, "sample {index} of a mask of {}", self.rows * self.cols);
        self.bits[index / 8] >> (index % 8) & 1 == 1
    }

    /// Checks that the mask is of an image of this size.
    pub(super) fn fits_image(&self, rows: usize, cols: usize) -> Result<()> {
        if [self.rows, self.cols] == [rows, cols] {
            return Ok(());
        }
        Err(Error::input(format!("the mask has {} x {} pixels, but the image {rows} x {cols}", self.rows, self.cols)))
    }

    /// Checks that the mask is of a list of so many `things`.
    pub(super) fn fits_list(&self, count: usize, things: &str) -> Result<()> {
        if self.rows * self.cols == count {
            return Ok(());
        }
        Err(Error::input(format!("the mask has {} marks for {count} {things}: give one each", self.rows * self.cols)))
    }
}

fn finite(what: &str, numbers: &[f64]) -> Result<()> {
    match numbers.iter().find(|number| !number.is_finite()) {
        None => Ok(()),
        Some(number) => Err(Error::input(format!("a number of {what} is {number}, but must be finite"))),
    }
}
