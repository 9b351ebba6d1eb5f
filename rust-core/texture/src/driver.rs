//! The driver: the stages in their order.

use glam::{DAffine3, DVec3};

use base::error::{Error, Result};
use base::magnitude;
use base::memory;
use base::progress::Progress;
use geom::bvh::Bvh;
use image::photo::{self, Photo, Pixels};
use mesh::{Crs, Tile, TileImages, TriMesh, measure, normals};

use super::atlas::{self, NONE, Texel};
use super::behind::{self, Detail, Place};
use super::blend::{self, Sum};
use super::params::TextureParams;
use super::poses::{self, Grey, Posed};
use super::report::{Textured, TexturedPhoto};
use super::target::TextureTarget;
use super::view::View;
use super::{fill, gains, light, mask, occlusion, relief, samples};

/// At the peak, per texel of a tile, by the sizes of what is held: texel, place, sums, colours, and where values come from.
const BYTES_A_TEXEL: f64 = 110.0;
/// Of all tiles that are done: colour, mask, normal, height, occlusion.
const BYTES_DONE: f64 = 10.0;
/// Of the detailed surface: normals, and its vertices as a camera sees them.
const BYTES_A_VERTEX: f64 = 100.0;
/// Of all photos while cameras are refined, per grey pixel that is held: itself and blurred.
const BYTES_A_SMOOTH_PIXEL: f64 = 6.0;
/// Per sample and photo. Measured.
const BYTES_A_SAMPLE: f64 = 30.0;

base::stages! {
    /// Stages with their shares of the time.
    pub PLAN:
    COMPARING = "comparing photos", 0.1;
    REFINING = "refining cameras", 0.2;
    PLACING = "searching places", 0.2;
    COLOURING = "colouring texels", 0.4;
    SHAPING = "mapping the shape", 0.1;
}

/// Makes the images of a mesh, whose texture coordinates are its attributes `s` and `t` ([`mesh::texture`]).
///
/// A texel shows the place of the detailed surface behind it. Its colour is the mean, as light, of all photos that see this place, by
/// angle, resolution and distance from the image's border. Places that no photo sees take the colour of the detailed surface's vertices, or
/// else of the nearest place seen. The mask tells them apart.
///
/// # Guarantees
/// * A photo that does not see a place says nothing of it: visibility is decided by the detailed surface, and by measured
///   depths where a photo has some.
/// * The same images for any number of threads and any order of the photos.
///
/// # Cost
/// n texels, m photos: O(n (m + log t)) for t detailed triangles. About 7 s of CPU time per million texels with 16 photos. Each photo is
/// asked for once per tile, once or twice to be compared. About 110 bytes per texel of one tile, 10 per texel of the others, and one photo.
///
/// # Errors
/// Parameters out of range. A mesh, texture coordinates, a surface, a photo or a camera that can't be used. Neither photos nor colours of
/// vertices. [`Error::OutOfMemory`]. [`Error::Cancelled`].
pub fn run(
    mesh: &TriMesh,
    detail: &TriMesh,
    photos: &[&dyn Photo],
    params: &TextureParams,
    progress: &Progress<'_>,
) -> Result<Textured> {
    params.validate()?;
    let target = TextureTarget::new(mesh)?;
    let tiles = target.tiles()?;
    magnitude::points("vertex", &mesh.positions)?;
    Crs::lengths(mesh.crs.as_ref())?;
    detail.validate().map_err(|error| Error::input(format!("the detailed surface: {error}")))?;
    if detail.triangles.is_empty() || mesh.triangles.is_empty() {
        let which = if detail.triangles.is_empty() { "detailed surface" } else { "mesh" };
        return Err(Error::input(format!("the {which} has no triangles, but texturing needs some")));
    }
    let order = photo::in_order(photos)?;
    refuse_colourless(detail, photos)?;
    let texels = f64::from(params.size).powi(2);
    let bytes = texels * (BYTES_A_TEXEL + BYTES_DONE * f64::from(tiles - 1));
    let bytes = bytes.max(bytes_comparing(photos, params)) + BYTES_A_VERTEX * detail.positions.len() as f64;
    let work = || format!("texturing {tiles} tiles of {} texels from {} photos", params.size, photos.len());
    memory::expect(bytes, work, "use smaller tiles or photos")?;
    progress.plan(PLAN);
    let pool = base::threads::pool(params.threads)?;
    progress.run(&pool, || {
        let bvh = Bvh::build_with(&detail.positions, &detail.triangles, params.threads, progress)?;
        let (lo, hi) = measure::bounds(&detail.positions).unwrap_or_default();
        let detail_normals = normals::smooth(detail, progress)?;
        let detail = Detail { mesh: detail, bvh: &bvh, normals: &detail_normals, origin: (lo + hi) / 2.0 };
        let normals = normals::smooth(mesh, progress)?;
        progress.lap("surface");
        Job { target: &target, normals, detail, photos, order, params, progress }.all_tiles(tiles)
    })
}

/// Refuses a surface without colours where there are no photos.
///
/// # Errors
/// [`Error::Input`].
pub fn refuse_colourless(detail: &TriMesh, photos: &[&dyn Photo]) -> Result<()> {
    if photos.is_empty() && fill::vertex_colours(detail).is_none() {
        return Err(Error::input(
            "there are neither photos nor colours of the detailed surface's vertices: give at least one of the two",
        ));
    }
    Ok(())
}

/// Bytes that comparing photos takes, and one of them as a host holds it and as we do.
fn bytes_comparing(photos: &[&dyn Photo], params: &TextureParams) -> f64 {
    let largest = largest(photos);
    let pixels_of_greys =
        photos.len() as f64 * (largest as f64 / (poses::factor(photos.len(), largest) as f64).powi(2));
    let a_grey_pixel = if params.refine_cameras { BYTES_A_SMOOTH_PIXEL } else { 1.0 };
    let samples = photos.len() as f64 * samples::count(photos.len()) as f64;
    6.0 * largest as f64 + a_grey_pixel * pixels_of_greys + BYTES_A_SAMPLE * samples
}

/// Pixels of the largest photo.
fn largest(photos: &[&dyn Photo]) -> usize {
    let pixels = |photo: &&dyn Photo| photo.camera().size.map_or(0, |[columns, rows]| columns.saturating_mul(rows));
    photos.iter().map(pixels).max().unwrap_or(0)
}

struct Job<'a, 'p> {
    target: &'a TextureTarget<'a>,
    normals: Vec<DVec3>,
    detail: Detail<'a>,
    photos: &'a [&'a dyn Photo],
    /// Photos in the order of their names.
    order: Vec<usize>,
    params: &'a TextureParams,
    progress: &'a Progress<'p>,
}

/// A photo's camera and light, as they are used. In the order of the names.
struct Chosen {
    origin_from_camera: DAffine3,
    gain: [f64; 3],
    trust: f64,
}

impl Job<'_, '_> {
    fn all_tiles(&self, tiles: u32) -> Result<Textured> {
        let images = TileImages { size: self.params.size, ..TileImages::default() };
        let mut done = Textured { images, ..Textured::default() };
        let chosen = self.agree(&mut done)?;
        let tangents = self.params.normal_map.then(|| relief::tangents(self.target, &self.normals));
        let mut heights = Vec::new();
        for number in 0..tiles {
            let texels = atlas::texels(self.target, number, self.params.size, self.progress)?;
            self.progress.stage(PLACING, texels.len() as u64);
            let places = behind::places(&texels, self.target, &self.normals, &self.detail, self.progress)?;
            self.progress.lap("places");
            let mut tile = self.coloured(&texels, &places, &chosen, &mut done)?;
            let sources = fill::sources(&texels, self.params.size, self.progress)?;
            self.spread(&mut tile, &texels, &sources);
            self.progress.lap("filling");
            self.progress.stage(SHAPING, 1);
            if let Some(tangents) = &tangents {
                let map = relief::normal_map(&texels, &places, self.target, &self.normals, tangents);
                tile.normal = Some(spread(&map, &sources, [128, 128, 255]));
            }
            if self.params.height_map {
                let of = relief::heights(&texels, &places, self.target, &self.normals, self.detail.origin);
                heights.push(spread(&of, &sources, 0.0));
            }
            if self.params.occlusion_rays > 0 {
                let rays = self.params.occlusion_rays;
                let map = occlusion::occlusion(&texels, &places, self.params.size, &self.detail, rays, self.progress)?;
                tile.occlusion = Some(spread(&map, &sources, u8::MAX));
            }
            self.progress.lap("shape");
            done.images.tiles.push(tile);
        }
        if self.params.height_map {
            let all = || heights.iter().flatten().map(|&height| f64::from(height));
            let range = [all().fold(0.0, f64::min), all().fold(0.0, f64::max)];
            for (tile, heights) in done.images.tiles.iter_mut().zip(&heights) {
                tile.height = Some(relief::in_steps(heights, range));
            }
            done.images.heights = Some(range);
        }
        done.report.heights = done.images.heights;
        done.images.tangents = tangents;
        done.report.tiles = done.images.tiles.len();
        done.report.seconds = self.progress.seconds();
        Ok(done)
    }

    fn photo(&self, i: usize) -> &dyn Photo {
        self.photos[self.order[i]]
    }

    /// Gains and poses under which the photos agree. `None` for a photo that is left out.
    fn agree(&self, done: &mut Textured) -> Result<Vec<Option<Chosen>>> {
        let count = self.photos.len();
        let of = |photo: &&dyn Photo| TexturedPhoto {
            name: photo.name().to_owned(),
            gain: [1.0; 3],
            ..TexturedPhoto::default()
        };
        done.report.photos = self.photos.iter().map(of).collect();
        let given: Vec<DAffine3> = (0..count)
            .map(|i| DAffine3::from_translation(-self.detail.origin) * self.photo(i).world_from_camera())
            .collect();
        let mut chosen: Vec<Option<Chosen>> =
            given.iter().map(|pose| Some(Chosen { origin_from_camera: *pose, gain: [1.0; 3], trust: 1.0 })).collect();
        let samples = samples::spread(self.target, &self.normals, &self.detail, count, self.progress)?;
        self.progress.stage(COMPARING, count as u64);
        let factor = poses::factor(count, largest(self.photos));
        let mut greys = Vec::new();
        let mut shown = Vec::new();
        for i in 0..count {
            let pixels = photo::pixels(self.photo(i))?;
            if let Some(reason) = useless(&pixels) {
                done.report.photos[self.order[i]].reason = reason;
                chosen[i] = None;
            }
            let is_used = chosen[i].is_some();
            shown.push(if is_used { self.shown(i, given[i], &pixels, &samples)? } else { Vec::new() });
            greys.push(Grey::new(&pixels, factor));
            self.progress.advance(1)?;
        }
        trust_sharp(&greys, &mut chosen);
        if self.params.match_exposure {
            self.equalize(&shown, samples.len(), &mut chosen)?;
        }
        self.progress.lap("exposure");
        if self.params.refine_cameras {
            let moved = self.refine(greys, &samples, &mut chosen, done)?;
            if moved && self.params.match_exposure {
                let mut shown = Vec::new();
                for i in 0..count {
                    let Some(of) = &chosen[i] else {
                        shown.push(Vec::new());
                        continue;
                    };
                    let pixels = photo::pixels(self.photo(i))?;
                    shown.push(self.shown(i, of.origin_from_camera, &pixels, &samples)?);
                }
                self.equalize(&shown, samples.len(), &mut chosen)?;
            }
        }
        self.progress.lap("cameras");
        let mut poses = vec![DAffine3::IDENTITY; count];
        for i in 0..count {
            let given_pose = self.photo(i).world_from_camera();
            poses[self.order[i]] = given_pose;
            let Some(of) = &chosen[i] else { continue };
            let photo = &mut done.report.photos[self.order[i]];
            photo.gain = of.gain;
            if of.origin_from_camera != given[i] {
                photo.moved = poses::moved(&self.photo(i).camera(), &given[i], &of.origin_from_camera, &samples);
                poses[self.order[i]] = DAffine3::from_translation(self.detail.origin) * of.origin_from_camera;
            }
        }
        done.world_from_camera = poses;
        Ok(chosen)
    }

    /// Colours that a photo shows at the samples.
    fn shown(&self, i: usize, pose: DAffine3, pixels: &Pixels, samples: &[Place]) -> Result<gains::Shown> {
        let depths = photo::depths(self.photo(i))?;
        let view = View::new(self.photo(i).camera(), pose, &self.detail, depths.as_ref(), self.progress)?;
        Ok(gains::shown(&view, pixels, samples, &self.detail))
    }

    fn equalize(&self, shown: &[gains::Shown], samples: usize, chosen: &mut [Option<Chosen>]) -> Result<()> {
        let gains = gains::solve(shown, samples, self.progress)?;
        for (chosen, gain) in chosen.iter_mut().zip(gains) {
            if let Some(chosen) = chosen {
                chosen.gain = gain;
            }
        }
        Ok(())
    }

    /// Moves the cameras. Returns whether any was moved.
    fn refine(
        &self,
        greys: Vec<Grey>,
        samples: &[Place],
        chosen: &mut [Option<Chosen>],
        done: &mut Textured,
    ) -> Result<bool> {
        let used: Vec<usize> = (0..chosen.len()).filter(|&i| chosen[i].is_some()).collect();
        if used.len() < 2 {
            return Ok(false);
        }
        let mut posed: Vec<Posed<'_>> = Vec::new();
        for (i, grey) in greys.into_iter().enumerate() {
            if let Some(of) = &chosen[i] {
                // Bytes are nearly the square root of light.
                let gain = f64::from(light::level(of.gain.map(|of| of as f32))).powf(1.0 / 2.2);
                let photo = self.photo(i);
                let (camera, origin_from_camera) = (photo.camera(), of.origin_from_camera);
                posed.push(Posed { camera, origin_from_camera, grey, gain, photo });
            }
        }
        self.progress.stage(REFINING, (15 * posed.len()) as u64);
        done.report.differences = Some(poses::refine(&mut posed, samples, &self.detail, self.progress)?);
        let mut moved = false;
        for (photo, i) in posed.iter().zip(used) {
            if let Some(of) = &mut chosen[i] {
                moved |= of.origin_from_camera != photo.origin_from_camera;
                of.origin_from_camera = photo.origin_from_camera;
            }
        }
        Ok(moved)
    }

    /// Colours and mask of the covered texels. Still one entry per covered texel.
    fn coloured(
        &self,
        texels: &[Texel],
        places: &[Place],
        chosen: &[Option<Chosen>],
        done: &mut Textured,
    ) -> Result<Tile> {
        let used = chosen.iter().flatten().count();
        self.progress.stage(COLOURING, (used * texels.len()) as u64);
        let mut sums = vec![Sum::default(); places.len()];
        for (i, of) in chosen.iter().enumerate() {
            let Some(of) = of else { continue };
            let photo = self.photo(i);
            let depths = photo::depths(photo)?;
            let pixels = photo::pixels(photo)?;
            let view = View::new(photo.camera(), of.origin_from_camera, &self.detail, depths.as_ref(), self.progress)?;
            let seen =
                blend::add(&mut sums, places, (&view, &pixels), (of.gain, of.trust), &self.detail, self.progress)?;
            done.report.photos[self.order[i]].texels += seen;
        }
        let drop_highlights = self.params.drop_highlights;
        let mut colours: Vec<Option<[u8; 3]>> =
            sums.iter().map(|sum| sum.mean(drop_highlights).map(light::bytes)).collect();
        let is_clear: Vec<bool> = sums.iter().map(|sum| sum.is_clear).collect();
        drop(sums);
        let source = |colour: &Option<_>| if colour.is_some() { mask::SEEN } else { mask::FILLED };
        let mask = Some(colours.iter().map(source).collect());
        done.report.texels += texels.len() as u64;
        done.report.seen += colours.iter().flatten().count() as u64;
        if let Some(of) = fill::vertex_colours(self.detail.mesh) {
            for (colour, place) in colours.iter_mut().zip(places).filter(|(colour, _)| colour.is_none()) {
                *colour = fill::of_vertices(place, self.detail.mesh, of);
            }
        }
        fill::from_nearest(&mut colours, &is_clear, places, self.progress)?;
        self.progress.lap("colours");
        Ok(Tile { colour: colours.into_iter().map(Option::unwrap_or_default).collect(), mask, ..Tile::default() })
    }

    /// From covered texels to the whole tile. The mask says which these were.
    fn spread(&self, tile: &mut Tile, texels: &[Texel], sources: &[u32]) {
        tile.colour = spread(&tile.colour, sources, [0; 3]);
        let mut mask = vec![mask::BACKGROUND; sources.len()];
        texels.iter().zip(tile.mask.iter().flatten()).for_each(|(texel, &of)| mask[texel.place as usize] = of);
        tile.mask = Some(mask);
    }
}

/// Values of covered texels in all texels. `none` if nothing is covered at all.
fn spread<T: Copy>(values: &[T], sources: &[u32], none: T) -> Vec<T> {
    sources.iter().map(|&i| if i == NONE { none } else { values[i as usize] }).collect()
}

/// Reason why nothing can be taken of a photo.
fn useless(pixels: &Pixels) -> Option<String> {
    let share = light::clipped_share(pixels);
    (share > light::MOST_CLIPPED).then(|| format!("{:.0} % of its pixels are black or overexposed", 100.0 * share))
}

/// Photos less sharp than the middle one count less.
fn trust_sharp(greys: &[Grey], chosen: &mut [Option<Chosen>]) {
    let sharpness: Vec<f64> = greys.iter().map(Grey::sharpness).collect();
    let mut used: Vec<f64> = (0..greys.len()).filter(|&i| chosen[i].is_some()).map(|i| sharpness[i]).collect();
    if used.is_empty() {
        return;
    }
    used.sort_by(f64::total_cmp);
    let middle = used[used.len() / 2];
    for (of, sharp) in chosen.iter_mut().zip(sharpness) {
        if let Some(of) = of {
            of.trust = if middle > 0.0 { (sharp / middle).clamp(0.1, 1.0).powi(2) } else { 1.0 };
        }
    }
}
