//! Names of scans in messages.

use std::collections::BTreeMap;

/// Names as messages have them: those that several scans have come with the scan's number.
pub(crate) fn told_apart(names: &[String], numbers: &[usize]) -> Vec<String> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    names.iter().for_each(|name| *counts.entry(name).or_default() += 1);
    let shown = |(name, number): (&String, &usize)| match counts[name.as_str()] {
        1 => name.clone(),
        _ => format!("{name} (scan {number})"),
    };
    names.iter().zip(numbers).map(shown).collect()
}
