//! Columns of properties: positions, normals, colours and the named scalars of vertices and faces.

use glam::DVec3;

use super::header::{Element, Kind, ScalarType};
use super::problem::{Parsed, Problem};
use crate::import::colour::Count;
use base::error::Error;
use base::memory;
use mesh::{Attribute, texture};

/// A position in the precision it is kept in.
pub(super) trait Position: Copy {
    fn from_row(x: f64, y: f64, z: f64) -> Self;
    fn from_single(position: [f32; 3]) -> Self;
    fn to_single(self) -> [f32; 3];
}

impl Position for [f32; 3] {
    #[inline(always)]
    fn from_row(x: f64, y: f64, z: f64) -> Self {
        [x as f32, y as f32, z as f32]
    }

    #[inline(always)]
    fn from_single(position: [f32; 3]) -> Self {
        position
    }

    #[inline(always)]
    fn to_single(self) -> [f32; 3] {
        self
    }
}

impl Position for DVec3 {
    #[inline(always)]
    fn from_row(x: f64, y: f64, z: f64) -> Self {
        DVec3::new(x, y, z)
    }

    #[inline(always)]
    fn from_single([x, y, z]: [f32; 3]) -> Self {
        DVec3::new(x.into(), y.into(), z.into())
    }

    #[inline(always)]
    fn to_single(self) -> [f32; 3] {
        self.as_vec3().to_array()
    }
}

/// Values of one entry by slot. [`SKIP`] takes what nobody wants.
pub(super) type Row = [f64; SLOTS];

pub(super) const POSITION: usize = 0;
const NORMAL: usize = 3;
const COLOUR: usize = 6;
const FIRST_SCALAR: usize = 10;
pub(super) const SKIP: usize = FIRST_SCALAR + SCALARS.len();
const SLOTS: usize = SKIP + 1;

/// Entries of a [`Row`] before anything is read: opaque where a file has no alpha.
pub(super) const EMPTY_ROW: Row = [0.0; SLOTS];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Type {
    F32,
    I32,
    Bool,
}

/// Attribute, its type, and the property names that mean it, in lower case.
const SCALARS: [(&str, Type, &[&str]); 14] = [
    ("confidence", Type::F32, &["confidence"]),
    ("intensity", Type::F32, &["intensity", "scalar_intensity", "reflectance"]),
    ("quality", Type::F32, &["quality", "scalar_quality"]),
    ("error", Type::F32, &["error"]),
    ("noise", Type::F32, &["noise"]),
    ("range_row", Type::I32, &["range_row"]),
    ("range_col", Type::I32, &["range_col"]),
    ("source_scan", Type::I32, &["source_scan"]),
    ("interpolated", Type::Bool, &["interpolated"]),
    ("hole_fill", Type::Bool, &["hole_fill"]),
    (texture::S, Type::F32, &["s", "texture_u"]),
    (texture::T, Type::F32, &["t", "texture_v"]),
    ("source_vertex", Type::I32, &["source_vertex"]),
    ("chart", Type::I32, &["chart"]),
];

const VECTORS: [(&str, usize); 18] = [
    ("x", POSITION),
    ("y", POSITION + 1),
    ("z", POSITION + 2),
    ("nx", NORMAL),
    ("ny", NORMAL + 1),
    ("nz", NORMAL + 2),
    ("red", COLOUR),
    ("green", COLOUR + 1),
    ("blue", COLOUR + 2),
    ("alpha", COLOUR + 3),
    ("diffuse_red", COLOUR),
    ("diffuse_green", COLOUR + 1),
    ("diffuse_blue", COLOUR + 2),
    ("diffuse_alpha", COLOUR + 3),
    ("r", COLOUR),
    ("g", COLOUR + 1),
    ("b", COLOUR + 2),
    ("a", COLOUR + 3),
];

/// Targets of the properties of an element.
pub(super) struct Plan {
    /// The slot of each property. Lists go to [`SKIP`].
    pub(super) slots: Vec<usize>,
    types: [Option<ScalarType>; SLOTS],
}

impl Plan {
    pub(super) fn new(element: &Element) -> Parsed<Plan> {
        let mut plan = Plan { slots: Vec::with_capacity(element.properties.len()), types: [None; SLOTS] };
        for property in &element.properties {
            let slot = match property.kind {
                Kind::Scalar(scalar) => slot_of(&property.name).map(|slot| (slot, scalar)),
                Kind::List { .. } => None,
            };
            let Some((slot, scalar)) = slot else {
                plan.slots.push(SKIP);
                continue;
            };
            if plan.types[slot].replace(scalar).is_some() {
                let problem = format!("element {}: property `{}` is there twice", element.name, property.name);
                return Err(Problem::new("header", problem));
            }
            plan.slots.push(slot);
        }
        Ok(plan)
    }

    /// Whether x, y and z are there.
    pub(super) fn has_positions(&self) -> bool {
        self.has(POSITION..POSITION + 3)
    }

    /// Whether a coordinate has a type that single precision can't hold.
    pub(super) fn wide_positions(&self) -> bool {
        let wide = |t: &Option<ScalarType>| matches!(t, Some(ScalarType::F64 | ScalarType::I32 | ScalarType::U32));
        self.types[POSITION..POSITION + 3].iter().any(wide)
    }

    /// Whether an entry is a position in single precision, x, y, z in this order, and nothing else.
    pub(super) fn is_bare(&self) -> bool {
        self.slots == [POSITION, POSITION + 1, POSITION + 2]
            && self.types[POSITION..POSITION + 3].iter().all(|t| *t == Some(ScalarType::F32))
    }

    fn has(&self, slots: std::ops::Range<usize>) -> bool {
        self.types[slots].iter().all(Option::is_some)
    }
}

fn slot_of(name: &str) -> Option<usize> {
    if let Some((_, slot)) = VECTORS.iter().find(|(known, _)| *known == name) {
        return Some(*slot);
    }
    let known = |k: &&str| k.eq_ignore_ascii_case(name);
    SCALARS.iter().position(|(_, _, names)| names.iter().any(known)).map(|i| FIRST_SCALAR + i)
}

/// Attributes of the entries of an element, as they are read.
pub(super) struct Attributes {
    pub(super) normals: Option<Vec<[f32; 3]>>,
    pub(super) colour: Option<Vec<[u8; 4]>>,
    /// Factors that bring a colour's channels to 0 to 255.
    scale: [f64; 4],
    /// The number that channels of colours in floats count to. From `end` on they count to more.
    count: Count,
    end: f64,
    /// Place in the file of the property of each slot.
    order: [usize; SLOTS],
    floats: Vec<(usize, Vec<f32>)>,
    integers: Vec<(usize, Vec<i32>)>,
    flags: Vec<(usize, Vec<bool>)>,
}

impl Attributes {
    /// Room for `count` entries, which the caller has compared with the size of the file.
    pub(super) fn new(plan: &Plan, count: usize) -> Parsed<Attributes> {
        let mut scale = [1.0; 4];
        for channel in 0..4 {
            scale[channel] = match plan.types[COLOUR + channel] {
                Some(ScalarType::F32 | ScalarType::F64) => 255.0,
                Some(ScalarType::U16) => 1.0 / 257.0,
                _ => 1.0,
            };
        }
        let is_float = |channel: usize| matches!(plan.types[COLOUR + channel], Some(ScalarType::F32 | ScalarType::F64));
        let end = if (0..3).all(is_float) { Count::One.end() } else { f64::INFINITY };
        let mut order = [0; SLOTS];
        for (place, &slot) in plan.slots.iter().enumerate() {
            order[slot] = place;
        }
        let normals = plan.has(NORMAL..NORMAL + 3).then(|| reserve(count)).transpose()?;
        let colour = plan.has(COLOUR..COLOUR + 3).then(|| reserve(count)).transpose()?;
        let mut all = Attributes {
            normals,
            colour,
            scale,
            count: Count::One,
            end,
            order,
            floats: Vec::new(),
            integers: Vec::new(),
            flags: Vec::new(),
        };
        if plan.types[COLOUR + 3].is_none() {
            all.scale[3] = f64::NAN;
        }
        for (i, scalar) in SCALARS.iter().enumerate() {
            if plan.types[FIRST_SCALAR + i].is_some() {
                match scalar.1 {
                    Type::F32 => all.floats.push((i, reserve(count)?)),
                    Type::I32 => all.integers.push((i, reserve(count)?)),
                    Type::Bool => all.flags.push((i, reserve(count)?)),
                }
            }
        }
        Ok(all)
    }

    #[inline]
    pub(super) fn push(&mut self, row: &Row) {
        if let Some(normals) = &mut self.normals {
            normals.push([row[NORMAL] as f32, row[NORMAL + 1] as f32, row[NORMAL + 2] as f32]);
        }
        if self.colour.is_some() && row[COLOUR..COLOUR + 3].iter().any(|&channel| channel >= self.end) {
            self.count_further(row);
        }
        if let Some(colour) = &mut self.colour {
            // A cast from float to u8 stays within 0 to 255 and makes NaN 0.
            let mut channels: [u8; 4] = std::array::from_fn(|c| (row[COLOUR + c] * self.scale[c] + 0.5) as u8);
            if self.scale[3].is_nan() {
                channels[3] = 255;
            }
            colour.push(channels);
        }
        for (i, values) in &mut self.floats {
            values.push(row[FIRST_SCALAR + *i] as f32);
        }
        for (i, values) in &mut self.integers {
            values.push(row[FIRST_SCALAR + *i] as i32);
        }
        for (i, values) in &mut self.flags {
            values.push(row[FIRST_SCALAR + *i] != 0.0);
        }
    }

    /// Counts the channels of colours to more, so that those of this row can be.
    #[cold]
    fn count_further(&mut self, row: &Row) {
        let largest = row[COLOUR..COLOUR + 3].iter().copied().fold(0.0, f64::max);
        // Alpha of another type has a scale of its own, and none is opaque.
        let channels = if self.scale[3] == self.scale[0] { 4 } else { 3 };
        self.count = self.count.widened(largest, self.colour.as_deref_mut().unwrap_or_default(), channels);
        self.scale[..channels].fill(self.count.factor());
        self.end = self.count.end();
    }

    pub(super) fn is_empty(&self) -> bool {
        self.normals.is_none()
            && self.colour.is_none()
            && self.floats.is_empty()
            && self.integers.is_empty()
            && self.flags.is_empty()
    }

    /// Takes the values of a float attribute out.
    pub(super) fn take_float(&mut self, name: &str) -> Option<Vec<f32>> {
        let at = self.floats.iter().position(|(i, _)| SCALARS[*i].0 == name)?;
        Some(self.floats.swap_remove(at).1)
    }

    /// As attributes of a mesh in the order of the file, normals left out.
    pub(super) fn into_mesh_attributes(self) -> Vec<Attribute> {
        let mut named: Vec<(usize, Attribute)> = Vec::new();
        let order = self.order;
        let place = |i: usize| order[FIRST_SCALAR + i];
        named.extend(self.colour.map(|colour| (order[COLOUR], Attribute::colour("colour", colour))));
        named.extend(self.floats.into_iter().map(|(i, v)| (place(i), Attribute::f32(SCALARS[i].0, v))));
        named.extend(self.integers.into_iter().map(|(i, v)| (place(i), Attribute::i32(SCALARS[i].0, v))));
        named.extend(self.flags.into_iter().map(|(i, v)| (place(i), Attribute::bool(SCALARS[i].0, v))));
        named.sort_by_key(|(place, _)| *place);
        named.into_iter().map(|(_, attribute)| attribute).collect()
    }
}

/// An empty list with room for `count` entries.
pub(super) fn reserve<T>(count: usize) -> Parsed<Vec<T>> {
    memory::reserved(count, || format!("{count} entries of a PLY file")).map_err(|error| match error {
        Error::OutOfMemory(text) => Problem::memory(text),
        other => Problem::memory(other.to_string()),
    })
}
