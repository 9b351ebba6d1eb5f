//! `Mesh`: a triangle mesh that never changes. Its arrays are views.

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::TriMesh;
use surfrecon::export::{Holding, Provenance, WriteOptions, ending_for, tell_left_out, write_mesh};
use surfrecon::memory;
use surfrecon::mesh::{Attribute, AttributeData, measure};

use crate::arrays;
use crate::crs;
use crate::edit::Edit;
use crate::errors::{detached, guarded, input_error, to_python};
use crate::memory_folder::Place;
use crate::params::{no_others, params};
use crate::pickling::{self, Reduced, crs_part, reduced};
use crate::progress::Watch;
use crate::similarity::Given;

/// A triangle mesh with attributes. It never changes. Its arrays are read-only views without copying.
///
/// Triangles turn counter-clockwise seen from outside. Attribute names in use: ``colour`` (uint8 RGBA, sRGB),
/// ``confidence``, ``intensity``, ``error`` (world units), ``interpolated`` (vertices not on any scan), ``hole_fill``
/// (triangles), ``s`` and ``t`` (texture coordinates, to the right and upwards).
///
/// >>> mesh = surfrecon.Mesh([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)])
/// >>> mesh.positions[mesh.triangles].shape  # three corners a triangle
/// (2, 3, 3)
///
/// Args:
///     positions: (n, 3) real numbers.
///     triangles: (m, 3) integers, indices of vertices.
///     colour: (n, 3) or (n, 4), uint8 or floats of 0 to 1, sRGB.
///     confidence: (n,) real numbers >= 0.
///
/// Raises:
///     InputError: wrong shape, an index out of range, a coordinate that isn't finite.
///     TypeError: entries of another type.
#[pyclass(frozen, module = "surfrecon")]
pub struct Mesh {
    pub mesh: Arc<TriMesh>,
}

impl From<TriMesh> for Mesh {
    fn from(mesh: TriMesh) -> Self {
        Mesh { mesh: Arc::new(mesh) }
    }
}

impl Mesh {
    fn from_arrays(
        positions: &Bound<'_, PyAny>,
        triangles: &Bound<'_, PyAny>,
        colour: Option<&Bound<'_, PyAny>>,
        confidence: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let positions = {
            let (coordinates, _) = arrays::floats(positions, "positions", &[None, Some(3)])?;
            arrays::vectors(coordinates)
        };
        let py = triangles.py();
        py.check_signals()?;
        let (indices, _) = arrays::integers(triangles, "triangles", &[None, Some(3)])?;
        py.check_signals()?;
        let mut mesh = TriMesh::new(positions, corners(&indices)?);
        let vertices = Some(mesh.positions.len());
        if let Some(colour) = colour {
            mesh.vertex_attributes.push(Attribute::colour("colour", arrays::colours(colour, "colour", &[vertices])?));
        }
        if let Some(confidence) = confidence {
            let (confidence, _) = arrays::floats32(confidence, "confidence", &[vertices])?;
            if let Some(v) = confidence.iter().position(|c| !(*c >= 0.0 && c.is_finite())) {
                let value = confidence[v];
                return Err(input_error(format!("confidence of vertex {v} must be a finite number >= 0, got {value}")));
            }
            mesh.vertex_attributes.push(Attribute::f32("confidence", confidence));
        }
        mesh.validate().map_err(|e| to_python(&e))?;
        Ok(mesh.into())
    }

    fn selected(&self, py: Python<'_>, edit: &Edit, world_from_mesh: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let place = world_from_mesh.map(|place| arrays::affine(place, "world_from_mesh")).transpose()?;
        let place = place.unwrap_or(DAffine3::IDENTITY);
        Ok(Watch::new(None).run(py, |progress| edit.of_mesh(&self.mesh, place, progress))?.0.into())
    }

    /// The coordinates less `origin` times `scale` in single precision.
    fn rounded(&self, origin: DVec3, scale: f64) -> PyResult<Vec<f32>> {
        let bytes = size_of::<[f32; 3]>() as f64;
        memory::foresee(self.mesh.positions.len(), bytes, "rounding", "vertices").map_err(|e| to_python(&e))?;
        let near = |p: &DVec3| ((*p - origin) * scale).as_vec3().to_array();
        let near: Vec<[f32; 3]> = self.mesh.positions.iter().map(near).collect();
        if let Some(v) = near.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            let at = self.mesh.positions[v].to_array();
            return Err(input_error(format!(
                "vertex {v} at {at:?} is more than float32 can hold with the origin {:?} and the scale {scale:?}",
                origin.to_array()
            )));
        }
        Ok(near.into_flattened())
    }
}

#[pymethods]
impl Mesh {
    #[new]
    #[pyo3(signature = (positions, triangles, *, colour = None, confidence = None, **others),
        text_signature = "(positions, triangles, *, colour=None, confidence=None)")]
    fn new(
        positions: &Bound<'_, PyAny>,
        triangles: &Bound<'_, PyAny>,
        colour: Option<&Bound<'_, PyAny>>,
        confidence: Option<&Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Mesh", others)?;
        guarded(|| Self::from_arrays(positions, triangles, colour, confidence))
    }

    /// (n, 3) float64, a read-only view.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let count = self.mesh.positions.len();
        arrays::view(py, &self.mesh, |m| arrays::coordinates(&m.positions), (count, 3))
    }

    /// (m, 3) uint32, a read-only view. ``triangles.view("int32")`` is the same memory as signed integers.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let count = self.mesh.triangles.len();
        arrays::view(py, &self.mesh, |m| m.triangles.as_flattened(), (count, 3))
    }

    /// ``(position - origin) * scale`` as one flat float32 array (3 n,), newly made: what hosts' meshes take.
    ///
    /// >>> flat = mesh.positions_f32(origin=mesh.bounds[0], scale=0.001)
    /// >>> flat.dtype, flat.size == 3 * len(mesh.positions)
    /// (dtype('float32'), True)
    ///
    /// Raises:
    ///     InputError: a coordinate that float32 can't hold.
    #[pyo3(signature = (origin = [0.0; 3], scale = 1.0), text_signature = "($self, origin=(0.0, 0.0, 0.0), scale=1.0)")]
    fn positions_f32<'py>(
        &self,
        py: Python<'py>,
        origin: [f64; 3],
        scale: f64,
    ) -> PyResult<Bound<'py, numpy::PyArray1<f32>>> {
        guarded(|| self.rounded(DVec3::from_array(origin), scale)).map(|near| numpy::PyArray1::from_vec(py, near))
    }

    /// The coordinate reference system that the coordinates are in, as files name it: well-known text, or a code as ``EPSG:25832``.
    /// ``None`` where that is not known, and in a frame of one scan. Files say it where their format has a place for it.
    #[getter]
    fn crs(&self) -> Option<String> {
        crs::text_of(self.mesh.crs.as_ref())
    }

    /// The same mesh in a coordinate reference system: nothing is moved.
    ///
    /// Args:
    ///     crs: its text. ``None`` for none.
    ///
    /// Raises:
    ///     InputError: a text that names none.
    fn with_crs(&self, py: Python<'_>, crs: Option<crs::CrsText>) -> PyResult<Self> {
        let crs = crs::crs_of(crs)?;
        if crs == self.mesh.crs {
            return Ok(Mesh { mesh: self.mesh.clone() });
        }
        let mesh = detached(py, || Ok(TriMesh::clone(&self.mesh)))?;
        Ok(TriMesh { crs, ..mesh }.into())
    }

    /// Lowest and highest coordinates, (2, 3) float64. ``None`` without vertices.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> Option<Bound<'py, numpy::PyArray2<f64>>> {
        let (low, high) = measure::bounds(&self.mesh.positions)?;
        Some(numpy::PyArray2::from_array(py, &numpy::ndarray::arr2(&[low.to_array(), high.to_array()])))
    }

    /// Attributes of the vertices by name: read-only views, (n,) float32, int32 or bool, colours (n, 4) uint8.
    #[getter]
    fn vertex_attributes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        attributes(py, &self.mesh, |m| &m.vertex_attributes)
    }

    /// Attributes of the triangles by name, like ``vertex_attributes``.
    #[getter]
    fn face_attributes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        attributes(py, &self.mesh, |m| &m.face_attributes)
    }

    /// Checks independently whether this is what a surface must be, and what its topology is.
    ///
    /// >>> report = mesh.check()
    /// >>> report.is_closed, report.genus  # a ring
    /// (True, 1)
    ///
    /// Returns:
    ///     A ``CheckReport``: counts, ``is_manifold``, ``is_closed`` and ``genus``.
    fn check<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mesh = self.mesh.clone();
        let report = Watch::new(None).run(py, move |progress| surfrecon::mesh::try_check(&mesh, progress))?;
        crate::report::of(py, &report)
    }

    /// Writes the mesh: ``.ply`` (with all attributes), ``.glb`` (binary glTF, with the attributes of vertices), ``.obj`` (with
    /// colours), ``.stl`` (binary) or ``.3mf`` (with the unit and colours, for printing). Options that are ``None`` take their defaults.
    ///
    /// >>> mesh.write("part.ply", provenance={"part": "ring"})
    /// >>> mesh.write("part.glb", metres_per_unit=0.001, up="z")  # it is in millimetres, and z points up
    /// >>> mesh.write("part.3mf", metres_per_unit=0.001, up="z")  # the same, for a slicer
    ///
    /// Args:
    ///     path: its ending decides on the format.
    #[doc = include_str!("params/write.txt")]
    ///     provenance: what the file says of where it is from, what ``json.dumps`` takes with keys of its own: ``.ply`` and ``.obj``
    ///         have it as comments, ``.glb`` in ``asset.extras.surfrecon``, ``.stl`` and ``.3mf`` have no place for it. The first
    ///         three also say the mesh's ``crs``.
    ///     coarser: the same surface as meshes of fewer and fewer triangles, written into the ``.glb`` as its levels of detail
    ///         (``MSFT_lod``). Programs that don't know the extension show the finest.
    ///     progress: called with the stage's name and the share of the call that is done. ``False`` cancels.
    ///
    /// Raises:
    ///     ParameterError: an option out of its range.
    ///     InputError: another ending, ``coarser`` for another format or with more triangles than before, coordinates that don't fit single precision.
    ///     FileError: writing failed. No file is left, and one that was there is untouched.
    ///     Cancelled: the callback said so. Files are as after a failure.
    // options: $self write
    #[pyo3(signature = (path, *, provenance = None, coarser = Vec::new(), progress = None, **options), text_signature = "($self, path, *, metres_per_unit=1.0, up='y', encoding='binary', part_triangles=0, provenance=None, coarser=(), progress=None)")]
    fn write(
        &self,
        py: Python<'_>,
        path: Place,
        provenance: Option<&Bound<'_, PyAny>>,
        coarser: Vec<Bound<'_, Mesh>>,
        progress: Option<Py<PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        let provenance = provenance_of(provenance)?;
        let options = WriteOptions { provenance, ..params("Mesh.write", options)? };
        let mesh = self.mesh.clone();
        let coarser: Vec<_> = coarser.iter().map(|mesh| mesh.get().mesh.clone()).collect();
        Watch::new(progress).run(py, move |progress| {
            let coarser: Vec<_> = coarser.iter().map(AsRef::as_ref).collect();
            write_mesh(&path, &mesh, &coarser, &options, progress)?;
            tell_left_out(&path, Holding::Mesh, mesh.crs.as_ref());
            Ok(())
        })
    }

    /// The mesh with the vertices that a region holds, and the faces of which all three are: see ``surfrecon.keep``.
    ///
    /// >>> half = mesh.keep(surfrecon.Plane((0, 0, 0), (0, 0, 1)))
    /// >>> len(half.positions) < len(mesh.positions)
    /// True
    ///
    /// Args:
    ///     region: a ``Box``, a ``Plane`` or a mask, (n,) bool.
    ///     world_from_mesh: 4 x 4: where the mesh lies. Default: its coordinates are the world's.
    ///
    /// Raises:
    ///     InputError: a mask of another size.
    ///     TypeError: what is no region.
    #[pyo3(signature = (region, *, world_from_mesh = None, **others),
        text_signature = "($self, region, *, world_from_mesh=None)")]
    fn keep(
        &self,
        py: Python<'_>,
        region: &Bound<'_, PyAny>,
        world_from_mesh: Option<&Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Mesh.keep", others)?;
        self.selected(py, &Edit::select(region, true)?, world_from_mesh)
    }

    /// The mesh without the vertices that a region holds, and without the faces at them. Works as ``keep``.
    #[pyo3(signature = (region, *, world_from_mesh = None, **others),
        text_signature = "($self, region, *, world_from_mesh=None)")]
    fn remove(
        &self,
        py: Python<'_>,
        region: &Bound<'_, PyAny>,
        world_from_mesh: Option<&Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Mesh.remove", others)?;
        self.selected(py, &Edit::select(region, false)?, world_from_mesh)
    }

    /// The mesh with its vertices scaled, turned and shifted, and attributes that are lengths scaled. Then it is in no coordinate
    /// reference system: ``with_crs`` says where one was reached.
    ///
    /// Raises:
    ///     InputError: coordinates that become too large.
    fn transformed(&self, py: Python<'_>, similarity: Given) -> PyResult<Self> {
        let mesh = detached(py, || {
            let mut mesh = TriMesh::clone(&self.mesh);
            similarity.0.similarity.of_mesh(&mut mesh).map(|()| mesh)
        })?;
        Ok(mesh.into())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py>> {
        let mesh = &slf.get().mesh;
        let parts = pickling::attributes(slf, &["positions", "triangles", "vertex_attributes", "face_attributes"])?;
        parts.set_item("rounding_room", mesh.rounding_room)?;
        parts.set_item("crs", crs_part(mesh.crs.as_ref()))?;
        reduced("mesh", parts)
    }

    fn __copy__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: PyRef<'py, Self>, _memo: &Bound<'py, PyAny>) -> PyRef<'py, Self> {
        slf
    }

    fn __repr__(&self) -> String {
        let names = |attributes: &[Attribute]| attributes.iter().map(|a| a.name.clone()).collect::<Vec<_>>().join(", ");
        let mesh = &self.mesh;
        let mut text = format!("<Mesh {} vertices, {} triangles", mesh.positions.len(), mesh.triangles.len());
        if !mesh.vertex_attributes.is_empty() {
            text += &format!("; vertices: {}", names(&mesh.vertex_attributes));
        }
        if !mesh.face_attributes.is_empty() {
            text += &format!("; triangles: {}", names(&mesh.face_attributes));
        }
        text + ">"
    }
}

/// Colours as hosts' shaders take them: linear light in single precision.
///
/// >>> surfrecon.linear_colours(np.array([[255, 128, 0, 255]], np.uint8)).round(2)
/// array([1.  , 0.22, 0.  , 1.  ], dtype=float32)
///
/// Args:
///     colours: (n, 4) uint8, sRGB with alpha.
///
/// Returns:
///     (4 n,) float32, newly made: red, green and blue of 0 to 1 in linear light, alpha as its share of 255.
///
/// Raises:
///     InputError: another shape.
///     TypeError: entries of another type.
#[pyfunction]
pub fn linear_colours<'py>(colours: &Bound<'py, PyAny>) -> PyResult<Bound<'py, numpy::PyArray1<f32>>> {
    let share: [f32; 256] = std::array::from_fn(|byte| (byte as f64 / 255.0) as f32);
    // IEC 61966-2-1.
    let light: [f32; 256] = std::array::from_fn(|byte| {
        let x = byte as f64 / 255.0;
        (if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }) as f32
    });
    let linear = arrays::looked_up(colours, "colours", [&light, &light, &light, &share])?;
    Ok(numpy::PyArray1::from_vec(colours.py(), linear))
}

/// The provenance that a file is to have.
///
/// # Errors
/// `TypeError` for what JSON can't hold, `InputError` for what is no mapping.
pub fn provenance_of(given: Option<&Bound<'_, PyAny>>) -> PyResult<Option<Provenance>> {
    let Some(given) = given else { return Ok(None) };
    let text: String = given.py().import("json")?.call_method1("dumps", (given,))?.extract()?;
    Provenance::from_json(&text).map(Some).map_err(|e| to_python(&e))
}

/// The ending of the name of a file that is to hold this.
///
/// # Errors
/// `InputError` for an ending of formats that can't.
pub fn ending_of(path: &Path, holding: Holding) -> PyResult<&'static str> {
    ending_for(path, holding).map_err(|e| to_python(&e))
}

fn corners(indices: &[i64]) -> PyResult<Vec<[u32; 3]>> {
    let corner = |i: usize| {
        u32::try_from(indices[i]).map_err(|_| {
            input_error(format!("triangle {} names vertex {}, but numbers must be 0 to 2^32 - 1", i / 3, indices[i]))
        })
    };
    (0..indices.len() / 3).map(|t| Ok([corner(3 * t)?, corner(3 * t + 1)?, corner(3 * t + 2)?])).collect()
}

/// A dict of views of the attributes that `select` finds in a mesh of any kind.
pub fn attributes<'py, M: Send + Sync + 'static>(
    py: Python<'py>,
    mesh: &Arc<M>,
    select: for<'a> fn(&'a M) -> &'a Vec<Attribute>,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (i, attribute) in select(mesh).iter().enumerate() {
        let count = attribute.data.len();
        let array = match &attribute.data {
            AttributeData::F32(_) => arrays::view(py, mesh, |m| f32s(&select(m)[i].data), count)?,
            AttributeData::I32(_) => arrays::view(py, mesh, |m| i32s(&select(m)[i].data), count)?,
            AttributeData::Bool(_) => arrays::view(py, mesh, |m| flags(&select(m)[i].data), count)?,
            AttributeData::Colour(_) => arrays::view(py, mesh, |m| bytes(&select(m)[i].data), (count, 4))?,
        };
        dict.set_item(&attribute.name, array)?;
    }
    Ok(dict)
}

fn f32s(data: &AttributeData) -> &[f32] {
    if let AttributeData::F32(v) = data { v } else { &[] }
}

fn i32s(data: &AttributeData) -> &[i32] {
    if let AttributeData::I32(v) = data { v } else { &[] }
}

fn flags(data: &AttributeData) -> &[bool] {
    if let AttributeData::Bool(v) = data { v } else { &[] }
}

fn bytes(data: &AttributeData) -> &[u8] {
    if let AttributeData::Colour(v) = data { v.as_flattened() } else { &[] }
}
