//! Numbers of frames, and times, in names. This one rule decides them for the order of a recording, and for lists of poses that are read and
//! written.

use std::collections::BTreeSet;

/// The number in a name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Number<'n> {
    /// It as the name has it.
    pub(crate) text: &'n str,
    pub(crate) value: f64,
    /// Whether the name has nothing else.
    pub(crate) is_all: bool,
}

/// The last number in a name, of a frame or a time in seconds.
pub(crate) fn number_in(name: &str) -> Option<Number<'_>> {
    let end = name.rfind(|c: char| c.is_ascii_digit())? + 1;
    let begin = name[..end].rfind(|c: char| !c.is_ascii_digit() && c != '.').map_or(0, |other| {
        // It may take several bytes.
        other + name[other..].chars().next().map_or(1, char::len_utf8)
    });
    let text = name[begin..end].trim_start_matches('.');
    Some(Number { text, value: text.parse().ok().filter(|value: &f64| value.is_finite())?, is_all: text == name })
}

/// All numbers in a name. One with several dots, as of a version or a date, is several.
fn numbers_in(name: &str) -> Vec<Number<'_>> {
    let runs = name.split(|c: char| !c.is_ascii_digit() && c != '.').map(|run| run.trim_matches('.'));
    let texts = runs.flat_map(|run| {
        let dots = run.bytes().filter(|byte| *byte == b'.').count();
        run.split(move |c| c == '.' && dots > 1).filter(|text| !text.is_empty())
    });
    let number = |text| Number { text, value: str::parse(text).unwrap_or(f64::INFINITY), is_all: text == name };
    texts.map(number).filter(|number| number.value.is_finite()).collect()
}

/// A name without the ending that tells a copy from its file, as `(2)` does.
fn without_copy(name: &str) -> Option<&str> {
    let inner = name.strip_suffix(')')?;
    let rest = inner.trim_end_matches(|c: char| c.is_ascii_digit());
    rest.strip_suffix('(').filter(|_| rest.len() < inner.len()).map(str::trim_end)
}

/// Whole numbers from here on are times, as seconds since 1970 are: no frame has such a number.
pub(super) const TIMES_FROM: f64 = 1e8;

/// A number in each name, another in each.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Key {
    /// The number of each name. `None` of names without a number.
    pub(super) values: Vec<Option<f64>>,
    /// Whether some of them are surely times.
    pub(super) are_times: bool,
}

fn is_time(number: &Number<'_>) -> bool {
    number.text.contains('.') || number.value >= TIMES_FROM
}

/// The time among the numbers of a name, if there is one.
fn only_time<'n>(numbers: &[Number<'n>]) -> Option<Number<'n>> {
    let mut times = numbers.iter().filter(|number| is_time(number));
    let first = times.next().copied();
    first.filter(|_| times.next().is_none())
}

impl Key {
    fn of(numbers: &[Option<Number<'_>>]) -> Key {
        let values = numbers.iter().map(|number| number.map(|number| number.value)).collect();
        Key { values, are_times: numbers.iter().flatten().any(is_time) }
    }

    /// How many numbers there are, each counted once.
    fn count(&self) -> usize {
        self.values.iter().flatten().map(|value| value.to_bits()).collect::<BTreeSet<_>>().len()
    }

    /// The first two names that have one number.
    fn same(&self) -> Option<[usize; 2]> {
        let mut order: Vec<(f64, usize)> =
            self.values.iter().enumerate().filter_map(|(name, value)| Some(((*value)?, name))).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        order.windows(2).filter(|two| two[0].0 == two[1].0).map(|two| [two[0].1, two[1].1]).min()
    }
}

/// The numbers by which names differ, each at one place of the names. None where no name has a number. Names of other forms differ
/// by the time that each has.
///
/// # Errors
/// Two names of one number. Names of which it is in doubt which number counts.
pub(super) fn keys_of(names: &[&str]) -> Result<Vec<Key>, String> {
    // Else they number the scans.
    let some_are_copies = names.len() < 2 || names.iter().any(|name| without_copy(name).is_none());
    let has_number = |name: &&str| name.contains(|c: char| c.is_ascii_digit());
    let plain = |name| without_copy(name).filter(|plain| some_are_copies && has_number(plain)).unwrap_or(name);
    let numbers: Vec<Vec<Number<'_>>> = names.iter().map(|name| numbers_in(plain(name))).collect();
    let mut numbered = (0..names.len()).filter(|&name| !numbers[name].is_empty());
    let Some(first) = numbered.next() else { return Ok(Vec::new()) };
    let (count, has_others) = (numbers[first].len(), numbered.clone().next().is_some());
    let other = numbered.find(|&name| numbers[name].len() != count);
    let mut keys = Vec::new();
    if other.is_some() || (!has_others && count > 1) {
        let times: Vec<Option<Number<'_>>> = numbers.iter().map(|own| only_time(own)).collect();
        if times.iter().zip(&numbers).any(|(time, numbers)| time.is_none() && !numbers.is_empty()) {
            let first = names[first];
            return Err(match other {
                Some(other) => format!(
                    "it is in doubt which number in the names of the scans counts: {first} has {count}, and {} has {}. Rename \
                        them so that each has one.",
                    names[other],
                    numbers[other].len()
                ),
                None => format!(
                    "it is in doubt which of the {count} numbers in the name {first} counts. Open it together with others of \
                        its kind, or rename it so that it has one."
                ),
            });
        }
        keys.push(Key::of(&times));
    } else {
        keys.extend((0..count).map(|place| {
            let at_place: Vec<Option<Number<'_>>> = numbers.iter().map(|own| own.get(place).copied()).collect();
            Key::of(&at_place)
        }));
    }
    // The number that almost all differ by is the one that is meant.
    let same = keys.iter().max_by_key(|key| key.count()).and_then(Key::same);
    keys.retain(|key| key.same().is_none());
    match same.filter(|_| keys.is_empty()) {
        None => Ok(keys),
        Some([one, other]) => Err(format!(
            "{} and {} have the same number in their names, which must tell them apart. Open one of them, or rename them.",
            names[one], names[other]
        )),
    }
}

/// The order of scans that only their numbers, or the order in which they are handed over, can tell.
///
/// # Errors
/// Names with a number among names without one. Numbers that do not agree.
pub(super) fn order_of(keys: &[Key], names: &[&str]) -> Result<Vec<usize>, String> {
    let mut order: Vec<usize> = (0..names.len()).collect();
    let Some(key) = keys.last() else { return Ok(order) };
    if let Some(bare) = order.iter().find(|&&name| key.values[name].is_none()) {
        return Err(format!(
            "{} has no number in its name, and others have one, so that its place among them is not known. Rename it, or open \
                it apart.",
            names[*bare]
        ));
    }
    let value = |key: &Key, name: usize| key.values[name].unwrap_or(f64::NAN);
    order.sort_by(|&a, &b| value(key, a).total_cmp(&value(key, b)));
    for key in keys {
        if let Some(two) = order.windows(2).find(|two| value(key, two[0]) > value(key, two[1])) {
            return Err(format!(
                "the numbers in the names of {} and {} give two orders. Rename the scans so that each has one number.",
                names[two[0]], names[two[1]]
            ));
        }
    }
    Ok(order)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_number_counts() {
        for (name, text, value, is_all) in [
            ("0004", "0004", 4.0, true),
            ("1305031453.404816", "1305031453.404816", 1_305_031_453.404_816, true),
            ("frame_0004", "0004", 4.0, false),
            ("frame-3.depth", "3", 3.0, false),
            ("Tür7", "7", 7.0, false),
            ("ü7", "7", 7.0, false),
            ("-5", "5", 5.0, false),
            ("depth..5", "5", 5.0, false),
        ] {
            assert_eq!(number_in(name), Some(Number { text, value, is_all }), "{name}");
        }
        let long = "9".repeat(400);
        for name in ["", "depth", "v1.2.3", "nan", "inf", &long] {
            assert_eq!(number_in(name), None, "{name}");
        }
    }

    /// Theorem: a number of a name counts if it is another in each name. Copies have the number of their file.
    #[test]
    fn numbers_that_differ_count() {
        let keys = |names: &[&str]| -> Vec<Vec<f64>> {
            let keys = keys_of(names).unwrap();
            keys.into_iter().map(|key| key.values.into_iter().map(|value| value.unwrap_or(-1.0)).collect()).collect()
        };
        assert_eq!(keys(&["0_640x480", "10_640x480", "2_640x480"]), [[0.0, 10.0, 2.0]]);
        assert_eq!(keys(&["frame3_v2", "frame10_v2"]), [[3.0, 10.0]]);
        assert_eq!(keys(&["000001-000000000000", "000002-000000033369"]), [[1.0, 2.0], [0.0, 33369.0]]);
        assert_eq!(keys(&["v1.2.9", "v1.2.10", "mean"]), [[9.0, 10.0, -1.0]]);
        assert_eq!(keys(&["1305.5", "depth2_1305.25"]), [[1305.5, 1305.25]]);
        assert_eq!(keys(&["f_1 (2)", "f_0", "f_3(1)"]), [[1.0, 0.0, 3.0]]);
        assert_eq!(keys(&["view (1)", "view (10)", "view (2)"]), [[1.0, 10.0, 2.0]]);
        assert_eq!(keys(&["depth", "depth (2)"]), [[-1.0, 2.0]]);
        assert!(keys(&["a", "b"]).is_empty() && keys(&[]).is_empty());
        for (names, problem) in [
            (&["f_0", "f_1", "f_1 (2)"][..], "f_1 and f_1 (2) have the same number"),
            (&["cam1_1", "cam1_2", "cam2_1"], "cam1_1 and cam2_1 have the same number"),
            (&["0_640x480", "1_640x480", "1_640x480 (2)"], "1_640x480 and 1_640x480 (2) have the same number"),
            (&["f_1", "f_2_v2"], "f_1 has 1, and f_2_v2 has 2"),
            (&["frame3_v2"], "which of the 2 numbers in the name frame3_v2 counts"),
        ] {
            let refused = keys_of(names).unwrap_err();
            assert!(refused.contains(problem), "{refused}");
        }
        let order = |names: &[&str]| order_of(&keys_of(names).unwrap(), names);
        assert_eq!(order(&["0_640x480", "10_640x480", "2_640x480"]), Ok(vec![0, 2, 1]));
        assert_eq!(order(&["c", "a"]), Ok(vec![0, 1]));
        assert!(order(&["frame0", "mean"]).unwrap_err().starts_with("mean has no number"));
        assert!(order(&["f1_e9", "f2_e8"]).unwrap_err().contains("f1_e9 give two orders"));
    }
}
