//! A mesh in the format that its file's name asks for.

use std::path::Path;

use glam::DAffine3;

use super::{
    GlbNode, GlbOptions, Holding, ImageOptions, PlyEncoding, PlyOptions, PositionType, Provenance, Up, ending_for,
    write_3mf, write_glb, write_obj, write_ply, write_ply_in_pieces, write_stl, write_textured_obj,
};
use base::error::{Error, Result, known_as};
use base::params::{choice, count, ratio};
use base::progress::Progress;
use mesh::sink::MeshSink;
use mesh::{TileImages, TriMesh};

base::choices! {
    /// Form of the numbers in PLY files.
    pub enum Encoding {
        /// Coordinates in single precision unless they lie so far from the origin that they would lose detail.
        Binary = "binary" "Binary",
        /// Coordinates in double precision.
        BinaryDouble = "binary_double" "Binary, double precision",
        /// Coordinates with the fewest digits that read back as the same numbers.
        Ascii = "ascii" "Text",
    }
}

impl From<Encoding> for PlyOptions {
    fn from(encoding: Encoding) -> Self {
        let (encoding, positions) = match encoding {
            Encoding::Binary => (PlyEncoding::BinaryLittleEndian, PositionType::Auto),
            Encoding::BinaryDouble => (PlyEncoding::BinaryLittleEndian, PositionType::Double),
            Encoding::Ascii => (PlyEncoding::Ascii, PositionType::Auto),
        };
        PlyOptions { encoding, positions, ..PlyOptions::default() }
    }
}

base::params! {
    /// How a mesh is written.
    #[derive(Clone, Debug, PartialEq)]
    pub struct WriteOptions of "write" {
        /// Metres a unit of the mesh, for glTF, which is in metres, and 3MF, which says its unit: 0.001 for millimetres. STL files say it in
        /// their header, unless it is 1, and are then read in metres. Other formats keep the unit.
        metres_per_unit: f64 = ratio("Metres per unit").default(1.0).above(0.0),
        /// Axis of the mesh that points up, for glTF, where y does.
        up: Up = choice("Up", Up::CHOICES),
        /// Form of the numbers in PLY files. Other formats have one way.
        encoding: Encoding = choice("Encoding", Encoding::CHOICES),
        /// A PLY file gets no more triangles than this. Of a larger mesh it gets the first, and files beside it called name-2-of-3.ply and
        /// so on get the others. Each has the vertices that its triangles name, so that parts meet in vertices of the same coordinates.
        part_triangles: u32 = count("Triangles a file").at_most(2_147_483_647.0).off("one file").since("0.2"),
    }
    besides {
        /// Provenance that the file tells, if its format has a place for it.
        provenance: Option<Provenance>,
    }
}

impl WriteOptions {
    /// The part of it that holds for PLY files.
    fn ply(&self) -> PlyOptions {
        let (provenance, part_triangles) = (self.provenance.clone(), self.part_triangles);
        PlyOptions { provenance, part_triangles, ..self.encoding.into() }
    }
}

/// Checks, before the work that a mesh takes, that [`write_mesh`] knows the ending of a file's name and has what the options ask for.
/// Returns the ending. Looks at no file.
///
/// # Errors
/// [`Error::Parameter`]. [`Error::Input`] for another ending, and for an encoding that its format does not have.
pub fn check_mesh_file(path: &Path, options: &WriteOptions) -> Result<&'static str> {
    options.validate()?;
    let ending = ending_for(path, Holding::Mesh)?;
    if options.encoding != Encoding::Binary && ending != "ply" {
        let encoding = options.encoding.name();
        return Err(Error::input(format!("{}: only .ply has the encoding \"{encoding}\"", known_as(path))));
    }
    if options.part_triangles > 0 {
        if ending != "ply" {
            return Err(Error::input(format!(
                "{}: only .ply is written in parts: leave part_triangles",
                known_as(path)
            )));
        }
        if options.encoding == Encoding::Ascii {
            let path = known_as(path);
            return Err(Error::input(format!(
                "{path}: what is written in parts is binary, not text: leave one of both"
            )));
        }
    }
    Ok(ending)
}

/// Writes a mesh by the ending of the file's name: PLY with all attributes, binary glTF with those of vertices, OBJ and
/// 3MF with colours, STL. `coarser` are meshes of the same surface with fewer and fewer triangles, glTF's levels of detail.
///
/// # Errors
/// [`Error::Parameter`]. [`Error::Input`] for another ending, and for what the format has no place for. Those of the writer.
pub fn write_mesh(
    path: &Path,
    mesh: &TriMesh,
    coarser: &[&TriMesh],
    options: &WriteOptions,
    progress: &Progress<'_>,
) -> Result<()> {
    write_textured_mesh(path, mesh, coarser, None, options, progress)
}

/// As [`write_mesh`], with images that the mesh and the coarser ones show, and their form: packed into glTF
/// ([`GlbNode::images`]), beside an OBJ file ([`write_textured_obj`]).
///
/// # Errors
/// As [`write_mesh`]. [`Error::Input`] for images and an ending that holds none.
pub fn write_textured_mesh(
    path: &Path,
    mesh: &TriMesh,
    coarser: &[&TriMesh],
    images: Option<(&TileImages, &ImageOptions)>,
    options: &WriteOptions,
    progress: &Progress<'_>,
) -> Result<()> {
    let ending = check_mesh_file(path, options)?;
    if images.is_some() && !matches!(ending, "glb" | "obj") {
        return Err(Error::input(format!("{}: only .glb and .obj hold images: choose such a name", known_as(path))));
    }
    if !coarser.is_empty() && ending != "glb" {
        return Err(Error::input(format!("{}: only .glb holds coarser levels", known_as(path))));
    }
    match ending {
        "ply" => write_ply(path, mesh, options.ply(), progress),
        "glb" => {
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let (images, form) = images.unzip();
            let node = GlbNode { name: &name, mesh, world_from_mesh: DAffine3::IDENTITY, coarser, images };
            let WriteOptions { up, metres_per_unit, provenance, .. } = options.clone();
            let images = form.copied().unwrap_or_default();
            write_glb(path, &[node], &GlbOptions { up, metres_per_unit, provenance, images }, progress)
        }
        "3mf" => {
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let WriteOptions { up, metres_per_unit, .. } = *options;
            write_3mf(path, &name, mesh, &GlbOptions { up, metres_per_unit, ..GlbOptions::default() }, progress)
        }
        "obj" => match images {
            Some((images, form)) => write_textured_obj(path, mesh, images, form, options.provenance.as_ref(), progress),
            None => write_obj(path, mesh, options.provenance.as_ref(), progress),
        },
        "stl" => write_stl(path, mesh, options.metres_per_unit, progress),
        other => unreachable!("{other} holds no mesh"),
    }
}

/// Checks, before the work that a mesh takes, that [`write_mesh_in_pieces`] knows the ending of a file's name and has what the options ask
/// for. Looks at no file.
///
/// # Errors
/// As [`check_mesh_file`]. [`Error::Input`] for anything but binary PLY.
pub fn check_file_in_pieces(path: &Path, options: &WriteOptions) -> Result<()> {
    let shown = known_as(path);
    if !matches!(ending_for(path, Holding::Mesh), Ok("ply")) {
        return Err(Error::input(format!("{shown}: only .ply is written piece by piece: choose such a name")));
    }
    check_mesh_file(path, options)?;
    if options.encoding == Encoding::Ascii {
        let encoding = options.encoding.name();
        return Err(Error::input(format!(
            "{shown}: a file that is written piece by piece must be binary, got the encoding \"{encoding}\""
        )));
    }
    Ok(())
}

/// Writes a mesh that `make` hands over piece by piece, as [`write_ply_in_pieces`] does. Returns what `make` returns.
///
/// # Errors
/// As [`check_file_in_pieces`] and [`write_ply_in_pieces`].
pub fn write_mesh_in_pieces<R: Send>(
    path: &Path,
    options: &WriteOptions,
    make: impl FnOnce(&mut dyn MeshSink) -> Result<R> + Send,
    progress: &Progress<'_>,
) -> Result<R> {
    check_file_in_pieces(path, options)?;
    write_ply_in_pieces(path, options.ply(), make, progress)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::ImageFormat;
    use crate::export::sheet;

    #[test]
    fn the_ending_decides_where_images_go() {
        let folder = tempfile::tempdir().unwrap();
        let (mesh, images) = (sheet::mesh(), sheet::images());
        let form = ImageOptions { image_format: ImageFormat::Jpeg, ..ImageOptions::default() };
        let write = |name: &str| {
            let (path, options) = (folder.path().join(name), WriteOptions::default());
            write_textured_mesh(&path, &mesh, &[], Some((&images, &form)), &options, &Progress::none())
        };
        write("a.glb").unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        let bytes = std::fs::read(folder.path().join("a.glb")).unwrap();
        assert_eq!(memchr::memmem::find_iter(&bytes, "image/jpeg").count(), 2);
        write("a.obj").unwrap();
        assert!(folder.path().join("a_colour.1003.jpg").exists());
        let count = std::fs::read_dir(folder.path()).unwrap().count();
        let error = write("a.ply").unwrap_err().to_string();
        assert!(error.ends_with("only .glb and .obj hold images: choose such a name"), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), count);
    }
}
