//! The steps of a merge, in one list for all stores. A store keeps what steps leave for each other. It is memory, where all is one block
//! (`run::memory`), or memory that the next merge goes on with (`run::incremental`). Or it is files, block by block and task by task
//! (`run::out_of_core`).

use crate::crossings::lattice::Lattice;
use crate::crossings::scan_order::ScanPlaces;
use crate::dump;
use crate::finish::close_holes::Room;
use crate::finish::write::Besides;
use crate::finish::{close_holes, close_openings, components, noise, refuse_nothing, write};
use crate::intake::placing::Placing;
use crate::params::MergeParams;
use crate::report::MergeReport;
use crate::surface::tile::Tiles;
use crate::surface::whole::Whole;
use crate::visibility::eyes::Eyes;
use base::error::Result;
use base::progress::Progress;
use mesh::sink::MeshSink;
use mesh::{Crs, TriMesh};

base::choices! {
    /// The stages of a merge. Tasks of a stage need nothing of each other, and all of the stages before.
    pub enum Stage {
        /// The order of the scans, the size of the cells, where they lie.
        Plan = "plan" "Plan",
        /// Crossings of some scans with the grid.
        Collect = "collect" "Collect",
        /// Distances between scans.
        Overlap = "overlap" "Overlap",
        /// Sums of all scans in some blocks of the grid.
        Fuse = "fuse" "Fuse",
        /// Crossings that some scans see through.
        Look = "look" "Look",
        /// Crossings that most scans see through are dropped, in some blocks.
        Drop = "drop" "Drop",
        /// Brightness of scans beside each other.
        Colours = "colours" "Colours",
        /// Inside and outside, in some blocks.
        Label = "label" "Label",
        /// The surface in some blocks.
        Build = "build" "Build",
    }
}

impl Stage {
    /// Of how many tasks it is where stages are cut into so many. Some are one task.
    pub fn tasks(self, portions: u32) -> u32 {
        match self {
            Stage::Plan | Stage::Overlap | Stage::Colours => 1,
            _ => portions,
        }
    }
}

/// A merge at work, and what its stages leave for each other.
pub trait Graph {
    /// The surface, block by block.
    type Tiles: Tiles;

    /// Does a stage. All before it are done.
    ///
    /// # Errors
    /// Errors of the stage. Cancelled.
    fn run(&mut self, stage: Stage, progress: &Progress<'_>) -> Result<()>;

    /// Their result, all done.
    ///
    /// # Errors
    /// It can't be read.
    fn finished(&mut self) -> Result<Built<'_, Self::Tiles>>;
}

/// Result of the stages.
pub struct Built<'a, T> {
    /// The surface before holes are closed.
    pub tiles: T,
    /// The grid.
    pub lattice: Lattice,
    /// The merge distance, in cells.
    pub reach: f64,
    /// Whether any scan has colours.
    pub coloured: bool,
    /// Placing of the scans as given.
    pub placing: Placing,
    /// The system that the scans lie in.
    pub crs: Option<Crs>,
    /// Places of the scans of the vertices in their order.
    pub places: ScanPlaces,
    /// The scans, to be asked where nothing is.
    pub eyes: Eyes<'a>,
    /// Figures so far.
    pub report: MergeReport,
}

/// Target of the surface, and how much of it may be in memory at a time.
pub struct Out<'a> {
    /// Takes it.
    pub sink: &'a mut dyn MeshSink,
    /// For what lies around holes.
    pub room: Room,
}

/// The paper's list of steps.
///
/// # Errors
/// Those of the stages, and of [`finish`].
pub fn merge(
    graph: &mut impl Graph,
    params: &MergeParams,
    out: Out<'_>,
    progress: &Progress<'_>,
) -> Result<MergeReport> {
    for &stage in Stage::ALL {
        graph.run(stage, progress)?;
    }
    finish(graph, params, out, progress)
}

/// Steps 8 to 10, once all stages are done: what is made of the tiles is handed over.
///
/// # Errors
/// A tile can't be read. Nothing is left. More vertices than there are numbers for. The sink's. Cancelled.
pub fn finish(
    graph: &mut impl Graph,
    params: &MergeParams,
    Out { sink, room }: Out<'_>,
    progress: &Progress<'_>,
) -> Result<MergeReport> {
    let Built { tiles, lattice, reach, coloured, placing, crs, places, eyes, mut report } = graph.finished()?;
    report.artificial_intersections = tiles.artificial();
    report.noise = noise::typical(&tiles, progress)?;
    report.warnings.extend(placing.warnings(&report));
    let chosen = components::choose(&tiles, reach, params.min_component_share, &mut report, progress)?;
    let mut whole = Whole::new(tiles, chosen, progress)?;
    progress.lap("components");
    refuse_nothing(whole.triangles(), report.voxel, params.min_component_share)?;
    dump::parts(&whole)?;
    close_holes::close(&mut whole, &eyes, &lattice, params, room, &mut report, progress)?;
    progress.lap("holes");
    let besides = Besides { coloured, crs, places };
    let closes = close_openings::is_asked(params);
    let mut surface = TriMesh::default();
    let written = write::write(whole, besides, if closes { &mut surface } else { sink }, progress)?;
    (report.faces, report.shortest_edge) = (written.faces, written.shortest_edge());
    if closes {
        let closed = close_openings::close(&surface, &eyes, params, &mut report, progress)?;
        drop(surface);
        progress.lap("close");
        sink.whole(closed, progress)?;
    }
    progress.lap("write");
    report.seconds = progress.seconds();
    Ok(report)
}
