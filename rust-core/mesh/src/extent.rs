//! Extent of coordinates, and their precision: they decide how files hold them.

use glam::DVec3;

/// The box around positions, and whether single precision holds them all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// The lowest corner. Infinite if there is no position.
    pub low: DVec3,
    /// The highest. Infinite the other way.
    pub high: DVec3,
    /// Whether single precision holds every coordinate exactly.
    pub single: bool,
}

impl Default for Extent {
    fn default() -> Self {
        Extent { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY, single: true }
    }
}

impl Extent {
    /// The extent of positions, which are finite.
    pub fn of(positions: &[DVec3]) -> Self {
        let mut extent = Extent::default();
        positions.iter().for_each(|&position| extent.add(position));
        extent
    }

    /// Takes in a finite position.
    pub fn add(&mut self, position: DVec3) {
        self.low = self.low.min(position);
        self.high = self.high.max(position);
        self.single &= position.as_vec3().as_dvec3() == position;
    }

    /// Whether there is no position.
    pub fn is_empty(&self) -> bool {
        self.low.x > self.high.x
    }

    /// The coordinate of largest magnitude. 0 of none.
    pub fn largest(&self) -> f64 {
        if self.is_empty() { 0.0 } else { self.low.abs().max(self.high.abs()).max_element() }
    }

    /// The longest side of the box. 0 of none.
    pub fn side(&self) -> f64 {
        if self.is_empty() { 0.0 } else { (self.high - self.low).max_element() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn box_magnitude_and_precision() {
        let none = Extent::default();
        assert!(none.is_empty() && none.single && (none.largest(), none.side()) == (0.0, 0.0));
        let exact = Extent::of(&[DVec3::new(-3e7, 1.5, 0.0), DVec3::new(-3e7, -2.0, 0.25)]);
        assert!(exact.single && !exact.is_empty() && (exact.largest(), exact.side()) == (3e7, 3.5));
        assert_eq!((exact.low, exact.high), (DVec3::new(-3e7, -2.0, 0.0), DVec3::new(-3e7, 1.5, 0.25)));
        for fine in [DVec3::new(3e7 + 1.0, 0.0, 0.0), DVec3::new(0.0, 0.1, 0.0), DVec3::new(0.0, 0.0, 1e39)] {
            assert!(!Extent::of(&[fine]).single, "{fine}");
        }
    }
}
