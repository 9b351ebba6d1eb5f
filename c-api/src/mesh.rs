//! Meshes.

use std::ffi::{CString, c_char};

use surfrecon::TriMesh;
use surfrecon::error::meant;
use surfrecon::mesh::{Attribute, try_check, try_check_welded};
use surfrecon::reports::Report as _;

use crate::array::{self, Borrowed, srf_array};
use crate::guard::guard;
use crate::handle::{self, handle};
use crate::progress::{srf_progress, watched};
use crate::reports::check::srf_check_report;
use crate::status::{Failure, flag, srf_status, srf_status::*};
use crate::text::c_text;
use crate::{pointer, report, sized};

/// A mesh of the library with the names of its attributes as C wants them.
#[derive(Clone)]
pub struct Mesh {
    pub mesh: TriMesh,
    vertex_names: Vec<CString>,
    face_names: Vec<CString>,
}

impl From<TriMesh> for Mesh {
    fn from(mesh: TriMesh) -> Self {
        let names = |attributes: &[Attribute]| attributes.iter().map(|a| c_text(&a.name)).collect();
        Mesh { vertex_names: names(&mesh.vertex_attributes), face_names: names(&mesh.face_attributes), mesh }
    }
}

/// A triangle mesh with named attributes of its vertices and triangles. Triangles turn counter-clockwise seen from outside. Released with
/// srf_mesh_free().
#[allow(non_camel_case_types)]
pub struct srf_mesh {
    _opaque: [u8; 0],
}

handle!(srf_mesh, Mesh);

/// The owners of an attribute's entries.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_domain {
    /// One entry per vertex.
    SRF_DOMAIN_VERTICES = 1,
    /// One entry per triangle.
    SRF_DOMAIN_TRIANGLES = 2,
}

fn attributes_of(mesh: &Mesh, domain: u32) -> Result<(&[Attribute], &[CString]), Failure> {
    match domain {
        d if d == srf_domain::SRF_DOMAIN_VERTICES as u32 => Ok((&mesh.mesh.vertex_attributes, &mesh.vertex_names)),
        d if d == srf_domain::SRF_DOMAIN_TRIANGLES as u32 => Ok((&mesh.mesh.face_attributes, &mesh.face_names)),
        other => Err(unknown_domain(other)),
    }
}

fn unknown_domain(domain: u32) -> Failure {
    let text = format!("domain must be SRF_DOMAIN_VERTICES (1) or SRF_DOMAIN_TRIANGLES (2), got {domain}");
    Failure::new(SRF_ERR_PARAMETER, text)
}

/// Makes a mesh.
/// positions  3 SRF_TYPE_F64 or SRF_TYPE_F32 per vertex, finite, in any unit. Not NULL
/// triangles  3 SRF_TYPE_U32 or SRF_TYPE_I32 per triangle, each less than the number of vertices. NULL for a mesh of points alone
/// out_mesh   receives a new handle on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT naming the element, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_create(
    positions: *const srf_array,
    triangles: *const srf_array,
    out_mesh: *mut *mut srf_mesh,
) -> srf_status {
    guard(|| {
        pointer::writable("out_mesh", out_mesh)?;
        let positions = Borrowed::new("positions", positions, 3)?.points()?;
        let triangles = match Borrowed::optional("triangles", triangles, 3)? {
            Some(triangles) => triangles.triangles()?,
            None => Vec::new(),
        };
        let mesh = TriMesh::new(positions, triangles);
        mesh.validate()?;
        handle::give("out_mesh", out_mesh, mesh.into())
    })
}

/// Releases a mesh. Views of it are gone. A call that works with it on another thread goes on.
/// mesh       NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_free(mesh: *mut srf_mesh) -> srf_status {
    guard(|| handle::free("mesh", mesh))
}

/// A view of the coordinates: 3 SRF_TYPE_F64 per vertex.
/// mesh           not NULL
/// out_positions  receives the view on SRF_OK only. Not NULL
/// returns        SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_positions(mesh: *const srf_mesh, out_positions: *mut srf_array) -> srf_status {
    guard(|| pointer::write("out_positions", out_positions, array::points(&handle::get("mesh", mesh)?.mesh.positions)))
}

/// A view of the triangles: 3 SRF_TYPE_U32 per triangle.
/// mesh           not NULL
/// out_triangles  receives the view on SRF_OK only. Not NULL
/// returns        SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_triangles(mesh: *const srf_mesh, out_triangles: *mut srf_array) -> srf_status {
    guard(|| {
        pointer::write("out_triangles", out_triangles, array::triangles(&handle::get("mesh", mesh)?.mesh.triangles))
    })
}

/// Number of attributes.
/// mesh       not NULL
/// domain     a value of srf_domain
/// out_count  receives the number on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_attribute_count(
    mesh: *const srf_mesh,
    domain: u32,
    out_count: *mut usize,
) -> srf_status {
    guard(|| {
        let mesh = handle::get("mesh", mesh)?;
        pointer::write("out_count", out_count, attributes_of(&mesh, domain)?.0.len())
    })
}

/// Name of an attribute. Names in use: colour, confidence, intensity, error (in the mesh's unit), range_row, range_col,
/// source_scan, interpolated (vertices that lie on no scan), hole_fill (triangles), s and t (texture coordinates, to the right and upwards).
/// mesh       not NULL
/// domain     a value of srf_domain
/// index      less than srf_mesh_attribute_count()
/// out_name   receives a text that stays until the mesh is freed or changed, on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_attribute_name(
    mesh: *const srf_mesh,
    domain: u32,
    index: usize,
    out_name: *mut *const c_char,
) -> srf_status {
    guard(|| {
        let mesh = handle::get("mesh", mesh)?;
        let names = attributes_of(&mesh, domain)?.1;
        let name = names
            .get(index)
            .ok_or_else(|| Failure::new(SRF_ERR_PARAMETER, format!("index must be < {}, got {index}", names.len())))?;
        pointer::write("out_name", out_name, name.as_ptr())
    })
}

/// A view of an attribute: one SRF_TYPE_F32, SRF_TYPE_I32 or SRF_TYPE_U8 (a flag) or four SRF_TYPE_U8 (a colour, sRGB with straight alpha)
/// an entry.
/// mesh       not NULL
/// domain     a value of srf_domain
/// name       not NULL
/// out_data   receives the view on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_INPUT if there is none of that name, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_attribute(
    mesh: *const srf_mesh,
    domain: u32,
    name: *const c_char,
    out_data: *mut srf_array,
) -> srf_status {
    guard(|| {
        let mesh = handle::get("mesh", mesh)?;
        let (attributes, _) = attributes_of(&mesh, domain)?;
        let name = pointer::text("name", name)?;
        let found = attributes.iter().find(|a| a.name == name).ok_or_else(|| {
            let there: Vec<&str> = attributes.iter().map(|a| a.name.as_str()).collect();
            let meant = meant(name, there.iter().copied());
            let there = if there.is_empty() { "none".to_owned() } else { there.join(", ") };
            Failure::new(SRF_ERR_INPUT, format!("the mesh has no attribute {name} there: there are {there}{meant}"))
        })?;
        pointer::write("out_data", out_data, array::attribute(&found.data))
    })
}

/// Sets an attribute, in place of one of the same name if there is one. Views of the mesh are gone.
/// mesh       not NULL
/// domain     a value of srf_domain
/// name       not NULL, not empty
/// data       one entry per vertex or triangle of one of the types of srf_mesh_attribute(), copied. NULL removes the attribute
/// returns    SRF_OK, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_set_attribute(
    mesh: *mut srf_mesh,
    domain: u32,
    name: *const c_char,
    data: *const srf_array,
) -> srf_status {
    guard(|| {
        let name = pointer::text("name", name)?;
        if name.is_empty() {
            return Err(Failure::new(SRF_ERR_INPUT, "name must not be empty"));
        }
        let data = if data.is_null() { None } else { Some(Borrowed::attribute(data, "data")?) };
        handle::change("mesh", mesh.cast_const(), |mesh| {
            attributes_of(mesh, domain)?;
            let of_vertices = domain == srf_domain::SRF_DOMAIN_VERTICES as u32;
            let elements = if of_vertices { mesh.mesh.positions.len() } else { mesh.mesh.triangles.len() };
            if let Some(data) = data.as_ref().filter(|data| data.len() != elements) {
                let text = format!("data has {} entries for {elements} elements of the mesh", data.len());
                return Err(Failure::new(SRF_ERR_INPUT, text));
            }
            let all = if of_vertices { &mut mesh.mesh.vertex_attributes } else { &mut mesh.mesh.face_attributes };
            all.retain(|a| a.name != name);
            all.extend(data.map(|data| Attribute { name: name.to_owned(), data }));
            *mesh = std::mem::take(&mut mesh.mesh).into();
            Ok(())
        })
    })
}

/// Checks whether a mesh is what a surface must be, and finds its topology. Shares no code with what makes meshes.
/// mesh        not NULL
/// welded      0: vertices are the same if they have the same index. 1: also if they are at the same place in single precision
/// progress    NULL for none
/// out_report  initialized by srf_check_report_init(). Not NULL
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_OUT_OF_MEMORY, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE.
///             Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_check(
    mesh: *const srf_mesh,
    welded: u32,
    progress: *const srf_progress,
    out_report: *mut srf_check_report,
) -> srf_status {
    guard(|| {
        sized::writable("out_report", out_report)?;
        let mesh = handle::get("mesh", mesh)?;
        let check = if flag("welded", welded)? { try_check_welded } else { try_check };
        watched(progress, |progress| {
            let found = check(&mesh.mesh, progress)?;
            report::write("out_report", out_report, found.values())
        })
    })
}
