//! Scans whose files are damaged: what they held is not part of the surface.

use crate::report::{Warning, WarningKind};
use image::source::ScanSource;

/// More are not described one by one.
const DESCRIBED: usize = 3;

/// Returns a warning that describes damaged scans. `None` if there are none. It knows of scans that this process has read: not of those
/// that another one read, or that an earlier merge left in files.
pub fn warning(sources: &[&dyn ScanSource]) -> Option<Warning> {
    let mut damaged: Vec<String> =
        sources.iter().filter_map(|scan| Some(format!("{} {}", scan.name(), scan.damage()?))).collect();
    let count = damaged.len();
    damaged.truncate(DESCRIBED);
    let more = if count > DESCRIBED { ", and others" } else { "" };
    let text = match count {
        0 => return None,
        1 => damaged.remove(0),
        _ => format!("{count} of {} scans are damaged: {}{more}", sources.len(), damaged.join("; ")),
    };
    Some(Warning { kind: WarningKind::Damaged, text })
}
