//! The name that was probably meant by one that is not known: errors say it.

/// Most letters that a name differs by for each so many of it.
const LETTERS_PER_SLIP: usize = 3;

/// The nearest of the known names if it is near enough to be meant: a third of the letters may be wrong, missing, too many or
/// swapped, or one name is the other with more words behind it. Of equally near ones the first. Capitals, and which of `-`, `_` and a
/// space joins words, count for nothing.
pub fn nearest<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let given = plain(given);
    let most = (given.len() / LETTERS_PER_SLIP).max(1).min(given.len().saturating_sub(1));
    let slips = |name: &str| {
        let name = plain(name);
        let slips = slips(&given, &name);
        if is_longer(&given, &name) || is_longer(&name, &given) { slips.min(most) } else { slips }
    };
    let near = known.into_iter().map(|name| (slips(name), name)).filter(|(slips, _)| *slips <= most);
    near.reduce(|best, other| if other.0 < best.0 { other } else { best }).map(|(_, name)| name)
}

/// The end of an error of an unknown name: the question whether the nearest known one was meant. Empty if none is near.
pub fn meant<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    nearest(given, known).map_or_else(String::new, |name| format!(". Did you mean \"{name}\"?"))
}

/// The end of an error of a name where there is none like it: which one was probably meant, or else which there are.
pub fn instead(given: &str, known: &[&str]) -> String {
    match nearest(given, known.iter().copied()) {
        Some(name) => format!("Did you mean \"{name}\"?"),
        None => format!("There are {}.", known.join(", ")),
    }
}

fn plain(name: &str) -> Vec<char> {
    // A name of thousands of letters is none, and need not be compared whole.
    name.chars().take(100).flat_map(char::to_lowercase).map(|c| if matches!(c, '-' | ' ') { '_' } else { c }).collect()
}

fn is_longer(name: &[char], other: &[char]) -> bool {
    !other.is_empty() && name.starts_with(other) && name[other.len()..].starts_with(&['_'])
}

/// Number of letters that are wrong, missing, too many or swapped with their neighbour.
fn slips(a: &[char], b: &[char]) -> usize {
    let mut rows = [Vec::new(), (0..=b.len()).collect::<Vec<_>>(), vec![0; b.len() + 1]];
    rows[0] = rows[1].clone();
    for i in 1..=a.len() {
        rows[2][0] = i;
        for j in 1..=b.len() {
            let changed = rows[1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            rows[2][j] = changed.min(rows[1][j] + 1).min(rows[2][j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                rows[2][j] = rows[2][j].min(rows[0][j - 2] + 1);
            }
        }
        rows.rotate_left(1);
    }
    rows[1][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: [&str; 6] = ["smoothing", "auto", "sequence", "rough", "min_overlap", "max-memory"];

    #[test]
    fn misspelled_names_are_known_by_the_nearest() {
        let cases = [
            ("sequnce", "sequence"),
            ("seqeunce", "sequence"),
            ("ruogh", "rough"),
            ("Rough", "rough"),
            ("min-overlap", "min_overlap"),
            ("minoverlap", "min_overlap"),
            ("max_memroy", "max-memory"),
            ("atuo", "auto"),
            ("rough_or_not", "rough"),
            ("min", "min_overlap"),
        ];
        for (given, meant) in cases {
            assert_eq!(nearest(given, KNOWN), Some(meant), "{given}");
        }
        assert_eq!(meant("sequnce", KNOWN), ". Did you mean \"sequence\"?");
    }

    #[test]
    fn other_names_are_near_to_none() {
        for given in ["", "x", "tolerance", "no", "turntable", "nothing"] {
            assert_eq!(nearest(given, KNOWN), None, "{given}");
        }
        assert_eq!(nearest("auto", []), None);
        assert_eq!(meant("tolerance", KNOWN), "");
        assert_eq!(instead("tolerance", &KNOWN[1..3]), "There are auto, sequence.");
        assert_eq!(instead("autto", &KNOWN), "Did you mean \"auto\"?");
    }

    #[test]
    fn of_equally_near_names_the_first_is_taken() {
        assert_eq!(nearest("bat", ["cat", "rat"]), Some("cat"));
        assert_eq!(nearest("cart", ["rat", "cat"]), Some("cat"));
    }

    #[test]
    fn slips_are_counted() {
        let count = |a: &str, b: &str| slips(&plain(a), &plain(b));
        assert_eq!([count("", ""), count("", "abc"), count("abc", ""), count("abc", "abc")], [0, 3, 3, 0]);
        assert_eq!([count("kitten", "sitting"), count("abcd", "abdc"), count("ca", "abc")], [3, 1, 3]);
    }
}
