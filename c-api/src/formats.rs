//! The files that can be read.

use std::ffi::{CString, c_char};
use std::sync::OnceLock;

use surfrecon::import;

use crate::guard::guard;
use crate::pointer;
use crate::status::{Failure, srf_status, srf_status::*};

/// A format as C sees it.
struct Format {
    name: CString,
    endings: CString,
    is_side_file: bool,
}

fn all() -> &'static [Format] {
    static ALL: OnceLock<Vec<Format>> = OnceLock::new();
    ALL.get_or_init(|| {
        let text = |text: String| CString::new(text).unwrap_or_default();
        let format = |format: &import::Format| Format {
            name: text(format.name.to_owned()),
            endings: text(format.extensions.join(" ")),
            is_side_file: format.is_side_file(),
        };
        import::formats().iter().map(format).collect()
    })
}

/// Number of formats that srf_scans_open() knows.
/// out_count  not NULL
/// returns    SRF_OK, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_format_count(out_count: *mut usize) -> srf_status {
    guard(|| pointer::write("out_count", out_count, all().len()))
}

/// A format that srf_scans_open() knows. Files are recognized by their content. Their endings serve the filters of file dialogues.
/// index             less than the number of formats
/// out_name          receives its name for people, static text. Not NULL
/// out_endings       receives the usual endings of names, in lower case, without the dot, a blank between two, static text. NULL if not
///                   wanted
/// out_is_side_file  receives 0 for files that hold scans. 1 for those that list, place or describe scans of other files. NULL if not
///                   wanted
/// returns           SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_format(
    index: usize,
    out_name: *mut *const c_char,
    out_endings: *mut *const c_char,
    out_is_side_file: *mut u32,
) -> srf_status {
    guard(|| {
        pointer::writable("out_name", out_name)?;
        let formats = all();
        let format = formats.get(index).ok_or_else(|| {
            let text = format!("index must be < {}, the number of formats, got {index}", formats.len());
            Failure::new(SRF_ERR_PARAMETER, text)
        })?;
        if !out_endings.is_null() {
            pointer::write("out_endings", out_endings, format.endings.as_ptr())?;
        }
        if !out_is_side_file.is_null() {
            pointer::write("out_is_side_file", out_is_side_file, u32::from(format.is_side_file))?;
        }
        pointer::write("out_name", out_name, format.name.as_ptr())
    })
}
