use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

use super::super::{Content, ReadOptions, open, open_many};
use super::*;

const UTM: &str =
    "PROJCS[\"ETRS89 / UTM zone 32N\",GEOGCS[\"ETRS89\"],UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"25832\"]]";

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Folder(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }
}

/// The system that a file is said to be in, and the notes on it.
fn told(path: &Path) -> (Option<Crs>, Vec<String>) {
    let set = open(path).unwrap();
    (set.scans[0].crs().unwrap(), set.notes)
}

fn text_of(path: &Path) -> Option<String> {
    told(path).0.map(|crs| crs.text().to_owned())
}

/// A directory of GeoTIFF: keys whose values stand in it, then those whose texts lie beside it.
fn directory(keys: &[(u16, u16)], texts: &[(u16, u16, u16)]) -> Vec<u16> {
    let head = [1, 1, 0, (keys.len() + texts.len()) as u16];
    let keys = keys.iter().flat_map(|&(id, value)| [id, 0, 1, value]);
    let texts = texts.iter().flat_map(|&(id, count, at)| [id, IN_TEXT, count, at]);
    head.into_iter().chain(keys).chain(texts).collect()
}

const IN_TEXT: u16 = 34737;

/// Records before the points and, where `behind`, all of them behind the points of a file of version 1.4 with one point.
pub(super) fn las(records: &[(&str, u16, &[u8])], behind: bool) -> Vec<u8> {
    let mut bytes = vec![0; 375];
    let head = if behind { 60 } else { 54 };
    let mut all = Vec::new();
    for (user, id, content) in records {
        let mut record = vec![0; head];
        record[2..2 + user.len()].copy_from_slice(user.as_bytes());
        record[18..20].copy_from_slice(&id.to_le_bytes());
        let length = (content.len() as u64).to_le_bytes();
        record[20..if behind { 28 } else { 22 }].copy_from_slice(&length[..if behind { 8 } else { 2 }]);
        all.extend(record);
        all.extend_from_slice(content);
    }
    let begin = 375 + if behind { 0 } else { all.len() };
    let mut put = |at: usize, content: &[u8]| bytes[at..at + content.len()].copy_from_slice(content);
    put(0, b"LASF");
    put(24, &[1, 4]);
    put(94, &375_u16.to_le_bytes());
    put(96, &(begin as u32).to_le_bytes());
    put(100, &(if behind { 0 } else { records.len() as u32 }).to_le_bytes());
    put(105, &20_u16.to_le_bytes());
    for (k, offset) in [500_000.0, 5e6, 100.0].into_iter().enumerate() {
        put(131 + 8 * k, &f64::to_le_bytes(0.001));
        put(155 + 8 * k, &f64::to_le_bytes(offset));
    }
    if behind {
        put(235, &(375_u64 + 20).to_le_bytes());
        put(243, &(records.len() as u32).to_le_bytes());
    }
    put(247, &1_u64.to_le_bytes());
    let point = [&1_i32.to_le_bytes()[..], &2_i32.to_le_bytes(), &3_i32.to_le_bytes(), &[0; 8]].concat();
    let (first, second) = if behind { (point, all) } else { (all, point) };
    [bytes, first, second].concat()
}

fn bytes_of(numbers: &[u16]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

#[test]
fn las_names_its_system_in_text_or_keys() {
    let folder = Folder::new();
    let text = format!("{UTM}\0");
    let ours = "LASF_Projection";
    for behind in [false, true] {
        let path = folder.file("text.las", las(&[("somebody", 2112, b"x"), (ours, 2112, text.as_bytes())], behind));
        let (crs, notes) = told(&path);
        assert_eq!(crs.unwrap().text(), UTM);
        assert_eq!(notes, ["coordinates are in ETRS89 / UTM zone 32N (EPSG:25832)"]);
        let Content::Points(cloud) = open(&path).unwrap().scans[0].read().unwrap() else { panic!("no cloud") };
        assert_eq!(cloud.crs.unwrap().text(), UTM);
        let expected = DVec3::new(500_000.001, 5_000_000.002, 100.003);
        assert!(cloud.positions[0].distance(expected) < 2e-9, "{}", cloud.positions[0]);
    }
    let keyed = |keys: &[(u16, u16)], texts: &[(u16, u16, u16)], text: &[u8]| {
        let keys = bytes_of(&directory(keys, texts));
        told(&folder.file("keys.las", las(&[(ours, 34735, &keys), (ours, 34737, text)], false))).0
    };
    let code = |crs: Option<Crs>| crs.map(|crs| (crs.text().to_owned(), crs.is_in_degrees()));
    assert_eq!(code(keyed(&[(1024, 1), (3072, 25832)], &[], b"")), Some(("EPSG:25832".to_owned(), false)));
    let heights = keyed(&[(1024, 1), (3072, 25832), (4096, 7837)], &[], b"");
    assert_eq!(code(heights), Some(("EPSG:25832+7837".to_owned(), false)));
    assert_eq!(code(keyed(&[(1024, 2), (2048, 6318)], &[], b"")), Some(("EPSG:6318".to_owned(), true)));
    let own = keyed(&[(1024, 1), (3072, 32767)], &[(1026, 4, 0), (3073, 9, 4)], b"any|Our grid|");
    assert_eq!(code(own), Some(("Our grid".to_owned(), false)));
    assert_eq!(keyed(&[(1024, 1), (3072, 32767)], &[(3073, 90, 4)], b"any|"), None);
}

#[test]
fn damaged_records_never_panic_and_nothing_is_made_up() {
    let ours = "LASF_Projection";
    let keys = bytes_of(&directory(&[(1024, 1), (3072, 32767)], &[(3073, 6, 0)]));
    for behind in [false, true] {
        let whole = las(&[(ours, 34735, &keys), (ours, 34737, b"grid x|")], behind);
        let named = |bytes: &[u8]| las::named(&mut std::io::Cursor::new(bytes), bytes.len() as u64);
        assert_eq!(named(&whole).unwrap().unwrap().unwrap().text(), "grid x");
        for end in 0..whole.len() {
            let _ = named(&whole[..end]);
        }
        let mut damaged = whole.clone();
        for at in 0..whole.len() {
            for value in [0, 0xFF, whole[at] ^ 1, whole[at] ^ 0x80] {
                damaged[at] = value;
                let _ = named(&damaged);
            }
            damaged[at] = whole[at];
        }
    }
    let folder = Folder::new();
    let path = folder.file("bad.las", las(&[(ours, 2112, b"PROJCS[\x01]")], false));
    let (crs, notes) = told(&path);
    assert!(crs.is_none() && notes[0].contains("bad.las: coordinate reference system: not the text of a"), "{notes:?}");
    assert!(notes[0].ends_with("it is left out"), "{notes:?}");
    assert!(matches!(open(&path).unwrap().scans[0].read().unwrap(), Content::Points(cloud) if cloud.crs.is_none()));
}

#[test]
fn an_empty_text_of_las_names_nothing() {
    let folder = Folder::new();
    let ours = "LASF_Projection";
    let keys = bytes_of(&directory(&[(1024, 1), (3072, 25832)], &[]));
    for behind in [false, true] {
        for empty in [&b""[..], b"\0", b"\0\0PROJCS[\x01", b" \r\n\t\0", b"\"\"", b"\x0b"] {
            let path = folder.file("empty.las", las(&[(ours, 2112, empty)], behind));
            assert_eq!(told(&path), (None, vec![]), "{empty:?}");
            // A file that names one besides is believed.
            let both = folder.file("both.las", las(&[(ours, 2112, empty), (ours, 34735, &keys)], behind));
            assert_eq!(text_of(&both).as_deref(), Some("EPSG:25832"), "{empty:?}");
        }
    }
    let padded = format!("{UTM}\0 rest of a buffer \x01");
    let path = folder.file("padded.las", las(&[(ours, 2112, padded.as_bytes())], false));
    assert_eq!(text_of(&path).as_deref(), Some(UTM));
}

fn tiff(keys: &[u16], placed: bool) -> Vec<u8> {
    use ::tiff::tags::Tag;
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = ::tiff::encoder::TiffEncoder::new(&mut bytes).unwrap();
    let mut image = encoder.new_image::<::tiff::encoder::colortype::Gray32Float>(2, 2).unwrap();
    let tags = image.encoder();
    if placed {
        tags.write_tag(Tag::ModelPixelScaleTag, &[0.5, 0.5, 0.0][..]).unwrap();
        tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, 500_000.0, 5e6, 0.0][..]).unwrap();
    }
    tags.write_tag(Tag::GeoKeyDirectoryTag, keys).unwrap();
    image.write_data(&[1.0; 4]).unwrap();
    bytes.into_inner()
}

#[test]
fn maps_name_theirs_where_they_say_where_they_lie() {
    let folder = Folder::new();
    let utm = directory(&[(1024, 1), (1025, 1), (3072, 25832)], &[]);
    let path = folder.file("map.tif", tiff(&utm, true));
    let Content::RangeImage(image) = open(&path).unwrap().scans[0].read().unwrap() else { panic!("no image") };
    assert_eq!(image.crs.as_ref().unwrap().text(), "EPSG:25832");
    assert_eq!(image.point_in_world(0), DVec3::new(500_000.25, 4_999_999.75, 1.0));
    assert!(image.crs_of_frame().is_none(), "its pose says where it lies");
    assert_eq!(text_of(&folder.file("nowhere.tif", tiff(&utm, false))), None);
    let degrees = directory(&[(1024, 2), (2048, 4326)], &[]);
    let (crs, notes) = told(&folder.file("degrees.tif", tiff(&degrees, true)));
    assert!(crs.is_none() && notes[0].contains("places in degrees (EPSG:4326) are not lengths"), "{notes:?}");
    // Depth images lie in no system.
    let camera = super::super::Camera::new([1.0; 2], [0.5; 2]);
    let options = ReadOptions { camera: Some(camera), ..ReadOptions::default() };
    let scan = FileScan { options: Arc::new(options), ..FileScan::new(&path) };
    assert_eq!(scan.crs().unwrap(), None);
    let damaged = tiff(&utm, true);
    for at in 0..damaged.len() {
        for value in [0, 0xFF, damaged[at] ^ 0x80] {
            let mut damaged = damaged.clone();
            damaged[at] = value;
            let _ = FileScan::new(&folder.file("damaged.tif", damaged)).crs();
        }
    }
}

#[test]
fn a_file_beside_it_names_it() {
    let folder = Folder::new();
    let grid = folder.file("heights.asc", "ncols 2\nnrows 1\nxllcorner 500000\nyllcorner 5000000\ncellsize 1\n1 2\n");
    assert_eq!(text_of(&grid), None);
    folder.file("heights.prj", UTM.replace(',', ",\r\n  "));
    assert_eq!(text_of(&grid).as_deref(), Some(UTM));
    // A text that is none is told: a project of another program, a code, nothing, and text that was cut.
    for text in ["[project]\nname=x\n", "EPSG:25832", "", "GEOGCSX[1]"] {
        let path = folder.file("heights.prj", text);
        let problem = "expected well-known text, without which the coordinates are in no known system: it is left out";
        let note = format!("{}: coordinate reference system: {problem}", path.display());
        assert_eq!(told(&grid), (None, vec![note]));
    }
    folder.file("heights.prj", &UTM[..UTM.len() - 1]);
    assert!(told(&grid).1[0].contains("heights.prj: coordinate reference system: not the text of a"));
    folder.file("heights.prj", [b"PROJCS[\"\xff\"]".to_vec(), vec![0; 9]].concat());
    assert!(told(&grid).1[0].contains("heights.prj: coordinate reference system: "));
    folder.file("heights.prj", "GEOGCS[\"WGS 84\",UNIT[\"degree\",0.0174532925199433]]");
    let set = open(&grid).unwrap();
    let error = set.crs().unwrap_err().to_string();
    assert!(error.starts_with("heights: its coordinates are degrees (WGS 84), in which nothing"), "{error}");
}

#[test]
fn who_knows_better_is_believed_and_two_systems_are_told() {
    let folder = Folder::new();
    let utm = folder.file("a.las", las(&[("LASF_Projection", 2112, UTM.as_bytes())], false));
    let keys = bytes_of(&directory(&[(1024, 1), (3072, 25833)], &[]));
    let other = folder.file("b.las", las(&[("LASF_Projection", 34735, &keys)], false));
    let silent = folder.file("c.las", las(&[], false));
    let mut set = open_many(&[&utm, &silent]).unwrap();
    assert_eq!(set.crs().unwrap().unwrap().text(), UTM);
    set.scans[0].set_crs(None);
    assert_eq!(set.crs().unwrap(), None);
    let set = open_many(&[&utm, &other]).unwrap();
    assert!(set.notes[0].starts_with("the scans are in different coordinate reference systems: "), "{:?}", set.notes);
    let error = set.crs().unwrap_err().to_string();
    assert!(error.starts_with("a is in ETRS89 / UTM zone 32N (EPSG:25832), b in EPSG:25833: transform"), "{error}");
    let options = ReadOptions { crs: Some(Crs::new("EPSG:25832").unwrap()), ..ReadOptions::default() };
    let set = super::super::open_with(&[&utm, &other], &options, &base::progress::Progress::none()).unwrap();
    assert_eq!(set.crs().unwrap().unwrap().text(), "EPSG:25832");
    // A world of another size is in none.
    let mut scan = open(&utm).unwrap().scans.remove(0);
    scan.transform(&image::select::Similarity::scaling(2.0).unwrap()).unwrap();
    assert_eq!(scan.crs().unwrap(), None);
}
