//! Chapters of the C header: what their functions are for, with examples of them, and the index.

use std::sync::LazyLock;

use surfrecon::operations::OPERATIONS;

use crate::root;

/// Functions that belong together.
#[derive(Clone, Copy)]
pub struct Chapter {
    pub title: &'static str,
    /// The files of the C library that it is made of, in the order they have in the header.
    pub files: &'static [&'static str],
    /// The gain for its reader.
    text: &'static str,
    /// Functions of C that call each of its own. A test compiles them.
    examples: &'static str,
}

/// All chapters in the order they have in the header. The file of an operation that no chapter below names is a chapter of its own, behind
/// that of the operation before it.
pub static CHAPTERS: LazyLock<Vec<Chapter>> = LazyLock::new(|| {
    let mut all = BY_HAND.to_vec();
    let mut behind = all.len();
    for operation in OPERATIONS {
        let has = |chapter: &Chapter| chapter.files.contains(&operation.name);
        if let Some(place) = all.iter().position(has) {
            behind = place + 1;
        } else if let Ok(source) = std::fs::read_to_string(root().join(format!("c-api/src/{}.rs", operation.name))) {
            let mut files = vec![operation.name.to_owned()];
            if !operation.report.is_empty() {
                files.insert(0, format!("reports/{}", operation.name));
            }
            if operation.params.is_some() {
                files.insert(0, format!("params/{}", operation.name));
            }
            all.insert(behind, of_its_own(operation.name, &source, files));
            behind += 1;
        }
    }
    all
});

/// The chapter that the first comment of a file declares: a title, a text, and examples in C.
fn of_its_own(name: &str, source: &str, files: Vec<String>) -> Chapter {
    let comment = source.lines().map_while(|line| line.strip_prefix("//!"));
    let comment: Vec<&str> = comment.map(|line| line.strip_prefix(' ').unwrap_or(line)).collect();
    let comment = comment.join("\n");
    let parts = comment
        .strip_prefix("# ")
        .and_then(|rest| rest.split_once("\n\n"))
        .and_then(|(title, rest)| Some((title, rest.split_once("\n\n```c\n")?)))
        .and_then(|(title, (text, rest))| Some((title, text, rest.split_once("\n```")?.0)));
    let Some((title, text, examples)) = parts else {
        panic!(
            "c-api/src/{name}.rs must begin with a comment that is a chapter of the header, as no chapter in chapters.rs names the file: \
             its title (//! # ...), a text, and examples in C between //! ```c and //! ```"
        );
    };
    let kept = |text: &str| -> &'static str { text.to_owned().leak() };
    let files: Vec<&'static str> = files.iter().map(|file| kept(file)).collect();
    Chapter { title: kept(title), files: files.leak(), text: kept(&text.replace('\n', " ")), examples: kept(examples) }
}

/// The chapters that several files make, or that were there first.
const BY_HAND: &[Chapter] = &[
    Chapter {
        title: "The library: errors, threads, memory, progress",
        files: &["version", "status", "last_error", "settings", "context", "allocator", "cancel", "progress"],
        text: "A call that failed says why. Threads, memory and the log are set for the process, or for a context.",
        examples: include_str!("chapters/library.c"),
    },
    Chapter {
        title: "Range images",
        files: &[
            "array",
            "pose",
            "params/triangulate",
            "projection",
            "image",
            "reports/left_out",
            "frame",
            "image_source",
        ],
        text: "A range image is made of samples, of how its pixels see and of where its sensor stood.",
        examples: include_str!("chapters/images.c"),
    },
    Chapter {
        title: "Point clouds and meshes",
        files: &["cloud", "reports/check", "mesh", "bounds", "vertices"],
        text: "Both hand out views that copy nothing, and are made of arrays of any stride.",
        examples: include_str!("chapters/meshes.c"),
    },
    Chapter {
        title: "Reading files",
        files: &["formats", "folder", "params/open", "files"],
        text: "Files are opened as a set of scans. Their samples stay on the disk until a scan is read, merged or aligned.",
        examples: include_str!("chapters/reading.c"),
    },
    Chapter {
        title: "Writing files",
        files: &["params/write", "write", "crs", "provenance"],
        text: "Take srf_mesh_write() for a mesh: the ending of the name chooses the format. srf_mesh_write_from() does the same, and \
               the file says where it is from. srf_mesh_write_ply() and those for GLB, OBJ and STL write one format whatever the name is. \
               srf_merger_write() merges into a file what memory does not hold.",
        examples: include_str!("chapters/writing.c"),
    },
    Chapter {
        title: "Aligning",
        files: &["params/align", "align", "reports/align", "alignment", "reports/snap", "snap"],
        text: "Scans without poses come into one frame. srf_scans_set_pose() places the scans of a set by it, which then merge from \
               the disk.",
        examples: include_str!("chapters/aligning.c"),
    },
    Chapter {
        title: "What to keep, true size and ground",
        files: &["params/plane", "region", "select"],
        text: "Boxes, planes and masks keep or remove samples. Two picked points give the true size, a plane the ground.",
        examples: include_str!("chapters/keeping.c"),
    },
    Chapter {
        title: "Merging",
        files: &["params/merge", "reports/merge", "merger", "merge"],
        text: "Registered scans become one surface. A merger takes scans of all kinds and is run as often as wanted.",
        examples: include_str!("chapters/merging.c"),
    },
    Chapter {
        title: "Sculpting one scan",
        files: &["params/sculpt", "reports/sculpt", "sculpt"],
        text: "One range image becomes few triangles within a tolerance, with a certificate of how far they lie from the samples.",
        examples: include_str!("chapters/sculpting.c"),
    },
    Chapter {
        title: "Quad grids and splines",
        files: &["params/quads", "reports/quads", "quads", "params/spline", "spline"],
        text: "One range image becomes a regular grid of quads, dense where the surface bends, and a smooth surface through it.",
        examples: include_str!("chapters/quads.c"),
    },
    Chapter {
        title: "Surfaces through points",
        files: &["params/reconstruct", "reports/reconstruct", "reconstruct"],
        text: "Scattered points become a surface, closed or open. Their noise is measured and smoothed out.",
        examples: include_str!("chapters/points.c"),
    },
    Chapter {
        title: "Coarse meshes",
        files: &["params/cluster", "reports/cluster", "cluster"],
        text: "A dense mesh, or points, become a mesh of few well-shaped triangles.",
        examples: include_str!("chapters/coarse.c"),
    },
    Chapter {
        title: "Textures from photos",
        files: &["photo", "params/texture", "reports/texture", "texture"],
        text: "A mesh with texture coordinates gets images: colours from photos, normals, heights and occlusion from the detailed surface \
               that it stands for.",
        examples: include_str!("chapters/texturing.c"),
    },
    Chapter {
        title: "The virtual scanner",
        files: &["params/scan", "scan"],
        text: "Range images of any mesh, with the errors that a scanner makes: for tests that know the truth.",
        examples: include_str!("chapters/scanning.c"),
    },
    Chapter {
        title: "Measuring",
        files: &["reports/distance", "measure"],
        text: "How far points or a surface lie from a mesh.",
        examples: include_str!("chapters/measuring.c"),
    },
];

/// Widest line of a banner, the mark of a comment included.
const WIDTH: usize = 110;

impl Chapter {
    /// The functions that its files declare, in their order.
    fn functions(&self) -> Vec<String> {
        let sources = self.files.iter().map(|file| {
            let path = root().join("c-api/src").join(file).with_extension("rs");
            std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
        });
        let names = |source: String| -> Vec<String> {
            let after = source.split("extern \"C\" fn srf_").skip(1);
            after.map(|rest| format!("srf_{}", rest.split('(').next().unwrap_or_default())).collect()
        };
        sources.flat_map(names).collect()
    }

    /// The text before its first function.
    fn banner(&self, number: usize) -> String {
        let head = format!("// ==== {number}. {} ", self.title);
        let mut banner = format!("{head:=<WIDTH$}\n");
        for line in wrapped(self.text, WIDTH - 3) {
            banner += &format!("// {line}\n");
        }
        banner += "//\n";
        for line in self.examples.trim().lines() {
            banner += format!("//     {line}").trim_end();
            banner += "\n";
        }
        banner + "\n"
    }
}

fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.len() + 1 + word.len() <= width => *line += &format!(" {word}"),
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// The mark in the header's first comment that the index takes the place of.
const INDEX: &str = " * (index)\n";

/// The header with the index, and each chapter's banner before its first function.
pub fn with_chapters(header: &str) -> String {
    let mut header = header.to_owned();
    let mut index = String::new();
    for (number, chapter) in (1..).zip(CHAPTERS.iter()) {
        let functions = chapter.functions();
        let first = functions.first().expect("a chapter has functions");
        let lines: Vec<&str> = header.split_inclusive('\n').collect();
        let declares = |line: &&str| !line.starts_with([' ', '/']) && line.contains(&format!("{first}("));
        let declared = lines.iter().position(declares).unwrap_or_else(|| panic!("{first} is not declared"));
        let begin = (0..declared).rev().take_while(|&line| lines[line].starts_with("//")).last().unwrap_or(declared);
        // Structs are prepared first, which says least of a chapter.
        let named = functions.iter().find(|name| !name.ends_with("_init_sized")).unwrap_or(first);
        index += &format!(" *   {number:>2}. {:<48}{named}()\n", chapter.title);
        let banner = chapter.banner(number);
        header = [&lines[..begin], &[banner.as_str()], &lines[begin..]].concat().concat();
    }
    assert!(header.contains(INDEX), "the header's first comment has no place for the index");
    header.replace(INDEX, &index)
}
