//! Parameters of reconstruct. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::srf_status;

/// Length that the perimeter of a facet is compared with.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_threshold {
    /// The spacing of the points around it: sparse parts may have large facets.
    SRF_THRESHOLD_LOCAL = 1,
    /// The mean over the whole surface, as in the paper.
    SRF_THRESHOLD_GLOBAL = 2,
}

/// Form of the surface.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_topology {
    /// Every edge has at most two facets, every vertex one fan of them.
    SRF_TOPOLOGY_MANIFOLD = 1,
    /// The paper's carving: closed, but not manifold where parts touch, and without the points carved away.
    SRF_TOPOLOGY_FREE = 2,
}

/// Whether the points are of a closed surface. Only with a manifold topology.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_closure {
    /// Closed if a closed surface goes through more than half of the points at once, or through 5 % at once and 99 % in the
    /// end. But not if sensors saw it from one side only, or if points carry noise and more than 15 % of the area would be
    /// in facets above the threshold. Else it is open and grows from the most certain facet on. Parts are joined over
    /// facets up to 4 times as large as the threshold, or 16 times where they continue a part smoothly. Small holes are
    /// closed. Parts that lie further apart stay apart.
    SRF_CLOSURE_AUTO = 1,
    /// Gaps in the sampling are spanned by large facets.
    SRF_CLOSURE_CLOSED = 2,
    /// Facets above the threshold are left out, so that gaps stay open.
    SRF_CLOSURE_OPEN = 3,
}

/// Treatment of the noise of points.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_noisy_points {
    /// They are moved to the surface that those around them tell. Outliers, also around points that carry no noise, are
    /// left out.
    SRF_NOISY_POINTS_MOVED = 1,
    /// The surface is found as with `moved`, and goes through the points as they were measured. Noise may make it cross
    /// itself.
    SRF_NOISY_POINTS_PUT_BACK = 2,
    /// Nothing is smoothed and no outlier left out, whatever noise the points carry and whatever the smoothing is. If noise
    /// is half a spacing or more, no surface may be found, or one full of holes.
    SRF_NOISY_POINTS_AS_CLEAN = 3,
}

/// How a surface is made through scattered points. Starts with its size. Set to the defaults by
/// srf_reconstruct_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_reconstruct_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
    /// number.
    pub threads: u32,
    /// Makes the threshold on the perimeters of facets larger. Larger closes more gaps and keeps more stray points. 1 to 2,
    /// default 1.
    pub factor: f64,
    /// Length that the perimeter of a facet is compared with. A value of srf_threshold, default SRF_THRESHOLD_LOCAL.
    pub threshold: u64,
    /// Form of the surface. A value of srf_topology, default SRF_TOPOLOGY_MANIFOLD.
    pub topology: u64,
    /// Whether the points are of a closed surface. Only with a manifold topology. A value of srf_closure, default
    /// SRF_CLOSURE_AUTO.
    pub closure: u64,
    /// The surface is the one that points within this distance tell, and those far from any surface are left out. Larger
    /// takes away more noise, and what is thin: bars thinner than twice this may tear. Smaller may leave good points out.
    /// Less than the usual distance to the 16 nearest points counts as that distance. > 0. SRF_FROM_DATA, the default: the
    /// distance at which points are best foretold by the others, if the noise of 1,024 points or more is more than 0.2
    /// spacings, else points stay.
    pub smooth: f64,
    /// Treatment of the noise of points. A value of srf_noisy_points, default SRF_NOISY_POINTS_MOVED.
    pub noisy_points: u64,
}

impl Fields for srf_reconstruct_params {
    fn defaults() -> Self {
        srf_reconstruct_params {
            struct_size: size_of::<Self>() as u32,
            threads: 0,
            factor: 1.0,
            threshold: 1,
            topology: 1,
            closure: 1,
            smooth: SRF_FROM_DATA,
            noisy_points: 1,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("threads", Given::Threads(self.threads)),
            ("factor", Given::Double(self.factor)),
            ("threshold", Given::Whole(self.threshold)),
            ("topology", Given::Whole(self.topology)),
            ("closure", Given::Whole(self.closure)),
            ("smooth", Given::Double(self.smooth)),
            ("noisy_points", Given::Whole(self.noisy_points)),
        ]
    }
}

/// Sets the defaults. Call srf_reconstruct_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_reconstruct_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_reconstruct_params_init_sized(
    params: *mut srf_reconstruct_params,
    size: usize,
) -> srf_status {
    guard(|| sized::init("params", params, size, srf_reconstruct_params::defaults()))
}
