//! Names that Windows gives no file ("Naming Files, Paths, and Namespaces" in its documentation): writing to one fails in
//! words that nobody understands, or goes well and the file is nowhere.

/// Reason why Windows can't give a file this name, if it can't.
pub(super) fn forbidden(name: &str) -> Option<String> {
    if let Some(bad) = name.chars().find(|&c| r#"<>:"/\|?*"#.contains(c) || c < ' ') {
        return Some(format!("Windows' names of files have no {bad:?}"));
    }
    if name.ends_with(['.', ' ']) {
        return Some("Windows' names of files don't end with a dot or a space".to_owned());
    }
    let stem = name.split('.').next().unwrap_or(name).trim_end_matches(' ').to_uppercase();
    let numbered = |device: &str| {
        let number = stem.strip_prefix(device).map(|rest| rest.chars().collect::<Vec<_>>());
        number.is_some_and(|n| matches!(n[..], ['0'..='9' | '¹' | '²' | '³']))
    };
    (["CON", "PRN", "AUX", "NUL"].contains(&stem.as_str()) || numbered("COM") || numbered("LPT"))
        .then(|| format!("{stem} is a device of Windows, whatever its ending"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_and_characters() {
        for name in ["nul", "NUL.ply", "con.tar.gz", "Aux .ply", "com1", "LPT9.glb", "com¹.ply"] {
            assert!(forbidden(name).is_some_and(|why| why.contains("is a device of Windows")), "{name}");
        }
        for name in ["a:b.ply", "a<b", "what?.ply", "a|b", "a*", "\"a\"", "a\tb"] {
            assert!(forbidden(name).is_some_and(|why| why.contains("names of files have no")), "{name}");
        }
        for name in ["a.", "a.ply ", "..."] {
            assert!(forbidden(name).is_some_and(|why| why.contains("don't end with")), "{name}");
        }
        for name in [
            "console.ply",
            "nul_.ply",
            "com.ply",
            "com10.ply",
            "comet.ply",
            ".nul",
            "a nul.ply",
            "größe 測試 😀.ply",
            "a..b",
        ] {
            assert_eq!(forbidden(name), None, "{name}");
        }
    }
}
