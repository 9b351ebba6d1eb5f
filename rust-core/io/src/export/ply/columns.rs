//! Elements of a file and their columns, as its header declares them.

use glam::DVec3;

use super::super::provenance::comments;
use super::options::{PlyEncoding, PlyOptions, PositionType};
use super::rows::{Column, Data, Element};
use base::error::{Error, Result};
use mesh::{Attribute, AttributeData, Crs, Extent};

/// Coordinates farther from the origin than this many times their extent are written in double precision: single
/// precision would keep less than 2^-20 of the extent.
const FAR: f64 = 8.0;

pub(super) fn element(name: &'static str, count: usize) -> Element<'static> {
    Element { name, count, columns: Vec::new(), blank_at_end: false }
}

pub(super) fn floats(names: &[&str]) -> String {
    names.iter().map(|name| format!("property float {name}\n")).collect()
}

pub(super) fn channels(prefix: &str) -> String {
    ["red", "green", "blue", "alpha"].iter().map(|name| format!("property uchar {prefix}{name}\n")).collect()
}

/// The column of coordinates. They are known to be finite.
pub(super) fn positions(positions: &[DVec3], kind: PositionType) -> Result<Column<'_>> {
    Ok(position_column(positions, is_double(&Extent::of(positions), kind)?))
}

/// Whether coordinates that lie there are written in double precision.
pub(super) fn is_double(extent: &Extent, kind: PositionType) -> Result<bool> {
    let largest = extent.largest();
    let fits = largest <= f64::from(f32::MAX);
    let near = largest <= FAR * extent.side() || extent.single;
    let double = match kind {
        PositionType::Auto => !fits || !near,
        PositionType::Float => false,
        PositionType::Double => true,
    };
    if !double && !fits {
        return Err(Error::input(format!(
            "a coordinate of {largest:e} is too large for single precision: write doubles"
        )));
    }
    Ok(double)
}

pub(super) fn position_column(positions: &[DVec3], double: bool) -> Column<'_> {
    if double {
        let declaration = ["x", "y", "z"].iter().map(|name| format!("property double {name}\n")).collect();
        return Column { declaration, data: Data::Double(positions) };
    }
    Column { declaration: floats(&["x", "y", "z"]), data: Data::Single(positions) }
}

/// The element of triangles, without attributes.
pub(super) fn faces(triangles: &[[u32; 3]], count: usize) -> Element<'_> {
    let mut faces = element("face", count);
    let declaration = "property list uchar int vertex_indices\n".to_owned();
    faces.columns.push(Column { declaration, data: Data::Triangle(triangles) });
    faces
}

pub(super) fn attributes<'a>(element: &mut Element<'a>, attributes: &'a [Attribute]) -> Result<()> {
    for attribute in attributes {
        let name = &attribute.name;
        if name.is_empty() || name.chars().any(|c| c.is_whitespace() || c.is_control()) {
            return Err(Error::input(format!("attribute {name:?}: a PLY file needs a name without blanks")));
        }
        let declaration = match &attribute.data {
            AttributeData::F32(_) => floats(&[name]),
            AttributeData::I32(_) => format!("property int {name}\n"),
            AttributeData::Bool(_) => format!("property uchar {name}\n"),
            AttributeData::Colour(_) if name == "colour" => channels(""),
            AttributeData::Colour(_) => channels(&format!("{name}_")),
        };
        // A property's name is the last word of its line.
        let taken = |line: &str| {
            let name = line.rsplit(' ').next();
            element.columns.iter().flat_map(|c| c.declaration.lines()).any(|other| other.rsplit(' ').next() == name)
        };
        if declaration.lines().any(taken) {
            return Err(Error::input(format!("attribute {name}: the name is taken, so rename it")));
        }
        element.columns.push(Column { declaration, data: column_data(&attribute.data) });
    }
    Ok(())
}

pub(super) fn column_data(entries: &AttributeData) -> Data<'_> {
    match entries {
        AttributeData::F32(values) => Data::F32(values),
        AttributeData::I32(values) => Data::I32(values),
        AttributeData::Bool(values) => Data::Bool(values),
        AttributeData::Colour(values) => Data::Colour(values),
    }
}

pub(super) fn header(info: &str, elements: &[Element<'_>], options: &PlyOptions, crs: Option<&Crs>) -> Result<String> {
    if let Some(element) = elements.iter().find(|e| e.count > i32::MAX as usize) {
        return Err(Error::input(format!(
            "{} entries of {} are more than a PLY file holds",
            element.count, element.name
        )));
    }
    let encoding = match options.encoding {
        PlyEncoding::Ascii => "ascii",
        PlyEncoding::BinaryLittleEndian => "binary_little_endian",
        PlyEncoding::BinaryBigEndian => "binary_big_endian",
    };
    let comments = comments("comment", options.provenance.as_ref(), crs)?;
    let mut header = format!("ply\nformat {encoding} 1.0\n{comments}{info}");
    for element in elements {
        element.declare(&mut header);
    }
    header += "end_header\n";
    Ok(header)
}
