//! Rules that peeling must hold, on sheets with holes.

use std::borrow::Cow;
use std::collections::BTreeMap;

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::crossings::scan_order::ScanPlaces;
use crate::finish::close_holes::{self, Room};
use crate::finish::write::{self, Besides};
use crate::surface::extract::Case;
use crate::surface::numbering::Numbers;
use crate::surface::parts;
use crate::surface::parts::Chosen;
use crate::surface::tile::{Share, Tile, Tiles};
use crate::surface::whole::Whole;
use crate::visibility::eyes::Eyes;
use crate::{MergeParams, MergeReport};
use mesh::sink::{MeshOutline, MeshSink};
use mesh::{AttributeData, TriMesh, check};

/// Squares along each side of a sheet.
const SIDE: i32 = 20;
/// Distance between sheets: exact in all places of a sheet.
const APART: f64 = 1024.0;

/// A sheet with a hole, around which vertices stand out of it, by place and height. A fin through the hole's middle.
#[derive(Clone, Debug)]
struct Sheet {
    hole: i32,
    spikes: Vec<(i32, i32, i32)>,
    fin: bool,
}

fn sheet() -> impl Strategy<Value = Sheet> {
    let spikes = prop::collection::vec((5..16_i32, 5..16_i32, -200..200_i32), 0..25);
    (2..6_i32, spikes, prop::bool::weighted(0.2)).prop_map(|(hole, spikes, fin)| Sheet { hole, spikes, fin })
}

impl Sheet {
    fn mesh(&self) -> TriMesh {
        let at = |x: i32, y: i32| (y * (SIDE + 1) + x) as u32;
        let places = (0..=SIDE).flat_map(|y| (0..=SIDE).map(move |x| DVec3::new(x.into(), y.into(), 0.5)));
        let mut positions: Vec<DVec3> = places.collect();
        for &(x, y, height) in &self.spikes {
            // Toward the middle, so that what stands out leans over the hole.
            let moved = f64::from(height) / 64.0;
            let middle = DVec3::new(10.0, 10.0, 0.0);
            let place = &mut positions[at(x, y) as usize];
            let toward = ((middle - *place) * 8.0).round() / 8.0 * DVec3::new(1.0, 1.0, 0.0);
            *place += toward * 0.5 + DVec3::Z * moved;
        }
        let is_cut = |x: i32, y: i32| {
            [x, y].iter().all(|a| (10 - self.hole / 2..10 + self.hole / 2 + self.hole % 2).contains(a))
        };
        let mut triangles = Vec::new();
        for (x, y) in (0..SIDE * SIDE).map(|i| (i % SIDE, i / SIDE)).filter(|&(x, y)| !is_cut(x, y)) {
            let [p, q, r, s] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            triangles.extend([[p, q, r], [p, r, s]]);
        }
        if self.fin {
            let first = positions.len() as u32;
            let corners = [[9.75, -1.0], [10.5, -1.0], [10.5, 2.0], [9.75, 2.0]];
            positions.extend(corners.map(|[x, z]| DVec3::new(x, 10.25, z)));
            triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
        TriMesh::new(positions, triangles)
    }
}

/// The surface of several sheets, side by side.
fn surface(sheets: &[Sheet], first: usize) -> Surface {
    let mut surface = Surface::default();
    for (i, sheet) in sheets.iter().enumerate() {
        let (mesh, before) = (sheet.mesh(), surface.positions.len() as u32);
        let aside = DVec3::X * APART * (first + i) as f64;
        surface.positions.extend(mesh.positions.iter().map(|p| p + aside));
        surface.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + before)));
    }
    let sides = || surface.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let all: FxHashSet<[u32; 2]> = sides().collect();
    surface.boundary = sides().filter(|&[a, b]| !all.contains(&[b, a])).collect();
    let count = surface.positions.len();
    (surface.confidence, surface.noise) = (vec![1.0; count], vec![0.0; count]);
    (surface.colour, surface.scan) = (vec![[9; 4]; count], vec![0; count]);
    surface.cases = vec![Case::Direct; surface.triangles.len()];
    surface
}

/// A surface that is one tile.
fn tile(surface: Surface) -> Tile {
    let (vertices, triangles) = (surface.positions.len() as u32, surface.triangles.len() as u32);
    let mut tile = Tile {
        surface,
        shares: vec![Share { brick: [0; 3], vertices, copies: 0, triangles }],
        first: vec![0],
        copied: Vec::new(),
        foreign: Vec::new(),
        own: vertices as usize,
        shared: Vec::new(),
        artificial: 0,
        parts: Vec::new(),
        part_of: Vec::new(),
    };
    (tile.part_of, tile.parts) = parts::within(&tile, &Progress::none()).unwrap();
    tile
}

fn whole<T: Tiles>(tiles: T) -> Whole<T> {
    let progress = Progress::none();
    let parts = parts::find(&tiles, &progress).unwrap();
    let kept = vec![true; parts.list.len()];
    Whole::new(tiles, Chosen { parts, kept, size: DVec3::ONE }, &progress).unwrap()
}

/// Closes what can be closed and hands the surface over. Returns the holes closed and those left open.
fn closed_into<T: Tiles>(mut whole: Whole<T>, sink: &mut dyn MeshSink) -> [u64; 2] {
    let progress = Progress::none();
    let lattice = Lattice::new(1.0, DVec3::ZERO, [0; 3]).unwrap();
    let params = MergeParams { max_hole_length: Some(60.0), ..MergeParams::default() };
    let mut found = MergeReport::default();
    close_holes::close(&mut whole, &Eyes::default(), &lattice, &params, Room::ALL, &mut found, &progress).unwrap();
    let besides = Besides { places: ScanPlaces([(0, 0)].into_iter().collect()), ..Besides::default() };
    write::write(whole, besides, sink, &progress).unwrap();
    found.holes
}

/// Holes closed and left open, and the triangles by their corners.
fn closed(sheets: &[Sheet], first: usize) -> ([u64; 2], Vec<[[u64; 3]; 3]>) {
    let mut mesh = TriMesh::default();
    let holes = closed_into(whole(vec![tile(surface(sheets, first))]), &mut mesh);
    let corner = |v: u32| mesh.positions[v as usize].to_array().map(f64::to_bits);
    let mut triangles: Vec<_> = mesh.triangles.iter().map(|t| t.map(corner)).collect();
    triangles.sort_unstable();
    let report = check(&mesh);
    assert!(report.is_manifold(), "{report}");
    assert_eq!(report.boundary_loops as u64, holes[1]);
    (holes, triangles)
}

/// Tiles that are never one surface in memory.
struct Apart(Vec<Tile>);

impl Tiles for Apart {
    fn count(&self) -> usize {
        self.0.count()
    }

    fn get(&self, tile: usize) -> Result<Cow<'_, Tile>> {
        self.0.get(tile)
    }

    fn positions(&self, tile: usize) -> Result<Cow<'_, [DVec3]>> {
        self.0.positions(tile)
    }

    fn noise(&self, tile: usize) -> Result<Cow<'_, [f32]>> {
        self.0.noise(tile)
    }

    fn artificial(&self) -> u64 {
        0
    }

    fn take_only(&mut self) -> Option<Tile> {
        None
    }
}

/// Things that are handed over, by number.
#[derive(Default)]
struct Taken {
    outline: MeshOutline,
    vertices: BTreeMap<u64, [u64; 3]>,
    triangles: BTreeMap<u64, [u64; 3]>,
}

impl MeshSink for Taken {
    fn begin(&mut self, outline: &MeshOutline) -> Result<()> {
        self.outline = outline.clone();
        Ok(())
    }

    fn vertices(&mut self, first: u64, positions: &[DVec3], _: &[AttributeData]) -> Result<()> {
        self.vertices.extend((first..).zip(positions.iter().map(|p| p.to_array().map(f64::to_bits))));
        Ok(())
    }

    fn triangles(&mut self, first: u64, triangles: &[[u64; 3]], _: &[AttributeData]) -> Result<()> {
        self.triangles.extend((first..).zip(triangles.iter().copied()));
        Ok(())
    }
}

/// Theorem: numbers are of 64 bits wherever tiles are put together, as if billions of vertices came before those that are there.
#[test]
fn numbers_go_beyond_32_bits() {
    let spikes: Vec<_> = (8..13).map(|x| (x, 7, if x % 2 == 0 { 40 } else { -40 })).collect();
    let sheets = [
        Sheet { hole: 4, spikes: Vec::new(), fin: false },
        Sheet { hole: 4, spikes, fin: false },
        Sheet { hole: 3, spikes: Vec::new(), fin: true },
    ];
    let (holes, expected) = closed(&sheets, 0);
    assert!(holes[0] >= 2, "{holes:?}");
    // The limit is among the vertices, and far below.
    for others in [0, (1 << 32) - 700, 1 << 40] {
        let mut whole = whole(Apart(vec![tile(surface(&sheets, 0))]));
        whole.numbers = Numbers::after(others, &whole.tiles, &whole.chosen);
        let mut taken = Taken::default();
        assert_eq!(closed_into(whole, &mut taken), holes);
        let Taken { outline, vertices, triangles } = taken;
        assert!(vertices.keys().copied().eq(others..outline.vertices), "{others}");
        assert!(triangles.keys().copied().eq(others..outline.triangles), "{others}");
        let mut found: Vec<_> = triangles.values().map(|t| t.map(|v| vertices[&v])).collect();
        found.sort_unstable();
        assert!(found == expected, "{others}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(60)))]

    /// Theorem: what is done in one place does not depend on what is elsewhere.
    #[test]
    fn places_do_not_decide_about_each_other(sheets in prop::collection::vec(sheet(), 2..12)) {
        let (holes, triangles) = closed(&sheets, 0);
        let alone: Vec<_> = sheets.iter().enumerate().map(|(i, sheet)| closed(std::slice::from_ref(sheet), i)).collect();
        let sum = |i: usize| alone.iter().map(|(holes, _)| holes[i]).sum::<u64>();
        prop_assert_eq!(holes, [sum(0), sum(1)]);
        let mut expected: Vec<_> = alone.into_iter().flat_map(|(_, triangles)| triangles).collect();
        expected.sort_unstable();
        prop_assert!(triangles == expected);
    }
}

#[test]
fn what_leans_over_a_hole_is_peeled_and_what_stands_in_it_stays() {
    let spikes: Vec<_> = (8..13).map(|x| (x, 7, if x % 2 == 0 { 40 } else { -40 })).collect();
    let flap = Sheet { hole: 4, spikes, fin: false };
    let surface = surface(std::slice::from_ref(&flap), 0);
    let ([closed_holes, open], triangles) = closed(std::slice::from_ref(&flap), 0);
    assert_eq!((closed_holes, open), (1, 1));
    let corner = |v: u32| surface.positions[v as usize].to_array().map(f64::to_bits);
    let gone = surface.triangles.iter().filter(|t| triangles.binary_search(&t.map(corner)).is_err()).count();
    assert!(gone > 5, "{gone}");
    let fin = Sheet { hole: 4, spikes: Vec::new(), fin: true };
    let before = self::surface(std::slice::from_ref(&fin), 0);
    let (holes, triangles) = closed(&[fin], 0);
    assert_eq!((holes, triangles.len()), ([0, 3], before.triangles.len()));
}
