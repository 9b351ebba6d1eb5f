//! Objects that the build places, as one mesh.

use glam::{DAffine3, DVec3};
use rustc_hash::{FxHashMap, FxHashSet};

use super::model::{self, Model, Object, Placed};
use super::part::Part;
use crate::import::archive::Archive;
use crate::import::file::reserve;
use crate::import::scan::FileScan;
use base::error::{Error, Result, known_as};
use base::memory;
use base::progress::Progress;
use mesh::{Attribute, TriMesh};

/// Deepest nesting of objects.
const DEEPEST: usize = 64;
/// Parts of one package, and objects that it places: objects in objects multiply.
const MOST_PARTS: usize = 10_000;
const MOST_PLACED: usize = 1 << 20;
/// Of the length of a part's text, which its vertices and triangles take: `<vertex x="1" y="2" z="3"/>` is the shortest.
const SHARE_OF_TEXT: f64 = 0.8;

/// The parts that objects lie in, by name.
struct Parts<'a> {
    scan: &'a FileScan,
    models: FxHashMap<String, Model>,
}

/// All that the model of that name builds.
///
/// # Errors
/// A part is missing or damaged, or an object that is placed. Nothing is built. More would be placed than `max_decoded_gib` allows. Cancelled.
pub(super) fn placed(archive: &Archive, root: &str, scan: &FileScan, progress: &Progress<'_>) -> Result<TriMesh> {
    let mut parts = Parts { scan, models: FxHashMap::default() };
    parts.read(archive, root, progress)?;
    let model = &parts.models[root];
    let scale = DAffine3::from_scale(DVec3::splat(model.metres));
    let mut leaves = Vec::new();
    if model.items.is_empty() {
        let inside: FxHashSet<u32> =
            model.objects.values().flat_map(|of| of.components.iter().map(|of| of.object)).collect();
        for &object in model.order.iter().filter(|object| !inside.contains(object)) {
            let alone = Placed { part: None, object, transform: DAffine3::IDENTITY };
            parts.gather(root, &alone, scale, 0, &mut leaves)?;
        }
    }
    for item in &model.items {
        parts.gather(root, item, scale, 0, &mut leaves)?;
    }
    joined(scan, &leaves, progress)
}

impl Parts<'_> {
    /// Reads a part, and those that it names.
    fn read(&mut self, archive: &Archive, root: &str, progress: &Progress<'_>) -> Result<()> {
        let mut next = vec![root.to_owned()];
        let (mut left, mut entries) = (self.scan.options.max_decoded_bytes(), 0);
        while let Some(name) = next.pop() {
            if self.models.contains_key(&name) {
                continue;
            }
            if self.models.len() == MOST_PARTS {
                return Err(Error::format(&self.scan.path, name, format!("more than {MOST_PARTS} parts")));
            }
            let length = archive.length(&name).unwrap_or(0);
            let model = archive.unpack(&name, left, progress, |from| {
                memory::expect(
                    SHARE_OF_TEXT * length as f64,
                    || format!("reading {}", known_as(&self.scan.path)),
                    "use a smaller mesh, or raise the limit",
                )?;
                progress.stage(0, length);
                model::read(Part::new(self.scan, &name, from), &mut entries, progress)
            })?;
            left = left.saturating_sub(length);
            let named = model.objects.values().flat_map(|object| &object.components).chain(&model.items);
            next.extend(named.filter_map(|placed| placed.part.clone()).collect::<FxHashSet<_>>());
            self.models.insert(name, model);
        }
        Ok(())
    }

    /// The meshes of a placed object, each in its place.
    fn gather<'m>(
        &'m self,
        here: &str,
        placed: &Placed,
        outer: DAffine3,
        depth: usize,
        leaves: &mut Vec<(&'m Object, DAffine3)>,
    ) -> Result<()> {
        let name = placed.part.as_deref().unwrap_or(here);
        let fail =
            |problem: String| Err(Error::format(&self.scan.path, format!("{name}, object {}", placed.object), problem));
        let Some(object) = self.models[name].objects.get(&placed.object) else {
            return fail("it is placed, but it is not there".to_owned());
        };
        if depth == DEEPEST {
            return fail(format!("objects contain each other more than {DEEPEST} deep"));
        }
        let transform = outer * placed.transform;
        if leaves.len() == MOST_PLACED {
            return fail(format!("more than {MOST_PLACED} objects are placed, which is the most"));
        }
        leaves.push((object, transform));
        object.components.iter().try_for_each(|inner| self.gather(name, inner, transform, depth + 1, leaves))
    }
}

/// One mesh of them all.
fn joined(scan: &FileScan, leaves: &[(&Object, DAffine3)], progress: &Progress<'_>) -> Result<TriMesh> {
    let vertices: u64 = leaves.iter().map(|(object, _)| object.positions.len() as u64).sum();
    let triangles: u64 = leaves.iter().map(|(object, _)| object.triangles.len() as u64).sum();
    let most = scan.options.max_decoded_bytes() / size_of::<DVec3>() as u64;
    let fail = |problem: String| Err(Error::format(&scan.path, "build", problem));
    if vertices > most || triangles > 2 * most || vertices > u64::from(u32::MAX) {
        return fail(format!(
            "{vertices} vertices of {triangles} triangles are placed, more than max_decoded_gib allows: raise it"
        ));
    }
    if triangles == 0 {
        return fail("there is no triangle: export a surface with it".to_owned());
    }
    let mut mesh = TriMesh::new(reserve(vertices as usize, &scan.path)?, reserve(triangles as usize, &scan.path)?);
    let has_colours = leaves.iter().any(|(object, _)| object.colours.is_some());
    let mut colours = reserve(if has_colours { vertices as usize } else { 0 }, &scan.path)?;
    for (object, transform) in leaves {
        progress.check()?;
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(object.positions.iter().map(|&place| transform.transform_point3(place)));
        // A mirrored object shows its inner side otherwise.
        let is_mirrored = transform.matrix3.determinant() < 0.0;
        mesh.triangles.extend(object.triangles.iter().map(|&[a, b, c]| {
            let [b, c] = if is_mirrored { [c, b] } else { [b, c] };
            [a, b, c].map(|v| first + v)
        }));
        if has_colours {
            match &object.colours {
                Some(of_vertices) => {
                    colours.extend_from_slice(of_vertices);
                    colours.resize(mesh.positions.len(), [255; 4]);
                }
                None => colours.resize(mesh.positions.len(), [255; 4]),
            }
        }
    }
    if let Some(far) = mesh.positions.iter().position(|place| !place.is_finite()) {
        return fail(format!(
            "vertex {far} is placed beyond the largest number: scale the model down where it is from"
        ));
    }
    if has_colours {
        mesh.vertex_attributes.push(Attribute::colour("colour", colours));
    }
    Ok(mesh)
}
