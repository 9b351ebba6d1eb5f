//! Scattered points -> surface, over their 3D Delaunay tetrahedralization. \[RELP00\]
//!
//! | stage | file | in -> out |
//! |---|---|---|
//! | 0 | `prepare` | points -> samples in an order of their own, equal ones once |
//! |   | `seen` | from which side they were seen, where sensors or normals say |
//! |   | `noise`, `smooth` | how much noise they carry; where that is much, samples on the surface they tell, without outliers |
//! |   | `rounding` | the steps of their coordinates, which hide noise |
//! |   | `isolated` | whether samples without noise have outliers, which are left out then |
//! | 1 | `geom::delaunay3` | samples -> tetrahedra |
//! |   | `balls`, `slivers` | the circumscribed balls of these, however flat |
//! | 2 | `basins` | tetrahedra -> basins of empty space, the gates between them (the paper's erosion included) |
//! | 3 | `separate` | basins -> inside and outside |
//! |   | `cut` | or, of samples that carry noise, cells -> inside and outside |
//! | 4 | `closed`, `manifold`, `deep_samples` | a surface between the two that is manifold and meets the samples |
//! |   | `one_sided` | if sensors are known, whether they saw it from one side only: then it is open |
//! | 5 | `opened`, `certain`, `grow`, `hinge`, `best`, `border`, `fans` | open surfaces, which divide nothing: from what is certain over the rest |
//! |   | `lines` | lines of sight and facets: if sensors are known, jumps and places that were seen through stay open |
//! |   | `gaps`, `facet_scale` | large facets that bound no gap |
//! |   | `handles`, `join`, `gather`, `lids` | handles that samples force; parts joined; through samples passed by; small loops closed |
//! | 6 | `orient` | outward, or as normals or sensors say |
//!
//! With `topology = free` stages 2 to 5 give way to `carve`, the paper's own. `space` has them in their order. Samples that
//! lie in one plane have no tetrahedra: `plane` triangulates them in it.
//!
//! *Differences from the paper.* (1) No sample is lost to numerical errors. (2) It is not one threshold on perimeters that decides which
//! cells are outside, but how empty space hangs together: through gates that are wide beside the rooms they join. So sparse places stay
//! closed and dense gaps open, and a threshold that is too small can not eat the object. (3) The surface is manifold, after Boissonnat's
//! rules \[Boi84\]. (4) Open surfaces are found, too. (5) The threshold, global or local, says which facets are too large to be trusted.
//! These are those that would tie a stray point to the surface, those over the border of an open one, and on request those that close a
//! gap.
//!
//! Cost: O(n log n) in practice. The tetrahedralization takes more than half of the time.

#![cfg_attr(test, allow(clippy::print_stdout))]

// what goes in and out
mod operation;
mod params;
mod report;

// 0. samples
mod isolated;
mod noise;
mod patch;
mod prepare;
mod rounding;
mod scales;
mod seeds;
mod seen;
mod smooth;

mod balls;
mod complex;
mod slivers;

// 2. basins and gates
mod basins;

// 3. sides
mod cut;
mod separate;

// 4. manifold, and through all samples
mod closed;
mod deep_samples;
mod manifold;

// 5. open surfaces
mod best;
mod border;
mod certain;
mod facet_scale;
mod fans;
mod gaps;
mod gather;
mod grow;
mod handles;
mod hinge;
mod join;
mod lids;
mod lines;
mod opened;

// the paper's own carving
mod carve;

mod spacing;

// 6. orientation
mod orient;

// what the samples span: the stages above, or fewer
mod found;
mod one_sided;
mod plane;
mod space;

// all of it, and again with other parameters
mod driver;

pub use driver::{PLAN, Reconstructor, run, run_owned};
pub use operation::OPERATION;
pub use params::{Closure, NoisyPoints, ReconstructParams, SCHEMA, Threshold, Topology};
pub use report::{Dropped, Reason, ReconstructReport, Reconstructed};

#[cfg(any(test, fuzzing))]
pub mod fuzzing;
#[cfg(test)]
mod tests;
