//! The C header, from the comments of the C library's files.

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

#[test]
fn header() {
    // It is made of them, too; tests run side by side.
    crate::c_params::structs();
    crate::c_reports::structs();
    crate::versions();
    let library = root().join("c-api");
    let config = cbindgen::Config::from_file(library.join("cbindgen.toml")).expect("cbindgen.toml");
    let mut builder = cbindgen::Builder::new().with_config(config);
    for file in CHAPTERS.iter().flat_map(|chapter| chapter.files) {
        builder = builder.with_src(library.join("src").join(file).with_extension("rs"));
    }
    let mut header = Vec::new();
    builder.generate().expect("cbindgen").write(&mut header);
    let header = with_macros(&with_chapters(&String::from_utf8(header).expect("the header is text")));
    compare("c-api/include/surfrecon.h", &header);
}
