//! Options of writing PLY files.

use super::super::Provenance;

/// Form of the numbers of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PlyEncoding {
    /// Binary, least significant byte first: smallest and fastest.
    #[default]
    BinaryLittleEndian,
    /// Binary, most significant byte first.
    BinaryBigEndian,
    /// Text: the fewest digits that read back as the same number.
    Ascii,
}

/// In which precision coordinates are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PositionType {
    /// Single precision, unless the coordinates lie so far from the origin that it would lose detail, or it would break
    /// what was certified of the mesh ([`mesh::TriMesh::rounding_room`]).
    #[default]
    Auto,
    /// Single precision.
    Float,
    /// Double precision.
    Double,
}

/// Options of writing a file. A [`PlyEncoding`] alone converts to it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PlyOptions {
    /// Form of the numbers.
    pub encoding: PlyEncoding,
    /// Precision of coordinates.
    pub positions: PositionType,
    /// Provenance that the file tells.
    pub provenance: Option<Provenance>,
    /// Of a mesh of more triangles files beside it ([`part_path`](super::part_path)) get the rest, none of them more. 0 for one file.
    pub part_triangles: u32,
}

impl From<PlyEncoding> for PlyOptions {
    fn from(encoding: PlyEncoding) -> Self {
        PlyOptions { encoding, ..PlyOptions::default() }
    }
}
