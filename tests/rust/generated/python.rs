//! The parts of the Python module that repeat parameters: the texts of functions, their signatures, the types.
//!
//! Functions take parameters as `**options`. A comment `// options: OPERATION` before the attribute says of which operation, with `but
//! NAME..` or `only NAME..` where that is a part, and the signature that Python shows is written behind it. In the types, lines between `#
//! options: ..` and `# end` are. The types of a file may stand in the file itself, in a comment that begins with `// types:`, and those of
//! its methods of `Job` in one that begins with `// types of Job:`.

use std::collections::HashSet;

use surfrecon::params::{ParamKind, ParamSpec, Value, schema};

use crate::modules::{imported, listed, native};
use crate::python_reports::class_names;
use crate::words::{plain_default, range, rule, sentence, wrapped};
use crate::{compare, replaced, root};

/// The rows that a mark means: `merge`, `sculpt but tolerance`, `sculpt only tolerance`.
fn rows(mark: &str) -> Vec<&'static ParamSpec> {
    let mut words = mark.split_whitespace();
    let operation = words.next().expect("a mark names an operation");
    let schema = schema(operation).unwrap_or_else(|| panic!("there is no operation {operation}"));
    let (how, names): (Option<&str>, Vec<&str>) = (words.next(), words.collect());
    let all = (schema.all)();
    for name in &names {
        assert!(all.iter().any(|row| row.name == *name), "{mark}: there is no parameter {name}");
    }
    let kept = |row: &&ParamSpec| match how {
        None => true,
        Some("but") => !names.contains(&row.name),
        Some("only") => names.contains(&row.name),
        Some(other) => panic!("{mark}: what is {other}?"),
    };
    all.into_iter().filter(kept).collect()
}

/// The default as Python writes it.
fn literal(row: &ParamSpec) -> String {
    match row.default_value() {
        Value::Absent => "None".to_owned(),
        Value::Flag(true) => "True".to_owned(),
        Value::Flag(false) => "False".to_owned(),
        Value::Choice(name) => format!("'{name}'"),
        Value::Number(number) if row.kind == ParamKind::Count => format!("{number:.0}"),
        Value::Number(number) => format!("{number:?}"),
    }
}

/// The signature that Python shows, from the one that Rust has.
fn shown(signature: &str, is_method: bool, mark: &str) -> String {
    let signature = signature.trim_end_matches("**options");
    let (before, own) = signature.split_once("*,").unwrap_or((signature, ""));
    let own = own.replace(" = ", "=").replace("false", "False").replace("true", "True").replace("Vec::new()", "()");
    let own = own.split(',').map(str::trim).filter(|argument| !argument.is_empty()).map(str::to_owned);
    let options = rows(mark).into_iter().map(|row| format!("{}={}", row.name, literal(row)));
    let mut all: Vec<String> = is_method.then(|| "$self".to_owned()).into_iter().collect();
    all.extend(before.split(',').map(str::trim).filter(|argument| !argument.is_empty()).map(str::to_owned));
    all.push("*".to_owned());
    all.extend(options.chain(own));
    format!("({})", all.join(", "))
}

const SHOWN: &str = "text_signature = \"";

/// The file with the signatures behind its marks as they are to be.
fn with_signatures(source: &str) -> String {
    let mut out = String::new();
    let mut rest = source;
    while let Some((before, after)) = rest.split_once("// options: ") {
        let (mark, after) = after.split_once('\n').expect("a line behind the mark");
        let start = after.find("signature = (").expect("a signature behind the mark") + "signature = (".len();
        let end = start + after[start..].find("**options").expect("a signature with **options");
        let close = end + after[end..].find(")]").expect("the end of the attribute");
        // A function that is new has no signature to show yet.
        let (before_shown, shown_at) = match after[end..close].find(SHOWN) {
            Some(place) => (after[..end + place + SHOWN.len()].to_owned(), end + place + SHOWN.len()),
            None => (format!("{}, {SHOWN}", &after[..close]), close),
        };
        let has_shown = before_shown.len() == shown_at;
        let shown_end = if has_shown { shown_at + after[shown_at..].find('"').expect("its end") } else { close };
        let (is_method, mark) = mark.strip_prefix("$self ").map_or((false, mark), |mark| (true, mark));
        out += before;
        out += "// options: ";
        out += if is_method { "$self " } else { "" };
        out += mark;
        out.push('\n');
        out += &before_shown;
        out += &shown(&after[start..end + "**options".len()], is_method, mark);
        out += if has_shown { "" } else { "\"" };
        rest = &after[shown_end..];
    }
    out + rest
}

#[test]
fn signatures() {
    let mut marks = 0;
    for entry in std::fs::read_dir(root().join("python/src")).expect("the folder") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|ending| ending == "rs") {
            let source = std::fs::read_to_string(&path).expect("a file");
            marks += source.matches("// options: ").count();
            let name = path.file_name().expect("a name").to_string_lossy();
            compare(&format!("python/src/{name}"), &with_signatures(&source));
        }
    }
    assert!(marks > 10, "only {marks} functions take options");
}

/// The words of a function's text on its options.
fn texts(mark: &str) -> String {
    let mut lines = Vec::new();
    for row in rows(mark) {
        let mut text = row.full_text();
        if let ParamKind::Choice(choices) = row.kind {
            for choice in choices {
                text += &format!(" ``\"{}\"``: {}", choice.name, choice.text);
            }
        }
        text += match row.kind {
            ParamKind::Length => " In the unit of the scans",
            ParamKind::Angle => " Radians",
            _ => "",
        };
        let mut range = range(row);
        if matches!(row.kind, ParamKind::Length | ParamKind::Angle) && !range.is_empty() {
            range = format!(", {range}");
        } else if !range.is_empty() {
            range = format!(" {}", sentence(&range));
        }
        text += &range;
        if !text.ends_with('.') {
            text.push('.');
        }
        match rule(row) {
            Some(rule) => text += &format!(" Default: {rule}."),
            None if matches!(row.kind, ParamKind::Flag | ParamKind::Choice(_)) => {
                text += &format!(" Default: ``{}``.", literal(row).replace('\'', "\""));
            }
            None => {
                text = format!("{}, default {}.", text.trim_end_matches('.'), plain_default(row).unwrap_or_default())
            }
        }
        let text = format!("{}: {text}", row.name);
        let mut wrapped = wrapped(&text, "        ", 120);
        wrapped[0] = wrapped[0][4..].to_owned();
        lines.extend(wrapped);
    }
    lines.join("\n")
}

#[test]
fn docstrings() {
    for schema in surfrecon::params::schemas() {
        compare(&format!("python/src/params/{}.txt", schema.operation), &texts(schema.operation));
    }
}

fn type_of(row: &ParamSpec) -> String {
    let plain = match row.kind {
        ParamKind::Length | ParamKind::Angle | ParamKind::Ratio => "float".to_owned(),
        ParamKind::Count => "int".to_owned(),
        ParamKind::Flag => "bool".to_owned(),
        ParamKind::Choice(choices) => {
            let names: Vec<String> = choices.iter().map(|choice| format!("\"{}\"", choice.name)).collect();
            format!("Literal[{}]", names.join(", "))
        }
    };
    format!("{plain} | None")
}

/// The types that files of the module declare themselves: a block a file, of the lines below a comment.
fn declared(comment: &str) -> Vec<String> {
    let folder = std::fs::read_dir(root().join("python/src")).expect("the folder");
    let mut paths: Vec<_> = folder.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    let sources = paths.iter().filter_map(|path| std::fs::read_to_string(path).ok());
    let blocks = sources.filter_map(|source| {
        let (_, rest) = source.split_once(&format!("\n// {comment}:\n"))?;
        let lines = rest.lines().map_while(|line| line.strip_prefix("//"));
        Some(lines.map(|line| format!("{}\n", line.strip_prefix(' ').unwrap_or(line))).collect::<String>())
    });
    blocks.collect()
}

/// The types of functions and classes.
fn declared_types() -> String {
    let all: String = declared("types").iter().map(|block| format!("\n{block}")).collect();
    // As a formatter has a comment behind a declaration.
    if all.is_empty() { all } else { all + "\n" }
}

/// The types of methods of `Job`.
fn declared_jobs() -> String {
    declared("types of Job").concat().lines().map(|line| format!("    {line}\n")).collect()
}

#[test]
fn types() {
    let name = "python/python/surfrecon/_native.pyi";
    let stub = std::fs::read_to_string(root().join(name)).expect("the types");
    let stub = replaced(name, &stub, "# types\n", "# end of types\n", &declared_types());
    let stub = replaced(name, &stub, "    # types of Job\n", "    # end of types of Job\n", &declared_jobs());
    let native = native();
    let list = listed(native.iter().map(String::as_str).collect());
    let stub = replaced(name, &stub, "__all__ = [\n", "]\n", &list);
    let (_, body) = stub.split_once("]\n").expect("the end of the list");
    let words: HashSet<&str> = body.split(|letter: char| !letter.is_alphanumeric() && letter != '_').collect();
    let reports = class_names().into_iter().filter(|class| words.contains(class)).collect();
    let stub = replaced(name, &stub, "from ._reports import (\n", ")\n", &imported(reports));
    let mut out = String::new();
    let mut skipping = false;
    for line in stub.split_inclusive('\n') {
        let text = line.trim();
        if text == "# end" {
            skipping = false;
        }
        if !skipping {
            out += line;
        }
        if let Some(mark) = text.strip_prefix("# options: ") {
            skipping = true;
            let indent = &line[..line.len() - line.trim_start().len()];
            for row in rows(mark) {
                let default = literal(row).replace('\'', "\"");
                out += &format!("{indent}{}: {} = {default},\n", row.name, type_of(row));
            }
        }
    }
    assert!(!skipping, "the last mark has no end");
    compare(name, &out);
}
