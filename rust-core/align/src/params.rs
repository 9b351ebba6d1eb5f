//! The settings of the alignment.

use base::params::{choice, flag, length, ratio};

base::choices! {
    /// Facts that are known of the scans' poses.
    pub enum Start {
        /// As the scans say: `sequence` where all are frames of one recording that follow each other in time and at least half of them fit
        /// the frame before, `unknown` otherwise.
        Auto = "auto" "Automatic",
        /// Nothing: each scan may lie anywhere, whatever pose it has.
        Unknown = "unknown" "Unknown",
        /// They are near where they belong: no scan is placed further from its pose than `reach`.
        Rough = "rough" "Rough",
        /// Nothing, but each scan was taken a moment after the one before it, by a sensor that moved little: in the order of the recording
        /// that they are frames of, else in the order given.
        Sequence = "sequence" "Sequence",
    }
}

base::choices! {
    /// Whether the object turned on a table while the sensor stood still.
    pub enum Turntable {
        /// No, or not known.
        No = "no" "No",
        /// By angles that are found, or given, about an axis that is found, or given: the same one in the frames of all scans.
        Turned = "turned" "Turned",
        /// A whole turn in equal steps, in the order of the scans.
        Equal = "equal" "Turned by equal steps",
    }
}

base::params! {
    /// How scans are brought to one frame. Lengths are in the unit of the scans.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct AlignParams of "align" with threads {
        /// Facts that are known of the poses of the scans.
        start: Start = choice("Start", Start::CHOICES),
        /// With rough poses, how far off they may be: no sample of a scan is placed further from where its pose has it. A scan that fits no nearer is left out, and the report says how far that would be.
        reach: Option<f64> = length("Reach")
            .from_data("a tenth of the scan's size").above(0.0),
        /// Whether the object turned on a table while the sensor stood still: then only turns about one axis are looked for, unless none is found, which is said.
        turntable: Turntable = choice("Turntable", Turntable::CHOICES),
        /// Surfaces that lie further apart, as a root mean square, don't fit.
        tolerance: Option<f64> = length("Tolerance")
            .from_data("a fifth of the distance of the points that are compared, 8,000 to a scan, or more where noise asks for it").above(0.0),
        /// Scans fit only if one of them lies on the other with at least this share of its surface.
        min_overlap: f64 = ratio("Min overlap (share)").default(0.03).at_most(1.0),
        /// Colours or intensities decide where shape lets scans turn or slide, or fits in several places.
        use_colour: bool = flag("Use colour").on()
            .off("shape alone counts"),
    }
}
