//! A surface that is changed in place is the same as one that is written piece by piece.

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::surface::extract::Row;
use crate::surface::parts;
use crate::surface::parts::Chosen;
use crate::surface::tile::{Share, Tile};
use mesh::TriMesh;

/// Points along each side of a sheet.
const SIDE: u32 = 4;
/// Vertices and triangles of a sheet.
const VERTICES: u32 = SIDE * SIDE;
const TRIANGLES: u32 = 2 * (SIDE - 1) * (SIDE - 1);

/// The surface of so many sheets that lie apart, in bricks of one sheet each.
fn tile(sheets: u32) -> Tile {
    let mut surface = Surface::default();
    for v in 0..sheets * VERTICES {
        let (x, y, sheet) = (v % SIDE, v / SIDE % SIDE, v / VERTICES);
        let position = DVec3::new(x.into(), y.into(), f64::from(9 * sheet));
        let colour = [v as u8, 1, 2, if v % 5 == 0 { 0 } else { 255 }];
        surface.push(Row { position, confidence: v as f32, noise: 0.5 * v as f32, colour, scan: v as i32 % 3 });
    }
    for t in 0..sheets * TRIANGLES {
        let (square, sheet) = (t % TRIANGLES / 2, t / TRIANGLES);
        let p = sheet * VERTICES + square / (SIDE - 1) * SIDE + square % (SIDE - 1);
        let [q, r, s] = [p + 1, p + 1 + SIDE, p + SIDE];
        surface.triangles.push(if t % 2 == 0 { [p, q, r] } else { [p, r, s] });
        surface.cases.push(Case::ALL[t as usize % 2]);
    }
    let share = |z| Share { brick: [0, 0, z], vertices: VERTICES, copies: 0, triangles: TRIANGLES };
    let mut tile = Tile {
        surface,
        shares: (0..sheets as i32).map(share).collect(),
        first: (0..sheets).map(|sheet| sheet * VERTICES).collect(),
        copied: Vec::new(),
        foreign: Vec::new(),
        own: (sheets * VERTICES) as usize,
        shared: Vec::new(),
        artificial: 0,
        parts: Vec::new(),
        part_of: Vec::new(),
    };
    (tile.part_of, tile.parts) = parts::within(&tile, &Progress::none()).unwrap();
    tile
}

/// Changes that closing holes may make: places in lists are taken modulo their lengths.
#[derive(Clone, Debug)]
struct Changed {
    kept: Vec<bool>,
    moved: Vec<u32>,
    removed: Vec<u64>,
    renamed: Vec<(u64, [u32; 3])>,
    /// Triangles, each with a vertex of its own.
    added: Vec<[u32; 2]>,
    coloured: bool,
}

fn changed() -> impl Strategy<Value = Changed> {
    let kept = prop::collection::vec(prop::bool::weighted(0.7), 3);
    let moved = prop::collection::vec(any::<u32>(), 0..6);
    let removed = prop::collection::vec(any::<u64>(), 0..20);
    let renamed = prop::collection::vec((any::<u64>(), any::<[u32; 3]>()), 0..6);
    let added = prop::collection::vec(any::<[u32; 2]>(), 0..5);
    (kept, moved, removed, renamed, added, any::<bool>()).prop_map(
        |(kept, moved, removed, renamed, added, coloured)| Changed { kept, moved, removed, renamed, added, coloured },
    )
}

fn whole(asked: &Changed) -> Whole<Vec<Tile>> {
    let progress = Progress::none();
    let tiles = vec![tile(asked.kept.len() as u32)];
    let parts = parts::find(&tiles, &progress).unwrap();
    let chosen = Chosen { parts, kept: asked.kept.clone(), size: DVec3::ONE };
    let mut whole = Whole::new(tiles, chosen, &progress).unwrap();
    let known = whole.numbers.vertices;
    if known == 0 {
        return whole;
    }
    let (first, all) = (known, known + asked.added.len() as u64);
    for (v, corners) in (first..).zip(&asked.added) {
        let position = DVec3::new(v as f64, 0.5, -1.0);
        whole.added.push(Row { position, confidence: 1.0, noise: 0.0, colour: [3, 4, 5, 0], scan: -1 });
        let [a, b] = corners.map(|corner| u64::from(corner) % known);
        whole.corners.push([a, b, v]);
        whole.added.cases.push(Case::Fill);
    }
    let triangles = whole.triangles();
    let changes = &mut whole.changes;
    changes.moved.extend(asked.moved.iter().map(|&v| (u64::from(v) % all, (DVec3::splat(f64::from(v % 7)), -1))));
    changes.removed.extend(asked.removed.iter().map(|t| t % triangles));
    let renamed = asked.renamed.iter().map(|(t, corners)| (t % triangles, corners.map(|v| u64::from(v) % all)));
    changes.renamed.extend(renamed.filter(|of| !changes.removed.contains(&of.0)));
    // Corners that are others are known as those of added triangles are.
    let numbered = whole.tile(0).unwrap();
    let rows: Vec<(u64, Row)> = (0..numbered.tile.own)
        .map(|v| (numbered.vertex(v), numbered.tile.surface.row(v)))
        .filter(|row| row.0 != GONE)
        .collect();
    drop(numbered);
    whole.rims.extend(rows);
    let mut is_used = vec![false; all as usize];
    whole
        .each_triangle(&progress, |corners| corners.iter().for_each(|corner| is_used[corner.0 as usize] = true))
        .unwrap();
    whole.changes.bare = (0..all).filter(|&v| !is_used[v as usize]).collect();
    whole
}

/// Scans stand in another order than their numbers.
fn besides(asked: &Changed) -> Besides {
    let places = ScanPlaces([(0, 1), (1, 2), (2, 0)].into_iter().collect());
    Besides { coloured: asked.coloured, places, ..Besides::default() }
}

proptest! {
    #[test]
    fn in_place_is_as_piece_by_piece(asked in changed()) {
        let progress = Progress::none();
        let colours = asked.coloured.then(|| bare_colours::fill_in(&whole(&asked), &progress).unwrap());
        let mut pieces = TriMesh::default();
        let counts = in_pieces(&whole(&asked), colours.as_ref(), besides(&asked), &mut pieces, &progress).unwrap();
        let mut at_once = TriMesh::default();
        prop_assert_eq!(write(whole(&asked), besides(&asked), &mut at_once, &progress).unwrap(), counts);
        prop_assert!(at_once == pieces);
    }
}
