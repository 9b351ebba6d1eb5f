//! Meanings of the numbers of a line.

/// Columns that are looked at. More are passed over.
pub(super) const MOST: usize = 16;

/// Largest difference from 1 of the lengths of normals written with two digits.
const UNIT_WITHIN: f64 = 0.02;
/// Largest value of a colour of 16 bits, and what makes it one of 8.
const LARGEST_COLOUR: f64 = 65535.0;
const OF_8_BITS: f64 = 1.0 / 257.0;

/// Places in a line, columns counted from 0.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Columns {
    width: usize,
    pub(super) position: [usize; 3],
    pub(super) normal: Option<[usize; 3]>,
    pub(super) colour: Option<[usize; 3]>,
    pub(super) intensity: Option<usize>,
    /// Makes colours 0 to 255.
    pub(super) colour_scale: f64,
    /// Notes on what was decided without being told.
    pub(super) notes: Vec<String>,
}

impl Columns {
    fn new(width: usize) -> Self {
        Columns {
            width,
            position: [0, 1, 2],
            normal: None,
            colour: None,
            intensity: None,
            colour_scale: 1.0,
            notes: Vec::new(),
        }
    }

    /// Numbers a line has.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// Columns by their names. `None` if x, y and z are not among them.
    pub(super) fn named(names: &[String]) -> Option<Self> {
        let names: Vec<String> =
            names.iter().map(|name| name.trim_matches(['"', '\'', '/', '#']).to_ascii_lowercase()).collect();
        let find = |known: &[&str]| names.iter().position(|name| known.contains(&name.as_str()));
        let all = |known: [&[&str]; 3]| Some([find(known[0])?, find(known[1])?, find(known[2])?]);
        let mut columns = Columns::new(names.len());
        columns.position = all([&["x", "easting"], &["y", "northing"], &["z", "height", "elevation"]])?;
        columns.normal =
            all([&["nx", "normal_x", "normalx"], &["ny", "normal_y", "normaly"], &["nz", "normal_z", "normalz"]]);
        columns.colour = all([&["r", "red"], &["g", "green"], &["b", "blue"]]);
        columns.intensity = find(&["i", "intensity", "reflectance", "scalar_field", "scalar_intensity"]);
        if names.len() > MOST {
            // Of the values only the first columns are kept for a look.
            let seen = |at: &[usize; 3]| at.iter().all(|&c| c < MOST);
            columns.colour = columns.colour.filter(seen);
        }
        Some(columns)
    }

    /// Columns by their count and the first rows. `announced`: the file starts with a count, as PTS files do.
    pub(super) fn guessed(width: usize, announced: bool, rows: &[[f64; MOST]]) -> Self {
        let mut columns = Columns::new(width);
        let are_units = |at: usize| {
            at + 3 <= width.min(MOST)
                && rows.iter().all(|row| {
                    let length = row[at..at + 3].iter().map(|v| v * v).sum::<f64>().sqrt();
                    (length - 1.0).abs() < UNIT_WITHIN || length == 0.0
                })
                && rows.iter().any(|row| row[at..at + 3].iter().any(|v| v.fract() != 0.0))
        };
        let are_colours = |at: usize| {
            let values = || rows.iter().flat_map(|row| &row[at..at + 3]);
            at + 3 <= width.min(MOST)
                && values().all(|v| *v >= 0.0 && *v <= LARGEST_COLOUR)
                && (values().all(|v| v.fract() == 0.0) || values().all(|v| *v <= 1.0))
        };
        let triple = |at: usize| [at, at + 1, at + 2];
        let mut at = 3;
        // x y z i r g b is what PTS files hold; x y z r g b i is rare but told apart by a last column that can't be blue.
        if width == 4 || (matches!(width, 7 | 10) && are_colours(4) && (announced || !are_units(3))) {
            columns.intensity = Some(3);
            at = 4;
        }
        while at < width.min(MOST) {
            if columns.normal.is_none() && are_units(at) {
                columns.normal = Some(triple(at));
                at += 3;
            } else if columns.colour.is_none() && are_colours(at) {
                columns.colour = Some(triple(at));
                at += 3;
            } else if columns.intensity.is_none() && at + 1 == width {
                columns.intensity = Some(at);
                at += 1;
            } else {
                break;
            }
        }
        columns.scale_colours(rows);
        if width > 3 {
            columns.notes.insert(0, columns.describe());
        }
        columns
    }

    fn describe(&self) -> String {
        let mut parts = vec!["x y z".to_owned()];
        let mut known = 3;
        let mut found: Vec<(usize, usize, &str)> = Vec::new();
        found.extend(self.intensity.map(|c| (c, 1, "intensity")));
        found.extend(self.colour.map(|c| (c[0], 3, "red green blue")));
        found.extend(self.normal.map(|c| (c[0], 3, "normal")));
        found.sort_unstable();
        for (_, count, name) in found {
            parts.push(name.to_owned());
            known += count;
        }
        let passed = match self.width - known {
            0 => String::new(),
            1 => ". The last column is passed over.".to_owned(),
            n => format!(". The last {n} columns are passed over."),
        };
        format!("{} columns without names, taken as {}{passed}", self.width, parts.join(", "))
    }

    /// Tells colours of 0 to 1, of 0 to 255 and of 16 bits apart by the largest of the first rows.
    pub(super) fn scale_colours(&mut self, rows: &[[f64; MOST]]) {
        let Some(colour) = self.colour else { return };
        let values = || rows.iter().flat_map(|row| colour.map(|c| row[c]));
        let largest = values().fold(0.0, f64::max);
        if largest > 255.0 {
            self.colour_scale = OF_8_BITS;
            self.notes.push("colours go beyond 255 and are taken as 16 bits".to_owned());
        } else if largest <= 1.0 && values().any(|v| v.fract() != 0.0) {
            self.colour_scale = 255.0;
            self.notes.push("colours are taken as 0 to 1".to_owned());
        }
    }
}
