//! The elements of a PLY file: vertices, faces, triangle strips, range grids. All others are checked and skipped.

use super::columns::{Attributes, EMPTY_ROW, POSITION, Plan, Position, Row, SKIP, reserve};
use super::fault::Fault;
use super::header::{Element, Encoding, Kind, ScalarType};
use super::problem::{Parsed, Problem};
use super::source::{Grid, Layout, NO_VERTEX, Source};
use super::words::place;
use crate::import::polygons::Polygons;

/// Vertices with what else they have.
pub(super) struct Vertices<P> {
    pub(super) positions: Vec<P>,
    pub(super) attributes: Attributes,
}

/// Compares the claimed number of entries with what the rest of the file can hold, before anything is allocated.
pub(super) fn claimed(element: &Element, smallest: u64, encoding: Encoding, left: u64) -> Parsed<usize> {
    // Text may end without a line end.
    let left = left + u64::from(encoding == Encoding::Ascii);
    let most = left.checked_div(smallest).unwrap_or(0);
    if element.count > most {
        let problem = format!(
            "the header claims {}, but the rest of the file holds at most {most}: it is cut short",
            element.count
        );
        return Err(Problem::new(format!("element {}", element.name), problem));
    }
    if element.count >= u64::from(NO_VERTEX) {
        let problem = format!("{} entries are more than {NO_VERTEX}, the most that can be handled", element.count);
        return Err(Problem::new(format!("element {}", element.name), problem));
    }
    Ok(element.count as usize)
}

/// Reads the vertices.
pub(super) fn vertices<S: Source, P: Position>(
    source: &mut S,
    element: &Element,
    plan: &Plan,
    encoding: Encoding,
) -> Parsed<Vertices<P>> {
    let count = claimed(element, element.smallest_size(encoding), encoding, source.window().left())?;
    let mut positions: Vec<P> = reserve(count)?;
    let mut attributes = Attributes::new(plan, count)?;
    if plan.is_bare() {
        loop {
            source.plain_positions(count, &mut positions);
            let index = positions.len();
            if index == count {
                return Ok(Vertices { positions, attributes });
            }
            let position = bare(source).map_err(|(fault, axis)| fault.at(element, index as u64, axis, source))?;
            positions.push(position);
        }
    }
    let has_attributes = !attributes.is_empty();
    let mut row = EMPTY_ROW;
    let mut add = |row: &Row| {
        positions.push(P::from_row(row[POSITION], row[POSITION + 1], row[POSITION + 2]));
        if has_attributes {
            attributes.push(row);
        }
    };
    let mut index = 0;
    if let Some(layout) = layout(element, plan, 0) {
        source.rows(&layout, count, &mut row, |row| {
            add(row);
            index += 1;
        });
    }
    for index in index..count {
        vertex_row(source, element, plan, &mut row)
            .map_err(|(fault, property)| fault.at(element, index as u64, property, source))?;
        add(&row);
    }
    Ok(Vertices { positions, attributes })
}

/// Places of the values of an entry, with lists, of which there is one at most, of `corners` items. `None` with more.
fn layout(element: &Element, plan: &Plan, corners: usize) -> Option<Layout> {
    let mut layout = Layout {
        size: 0,
        properties: element.properties.len(),
        list: 0,
        list_types: [ScalarType::U8; 2],
        wanted: Vec::new(),
    };
    let mut lists = 0;
    for (property, &slot) in element.properties.iter().zip(&plan.slots) {
        match property.kind {
            Kind::Scalar(scalar) => {
                if slot != SKIP {
                    layout.wanted.push((layout.size, scalar, slot));
                }
                layout.size += scalar.size();
            }
            Kind::List { length, item } => {
                lists += 1;
                layout.list = layout.size;
                layout.list_types = [length, item];
                layout.size += length.size() + corners * item.size();
            }
        }
    }
    (lists <= corners.min(1)).then_some(layout)
}

/// Reads one vertex into `row`. On a fault also the property.
pub(super) fn vertex_row<S: Source>(
    source: &mut S,
    element: &Element,
    plan: &Plan,
    row: &mut Row,
) -> Result<(), (Fault, Option<usize>)> {
    source.begin().map_err(|fault| (fault, None))?;
    for (p, (property, &slot)) in element.properties.iter().zip(&plan.slots).enumerate() {
        let read = match property.kind {
            Kind::Scalar(scalar) if slot != SKIP => source.number(scalar).map(|value| row[slot] = value),
            _ => source.skip_property(property),
        };
        read.map_err(|fault| (fault, Some(p)))?;
    }
    source.end().map_err(|fault| (fault, None))
}

/// A vertex of three floats and nothing else. On a fault also which of them.
#[inline(always)]
fn bare<S: Source, P: Position>(source: &mut S) -> Result<P, (Fault, Option<usize>)> {
    source.begin().map_err(|fault| (fault, None))?;
    let x = source.number(ScalarType::F32).map_err(|fault| (fault, Some(0)))?;
    let y = source.number(ScalarType::F32).map_err(|fault| (fault, Some(1)))?;
    let z = source.number(ScalarType::F32).map_err(|fault| (fault, Some(2)))?;
    source.end().map_err(|fault| (fault, None))?;
    Ok(P::from_row(x, y, z))
}

/// Points of cells whose vertices have been read before and have nothing but a position.
pub(super) struct GridPoints<'a, P> {
    pub(super) positions: &'a [P],
    pub(super) points: Vec<[f32; 3]>,
}

impl<P: Position> Grid for GridPoints<'_, P> {
    fn len(&self) -> usize {
        self.points.len()
    }

    #[inline(always)]
    fn add(&mut self, vertex: u32) {
        self.points.push(self.positions.get(vertex as usize).map_or([f32::NAN; 3], |p| p.to_single()));
    }

    #[inline(always)]
    fn add_empty(&mut self, count: usize) {
        self.points.resize(self.points.len() + count, [f32::NAN; 3]);
    }
}

/// Compares the claimed number of cells with the file.
pub(super) fn claimed_cells<S: Source>(source: &S, element: &Element, encoding: Encoding) -> Parsed<usize> {
    claimed(element, element.smallest_size(encoding), encoding, source.window().left())
}

/// Reads the `count` cells of a range grid of `cols` columns.
pub(super) fn range_grid<S: Source, G: Grid>(
    source: &mut S,
    element: &Element,
    count: usize,
    cols: u64,
    vertex_count: u64,
    grid: &mut G,
) -> Parsed<()> {
    let (list, length_type, item_type) = index_list(element)?;
    let plain = element.properties.len() == 1;
    loop {
        if plain {
            source.plain_cells([length_type, item_type], vertex_count, count, grid);
        }
        if grid.len() == count {
            return Ok(());
        }
        let index = grid.len() as u64;
        let at = |fault: Fault, property, source: &S| fault.at(element, index, property, source);
        source.begin().map_err(|fault| at(fault, None, source))?;
        let mut cell = NO_VERTEX;
        for (p, property) in element.properties.iter().enumerate() {
            if p != list {
                source.skip_property(property).map_err(|fault| at(fault, Some(p), source))?;
                continue;
            }
            let length = source.whole(length_type).map_err(|fault| at(fault, Some(p), source))?;
            if length == 0 {
                continue;
            }
            let problem = |source: &S, problem: String| {
                wrong(source, element, index, format!("row {}, column {}: {problem}", index / cols, index % cols))
            };
            if length != 1 {
                return Err(problem(source, format!("a cell holds at most one vertex, this one {length}")));
            }
            let vertex = source.whole(item_type).map_err(|fault| at(fault, Some(p), source))?;
            cell = checked_index(vertex, vertex_count).map_err(|text| problem(source, text))?;
        }
        source.end().map_err(|fault| at(fault, None, source))?;
        grid.add(cell);
    }
}

/// Faces as triangles: polygons as fans around their first vertex, which are still to be cut.
pub(super) struct Faces {
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) polygons: Polygons,
    pub(super) attributes: Attributes,
}

/// Reads faces.
pub(super) fn faces<S: Source>(
    source: &mut S,
    element: &Element,
    plan: &Plan,
    encoding: Encoding,
    vertex_count: u64,
) -> Parsed<Faces> {
    let (list, length_type, item_type) = index_list(element)?;
    let corner = if encoding == Encoding::Ascii { 2 } else { item_type.size() as u64 };
    let count = claimed(element, element.smallest_size(encoding) + 3 * corner, encoding, source.window().left())?;
    let mut triangles: Vec<[u32; 3]> = reserve(count)?;
    let mut attributes = Attributes::new(plan, count)?;
    let mut polygons = Polygons::default();
    let has_attributes = !attributes.is_empty();
    let mut row = EMPTY_ROW;
    let mut index = 0;
    let layout = layout(element, plan, 3);
    while index < count as u64 {
        if let Some(layout) = &layout {
            let before = triangles.len();
            let most = before + (count as u64 - index) as usize;
            source.plain_triangles(layout, vertex_count, most, &mut triangles, &mut row, |row| {
                if has_attributes {
                    attributes.push(row);
                }
            });
            index += (triangles.len() - before) as u64;
            if index == count as u64 {
                break;
            }
        }
        let at = |fault: Fault, property, source: &S| fault.at(element, index, property, source);
        let first = triangles.len();
        source.begin().map_err(|fault| at(fault, None, source))?;
        for (p, property) in element.properties.iter().enumerate() {
            if p != list {
                let read = match property.kind {
                    Kind::Scalar(scalar) if plan.slots[p] != SKIP => {
                        source.number(scalar).map(|value| row[plan.slots[p]] = value)
                    }
                    _ => source.skip_property(property),
                };
                read.map_err(|fault| at(fault, Some(p), source))?;
                continue;
            }
            let length = source.length(length_type, item_type).map_err(|fault| at(fault, Some(p), source))?;
            if length < 3 {
                return Err(wrong(source, element, index, format!("a face needs 3 vertices, this one has {length}")));
            }
            let corner = |source: &mut S| -> Parsed<u32> {
                let vertex = source.whole(item_type).map_err(|fault| at(fault, Some(p), source))?;
                checked_index(vertex, vertex_count).map_err(|text| wrong(source, element, index, text))
            };
            let apex = corner(source)?;
            let mut previous = corner(source)?;
            for _ in 2..length {
                let next = corner(source)?;
                triangles.push([apex, previous, next]);
                previous = next;
            }
            polygons.add(first, length as usize);
        }
        source.end().map_err(|fault| at(fault, None, source))?;
        if has_attributes {
            for _ in first..triangles.len() {
                attributes.push(&row);
            }
        }
        index += 1;
    }
    Ok(Faces { triangles, polygons, attributes })
}

/// Reads triangle strips. -1 starts a new one, and every second triangle of a strip is turned over.
pub(super) fn strips<S: Source>(
    source: &mut S,
    element: &Element,
    encoding: Encoding,
    vertex_count: u64,
    triangles: &mut Vec<[u32; 3]>,
) -> Parsed<()> {
    let (list, length_type, item_type) = index_list(element)?;
    let count = claimed(element, element.smallest_size(encoding), encoding, source.window().left())?;
    for index in 0..count as u64 {
        let at = |fault: Fault, property, source: &S| fault.at(element, index, property, source);
        source.begin().map_err(|fault| at(fault, None, source))?;
        for (p, property) in element.properties.iter().enumerate() {
            if p != list {
                source.skip_property(property).map_err(|fault| at(fault, Some(p), source))?;
                continue;
            }
            let length = source.length(length_type, item_type).map_err(|fault| at(fault, Some(p), source))?;
            let mut last = [0; 2];
            let mut strip = 0_u64;
            for _ in 0..length {
                let vertex = source.whole(item_type).map_err(|fault| at(fault, Some(p), source))?;
                if vertex == -1 {
                    strip = 0;
                    continue;
                }
                let next = checked_index(vertex, vertex_count).map_err(|text| wrong(source, element, index, text))?;
                let [a, b] = last;
                // Strips are stitched with triangles that repeat a vertex.
                if strip >= 2 && a != b && b != next && next != a {
                    triangles.push(if strip.is_multiple_of(2) { [a, b, next] } else { [b, a, next] });
                }
                last = [b, next];
                strip += 1;
            }
        }
        source.end().map_err(|fault| at(fault, None, source))?;
    }
    Ok(())
}

/// Checks and skips an element nobody wants.
pub(super) fn skip<S: Source>(source: &mut S, element: &Element, encoding: Encoding) -> Parsed<()> {
    if element.count == 0 {
        return Ok(());
    }
    let count = claimed(element, element.smallest_size(encoding), encoding, source.window().left())?;
    for index in 0..count as u64 {
        let at = |fault: Fault, property, source: &S| fault.at(element, index, property, source);
        source.begin().map_err(|fault| at(fault, None, source))?;
        for (p, property) in element.properties.iter().enumerate() {
            source.skip_property(property).map_err(|fault| at(fault, Some(p), source))?;
        }
        source.end().map_err(|fault| at(fault, None, source))?;
    }
    Ok(())
}

/// The fault of the entry now being read.
#[cold]
fn wrong<S: Source>(source: &S, element: &Element, index: u64, problem: String) -> Box<Problem> {
    let place = place(element, index);
    if S::TEXT {
        return Problem::on_line_of(source.window().offset(source.window().at), format!("{place}: {problem}"));
    }
    Problem::new(place, problem)
}

/// The list of vertex indices of an element: its property and its types.
fn index_list(element: &Element) -> Parsed<(usize, ScalarType, ScalarType)> {
    let found = element.properties.iter().enumerate().find_map(|(p, property)| match property.kind {
        Kind::List { length, item }
            if matches!(property.name.as_str(), "vertex_indices" | "vertex_index") && item.whole_range().is_some() =>
        {
            Some((p, length, item))
        }
        _ => None,
    });
    found.ok_or_else(|| {
        let problem = "there is no list of whole numbers `vertex_indices` (or `vertex_index`)";
        Problem::new(format!("element {}", element.name), problem)
    })
}

#[inline(always)]
fn checked_index(vertex: i64, vertex_count: u64) -> Result<u32, String> {
    if vertex >= 0 && (vertex as u64) < vertex_count {
        Ok(vertex as u32)
    } else {
        Err(format!("vertex {vertex} does not exist: there are {vertex_count}, counted from 0"))
    }
}
