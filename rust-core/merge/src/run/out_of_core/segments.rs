//! Segments: files with the crossings of some scans, added up by edge and sorted by block. Also the sum of all of them.

use std::collections::BTreeMap;
use std::path::PathBuf;

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::files::{Columns, Place, Stored, damaged};
use super::setting::{Key, Setting, remove};
use crate::crossings::bundles::{Added, Found, RawBundle, in_sample};
use crate::crossings::crossing::{BundleKey, Crossing};
use crate::crossings::edge_sums::{self, EdgeSums};
use crate::crossings::fine_details::remove_fine_details;
use crate::crossings::lattice::{ACROSS, BRICK_BITS, Lattice};
use crate::crossings::lines;
use crate::crossings::scan_order::ScanOrder;
use crate::intake::Discretized;
use crate::intake::overlap::{BundleDistances, OverlapDistances};
use crate::intake::placing::Placing;
use base::error::{Error, Result};
use base::progress::Progress;
use image::range_image::noise::Noise;
use image::source::Measured;

/// Sum of all scans.
pub struct Collected {
    /// Findings about them.
    pub about: About,
    /// The segments that hold their crossings.
    pub segments: Vec<Segment>,
}

/// Findings about some scans, but for their crossings.
pub struct About {
    /// The numbers of those that were looked at, also of those that have none.
    pub scans: Vec<u32>,
    /// Number of crossings.
    pub intersections: u64,
    /// Measures of them. No crossings.
    pub found: Discretized,
}

impl About {
    /// Of no scan.
    pub fn none(lattice: Lattice) -> Self {
        About { scans: Vec::new(), intersections: 0, found: Discretized::none(lattice) }
    }

    /// Adds what was found out of others.
    pub fn add(&mut self, other: &About) {
        self.scans.extend(&other.scans);
        self.intersections += other.intersections;
        self.found.add(&other.found);
    }

    /// It in numbers, exactly.
    pub fn to_numbers(&self) -> Vec<f64> {
        let About { scans, intersections, found } = self;
        let Discretized { triangles, full_trust, coloured, placing, images, .. } = found;
        let mut all =
            vec![*intersections as f64, *triangles as f64, (*full_trust).into(), f64::from(u8::from(*coloured))];
        all.extend([placing.spacing, placing.unplaced as f64, scans.len() as f64]);
        all.extend(scans.iter().map(|&scan| f64::from(scan)));
        for (scan, Measured { noise, has_lines_of_sight }) in images {
            let noise = noise.to_numbers();
            all.extend([f64::from(*scan), f64::from(u8::from(*has_lines_of_sight)), noise.len() as f64]);
            all.extend(noise);
        }
        all
    }

    /// The findings that [`About::to_numbers`] wrote. `None` for other numbers.
    pub fn from_numbers(lattice: Lattice, numbers: &[f64]) -> Option<Self> {
        let (&[intersections, triangles, full_trust, coloured, spacing, unplaced, scans], rest) =
            numbers.split_first_chunk()?;
        let (scans, mut rest) = rest.split_at_checked(scans as usize)?;
        let mut about = About {
            scans: scans.iter().map(|&scan| scan as u32).collect(),
            intersections: intersections as u64,
            found: Discretized {
                triangles: triangles as u64,
                full_trust: full_trust as f32,
                coloured: coloured > 0.0,
                placing: Placing { spacing, unplaced: unplaced as u64 },
                ..Discretized::none(lattice)
            },
        };
        while !rest.is_empty() {
            let (&[scan, has_lines, count], more) = rest.split_first_chunk()?;
            let (noise, more) = more.split_at_checked(count as usize)?;
            let measured = Measured { noise: Noise::from_numbers(noise)?, has_lines_of_sight: has_lines > 0.0 };
            about.found.images.push((scan as u32, measured));
            rest = more;
        }
        Some(about)
    }
}

/// A file with crossings of some scans, added up, and where it has those of each block.
pub struct Segment {
    path: PathBuf,
    key: Key,
    /// Its scans.
    pub members: Vec<SegmentMember>,
    /// Whether overlaps can be measured by all of its crossings.
    pub is_whole: bool,
    /// Sorted.
    table: Vec<Entry>,
}

/// A scan of a segment.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Pod, Zeroable)]
pub struct SegmentMember {
    pub number: u32,
    /// Whether samples for overlaps are taken of it.
    pub is_sampled: u32,
    /// Its version.
    pub version: u64,
}

impl SegmentMember {
    /// The scan at a place of the order.
    pub fn of(scan_order: &ScanOrder<'_>, place: usize) -> Self {
        let (number, version) = (scan_order.numbers()[place], scan_order.versions[place]);
        SegmentMember { number, is_sampled: scan_order.is_sampled(place).into(), version }
    }

    /// Whether it is a scan of the order, and counts for the same.
    pub fn is_of(&self, scan_order: &ScanOrder<'_>) -> bool {
        scan_order.place(self.number).is_some_and(|place| *self == SegmentMember::of(scan_order, place))
    }
}

/// Kind of a segment's file.
pub const KIND: &str = "segment";

/// Place in a segment of the content of a block, on lines along an axis, sorted by bundle, line and place. Or of a sample of crossings in a
/// row of blocks, by bundle.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
struct Entry {
    axis: u32,
    kind: u32,
    block: [i32; 3],
    /// Whether crossings are added up. Of [`ABOUT`] whether the samples are whole.
    are_sums: u32,
    /// [`Row`]s.
    bundles: Place,
    /// Content of the rows, one after the other.
    list: Place,
}

const BLOCK: u32 = 0;
const SAMPLE: u32 = 1;
/// The list has what was found out of the scans, in numbers, the bundles are the scans.
const ABOUT: u32 = 2;

impl Entry {
    fn key(&self) -> (u32, [i32; 3], u32) {
        (self.kind, self.block, self.axis)
    }
}

/// A bundle, and how much of it there is.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Row {
    across: [i32; 2],
    count: u32,
}

/// Scans whose crossings a segment has.
pub struct Whose<'a> {
    pub members: &'a [SegmentMember],
    /// Basis that segments follow from besides their scans.
    pub basis: Key,
    /// All scans that there are.
    pub scan_order: &'a ScanOrder<'a>,
}

/// Writes crossings of whole scans to a segment, whose key it gives. If `are_few`, overlaps are measured by all of them.
///
/// # Errors
/// It can't be written. Cancelled.
pub fn write(
    raw: Vec<RawBundle>,
    about: &About,
    &Whose { members, basis, scan_order }: &Whose<'_>,
    setting: &Setting<'_>,
    are_few: bool,
    progress: &Progress<'_>,
) -> Result<Key> {
    // Bundles in rows of blocks.
    let mut rows: BTreeMap<(u8, [i32; 2]), Vec<RawBundle>> = BTreeMap::new();
    for bundle in raw {
        let row = bundle.key.across.map(|brick| setting.cut.of(brick));
        rows.entry((bundle.key.axis, row)).or_default().push(bundle);
    }
    let key = Key::of(&(basis, members, are_few));
    let mut file = Columns::new(&setting.path(KIND, key))?;
    let mut table = Vec::new();
    for ((axis, row), list) in rows {
        progress.check()?;
        let mut blocks: BTreeMap<i32, (Vec<Row>, Vec<Crossing>)> = BTreeMap::new();
        let (mut sampled, mut sample) = (Vec::new(), Vec::new());
        for RawBundle { key, found } in list {
            let before = sample.len();
            let all = found.chunks.iter().flatten().copied();
            sample.extend(all.filter(|crossing| are_few || in_sample(&key, crossing, scan_order)));
            if sample.len() > before {
                sampled.push(Row { across: key.across, count: (sample.len() - before) as u32 });
            }
            lines::for_each_line(&found.chunks, |_, line| {
                remove_fine_details(line);
                for crossing in line {
                    let (bundles, list) = blocks.entry(setting.cut.of(crossing.cell >> BRICK_BITS)).or_default();
                    match bundles.last_mut() {
                        Some(last) if last.across == key.across => last.count += 1,
                        _ => bundles.push(Row { across: key.across, count: 1 }),
                    }
                    list.push(*crossing);
                }
            });
        }
        let [u, v] = ACROSS[axis as usize];
        let mut entry = |kind, block, are_sums: bool, bundles, list| {
            table.push(Entry { axis: axis.into(), kind, block, are_sums: are_sums.into(), bundles, list });
        };
        for (along, (mut bundles, list)) in blocks {
            let mut block = [along; 3];
            [block[u], block[v]] = row;
            // Whichever takes less: where scans overlap that is the sums.
            let are_sums = lines::count_sums(&list) * size_of::<EdgeSums>() < size_of_val(&list[..]);
            let list = if are_sums { file.put(&added_up(&mut bundles, &list))? } else { file.put(&list)? };
            entry(BLOCK, block, are_sums, file.put(&bundles)?, list);
        }
        if !sample.is_empty() {
            entry(SAMPLE, [row[0], row[1], 0], false, file.put(&sampled)?, file.put(&sample)?);
        }
    }
    let (list, bundles) = (file.put(&about.to_numbers())?, file.put(members)?);
    table.push(Entry { axis: 0, kind: ABOUT, block: [0; 3], are_sums: are_few.into(), bundles, list });
    table.sort_unstable_by_key(Entry::key);
    file.finish(&table)?;
    Ok(key)
}

/// The crossings of bundles added up, which then have so many.
fn added_up(bundles: &mut [Row], crossings: &[Crossing]) -> Vec<EdgeSums> {
    let mut all = Vec::new();
    let mut rest = crossings;
    for bundle in bundles {
        let (of_bundle, others) = rest.split_at(bundle.count as usize);
        rest = others;
        let before = all.len();
        lines::add_up_sorted(of_bundle, &mut all);
        bundle.count = (all.len() - before) as u32;
    }
    all
}

impl Segment {
    /// Those that are there of scans in this grid, whoever collected them.
    ///
    /// # Errors
    /// A file can't be read.
    pub fn all(basis: Key, lattice: Lattice, setting: &Setting<'_>) -> Result<Vec<(Self, About)>> {
        let open = |path: PathBuf| {
            let (stored, table) = Stored::open::<Entry>(&path)?;
            let about = table.iter().find(|entry| entry.kind == ABOUT).ok_or_else(|| damaged(&path))?;
            let (members, is_whole) = (stored.get::<SegmentMember>(&about.bundles)?, about.are_sums != 0);
            let key = Key::of(&(basis, &members[..], is_whole));
            if setting.path(KIND, key) != path {
                return Ok(None);
            }
            let numbers: Vec<f64> = stored.get(&about.list)?;
            let about = About::from_numbers(lattice, &numbers).ok_or_else(|| damaged(&path))?;
            Ok(Some((Segment { path, key, members, is_whole, table }, about)))
        };
        setting.files(KIND)?.into_iter().filter_map(|path| open(path).transpose()).collect()
    }

    /// Key that it follows from.
    pub fn key(&self) -> Key {
        self.key
    }

    /// Removes it.
    ///
    /// # Errors
    /// It can't be removed.
    pub fn remove(&self) -> Result<()> {
        remove(&self.path)
    }

    /// Place of its content of a block, or of the sample of a row of blocks.
    fn find(&self, kind: u32, block: [i32; 3], axis: u32) -> Option<&Entry> {
        let place = self.table.binary_search_by_key(&(kind, block, axis), Entry::key).ok()?;
        Some(&self.table[place])
    }
}

impl Collected {
    /// The segments of these keys.
    ///
    /// # Errors
    /// A file can't be read.
    pub fn open(keys: &[Key], basis: Key, lattice: Lattice, setting: &Setting<'_>) -> Result<Self> {
        let mut all = Collected { about: About::none(lattice), segments: Vec::new() };
        for (segment, about) in Segment::all(basis, lattice, setting)? {
            if keys.contains(&segment.key) {
                all.about.add(&about);
                all.segments.push(segment);
            }
        }
        if let Some(key) = keys.iter().find(|&&key| all.segments.iter().all(|segment| segment.key != key)) {
            let path = setting.path(KIND, *key);
            return Err(Error::io(&path, std::io::ErrorKind::NotFound.into()));
        }
        Ok(all)
    }

    /// Key that the content of a block follows from.
    pub fn key_of(&self, block: [i32; 3]) -> Key {
        let has = |segment: &&Segment| (0..3).any(|axis| segment.find(BLOCK, block, axis).is_some());
        let mut keys: Vec<Key> = self.segments.iter().filter(has).map(Segment::key).collect();
        keys.sort_unstable();
        Key::of(&(block, keys))
    }

    /// The blocks in which there is anything, in order.
    pub fn blocks(&self) -> Vec<[i32; 3]> {
        self.all(BLOCK, |entry| entry.block)
    }

    /// Different values of the entries of a kind, in order.
    fn all<T: Ord>(&self, kind: u32, of: impl Fn(&Entry) -> T) -> Vec<T> {
        let entries = self.segments.iter().flat_map(|segment| &segment.table).filter(|entry| entry.kind == kind);
        let mut all: Vec<T> = entries.map(of).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Rows of blocks that overlaps are measured in.
    pub fn rows(&self) -> usize {
        self.all(SAMPLE, |entry| (entry.axis, entry.block)).len()
    }

    /// Distances between the scans.
    ///
    /// # Errors
    /// A segment can't be read. Cancelled.
    pub fn distances(
        &self,
        scan_order: &ScanOrder<'_>,
        kept: u64,
        progress: &Progress<'_>,
    ) -> Result<OverlapDistances> {
        let rows = self.all(SAMPLE, |entry| (entry.axis, entry.block));
        let are_sampled = self.about.intersections > kept;
        let of_row = |(axis, row): (u32, [i32; 3])| {
            progress.advance(1)?;
            let mut bundles: BTreeMap<[i32; 2], Vec<Vec<Crossing>>> = BTreeMap::new();
            for segment in &self.segments {
                let Some(entry) = segment.find(SAMPLE, row, axis) else { continue };
                let stored = Stored::again(&segment.path)?;
                let list: Vec<Crossing> = stored.get(&entry.list)?;
                for (across, list) in by_bundle(&stored.get(&entry.bundles)?, &list) {
                    let key = BundleKey { axis: axis as u8, across };
                    let is_told = |crossing: &Crossing| !are_sampled || in_sample(&key, crossing, scan_order);
                    bundles.entry(across).or_default().push(list.iter().copied().filter(is_told).collect());
                }
            }
            let measured = bundles.into_iter().map(|(across, chunks)| {
                let key = BundleKey { axis: axis as u8, across };
                let raw = RawBundle { key, found: Found { chunks, added: Added::default() } };
                BundleDistances::measure(&raw, scan_order, are_sampled)
            });
            Ok((axis as u8, measured.collect::<Vec<_>>()))
        };
        let mut all = OverlapDistances::none();
        for (axis, of_row) in rows.into_par_iter().map(of_row).collect::<Result<Vec<_>>>()? {
            of_row.iter().for_each(|of_bundle| all.add(axis, of_bundle));
        }
        Ok(all)
    }

    /// Sums of the crossings in one block on lines along an axis, per bundle.
    ///
    /// # Errors
    /// A segment can't be read. Cancelled.
    pub fn sums(
        &self,
        block: [i32; 3],
        axis: usize,
        progress: &Progress<'_>,
    ) -> Result<BTreeMap<[i32; 2], Vec<EdgeSums>>> {
        let mut all: BTreeMap<[i32; 2], Vec<EdgeSums>> = BTreeMap::new();
        for segment in &self.segments {
            let Some(entry) = segment.find(BLOCK, block, axis as u32) else { continue };
            progress.check()?;
            let stored = Stored::again(&segment.path)?;
            let mut bundles: Vec<Row> = stored.get(&entry.bundles)?;
            let list = match entry.are_sums {
                0 => added_up(&mut bundles, &stored.get::<Crossing>(&entry.list)?),
                _ => stored.get(&entry.list)?,
            };
            for (across, list) in by_bundle(&bundles, &list) {
                edge_sums::add_up(all.entry(across).or_default(), list);
            }
        }
        Ok(all)
    }
}

/// Parts of a list by rows.
fn by_bundle<'a, T>(rows: &'a [Row], mut list: &'a [T]) -> impl Iterator<Item = ([i32; 2], &'a [T])> {
    rows.iter().map(move |row| {
        let (of_row, rest) = list.split_at(row.count as usize);
        list = rest;
        (row.across, of_row)
    })
}
