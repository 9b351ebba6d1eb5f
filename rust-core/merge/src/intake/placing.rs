//! Whether scans plainly do not lie where they belong.

use crate::report::{MergeReport, Warning, WarningKind};
use base::error::Shown;
use image::source::OrientedSurface;

/// Scans do not fit if they lie apart by so many standard deviations of their noise. Those of depth cameras, whose errors depend on each
/// other, lie up to 6 apart where poses are right ...
const DEVIATIONS: f64 = 10.0;
/// ... and by so many distances of samples, with noise and without, where that may not be known: they lie up to 1 apart where poses are
/// right.
const SPACINGS: [f64; 2] = [2.0, 4.0];
/// Depth images that were all taken from one place lie apart by fewer deviations and a smaller share of the distance of samples.
const STILL: [f64; 2] = [3.0, 0.2];

/// Placing of scans as given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placing {
    /// Median distance of the samples of the coarsest.
    pub spacing: f64,
    /// Depth images of which none was ever placed.
    pub unplaced: u64,
}

impl Placing {
    /// Of one scan.
    pub fn of(surface: &OrientedSurface) -> Self {
        Placing { spacing: surface.spacing, unplaced: surface.is_unplaced.into() }
    }

    /// Adds others.
    pub fn add(&mut self, other: &Placing) {
        self.spacing = self.spacing.max(other.spacing);
        self.unplaced += other.unplaced;
    }

    /// Warnings for people, by the figures of the report so far.
    pub fn warnings(&self, report: &MergeReport) -> Vec<Warning> {
        let are_unplaced = report.scans > 1 && self.unplaced == report.scans as u64;
        let [deviations, spacings] = match (are_unplaced, report.noise > 0.0) {
            (true, _) => STILL,
            (false, true) => [DEVIATIONS, SPACINGS[0]],
            (false, false) => [DEVIATIONS, SPACINGS[1]],
        };
        let least = (deviations * report.noise).max(spacings * self.spacing);
        let (unit, what) = match report.noise > 0.0 {
            true => (report.noise, "the noise of their samples"),
            false => (self.spacing, "the distance of their samples"),
        };
        let apart = report.overlap_residual.filter(|apart| *apart > least && least > 0.0).map(|apart| {
            let times = Shown::digits(apart / unit, 2);
            format!("lie {} apart where they overlap, which is {times} times {what}", Shown::digits(apart, 2))
        });
        let (kind, text) = match (are_unplaced, apart, report.overlap_residual) {
            (true, Some(apart), _) => (
                WarningKind::NoPoses,
                format!(
                    "no scan has a pose: all {} stand at one place, and their surfaces {apart}: align them first, or give their poses",
                    report.scans
                ),
            ),
            (true, None, residual) => {
                let so = match residual {
                    Some(_) => ". Unless the camera stood still,",
                    None => ", and their surfaces lie on each other nowhere:",
                };
                let scans = report.scans;
                (
                    WarningKind::NoPoses,
                    format!(
                        "no scan has a pose: all {scans} stand at one place{so} align them first, or give their poses"
                    ),
                )
            }
            (false, Some(apart), _) => {
                (WarningKind::Apart, format!("the scans {apart}: align them first, or check their poses"))
            }
            _ => return Vec::new(),
        };
        vec![Warning { kind, text }]
    }
}
