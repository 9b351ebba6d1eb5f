//! A node of the scene: a mesh in its place, cut into what is drawn at once.

use std::borrow::Cow;

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use rustc_hash::FxHashMap;

use super::primitive::{Primitive, custom, written_name};
use crate::export::tiles::{Tiled, by_tile, check_tangents};
use base::error::{Error, Result};
use base::progress::Progress;
use mesh::{AttributeData, TileImages, TriMesh, images, normals, tangents, texture};

/// Coordinates larger than this times the mesh's size get an origin of their own: single precision keeps 2^-24 of a
/// coordinate, which then is at most 2^-20 of the size.
const FAR: f64 = 8.0;
/// Integers up to this are kept by the single precision that they are written in.
const EXACT: i32 = 1 << 24;
/// Largest difference of a pose from a rigid one.
const RIGID: f64 = 1e-6;

/// A mesh in its place, for [`write_glb`](super::write_glb).
#[derive(Clone, Copy, Debug)]
pub struct GlbNode<'a> {
    /// Name of the node and of its mesh.
    pub name: &'a str,
    /// Written as points if it has no triangles, as an empty node if it has no vertices either.
    pub mesh: &'a TriMesh,
    /// Places the mesh in the world: a rotation and a translation.
    pub world_from_mesh: DAffine3,
    /// The same with fewer and fewer triangles, in the mesh's frame, for the extension `MSFT_lod`: viewers that know it
    /// show these when the object is small on the screen, others never. Empty for none.
    pub coarser: &'a [&'a TriMesh],
    /// Images that the mesh and the coarser ones show. Each of them has texture coordinates. The tangents are those of `mesh`.
    pub images: Option<&'a TileImages>,
}

/// Tangents of a triangle's corners.
type OfTriangle = [[f32; 4]; 3];

/// A node with what is worked out beforehand.
pub struct Part<'a> {
    pub node: &'a GlbNode<'a>,
    /// Number of the mesh among the node's: its own, then the coarser ones.
    pub level: usize,
    /// Number of its triangles.
    pub triangles: usize,
    pub rotation: DQuat,
    pub translation: DVec3,
    pub primitives: Vec<Primitive<'a>>,
}

impl<'a> Part<'a> {
    pub fn new(node: &'a GlbNode<'a>, mesh: &'a TriMesh, level: usize, progress: &Progress<'_>) -> Result<Self> {
        let name = match level {
            0 => node.name.to_owned(),
            level => format!("{}, its level {level}", node.name),
        };
        let named = |error| match error {
            Error::Input(problem) => Error::input(format!("{name}: {problem}")),
            other => other,
        };
        mesh.validate().map_err(named)?;
        let (m, t) = (node.world_from_mesh.matrix3, node.world_from_mesh.translation);
        if !(m * m.transpose()).abs_diff_eq(DMat3::IDENTITY, RIGID) || m.determinant() < 0.0 || !t.is_finite() {
            return Err(Error::input(format!("{name}: its pose must be a rotation and a translation")));
        }
        check_attributes(&name, mesh)?;
        let origin = origin(&mesh.positions);
        let whole = Primitive {
            bounds: bounds(mesh, origin).map_err(named)?,
            normals: written_normals(mesh, progress)?,
            mesh: Cow::Borrowed(mesh),
            origin,
            tangents: None,
            tile: None,
        };
        let primitives = match node.images {
            None => vec![whole],
            Some(images) => {
                let tiles = by_tile(mesh, images, progress).map_err(named)?;
                let tangents = tangents(&whole, level, images).map_err(named)?;
                cut(whole, &tiles, tangents.as_deref(), progress)?
            }
        };
        let rotation = DQuat::from_mat3(&m).normalize();
        let translation = node.world_from_mesh.transform_point3(origin);
        Ok(Part { node, level, triangles: mesh.triangles.len(), rotation, translation, primitives })
    }
}

/// Tangents of the corners, if there is a normal map: those of the images, which are of the finest level, or new ones.
fn tangents<'a>(whole: &Primitive<'_>, level: usize, images: &'a TileImages) -> Result<Option<Cow<'a, [OfTriangle]>>> {
    let mesh = &whole.mesh;
    let (true, Some([s, t])) = (images.tiles[0].normal.is_some(), texture::coordinates(mesh)) else { return Ok(None) };
    if let Some(given) = images.tangents.as_deref().filter(|_| level == 0) {
        check_tangents(mesh, images)?;
        return Ok(Some(Cow::Borrowed(given)));
    }
    let normals: Vec<DVec3> = whole.normals.iter().map(|n| Vec3::from(*n).as_dvec3()).collect();
    Ok(Some(Cow::Owned(tangents::of_corners(mesh, &normals, &|v| [s[v], t[v]]))))
}

/// Bounds of the positions as written.
fn bounds(mesh: &TriMesh, origin: DVec3) -> Result<[Vec3; 2]> {
    let start = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let bounds = mesh.positions.iter().fold(start, |[lo, hi], &p| {
        let p = (p - origin).as_vec3();
        [lo.min(p), hi.max(p)]
    });
    if !(mesh.positions.is_empty() || bounds[0].is_finite() && bounds[1].is_finite()) {
        return Err(Error::input("a coordinate is too large for single precision: use a larger unit"));
    }
    Ok(bounds)
}

/// A mesh cut by its tiles, with coordinates within each tile. Vertices are split where triangles differ in tile or tangent.
fn cut<'a>(
    whole: Primitive<'a>,
    tiles: &[Tiled],
    tangents: Option<&[OfTriangle]>,
    progress: &Progress<'_>,
) -> Result<Vec<Primitive<'a>>> {
    if let ([tiled], None) = (tiles, tangents)
        && tiled.tile == 0
    {
        return Ok(vec![Primitive { tile: Some(0), ..whole }]);
    }
    tiles.iter().map(|tiled| piece(&whole, tiled, tangents, progress)).collect()
}

/// The part of a mesh that lies in a tile.
fn piece<'a>(
    whole: &Primitive<'a>,
    tiled: &Tiled,
    tangents: Option<&[OfTriangle]>,
    progress: &Progress<'_>,
) -> Result<Primitive<'a>> {
    let mut places: FxHashMap<(u32, [u32; 4]), u32> = FxHashMap::default();
    let (mut vertices, mut of_vertices) = (Vec::new(), Vec::new());
    let mut triangles = Vec::with_capacity(tiled.triangles.len());
    for block in progress.blocks(&tiled.triangles) {
        for &t in block? {
            triangles.push(std::array::from_fn(|k| {
                let (vertex, tangent) = (whole.mesh.triangles[t][k], tangents.map(|all| all[t][k]).unwrap_or_default());
                *places.entry((vertex, tangent.map(f32::to_bits))).or_insert_with(|| {
                    vertices.push(vertex as usize);
                    of_vertices.push(tangent);
                    vertices.len() as u32 - 1
                })
            }));
        }
    }
    let positions = vertices.iter().map(|&v| whole.mesh.positions[v]).collect();
    let mut mesh = TriMesh::new(positions, triangles);
    let corner = images::corner(tiled.tile).as_vec2();
    for attribute in &whole.mesh.vertex_attributes {
        let mut of = attribute.gather(&vertices);
        if let (true, AttributeData::F32(along)) = (texture::has_name(&of.name), &mut of.data) {
            let offset = if of.name == texture::S { corner.x } else { corner.y };
            along.iter_mut().for_each(|x| *x -= offset);
        }
        mesh.vertex_attributes.push(of);
    }
    let normals: Vec<[f32; 3]> = vertices.iter().map(|&v| whole.normals[v]).collect();
    let of_vertices = of_vertices.iter().zip(&normals).map(|(tangent, normal)| unit_tangent(tangent, normal)).collect();
    Ok(Primitive {
        bounds: bounds(&mesh, whole.origin)?,
        tangents: tangents.is_some().then_some(of_vertices),
        normals,
        tile: Some(tiled.tile),
        origin: whole.origin,
        mesh: Cow::Owned(mesh),
    })
}

/// A tangent as glTF wants it: of length 1, with a sign. Across the normal where there is none.
fn unit_tangent(tangent: &[f32; 4], normal: &[f32; 3]) -> [f32; 4] {
    let [x, y, z, sign] = *tangent;
    let direction = Vec3::new(x, y, z).try_normalize().unwrap_or_else(|| Vec3::from(*normal).any_orthonormal_vector());
    direction.extend(if sign < 0.0 { -1.0 } else { 1.0 }).to_array()
}

/// The origin of the node's own coordinates: zero unless the mesh is far from it. Along an axis it is a number of single precision between
/// half and twice of all coordinates. Differences of such numbers are exact, so that taking it off never rounds further than single
/// precision does without it.
pub fn origin(positions: &[DVec3]) -> DVec3 {
    let Some((lo, hi)) = mesh::measure::bounds(positions) else { return DVec3::ZERO };
    let (size, far) = ((hi - lo).max_element(), lo.abs().max(hi.abs()).max_element());
    if far <= FAR * size {
        return DVec3::ZERO;
    }
    let along = |lo: f64, hi: f64| {
        let middle = f64::from(lo.midpoint(hi).round() as f32);
        let (least, most) = if middle > 0.0 { (lo, hi) } else { (-hi, -lo) };
        if least >= middle.abs() / 2.0 && most <= middle.abs() * 2.0 { middle } else { 0.0 }
    };
    DVec3::new(along(lo.x, hi.x), along(lo.y, hi.y), along(lo.z, hi.z))
}

/// Checks that attributes can be written, under names of their own.
fn check_attributes(name: &str, mesh: &TriMesh) -> Result<()> {
    let mut names: Vec<String> = Vec::new();
    for attribute in &mesh.vertex_attributes {
        check_values(name, &attribute.name, &attribute.data)?;
    }
    for attribute in custom(mesh) {
        let written = written_name(attribute);
        if names.contains(&written) {
            return Err(Error::input(format!("{name}: two attributes would be written as {written}: rename one")));
        }
        names.push(written);
    }
    Ok(())
}

fn check_values(node: &str, attribute: &str, data: &AttributeData) -> Result<()> {
    let bad = match data {
        AttributeData::F32(v) => v.iter().position(|x| !x.is_finite()).map(|i| (i, v[i].to_string())),
        AttributeData::I32(v) => {
            let place = v.iter().position(|x| !(-EXACT..=EXACT).contains(x));
            place.map(|i| (i, v[i].to_string()))
        }
        AttributeData::Bool(_) | AttributeData::Colour(_) => None,
    };
    match bad {
        None => Ok(()),
        Some((i, value)) => Err(Error::input(format!(
            "{node}: attribute {attribute} of vertex {i} is {value}, which a glb file can't hold: replace or remove it"
        ))),
    }
}

/// Normals of the vertices, of length 1. +z where the faces say nothing. Those of a mesh with texture coordinates do not show its seams.
fn written_normals(mesh: &TriMesh, progress: &Progress<'_>) -> Result<Vec<[f32; 3]>> {
    let unit = |n: &DVec3| n.try_normalize().filter(|n| n.is_finite()).unwrap_or(DVec3::Z).as_vec3().normalize();
    let of_vertices = match texture::coordinates(mesh) {
        _ if mesh.triangles.is_empty() => return Ok(Vec::new()),
        Some(_) => normals::smooth(mesh, progress)?,
        None => by_area(mesh),
    };
    Ok(of_vertices.iter().map(|n| unit(n).to_array()).collect())
}

/// Sums of the faces' normals by area.
fn by_area(mesh: &TriMesh) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(t);
        let normal = (b - a).cross(c - a);
        for &v in corners {
            sums[v as usize] += normal;
        }
    }
    sums
}
