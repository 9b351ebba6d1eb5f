//! NumPy arrays <-> slices and vectors. All `unsafe` of this crate but the allocator's is here.
//!
//! Out: read-only arrays that borrow from a Rust object and keep it alive. In: anything `numpy.asarray` takes, copied
//! once, because the work runs without the interpreter lock.
#![allow(unsafe_code)]

use std::any::Any;
use std::sync::Arc;

use glam::{DAffine3, DMat4, DVec3};
use numpy::ndarray::{ArrayView, Dimension, IntoDimension};
use numpy::{Element, PyArray, PyArray2, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use surfrecon::memory::foresee;

use crate::errors::{input_error, to_python};

/// The owner of memory that a borrowing array keeps alive.
#[pyclass(frozen, module = "surfrecon._native")]
struct Owner {
    #[expect(dead_code, reason = "held only to be dropped with the last array")]
    held: Box<dyn Any + Send + Sync>,
}

/// A read-only array over a slice inside `owner`, without copying.
///
/// `owner`'s content must not have interior mutability in that slice. It isn't changed while the array lives because
/// `Arc::make_mut` copies as long as the array holds its share.
pub fn view<'py, O, T, D>(
    py: Python<'py>,
    owner: &Arc<O>,
    select: impl for<'a> FnOnce(&'a O) -> &'a [T],
    shape: D,
) -> PyResult<Bound<'py, PyAny>>
where
    O: Any + Send + Sync,
    T: Element,
    D: IntoDimension,
{
    let held = Owner { held: Box::new(owner.clone()) };
    let container = Bound::new(py, held)?.into_any();
    let slice = select(owner);
    let slice = ArrayView::from_shape(shape.into_dimension(), slice).expect("the shape covers the slice");
    // SAFETY: the slice lives inside the Arc's allocation or a vector of it, which `container` keeps alive and which
    // nobody changes (see above).
    let array = unsafe { PyArray::<T, D::Dim>::borrow_from_array(&slice, container) };
    Ok(read_only(array).into_any())
}

fn read_only<T: Element, D: Dimension>(array: Bound<'_, PyArray<T, D>>) -> Bound<'_, PyArray<T, D>> {
    let guard = array.readwrite();
    drop(guard.make_nonwriteable());
    array
}

/// The wanted length of one dimension: any, or a number.
pub type Extent = Option<usize>;

/// An array of floats of the wanted shape, copied row by row.
///
/// # Errors
/// `TypeError` for entries that aren't real numbers, `InputError` for another shape.
pub fn floats(value: &Bound<'_, PyAny>, what: &str, shape: &[Extent]) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let array = numbers(value, what, "fiu", shape)?;
    copy::<f64>(&array, "float64")
}

/// Like [`floats`], in single precision.
///
/// # Errors
/// Also `InputError` for a finite number that single precision can't hold.
pub fn floats32(value: &Bound<'_, PyAny>, what: &str, shape: &[Extent]) -> PyResult<(Vec<f32>, Vec<usize>)> {
    let array = numbers(value, what, "fiu", shape)?;
    let (rounded, extents) = copy::<f32>(&array, "float32")?;
    if let Some(i) = rounded.iter().position(|x| x.is_infinite()) {
        check_single(&copy::<f64>(&array, "float64")?.0, &rounded, i, what)?;
    }
    Ok((rounded, extents))
}

/// Refuses finite numbers that single precision rounds to an infinite one, from entry `first` on.
///
/// # Errors
/// `InputError`.
pub fn check_single(exact: &[f64], rounded: &[f32], first: usize, what: &str) -> PyResult<()> {
    match (first..exact.len()).find(|&i| exact[i].is_finite() && !rounded[i].is_finite()) {
        None => Ok(()),
        Some(i) => Err(input_error(format!("{what}: entry {i}, {:?}, is more than float32 can hold", exact[i]))),
    }
}

/// An array of whole numbers of the wanted shape, copied row by row.
///
/// # Errors
/// `TypeError` for entries that aren't integers, `InputError` for another shape.
pub fn integers(value: &Bound<'_, PyAny>, what: &str, shape: &[Extent]) -> PyResult<(Vec<i64>, Vec<usize>)> {
    let array = numbers(value, what, "iu", shape)?;
    if dtype_kind(&array)? == "u" {
        // Numbers that int64 can't hold would become negative.
        let (entries, shape) = copy::<u64>(&array, "uint64")?;
        return match entries.iter().position(|&entry| i64::try_from(entry).is_err()) {
            Some(at) => Err(input_error(format!("{what} has an entry that is too large: {}", entries[at]))),
            None => Ok((entries.into_iter().map(|entry| entry as i64).collect(), shape)),
        };
    }
    copy::<i64>(&array, "int64")
}

/// An array of entries that are of a type already, copied row by row.
///
/// # Errors
/// `TypeError` for entries of another kind, `InputError` for another shape.
pub fn of_type<T: Element + Copy>(
    value: &Bound<'_, PyAny>,
    what: &str,
    dtype: &str,
    shape: &[Extent],
) -> PyResult<Vec<T>> {
    let array = numbers(value, what, &dtype[..1], shape)?;
    Ok(copy(&array, dtype)?.0)
}

/// An array of flags of any shape, copied row by row.
///
/// # Errors
/// `TypeError` for entries of another type.
pub fn marks(value: &Bound<'_, PyAny>, what: &str) -> PyResult<(Vec<bool>, Vec<usize>)> {
    let array = value.py().import("numpy")?.call_method1("asarray", (value,))?;
    let shape: Vec<Extent> = untyped_shape(&array)?.into_iter().map(Some).collect();
    copy::<bool>(&numbers(&array, what, "b", &shape)?, "bool")
}

/// Colours of shape (..., 3) or (..., 4): bytes as they are, floats from 0 to 1 as shares of 255. Alpha 255 where it is missing.
///
/// # Errors
/// `TypeError` for other types, `InputError` for another shape, and for floats that are not from 0 to 1.
pub fn colours(value: &Bound<'_, PyAny>, what: &str, elements: &[Extent]) -> PyResult<Vec<[u8; 4]>> {
    let mut shape = elements.to_vec();
    shape.push(None);
    let array = numbers(value, what, "fu", &shape)?;
    let channels = *untyped_shape(&array)?.last().expect("at least one dimension");
    if !(3..=4).contains(&channels) {
        return Err(input_error(format!("{what} must have 3 or 4 channels, got {channels}")));
    }
    let bytes: Vec<u8> = if dtype_kind(&array)? == "f" {
        let (floats, _) = copy::<f32>(&array, "float32")?;
        let of_255 = |x: f32| (x * 255.0).round();
        // A value that is no number is black.
        if let Some(&x) = floats.iter().find(|&&x| !x.is_nan() && !(0.0..=255.0).contains(&of_255(x))) {
            return Err(input_error(format!(
                "{what}: floats must be from 0 to 1, got {x}. Give 0 to 255 as bytes (uint8), and clip values brighter than white."
            )));
        }
        floats.iter().map(|&x| of_255(x) as u8).collect()
    } else {
        let size: usize = array.getattr("dtype")?.getattr("itemsize")?.extract()?;
        if size != 1 {
            return Err(PyTypeError::new_err(format!("{what} must be uint8 or float, got {}", dtype_name(&array)?)));
        }
        copy::<u8>(&array, "uint8")?.0
    };
    Ok(bytes.chunks_exact(channels).map(|c| [c[0], c[1], c[2], if channels == 4 { c[3] } else { 255 }]).collect())
}

/// An image of shape (rows, cols, 3) or (rows, cols, 4) as [`colours`] takes them, without alpha: columns and rows, and the pixels.
///
/// # Errors
/// As [`colours`].
pub fn image(value: &Bound<'_, PyAny>, what: &str) -> PyResult<([usize; 2], Vec<[u8; 3]>)> {
    let array = value.py().import("numpy")?.call_method1("asarray", (value,))?;
    let pixels = colours(&array, what, &[None, None])?;
    let shape = untyped_shape(&array)?;
    Ok(([shape[1], shape[0]], pixels.into_iter().map(|[red, green, blue, _]| [red, green, blue]).collect()))
}

/// Colours of shape (n, 4), uint8, looked up in a table of 256 values a channel, all channels in one flat array.
///
/// # Errors
/// `TypeError` for other types, `InputError` for another shape.
pub fn looked_up(value: &Bound<'_, PyAny>, what: &str, tables: [&[f32; 256]; 4]) -> PyResult<Vec<f32>> {
    let array = numbers(value, what, "u", &[None, Some(4)])?;
    let array = value.py().import("numpy")?.call_method1("ascontiguousarray", (array,))?;
    let array = array
        .cast_into::<PyArray2<u8>>()
        .map_err(|refused| PyTypeError::new_err(format!("{what} must be uint8: {refused}")))?;
    let entries = array.readonly();
    let (colours, _) = entries.as_slice()?.as_chunks::<4>();
    let found: Vec<[f32; 4]> =
        colours.iter().map(|colour| std::array::from_fn(|k| tables[k][usize::from(colour[k])])).collect();
    Ok(found.into_flattened())
}

/// `value` as an array whose kind is one of `kinds` (NumPy's letters) and whose shape fits `shape`.
fn numbers<'py>(value: &Bound<'py, PyAny>, what: &str, kinds: &str, shape: &[Extent]) -> PyResult<Bound<'py, PyAny>> {
    let numpy = value.py().import("numpy")?;
    let mut array = numpy.call_method1("asarray", (value,))?;
    let kind = dtype_kind(&array)?;
    // An array of numbers and a mask, as rasters are read: what is masked is no number.
    if kinds.contains('i')
        && kinds.contains(kind.as_str())
        && numpy.getattr("ma")?.call_method1("is_masked", (value,))?.is_truthy()?
    {
        if !kinds.contains('f') {
            return Err(PyTypeError::new_err(format!("{what} must be integers, got masked entries: leave these out")));
        }
        array = value.call_method1("astype", ("float64",))?.call_method1("filled", (f64::NAN,))?;
    }
    if !kinds.contains(kind.as_str()) {
        let wanted = match kinds {
            "b" => "bool",
            kinds if kinds.contains('f') => "real numbers",
            _ => "integers",
        };
        return Err(PyTypeError::new_err(format!("{what} must be {wanted}, got {}", dtype_name(&array)?)));
    }
    let got = untyped_shape(&array)?;
    let fits = got.len() == shape.len() && got.iter().zip(shape).all(|(g, w)| w.is_none_or(|w| w == *g));
    if !fits {
        let (wanted, got) = (shape_text(shape), shape_text(&got.iter().map(|&n| Some(n)).collect::<Vec<_>>()));
        return Err(input_error(format!("{what} must have shape {wanted}, got {got}")));
    }
    Ok(array)
}

/// Memory that taking an array needs, as multiples of what it holds, nearly: numbers stay, indices become smaller ones.
const COPIES: f64 = 1.3;
const COPIES_OF_INDICES: f64 = 1.55;

fn copy<T: Element + Copy>(array: &Bound<'_, PyAny>, dtype: &str) -> PyResult<(Vec<T>, Vec<usize>)> {
    let array = array.py().import("numpy")?.call_method1("ascontiguousarray", (array, dtype))?;
    // Views into records of files lie anywhere.
    let is_aligned = array.getattr("flags")?.getattr("aligned")?.is_truthy()?;
    let array = if is_aligned { array } else { array.call_method0("copy")? };
    let array = array.cast_into::<PyArrayDyn<T>>()?;
    let entries = array.readonly();
    // Indices of 64 bits become smaller ones.
    let copies = if dtype.contains("int64") { COPIES_OF_INDICES } else { COPIES };
    foresee(array.len(), copies * size_of::<T>() as f64, "taking", "numbers").map_err(|e| to_python(&e))?;
    // A zero-dimensional array comes back as one of length one; no caller asks for that.
    Ok((entries.as_slice()?.to_vec(), array.shape().to_vec()))
}

fn dtype_kind(array: &Bound<'_, PyAny>) -> PyResult<String> {
    array.getattr("dtype")?.getattr("kind")?.extract()
}

fn dtype_name(array: &Bound<'_, PyAny>) -> PyResult<String> {
    array.getattr("dtype")?.getattr("name")?.extract()
}

fn untyped_shape(array: &Bound<'_, PyAny>) -> PyResult<Vec<usize>> {
    array.getattr("shape")?.extract()
}

fn shape_text(shape: &[Extent]) -> String {
    let extents: Vec<String> = shape.iter().map(|e| e.map_or("n".to_owned(), |n| n.to_string())).collect();
    format!("({}{})", extents.join(", "), if extents.len() == 1 { "," } else { "" })
}

/// A 4 x 4 matrix, translation in the last column.
pub fn matrix<'py>(py: Python<'py>, transform: &DAffine3) -> Bound<'py, PyAny> {
    let rows: [[f64; 4]; 4] = DMat4::from(*transform).transpose().to_cols_array_2d();
    PyArray2::from_vec2(py, &rows.map(|r| r.to_vec())).expect("rows of equal length").into_any()
}

/// A transform from a 4 x 4 matrix with the translation in the last column.
///
/// # Errors
/// `InputError` if it isn't affine, finite and invertible.
pub fn affine(value: &Bound<'_, PyAny>, what: &str) -> PyResult<DAffine3> {
    let transform = any_affine(value, what)?;
    if transform.matrix3.determinant() == 0.0 {
        return Err(input_error(format!("{what} flattens space: its determinant must not be 0")));
    }
    Ok(transform)
}

/// Like [`affine`], also of one that flattens space.
///
/// # Errors
/// `InputError` if it isn't affine and finite.
pub fn any_affine(value: &Bound<'_, PyAny>, what: &str) -> PyResult<DAffine3> {
    let (m, _) = floats(value, what, &[Some(4), Some(4)])?;
    if !m.iter().all(|x| x.is_finite()) {
        return Err(input_error(format!("{what} must have finite entries")));
    }
    if m[12..] != [0.0, 0.0, 0.0, 1.0] {
        return Err(input_error(format!("{what} must end with the row 0 0 0 1, got {:?}", &m[12..])));
    }
    let columns = |c: usize| DVec3::new(m[c], m[4 + c], m[8 + c]);
    Ok(DAffine3::from_cols(columns(0), columns(1), columns(2), columns(3)))
}

/// The rigid transform nearest to a 4 x 4 matrix.
///
/// # Errors
/// `InputError` if it scales, shears or mirrors by more than digits can be lost.
pub fn rigid(value: &Bound<'_, PyAny>, what: &str) -> PyResult<DAffine3> {
    surfrecon::rigid::nearest(affine(value, what)?)
        .map_err(|why| input_error(format!("{what} must be rigid (rotation and translation only): {why}")))
}

/// A vector of three numbers.
pub fn vector(value: &Bound<'_, PyAny>, what: &str) -> PyResult<DVec3> {
    let (v, _) = floats(value, what, &[Some(3)])?;
    Ok(DVec3::new(v[0], v[1], v[2]))
}

/// The coordinates of vectors, three a vector.
pub fn coordinates(vectors: &[DVec3]) -> &[f64] {
    bytemuck::cast_slice(vectors)
}

/// Vectors from coordinates, three a vector.
pub fn vectors(coordinates: Vec<f64>) -> Vec<DVec3> {
    // In place, unless there is room for more that is no whole number of vectors.
    bytemuck::allocation::try_cast_vec(coordinates)
        .unwrap_or_else(|(_, given)| given.chunks_exact(3).map(|c| DVec3::new(c[0], c[1], c[2])).collect())
}
