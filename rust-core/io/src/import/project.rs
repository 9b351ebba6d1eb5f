//! Lists of placed meshes: MeshLab's projects (`.mlp`) and alignments (`.aln`), and folders of scans.
//!
//! Files lie in the folder of the list or below it. Names that lead out of it are refused unless the options allow it.

use std::path::Path;
use std::sync::Arc;

use glam::DAffine3;
use roxmltree::{Document, Node, ParsingOptions};

use super::options::ReadOptions;
use super::set::{OpenNamed, ScanSet};
use super::text::{Lines, lines_of};
use super::{conf, file, pose};
use base::error::{Error, Result, known_as};
use base::progress::Progress;

/// Longest project: some kilobytes a scan.
const LONGEST: u64 = 64 << 20;

/// Most parts of a project's XML.
const MOST_NODES: u32 = 1 << 20;

/// A file that a list places.
pub(super) struct Placed {
    line: usize,
    name: String,
    label: Option<String>,
    pose: DAffine3,
}

/// Whether a file that starts like this is a project.
pub(super) fn sniff_mlp(start: &[u8]) -> bool {
    let text = file::start_of_text(start);
    text.trim_start().starts_with('<') && (text.contains("<MeshLabProject") || text.contains("MeshLabDocument"))
}

/// Whether a file that starts like this is an alignment: a count, a name, a line `#`.
pub(super) fn sniff_aln(start: &[u8]) -> bool {
    let text = file::start_of_text(start);
    let mut lines = lines_of(&text).map(str::trim);
    let count = lines.next().is_some_and(|line| line.parse::<u32>().is_ok());
    count && lines.next().is_some_and(|line| !line.is_empty()) && lines.next() == Some("#")
}

/// Opens the meshes of a project.
pub(super) fn open_mlp(
    path: &Path,
    options: &Arc<ReadOptions>,
    open_named: OpenNamed,
    progress: &Progress<'_>,
) -> Result<ScanSet> {
    let (_, length) = file::open(path)?;
    if length > LONGEST {
        return Err(Error::format(
            path,
            "whole file",
            format!("{length} bytes are more than a project may have, {LONGEST}"),
        ));
    }
    resolve(path, parse_mlp(&file::read(path)?, path)?, options, open_named, progress)
}

pub(super) fn parse_mlp(bytes: &[u8], path: &Path) -> Result<Vec<Placed>> {
    let text = std::str::from_utf8(bytes).map_err(|_| Error::format(path, "whole file", "this is not text (UTF-8)"))?;
    // The document type that MeshLab writes declares nothing; entities are refused.
    let parsing = ParsingOptions { allow_dtd: true, nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, parsing)
        .map_err(|e| Error::format(path, format!("line {}", e.pos().row), e.to_string()))?;
    if text.contains("<!ENTITY") {
        return Err(Error::format(path, "whole file", "it declares entities, which no project needs"));
    }
    let mut placed = Vec::new();
    for mesh in document.descendants().filter(|node| node.has_tag_name("MLMesh")) {
        let line = line_of(&document, mesh);
        let fail = |problem: String| Error::format(path, format!("line {line}"), problem);
        let name = mesh.attribute("filename").ok_or_else(|| fail("a mesh must have a `filename`".to_owned()))?;
        let matrix = mesh.children().find(|node| node.has_tag_name("MLMatrix44"));
        let pose = match matrix.and_then(|node| node.text()) {
            Some(text) => pose::parse(text.as_bytes()).map_err(fail)?,
            None => DAffine3::IDENTITY,
        };
        let label = mesh.attribute("label").map(|label| label.strip_suffix(".ply").unwrap_or(label).to_owned());
        placed.push(Placed { line, name: name.to_owned(), label, pose });
    }
    if placed.is_empty() {
        return Err(Error::format(path, "whole file", "an `MLMesh` must name a mesh"));
    }
    Ok(placed)
}

fn line_of(document: &Document<'_>, node: Node<'_, '_>) -> usize {
    document.text_pos_at(node.range().start).row as usize
}

/// Opens the meshes of an alignment.
pub(super) fn open_aln(
    path: &Path,
    options: &Arc<ReadOptions>,
    open_named: OpenNamed,
    progress: &Progress<'_>,
) -> Result<ScanSet> {
    let (file, length) = file::open(path)?;
    resolve(path, parse_aln(Lines::new(file, length, path))?, options, open_named, progress)
}

pub(super) fn parse_aln(mut lines: Lines<'_>) -> Result<Vec<Placed>> {
    lines.expect_line("the number of meshes")?;
    let count = lines.count("the number of meshes")?;
    let mut placed = Vec::new();
    for _ in 0..count {
        if !lines.next_content()? {
            return Err(lines.ends("the name of a mesh"));
        }
        let name = String::from_utf8_lossy(lines.rest()).trim().to_owned();
        let line = lines.number as usize;
        loop {
            lines.expect_line("a line `#`")?;
            if lines.rest().trim_ascii_start().starts_with(b"#") {
                break;
            }
        }
        let mut rows = [0.0; 16];
        for row in rows.chunks_exact_mut(4) {
            lines.expect_line("a row of a 4 x 4 matrix")?;
            for value in row {
                *value = lines.f64("a number of a 4 x 4 matrix")?;
            }
        }
        let pose = pose::from_rows(&rows).map_err(|problem| lines.fail(problem))?;
        placed.push(Placed { line, name, label: None, pose });
    }
    if placed.is_empty() {
        return Err(lines.fail("it must name a mesh"));
    }
    Ok(placed)
}

/// Finds the files and opens each.
fn resolve(
    list: &Path,
    placed: Vec<Placed>,
    options: &Arc<ReadOptions>,
    open_named: OpenNamed,
    progress: &Progress<'_>,
) -> Result<ScanSet> {
    let folder = list.parent().unwrap_or(Path::new(""));
    let mut found = Vec::with_capacity(placed.len());
    let mut missing: Vec<&str> = Vec::new();
    for one in &placed {
        let path = conf::named(folder, &one.name, options)
            .map_err(|problem| Error::format(list, format!("line {}", one.line), problem))?;
        if !file::is_file(&path) {
            missing.push(&one.name);
        }
        found.push(path);
    }
    if !missing.is_empty() {
        let shown = missing[..missing.len().min(10)].join(", ");
        let more = if missing.len() > 10 { ", ..." } else { "" };
        let problem = format!(
            "{} of {} files are missing: {shown}{more}. Put them into {} or take them out of the list.",
            missing.len(),
            placed.len(),
            known_as(if folder.as_os_str().is_empty() { Path::new(".") } else { folder })
        );
        return Err(Error::format(list, "whole file", problem));
    }
    let mut set = ScanSet::default();
    for (one, path) in placed.into_iter().zip(found) {
        progress.check()?;
        let mut scan = open_named(list, one.line, &path, options, &mut set.notes)?;
        scan.world_from_sensor = one.pose;
        if let Some(label) = one.label.filter(|label| !label.is_empty() && label.len() < 200) {
            scan.name = label;
        }
        set.scans.push(scan);
    }
    Ok(set)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::open;
    use glam::DVec3;

    const POINT: &str = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
        end_header\n0 0 0\n";
    const MLP: &str = "<!DOCTYPE MeshLabDocument>\n<MeshLabProject>\n <MeshGroup>\n  <MLMesh label=\"Front\" filename=\"a.ply\">\n\
        <MLMatrix44>\n0 -1 0 5 \n1 0 0 6 \n0 0 1 7 \n0 0 0 1 \n</MLMatrix44>\n  </MLMesh>\n\
        <MLMesh filename=\"deep/b.ply\"/></MeshGroup>\n</MeshLabProject>\n";
    const ALN: &str =
        "2\na.ply\n#\n0 -1 0 5\n1 0 0 6\n0 0 1 7\n0 0 0 1\ndeep/b.ply\r\n#\r\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n0\n";

    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("deep")).unwrap();
        for name in ["a.ply", "deep/b.ply"] {
            std::fs::write(folder.path().join(name), POINT).unwrap();
        }
        folder
    }

    #[test]
    fn both_lists_place_their_meshes() {
        for (name, text, label) in [("s.mlp", MLP, "Front"), ("s.aln", ALN, "a")] {
            let folder = folder();
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            for path in [path.as_path(), folder.path()] {
                let set = open(path).unwrap();
                assert_eq!(set.scans.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), [label, "b"]);
                assert_eq!(set.scans[0].world_from_sensor.transform_point3(DVec3::X), DVec3::new(5.0, 7.0, 7.0));
                assert_eq!(set.scans[1].world_from_sensor, DAffine3::IDENTITY);
            }
            for end in 0..text.len() {
                std::fs::write(&path, &text[..end]).unwrap();
                let _ = open(&path);
            }
        }
    }

    #[test]
    fn notes_of_other_programs_are_no_lists() {
        let folder = folder();
        std::fs::write(folder.path().join("a.ply.json"), "{\"program\": \"another\", \"frames\": []}").unwrap();
        assert_eq!(open(folder.path()).unwrap().scans.len(), 1);
        let error = open(&folder.path().join("a.ply.json")).unwrap_err().to_string();
        assert!(error.contains("a.ply.json"), "{error}");
    }

    #[test]
    fn what_is_wrong_says_where() {
        let folder = folder();
        let case = |name: &str, text: String, problem: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            let error = open(&path).unwrap_err().to_string();
            assert!(error.contains(problem), "{error}");
        };
        case("s.mlp", MLP.replace("a.ply", "x.ply"), "whole file: 1 of 2 files are missing: x.ply. Put them into");
        case("s.mlp", MLP.replace("a.ply", "../a.ply"), "line 4: ../a.ply leads out of the folder");
        case("s.mlp", MLP.replace("0 -1 0 5", "0 -2 0 5"), "line 4: the matrix is not a rigid transform");
        case("s.mlp", MLP.replace("0 -1 0 5", "0 -1 5"), "line 4: a pose must be a 4 x 4 matrix, found 15 numbers");
        case("s.mlp", MLP.replace("</MeshGroup>", ""), "line 13: expected 'MeshGroup' tag");
        case("s.mlp", MLP.replace("MLMesh", "Mesh"), "an `MLMesh` must name a mesh");
        case("s.mlp", MLP.replace("a.ply", "s.mlp"), "line 4: s.mlp is a list of scans");
        case("s.aln", ALN.replace("a.ply", "/etc/passwd"), "line 2: /etc/passwd leads out of the folder");
        case(
            "s.aln",
            ALN.replace("0 0 1 7", "0 0 1"),
            "line 6: expected a number of a 4 x 4 matrix, but the line ends",
        );
        case("s.aln", ALN.replacen('2', "99999999", 1), "expected");
        let error = open(folder.path()).unwrap_err().to_string();
        assert!(error.contains("several lists of scans (s.aln, s.mlp): choose one of them"), "{error}");
        let empty = tempfile::tempdir().unwrap();
        assert!(open(empty.path()).unwrap_err().to_string().contains("there is no scan in this folder: names of"));
    }

    #[test]
    fn entities_are_not_expanded() {
        let mut bomb = "<!DOCTYPE MeshLabDocument [<!ENTITY a \"aaaaaaaaaa\">".to_owned();
        for (name, of) in ["b", "c", "d", "e", "f", "g", "h", "i"].iter().zip(["a", "b", "c", "d", "e", "f", "g", "h"])
        {
            bomb += &format!("<!ENTITY {name} \"{}\">", format!("&{of};").repeat(10));
        }
        bomb += "]><MeshLabProject><MLMesh filename=\"&i;\"/></MeshLabProject>";
        let error = parse_mlp(bomb.as_bytes(), Path::new("s.mlp")).err().unwrap().to_string();
        assert!(error.starts_with("s.mlp: "), "{error}");
    }
}
