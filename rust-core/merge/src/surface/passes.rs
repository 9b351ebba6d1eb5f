//! Passes over lists as long as the surface that can be stopped half way: at tens of millions of triangles each takes
//! seconds.

use base::error::Result;
use base::progress::Progress;

/// Calls `each` with `0..len` in order.
///
/// # Errors
/// Cancelled.
pub fn each(len: usize, progress: &Progress<'_>, mut each: impl FnMut(usize)) -> Result<()> {
    for block in progress.ranges(len) {
        block?.for_each(&mut each);
    }
    Ok(())
}

/// A list of what `make` gives for `0..len`.
///
/// # Errors
/// Cancelled.
pub fn made<T>(len: usize, progress: &Progress<'_>, mut make: impl FnMut(usize) -> T) -> Result<Vec<T>> {
    let mut list = Vec::with_capacity(len);
    for block in progress.ranges(len) {
        list.extend(block?.map(&mut make));
    }
    Ok(list)
}

/// A list of the same value.
///
/// # Errors
/// Cancelled.
pub fn filled<T: Clone>(value: T, len: usize, progress: &Progress<'_>) -> Result<Vec<T>> {
    let mut list = Vec::with_capacity(len);
    for block in progress.ranges(len) {
        list.resize(block?.end, value.clone());
    }
    Ok(list)
}

/// Keeps the elements, in their order, for whose index and value `keep` holds.
///
/// # Errors
/// Cancelled: the list is then left half done.
pub fn retain<T: Copy>(
    list: &mut Vec<T>,
    progress: &Progress<'_>,
    mut keep: impl FnMut(usize, T) -> bool,
) -> Result<()> {
    let mut kept = 0;
    each(list.len(), progress, |i| {
        if keep(i, list[i]) {
            list[kept] = list[i];
            kept += 1;
        }
    })?;
    list.truncate(kept);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use base::progress::BLOCK;

    #[test]
    fn passes_do_what_their_twins_of_the_standard_library_do_and_stop() {
        for len in [0, 1, BLOCK - 1, BLOCK, 2 * BLOCK + 3] {
            let none = Progress::none();
            let list = made(len, &none, |i| i as u32).unwrap();
            assert_eq!(list, (0..len as u32).collect::<Vec<_>>());
            assert_eq!(filled(7_u8, len, &none).unwrap(), vec![7; len]);
            let (mut ours, mut theirs) = (list.clone(), list.clone());
            retain(&mut ours, &none, |i, value| i as u32 == value && value % 3 == 1).unwrap();
            theirs.retain(|value| value % 3 == 1);
            assert_eq!(ours, theirs);
            if len > 0 {
                assert!(filled(0, len, &Progress::cancel_after(len.div_ceil(BLOCK) as u64 - 1)).is_err());
            }
        }
    }
}
