//! Meshes that are handed over piece by piece: what is larger than memory is never in one place.

use std::ops::Range;

use base::error::{Error, Result};
use base::memory::expect;
use base::progress::Progress;
use glam::DVec3;

use crate::{Attribute, AttributeData, Crs, Extent, TriMesh};

/// Vertices that a mesh in memory has numbers for.
const MOST_VERTICES: u64 = 1 << 32;

/// Rows of a mesh in memory that are handed over at once.
const PIECE: usize = 1 << 14;

/// Outline of a mesh that is handed over.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshOutline {
    /// Vertices.
    pub vertices: u64,
    /// Triangles.
    pub triangles: u64,
    /// Extent of all its vertices.
    pub extent: Extent,
    /// Attributes of the vertices, without entries.
    pub vertex_attributes: Vec<Attribute>,
    /// Attributes of the triangles, without entries.
    pub face_attributes: Vec<Attribute>,
    /// The system of the world, where it is known.
    pub crs: Option<Crs>,
}

/// Takes a mesh piece by piece, in any order, each piece once.
pub trait MeshSink: Send {
    /// Told first what there will be.
    ///
    /// # Errors
    /// It can't take that much.
    fn begin(&mut self, outline: &MeshOutline) -> Result<()>;

    /// Vertices from `first` on, in the world, with their attributes in the order of the outline.
    ///
    /// # Errors
    /// It can't take them.
    fn vertices(&mut self, first: u64, positions: &[DVec3], attributes: &[AttributeData]) -> Result<()>;

    /// Triangles from `first` on, of vertices of any piece.
    ///
    /// # Errors
    /// It can't take them.
    fn triangles(&mut self, first: u64, triangles: &[[u64; 3]], attributes: &[AttributeData]) -> Result<()>;

    /// A mesh as a whole, and nothing else: to begin is part of it.
    ///
    /// # Errors
    /// It can't take it, or it is cancelled.
    fn whole(&mut self, mesh: TriMesh, progress: &Progress<'_>) -> Result<()> {
        mesh.hand_over(self, progress)
    }
}

impl AttributeData {
    /// So many entries of the same kind: zeros.
    fn blank(&self, count: usize) -> Self {
        match self {
            AttributeData::F32(_) => AttributeData::F32(vec![0.0; count]),
            AttributeData::I32(_) => AttributeData::I32(vec![0; count]),
            AttributeData::Bool(_) => AttributeData::Bool(vec![false; count]),
            AttributeData::Colour(_) => AttributeData::Colour(vec![[0; 4]; count]),
        }
    }

    pub(crate) fn bytes_of_an_entry(&self) -> usize {
        match self {
            AttributeData::F32(_) => size_of::<f32>(),
            AttributeData::I32(_) => size_of::<i32>(),
            AttributeData::Bool(_) => size_of::<bool>(),
            AttributeData::Colour(_) => size_of::<[u8; 4]>(),
        }
    }

    /// Puts entries of the same kind in from `first` on.
    fn put(&mut self, first: usize, entries: &Self) {
        fn put<T: Copy>(all: &mut [T], first: usize, entries: &[T]) {
            all[first..first + entries.len()].copy_from_slice(entries);
        }
        match (self, entries) {
            (AttributeData::F32(all), AttributeData::F32(entries)) => put(all, first, entries),
            (AttributeData::I32(all), AttributeData::I32(entries)) => put(all, first, entries),
            (AttributeData::Bool(all), AttributeData::Bool(entries)) => put(all, first, entries),
            (AttributeData::Colour(all), AttributeData::Colour(entries)) => put(all, first, entries),
            _ => unreachable!("pieces have the attributes of the outline"),
        }
    }
}

impl TriMesh {
    /// Its outline, as it is told when it is handed over.
    pub fn outline(&self) -> MeshOutline {
        let blank = |list: &[Attribute]| {
            let blank = |of: &Attribute| Attribute { name: of.name.clone(), data: of.data.blank(0) };
            list.iter().map(blank).collect()
        };
        MeshOutline {
            vertices: self.positions.len() as u64,
            triangles: self.triangles.len() as u64,
            extent: Extent::of(&self.positions),
            vertex_attributes: blank(&self.vertex_attributes),
            face_attributes: blank(&self.face_attributes),
            crs: self.crs.clone(),
        }
    }
}

impl TriMesh {
    /// Hands itself over, in order, a few at a time.
    ///
    /// # Errors
    /// The sink's, or cancelled.
    pub fn hand_over<S: MeshSink + ?Sized>(&self, sink: &mut S, progress: &Progress<'_>) -> Result<()> {
        let some = |list: &[Attribute], range: &Range<usize>| -> Vec<AttributeData> {
            let places: Vec<usize> = range.clone().collect();
            list.iter().map(|of| of.data.gather(&places)).collect()
        };
        sink.begin(&self.outline())?;
        for range in pieces(self.positions.len()) {
            progress.advance(range.len() as u64)?;
            let attributes = some(&self.vertex_attributes, &range);
            sink.vertices(range.start as u64, &self.positions[range], &attributes)?;
        }
        for range in pieces(self.triangles.len()) {
            progress.advance(range.len() as u64)?;
            let attributes = some(&self.face_attributes, &range);
            let (first, corners) = (range.start as u64, self.triangles[range].iter().map(|t| t.map(u64::from)));
            sink.triangles(first, &corners.collect::<Vec<_>>(), &attributes)?;
        }
        Ok(())
    }
}

/// Ranges of at most [`PIECE`], all of a list.
fn pieces(count: usize) -> impl Iterator<Item = Range<usize>> {
    (0..count).step_by(PIECE).map(move |first| first..(first + PIECE).min(count))
}

/// A mesh in memory.
impl MeshSink for TriMesh {
    fn begin(&mut self, outline: &MeshOutline) -> Result<()> {
        let each = |list: &[Attribute]| list.iter().map(|of| of.data.bytes_of_an_entry()).sum::<usize>();
        let vertex = size_of::<DVec3>() + each(&outline.vertex_attributes);
        let triangle = size_of::<[u32; 3]>() + each(&outline.face_attributes);
        let bytes = vertex as f64 * outline.vertices as f64 + triangle as f64 * outline.triangles as f64;
        let what = || format!("a surface of {} triangles", outline.triangles);
        expect(bytes, what, "have it written into a file, make it coarser, or raise the limit")?;
        if outline.vertices > MOST_VERTICES {
            let text =
                format!("a surface of {} vertices is more than a mesh in memory has numbers for", outline.vertices);
            return Err(Error::OutOfMemory(text));
        }
        let blank = |list: &[Attribute], count: u64| {
            let blank = |of: &Attribute| Attribute { name: of.name.clone(), data: of.data.blank(count as usize) };
            list.iter().map(blank).collect()
        };
        self.positions = vec![DVec3::ZERO; outline.vertices as usize];
        self.triangles = vec![[0; 3]; outline.triangles as usize];
        self.vertex_attributes = blank(&outline.vertex_attributes, outline.vertices);
        self.face_attributes = blank(&outline.face_attributes, outline.triangles);
        self.crs.clone_from(&outline.crs);
        Ok(())
    }

    fn vertices(&mut self, first: u64, positions: &[DVec3], attributes: &[AttributeData]) -> Result<()> {
        let first = first as usize;
        self.positions[first..first + positions.len()].copy_from_slice(positions);
        self.vertex_attributes.iter_mut().zip(attributes).for_each(|(all, entries)| all.data.put(first, entries));
        Ok(())
    }

    fn triangles(&mut self, first: u64, triangles: &[[u64; 3]], attributes: &[AttributeData]) -> Result<()> {
        let first = first as usize;
        let places = &mut self.triangles[first..first + triangles.len()];
        places.iter_mut().zip(triangles).for_each(|(place, corners)| *place = corners.map(|v| v as u32));
        self.face_attributes.iter_mut().zip(attributes).for_each(|(all, entries)| all.data.put(first, entries));
        Ok(())
    }

    fn whole(&mut self, mesh: TriMesh, _: &Progress<'_>) -> Result<()> {
        *self = mesh;
        Ok(())
    }
}
