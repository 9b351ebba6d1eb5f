//! VRIP's `.conf`: a list of scans with their places.
//!
//! ```text
//! camera tx ty tz qx qy qz qw
//! bmesh  file.ply tx ty tz qx qy qz qw
//! mesh   file.ply tx ty tz qx qy qz qw
//! ```
//!
//! Files lie in the folder of the `.conf` or below it. Names that lead out of it are refused. Tools differ in what the quaternion means:
//! where no comment says so, as in those that we write, the points decide ([`super::overlap`]). A `mesh` line whose name is no file and has
//! no extension is passed over with a note: Stanford's own files name a cylindrical scan this way that was never given out.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3};

use super::file;
use super::options::ReadOptions;
use super::overlap::{self, Convention, STANFORD};
use super::set::{OpenNamed, ScanSet};
use super::text::lines_of;
use crate::memory_folder::begins_in_memory;
use base::error::{Error, Result, known_as};
use base::progress::Progress;

/// Says what quaternions of a list mean, of which there are several senses: so those of our own need no guess.
pub(crate) const SENSE: &str = "# quaternions are x y z w and rotate world to scan";

/// One placed file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Placed {
    pub(super) line: usize,
    pub(super) path: PathBuf,
    pub(super) translation: DVec3,
    /// Unit length, in the order of the file.
    pub(super) quaternion: [f64; 4],
}

impl Placed {
    /// The pose under a convention.
    pub(super) fn pose(&self, convention: Convention) -> DAffine3 {
        let [a, b, c, d] = self.quaternion;
        let hamilton = match convention.scalar_first {
            false => DQuat::from_xyzw(a, b, c, d),
            true => DQuat::from_xyzw(b, c, d, a),
        };
        let rotation = if convention.world_to_scan { hamilton.conjugate() } else { hamilton };
        DAffine3::from_rotation_translation(rotation, self.translation)
    }
}

/// Whether text that starts like this is one: its first line of content starts with a known word.
pub(super) fn sniff(start: &[u8]) -> bool {
    let text = file::start_of_text(start);
    let first = text.split(['\n', '\r']).map(str::trim).find(|line| !line.is_empty() && !is_comment(line));
    first.is_some_and(|line| {
        let mut words = line.split_ascii_whitespace();
        words.next().is_some_and(|w| keyword(w).is_some()) && words.count() >= 7
    })
}

/// Opens the scans of a file and decides what its quaternions mean.
pub(super) fn open(
    path: &Path,
    options: &Arc<ReadOptions>,
    open_named: OpenNamed,
    progress: &Progress<'_>,
) -> Result<ScanSet> {
    let mut notes = Vec::new();
    let bytes = file::read(path)?;
    let placed = parse(path, &bytes, options, &mut notes)?;
    let mut scans = Vec::with_capacity(placed.len());
    for one in &placed {
        progress.check()?;
        scans.push(open_named(path, one.line, &one.path, options, &mut notes)?);
    }
    let convention = if says_sense(&bytes) {
        STANFORD
    } else {
        let (convention, why) = overlap::decide(&scans, &|i, convention| placed[i].pose(convention), progress)?;
        notes.push(format!("{}: {why}", file::name(path)));
        convention
    };
    for (scan, one) in scans.iter_mut().zip(&placed) {
        scan.world_from_sensor = one.pose(convention);
    }
    Ok(ScanSet { scans, notes })
}

/// Whether it begins as those that we write.
fn says_sense(bytes: &[u8]) -> bool {
    bytes.split(|byte| b"\r\n".contains(byte)).next().is_some_and(|line| line.trim_ascii() == SENSE.as_bytes())
}

/// Parses the text and finds the files.
pub(super) fn parse(path: &Path, bytes: &[u8], options: &ReadOptions, notes: &mut Vec<String>) -> Result<Vec<Placed>> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let line = bytes[..e.valid_up_to()].iter().filter(|&&b| b == b'\n').count() + 1;
        Error::format(path, format!("line {line}"), "this is not text (UTF-8)")
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut placed = Vec::new();
    for (number, line) in lines_of(text).enumerate() {
        let number = number + 1;
        let fail = |problem: String| Err(Error::format(path, format!("line {number}"), problem));
        let line = line.trim();
        if line.is_empty() || is_comment(line) {
            continue;
        }
        let (word, rest) = line.split_once([' ', '\t']).unwrap_or((line, ""));
        let Some(kind) = keyword(word) else {
            let shown: String = word.chars().take(40).collect();
            return fail(format!("`{shown}` is unknown: there are camera, mesh and bmesh, and # starts a comment"));
        };
        let (name, numbers) = match split_numbers(rest) {
            Ok(parts) => parts,
            Err(problem) => return fail(problem),
        };
        if let Some(bad) = numbers.iter().find(|x| !x.is_finite()) {
            return fail(format!("{bad} is not a finite number"));
        }
        if kind == Keyword::Camera {
            continue;
        }
        let file = match named(folder, name, options) {
            Ok(file) => file,
            Err(problem) => return fail(problem),
        };
        let quaternion = match unit([numbers[3], numbers[4], numbers[5], numbers[6]]) {
            Some(quaternion) => quaternion,
            None => return fail("the quaternion is zero and turns nowhere: for no rotation write 0 0 0 1".to_owned()),
        };
        if !file::is_file(&file) {
            if kind == Keyword::Mesh && file.extension().is_none() {
                notes.push(format!(
                    "{}: line {number}: there is no file {name}, so this reference surface was left out",
                    file::name(path)
                ));
                continue;
            }
            return fail(format!("there is no file {}: correct the name, or put the file there", known_as(&file)));
        }
        let translation = DVec3::new(numbers[0], numbers[1], numbers[2]);
        placed.push(Placed { line: number, path: file, translation, quaternion });
    }
    if placed.is_empty() {
        return Err(Error::format(path, "whole file", "a line `bmesh` or `mesh` must name a scan"));
    }
    Ok(placed)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Keyword {
    Camera,
    Mesh,
    Bmesh,
}

fn keyword(word: &str) -> Option<Keyword> {
    let known = [("camera", Keyword::Camera), ("mesh", Keyword::Mesh), ("bmesh", Keyword::Bmesh)];
    known.into_iter().find(|(name, _)| name.eq_ignore_ascii_case(word)).map(|(_, keyword)| keyword)
}

fn is_comment(line: &str) -> bool {
    line.starts_with('#') || line.starts_with("//")
}

/// A name, which may hold blanks, and the seven numbers after it.
fn split_numbers(rest: &str) -> Result<(&str, [f64; 7]), String> {
    let mut numbers = [0.0; 7];
    let mut rest = rest.trim();
    for i in (0..7).rev() {
        let (before, word) = rest.rsplit_once([' ', '\t']).unwrap_or(("", rest));
        numbers[i] = word.parse().map_err(|_| {
            let shown: String = word.chars().take(40).collect();
            format!("expected tx ty tz qx qy qz qw at the end of the line, found `{shown}` for {}", NUMBERS[i])
        })?;
        rest = before.trim_end();
    }
    Ok((rest, numbers))
}

const NUMBERS: [&str; 7] = ["tx", "ty", "tz", "qx", "qy", "qz", "qw"];

/// The file that a list in the folder names: within it, or where the options allow that, anywhere.
pub(super) fn named(folder: &Path, name: &str, options: &ReadOptions) -> Result<PathBuf, String> {
    match inside(folder, name) {
        Err(_) if options.allow_outside && !name.is_empty() && !name.contains('\0') => Ok(folder.join(name)),
        found => found,
    }
}

/// The file of that name within the folder, links followed.
fn inside(folder: &Path, name: &str) -> Result<PathBuf, String> {
    if name.is_empty() {
        return Err("the name of the file is missing".to_owned());
    }
    // Both kinds of separators, whatever system wrote the file, unless a file has a backslash in its name.
    let is_separator = cfg!(windows) || !name.contains('\\') || !file::is_file(&folder.join(name));
    let parts: Vec<&str> = name.split(|c| c == '/' || (c == '\\' && is_separator)).collect();
    let drive = parts[0].len() >= 2 && parts[0].as_bytes()[1] == b':' && parts[0].as_bytes()[0].is_ascii_alphabetic();
    if parts[0].is_empty() || drive || parts.contains(&"..") || begins_in_memory(name) {
        return Err(format!(
            "{name} leads out of the folder of this file: put the scans beside it or below it, or allow files outside (allow_outside)"
        ));
    }
    if name.contains('\0') {
        return Err("the name of the file holds a zero byte".to_owned());
    }
    let path =
        parts.iter().filter(|part| !matches!(**part, "" | ".")).fold(folder.to_owned(), |path, part| path.join(part));
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    match (path.canonicalize(), here.canonicalize()) {
        (Ok(file), Ok(folder)) if !file.starts_with(&folder) => Err(format!(
            "{name} is a link that leads out of the folder of this file. Put the scans beside it or below it, or \
                allow files outside (allow_outside)."
        )),
        _ => Ok(path),
    }
}

/// The quaternion at unit length. `None` for zero.
fn unit(q: [f64; 4]) -> Option<[f64; 4]> {
    // Scaled first, so that no square over- or underflows.
    let largest = q.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest == 0.0 {
        return None;
    }
    let scaled = q.map(|x| x / largest);
    let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
    Some(scaled.map(|x| x / length))
}

/// For tests and fuzzing: text must not make the parser panic. A text that it accepts lies in the folder and is a rigid place. True if it
/// is accepted.
#[cfg(any(test, fuzzing))]
pub(super) fn examine(bytes: &[u8], folder: &Path) -> bool {
    sniff(bytes);
    let path = folder.join("fuzz.conf");
    match parse(&path, bytes, &ReadOptions::default(), &mut Vec::new()) {
        Ok(placed) => {
            assert!(!placed.is_empty());
            for one in placed {
                let inside = one.path.strip_prefix(folder);
                assert!(inside.is_ok_and(|p| p.components().all(|c| matches!(c, std::path::Component::Normal(_)))));
                assert!(one.translation.is_finite());
                let pose = one.pose(STANFORD);
                assert!((pose.matrix3.determinant() - 1.0).abs() < 1e-9, "{pose:?}");
            }
            true
        }
        Err(Error::Format { path: at, .. }) => {
            assert_eq!(at, path);
            false
        }
        Err(other) => panic!("{other:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::open as open_any;

    /// A folder with scans `a.ply`, `b.ply` and `deep/c.ply`, and the text as `s.conf`.
    fn folder(text: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("deep")).unwrap();
        let ply = "ply\nformat ascii 1.0\nbye\nelement vertex 1\nproperty float x\nproperty float y\n\
            property float z\nend_header\n0 0 0\n";
        for name in ["a.ply", "b.ply", "deep/c.ply", "two words.ply"] {
            std::fs::write(folder.path().join(name), ply).unwrap();
        }
        let conf = folder.path().join("s.conf");
        std::fs::write(&conf, text).unwrap();
        (folder, conf)
    }

    fn refused(text: &str) -> String {
        let (_folder, conf) = folder(text);
        let error = open_any(&conf).unwrap_err().to_string();
        error.strip_prefix(&format!("{}: ", conf.display())).expect("the path comes first").to_owned()
    }

    #[test]
    fn every_form_that_is_met() {
        let text = "# a comment\r\n\r\ncamera 0 0 0  0 0 0 1\r\nBMesh\ta.ply 1 2 3 0 0 0 2\r\n// more\r\n\
            mesh ./deep\\c.ply\t4 5 6 0 0 1e-200 0  \r\nmesh reference_cyl 0 0 0 0 0 0 1\r\n\
            bmesh two words.ply -1e-3 +2 .5 0 0 -0.5 -0.5";
        let (_folder, conf) = folder(text);
        let mut notes = Vec::new();
        let placed = parse(&conf, text.as_bytes(), &ReadOptions::default(), &mut notes).unwrap();
        assert_eq!(placed.iter().map(|p| p.line).collect::<Vec<_>>(), [4, 6, 8]);
        assert_eq!(placed[0].quaternion, [0.0, 0.0, 0.0, 1.0]);
        assert_eq!(placed[1].quaternion, [0.0, 0.0, 1.0, 0.0]);
        assert_eq!(placed[2].translation, DVec3::new(-1e-3, 2.0, 0.5));
        assert_eq!(notes, ["s.conf: line 7: there is no file reference_cyl, so this reference surface was left out"]);
        let cr = text.replace("\r\n", "\r");
        assert_eq!(parse(&conf, cr.as_bytes(), &ReadOptions::default(), &mut notes).unwrap(), placed);
        let set = open_any(&conf).unwrap();
        let names: Vec<&str> = set.scans.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, ["a", "c", "two words"]);
        assert!(set.notes.iter().any(|n| n.starts_with("a.ply: header line 3, `bye`")), "{:?}", set.notes);
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_within_the_folder() {
        let (folder, conf) = folder("bmesh link.ply 0 0 0 0 0 0 1");
        let elsewhere = tempfile::tempdir().unwrap();
        std::fs::copy(folder.path().join("a.ply"), elsewhere.path().join("secret.ply")).unwrap();
        let link = folder.path().join("link.ply");
        std::os::unix::fs::symlink(elsewhere.path().join("secret.ply"), &link).unwrap();
        let error = open_any(&conf).unwrap_err().to_string();
        assert!(error.contains("line 1: link.ply is a link that leads out of the folder of this file"), "{error}");
        std::fs::remove_file(&link).unwrap();
        std::os::unix::fs::symlink("deep/c.ply", &link).unwrap();
        open_any(&conf).unwrap();
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let case = |text: &str, expected: &str| {
            let found = refused(text);
            assert!(found.starts_with(expected), "found: {found}\nexpected: {expected}");
            examine(text.as_bytes(), &std::env::temp_dir());
        };
        case("bmesh a.ply 0 0 0 0 0 0 1\nbmesh x.ply 0 0 0 0 0 0 1\n", "line 2: there is no file ");
        case("bmesh ../a.ply 0 0 0 0 0 0 1", "line 1: ../a.ply leads out of the folder");
        case("bmesh deep/../../a.ply 0 0 0 0 0 0 1", "line 1: deep/../../a.ply leads out of the folder");
        case("bmesh deep\\..\\..\\a.ply 0 0 0 0 0 0 1", "line 1: deep\\..\\..\\a.ply leads out of the folder");
        case("bmesh /etc/passwd 0 0 0 0 0 0 1", "line 1: /etc/passwd leads out of the folder");
        case("bmesh \\\\server\\a.ply 0 0 0 0 0 0 1", "line 1: \\\\server\\a.ply leads out of the folder");
        case("bmesh C:a.ply 0 0 0 0 0 0 1", "line 1: C:a.ply leads out of the folder");
        case("bmesh a\0.ply 0 0 0 0 0 0 1", "line 1: the name of the file holds a zero byte");
        case("bmesh deep 0 0 0 0 0 0 1", "line 1: there is no file");
        case("bmesh a.ply 0 0 0 0 0 0 0", "line 1: the quaternion is zero");
        case("bmesh a.ply 0 0 nan 0 0 0 1", "line 1: NaN is not a finite number");
        case("bmesh a.ply 0 0 0 0 0 0 1e999", "line 1: inf is not a finite number");
        case(
            "bmesh a.ply 0 0 0 0 0 1",
            "line 1: expected tx ty tz qx qy qz qw at the end of the line, found `a.ply` for tx",
        );
        case("bmesh 0 0 0 0 0 0 1", "line 1: the name of the file is missing");
        case("bmesh", "line 1: expected tx ty tz");
        case("camera 0 0 x 0 0 0 1", "line 1: expected tx ty tz qx qy qz qw at the end of the line, found `x` for tz");
        case("bmsh a.ply 0 0 0 0 0 0 1", "line 1: `bmsh` is unknown");
        case("camera 0 0 0 0 0 0 1\n", "whole file: a line `bmesh` or `mesh` must name a scan");
        case("", "whole file: a line `bmesh` or `mesh` must name a scan");
        case("bmesh s.conf 0 0 0 0 0 0 1", "line 1: s.conf is a list of scans");
        let (_folder, conf) = folder("");
        let error = parse(&conf, b"# \n\xff\n", &ReadOptions::default(), &mut Vec::new()).unwrap_err().to_string();
        assert!(error.ends_with("line 2: this is not text (UTF-8)"), "{error}");
    }

    #[test]
    fn quaternions_of_any_length_turn_alike() {
        for scale in [1e-300, 1e-9, 1.0, 1e9, 1e300] {
            let q = unit([0.1 * scale, -0.2 * scale, 0.3 * scale, 0.4 * scale]).unwrap();
            let length: f64 = q.iter().map(|x| x * x).sum();
            assert!((length - 1.0).abs() < 1e-15);
            assert!((q[1] / q[0] + 2.0).abs() < 1e-15);
        }
        assert_eq!(unit([0.0, -0.0, 0.0, 0.0]), None);
    }
}
