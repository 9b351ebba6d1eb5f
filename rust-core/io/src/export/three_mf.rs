//! 3MF, the 3D Manufacturing Format (core specification 1.3): triangles with their unit and colours, for slicers.
//!
//! A package is a zip archive of three parts in XML: the kinds of parts, which of them is the model, and the model. Colours are the materials
//! extension's group of colours, one for each corner of a triangle.

use std::io::{Error as IoError, Write};
use std::path::Path;

use flate2::Compression;
use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;

use super::archive::Archive;
use super::atomic::{Output, write_atomically};
use super::glb::{GlbOptions, origin};
use crate::unit::{self, MILLIMETRE};
use base::error::{Error, Result};
use base::memory;
use base::progress::Progress;
use mesh::{AttributeData, TriMesh};

/// Elements that are written between two looks at the progress.
const CHUNK: usize = 1 << 13;
/// More colours than this are rounded to five bits a channel, so that readers need no longer list.
const MOST_COLOURS: usize = 1 << 16;
/// Of the table of colours, and the place of each vertex's.
const BYTES_A_COLOUR: f64 = 24.0;
/// Numbers of vertices and triangles in the format are below 2^31.
const MOST: usize = i32::MAX as usize;
/// The transform that changes nothing.
const SAME: [f64; 12] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
/// Longest text of a coordinate: a sign, a point, and up to 45 zeros and 9 digits.
const LONGEST_NUMBER: u64 = 56;

const TYPES: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
    <Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">\
    <Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>\
    <Default Extension=\"model\" ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/></Types>\n";
const RELATIONS: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
    <Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">\
    <Relationship Target=\"/3D/3dmodel.model\" Id=\"model\" Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>\
    </Relationships>\n";

/// Writes a mesh as 3MF. `name` is the object's and the title. Vertices stay as they are, whatever axis of `options` is up: slicers print along z.
///
/// Positions have single precision, relative to an origin in the item's transform if they are far from zero. The unit is the format's where
/// it has one of that size, else millimetres, with a scale in the transform. `colour` is written as colours of the triangles' corners. More
/// than 65,536 of them are rounded to five bits a channel. Other attributes, the provenance and the coordinate reference system have no
/// place in the format. Triangles that name a vertex twice have no area and no place in the format either, and are left out.
///
/// The bytes depend on nothing else: no time, no number of threads.
///
/// # Errors
/// The mesh isn't valid ([`TriMesh::validate`]), has no triangles, more vertices or triangles than the format numbers, or a coordinate that
/// single precision can't hold. A unit that it can't hold either. [`Error::Io`]. [`Error::Cancelled`]. Then no file is left, and one that
/// was there is untouched.
pub fn write_3mf(path: &Path, name: &str, mesh: &TriMesh, options: &GlbOptions, progress: &Progress<'_>) -> Result<()> {
    mesh.validate()?;
    check_counts(mesh.positions.len(), mesh.triangles.len())?;
    let metres = options.metres_per_unit;
    unit::check(metres, "3MF")?;
    if mesh.triangles.iter().all(is_flat) {
        return Err(Error::input("a 3MF file holds triangles, but the mesh has none: write PLY"));
    }
    let origin = origin(&mesh.positions);
    let transform = transform(origin, options);
    let is_single = |number: f64| (number as f32).is_finite();
    if mesh.positions.iter().any(|&place| !(place - origin).as_vec3().is_finite())
        || !transform.into_iter().all(is_single)
    {
        return Err(Error::input("a coordinate is too large for single precision: use a larger unit"));
    }
    let colours = match mesh.vertex_attribute("colour") {
        Some(AttributeData::Colour(colours)) => Some(Colours::of(colours)?),
        _ => None,
    };
    progress.plan(&[("writing", 1.0)]);
    progress.stage(0, (mesh.positions.len() + mesh.triangles.len()) as u64);
    let model = Model { name, mesh, origin, unit: said(metres).0, transform, colours };
    write_atomically(path, progress, |file| {
        package(file, &model, progress).map_err(|problem| match problem {
            Problem::Ours(error) => error,
            Problem::File(error) => Error::io(path, error),
        })
    })
}

/// Refuses more vertices or triangles than the format numbers.
fn check_counts(vertices: usize, triangles: usize) -> Result<()> {
    if vertices <= MOST && triangles <= MOST {
        return Ok(());
    }
    Err(Error::input(format!(
        "a 3MF file holds at most {MOST} vertices and as many triangles, but the mesh has {vertices} and {triangles}: write PLY"
    )))
}

/// The mesh and what is said with it.
struct Model<'a> {
    name: &'a str,
    mesh: &'a TriMesh,
    /// Taken off all positions and put into the transform.
    origin: DVec3,
    unit: &'static str,
    /// The numbers that a row of coordinates is multiplied by from the left.
    transform: [f64; 12],
    colours: Option<Colours>,
}

/// The three parts.
fn package(file: &mut Output<'_>, model: &Model<'_>, progress: &Progress<'_>) -> std::result::Result<(), Problem> {
    let mut archive = Archive::new(file, Compression::default());
    for (name, text) in [("[Content_Types].xml", TYPES), ("_rels/.rels", RELATIONS)] {
        archive.add(name, text.len() as u64, |out| out.write_all(text.as_bytes()))?;
    }
    archive.add("3D/3dmodel.model", model.most_bytes(), |out| model.write(out, progress))?;
    Ok(archive.finish()?)
}

impl Model<'_> {
    /// The length that its text does not exceed.
    fn most_bytes(&self) -> u64 {
        let colours = self.colours.as_ref().map_or(0, |colours| colours.table.len());
        let digits = |count: usize| count.to_string().len() as u64;
        let line_of_vertex = 32 + 3 * LONGEST_NUMBER;
        let line_of_triangle = 64 + 3 * (digits(self.mesh.positions.len()) + digits(colours));
        // The name comes twice, and a character of it becomes up to six. Twelve numbers of the transform have up to 330 each.
        (8192 + 12 * self.name.len() + 32 * colours) as u64
            + line_of_vertex * self.mesh.positions.len() as u64
            + line_of_triangle * self.mesh.triangles.len() as u64
    }

    fn write(&self, out: &mut impl Write, progress: &Progress<'_>) -> std::result::Result<(), Problem> {
        let unit = self.unit;
        let name = escaped(self.name);
        let version = env!("CARGO_PKG_VERSION");
        write!(
            out,
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"{unit}\" xml:lang=\"en-US\" \
             xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" \
             xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\">\n\
             <metadata name=\"Title\">{name}</metadata>\n<metadata name=\"Application\">surfrecon {version}</metadata>\n<resources>\n"
        )?;
        let property = if let Some(Colours { table, .. }) = &self.colours {
            out.write_all(b"<m:colorgroup id=\"2\">\n")?;
            for [r, g, b, a] in table {
                match a {
                    255 => writeln!(out, "<m:color color=\"#{r:02X}{g:02X}{b:02X}\"/>")?,
                    _ => writeln!(out, "<m:color color=\"#{r:02X}{g:02X}{b:02X}{a:02X}\"/>")?,
                }
            }
            out.write_all(b"</m:colorgroup>\n")?;
            " pid=\"2\" pindex=\"0\""
        } else {
            ""
        };
        write!(out, "<object id=\"1\" name=\"{name}\" type=\"model\"{property}>\n<mesh>\n<vertices>\n")?;
        for places in self.mesh.positions.chunks(CHUNK) {
            for &place in places {
                let Vec3 { x, y, z } = (place - self.origin).as_vec3();
                writeln!(out, "<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>")?;
            }
            progress.advance(places.len() as u64)?;
        }
        out.write_all(b"</vertices>\n<triangles>\n")?;
        for triangles in self.mesh.triangles.chunks(CHUNK) {
            for corners @ [a, b, c] in triangles.iter().filter(|corners| !is_flat(corners)) {
                write!(out, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"")?;
                if let Some(colours) = &self.colours {
                    match corners.map(|v| colours.of_vertices[v as usize]) {
                        [p, q, r] if p == q && q == r => write!(out, " pid=\"2\" p1=\"{p}\"")?,
                        [p, q, r] => write!(out, " pid=\"2\" p1=\"{p}\" p2=\"{q}\" p3=\"{r}\"")?,
                    }
                }
                out.write_all(b"/>\n")?;
            }
            progress.advance(triangles.len() as u64)?;
        }
        out.write_all(b"</triangles>\n</mesh>\n</object>\n</resources>\n<build>\n<item objectid=\"1\"")?;
        if self.transform != SAME {
            let numbers = self.transform.map(|number| number.to_string());
            write!(out, " transform=\"{}\"", numbers.join(" "))?;
        }
        out.write_all(b"/>\n</build>\n</model>\n")?;
        Ok(())
    }
}

/// The transform that puts vertices relative to an origin in their place, in the format's unit.
fn transform(origin: DVec3, options: &GlbOptions) -> [f64; 12] {
    let scale = said(options.metres_per_unit).1;
    let mut numbers = [0.0; 12];
    for (numbers, row) in numbers.as_chunks_mut::<3>().0.iter_mut().zip([DVec3::X, DVec3::Y, DVec3::Z, origin]) {
        // + 0: no negative zero.
        *numbers = (row * scale + 0.0).to_array();
    }
    numbers
}

/// Whether a triangle names a vertex twice.
fn is_flat(&[a, b, c]: &[u32; 3]) -> bool {
    a == b || b == c || c == a
}

/// The format's unit, and the scale that makes it one of so many metres.
fn said(metres: f64) -> (&'static str, f64) {
    unit::named(metres).map_or((MILLIMETRE.name, metres / MILLIMETRE.metres), |unit| (unit.name, 1.0))
}

/// The different colours of a mesh.
struct Colours {
    table: Vec<[u8; 4]>,
    /// Of each vertex, the place of its colour in the table.
    of_vertices: Vec<u32>,
}

impl Colours {
    fn of(colours: &[[u8; 4]]) -> Result<Self> {
        memory::expect_each(colours.len(), BYTES_A_COLOUR, 0.0, "writing", "colours")?;
        let exact = Self::table(colours.iter().copied(), MOST_COLOURS);
        let rounded = || Self::table(colours.iter().map(|colour| colour.map(five_bits)), usize::MAX);
        Ok(exact.or_else(rounded).expect("any number is allowed"))
    }

    /// In the order of their first vertices. `None` if there are more than `most`.
    fn table(colours: impl Iterator<Item = [u8; 4]>, most: usize) -> Option<Self> {
        let (mut places, mut table, mut of_vertices) = (FxHashMap::default(), Vec::new(), Vec::new());
        for colour in colours {
            let place = *places.entry(colour).or_insert(table.len() as u32);
            if place as usize == table.len() {
                if table.len() == most {
                    return None;
                }
                table.push(colour);
            }
            of_vertices.push(place);
        }
        Some(Colours { table, of_vertices })
    }
}

/// The nearest of 32 values from 0 to 255.
fn five_bits(value: u8) -> u8 {
    let step = (u32::from(value) * 31 + 127) / 255;
    ((step * 255 + 15) / 31) as u8
}

/// Text as XML has it, without the characters that XML has no place for.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for character in text.chars().filter(|&character| character >= ' ' && !matches!(character, '\u{fffe}' | '\u{ffff}'))
    {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            other => out.push(other),
        }
    }
    out
}

/// Reasons why a package is not written.
enum Problem {
    Ours(Error),
    File(IoError),
}

impl From<Error> for Problem {
    fn from(error: Error) -> Self {
        Problem::Ours(error)
    }
}

impl From<IoError> for Problem {
    fn from(error: IoError) -> Self {
        Problem::File(error)
    }
}

#[cfg(test)]
pub(super) mod size_tests;
#[cfg(test)]
mod tests;
