//! Colours of files that do not say what they count to: 1, 255 or 65,535.

/// The number that channels of colours count to, by the largest so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Count {
    One,
    Byte,
    Word,
}

impl Count {
    /// Multiplied by this, channels lie in 0 to 255.
    pub(super) fn factor(self) -> f64 {
        match self {
            Count::One => 255.0,
            Count::Byte => 1.0,
            Count::Word => 1.0 / 257.0,
        }
    }

    /// From here on channels count to more. Light that is too bright for 1 stays below 2.
    pub(super) fn end(self) -> f64 {
        match self {
            Count::One => 2.0,
            Count::Byte => 256.0,
            Count::Word => f64::INFINITY,
        }
    }

    /// The way of counting that a channel of this size needs. The colours before it, of which so many channels count, become what they
    /// are in it.
    #[cold]
    pub(super) fn widened(self, channel: f64, before: &mut [[u8; 4]], channels: usize) -> Count {
        let wider = match self {
            _ if channel < self.end() => return self,
            Count::One if channel < Count::Byte.end() => Count::Byte,
            _ => Count::Word,
        };
        let factor = wider.factor() / self.factor();
        for colour in before {
            for channel in &mut colour[..channels] {
                *channel = (f64::from(*channel) * factor + 0.5) as u8;
            }
        }
        wider
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::scan::{Content, FileScan};
    use super::super::{damage, obj, open};
    use super::*;

    #[test]
    fn colours_before_the_first_large_one_are_counted_anew() {
        let mut before = [[255, 128, 0, 255]];
        assert_eq!(Count::One.widened(1.5, &mut before, 3), Count::One);
        assert_eq!(before, [[255, 128, 0, 255]]);
        assert_eq!(Count::One.widened(255.0, &mut before, 3), Count::Byte);
        assert_eq!(before, [[1, 1, 0, 255]]);
        assert_eq!(Count::Byte.widened(256.0, &mut before, 4), Count::Word);
        assert_eq!(before, [[0, 0, 0, 1]]);
        assert_eq!(Count::One.widened(65535.0, &mut before, 4), Count::Word);
    }

    /// Vertices of an OBJ or of a PLY with colours in floats.
    fn read(rows: &[[f64; 3]]) -> [Vec<[u8; 4]>; 2] {
        let line = |[r, g, b]: &[f64; 3]| format!("0 0 0 {r} {g} {b}\n");
        let obj: String = rows.iter().map(|row| format!("v {}", line(row))).collect();
        let Content::Points(cloud) = damage::read(obj::parse, obj.as_bytes(), &FileScan::new(Path::new("x"))).unwrap()
        else {
            panic!("no points")
        };
        let names = ["float x", "float y", "float z", "float red", "float green", "float blue"];
        let header: String = names.map(|name| format!("property {name}\n")).concat();
        let body: String = rows.iter().map(line).collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        let head = format!("ply\nformat ascii 1.0\nelement vertex {}\n{header}end_header\n", rows.len());
        std::fs::write(&path, head + &body).unwrap();
        let Content::Points(of_ply) = open(&path).unwrap().scans[0].read().unwrap() else { panic!("no points") };
        [cloud.colour.unwrap(), of_ply.colour.unwrap()]
    }

    #[test]
    fn readers_tell_the_ways_apart() {
        let bytes = [[0.0, 1.0, 0.0], [255.0, 128.0, 0.0], [12.0, 1.0, 2.0]];
        for (rows, expected) in [
            (&[[1.0, 0.0, 0.5], [1.01, 0.2, 0.4]][..], &[[255, 0, 128, 255], [255, 51, 102, 255]][..]),
            (&bytes, &[[0, 1, 0, 255], [255, 128, 0, 255], [12, 1, 2, 255]]),
            (&[[257.0, 0.0, 65535.0], [514.0, 1.0, 128.0]], &[[1, 0, 255, 255], [2, 0, 0, 255]]),
        ] {
            for found in read(rows) {
                assert_eq!(found, expected);
            }
        }
    }
}
