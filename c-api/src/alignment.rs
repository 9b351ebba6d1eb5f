//! The result of an alignment.

use std::ffi::{CString, c_char};

use surfrecon::align::AlignReport;
use surfrecon::reports::Report;

use crate::array::{self, srf_array};
use crate::files::at;
use crate::guard::guard;
use crate::handle::{self, handle};
use crate::reports::align::{srf_align_report, srf_aligned_pair, srf_aligned_scan};
use crate::status::srf_status;
use crate::text::c_text;
use crate::{pointer, report};

/// The result, with texts as C wants them.
pub struct Aligned {
    report: AlignReport,
    reasons: Vec<CString>,
    messages: Vec<CString>,
    lines: Vec<CString>,
    /// By how much the turntable was turned, NaN where that is not known.
    angles: Vec<f64>,
}

impl From<AlignReport> for Aligned {
    fn from(report: AlignReport) -> Self {
        Aligned {
            reasons: report.scans.iter().map(|scan| c_text(&scan.reason)).collect(),
            messages: report.messages.iter().map(|message| c_text(message)).collect(),
            lines: report.lines().iter().map(|line| c_text(line)).collect(),
            angles: report.turntable.iter().flat_map(|table| &table.angles).map(|a| a.unwrap_or(f64::NAN)).collect(),
            report,
        }
    }
}

/// The result of an alignment: the poses and how sure they are. Released with srf_alignment_free().
#[allow(non_camel_case_types)]
pub struct srf_alignment {
    _opaque: [u8; 0],
}

handle!(srf_alignment, Aligned);

/// Releases what an alignment found, with its texts.
/// alignment  NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_free(alignment: *mut srf_alignment) -> srf_status {
    guard(|| handle::free("alignment", alignment))
}

/// The figures of an alignment. srf_alignment_line() gives as many lines as there are scans and messages, and one more.
/// alignment   not NULL
/// out_report  initialized by srf_align_report_init(). Not NULL
/// returns     SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_report(
    alignment: *const srf_alignment,
    out_report: *mut srf_align_report,
) -> srf_status {
    guard(|| report::write("out_report", out_report, handle::get("alignment", alignment)?.report.values()))
}

/// The figures of a scan that was aligned.
/// alignment  not NULL
/// index      number of the scan, in the order of adding
/// out_scan   initialized by srf_aligned_scan_init(). Not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_scan(
    alignment: *const srf_alignment,
    index: usize,
    out_scan: *mut srf_aligned_scan,
) -> srf_status {
    guard(|| {
        let aligned = handle::get("alignment", alignment)?;
        report::write("out_scan", out_scan, at(&aligned.report.scans, index)?.values())
    })
}

/// The figures of a pair of scans. Pairs that are not listed have nothing in common.
/// alignment  not NULL
/// index      less than pairs_count of the report. Pairs are listed by their scans' numbers
/// out_pair   initialized by srf_aligned_pair_init(). Not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_pair(
    alignment: *const srf_alignment,
    index: usize,
    out_pair: *mut srf_aligned_pair,
) -> srf_status {
    guard(|| {
        let aligned = handle::get("alignment", alignment)?;
        report::write("out_pair", out_pair, at(&aligned.report.pairs, index)?.values())
    })
}

/// The turntable that the object stood on.
/// alignment      not NULL
/// out_found      receives 1, or 0 where there was none or its axis was not found: then nothing else is written. Not NULL
/// out_point      room for 3 doubles: a point of its axis, in the frame that the scans were taken in. NULL if not wanted
/// out_direction  room for 3 doubles: the unit direction of its axis. NULL if not wanted
/// out_angles     receives a view that stays until the alignment is freed, an SRF_TYPE_F64 a scan: by how much it was turned then, from 0 to
///                2 pi, counter-clockwise where the axis points to the viewer. 0 at the first scan that is placed, NaN at those that
///                are not. NULL if not wanted
/// returns        SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_turntable(
    alignment: *const srf_alignment,
    out_found: *mut u32,
    out_point: *mut f64,
    out_direction: *mut f64,
    out_angles: *mut srf_array,
) -> srf_status {
    guard(|| {
        pointer::writable("out_found", out_found)?;
        let aligned = handle::get("alignment", alignment)?;
        let Some(table) = &aligned.report.turntable else { return pointer::write("out_found", out_found, 0) };
        let numbers =
            [("out_point", out_point, table.axis.point), ("out_direction", out_direction, table.axis.direction)];
        for (name, out, value) in numbers.into_iter().filter(|(_, out, _)| !out.is_null()) {
            pointer::copy_out(name, out, &value.to_array())?;
        }
        if !out_angles.is_null() {
            pointer::write("out_angles", out_angles, array::values(&aligned.angles))?;
        }
        pointer::write("out_found", out_found, 1)
    })
}

/// Why a scan is not placed, and what to do.
/// alignment   not NULL
/// index       number of the scan, in the order of adding
/// out_reason  receives a text that stays until the alignment is freed, empty for a scan that is placed. Not NULL
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_reason(
    alignment: *const srf_alignment,
    index: usize,
    out_reason: *mut *const c_char,
) -> srf_status {
    guard(|| {
        let aligned = handle::get("alignment", alignment)?;
        pointer::write("out_reason", out_reason, at(&aligned.reasons, index)?.as_ptr())
    })
}

/// A sentence on the whole that a person should know.
/// alignment    not NULL
/// index        less than messages_count of the report
/// out_message  receives a text that stays until the alignment is freed, on SRF_OK only. Not NULL
/// returns      SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_message(
    alignment: *const srf_alignment,
    index: usize,
    out_message: *mut *const c_char,
) -> srf_status {
    guard(|| {
        let aligned = handle::get("alignment", alignment)?;
        pointer::write("out_message", out_message, at(&aligned.messages, index)?.as_ptr())
    })
}

/// A line for logs: first the whole, then the messages, then each scan.
/// alignment  not NULL
/// index      less than scans_count + messages_count + 1 of the report
/// out_line   receives a text that stays until the alignment is freed, on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_line(
    alignment: *const srf_alignment,
    index: usize,
    out_line: *mut *const c_char,
) -> srf_status {
    guard(|| {
        let aligned = handle::get("alignment", alignment)?;
        pointer::write("out_line", out_line, at(&aligned.lines, index)?.as_ptr())
    })
}
