//! The numbers of the scans: by name, then by content.

use rayon::prelude::*;

use base::{Progress, Result};
use image::source::ScanSource;

/// The scans, as places in the list, in the order of their numbers: by name, then by `content`, so that the order of the list does
/// not matter. That is asked for of scans that share a name.
///
/// # Errors
/// What `content` says; cancelled.
pub(super) fn in_order(
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
    use crate::{Loading, MergeParams, OrientedSurface, PlacedMesh, run};

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
        let mesh = run(scans, &params, &Progress::none()).unwrap().mesh;
        match mesh.vertex_attribute("source_scan") {
            Some(AttributeData::I32(sources)) => sources.clone(),
            _ => panic!("no sources"),
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
