//! The scene of a glTF file: its nodes, and the triangles or points of the meshes that they place.

use glam::{DMat4, DQuat, DVec3};
use gltf::json::accessor::ComponentType;
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::scene::Node;
use gltf::json::validation::Checked;
use gltf::json::{Index, Mesh};
use gltf::mesh::Semantic;
use serde_json::Value;

use super::container::Members;
use super::elements::Accessors;
use crate::import::file::reserve;
use crate::import::scan::Content;
use base::error::Result;
use base::memory;
use base::progress::Progress;
use mesh::point_cloud::PointCloud;
use mesh::{Attribute, TriMesh, texture};

/// Deepest tree of nodes.
const DEEPEST: usize = 256;

/// The transforms of all nodes, with all their digits.
pub(super) fn transforms(members: &Members) -> serde_json::Result<Vec<DMat4>> {
    let nodes: Vec<Value> = members.get("nodes").map_or(Ok(Vec::new()), |nodes| serde_json::from_str(nodes.get()))?;
    Ok(nodes.iter().map(transform).collect())
}

fn transform(node: &Value) -> DMat4 {
    match numbers::<16>(node, "matrix") {
        Some(matrix) => DMat4::from_cols_array(&matrix),
        None => DMat4::from_scale_rotation_translation(
            DVec3::from_array(numbers(node, "scale").unwrap_or([1.0; 3])),
            DQuat::from_array(numbers(node, "rotation").unwrap_or([0.0, 0.0, 0.0, 1.0])),
            DVec3::from_array(numbers(node, "translation").unwrap_or([0.0; 3])),
        ),
    }
}

/// So many numbers by their key.
fn numbers<const N: usize>(value: &Value, key: &str) -> Option<[f64; N]> {
    let list = value.get(key)?.as_array()?;
    let mut all = [0.0; N];
    if list.len() != N {
        return None;
    }
    for (number, entry) in all.iter_mut().zip(list) {
        *number = entry.as_f64()?;
    }
    Some(all)
}

/// Data that are read of a scene.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Wanted {
    Triangles,
    /// Of a scene that has no triangles.
    Points,
}

impl Wanted {
    fn has(self, primitive: &Primitive) -> bool {
        let is_surface = |mode| matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan);
        match primitive.mode {
            Checked::Valid(mode) => {
                (self == Wanted::Triangles && is_surface(mode)) || (self == Wanted::Points && mode == Mode::Points)
            }
            // Said when it is read.
            Checked::Invalid => true,
        }
    }
}

pub(super) struct Reader<'a, 'p> {
    accessors: Accessors<'a>,
    /// Of the nodes, in their parents.
    transforms: Vec<DMat4>,
    wanted: Wanted,
    /// Points are vertices without triangles.
    mesh: TriMesh,
    colours: Option<Vec<[u8; 4]>>,
    /// Of points, while all that were read have them.
    normals: Option<Vec<[f32; 3]>>,
    /// Texture coordinates of a surface, likewise.
    texture: Option<Vec<[f32; 2]>>,
    /// Nodes seen: each has one parent, whatever a damaged file says.
    visited: Vec<bool>,
    progress: &'a Progress<'p>,
}

/// Sum of the meshes of a file, each counted as often as nodes place it.
#[derive(Default)]
struct Amount {
    vertices: usize,
    corners: usize,
    /// Of the largest primitive.
    most: [usize; 2],
}

impl<'a, 'p> Reader<'a, 'p> {
    /// A reader of a scene that has placed nothing yet, with room for what the scene will.
    pub fn new(accessors: Accessors<'a>, transforms: Vec<DMat4>, progress: &'a Progress<'p>) -> Result<Self> {
        let visited = vec![false; accessors.root.nodes.len()];
        let mesh = TriMesh::default();
        let (wanted, colours, normals, texture) = (Wanted::Triangles, None, None, None);
        let mut reader = Reader { accessors, transforms, wanted, mesh, colours, normals, texture, visited, progress };
        reader.foresee()?;
        Ok(reader)
    }

    /// The nodes that nothing places: those of the scene. Without one, or if it names none, those that are no node's children.
    fn roots(&self) -> Vec<Index<Node>> {
        let root = self.accessors.root;
        let scene = root.scenes.get(root.scene.map_or(0, |scene| scene.value()));
        if let Some(scene) = scene.filter(|scene| !scene.nodes.is_empty()) {
            return scene.nodes.clone();
        }
        let mut is_child = vec![false; root.nodes.len()];
        for child in root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
            is_child.get_mut(child.value()).into_iter().for_each(|is_child| *is_child = true);
        }
        (0..root.nodes.len()).filter(|&node| !is_child[node]).map(|node| Index::new(node as u32)).collect()
    }

    /// All that the scene places. Without any node, all meshes.
    pub fn placed(mut self) -> Result<Content> {
        let root = self.accessors.root;
        if root.nodes.is_empty() {
            (0..root.meshes.len()).try_for_each(|index| self.mesh(Index::new(index as u32), DMat4::IDENTITY))?;
        }
        self.roots().into_iter().try_for_each(|node| self.node(node, DMat4::IDENTITY, 0))?;
        let has_any = match self.wanted {
            Wanted::Triangles => !self.mesh.triangles.is_empty(),
            Wanted::Points => !self.mesh.positions.is_empty(),
        };
        if !has_any {
            let problem =
                if root.meshes.is_empty() { "there is no mesh" } else { "there are no triangles and no points" };
            return self.accessors.fail("scene", format!("{problem}: export a surface or points with it"));
        }
        let Reader { mut mesh, colours, normals, texture, wanted, accessors, .. } = self;
        if wanted == Wanted::Points {
            return Ok(Content::Points(PointCloud {
                positions: mesh.positions,
                normals,
                colour: colours,
                world_from_cloud: accessors.scan.world_from_sensor,
                ..PointCloud::default()
            }));
        }
        mesh.vertex_attributes.extend(colours.map(|colours| Attribute::colour("colour", colours)));
        if let Some(all) = texture {
            let along = |axis: usize| all.iter().map(|at| at[axis]).collect();
            mesh.vertex_attributes.push(Attribute::f32(texture::S, along(0)));
            mesh.vertex_attributes.push(Attribute::f32(texture::T, along(1)));
        }
        Ok(Content::Mesh(mesh))
    }

    /// Of each mesh, how often nodes place it.
    fn times_placed(&self) -> Vec<usize> {
        let root = self.accessors.root;
        if root.nodes.is_empty() {
            return vec![1; root.meshes.len()];
        }
        let mut placed = vec![0_usize; root.meshes.len()];
        let mut next = self.roots();
        let mut seen = vec![false; root.nodes.len()];
        while let Some(index) = next.pop().map(|node| node.value()) {
            let Some(node) = root.nodes.get(index) else { continue };
            if std::mem::replace(&mut seen[index], true) {
                continue;
            }
            let count = node.mesh.and_then(|mesh| placed.get_mut(mesh.value()));
            count.into_iter().for_each(|count| *count += 1);
            next.extend(node.children.iter().flatten().copied());
        }
        placed
    }

    /// Decides what is read, makes room for what the nodes place, and refuses more than may be: what the file does not hold is said
    /// when it is read.
    fn foresee(&mut self) -> Result<()> {
        let placed = self.times_placed();
        let of_placed = || self.accessors.root.meshes.iter().zip(&placed).filter(|(_, times)| **times > 0);
        if !of_placed().any(|(mesh, _)| mesh.primitives.iter().any(|primitive| Wanted::Triangles.has(primitive))) {
            self.wanted = Wanted::Points;
        }
        let mut amount = Amount::default();
        for (mesh, &times) in of_placed() {
            for primitive in mesh.primitives.iter().filter(|primitive| self.wanted.has(primitive)) {
                let position = primitive.attributes.get(&Checked::Valid(Semantic::Positions)).copied();
                let count = |accessor| self.accessors.elements(accessor).map_or(0, |elements| elements.count);
                let vertices = position.map_or(0, count);
                let corners = match self.wanted {
                    Wanted::Triangles => primitive.indices.map_or(vertices, count),
                    Wanted::Points => 0,
                };
                amount.vertices = amount.vertices.saturating_add(vertices.saturating_mul(times));
                amount.corners = amount.corners.saturating_add(corners.saturating_mul(times));
                amount.most = [amount.most[0].max(vertices), amount.most[1].max(corners)];
            }
        }
        let limit = self.accessors.scan.options.max_decoded_bytes() / size_of::<DVec3>() as u64;
        if amount.vertices as u64 > limit || amount.corners as u64 > 6 * limit {
            let problem = format!(
                "{} vertices and {} corners of triangles are placed, more than max_decoded_gib allows: raise it",
                amount.vertices, amount.corners
            );
            return self.accessors.fail("scene", problem);
        }
        let while_reading = amount.most[0] * size_of::<DVec3>() + amount.most[1] * size_of::<u32>();
        memory::expect_each(
            amount.vertices,
            size_of::<DVec3>() as f64,
            (while_reading + amount.corners / 3 * size_of::<[u32; 3]>()) as f64,
            "reading",
            "vertices",
        )?;
        self.mesh.positions = reserve(amount.vertices, &self.accessors.scan.path)?;
        self.mesh.triangles = reserve(amount.corners / 3, &self.accessors.scan.path)?;
        Ok(())
    }

    fn node(&mut self, node: Index<Node>, world: DMat4, depth: usize) -> Result<()> {
        let index = node.value();
        let at = format!("node {index}");
        let Some(node) = self.accessors.root.nodes.get(index) else {
            return self.accessors.fail(&at, "there is no such node");
        };
        if depth > DEEPEST {
            return self.accessors.fail(&at, format!("the tree of nodes is more than {DEEPEST} deep"));
        }
        if std::mem::replace(&mut self.visited[index], true) {
            return self.accessors.fail(&at, "it must have one parent, but has two");
        }
        let world = world * self.transforms[index];
        if !world.is_finite() {
            return self.accessors.fail(&at, "its transform is not finite");
        }
        if let Some(mesh) = node.mesh {
            self.mesh(mesh, world)?;
        }
        for &child in node.children.iter().flatten() {
            self.node(child, world, depth + 1)?;
        }
        Ok(())
    }

    fn mesh(&mut self, mesh: Index<Mesh>, world: DMat4) -> Result<()> {
        let index = mesh.value();
        let Some(mesh) = self.accessors.root.meshes.get(index) else {
            return self.accessors.fail(&format!("mesh {index}"), "there is no such mesh");
        };
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            self.primitive(primitive, world, &format!("mesh {index}, primitive {k}"))?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, world: DMat4, at: &str) -> Result<()> {
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let Checked::Valid(mode) = primitive.mode else {
            return self.accessors.fail(at, "its mode is unknown: there are 0 to 6");
        };
        if !self.wanted.has(primitive) {
            return Ok(());
        }
        let Some(positions) = attribute(Semantic::Positions) else { return Ok(()) };
        self.progress.check()?;
        let positions = self.accessors.elements(positions)?;
        if (positions.component, positions.channels) != (ComponentType::F32, 3) {
            return self.accessors.fail(at, "positions must be three floats");
        }
        let (first, count) = (self.mesh.positions.len(), positions.count);
        let limit = self.accessors.scan.options.max_decoded_bytes();
        // Nodes may share a mesh: what they make of it together is checked as well.
        if (first as u64 + count as u64).saturating_mul(24) > limit || first + count > u32::MAX as usize {
            return self.accessors.fail(at, "the vertices are more than max_decoded_gib allows: raise it");
        }
        let mut points: Vec<DVec3> = reserve(count, &self.accessors.scan.path)?;
        for block in self.progress.ranges(count) {
            for i in block? {
                let [x, y, z] = [0, 1, 2].map(|k| positions.value(i, k));
                points.push(world.transform_point3(DVec3::new(x, y, z)));
            }
        }
        if let Some(i) = points.iter().position(|p| !p.is_finite()) {
            return self.accessors.fail(at, format!("vertex {i} has a coordinate that is not finite"));
        }
        let colours = attribute(Semantic::Colors(0)).map(|c| self.accessors.colours(c, count, at)).transpose()?;
        let corners: Vec<u32> = match primitive.indices {
            Some(indices) => self.accessors.indices(indices, at)?,
            None => (0..count as u32).collect(),
        };
        if let Some(bad) = corners.iter().find(|&&i| i as usize >= count) {
            return self.accessors.fail(at, format!("an index is {bad}, but there are only {count} vertices"));
        }
        if (self.mesh.triangles.len() as u64 + corners.len() as u64).saturating_mul(12) > limit {
            return self.accessors.fail(at, "the triangles are more than max_decoded_gib allows: raise it");
        }
        if colours.is_some() || self.colours.is_some() {
            let all = self.colours.get_or_insert_default();
            all.resize(first, [255; 4]);
            all.extend(colours.unwrap_or_default());
            all.resize(first + count, [255; 4]);
        }
        self.mesh.positions.extend(points);
        if self.wanted == Wanted::Points {
            let normals = attribute(Semantic::Normals);
            let normals = normals.map(|normals| self.accessors.normals(normals, count, world, at)).transpose()?;
            self.normals = joined(self.normals.take(), normals, first);
            return Ok(());
        }
        let coordinates = attribute(Semantic::TexCoords(0));
        let coordinates = coordinates.map(|accessor| self.accessors.texture(accessor, count)).transpose()?.flatten();
        self.texture = joined(self.texture.take(), coordinates, first);
        let mirrored = world.determinant() < 0.0;
        let mut add = |a: u32, b: u32, c: u32| {
            let triangle = if mirrored { [a, c, b] } else { [a, b, c] };
            self.mesh.triangles.push(triangle.map(|v| v + first as u32));
        };
        match mode {
            Mode::TriangleStrip => (2..corners.len()).for_each(|i| {
                let [a, b, c] = [corners[i - 2], corners[i - 1], corners[i]];
                let (a, b) = if i % 2 == 0 { (a, b) } else { (b, a) };
                // Strips turn corners by repeating vertices.
                if a != b && b != c && c != a {
                    add(a, b, c);
                }
            }),
            Mode::TriangleFan => (2..corners.len()).for_each(|i| add(corners[0], corners[i - 1], corners[i])),
            _ => corners.as_chunks::<3>().0.iter().for_each(|&[a, b, c]| add(a, b, c)),
        }
        Ok(())
    }
}

/// Those of the `first` vertices and of more behind them. Of some vertices alone they are left out.
fn joined<T>(all: Option<Vec<T>>, more: Option<Vec<T>>, first: usize) -> Option<Vec<T>> {
    match (all, more) {
        (Some(mut all), Some(more)) if all.len() == first => {
            all.extend(more);
            Some(all)
        }
        (None, Some(all)) if first == 0 => Some(all),
        _ => None,
    }
}
