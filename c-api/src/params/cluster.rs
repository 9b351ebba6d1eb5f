//! Parameters of cluster. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::srf_status;

/// How a mesh, or points, are clustered. Starts with its size. Set to the defaults by srf_cluster_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_cluster_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
    /// number.
    pub threads: u32,
    /// Vertices wanted. More come only if the input's topology needs them, at most as many as the input has when cut to a
    /// manifold. 1 to 4000000000. 0, the default: a tenth of the input's vertices.
    pub vertices: u64,
    /// Patches wanted, instead of vertices: k patches give about 3 k vertices. 1 to 4000000000. 0, the default: about a
    /// third of the vertices wanted.
    pub patches: u64,
    /// Largest distance of any point of the input from the result and of the result from the input, instead of a number of
    /// vertices: there are as many as it takes. > 0. SRF_FROM_DATA, the default: none, a number of vertices is asked for.
    pub max_error: f64,
    /// How much smaller triangles are where the surface bends: 0 makes them alike everywhere, 1 gives the least mean
    /// distance from the input. 0 to 2, default 1.
    pub adaptivity: f64,
    /// Most Lloyd steps at the final number of patches. Fewer if they no longer gain. 0 to 10000, default 40.
    pub iterations: u64,
    /// Most steps of the spring relaxation. 0: the fans stay as they are. 0 to 10000, default 50.
    pub relaxation: u64,
    /// Rounds in which vertices leave the surface for where it lies nearest in the mean square. 1 takes a third off the
    /// mean error, more lower the largest. 0: vertices stay on the surface. 0 to 100, default 0.
    pub fitting: u64,
    /// Smallest angle of triangles that may have any shape for the least mean square distance, instead of one as even as
    /// can be. Vertices leave the surface, in as many rounds as `fitting` says, but at least two. 30 degrees leave a third
    /// of the mean error at the same number of vertices, in up to five times the time. 0: triangles are as even as can be.
    /// Radians, 0 to pi/6, default 0.
    pub min_angle: f64,
    /// Edges whose triangles turn by at least this angle are kept as edges of the result, where they make lines a few of
    /// its edges long: those of parts and buildings. Noise makes no such lines. 0: no edge is kept. Radians, 0 to pi,
    /// default 0.6981317007977318.
    pub feature_angle: f64,
    /// Direction in which round patches are split. 0 to 4294967295, default 0.
    pub seed: u64,
    /// Most triangles wanted, instead of vertices. So many come, or one fewer. More come only if the input's topology needs
    /// them, at most as many as the input has. 1 to 4000000000. 0, the default: about a tenth of the input's.
    pub triangles: u64,
}

impl Fields for srf_cluster_params {
    fn defaults() -> Self {
        srf_cluster_params {
            struct_size: size_of::<Self>() as u32,
            threads: 0,
            vertices: 0,
            patches: 0,
            max_error: SRF_FROM_DATA,
            adaptivity: 1.0,
            iterations: 40,
            relaxation: 50,
            fitting: 0,
            min_angle: 0.0,
            feature_angle: 0.6981317007977318,
            seed: 0,
            triangles: 0,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("threads", Given::Threads(self.threads)),
            ("vertices", Given::Whole(self.vertices)),
            ("patches", Given::Whole(self.patches)),
            ("max_error", Given::Double(self.max_error)),
            ("adaptivity", Given::Double(self.adaptivity)),
            ("iterations", Given::Whole(self.iterations)),
            ("relaxation", Given::Whole(self.relaxation)),
            ("fitting", Given::Whole(self.fitting)),
            ("min_angle", Given::Double(self.min_angle)),
            ("feature_angle", Given::Double(self.feature_angle)),
            ("seed", Given::Whole(self.seed)),
            ("triangles", Given::Whole(self.triangles)),
        ]
    }
}

/// Sets the defaults. Call srf_cluster_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_cluster_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cluster_params_init_sized(params: *mut srf_cluster_params, size: usize) -> srf_status {
    guard(|| sized::init("params", params, size, srf_cluster_params::defaults()))
}
