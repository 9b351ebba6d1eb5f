//! The places of the charts in their tiles: crate `uvunwrap`, by their shapes.

use uvunwrap::{Density, Options};

use base::error::{Error, Result, Shown};
use base::progress::Progress;
use glam::DVec2;
use mesh::images;

use super::charts::{Charts, NONE, on_grid};
use super::flatten::{Generated, Known, generated};
use super::join::area_vector;
use super::params::{ChartScale, UnwrapParams};
use super::surface::Surface;

/// Densities that are tried to fill several tiles, each halving the range.
const TRIALS: usize = 7;

/// Texels along the longest side of the mesh, at most.
const LONGEST: f64 = 1e9;

/// Charts in their tiles.
pub struct Packed {
    /// Their coordinates, on the grid.
    pub charts: Charts,
    /// Tiles.
    pub tiles: u32,
}

/// Packs the charts.
///
/// # Errors
/// [`Error::Input`] if they do not fit. [`Error::Cancelled`].
pub fn pack(charts: &Charts, surface: &Surface, params: &UnwrapParams, progress: &Progress<'_>) -> Result<Packed> {
    let packer = Packer::new(charts, surface, params, progress);
    let most = match params.extent {
        ChartScale::OneTile => 1,
        ChartScale::Tiles(tiles) => tiles,
        ChartScale::TexelsPerUnit(density) => {
            let generated = packer.at(density * surface.unit)?;
            if generated.pages > images::MOST_TILES {
                return Err(Error::input(format!(
                    "{} texels per unit need {} tiles of {} texels, but 100 are the most: use fewer texels per unit or larger \
                     tiles",
                    Shown(density),
                    generated.pages,
                    params.size
                )));
            }
            return Ok(packer.placed(generated));
        }
    };
    let one = packer.filling_one()?;
    if one.pages > most {
        let (count, UnwrapParams { padding, size, .. }) = (charts.members().len(), params);
        return Err(Error::input(format!(
            "{count} charts with a padding of {padding} texels do not fit the tiles: {most} of {size} x {size} texels. Use more or larger \
             tiles or less padding, or drop small parts of the mesh."
        )));
    }
    if most == 1 || one.pages > 1 {
        return Ok(packer.placed(one));
    }
    packer.filling(most, one).map(|best| packer.placed(best))
}

/// Refuses a density at which the mesh is smaller than a texel, or larger than single precision counts.
///
/// # Errors
/// [`Error::Input`].
pub fn expect_density(surface: &Surface, params: &UnwrapParams) -> Result<()> {
    let ChartScale::TexelsPerUnit(density) = params.extent else { return Ok(()) };
    let side = density * surface.unit;
    if (1.0..=LONGEST).contains(&side) {
        return Ok(());
    }
    Err(Error::input(format!(
        "{} texels per unit make the mesh {} texels long, but 1 to 10^9 are allowed: use more or fewer texels per unit",
        Shown(density),
        Shown::digits(side, 4)
    )))
}

struct Packer<'a, 'p> {
    charts: &'a Charts,
    positions: Vec<[f32; 3]>,
    uv: Vec<[f32; 2]>,
    ignored: Vec<bool>,
    area: f64,
    params: &'a UnwrapParams,
    progress: &'a Progress<'p>,
}

impl<'a, 'p> Packer<'a, 'p> {
    fn new(charts: &'a Charts, surface: &Surface, params: &'a UnwrapParams, progress: &'a Progress<'p>) -> Self {
        let position = |&v: &u32| surface.positions[v as usize].as_vec3().to_array();
        let double = |t: usize| area_vector(surface.corners(t)).length();
        let with_area = (0..charts.of.len()).filter(|&t| charts.of[t] != NONE);
        Packer {
            charts,
            positions: charts.vertex.iter().map(position).collect(),
            uv: from_their_corners(charts).iter().map(|at| at.as_vec2().to_array()).collect(),
            ignored: charts.of.iter().map(|&chart| chart == NONE).collect(),
            area: with_area.map(double).sum::<f64>() / 2.0,
            params,
            progress,
        }
    }

    fn run(&self, density: Density) -> Result<Generated> {
        let known = Known { uv: &self.uv, chart: &self.charts.of, ignored: &self.ignored };
        let options = Options {
            max_chart_angle: self.params.cone.to_degrees() as f32,
            max_area_distortion: self.params.max_stretch as f32,
            padding: self.params.padding,
            density,
            ..Options::default()
        };
        generated(&self.positions, self.charts.corners.as_flattened(), Some(&known), &options, self.progress)
    }

    fn filling_one(&self) -> Result<Generated> {
        self.run(Density::Auto { page_size: self.params.size })
    }

    fn at(&self, density: f64) -> Result<Generated> {
        self.run(Density::Fixed { texels_per_unit: density as f32, page_size: Some(self.params.size) })
    }

    /// The densest of some trials that fits so many tiles. `one` fits one.
    fn filling(&self, tiles: u32, one: Generated) -> Result<Generated> {
        let mut low = one.density;
        let mut high = f64::from(self.params.size) * (f64::from(tiles) / self.area).sqrt();
        let mut best = one;
        for _ in 0..TRIALS {
            let density = (low * high).sqrt();
            match self.at(density) {
                Ok(generated) if generated.pages <= tiles => {
                    low = density;
                    best = generated;
                }
                Ok(_) | Err(Error::Input(_)) => high = density,
                Err(other) => return Err(other),
            }
        }
        Ok(best)
    }

    fn placed(&self, generated: Generated) -> Packed {
        let Generated { mut charts, page, pages, density, .. } = generated;
        let scale = density / f64::from(self.params.size);
        let mut tile = vec![0; charts.uv.len()];
        for (corners, page) in charts.corners.iter().zip(page) {
            corners.iter().for_each(|&place| tile[place as usize] = page);
        }
        for (at, tile) in charts.uv.iter_mut().zip(tile) {
            *at = (*at * scale).clamp(DVec2::ZERO, DVec2::ONE) + images::corner(tile);
            *at = on_grid(*at);
        }
        // It was given places, not vertices.
        charts.vertex.iter_mut().for_each(|place| *place = self.charts.vertex[*place as usize]);
        Packed { charts, tiles: pages }
    }
}

/// Coordinates from the lower left corner of each chart: single precision holds them better there.
fn from_their_corners(charts: &Charts) -> Vec<DVec2> {
    let mut uv = charts.uv.clone();
    for members in charts.members() {
        let mut places: Vec<u32> = members.iter().flat_map(|&t| charts.corners[t as usize]).collect();
        places.sort_unstable();
        places.dedup();
        let corner = places.iter().fold(DVec2::INFINITY, |low, &place| low.min(uv[place as usize]));
        places.iter().for_each(|&place| uv[place as usize] -= corner);
    }
    uv
}
