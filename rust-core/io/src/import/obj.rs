//! Wavefront OBJ: vertices, with colours where six numbers are given, and faces. Polygons are cut into triangles. Colours count to 1, or to
//! 255 where one is larger. Texture coordinates are read where each vertex has one pair: vertices are not split at seams. Normals,
//! materials, lines and free-form surfaces are passed over. Without faces it is a cloud.

use glam::DVec3;

use super::colour::Count;
use super::file::Input;
use super::polygons::Polygons;
use super::scan::{Content, FileScan};
use super::text::{Lines, lines_of, whole_lines};
use base::error::{Result, known_as};
use base::memory;
use base::progress::Progress;
use mesh::point_cloud::PointCloud;
use mesh::{Attribute, TriMesh, texture};

/// Statements that a file may have before its first vertex or face, and all others that mean nothing here.
const KNOWN: [&[u8]; 12] = [b"v", b"vn", b"vt", b"vp", b"f", b"o", b"g", b"s", b"mtllib", b"usemtl", b"l", b"p"];

/// Whether a file that starts like this is one: its statements are known and one of them is a vertex, a name or a
/// material library.
pub(super) fn sniff(start: &[u8]) -> bool {
    let mut telling = false;
    let mut continued = false;
    for line in lines_of(&String::from_utf8_lossy(whole_lines(start))) {
        if std::mem::replace(&mut continued, line.ends_with('\\')) {
            continue;
        }
        let mut words = line.split_ascii_whitespace().map(str::as_bytes);
        let Some(first) = words.next() else { continue };
        if first.starts_with(b"#") {
            continue;
        }
        if !KNOWN.contains(&first) {
            return false;
        }
        let second = words.next().unwrap_or_default();
        telling |= match first {
            b"mtllib" | b"o" => true,
            b"v" => second.first().is_some_and(|c| c.is_ascii_digit() || matches!(c, b'-' | b'+' | b'.')),
            _ => false,
        };
    }
    telling
}

/// Of the length of the file, which the mesh takes. Measured.
const SHARE_OF_TEXT: f64 = 0.8;

pub(super) fn parse(input: &mut dyn Input, length: u64, scan: &FileScan, progress: &Progress<'_>) -> Result<Content> {
    memory::expect(
        length as f64 * SHARE_OF_TEXT,
        || format!("reading {}", known_as(&scan.path)),
        "use a smaller mesh, or raise the limit",
    )?;
    let mut lines = Lines::new(input, length, &scan.path);
    let mut positions: Vec<DVec3> = Vec::new();
    let mut colours: Vec<[u8; 4]> = Vec::new();
    let mut colours_count = Count::One;
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let mut polygons = Polygons::default();
    let mut coordinates = Coordinates::default();
    // Faces may name vertices that come later: checked at the end.
    let (mut highest, mut highest_line) = (0, 0);
    while lines.next_content()? {
        // Nothing else is: comments and names may end with the backslash of a path.
        if matches!(lines.rest()[0], b'v' | b'f') {
            lines.join()?;
        }
        match lines.word() {
            b"v" => {
                let point = DVec3::new(lines.f64("x")?, lines.f64("y")?, lines.f64("z")?);
                if !point.is_finite() {
                    return Err(lines.fail("a coordinate is not finite"));
                }
                if positions.len() >= u32::MAX as usize {
                    return Err(lines.fail("more than 2^32 - 1 vertices"));
                }
                let mut more = [0.0; 3];
                let mut count = 0;
                while count < 3
                    && let Some(value) = lines.try_f64()
                {
                    more[count] = value;
                    count += 1;
                }
                if count == 3 {
                    let largest = more.into_iter().fold(0.0, f64::max);
                    if largest >= colours_count.end() {
                        colours_count = colours_count.widened(largest, &mut colours, 3);
                    }
                    colours.resize(positions.len(), [0, 0, 0, 255]);
                    let [r, g, b] = more.map(|c| (c * colours_count.factor()).round() as u8);
                    colours.push([r, g, b, 255]);
                }
                positions.push(point);
            }
            b"vt" => {
                // Those of a texture of one dimension have one.
                coordinates.add([lines.try_f64().unwrap_or(f64::NAN), lines.try_f64().unwrap_or_default()]);
            }
            b"f" => {
                let mut corners = [0_u32; 3];
                let (first, mut count) = (triangles.len(), 0);
                while !lines.is_done() {
                    let (vertex, named) = corner(&mut lines, positions.len(), coordinates.all.len())?;
                    coordinates.name(vertex, named, positions.len());
                    if vertex > highest {
                        (highest, highest_line) = (vertex, lines.number);
                    }
                    match count {
                        0 => corners[0] = vertex,
                        1 => corners[2] = vertex,
                        _ => {
                            corners = [corners[0], corners[2], vertex];
                            triangles.push(corners);
                        }
                    }
                    count += 1;
                }
                if count < 3 {
                    return Err(lines.fail("a face needs three vertices or more"));
                }
                polygons.add(first, count);
            }
            _ => {}
        }
    }
    if positions.is_empty() {
        return Err(lines.fail("there is no vertex"));
    }
    if highest as usize >= positions.len() && !triangles.is_empty() {
        let problem = format!("a face names vertex {}, but there are only {}", u64::from(highest) + 1, positions.len());
        return Err(base::Error::format(&scan.path, format!("line {highest_line}"), problem));
    }
    if !colours.is_empty() {
        colours.resize(positions.len(), [0, 0, 0, 255]);
    }
    let colours = (!colours.is_empty()).then_some(colours);
    if triangles.is_empty() {
        let cloud = PointCloud {
            positions,
            colour: colours,
            world_from_cloud: scan.world_from_sensor,
            ..PointCloud::default()
        };
        return Ok(Content::Points(cloud));
    }
    polygons.cut(&positions, &mut triangles, progress)?;
    let mut mesh = TriMesh::new(positions, triangles);
    mesh.vertex_attributes.extend(colours.map(|c| Attribute::colour("colour", c)));
    mesh.vertex_attributes.extend(coordinates.of_vertices(mesh.positions.len()).into_iter().flatten());
    Ok(Content::Mesh(mesh))
}

/// Texture coordinates, and which of them each vertex has.
#[derive(Default)]
struct Coordinates {
    all: Vec<[f32; 2]>,
    /// Of each vertex, counted from 1. 0 before any corner has named it.
    of: Vec<u32>,
    /// Whether they are passed over: a corner has none, or two corners of a vertex have two.
    are_lost: bool,
}

impl Coordinates {
    fn add(&mut self, coordinates: [f64; 2]) {
        let single = coordinates.map(|x| x as f32);
        if !single.iter().all(|x| x.is_finite()) || self.all.len() >= u32::MAX as usize {
            self.lose();
        } else if !self.are_lost {
            self.all.push(single);
        }
    }

    /// A corner of a vertex has the coordinates `named`, counted from 1. Vertices and coordinates that come later are not waited for.
    fn name(&mut self, vertex: u32, named: Option<u32>, vertices: usize) {
        if self.are_lost || self.all.is_empty() {
            return;
        }
        let place = vertex as usize;
        let named = named.filter(|&named| place < vertices && named as usize <= self.all.len());
        self.of.resize(vertices, 0);
        match (named, self.of.get_mut(place)) {
            (Some(named), Some(of)) if *of == 0 || *of == named => *of = named,
            _ => self.lose(),
        }
    }

    fn lose(&mut self) {
        *self = Coordinates { are_lost: true, ..Coordinates::default() };
    }

    /// Those of so many vertices. A vertex at no corner has the coordinates of its number, if there are as many.
    fn of_vertices(mut self, count: usize) -> Option<[Attribute; 2]> {
        if self.of.is_empty() {
            return None;
        }
        self.of.resize(count, 0);
        let is_alike = self.all.len() == count;
        let of_vertex = |(v, &named): (usize, &u32)| match named {
            0 if is_alike => self.all[v],
            0 => [0.0; 2],
            named => self.all[named as usize - 1],
        };
        let along = |axis: usize| self.of.iter().enumerate().map(|of| of_vertex(of)[axis]).collect();
        Some([Attribute::f32(texture::S, along(0)), Attribute::f32(texture::T, along(1))])
    }
}

/// The vertex of a corner `v`, `v/t`, `v//n` or `v/t/n`, and the number of its texture coordinates, counted from 1, if it has any that
/// are there.
fn corner(lines: &mut Lines<'_>, vertices: usize, coordinates: usize) -> Result<(u32, Option<u32>)> {
    let word = lines.word();
    let mut parts = word.split(|&b| b == b'/');
    if let Some(vertex) = parts.next().and_then(|part| index(part, vertices)) {
        return Ok((vertex, parts.next().and_then(|part| index(part, coordinates)?.checked_add(1))));
    }
    let shown: String = String::from_utf8_lossy(word).chars().take(40).collect();
    Err(lines.fail(format!("`{shown}` names no vertex: they are counted from 1, or backwards from -1")))
}

/// An index that is counted from 1, or from the last of `count` where negative.
fn index(digits: &[u8], count: usize) -> Option<u32> {
    match std::str::from_utf8(digits).ok()?.parse::<i64>().ok()? {
        index if index > 0 => u32::try_from(index - 1).ok(),
        index if index < 0 => u32::try_from((count as i64).checked_add(index)?).ok(),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::damage;
    use super::*;

    const TEXT: &str = "# cube corner\nmtllib a.mtl\no part\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0.5\r\nv 1 1 0\nv 0 1 0\n\
        vt 0 0\nvn 0 0 1\nf 1/1/1 2//1 3/1 4\ns off\nf -4 -3 5\nv 4000000.25 0 1\n";

    fn scan() -> FileScan {
        FileScan::new(std::path::Path::new("x.obj"))
    }

    #[test]
    fn faces_of_every_form() {
        let Content::Mesh(mesh) = damage::read(parse, TEXT.as_bytes(), &scan()).unwrap() else { panic!("no mesh") };
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 4]]);
        assert_eq!(mesh.positions[4], DVec3::new(4_000_000.25, 0.0, 1.0));
        let expected = vec![[255, 0, 0, 255], [0, 255, 128, 255], [0, 0, 0, 255], [0, 0, 0, 255], [0, 0, 0, 255]];
        assert_eq!(mesh.vertex_attributes, [Attribute::colour("colour", expected)]);
        let cloud = damage::read(parse, b"v 1 2 3\nv 4 5 6", &scan()).unwrap();
        assert!(matches!(cloud, Content::Points(cloud) if cloud.positions.len() == 2));
        damage::endure(parse, TEXT.as_bytes(), &scan());
        assert!(sniff(TEXT.as_bytes()) && sniff(b"v 1 2 3\nf 1 2") && !sniff(b"1 2 3\n") && !sniff(b"hello v\n"));
        assert!(!sniff(b"v\nw\n") && !sniff(b""));
    }

    #[test]
    fn texture_coordinates_are_read_where_each_vertex_has_one_pair() {
        let read = |faces: &str| {
            let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0.25 1\nvt 0.5\nvt 3 2\n{faces}\n");
            let Content::Mesh(mesh) = damage::read(parse, text.as_bytes(), &scan()).unwrap() else { panic!("no mesh") };
            texture::coordinates(&mesh).map(|all| all.map(<[f32]>::to_vec))
        };
        let expected = Some([vec![0.25, 3.0, 0.5, 0.0], vec![1.0, 2.0, 0.0, 0.0]]);
        assert_eq!(read("f 1/1 2/3 3/2"), expected);
        assert_eq!(read("f 1/-3/1 2/-1 3/-2\nf 3/2 2/3 1/1"), expected);
        // A seam, a corner without any, none, one that is not there, and a vertex that comes later.
        for faces in [
            "f 1/1 2/3 3/2\nf 1/2 2/3 3/2",
            "f 1/1 2 3/2",
            "f 1//1 2//1 3//1",
            "f 1/1 2/4 3/2",
            "f 1/1 2/2 5/3\nv 0 0 0",
        ] {
            assert_eq!(read(faces), None, "{faces}");
        }
        assert_eq!(read("vt x\nf 1/1 2/3 3/2"), None);
        assert_eq!(read("vt 1e300 0\nf 1/1 2/3 3/2"), None);
    }

    #[test]
    fn what_is_wrong_has_its_line() {
        for (text, problem) in [
            ("v 1 2\n", "line 1: expected z, but the line ends"),
            ("v 1 2 x\n", "line 1: expected z, found `x`"),
            ("v 0 0 0\nf 1 1\n", "line 2: a face needs three vertices"),
            ("v 0 0 0\nf 1 1 2\n", "line 2: a face names vertex 2, but there are only 1"),
            ("v 0 0 0\nf 1 1 0\n", "line 2: `0` names no vertex"),
            ("v 0 0 0\nf 1 1 -2\n", "line 2: `-2` names no vertex"),
            ("v 0 0 0\nf 1 1 99999999999999999999\n", "names no vertex"),
            ("v 0 0 0\nf 1 1 4294967296\n", "line 2: a face names vertex 4294967296"),
            ("v 0 0 inf\n", "line 1: a coordinate is not finite"),
            ("# nothing\n", "line 1: there is no vertex"),
            ("# an object alone\no empty\n", "line 2: there is no vertex"),
        ] {
            let error = damage::read(parse, text.as_bytes(), &scan()).unwrap_err().to_string();
            assert!(error.contains(problem), "{error}");
        }
    }
}
