//! One part of a package that is a model: its unit, its objects, and what it builds.

use glam::{DAffine3, DMat3, DVec3};
use quick_xml::events::{BytesStart, Event};
use rustc_hash::FxHashMap;

use super::part::Part;
use crate::unit::{MILLIMETRE, UNITS};
use base::error::Result;
use base::progress::Progress;

/// Extensions that a file may ask for: what they say is read, or changes no triangle.
const KNOWN: [&str; 4] = [
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
    "http://schemas.microsoft.com/3dmanufacturing/production/2015/06",
    "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07",
    "http://schemas.microsoft.com/3dmanufacturing/core/2015/02",
];
/// Triangles and vertices between two looks at the progress.
const CHUNK: usize = 1 << 12;
/// Objects, placings and groups of colours of all parts.
const MOST_ENTRIES: usize = 1 << 20;

/// A part's content.
pub(super) struct Model {
    /// Metres in its unit.
    pub metres: f64,
    pub objects: FxHashMap<u32, Object>,
    /// The order of their numbers in the file.
    pub order: Vec<u32>,
    pub items: Vec<Placed>,
}

/// An object of another part or of the same, in its place.
pub(super) struct Placed {
    /// Name of the part. `None` for the same.
    pub part: Option<String>,
    pub object: u32,
    pub transform: DAffine3,
}

/// A mesh, or other objects put together.
#[derive(Default)]
pub(super) struct Object {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// Of the vertices, if any triangle has one.
    pub colours: Option<Vec<[u8; 4]>>,
    pub components: Vec<Placed>,
}

/// A colour of a vertex that no triangle gives one: as viewers show it.
const WHITE: [u8; 4] = [255; 4];

/// Reads a part. `entries` counts the objects, the placings and the groups of colours of all parts.
///
/// # Errors
/// The text is no XML, or no model. It needs an extension that is not read. A number, a vertex or an object is missing. There are more
/// entries than are read. Cancelled.
pub(super) fn read<'a>(part: Part<'a>, entries: &'a mut usize, progress: &Progress<'_>) -> Result<Model> {
    let (groups, coloured) = (FxHashMap::default(), Vec::new());
    let mut reading = Reading { part, entries, groups, group: None, open: None, coloured };
    let mut model =
        Model { metres: MILLIMETRE.metres, objects: FxHashMap::default(), order: Vec::new(), items: Vec::new() };
    let (mut is_model, mut elements, mut told) = (false, 0_usize, 0);
    let mut buffer = Vec::new();
    loop {
        elements += 1;
        if elements.is_multiple_of(CHUNK) {
            let at = reading.part.position();
            progress.advance(at - std::mem::replace(&mut told, at))?;
        }
        let event = reading.part.next(&mut buffer)?;
        let (tag, is_closed) = match &event {
            Event::Start(tag) => (tag, false),
            Event::Empty(tag) => (tag, true),
            Event::End(tag) => {
                match tag.local_name().into_inner() {
                    "object" => reading.close(&mut model)?,
                    "colorgroup" | "basematerials" => reading.group = None,
                    _ => {}
                }
                continue;
            }
            Event::Eof if is_model => {
                progress.advance(reading.part.position() - told)?;
                return Ok(model);
            }
            Event::Eof => return Err(reading.part.fail("there is no model in it")),
            _ => continue,
        };
        match tag.local_name().into_inner() {
            "model" => {
                is_model = true;
                model.metres = reading.unit(tag)?;
            }
            "colorgroup" | "basematerials" if !is_closed => {
                reading.count()?;
                let id = reading.id(tag, "id")?;
                reading.groups.insert(id, Vec::new());
                reading.group = Some(id);
            }
            "color" => reading.colour(tag, "color")?,
            "base" => reading.colour(tag, "displaycolor")?,
            "object" => {
                reading.count()?;
                reading.begin(tag)?;
                if is_closed {
                    reading.close(&mut model)?;
                }
            }
            "vertex" => reading.vertex(tag)?,
            "triangle" => reading.triangle(tag)?,
            "component" => {
                reading.count()?;
                let placed = reading.placed(tag)?;
                if let Some(open) = &mut reading.open {
                    open.object.components.push(placed);
                }
            }
            "item" => {
                reading.count()?;
                model.items.push(reading.placed(tag)?);
            }
            _ => {}
        }
    }
}

/// The part while it is read.
struct Reading<'a> {
    part: Part<'a>,
    /// Of all parts, the objects, placings and groups of colours.
    entries: &'a mut usize,
    /// Colours of groups and base materials.
    groups: FxHashMap<u32, Vec<[u8; 4]>>,
    /// The group whose colours come.
    group: Option<u32>,
    open: Option<Open>,
    /// Of the open object's vertices, whether a triangle has given it a colour.
    coloured: Vec<bool>,
}

/// The object that is read.
struct Open {
    id: u32,
    object: Object,
    /// The group and the place in it that triangles without have.
    property: Option<(u32, usize)>,
}

impl Reading<'_> {
    /// Counts an entry: each takes more memory than its text.
    fn count(&mut self) -> Result<()> {
        *self.entries += 1;
        if *self.entries <= MOST_ENTRIES {
            return Ok(());
        }
        Err(self.part.fail(format!("more than {MOST_ENTRIES} objects and materials, which is the most")))
    }

    /// Metres in the unit of the model, whose extensions are known.
    fn unit(&self, tag: &BytesStart<'_>) -> Result<f64> {
        for prefix in self.text(tag, "requiredextensions")?.unwrap_or_default().split_ascii_whitespace() {
            let namespace = self.text(tag, prefix)?.unwrap_or_else(|| prefix.to_owned());
            if !KNOWN.contains(&namespace.as_str()) {
                return Err(self.part.fail(format!("it needs {namespace}, which is not read")));
            }
        }
        let Some(unit) = self.text(tag, "unit")? else { return Ok(MILLIMETRE.metres) };
        let known = UNITS.iter().find(|of| of.name == unit);
        let names: Vec<&str> = UNITS.iter().map(|of| of.name).collect();
        let problem = || format!("unit must be one of {}, got \"{unit}\"", names.join(", "));
        known.map(|of| of.metres).ok_or_else(|| self.part.fail(problem()))
    }

    fn text(&self, tag: &BytesStart<'_>, name: &str) -> Result<Option<String>> {
        self.part.attribute(tag, name)
    }

    fn id(&self, tag: &BytesStart<'_>, name: &str) -> Result<u32> {
        let given = self.text(tag, name)?.unwrap_or_default();
        let problem = || format!("{name} must be a whole number, got \"{given}\"");
        given.trim().parse().map_err(|_| self.part.fail(problem()))
    }

    /// Adds a colour to the group that is open.
    fn colour(&mut self, tag: &BytesStart<'_>, name: &str) -> Result<()> {
        let Some(group) = self.group.and_then(|id| self.groups.get(&id).map(|_| id)) else { return Ok(()) };
        let given = self.text(tag, name)?.unwrap_or_default();
        let colour = hexadecimal(given.trim())
            .ok_or_else(|| self.part.fail(format!("a colour must be #RRGGBB or #RRGGBBAA, got \"{given}\"")))?;
        self.groups.entry(group).or_default().push(colour);
        Ok(())
    }

    /// Begins an object.
    fn begin(&mut self, tag: &BytesStart<'_>) -> Result<()> {
        let id = self.id(tag, "id")?;
        let property = match self.text(tag, "pid")? {
            Some(_) => Some((self.id(tag, "pid")?, self.id(tag, "pindex")? as usize)),
            None => None,
        };
        self.coloured.clear();
        self.open = Some(Open { id, object: Object::default(), property });
        Ok(())
    }

    /// Ends it.
    fn close(&mut self, model: &mut Model) -> Result<()> {
        if let Some(Open { id, object, .. }) = self.open.take() {
            if model.objects.insert(id, object).is_some() {
                return Err(self.part.fail(format!("object {id} is there twice: export the model again")));
            }
            model.order.push(id);
        }
        Ok(())
    }

    fn vertex(&mut self, tag: &BytesStart<'_>) -> Result<()> {
        let Some(open) = &mut self.open else { return Ok(()) };
        let mut position = [f64::NAN; 3];
        for attribute in tag.attributes().with_checks(false) {
            let attribute = attribute.map_err(|e| self.part.fail(e.to_string()))?;
            let axis = match attribute.key.local_name().into_inner() {
                "x" => 0,
                "y" => 1,
                "z" => 2,
                _ => continue,
            };
            position[axis] = attribute.value.trim().parse().unwrap_or(f64::NAN);
        }
        let positions = &mut open.object.positions;
        let position = DVec3::from_array(position);
        if !position.is_finite() {
            let problem = format!("vertex {} must have finite numbers x, y and z", positions.len());
            return Err(self.part.fail(problem));
        }
        positions.push(position);
        Ok(())
    }

    fn triangle(&mut self, tag: &BytesStart<'_>) -> Result<()> {
        let Some(open) = &mut self.open else { return Ok(()) };
        let object = &mut open.object;
        let (mut corners, mut group, mut places) = ([None; 3], None, [None; 3]);
        for attribute in tag.attributes().with_checks(false) {
            let attribute = attribute.map_err(|e| self.part.fail(e.to_string()))?;
            let number = || attribute.value.trim().parse::<u32>().ok();
            match attribute.key.local_name().into_inner() {
                "v1" => corners[0] = number(),
                "v2" => corners[1] = number(),
                "v3" => corners[2] = number(),
                "pid" => group = number(),
                "p1" => places[0] = number(),
                "p2" => places[1] = number(),
                "p3" => places[2] = number(),
                _ => {}
            }
        }
        let problem = |problem: &str| {
            let (number, count) = (object.triangles.len(), object.positions.len());
            self.part.fail(format!("triangle {number} {problem}: there are {count} vertices"))
        };
        let [Some(a), Some(b), Some(c)] = corners else { return Err(problem("must have whole numbers v1, v2 and v3")) };
        if let Some(far) = [a, b, c].into_iter().find(|&v| v as usize >= object.positions.len()) {
            return Err(problem(&format!("names vertex {far}")));
        }
        object.triangles.push([a, b, c]);
        // Without a place in the group, the object's property holds.
        let property = match (group, places[0]) {
            (group, Some(first)) => group.or(open.property.map(|of| of.0)).map(|group| (group, first as usize)),
            (_, None) => open.property,
        };
        let Some((group, first)) = property else { return Ok(()) };
        // Other properties than colours are passed over.
        let Some(colours) = self.groups.get(&group) else { return Ok(()) };
        let count = object.positions.len();
        let of_vertices = object.colours.get_or_insert_with(Vec::new);
        of_vertices.resize(count, WHITE);
        self.coloured.resize(count, false);
        for (corner, vertex) in [a, b, c].into_iter().enumerate() {
            let place = places[corner].map_or(first, |place| place as usize);
            let Some(&colour) = colours.get(place) else {
                let problem = format!("colour {place} of group {group} is not there: it has {}", colours.len());
                return Err(self.part.fail(problem));
            };
            if !std::mem::replace(&mut self.coloured[vertex as usize], true) {
                of_vertices[vertex as usize] = colour;
            }
        }
        Ok(())
    }

    fn placed(&self, tag: &BytesStart<'_>) -> Result<Placed> {
        let part = self.text(tag, "path")?.map(|path| path.trim_start_matches('/').to_owned());
        let transform = match self.text(tag, "transform")? {
            None => DAffine3::IDENTITY,
            Some(given) => affine(&given)
                .ok_or_else(|| self.part.fail(format!("a transform must be twelve finite numbers, got \"{given}\"")))?,
        };
        Ok(Placed { part, object: self.id(tag, "objectid")?, transform })
    }
}

/// A colour of six or eight digits, sRGB.
fn hexadecimal(text: &str) -> Option<[u8; 4]> {
    let digits = text.strip_prefix('#').filter(|digits| digits.bytes().all(|byte| byte.is_ascii_hexdigit()))?;
    let number = u32::from_str_radix(digits, 16).ok()?;
    match digits.len() {
        6 => Some((number << 8 | 0xff).to_be_bytes()),
        8 => Some(number.to_be_bytes()),
        _ => None,
    }
}

/// A transform, whose numbers multiply a row of coordinates from the right.
fn affine(text: &str) -> Option<DAffine3> {
    let numbers: Vec<f64> = text.split_ascii_whitespace().map(|number| number.parse().ok()).collect::<Option<_>>()?;
    let &[a, b, c, d, e, f, g, h, i, x, y, z] = numbers.as_slice() else { return None };
    let matrix3 = DMat3::from_cols_array(&[a, b, c, d, e, f, g, h, i]);
    let transform = DAffine3 { matrix3, translation: DVec3::new(x, y, z) };
    transform.is_finite().then_some(transform)
}
