//! The scans: their order, by name, then by content, and the numbers that crossings know them by.
//!
//! A number is made of the scan's name: so a scan that comes or goes leaves the others theirs, wherever it stands in the order, and what
//! was found out of them stays true. Nothing but names and contents decides, so the order of the list does not matter.

use rayon::prelude::*;
use rustc_hash::FxHashMap;
use twox_hash::XxHash3_128;

use super::crossing::MAX_SCANS;
use base::{Progress, Result};
use image::source::ScanSource;

/// If crossings are many, overlaps are measured between no fewer pairs of scans than this, if there are so many.
const SAMPLED_PAIRS: usize = 256;

/// The scans of a merge, in order.
#[derive(Default)]
pub struct ScanOrder<'a> {
    /// The scans.
    pub sources: Vec<&'a dyn ScanSource>,
    /// The version of each of them: a number that no other has.
    pub versions: Vec<u64>,
    /// The numbers by which crossings know each of them.
    numbers: Vec<u32>,
    places: ScanPlaces,
}

/// Places of the scans of numbers in the order.
#[derive(Clone, Debug, Default)]
pub struct ScanPlaces(pub FxHashMap<u32, u32>);

impl ScanPlaces {
    /// The number by which users know the scan of a vertex. Less than 0 is none.
    pub fn told(&self, scan: i32) -> i32 {
        u32::try_from(scan).map_or(scan, |number| self.0[&number] as i32)
    }
}

impl<'a> ScanOrder<'a> {
    /// Of scans and their versions, of which `order` is as [`in_order`] gives it.
    pub fn new(sources: &[&'a dyn ScanSource], versions: &[u64], order: &[usize]) -> Self {
        let mut scan_order = ScanOrder {
            sources: order.iter().map(|&place| sources[place]).collect(),
            versions: order.iter().map(|&place| versions[place]).collect(),
            ..ScanOrder::default()
        };
        for namesakes in scan_order.sources.chunk_by(|a, b| a.name() == b.name()) {
            for (scan, nth) in namesakes.iter().zip(0..) {
                let name = scan.name().as_bytes();
                let mut numbers = (0..).map(|attempt| number(name, nth, attempt));
                let is_free = |number: &u32| !scan_order.places.0.contains_key(number);
                let number = numbers.find(is_free).expect("there are more numbers than scans");
                scan_order.places.0.insert(number, scan_order.numbers.len() as u32);
                scan_order.numbers.push(number);
            }
        }
        scan_order
    }

    /// Number of them.
    pub fn len(&self) -> usize {
        self.sources.len()
    }

    /// The name of each.
    pub fn names(&self) -> Vec<String> {
        self.sources.iter().map(|scan| scan.name().to_owned()).collect()
    }

    /// The number of each.
    pub fn numbers(&self) -> &[u32] {
        &self.numbers
    }

    /// Place of the scan of a number.
    pub fn place(&self, number: u32) -> Option<usize> {
        self.places.0.get(&number).map(|&place| place as usize)
    }

    /// The version of the scan of a number, which has to be one of them.
    pub fn version(&self, number: u32) -> u64 {
        self.versions[self.place(number).expect("it is of a scan of the order")]
    }

    /// Places of all of them.
    pub fn places(&self) -> ScanPlaces {
        self.places.clone()
    }

    /// Whether overlaps of a scan are measured where crossings are many: of scans that follow each other two, about [`SAMPLED_PAIRS`]
    /// times.
    pub fn is_sampled(&self, place: usize) -> bool {
        let every = self.len().div_ceil(2 * SAMPLED_PAIRS).next_power_of_two() as u32;
        let is_first = |place: usize| self.numbers[place] & (every - 1) == 0;
        is_first(place) || place > 0 && is_first(place - 1)
    }
}

/// A number for the nth scan of a name, another at each attempt.
fn number(name: &[u8], nth: u32, attempt: u32) -> u32 {
    let hash = XxHash3_128::oneshot_with_seed(u64::from(nth) << 32 | u64::from(attempt), name);
    (hash % MAX_SCANS as u128) as u32
}

/// The scans, as places in the list, in order: by name, then by `content`. That is asked for of scans that share a name.
///
/// # Errors
/// Errors of `content`. Cancelled.
pub fn in_order(
    sources: &[&dyn ScanSource],
    content: impl Fn(usize) -> Result<u64> + Sync,
    progress: &Progress<'_>,
) -> Result<Vec<usize>> {
    let name = |place: usize| sources[place].name();
    let mut order: Vec<usize> = (0..sources.len()).collect();
    order.sort_by(|&a, &b| name(a).cmp(name(b)));
    for namesakes in order.chunk_by_mut(|&a, &b| name(a) == name(b)).filter(|namesakes| namesakes.len() > 1) {
        let content = |&place: &usize| {
            progress.check()?;
            Ok((content(place)?, place))
        };
        let mut known = namesakes.par_iter().map(content).collect::<Result<Vec<_>>>()?;
        known.sort_by_key(|known| known.0);
        namesakes.iter_mut().zip(known).for_each(|(slot, known)| *slot = known.1);
    }
    Ok(order)
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use image::range_image::{Projection, RangeImage};
    use image::triangulate::TriangulateParams;
    use mesh::{AttributeData, TriMesh};

    use super::*;
    use crate::params::MergeParams;
    use crate::run::{Run, merge};
    use image::source::{Loading, OrientedSurface, PlacedMesh};

    /// Two patches of a plane that overlap, the second shifted and trusted less.
    fn patches(names: [&str; 2]) -> [RangeImage; 2] {
        [0, 1].map(|i| {
            let plane = Projection::Orthographic { first: [0.05 + 1.5 * f64::from(i), 0.03], step: [0.1, 0.1] };
            let heights = (0..900).map(|k| 0.01 * f64::from(i) + 0.02 * f64::from(k % 30)).collect();
            let mut image = RangeImage::from_values(30, 30, heights, plane).unwrap();
            image.name = names[i as usize].to_owned();
            image
        })
    }

    fn sources(scans: &[&dyn ScanSource]) -> Vec<i32> {
        let params = MergeParams { voxel: Some(0.17), max_hole_length: Some(0.0), ..MergeParams::default() };
        let mesh = merge(scans, &params, Run::default(), &Progress::none()).unwrap().mesh;
        match mesh.vertex_attribute("source_scan") {
            Some(AttributeData::I32(sources)) => sources.clone(),
            _ => panic!("no sources"),
        }
    }

    /// A scan that is no more than its name.
    struct Named(String);

    impl ScanSource for Named {
        fn name(&self) -> &str {
            &self.0
        }
        fn load(&self, _: &Loading, _: &Progress<'_>) -> Result<OrientedSurface> {
            unreachable!("nobody asks for it")
        }
    }

    fn numbers(names: &[Named]) -> Vec<u32> {
        let sources: Vec<&dyn ScanSource> = names.iter().map(|scan| scan as &dyn ScanSource).collect();
        let places: Vec<usize> = (0..names.len()).collect();
        let scan_order = ScanOrder::new(&sources, &vec![0; names.len()], &places);
        assert!((0..names.len()).all(|place| scan_order.place(scan_order.numbers()[place]) == Some(place)));
        assert!(scan_order.numbers().iter().all(|&number| (number as usize) < MAX_SCANS));
        scan_order.numbers().to_vec()
    }

    #[test]
    fn all_scans_have_numbers_of_their_own_which_stay_where_others_come_and_go() {
        let names = |count: usize| (0..count).map(|k| Named(format!("frame {k:06}"))).collect::<Vec<_>>();
        numbers(&names(100_000));
        numbers(&(0..3_000).map(|_| Named(String::new())).collect::<Vec<_>>());
        let all = numbers(&names(3_000));
        for gone in [0, 1, 1_700, 2_999] {
            let mut without = names(3_000);
            without.remove(gone);
            let mut expected = all.clone();
            expected.remove(gone);
            // But for one that would have had the number of the one that goes.
            let moved = numbers(&without).iter().zip(&expected).filter(|(a, b)| a != b).count();
            assert!(moved <= 1, "{moved} without {gone}");
        }
        // Of two that want the same number the first has it.
        let twins = |first: &str| [Named(first.to_owned()), Named("b".to_owned())];
        let wanted = number(b"b", 0, 0);
        let rival = (0..).map(|k| format!("a{k}")).find(|name| number(name.as_bytes(), 0, 0) == wanted).unwrap();
        assert_eq!(numbers(&twins(&rival)), [wanted, number(b"b", 0, 1)]);
    }

    #[test]
    fn as_many_pairs_are_sampled_as_there_are_or_some_hundred() {
        for count in [1, 2, 511, 512, 513, 1_000, 1_100, 5_000, 40_000] {
            let names: Vec<Named> = (0..count).map(|k| Named(format!("{k:05}"))).collect();
            let sources: Vec<&dyn ScanSource> = names.iter().map(|scan| scan as &dyn ScanSource).collect();
            let scan_order = ScanOrder::new(&sources, &vec![0; count], &(0..count).collect::<Vec<_>>());
            let pairs =
                (1..count).filter(|&place| scan_order.is_sampled(place - 1) && scan_order.is_sampled(place)).count();
            if count <= 2 * SAMPLED_PAIRS {
                assert_eq!(pairs, count - 1);
            } else {
                assert!((SAMPLED_PAIRS * 3 / 4..4 * SAMPLED_PAIRS).contains(&pairs), "{pairs} of {count}");
            }
        }
    }

    #[test]
    fn namesakes_are_numbered_by_content() {
        let [a, b] = patches(["", ""]);
        let numbers = sources(&[&a, &b]);
        assert!(numbers.contains(&0) && numbers.contains(&1));
        assert_eq!(sources(&[&b, &a]), numbers);
        // As meshes, and as scans that are no more than loaded.
        let params = TriangulateParams::default();
        let meshes = [&a, &b].map(|image| {
            let surface = image.load(&Loading { triangulation: params, cell: 0.0 }, &Progress::none()).unwrap();
            TriMesh::new(surface.positions, surface.triangles)
        });
        let placed = [0, 1].map(|i| PlacedMesh {
            name: "twin".to_owned(),
            mesh: &meshes[i],
            world_from_mesh: DAffine3::IDENTITY,
        });
        assert_eq!(sources(&[&placed[0], &placed[1]]), sources(&[&placed[1], &placed[0]]));
        struct Plain<'a>(&'a RangeImage);
        impl ScanSource for Plain<'_> {
            fn name(&self) -> &str {
                "plain"
            }
            fn load(&self, loading: &Loading, progress: &Progress<'_>) -> Result<OrientedSurface> {
                self.0.load(loading, progress)
            }
        }
        assert_eq!(sources(&[&Plain(&a), &Plain(&b)]), sources(&[&Plain(&b), &Plain(&a)]));
    }

    #[test]
    fn scans_of_different_names_are_numbered_by_them() {
        let [a, b] = patches(["b", "a"]);
        let numbers = sources(&[&a, &b]);
        assert_eq!(sources(&[&b, &a]), numbers);
        let [c, d] = patches(["a", "b"]);
        let turned: Vec<i32> = sources(&[&c, &d]).iter().map(|&s| if s < 0 { s } else { 1 - s }).collect();
        // Ties go to the smaller number, so not all turn.
        let same = turned.iter().zip(&numbers).filter(|(a, b)| a == b).count();
        assert!(5 * same > 4 * numbers.len(), "{same} of {}", numbers.len());
    }
}
