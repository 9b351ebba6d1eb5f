use super::*;

fn cloud(text: &str) -> PointCloud {
    assert!(sniff(text.as_bytes()), "not recognized: {text}");
    parse(text.as_bytes(), text.len() as u64).unwrap()
}

fn refused(text: &str) -> String {
    let problem = parse(text.as_bytes(), text.len() as u64).unwrap_err();
    problem.into_error(Path::new("a.xyz")).to_string()
}

fn notes(text: &str) -> String {
    layout(text.as_bytes()).unwrap().map(|c| c.notes.join("; ")).unwrap_or_default()
}

#[test]
fn all_separators_and_comments() {
    let expected = vec![DVec3::new(1.5, -2.0, 3e-2), DVec3::new(4.0, 5.0, 6.0)];
    for text in [
        "1.5 -2 3e-2\n4 5 6\n",
        "1.5,-2,3e-2\r\n4,5,6\r\n",
        "1.5;-2;3e-2\n4;5;6",
        "1.5\t-2\t3e-2\n4\t5\t6\n\n",
        "1,5;-2,0;3e-2\n4,0;5,0;6,0\n",
        "# made by hand\n  1.5   -2 3e-2  \n// more\n4, 5, 6\n",
        "X Y Z\r1.5 -2 3e-2\r4 5 6\r",
        "2\n1.5 -2 3e-2\n4 5 6\n",
        "z,x,y\n3e-2,1.5,-2\n6,4,5\n",
        "1.5 -2 3e-2\nnan 0 0\n4 5 6\n",
    ] {
        assert_eq!(cloud(text).positions, expected, "{text}");
    }
}

#[test]
fn columns_without_names() {
    let normals = cloud("0 0 0 0.6 0 0.8\n1 0 0 0 0.6 -0.8\n");
    assert_eq!(normals.normals.unwrap(), [[0.6, 0.0, 0.8], [0.0, 0.6, -0.8]]);
    let bytes = cloud("0 0 0 255 0 12\n1 0 0 1 2 3\n");
    assert_eq!(bytes.colour.unwrap(), [[255, 0, 12, 255], [1, 2, 3, 255]]);
    let floats = cloud("0 0 0 1.0 0 0.5\n1 0 0 0.2 0.4 0.3\n");
    assert_eq!(floats.colour.unwrap(), [[255, 0, 128, 255], [51, 102, 77, 255]]);
    let pts = cloud("2\n0 0 0 -1200 255 0 12\n1 0 0 300 1 2 3\n");
    assert_eq!(pts.intensity.unwrap(), [-1200.0, 300.0]);
    assert_eq!(pts.colour.unwrap()[1], [1, 2, 3, 255]);
    let both = cloud("0 0 0 0.6 0 0.8 10 20 30\n1 0 0 0 0.6 -0.8 1 2 3\n");
    assert!(both.normals.is_some() && both.colour.is_some());
    let swapped = cloud("0 0 0 10 20 30 0.6 0 0.8\n1 0 0 1 2 3 0 0.6 -0.8\n");
    assert_eq!((swapped.normals, swapped.colour), (both.normals, both.colour));
    assert_eq!(cloud("0 0 0 7.5\n1 1 1 8\n").intensity.unwrap(), [7.5, 8.0]);
    assert_eq!(
        notes("0 0 0 0.2 0.4 0.3\n"),
        "6 columns without names, taken as x y z, red green blue; colours are taken as 0 to 1"
    );
}

#[test]
fn columns_with_names() {
    let named = cloud("//X Y Z R G B Intensity\n1 2 3 10 20 30 0.5\n");
    assert_eq!(named.colour.unwrap(), [[10, 20, 30, 255]]);
    assert_eq!(named.intensity.unwrap(), [0.5]);
    assert_eq!(notes("x y z i\n1 2 3 4\n"), "");
}

#[test]
fn what_is_wrong_has_a_line() {
    assert_eq!(refused("0 0 0\n1 1\n"), "a.xyz: line 2: 2 numbers, but the first point has 3");
    assert_eq!(refused("# x\n\n0 0 0\n1 1 one\n"), "a.xyz: line 4: expected a number, found `one`");
    assert_eq!(refused("0 0\n"), "a.xyz: line 1: a point needs three coordinates, this line has 2 numbers");
    assert!(refused(&"1 ".repeat(100_000)).contains("longer than 65,536 bytes"));
}

#[test]
fn announced_points_must_follow() {
    assert_eq!(
        refused("3\n0 0 0\n1 1 1\n"),
        "a.xyz: line 1: 3 points are announced, but 2 follow: the file was cut short"
    );
    assert!(refused("1\n0 0 0\n2\n1 1 1\n").starts_with("a.xyz: line 3: 2 points are announced, but 1 follow"));
    // Several clouds in one file; some programs announce fewer points than they write.
    for (text, count) in [("1\n0 0 0\n2\n1 1 1\n2 2 2\n", 3), ("1\n0 0 0\n1 1 1\n", 2)] {
        assert_eq!(parse(text.as_bytes(), text.len() as u64).unwrap().positions.len(), count, "{text}");
    }
    assert!(refused("# nothing\n").ends_with("there is no point"));
}

/// Theorem: several clouds after each other have the columns that they have after one count.
#[test]
fn further_counts_change_no_columns() {
    let rows = ["0 0 0 -1200 255 0 12\n", "1 0 0 300 1 2 3\n", "2 0 0 7 9 8 7\n", "3 0 0 8 255 255 255\n"];
    let one = cloud(&format!("4\n{}", rows.concat()));
    assert!(one.colour.is_some() && one.intensity.is_some());
    for first in [1, 2] {
        let text = format!("{first}\n{}{}\n{}", rows[..first].concat(), 4 - first, rows[first..].concat());
        assert_eq!(cloud(&text), one);
        assert_eq!(notes(&text), notes(&format!("4\n{}", rows.concat())));
    }
}

#[test]
fn other_texts_are_not_taken() {
    for text in [
        "ply\nformat ascii 1.0\n",
        "10\n20\n0 0 0\n1 0 0\n",
        "ncols 5\nnrows 5\n1 2 3\n",
        "0 0 1\n1 0 0 0\n",
        "",
        "\0\0",
    ] {
        assert!(!sniff(text.as_bytes()), "{text}");
    }
}

#[test]
fn any_bytes_are_read_or_refused() {
    use proptest::prelude::*;
    let word =
        prop::sample::select(vec!["1", "-2.5", "nan", "x", "#", ";", ",", "\n", " ", "\n", "1e400", "//", "0.6"]);
    proptest!(|(words in prop::collection::vec(word, 0..60))| examine(words.concat().as_bytes()));
    proptest!(|(bytes in prop::collection::vec(any::<u8>(), 0..200))| examine(&bytes));
}

#[test]
fn real_files() {
    let Some(data) = std::env::var_os("SURFRECON_DATA") else {
        println!("SKIPPED real point files: SURFRECON_DATA is not set");
        return;
    };
    let folder = Path::new(&data).join("points");
    for (name, count, normals) in
        [("kitten.xyz", 5210, true), ("giaccari_hypersheet.xyz", 6752, false), ("ocean_r.xyz", 14550, false)]
    {
        let scan = &crate::import::open(&folder.join(name)).unwrap().scans[0];
        let Content::Points(cloud) = scan.read().unwrap() else { panic!("{name} holds points") };
        assert_eq!((cloud.positions.len(), cloud.normals.is_some()), (count, normals), "{name}");
        assert!(scan.preview_points(100).unwrap().len() >= 50);
    }
}
