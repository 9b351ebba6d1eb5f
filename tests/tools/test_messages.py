"""Messages are found in the sources of all languages, also new ones, and their form is held."""

import check_tree
import message_form
import messages
import pytest

GOOD = "voxel is -1, but must be positive"
IN_FILE = "rust-core/io/src/import/a.rs"


def found(code, name="rust-core/a.rs"):
    """Texts that stand alone in a code, and those that are parts."""
    all_of = [one for one in messages.READERS[name[name.rindex(".") :]](name, code) if one.whole]
    return [one.text for one in all_of]


@pytest.mark.parametrize(
    "code",
    [
        'fn a() {{ return Err(Error::input("{}")); }}',
        'fn a() {{ Error::input(format!("{}")) }}',
        'fn a() {{ x.ok_or_else(|| Error::format(path, "whole file", "{}")) }}',
        'fn a() -> Result<(), String> {{ Err("{}".to_owned()) }}',
        'fn a() {{ x.map_err(|_| Failure::new(SRF_ERR_INPUT, format!("{}"))) }}',
        'fn a() {{ Err(PyTypeError::new_err(match x {{ 1 => "{}", _ => y }})) }}',
        'fn refused(problem: &str) -> Error {{ Error::input(problem) }} fn a() {{ refused("{}") }}',
        'fn a() {{ let wrong = |text: String| Failure::new(E, format!("a: {{text}}")); wrong("{}".into()) }}',
        'fn a() {{ let problem = format!("{}", 3); told(problem); }}',
        'fn a() {{ self.fail(at, r"{}") }}',
        'fn a() {{ // "no text"\n let x = \'"\'; Err("{}") }}',
    ],
)
def test_errors_of_rust_are_found(code):
    assert GOOD in found(code.format(GOOD))


@pytest.mark.parametrize(
    "code",
    [
        '/// "{}"\nfn a() {{}}',
        'fn a() {{ x.expect("{}") }}',
        'fn a() {{ assert!(x, "{}"); }}',
        'fn a() {{ unreachable!("{}") }}',
        '#[deprecated(note = "{}")] fn a() {{}}',
        'params! {{ Err("{}") }}',
        'fn a() {{}}\n#[cfg(test)]\nmod tests {{ fn b() {{ Err("{}") }} }}',
        'fn a() {{ Err(b"{}") }}',
        'fn a() {{ Error::format(path, "{}", problem) }}',
    ],
)
def test_what_no_reader_sees_is_no_message_of_rust(code):
    assert not found(code.format(GOOD))


def test_literals_of_rust_over_several_lines_are_one_text():
    assert found('fn a() { Err("voxel is -1, \\\n        but \\"x\\" is allowed") }') == [
        'voxel is -1, but "x" is allowed'
    ]


@pytest.mark.parametrize(
    "code",
    [
        "raise ValueError('{}')",
        "raise Refused(f'{}')",
        "raise Refused('{}' if a else b)",
        "raise InputError('voxel is -1,' ' but must be positive')",
        "return TypeError('{}')",
        "cls.poll_message_set(told('{}'))",
    ],
)
def test_errors_of_python_are_found(code):
    assert found(f"def a():\n    {code.format(GOOD)}\n", "python/python/a.py") == [GOOD]


def test_values_in_texts_of_python_are_braces():
    assert found("raise InputError(f'{name!r}: {x + 1} is too many')", "python/python/a.py") == ["{}: {} is too many"]


def test_docstrings_and_helps_are_no_messages_of_python():
    code = 'def a():\n    """voxel is -1, but must be."""\n    x.add_argument("a", help="voxel is -1, but must be")\n'
    assert not list(messages.python_messages("python/python/a.py", code))


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ('refuse("voxel is -1");', "voxel is -1"),
        ('refuse(std::string(name) + " must be (0) to " + shown(3) + ".");', "{} must be (0) to {}."),
        ('refuse("a " +\n    b);', "a {}"),
    ],
)
def test_refusals_of_cpp_are_found(code, text):
    assert found(code, "meshlab-plugin/src/a.cpp") == [text]


def whole(text, name="rust-core/a.rs", of_file=False):
    """A message that stands alone."""
    return messages.Message(name, 1, text, True, of_file)


@pytest.mark.parametrize(
    "text",
    [
        GOOD,
        "{name} must be {allowed}, got {value}{unit}",
        "voxel is -1. Leave it out to have it measured.",
        "{}: the name must end in {list} to hold {held}",
        "there is no parameter {name:?}. {}",
        "the mesh has no triangles: export it with its faces",
        "its pose: {problem}",
        "cancelled",
        "{}: {problem}",
    ],
)
def test_messages_of_the_right_form_have_no_faults(text):
    assert not list(message_form.faults(whole(text)))


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("voxel is -1; it must be positive", "semicolon"),
        ("voxel must be positive, " + "and " * 25 + "finite", "sentence of 30 words"),
        ("what is kept of them, must be a folder", "question word"),
        ("{name}: invalid value, which must be a number", "vague"),
        ("The voxel must be positive", "capital"),
        ("voxel must be positive. Leave it out to have it measured", "full stop"),
        ("voxel must be positive.", "full stop"),
        ("the voxel is -1", "neither what is allowed"),
        ("the scan {name} is empty", "neither what is allowed"),
        ("try again", "neither a value nor a thing"),
    ],
)
def test_each_fault_of_the_form_is_told(text, fault):
    (told,) = message_form.faults(whole(text))
    assert fault in told


def test_messages_of_windows_begin_with_a_capital():
    assert not list(message_form.faults(whole("The layer {} is empty: choose another", "meshlab-plugin/src/a.cpp")))
    (told,) = message_form.faults(whole("the layer {} is empty: choose another", "meshlab-plugin/src/a.cpp"))
    assert "small letter" in told


def test_faults_of_files_need_no_remedy():
    assert list(message_form.faults(whole("the file ends")))
    assert not list(message_form.faults(whole("the file ends", IN_FILE, of_file=True)))
    (one,) = messages.rust_messages(IN_FILE, 'fn a() { Err("the file ends") }')
    assert one.of_file


def test_parts_of_messages_are_plain_as_well():
    part = messages.Message("rust-core/a.rs", 1, "scale it; cut it", False)
    assert list(message_form.faults(part)) and not list(message_form.faults(whole("scale it to {}, or cut it")))


@pytest.fixture
def tree(monkeypatch, tmp_path):
    """A tree with one message of each language, and the means to write files into it."""
    monkeypatch.setattr(check_tree, "ROOT", tmp_path)
    monkeypatch.setattr(message_form, "EXCEPTIONS", {})
    monkeypatch.setattr(message_form, "INTERNAL", {})
    for name, code in (
        ("rust-core/a/src/lib.rs", f'mod b;\n#[cfg(test)]\nmod c;\nfn a() {{ Err("{GOOD}") }}'),
        ("python/python/surfrecon/a.py", f'raise ValueError("{GOOD}")\n'),
        ("blender-addon/extension/a.py", f'raise Refused("The {GOOD}")\n'),
        ("meshlab-plugin/src/a.cpp", f'refuse("The {GOOD}");'),
    ):
        path = tmp_path / name
        path.parent.mkdir(parents=True)
        path.write_text(code, "utf-8")
    return tmp_path


def test_a_new_message_is_held_to_the_form(tree):
    assert not list(check_tree.message_problems())
    (tree / "rust-core/a/src/b.rs").write_text('fn b() {\n    Err("the voxel is -1")\n}', "utf-8")
    (told,) = check_tree.message_problems()
    assert told.startswith("rust-core/a/src/b.rs:2: ") and "is -1" in told


@pytest.mark.parametrize("name", ["rust-core/a/src/c.rs", "rust-core/a/tests/d.rs", "rust-core/a/examples/e.rs"])
def test_tests_and_examples_refuse_nothing(tree, name):
    (tree / name).parent.mkdir(exist_ok=True)
    (tree / name).write_text('fn b() { Err("the voxel is -1") }', "utf-8")
    assert not list(check_tree.message_problems())


def test_exceptions_of_messages_are_those_that_are_needed(tree, monkeypatch):
    (tree / "rust-core/a/src/b.rs").write_text('fn b() { Err("the voxel is -1") }', "utf-8")
    monkeypatch.setattr(message_form, "EXCEPTIONS", {"the voxel is": "a reason"})
    assert not list(check_tree.message_problems())
    monkeypatch.setattr(message_form, "EXCEPTIONS", {"the voxel is": "a reason", "none": "a reason"})
    monkeypatch.setattr(message_form, "INTERNAL", {"rust-core/a/src/none.rs": "a reason"})
    told = list(check_tree.message_problems())
    assert len(told) == 2 and all("take it out" in one for one in told)


def test_the_messages_of_the_tree_are_found():
    all_of = {path.relative_to(check_tree.ROOT).parts[0]: 0 for path in messages.sources()}
    for path in messages.sources():
        all_of[path.relative_to(check_tree.ROOT).parts[0]] += sum(one.whole for one in messages.messages(path))
    # A reader of sources that finds nothing holds nothing to the form.
    assert all_of["rust-core"] > 500 and all_of["c-api"] > 60 and all_of["python"] > 150
    assert all_of["blender-addon"] > 80 and all_of["meshlab-plugin"] > 30
