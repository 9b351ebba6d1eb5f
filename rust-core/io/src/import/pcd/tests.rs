use super::super::damage;
use std::path::Path;

use glam::DVec3;

use super::*;

fn head(height: usize, data: &str) -> String {
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS label x y z rgb hist\nSIZE 1 4 8 4 4 2\n\
         TYPE U F F F F I\nCOUNT 1 1 1 1 1 2\nWIDTH {}\nHEIGHT {height}\nVIEWPOINT 0.5 0 0 1 0 0 0\nPOINTS 6\nDATA {data}\n",
        6 / height
    )
}

const ROWS: [[f64; 4]; 6] = [
    [1.0, 2.0, 3.0, 0x0001_0203 as f64],
    [f64::NAN, 1.0, 1.0, 0.0],
    [1.5, 2e6, 3.0, 0x00FF_8000 as f64],
    [0.0, 0.0, 0.0, 0.0],
    [-1.0, 2.5, -3.0, 7.0],
    [4.0, 5.0, 6.0, 0.0],
];

fn record(row: [f64; 4]) -> [Vec<u8>; 6] {
    [
        vec![9],
        (row[0] as f32).to_le_bytes().to_vec(),
        row[1].to_le_bytes().to_vec(),
        (row[2] as f32).to_le_bytes().to_vec(),
        (row[3] as u32).to_le_bytes().to_vec(),
        vec![1, 2, 3, 4],
    ]
}

fn ascii(height: usize) -> Vec<u8> {
    let line = |r: &[f64; 4]| format!("9 {} {} {} {:e} 1 -2\n", r[0], r[1], r[2], f32::from_bits(r[3] as u32));
    (head(height, "ascii") + &ROWS.iter().map(line).collect::<String>()).into_bytes()
}

fn binary(height: usize) -> Vec<u8> {
    let mut bytes = head(height, "binary").into_bytes();
    ROWS.iter().for_each(|row| bytes.extend(record(*row).concat()));
    bytes
}

/// Packed the lazy way: plain runs, and a repetition wherever the last eight bytes occur again at once.
fn pack(plain: &[u8]) -> Vec<u8> {
    let (mut packed, mut at) = (Vec::new(), 0);
    while at < plain.len() {
        let same = (1..at.min(40) + 1).map(|back| {
            let length = (0..200.min(plain.len() - at)).take_while(|i| plain[at + i] == plain[at + i - back]).count();
            (length, back)
        });
        if let Some((length, back)) = same.max().filter(|(length, _)| *length >= 3) {
            let (run, offset) = (length - 2, back - 1);
            if run < 7 {
                packed.push(((run << 5) | (offset >> 8)) as u8);
            } else {
                packed.extend([(7 << 5 | (offset >> 8)) as u8, (run - 7) as u8]);
            }
            packed.push((offset & 0xFF) as u8);
            at += length;
        } else {
            packed.extend([0, plain[at]]);
            at += 1;
        }
    }
    packed
}

fn compressed(height: usize) -> Vec<u8> {
    let records: Vec<[Vec<u8>; 6]> = ROWS.iter().map(|row| record(*row)).collect();
    let plain: Vec<u8> = (0..6).flat_map(|f| records.iter().flat_map(move |r| r[f].clone())).collect();
    let packed = pack(&plain);
    let mut bytes = head(height, "binary_compressed").into_bytes();
    bytes.extend((packed.len() as u32).to_le_bytes());
    bytes.extend((plain.len() as u32).to_le_bytes());
    bytes.extend(packed);
    bytes
}

fn scan() -> FileScan {
    FileScan::new(Path::new("x.pcd"))
}

#[test]
fn three_encodings_hold_the_same() {
    for make in [ascii, binary, compressed] {
        let organized = make(2);
        assert!(sniff(&organized));
        let Content::RangeImage(image) = damage::read(parse, &organized, &scan()).unwrap() else { panic!("no grid") };
        assert_eq!((image.rows(), image.cols()), (2, 3));
        assert_eq!((0..6).map(|i| image.is_valid(i)).collect::<Vec<_>>(), [true, false, true, false, true, true]);
        assert_eq!(image.point_in_world(2), DVec3::new(1.5, 2e6, 3.0));
        assert_eq!(image.point_in_world(4), DVec3::new(-1.0, 2.5, -3.0));
        assert_eq!(image.colour.as_ref().unwrap()[0], [1, 2, 3, 255]);
        assert_eq!(image.ray_in_sensor(0).0, DVec3::new(0.5, 0.0, 0.0));
        let Content::Points(cloud) = damage::read(parse, &make(1), &scan()).unwrap() else { panic!("no cloud") };
        assert_eq!(cloud.positions.len(), 5);
        assert_eq!(cloud.positions[1], DVec3::new(1.5, 2e6, 3.0));
        assert_eq!(cloud.sensor, Some(DVec3::new(0.5, 0.0, 0.0)));
        assert_eq!(cloud.colour.as_ref().unwrap()[1], [255, 128, 0, 255]);
        damage::endure(parse, &organized, &scan());
        damage::endure(parse, &make(1), &scan());
    }
}

#[test]
fn a_viewpoint_that_nobody_set_is_no_sensor() {
    let unset = String::from_utf8(ascii(1)).unwrap().replace("VIEWPOINT 0.5", "VIEWPOINT 0");
    let Content::Points(cloud) = damage::read(parse, unset.as_bytes(), &scan()).unwrap() else { panic!("no cloud") };
    assert_eq!((cloud.positions.len(), cloud.sensor), (5, None));
}

#[test]
fn what_does_not_fit_is_refused_before_it_is_allocated() {
    let refused = |bytes: &[u8]| damage::read(parse, bytes, &scan()).unwrap_err().to_string();
    for make in [ascii, binary, compressed] {
        let text = String::from_utf8_lossy(&make(1)).into_owned();
        for (from, to) in [("WIDTH 6", "WIDTH 4294967295"), ("WIDTH 6", "WIDTH 999999999999999")] {
            let bytes = text.replace(from, to).replace("POINTS 6", "").into_bytes();
            let error = refused(&bytes);
            assert!(error.contains("don't fit the") || error.contains("but it unpacks to"), "{error}");
        }
    }
    let mut bomb =
        head(1, "binary_compressed").replace("POINTS 6", "").replace("WIDTH 6", "WIDTH 170000000").into_bytes();
    bomb.extend(8_u32.to_le_bytes());
    bomb.extend((170_000_000_u64 * 25).to_le_bytes()[..4].to_vec());
    bomb.extend([0; 8]);
    let error = refused(&bomb);
    assert!(error.contains("can't unpack to 4250000000"), "{error}");
    for (from, to, problem) in [
        ("POINTS 6", "POINTS 7", "line 11: POINTS is not WIDTH x HEIGHT"),
        ("FIELDS label x", "FIELDS label q", "line 11: a cloud needs the fields x, y and z"),
        ("SIZE 1 4", "SIZE 3 4", "line 11: field label: type U of 3 bytes is unknown"),
        ("SIZE 1 4", "SIZE 4", "line 11: FIELDS, SIZE, TYPE and COUNT need as many"),
        ("DATA ascii", "DATA asci", "line 11: the data must be ascii, binary or"),
        ("TYPE U", "TYPE X", "line 5: a type must be F, I or U"),
        ("\n9 1 2 3", "\n9 1 2 z", "line 12: expected a number, found `z`"),
        ("\n9 1 2 3", "\n9 1 2 3 3", "line 12: expected the end of the line"),
    ] {
        let text = String::from_utf8(ascii(1)).unwrap().replacen(from, to, 1);
        let error = refused(text.as_bytes());
        assert!(error.contains(problem), "{error}");
    }
}
