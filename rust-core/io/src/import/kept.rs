//! A scan as text, from which another process makes it again: what is in its files stays there.
//!
//! Numbers are written by their bits, since a pose that is rounded is another pose.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DAffine3;
use serde_json::{Value as Json, json};

use super::edits::{Edit, Edits, Placed};
use super::opening::{Taking, listed, open_listed};
use super::options::ReadOptions;
use super::scan::{Begin, FileScan};
use crate::memory_folder::MemoryFolder;
use base::error::{Error, Result, known_as};
use base::params::{Params as _, Value};
use base::progress::Progress;
use image::frame::Camera;
use image::select::{Mask, OrientedBox, Plane, Region, Selection};
use mesh::Crs;

/// All of a scan that is not in its files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kept {
    /// The file that holds the samples. Absolute.
    pub path: PathBuf,
    /// The file or folder that is opened to have the recording that it is a frame of. Absolute.
    pub recording: Option<PathBuf>,
    /// The rest, as JSON.
    pub text: String,
}

impl FileScan {
    /// A record that lets another process that sees the same files make the scan again.
    ///
    /// # Errors
    /// A scan whose file lies in memory.
    pub fn kept(&self) -> Result<Kept> {
        if self._memory.is_some() {
            return Err(Error::input(format!(
                "{} lies in the memory of this process, but a scan is handed to others by the path of its file. \
                    Write the file to a disk first, or hand over what reading the scan gives.",
                known_as(&self.path)
            )));
        }
        let absolute = |path: &Path| std::path::absolute(path).map_err(|error| Error::io(path, error));
        let print = self.recording.as_ref().and_then(|recording| recording.print_of(self.part));
        let told = json!({
            "name": self.name,
            "within": self.within,
            "part": self.part,
            "pose": bits(&self.world_from_sensor.to_cols_array()),
            "begin": [self.begin.byte, self.begin.line],
            "left_crs": self.left_crs,
            "options": options_told(&self.options),
            "edits": self.edits.0.iter().map(edit_told).collect::<Vec<_>>(),
            "frame": print,
        });
        Ok(Kept {
            path: absolute(&self.path)?,
            recording: self.opened.as_deref().map(absolute).transpose()?,
            text: told.to_string(),
        })
    }

    /// The scan that was kept. Of a frame the recording is opened again, unless `known` is a frame of it.
    ///
    /// # Errors
    /// A text that [`FileScan::kept`] did not write. A recording that can't be opened, or lists the frame otherwise now.
    pub fn of_kept(kept: &Kept, known: Option<&FileScan>, progress: &Progress<'_>) -> Result<FileScan> {
        let told: Json = serde_json::from_str(&kept.text).map_err(|_| damaged())?;
        let options = Arc::new(options_of(&told["options"])?);
        let mut scan = FileScan {
            name: told["name"].as_str().ok_or_else(damaged)?.to_owned(),
            within: told["within"].as_str().map(str::to_owned),
            part: whole(&told["part"])? as usize,
            world_from_sensor: pose_of(&told["pose"])?,
            begin: Begin { byte: whole(&told["begin"][0])?, line: whole(&told["begin"][1])? },
            left_crs: told["left_crs"].as_bool().ok_or_else(damaged)?,
            edits: Edits(list(&told["edits"])?.iter().map(edit_of).collect::<Result<_>>()?),
            _memory: MemoryFolder::of(&kept.path),
            ..FileScan::with(&kept.path, &options)
        };
        let Some(opened) = &kept.recording else { return Ok(scan) };
        let print = Some(whole(&told["frame"])?);
        let is_it = |frame: &FileScan| frame.recording.as_ref().is_some_and(|all| all.print_of(scan.part) == print);
        let known = known.filter(|known| known.opened.as_deref() == Some(opened.as_path()) && known.options == options);
        let frame = match known.filter(|known| is_it(known)) {
            Some(known) => known.clone(),
            None => {
                let set = progress.watch(|| {
                    open_listed(&listed(&[opened.as_path()], Taking::default(), progress)?.0, &options, progress)
                })?;
                set.scans.into_iter().find(|frame| frame.part == scan.part && is_it(frame)).ok_or_else(|| {
                    Error::input(format!(
                        "frame {} of {} is no longer listed as it was when it was handed over: open the recording again",
                        scan.name,
                        known_as(opened)
                    ))
                })?
            }
        };
        (scan.recording, scan.opened) = (frame.recording, Some(opened.as_path().into()));
        Ok(scan)
    }
}

fn damaged() -> Error {
    Error::input(
        "this is not what a scan was kept as: it must be handed over by the same version, unchanged. Open the file again.",
    )
}

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|number| number.to_bits()).collect()
}

fn whole(told: &Json) -> Result<u64> {
    told.as_u64().ok_or_else(damaged)
}

fn number(told: &Json) -> Result<f64> {
    whole(told).map(f64::from_bits)
}

fn list(told: &Json) -> Result<&[Json]> {
    told.as_array().map(Vec::as_slice).ok_or_else(damaged)
}

fn numbers<const COUNT: usize>(told: &Json) -> Result<[f64; COUNT]> {
    let numbers: Vec<f64> = list(told)?.iter().map(number).collect::<Result<_>>()?;
    numbers.try_into().map_err(|_| damaged())
}

fn pose_of(told: &Json) -> Result<DAffine3> {
    let pose = DAffine3::from_cols_array(&numbers(told)?);
    if pose.is_finite() { Ok(pose) } else { Err(damaged()) }
}

fn options_told(options: &ReadOptions) -> Json {
    let value = |value| match value {
        Value::Absent => Json::Null,
        Value::Number(number) => json!(number.to_bits()),
        Value::Flag(flag) => json!(flag),
        Value::Choice(name) => json!(name),
    };
    let rows = ReadOptions::rows();
    let given = rows.iter().filter_map(|row| Some((row.name.to_owned(), value(options.get(row.name)?))));
    let camera = options.camera.map(|Camera { focal, centre, size }| json!([bits(&focal), bits(&centre), size]));
    let crs = options.crs.as_ref().map(|crs| json!([crs.text(), crs.is_in_degrees()]));
    json!({ "given": given.collect::<serde_json::Map<_, _>>(), "camera": camera, "crs": crs })
}

fn options_of(told: &Json) -> Result<ReadOptions> {
    let mut options = ReadOptions::default();
    for (name, given) in told["given"].as_object().ok_or_else(damaged)? {
        let value = match given {
            Json::Null => Value::Absent,
            Json::Bool(flag) => Value::Flag(*flag),
            Json::String(choice) => Value::Choice(choice),
            bits => Value::Number(number(bits)?),
        };
        if !options.set(name, value)? {
            return Err(damaged());
        }
    }
    if let [focal, centre, size] = told["camera"].as_array().map_or(&[][..], Vec::as_slice) {
        let size = match size.as_array().map(Vec::as_slice) {
            Some([cols, rows]) => Some([whole(cols)? as usize, whole(rows)? as usize]),
            _ => None,
        };
        options.camera = Some(Camera { focal: numbers(focal)?, centre: numbers(centre)?, size });
    }
    if let [text, degrees] = told["crs"].as_array().map_or(&[][..], Vec::as_slice) {
        let text = text.as_str().ok_or_else(damaged)?;
        options.crs = Some(Crs::new(text)?.with_degrees(degrees.as_bool().ok_or_else(damaged)?));
    }
    options.validate()?;
    Ok(options)
}

fn edit_told(edit: &Edit) -> Json {
    let Placed { selection: Selection { region, keep }, world_from_sensor } = match edit {
        Edit::Scale(scale) => return json!({ "scale": scale.to_bits() }),
        Edit::Select(placed) => placed.as_ref(),
    };
    let region = match region {
        Region::Box(region) => json!({ "box": bits(&region.numbers()) }),
        Region::Below(plane) => json!({ "plane": bits(&plane.numbers()) }),
        Region::Mask(mask) => {
            let marks: String = mask.bits().iter().map(|byte| format!("{byte:02x}")).collect();
            json!({ "size": mask.size(), "marks": marks })
        }
    };
    json!({ "keep": keep, "pose": bits(&world_from_sensor.to_cols_array()), "region": region })
}

fn edit_of(told: &Json) -> Result<Edit> {
    if let Some(scale) = told.get("scale") {
        return number(scale).map(Edit::Scale);
    }
    let region = &told["region"];
    let region = if let Some(region) = region.get("box") {
        Region::Box(OrientedBox::of_numbers(numbers(region)?)?)
    } else if let Some(plane) = region.get("plane") {
        Region::Below(Plane::of_numbers(numbers(plane)?)?)
    } else {
        let size = [whole(&region["size"][0])? as usize, whole(&region["size"][1])? as usize];
        let digits = region["marks"].as_str().ok_or_else(damaged)?.as_bytes();
        let byte = |pair: &[u8]| {
            let text = std::str::from_utf8(pair).map_err(|_| damaged())?;
            u8::from_str_radix(text, 16).map_err(|_| damaged())
        };
        Region::Mask(Mask::of_bits(size, digits.chunks(2).map(byte).collect::<Result<_>>()?)?.into())
    };
    let selection = Selection { region, keep: told["keep"].as_bool().ok_or_else(damaged)? };
    Ok(Edit::Select(Placed { selection, world_from_sensor: pose_of(&told["pose"])? }.into()))
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};
    use image::select::Similarity;

    use super::*;

    /// A scan with all that may be said of one, none of it a short number.
    fn told_much() -> FileScan {
        let mut options = ReadOptions { invalid: Some(-1e300), step: Some(1.0 / 3.0), ..Default::default() };
        options.camera = Some(Camera::sized([500.1, 499.9], [1.0 / 3.0, 240.0], [640, 480]));
        let mut scan = FileScan::with(Path::new("scan.png"), &Arc::new(options));
        scan.world_from_sensor =
            DAffine3::from_rotation_translation(DQuat::from_rotation_y(0.7), DVec3::new(0.1, -1e-300, 4e6));
        (scan.name, scan.part, scan.begin) = ("σ \"1\"".to_owned(), 3, Begin { byte: 1 << 40, line: 7 });
        scan.select(Region::Box(OrientedBox::between(DVec3::splat(-0.1), DVec3::splat(1.0 / 3.0)).unwrap()).kept());
        scan.transform(&Similarity::from_affine(DAffine3::from_scale(DVec3::splat(0.3))).unwrap()).unwrap();
        scan.set_crs(Some(Crs::new("EPSG:25832").unwrap().with_degrees(true)));
        scan.select(Region::Below(Plane::new(DVec3::ONE, DVec3::new(1.0, 2.0, 3.0), 0.1).unwrap()).removed());
        scan.select(
            Region::Mask(
                Mask::of_image(3, 3, &[true, false, true, true, false, false, true, true, true]).unwrap().into(),
            )
            .kept(),
        );
        scan
    }

    #[test]
    fn a_scan_is_made_again_to_the_bit() {
        for scan in [told_much(), FileScan::new(Path::new("plain.ply"))] {
            let kept = scan.kept().unwrap();
            assert!(kept.path.is_absolute());
            let again = FileScan::of_kept(&kept, None, &Progress::none()).unwrap();
            // Debug writes each number as it is.
            assert_eq!(format!("{again:?}"), format!("{:?}", FileScan { path: kept.path.clone(), ..scan }));
            assert_eq!(again.kept().unwrap(), kept);
        }
    }

    #[test]
    fn what_no_scan_was_kept_as_is_refused() {
        let kept = told_much().kept().unwrap();
        let text = &kept.text;
        for (from, to) in
            [("\"part\":3", "\"part\":-3"), ("\"keep\":true", "\"keep\":2"), ("\"size\":[3,3]", "\"size\":[30,3]")]
        {
            assert!(text.contains(from), "{text}");
            let changed = Kept { text: text.replace(from, to), ..kept.clone() };
            assert!(matches!(FileScan::of_kept(&changed, None, &Progress::none()), Err(Error::Input(_))), "{from}");
        }
        for cut in (0..text.len()).filter(|&cut| text.is_char_boundary(cut)) {
            let changed = Kept { text: text[..cut].to_owned(), ..kept.clone() };
            assert!(FileScan::of_kept(&changed, None, &Progress::none()).is_err(), "{cut}");
        }
    }
}
