//! OBJ with materials (MTL) and their images beside it.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use glam::DVec3;

use super::Provenance;
use super::atomic::{Staged, StagedSet, stage};
use super::images::{self, ImageFile, ImageOptions, Map};
use super::obj::{Besides, Polygons, elements, staged};
use super::tiles::{Tiled, by_tile};
use base::error::{Error, Result, known_as};
use base::progress::Progress;
use mesh::images::udim;
use mesh::{TileImages, TriMesh, normals, texture};

/// Maps that a material has a place for.
const MAPS: &[Map] = &[Map::Colour, Map::Normal, Map::Height, Map::Occlusion];

base::stages! {
    /// Stages with their shares of the time.
    PLAN:
    PACKING = "packing images", 0.9;
    WRITING = "writing", 0.1;
}

/// Writes a mesh with its images: `chair.obj`, `chair.mtl` and `chair_colour.png`. Other maps are `chair_normal.png`, `chair_height.png`
/// and `chair_occlusion.png`. Images of several tiles have their numbers as UDIM counts, as in `chair_colour.1001.png`. Images in JPEG end
/// in `.jpg`. Files of these names are replaced.
///
/// Each tile has a material. Normals are `norm`, in tangent space. Heights are `disp`, with their range in the unit of the mesh. Occlusion is
/// the map of the ambient light, `map_Ka`. The mask has no place. Neither have colours of vertices, as programs would multiply both.
/// Texture coordinates are written as they are, so that those of tile 1002 lie between 1 and 2: programs repeat images. Normals of
/// vertices are by angle and do not show seams.
///
/// # Errors
/// A mesh or images that are not valid. No texture coordinates, a triangle in no tile or in one without images. A name of the file that
/// materials can't name. [`Error::OutOfMemory`]. [`Error::Io`]. [`Error::Cancelled`]. The files get their names when all are written: then
/// nothing can fail but renaming.
pub fn write_textured_obj(
    path: &Path,
    mesh: &TriMesh,
    of: &TileImages,
    options: &ImageOptions,
    provenance: Option<&Provenance>,
    progress: &Progress<'_>,
) -> Result<()> {
    mesh.validate()?;
    let stem = stem(path)?;
    let tiles = by_tile(mesh, of, progress)?;
    let used: Vec<u32> = tiles.iter().map(|tiled| tiled.tile).collect();
    let unit = |n: &DVec3| if *n == DVec3::ZERO { DVec3::Z } else { *n };
    let of_vertices: Vec<DVec3> = normals::smooth(mesh, progress)?.iter().map(unit).collect();
    progress.plan(PLAN);
    progress.stage(PACKING, images::texels(of, &used, MAPS));
    let files = images::files(of, &used, MAPS, options, progress)?;
    let polygons = Polygons {
        positions: &mesh.positions,
        colour: None,
        quads: &[],
        triangles: &mesh.triangles,
        provenance,
        crs: mesh.crs.as_ref(),
    };
    progress.stage(WRITING, elements(&polygons));
    let mut written = StagedSet::default();
    let mut library = String::new();
    let mut materials = Vec::new();
    for Tiled { tile, triangles } in tiles {
        let number = if of.tiles.len() > 1 { Some(udim(tile)) } else { None };
        let name = material_name(stem, number);
        let _ = write!(library, "newmtl {name}\nKa 1 1 1\nKd 1 1 1\nKs 0 0 0\nillum 1\n");
        for file in files.iter().filter(|file| file.tile == tile) {
            let image = image_name(stem, number, file);
            let _ = writeln!(library, "{} {image}", statement(file.map, of.heights));
            written.add(stage_bytes(&path.with_file_name(image), &file.bytes, progress)?)?;
        }
        materials.push((name, triangles));
    }
    let library_name = format!("{stem}.mtl");
    written.add(stage_bytes(&path.with_file_name(&library_name), library.as_bytes(), progress)?)?;
    let besides = Besides {
        texture: texture::coordinates(mesh),
        normals: Some(&of_vertices),
        library: Some(&library_name),
        materials: &materials,
    };
    written.add(staged(path, &polygons, &besides, progress)?)?;
    written.keep()
}

/// The file's name without its ending, which the names of the others begin with.
fn stem(path: &Path) -> Result<&str> {
    match path.file_stem().map(|stem| stem.to_str()) {
        Some(Some(stem)) if !stem.contains(char::is_control) && stem.trim() == stem => Ok(stem),
        Some(_) => Err(Error::input(format!(
            "{}: materials can't name files that begin so: choose a name in UTF-8 without line breaks, and without blanks at its ends",
            known_as(path)
        ))),
        None => Err(Error::input(format!("{}: give the name of a file", known_as(path)))),
    }
}

/// Name of a material, without blanks: programs take them for its end.
fn material_name(stem: &str, number: Option<u32>) -> String {
    let name = stem.replace(char::is_whitespace, "_");
    match number {
        None => name,
        Some(number) => format!("{name}_{number}"),
    }
}

fn image_name(stem: &str, number: Option<u32>, file: &ImageFile) -> String {
    let (map, ending) = (file.map.name(), file.ending());
    match number {
        None => format!("{stem}_{map}.{ending}"),
        Some(number) => format!("{stem}_{map}.{number}.{ending}"),
    }
}

/// The statement that names an image.
fn statement(map: Map, heights: Option<[f64; 2]>) -> String {
    match map {
        Map::Colour => "map_Kd".to_owned(),
        Map::Normal => "norm".to_owned(),
        Map::Occlusion => "map_Ka".to_owned(),
        Map::Height => {
            let [low, high] = heights.unwrap_or([0.0, 1.0]);
            format!("disp -mm {low} {}", high - low)
        }
    }
}

fn stage_bytes(path: &Path, bytes: &[u8], progress: &Progress<'_>) -> Result<Staged> {
    stage(path, progress, |file| {
        for bytes in bytes.chunks(1 << 20) {
            file.write_all(bytes).map_err(|error| Error::io(path, error))?;
            progress.check()?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::PathBuf;

    use super::super::images::ImageFormat;
    use super::super::sheet;
    use super::*;
    use crate::import::{self, Content};

    const JPEG: ImageOptions = ImageOptions { image_format: ImageFormat::Jpeg, jpeg_quality: 90 };

    fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
        let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
        entries.map(|e| (e.file_name().into_string().unwrap(), std::fs::read(e.path()).unwrap())).collect()
    }

    #[test]
    fn materials_and_images_stand_beside_the_mesh() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("my chair.obj");
        let (mesh, images) = (sheet::mesh(), sheet::images());
        write_textured_obj(&path, &mesh, &images, &ImageOptions::default(), None, &Progress::none()).unwrap();
        let files = files(folder.path());
        let mut names = vec!["my chair.mtl".to_owned(), "my chair.obj".to_owned()];
        for map in ["colour", "height", "normal", "occlusion"] {
            names.extend([1001, 1003].map(|number| format!("my chair_{map}.{number}.png")));
        }
        assert_eq!(files.keys().cloned().collect::<Vec<_>>(), names);
        let library = String::from_utf8(files["my chair.mtl"].clone()).unwrap();
        let expected = "newmtl my_chair_1001\nKa 1 1 1\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd my chair_colour.1001.png\n\
                        norm my chair_normal.1001.png\ndisp -mm -0.5 2 my chair_height.1001.png\n\
                        map_Ka my chair_occlusion.1001.png\nnewmtl my_chair_1003\n";
        assert!(library.starts_with(expected), "{library}");
        let text = String::from_utf8(files["my chair.obj"].clone()).unwrap();
        assert!(text.starts_with("mtllib my chair.mtl\nv 0 0 0\n"), "{text}");
        let faces = "vn 0.00000 0.00000 1.00000\nusemtl my_chair_1001\nf 1/1/1 2/2/2 3/3/3\nf 1/1/1 3/3/3 4/4/4\n\
                     usemtl my_chair_1003\nf 5/5/5 6/6/6 7/7/7\nf 5/5/5 7/7/7 8/8/8\n";
        assert!(text.ends_with(faces), "{text}");
        for (number, tile) in [(1001, 0), (1003, 2)] {
            let tile = &images.tiles[tile];
            let colours = import::frames::colours_of(&files[&format!("my chair_colour.{number}.png")]).unwrap();
            assert_eq!(colours.1, tile.colour);
            let heights = files[&format!("my chair_height.{number}.png")].as_slice();
            let mut reader = png::Decoder::new(std::io::Cursor::new(heights)).read_info().unwrap();
            let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut bytes).unwrap();
            let read: Vec<u16> = bytes.as_chunks::<2>().0.iter().map(|b| u16::from_be_bytes(*b)).collect();
            assert_eq!(Some(read), tile.height);
        }
        let Content::Mesh(read) = import::open(&path).unwrap().scans[0].read().unwrap() else { panic!("no mesh") };
        assert_eq!((&read.positions, &read.triangles), (&mesh.positions, &mesh.triangles));
        assert_eq!(read.vertex_attributes, mesh.vertex_attributes[1..3]);
    }

    #[test]
    fn one_tile_has_no_number() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        let mut mesh = sheet::mesh();
        mesh.triangles.truncate(2);
        let mut images = sheet::images();
        images.tiles.truncate(1);
        images.tiles[0].normal = None;
        write_textured_obj(&path, &mesh, &images, &JPEG, None, &Progress::none()).unwrap();
        let files = files(folder.path());
        let names: Vec<&str> = files.keys().map(String::as_str).collect();
        assert_eq!(names, ["a.mtl", "a.obj", "a_colour.jpg", "a_height.png", "a_occlusion.png"]);
        assert!(String::from_utf8_lossy(&files["a.mtl"]).starts_with("newmtl a\n"));
    }

    fn told(path: PathBuf, images: &TileImages) -> String {
        let form = ImageOptions::default();
        write_textured_obj(&path, &sheet::mesh(), images, &form, None, &Progress::none()).unwrap_err().to_string()
    }

    #[test]
    fn faults_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let mut images = sheet::images();
        assert!(told(at("line\nbreak.obj"), &images).contains("choose a name in UTF-8 without line breaks"));
        assert!(told(at("none/a.obj"), &images).contains("make it first"));
        images.tiles[2].colour.clear();
        assert!(told(at("a.obj"), &images).contains("the map colour of tile 2 has 0 texels"));
        assert!(files(folder.path()).is_empty());
    }

    /// Root may write everywhere: then there is nothing to see.
    #[cfg(unix)]
    #[test]
    fn a_folder_that_can_not_be_written_to_is_named() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let readable = |mode| std::fs::set_permissions(folder.path(), std::fs::Permissions::from_mode(mode)).unwrap();
        readable(0o500);
        if std::fs::write(folder.path().join("probe"), "").is_ok() {
            readable(0o700);
            println!("SKIPPED: this user may write to read-only folders");
            return;
        }
        let text = told(folder.path().join("a.obj"), &sheet::images());
        readable(0o700);
        assert!(text.contains("a_colour.1001.png") && text.contains("ermission"), "{text}");
        assert!(files(folder.path()).is_empty());
    }
}
