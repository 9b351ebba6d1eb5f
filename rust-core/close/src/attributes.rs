//! Attributes of what was filled: it is marked, and takes the rest from the nearest measured vertex and face.

use std::collections::VecDeque;

use base::error::Result;
use base::progress::{Pace, Progress};
use mesh::{Attribute, AttributeData, TriMesh};

/// Gives the filled vertices and faces, which come after those of `measured`, their attributes. `forced` says which faces were filled where
/// a scan saw through.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn extend(result: &mut TriMesh, measured: &TriMesh, forced: &[bool], progress: &Progress<'_>) -> Result<()> {
    let (vertices, faces) = (measured.positions.len(), measured.triangles.len());
    let sources = sources(result, vertices, progress)?;
    let is_filled = |count: usize, first: usize| (0..count).map(|i| i >= first).collect::<Vec<bool>>();
    result.vertex_attributes = measured.vertex_attributes.iter().map(|a| a.gather(&sources)).collect();
    for attribute in &mut result.vertex_attributes {
        filled_values(attribute, vertices);
    }
    mark(&mut result.vertex_attributes, "interpolated", is_filled(result.positions.len(), vertices));
    // The face of an edge before, over any of its corners.
    let mut face_of = vec![usize::MAX; vertices];
    for (t, corners) in measured.triangles.iter().enumerate() {
        corners.iter().for_each(|&v| face_of[v as usize] = face_of[v as usize].min(t));
    }
    let source = |t: usize| match t < faces {
        true => t,
        false => face_of[sources[result.triangles[t][0] as usize]],
    };
    let face_sources: Vec<usize> = (0..result.triangles.len()).map(source).collect();
    result.face_attributes = measured.face_attributes.iter().map(|a| a.gather(&face_sources)).collect();
    mark(&mut result.face_attributes, "hole_fill", is_filled(result.triangles.len(), faces));
    if forced.contains(&true) {
        mark(&mut result.face_attributes, "forced", forced.to_vec());
    }
    Ok(())
}

/// Of each vertex the measured one that is nearest over edges. Of several it is the first found from vertices of smaller numbers. Measured
/// vertices are their own.
fn sources(mesh: &TriMesh, measured: usize, progress: &Progress<'_>) -> Result<Vec<usize>> {
    let mut pace = Pace::new(progress);
    let mut beside: Vec<[u32; 2]> = Vec::new();
    for t in &mesh.triangles {
        pace.after(2)?;
        for k in 0..3 {
            let ends = [t[k], t[(k + 1) % 3]];
            if ends.iter().any(|&v| v as usize >= measured) {
                beside.extend([ends, [ends[1], ends[0]]]);
            }
        }
    }
    progress.sort(&mut beside, &|a, b| a.cmp(b))?;
    let mut sources = vec![usize::MAX; mesh.positions.len()];
    (0..measured).for_each(|v| sources[v] = v);
    let mut queue: VecDeque<u32> = beside.iter().map(|pair| pair[0]).filter(|&v| (v as usize) < measured).collect();
    while let Some(v) = queue.pop_front() {
        let first = beside.partition_point(|pair| pair[0] < v);
        for pair in beside[first..].iter().take_while(|pair| pair[0] == v) {
            pace.after(8)?;
            if sources[pair[1] as usize] == usize::MAX {
                sources[pair[1] as usize] = sources[v as usize];
                queue.push_back(pair[1]);
            }
        }
    }
    Ok(sources)
}

/// Filled vertices have no confidence, no scan and no colour of their own.
fn filled_values(attribute: &mut Attribute, first: usize) {
    match (attribute.name.as_str(), &mut attribute.data) {
        ("confidence", AttributeData::F32(values)) => values[first..].fill(0.0),
        ("source_scan" | "range_row" | "range_col", AttributeData::I32(values)) => values[first..].fill(-1),
        (_, AttributeData::Colour(values)) => values[first..].iter_mut().for_each(|colour| colour[3] = 0),
        _ => {}
    }
}

/// Sets a flag besides those that the attribute has already.
fn mark(attributes: &mut Vec<Attribute>, name: &str, flags: Vec<bool>) {
    match attributes.iter_mut().find(|attribute| attribute.name == name) {
        Some(Attribute { data: AttributeData::Bool(known), .. }) => {
            known.iter_mut().zip(flags).for_each(|(known, flag)| *known |= flag);
        }
        Some(attribute) => attribute.data = AttributeData::Bool(flags),
        None => attributes.push(Attribute::bool(name, flags)),
    }
}
