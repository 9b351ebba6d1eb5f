//! Accessors of a glTF file: numbers in its buffers.

use std::borrow::Cow;

use glam::{DMat3, DMat4, DVec3};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index, Root};

use crate::import::file::reserve;
use crate::import::scan::FileScan;
use base::error::{Error, Result};

/// Data that accessors look into.
pub(super) struct Accessors<'a> {
    pub scan: &'a FileScan,
    pub root: &'a Root,
    pub buffers: Vec<Cow<'a, [u8]>>,
}

/// An accessor's elements.
pub(super) struct Elements<'a> {
    data: &'a [u8],
    stride: usize,
    pub count: usize,
    pub component: ComponentType,
    pub channels: usize,
}

impl Accessors<'_> {
    /// The error of a place in the file.
    pub fn fail<T>(&self, at: &str, problem: impl Into<String>) -> Result<T> {
        Err(Error::format(&self.scan.path, at, problem))
    }

    /// The elements of an accessor, all within their buffer.
    pub fn elements(&self, accessor: Index<Accessor>) -> Result<Elements<'_>> {
        let at = format!("accessor {}", accessor.value());
        let Some(accessor) = self.root.accessors.get(accessor.value()) else {
            return self.fail(&at, "there is no such accessor");
        };
        if accessor.sparse.is_some() {
            return self.fail(&at, "sparse accessors are not read: write the mesh without");
        }
        let component = match accessor.component_type {
            Checked::Valid(kind) if !matches!(kind.0, ComponentType::I8 | ComponentType::I16) => kind.0,
            _ => return self.fail(&at, "components must be floats, or whole numbers without a sign"),
        };
        let bytes = component.size();
        let channels = match accessor.type_ {
            Checked::Valid(Type::Scalar) => 1,
            Checked::Valid(Type::Vec2) => 2,
            Checked::Valid(Type::Vec3) => 3,
            Checked::Valid(Type::Vec4) => 4,
            _ => return self.fail(&at, "its type must be SCALAR, VEC2, VEC3 or VEC4"),
        };
        let size = bytes * channels;
        let Some(view) = accessor.buffer_view.and_then(|view| self.root.buffer_views.get(view.value())) else {
            return self.fail(&at, "it needs a buffer view");
        };
        let count = accessor.count.0;
        let stride = view.byte_stride.map_or(size, |stride| stride.0);
        let data = (|| {
            let whole = |number: u64| usize::try_from(number).ok();
            let offset = whole(accessor.byte_offset.unwrap_or_default().0)?;
            let last = whole(count)?.checked_sub(1);
            let length = last.map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size))?;
            let end = offset.checked_add(length).filter(|end| *end as u64 <= view.byte_length.0)?;
            let start = whole(view.byte_offset.unwrap_or_default().0)?;
            let buffer = self.buffers.get(view.buffer.value())?;
            buffer.get(start.checked_add(offset)?..start.checked_add(end)?)
        })();
        match data {
            // Elements in one place would make any number of them out of nothing.
            Some(data) if stride >= size => Ok(Elements { data, stride, count: count as usize, component, channels }),
            _ => self.fail(&at, format!("its {count} elements don't fit their buffer")),
        }
    }

    /// Corners of triangles.
    pub fn indices(&self, accessor: Index<Accessor>, at: &str) -> Result<Vec<u32>> {
        let elements = self.elements(accessor)?;
        if elements.component == ComponentType::F32 || elements.channels != 1 {
            return self.fail(at, "indices must be whole numbers");
        }
        let mut all = reserve(elements.count, &self.scan.path)?;
        all.extend((0..elements.count).map(|i| elements.value(i, 0) as u32));
        Ok(all)
    }

    /// Normals of the vertices of a node, in the world.
    pub fn normals(&self, accessor: Index<Accessor>, count: usize, world: DMat4, at: &str) -> Result<Vec<[f32; 3]>> {
        let elements = self.elements(accessor)?;
        if (elements.component, elements.channels, elements.count) != (ComponentType::F32, 3, count) {
            return self.fail(at, format!("normals must be three floats for each of {count} vertices"));
        }
        let turn = DMat3::from_mat4(world).inverse().transpose();
        let mut all = reserve(count, &self.scan.path)?;
        for i in 0..count {
            let [x, y, z] = [0, 1, 2].map(|k| elements.value(i, k));
            let normal = (turn * DVec3::new(x, y, z)).try_normalize().unwrap_or(DVec3::ZERO);
            all.push(normal.as_vec3().to_array());
        }
        Ok(all)
    }

    /// Texture coordinates of the vertices of a mesh, upwards. `None` if they are in a form that is not read: a surface needs none.
    pub fn texture(&self, accessor: Index<Accessor>, count: usize) -> Result<Option<Vec<[f32; 2]>>> {
        let Ok(elements) = self.elements(accessor) else { return Ok(None) };
        let one = match elements.component {
            ComponentType::U8 => 255.0,
            ComponentType::U16 => 65535.0,
            ComponentType::F32 => 1.0,
            _ => return Ok(None),
        };
        if (elements.channels, elements.count) != (2, count) {
            return Ok(None);
        }
        let mut all = reserve(count, &self.scan.path)?;
        // glTF counts from the top.
        all.extend((0..count).map(|i| {
            let [s, t] = [0, 1].map(|k| elements.value(i, k) / one);
            [s as f32, (1.0 - t) as f32]
        }));
        Ok(Some(all).filter(|all| all.as_flattened().iter().all(|x| x.is_finite())))
    }

    /// Linear colours of three or four channels, as sRGB.
    pub fn colours(&self, accessor: Index<Accessor>, count: usize, at: &str) -> Result<Vec<[u8; 4]>> {
        let elements = self.elements(accessor)?;
        if elements.channels < 3 || elements.component == ComponentType::U32 {
            return self.fail(at, "a colour must have three or four channels of bytes, 16 bits or floats");
        }
        if elements.count != count {
            return self
                .fail(at, format!("{} colours for {count} vertices, but one per vertex is needed", elements.count));
        }
        let one = match elements.component {
            ComponentType::U8 => 255.0,
            ComponentType::U16 => 65535.0,
            _ => 1.0,
        };
        let mut all = reserve(count, &self.scan.path)?;
        for i in 0..count {
            let mut colour = [255; 4];
            for (k, value) in colour.iter_mut().enumerate().take(elements.channels) {
                let linear = elements.value(i, k) / one;
                let shown = match linear {
                    _ if k == 3 => linear,
                    ..=0.003_130_8 => 12.92 * linear,
                    _ => 1.055 * linear.powf(1.0 / 2.4) - 0.055,
                };
                *value = (255.0 * shown).round() as u8;
            }
            all.push(colour);
        }
        Ok(all)
    }
}

impl Elements<'_> {
    /// One component of an element.
    #[inline(always)]
    pub fn value(&self, element: usize, channel: usize) -> f64 {
        let b = &self.data[element * self.stride..];
        match self.component {
            ComponentType::U8 => b[channel].into(),
            ComponentType::U16 => u16::from_le_bytes([b[2 * channel], b[2 * channel + 1]]).into(),
            kind => {
                let bits = [0, 1, 2, 3].map(|k| b[4 * channel + k]);
                if kind == ComponentType::U32 {
                    u32::from_le_bytes(bits).into()
                } else {
                    f32::from_le_bytes(bits).into()
                }
            }
        }
    }
}
