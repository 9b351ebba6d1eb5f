//! Coordinate reference systems that files can't tell.

use std::path::Path;

use super::{Holding, ending_for};
use base::error::known_as;
use base::log::{self, Level};
use mesh::Crs;

/// The formats that say the system, of what they hold.
fn saying(holding: Holding) -> &'static [&'static str] {
    match holding {
        Holding::Mesh => &["ply", "glb", "obj"],
        Holding::Quads => &["ply", "obj"],
        Holding::Points => &["ply"],
        Holding::Image | Holding::Images => &["e57"],
    }
}

/// A note for people where a file of that name would not say which coordinate reference system its content lies in. `None` if it does, or
/// there is none.
pub fn crs_note(path: &Path, holding: Holding, crs: Option<&Crs>) -> Option<String> {
    let (crs, ending) = (crs?, ending_for(path, holding).ok()?);
    let saying = saying(holding);
    if saying.contains(&ending) {
        return None;
    }
    let remedy = saying.join(", .");
    Some(format!(
        ".{ending} has no place for the coordinate reference system, {crs}, which is left out: write .{remedy} to keep it"
    ))
}

/// Tells the log of a file that was written what [`crs_note`] says of it.
pub fn tell_left_out(path: &Path, holding: Holding, crs: Option<&Crs>) {
    if let Some(note) = crs_note(path, holding, crs) {
        log::tell(Level::Warning, &format!("{}: {note}", known_as(path)));
    }
}

#[cfg(test)]
mod tests;
