//! The elements of a file, read in its order.

use super::body::{self, GridPoints, Vertices};
use super::columns::{Attributes, Plan, Position, reserve};
use super::header::{Element, Header};
use super::problem::{Parsed, Problem};
use super::source::Source;
use crate::import::polygons::Polygons;

/// The element `vertex` and where its properties go.
pub(super) fn vertex_plan(header: &Header) -> Parsed<(&Element, Plan)> {
    let element = header.element("vertex").ok_or_else(|| Problem::new("header", "there is no element `vertex`"))?;
    let plan = Plan::new(element)?;
    if !plan.has_positions() {
        return Err(Problem::new("header", "element vertex needs the properties x, y and z"));
    }
    Ok((element, plan))
}

/// The cells of a range grid.
pub(super) enum Cells {
    /// Of each the vertex, or [`NO_VERTEX`](super::source::NO_VERTEX).
    Vertices(Vec<u32>),
    /// Of each the point, or NaN: where vertices have nothing else, this saves a list of the grid's size.
    Points(Vec<[f32; 3]>),
}

/// Content of the elements of a file.
pub(super) struct Parts<P> {
    pub(super) vertices: Vertices<P>,
    pub(super) grid: Cells,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) polygons: Polygons,
    pub(super) face_attributes: Option<Attributes>,
}

pub(super) fn elements<S: Source, P: Position>(
    source: &mut S,
    header: &Header,
    vertex_element: &Element,
    plan: &Plan,
    cols: u64,
) -> Parsed<Parts<P>> {
    let (encoding, vertex_count) = (header.encoding, vertex_element.count);
    let has_grid = header.element("range_grid").is_some();
    let mut vertices = None;
    let (mut grid, mut triangles, mut face_attributes) = (Cells::Vertices(Vec::new()), Vec::new(), None);
    let (mut strips, mut polygons) = (Vec::new(), Polygons::default());
    for element in header.elements.iter().filter(|e| e.count > 0) {
        match element.name.as_str() {
            "vertex" => vertices = Some(body::vertices(source, element, plan, encoding)?),
            "range_grid" => {
                let count = body::claimed_cells(source, element, encoding)?;
                grid = match &vertices {
                    Some(Vertices { positions, attributes }) if attributes.is_empty() && !plan.wide_positions() => {
                        let mut all = GridPoints { positions, points: reserve(count)? };
                        body::range_grid(source, element, count, cols, vertex_count, &mut all)?;
                        Cells::Points(all.points)
                    }
                    _ => {
                        let mut all: Vec<u32> = reserve(count)?;
                        body::range_grid(source, element, count, cols, vertex_count, &mut all)?;
                        Cells::Vertices(all)
                    }
                };
            }
            "face" if !has_grid => {
                let faces = body::faces(source, element, &Plan::new(element)?, encoding, vertex_count)?;
                (triangles, polygons, face_attributes) = (faces.triangles, faces.polygons, Some(faces.attributes));
            }
            "tristrips" if !has_grid => body::strips(source, element, encoding, vertex_count, &mut strips)?,
            _ => body::skip(source, element, encoding)?,
        }
    }
    if !source.at_end() {
        let left = source.window().left();
        let problem = format!("{left} bytes follow the last element: the counts of the header don't match the file");
        return Err(Problem::new("after the last element", problem));
    }
    if !strips.is_empty() {
        triangles.append(&mut strips);
        face_attributes = None;
    }
    let vertices = match vertices {
        Some(vertices) => vertices,
        None => Vertices { positions: Vec::new(), attributes: Attributes::new(plan, 0)? },
    };
    Ok(Parts { vertices, grid, triangles, polygons, face_attributes })
}
