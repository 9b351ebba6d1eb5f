//! The options that the caller asked for, and what layouts say of them alike.

use std::sync::Arc;

use super::super::camera;
use super::super::options::ReadOptions;
use super::store::Store;
use base::error::{Error, Result};
use base::progress::Progress;
use image::frame::Camera;

/// The options that the caller asked for.
pub(super) struct Asked<'a, 'p> {
    pub(super) options: &'a Arc<ReadOptions>,
    pub(super) progress: &'a Progress<'p>,
    /// Whether photos are asked for, which need no depths, and not scans.
    pub(super) photos: bool,
}

impl Asked<'_, '_> {
    /// The camera of a layout that has none in its files: the caller's, else the error that says how to give it.
    pub(super) fn camera(&self, store: &Store, layout: &str, usual: &str) -> Result<Camera> {
        self.options.camera.ok_or_else(|| {
            let problem = format!(
                "this recording of {layout} does not say its camera. Give it as camera = (fx, fy, cx, cy), or put a \
                    camera.json with fx, fy, cx, cy into the folder{usual}."
            );
            Error::format(&store.path, "camera", problem)
        })
    }

    /// The camera that a file at the top of the store says: of several that of depth, by its name, before that of colour.
    pub(super) fn camera_of(&self, store: &Store) -> Result<Option<Camera>> {
        let is_one = |name: &&str| {
            let lower = name.to_ascii_lowercase();
            (lower.ends_with(".json") || lower.ends_with(".txt")) && (lower.contains("cam") || lower.contains("intrin"))
        };
        let mut names: Vec<&str> = store.top().filter(is_one).collect();
        names.sort_by_key(|name| {
            let lower = name.to_ascii_lowercase();
            let of_colour = ["color", "colour", "rgb"].iter().any(|word| lower.contains(word));
            (!lower.contains("depth"), of_colour)
        });
        let mut unknown = None;
        for name in names {
            let text = store.text(name, self.progress)?;
            if camera::sniff(text.as_bytes()) {
                return camera::parse(text.as_bytes(), &store.path_of(name)).map(Some);
            }
            let lower = name.to_ascii_lowercase();
            if lower.starts_with("camera.") || lower.contains("intrinsic") {
                unknown.get_or_insert((name, text));
            }
        }
        match unknown {
            // A file that is called so and can't be read must not be replaced by a guess.
            Some((name, text)) if self.options.camera.is_none() => {
                camera::parse(text.as_bytes(), &store.path_of(name)).map(Some)
            }
            _ => Ok(None),
        }
    }
}

/// A note of how many frames something holds for, or `None` for none.
pub(super) fn counted(count: usize, of: usize, what: &str) -> Option<String> {
    (count > 0).then(|| format!("{count} of {of} frames {what}"))
}
