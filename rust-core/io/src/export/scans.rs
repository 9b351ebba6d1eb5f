//! Range images seen from a point as terrestrial scanners' files: PTX and E57, grid, pose, colour and intensity kept.

use std::io::{BufWriter, Write};
use std::path::Path;

use ::e57::{
    E57Writer, Extension, Quaternion, Record, RecordDataType, RecordName, RecordValue, Transform, Translation,
};
use glam::{DAffine3, DQuat, DVec3};

use super::atomic::{write_atomically, write_atomically_back_and_forth};
use super::provenance::{E57_NAMESPACE, Provenance};
use base::error::{Error, Result};
use base::progress::Progress;
use image::range_image::{Projection, RangeImage, Viewing};
use mesh::Crs;

/// Unit of a quaternion's entries: multiples of 2^-48, a turn that moves a point by 4e-15 of its distance.
const EXACT: f64 = (1_u64 << 48) as f64;

/// End of the root of E57's XML.
const E57_END: &str = "</e57Root>";

/// The point that the rays start from, in the image's frame.
fn eye(image: &RangeImage, name: &str) -> Result<DVec3> {
    match image.projection() {
        Projection::Pinhole { .. } | Projection::Spherical { .. } => Ok(DVec3::ZERO),
        Projection::PointGrid(Viewing::From(eye)) => Ok(*eye),
        Projection::Orthographic { .. } | Projection::PointGrid(Viewing::Parallel(_)) => Err(Error::input(format!(
            "{name}: its rays are parallel, and PTX and E57 hold scans seen from a point: write Stanford range images (.conf)"
        ))),
    }
}

/// The system's answer that lies beneath an error, or the error's own words.
fn answer(error: &(dyn std::error::Error + 'static)) -> std::io::Error {
    let mut beneath = std::iter::successors(Some(error), |error| error.source());
    let number = beneath.find_map(|error| error.downcast_ref::<std::io::Error>()?.raw_os_error());
    number.map_or_else(|| std::io::Error::other(error.to_string()), std::io::Error::from_raw_os_error)
}

/// The point of a pixel seen from the frame's origin, in single precision like the grids it comes from.
fn point(image: &RangeImage, pixel: usize, eye: DVec3) -> Option<[f32; 3]> {
    image.is_valid(pixel).then(|| (image.point_in_sensor(pixel) - eye).as_vec3().to_array())
}

fn checked(images: &[&RangeImage]) -> Result<Vec<(DVec3, DAffine3)>> {
    if images.is_empty() {
        return Err(Error::input("there is no range image to write"));
    }
    let place = |(number, image): (usize, &&RangeImage)| {
        let name = if image.name.is_empty() { format!("image {number}") } else { image.name.clone() };
        image.validate()?;
        if image.is_empty() {
            return Err(Error::input(format!("{name}: the image has no pixels, so leave it out")));
        }
        if !image.world_from_sensor.is_finite() {
            return Err(Error::input(format!("{name}: the pose must be finite")));
        }
        let eye = eye(image, &name)?;
        Ok((eye, image.world_from_sensor * DAffine3::from_translation(eye)))
    };
    images.iter().enumerate().map(place).collect()
}

/// Writes range images as PTX, one scan after the other, the frame of each moved to where its rays start. Points are in single precision
/// with the fewest digits that read back as the same number, poses in double. Confidence has no place in the format, nor has a coordinate
/// reference system. With colours but no intensities 0.5 is written for these.
///
/// # Errors
/// No image, an image without pixels, with parallel rays or attributes of the wrong length. [`Error::Io`]. [`Error::Cancelled`]. Then no
/// file is left, and one that was there is untouched.
pub fn write_ptx(path: &Path, images: &[&RangeImage], progress: &Progress<'_>) -> Result<()> {
    let places = checked(images)?;
    progress.plan(&[("writing", 1.0)]);
    progress.stage(0, images.iter().map(|image| image.len() as u64).sum());
    write_atomically(path, progress, |file| {
        let io = |e| Error::io(path, e);
        let mut out = BufWriter::with_capacity(1 << 18, file);
        for (image, (eye, pose)) in images.iter().zip(&places) {
            let (m, t) = (pose.matrix3, pose.translation);
            writeln!(out, "{}\n{}\n{} {} {}", image.cols(), image.rows(), t.x, t.y, t.z).map_err(io)?;
            let axes = [m.x_axis, m.y_axis, m.z_axis];
            for axis in axes {
                writeln!(out, "{} {} {}", axis.x, axis.y, axis.z).map_err(io)?;
            }
            for axis in axes {
                writeln!(out, "{} {} {} 0", axis.x, axis.y, axis.z).map_err(io)?;
            }
            writeln!(out, "{} {} {} 1", t.x, t.y, t.z).map_err(io)?;
            for col in 0..image.cols() {
                for row in 0..image.rows() {
                    let pixel = row * image.cols() + col;
                    let sample = point(image, pixel, *eye);
                    let [x, y, z] = sample.unwrap_or_default();
                    write!(out, "{x} {y} {z}").map_err(io)?;
                    if image.intensity.is_some() || image.colour.is_some() {
                        let intensity = image.intensity.as_ref().map_or(0.5, |all| all[pixel]);
                        write!(out, " {intensity}").map_err(io)?;
                    }
                    if let Some(colour) = &image.colour {
                        let [r, g, b, _] = colour[pixel];
                        write!(out, " {r} {g} {b}").map_err(io)?;
                    }
                    out.write_all(b"\n").map_err(io)?;
                }
                progress.advance(image.rows() as u64)?;
            }
        }
        out.flush().map_err(io)
    })
}

/// Writes range images as structured scans of an E57 file: valid pixels with their row and column, the frame of each moved to where its
/// rays start. Colours have 8 bits, intensities single precision. Invalid pixels are left out. The bounds of the indices keep the grid's
/// size. Confidence has no place in the format. The coordinate reference system of the images' world is the file's.
///
/// # Errors
/// As [`write_ptx`]. Images of different coordinate reference systems.
pub fn write_e57(
    path: &Path,
    images: &[&RangeImage],
    provenance: Option<&Provenance>,
    progress: &Progress<'_>,
) -> Result<()> {
    let places = checked(images)?;
    let said = provenance.map(Provenance::e57_element).transpose()?;
    let crs = Crs::common(images.iter().map(|image| (image.name.as_str(), image.crs.clone())))?;
    progress.plan(&[("writing", 1.0)]);
    progress.stage(0, images.iter().map(|image| image.len() as u64).sum());
    write_atomically_back_and_forth(path, progress, |file| {
        let failed = |e: ::e57::Error| Error::io(path, answer(&e));
        // Names, not random numbers: the same scans make the same file.
        let mut writer = E57Writer::new(file, "{surfrecon}").map_err(failed)?;
        writer.set_coordinate_metadata(crs.as_ref().map(|crs| crs.text().to_owned()));
        for (part, (image, (eye, pose))) in images.iter().zip(&places).enumerate() {
            let index = |name, count: usize| Record {
                name,
                data_type: RecordDataType::Integer { min: 0, max: count as i64 - 1 },
            };
            let mut prototype = vec![
                Record::CARTESIAN_X_F32,
                Record::CARTESIAN_Y_F32,
                Record::CARTESIAN_Z_F32,
                index(RecordName::RowIndex, image.rows()),
                index(RecordName::ColumnIndex, image.cols()),
            ];
            if image.intensity.is_some() {
                let data_type = RecordDataType::Single { min: None, max: None };
                prototype.push(Record { name: RecordName::Intensity, data_type });
            }
            if image.colour.is_some() {
                prototype.extend([Record::COLOR_RED_U8, Record::COLOR_GREEN_U8, Record::COLOR_BLUE_U8]);
            }
            let mut scan = writer.add_pointcloud(&format!("{{surfrecon-{part}}}"), prototype).map_err(failed)?;
            if !image.name.is_empty() {
                scan.set_name(Some(image.name.clone()));
            }
            let (rotation, t) = (DQuat::from_mat3(&pose.matrix3).normalize(), pose.translation);
            // The scalar part is not negative.
            let q = if rotation.w < 0.0 { -rotation } else { rotation };
            // Rounded beyond what a matrix keeps of it: reading and writing again gives the same digits.
            let q = DQuat::from_array(q.to_array().map(|x| (x * EXACT).round() / EXACT));
            scan.set_transform(Some(Transform {
                rotation: Quaternion { w: q.w, x: q.x, y: q.y, z: q.z },
                translation: Translation { x: t.x, y: t.y, z: t.z },
            }));
            scan.set_index_bounds(Some(::e57::IndexBounds {
                row_min: Some(0),
                row_max: Some(image.rows() as i64 - 1),
                column_min: Some(0),
                column_max: Some(image.cols() as i64 - 1),
                return_min: None,
                return_max: None,
            }));
            for row in 0..image.rows() {
                for col in 0..image.cols() {
                    let pixel = row * image.cols() + col;
                    let Some(sample) = point(image, pixel, *eye) else { continue };
                    let mut values: Vec<RecordValue> = Vec::with_capacity(9);
                    values.extend(sample.map(RecordValue::Single));
                    values.extend([row as i64, col as i64].map(RecordValue::Integer));
                    values.extend(image.intensity.as_ref().map(|all| RecordValue::Single(all[pixel])));
                    if let Some(colour) = &image.colour {
                        let [r, g, b, _] = colour[pixel].map(|c| RecordValue::Integer(c.into()));
                        values.extend([r, g, b]);
                    }
                    scan.add_point(values).map_err(failed)?;
                }
                progress.advance(image.cols() as u64)?;
            }
            scan.finalize().map_err(failed)?;
        }
        let Some(said) = &said else { return writer.finalize().map_err(failed) };
        writer.register_extension(Extension::new("surfrecon", E57_NAMESPACE)).map_err(failed)?;
        let with_it = |mut xml: String| {
            // Names may have the words of it, too: the last is the root's.
            let end = xml.rfind(E57_END).expect("what ends the root");
            xml.insert_str(end, said);
            Ok(xml)
        };
        writer.finalize_customized_xml(with_it).map_err(failed)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::{self, Content};

    type Write = fn(&Path, &[&RangeImage], &Progress<'_>) -> Result<()>;

    fn plain_e57(path: &Path, images: &[&RangeImage], progress: &Progress<'_>) -> Result<()> {
        write_e57(path, images, None, progress)
    }

    fn images() -> Vec<RangeImage> {
        let turn = DAffine3::from_rotation_translation(DQuat::from_rotation_z(0.5), DVec3::new(4e6 + 0.25, 5e6, 100.0));
        let points = |shift: f32| -> Vec<[f32; 3]> {
            (0..12).map(|i| if i % 5 == 2 { [f32::NAN; 3] } else { [i as f32 * 0.1 + shift, 1.0 / 3.0, 5.0] }).collect()
        };
        let mut first = RangeImage::from_points(3, 4, points(0.0), Viewing::From(DVec3::ZERO)).unwrap();
        first.world_from_sensor = turn;
        first.name = "Hall".to_owned();
        first.colour = Some((0..12).map(|i| [i, 255, 0, 255]).collect());
        first.intensity = Some((0..12).map(|i| i as f32 * 0.01).collect());
        let mut second = RangeImage::from_points(4, 3, points(1.0), Viewing::From(DVec3::new(1.0, 0.0, 0.0))).unwrap();
        second.name = "Stairs".to_owned();
        vec![first, second]
    }

    #[test]
    fn written_read_written_is_the_same() {
        for (ending, write) in [("ptx", write_ptx as Write), ("e57", plain_e57)] {
            let folder = tempfile::tempdir().unwrap();
            let [first, second] = ["a", "b"].map(|name| folder.path().join(format!("{name}.{ending}")));
            let images = images();
            write(&first, &images.iter().collect::<Vec<_>>(), &Progress::none()).unwrap();
            let set = import::open(&first).unwrap();
            let read: Vec<RangeImage> = set
                .scans
                .iter()
                .map(|scan| match scan.read().unwrap() {
                    Content::RangeImage(image) => image,
                    other => panic!("{other:?}"),
                })
                .collect();
            for (image, read) in images.iter().zip(&read) {
                assert_eq!((image.rows(), image.cols()), (read.rows(), read.cols()));
                for pixel in 0..image.len() {
                    assert_eq!(image.is_valid(pixel), read.is_valid(pixel));
                    if image.is_valid(pixel) {
                        let apart = image.point_in_world(pixel).distance(read.point_in_world(pixel));
                        assert!(apart < 2e-9 + 1e-7, "{apart}");
                        assert_eq!(image.colour.as_ref().map(|c| c[pixel]), read.colour.as_ref().map(|c| c[pixel]));
                        assert_eq!(
                            image.intensity.as_ref().map(|c| c[pixel]),
                            read.intensity.as_ref().map(|c| c[pixel])
                        );
                        let apart = image.world_from_sensor.transform_point3(image.ray_in_sensor(pixel).0)
                            - read.world_from_sensor.transform_point3(read.ray_in_sensor(pixel).0);
                        assert!(apart.length() < 2e-9, "{apart}");
                    }
                }
            }
            write(&second, &read.iter().collect::<Vec<_>>(), &Progress::none()).unwrap();
            assert!(std::fs::read(&first).unwrap() == std::fs::read(&second).unwrap(), "{ending}");
        }
    }

    #[test]
    fn what_has_no_eye_is_refused() {
        let path = std::env::temp_dir().join("never.ptx");
        let flat = RangeImage::from_points(1, 1, vec![[0.0; 3]], Viewing::ALONG_MINUS_Z).unwrap();
        for write in [write_ptx as Write, plain_e57] {
            let error = write(&path, &[&flat], &Progress::none()).unwrap_err().to_string();
            assert!(error.contains("its rays are parallel"), "{error}");
            assert!(write(&path, &[], &Progress::none()).is_err() && !path.exists());
        }
    }
}
