//! Intrinsics of depth cameras.
//!
//! Formats that are read: Open3D's JSON (`intrinsic_matrix`, nine numbers column by column, also inside `intrinsic`). Plain JSON with `fx
//! fy cx cy`, or `fl_x fl_y` as nerfstudio writes them, also inside `camera`, as Replica's. There `width` and `height` or `w` and `h` are
//! optional. A text of the 3 x 3 matrix or of the 4 x 4 one, as ScanNet's. A text of the four numbers fx fy cx cy. Pixel centres lie at
//! whole numbers.

use std::io::Read;
use std::path::Path;

use serde_json::Value;

use super::file;
use base::error::{Error, Result};
use image::frame::Camera;

/// Longest file of intrinsics.
const LONGEST: u64 = 1 << 16;

/// Whether a file that starts like this holds intrinsics.
pub(super) fn sniff(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let text = text.trim_start();
    if text.starts_with('{') {
        let has = |key: &str| text.contains(&format!("\"{key}\""));
        return has("intrinsic_matrix") || (has("fx") && has("fy")) || (has("fl_x") && has("cx"));
    }
    (start.len() as u64) < LONGEST && numbers(text).is_some_and(|n| from_numbers(&n).is_some())
}

/// Reads a file of intrinsics.
pub(super) fn read(path: &Path) -> Result<Camera> {
    let (file, length) = file::open(path)?;
    let fail = |at: &str, problem: String| Err(Error::format(path, at, problem));
    if length > LONGEST {
        return fail("whole file", format!("{length} bytes are more than intrinsics need, at most {LONGEST}"));
    }
    let mut bytes = Vec::new();
    file.take(length).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    parse(&bytes, path)
}

/// Parses the content of a file.
pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Camera> {
    let fail = |at: String, problem: &str| Err(Error::format(path, at, problem));
    let Ok(text) = std::str::from_utf8(bytes) else {
        return fail("whole file".to_owned(), "this is not text (UTF-8)");
    };
    let camera = if text.trim_start().starts_with('{') {
        let value: Value = match serde_json::from_str(text) {
            Ok(value) => value,
            Err(error) => return Err(file::no_json(path, &error)),
        };
        from_json(&value)
    } else {
        numbers(text).and_then(|numbers| from_numbers(&numbers))
    };
    match camera {
        Some(camera) => match camera.validate() {
            Ok(()) => Ok(camera),
            Err(problem) => fail("whole file".to_owned(), &problem.to_string()),
        },
        None => fail(
            "whole file".to_owned(),
            "no intrinsics found: known are JSON with `fx`, `fy`, `cx`, `cy` or with `intrinsic_matrix` (nine \
                numbers, column by column). A text may hold fx fy cx cy, or the 3 x 3 or 4 x 4 matrix.",
        ),
    }
}

fn from_json(value: &Value) -> Option<Camera> {
    let value = value.get("intrinsic").or(value.get("camera")).unwrap_or(value);
    let number = |names: [&str; 2]| names.iter().find_map(|name| value.get(name)?.as_f64());
    let mut camera = if let Some(matrix) = value.get("intrinsic_matrix") {
        let m: Vec<f64> = flattened(matrix)?;
        let &[fx, _, _, _, fy, _, cx, cy, _] = m.as_slice() else { return None };
        // Rows instead of columns: the last row is 0 0 1.
        let (cx, cy) = if cx == 0.0 && cy == 0.0 { (m[2], m[5]) } else { (cx, cy) };
        Camera::new([fx, fy], [cx, cy])
    } else {
        Camera::new(
            [number(["fx", "fl_x"])?, number(["fy", "fl_y"])?],
            [number(["cx", "ppx"])?, number(["cy", "ppy"])?],
        )
    };
    let size = |names: [&str; 2]| number(names).filter(|n| *n >= 1.0 && *n < 1e9).map(|n| n as usize);
    if let (Some(width), Some(height)) = (size(["width", "w"]), size(["height", "h"])) {
        camera.size = Some([width, height]);
    }
    Some(camera)
}

/// Numbers of an array, which may be nested once.
fn flattened(value: &Value) -> Option<Vec<f64>> {
    let mut all = Vec::new();
    for entry in value.as_array()? {
        match entry.as_array() {
            Some(inner) => inner.iter().try_for_each(|n| n.as_f64().map(|n| all.push(n)))?,
            None => all.push(entry.as_f64()?),
        }
    }
    Some(all)
}

/// The numbers of a text that holds nothing else, at most sixteen.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let words = text.split([' ', '\t', '\r', '\n', ',']).filter(|word| !word.is_empty());
    let numbers: Vec<f64> = words.take(17).map(|word| word.parse().ok()).collect::<Option<_>>()?;
    Some(numbers)
}

fn from_numbers(numbers: &[f64]) -> Option<Camera> {
    let camera = match *numbers {
        [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0] => Camera::new([fx, fy], [cx, cy]),
        [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0] => Camera::new([fx, fy], [cx, cy]),
        [fx, fy, cx, cy] => Camera::new([fx, fy], [cx, cy]),
        _ => return None,
    };
    // Focal lengths in pixels: anything shorter is no camera.
    (camera.focal[0].abs() > 1.0 && camera.focal[1].abs() > 1.0).then_some(camera)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Camera> {
        assert!(sniff(text.as_bytes()) || parse(text.as_bytes(), Path::new("c")).is_err(), "{text}");
        parse(text.as_bytes(), Path::new("c"))
    }

    #[test]
    fn every_form() {
        let open3d = r#"{"width": 640, "height": 480, "intrinsic_matrix": [525.0,0,0, 0,526.0,0, 319.5,239.5,1]}"#;
        let plain = Camera::new([525.0, 526.0], [319.5, 239.5]);
        let sized = Camera { size: Some([640, 480]), ..plain };
        assert_eq!(read(open3d).unwrap(), sized);
        assert_eq!(read(&format!(r#"{{"extrinsic": [1], "intrinsic": {open3d}}}"#)).unwrap(), sized);
        let rows = r#"{"intrinsic_matrix": [[525,0,319.5],[0,526,239.5],[0,0,1]]}"#;
        assert_eq!(read(rows).unwrap(), plain);
        assert_eq!(read(r#"{"fx":525,"fy":526,"cx":319.5,"cy":239.5}"#).unwrap(), plain);
        assert_eq!(read(r#"{"fl_x":525,"fl_y":526,"cx":319.5,"cy":239.5,"w":640,"h":480}"#).unwrap(), sized);
        let nested = r#"{"camera": {"w":640,"h":480,"fx":525,"fy":526,"cx":319.5,"cy":239.5,"scale":6553.5}}"#;
        assert_eq!(read(nested).unwrap(), sized);
        assert_eq!(read(" 525.0 0 319.5\r\n 0 526 239.5\n0 0 1\n").unwrap(), plain);
        assert_eq!(read("525 0 319.5 0\n0 526 239.5 0\n0 0 1 0\n0 0 0 1\n").unwrap(), plain);
        assert_eq!(read("525, 526, 319.5, 239.5").unwrap(), plain);
    }

    #[test]
    fn what_is_none_says_so() {
        for text in ["", "{", "{}", "1 2 3", r#"{"fx": "a", "fy": 1}"#, r#"{"intrinsic_matrix": [1,2]}"#, "1 2 3 4 5"] {
            let error = parse(text.as_bytes(), Path::new("c")).unwrap_err().to_string();
            assert!(error.contains("no intrinsics found") || error.contains("this is not JSON"), "{error}");
        }
        let huge = parse(br#"{"fx": 1e400, "fy": 1, "cx": 1, "cy": 1}"#, Path::new("c")).unwrap_err().to_string();
        assert!(huge.contains("a number is too large: at most 1.8e308 is read"), "{huge}");
        let zero = r#"{"fx": 0, "fy": 1, "cx": 1, "cy": 1}"#;
        assert!(parse(zero.as_bytes(), Path::new("c")).unwrap_err().to_string().contains("focal length fx must be"));
        let mirrored = parse(b"-525 526 319.5 239.5", Path::new("c")).unwrap_err().to_string();
        assert!(mirrored.contains("focal length fx must be above 0, got -525"), "{mirrored}");
        let deep = "[".repeat(100_000);
        assert!(parse(format!("{{\"fx\": {deep}").as_bytes(), Path::new("c")).is_err());
        assert!(!sniff(b"0.5 0.5 0.5 10\n") && !sniff(b"ply\n") && !sniff(br#"{"asset": {}}"#));
    }
}
