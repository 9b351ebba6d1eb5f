//! The C header, from the comments of the C library's files.

use std::path::Path;

use crate::chapters::{CHAPTERS, with_chapters};
use crate::{compare, root};

/// The header with a macro behind each function that initializes a struct: it adds the size that the header gives the struct,
/// which a library of another version can't know.
fn with_macros(header: &str) -> String {
    let (mut all, mut after) = (String::new(), String::new());
    for line in header.split_inclusive('\n') {
        all.push_str(line);
        if let Some((name, arguments)) = line.trim_start_matches("srf_status ").split_once("_init_sized(") {
            let (of, argument) = arguments.split_once(" *").expect("a pointer comes first");
            let argument = argument.split(',').next().expect("its name");
            after = format!("#define {name}_init({argument}) {name}_init_sized(({argument}), sizeof({of}))\n");
        }
        if line.trim_end().ends_with(");") {
            all.push_str(&std::mem::take(&mut after));
        }
    }
    all
}

/// The enums that a file declares.
fn enums(file: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let names = text.lines().filter_map(|line| line.strip_prefix("pub enum ")?.split_once(' '));
    names.map(|(name, _)| name.to_owned()).collect()
}

#[test]
fn header() {
    // It is made of them, too; tests run side by side.
    crate::c_params::structs();
    crate::c_reports::structs();
    crate::versions();
    let library = root().join("c-api");
    let mut config = cbindgen::Config::from_file(library.join("cbindgen.toml")).expect("cbindgen.toml");
    let files = CHAPTERS.iter().flat_map(|chapter| chapter.files);
    let files: Vec<_> = files.map(|file| library.join("src").join(file).with_extension("rs")).collect();
    // Enums cross the border as integers, so that no function names them, and cbindgen must be told of them.
    config.export.include = files.iter().flat_map(|file| enums(file)).collect();
    let mut builder = cbindgen::Builder::new().with_config(config);
    for file in &files {
        builder = builder.with_src(file);
    }
    let mut header = Vec::new();
    builder.generate().expect("cbindgen").write(&mut header);
    let header = with_macros(&with_chapters(&String::from_utf8(header).expect("the header is text")));
    for name in constants(&header) {
        assert!(
            header.contains(&format!("  {name} = ")),
            "comments of the header name {name}, which it does not declare"
        );
    }
    compare("c-api/include/surfrecon.h", &header);
}

/// Values of enums that comments name as defaults.
fn constants(header: &str) -> Vec<&str> {
    let joined = header.split(", default SRF_").skip(1);
    let name = |rest: &str| {
        rest.find(|c: char| !c.is_ascii_uppercase() && !c.is_ascii_digit() && c != '_').unwrap_or(rest.len())
    };
    let starts = joined.map(|rest| rest.as_ptr() as usize - header.as_ptr() as usize - "SRF_".len());
    starts.map(|start| &header[start..start + "SRF_".len() + name(&header[start + "SRF_".len()..])]).collect()
}
