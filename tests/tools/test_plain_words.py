"""Figures of texts are those of known texts; what is not published is kept out of guides until it is."""

import check_tree
import plain_words
import pytest

PLAIN = "A scan is placed only if four checks pass. The report says which failed.\n"
RIDDLE = "What could lie in several places, or nowhere, is left out; the reason is named.\n"


def test_plain_sentences_have_no_problems():
    text = plain_words.markdown(PLAIN)
    assert [len(plain_words.WORD.findall(sentence)) for sentence in text.sentences] == [9, 5]
    assert text.figures()["words per sentence"] == 7
    assert not list(text.problems())


def test_riddles_are_told_with_the_sentence():
    found = list(plain_words.markdown(RIDDLE).problems())
    assert any("inverted" in problem and "What could lie" in problem for problem in found)
    assert any("semicolons" in problem for problem in found) and any("commas" in problem for problem in found)


@pytest.mark.parametrize(
    "around",
    [
        "# What, a heading; is none\n\n{}",
        "| a, b | c; d |\n|---|---|\n\n{}",
        "{}\n```python\na, b, c = d; e\n```\n",
        "{}\n![What, a picture; shows](a.png)\n",
        "{}\n<!-- from README.md: A, alone -->\n",
    ],
)
def test_what_is_no_prose_does_not_count(around):
    assert plain_words.markdown(around.format(PLAIN)).figures() == plain_words.markdown(PLAIN).figures()


def test_items_of_a_list_are_sentences_of_their_own():
    text = plain_words.markdown("It does three things:\n\n- it reads the scans\n- it places the scans\n  in a frame\n")
    assert len(text.sentences) == 3


def test_long_sentences_count_from_the_limit():
    long, short = (" ".join(["word"] * n) + "." for n in (plain_words.LONG + 1, plain_words.LONG))
    assert plain_words.markdown(f"{long}\n\n{short}").figures()["% of sentences over 25 words"] == 50


@pytest.mark.parametrize(
    "line",
    [
        "pip install surfrecon",
        "run `pip install 'surfrecon[cli]'` first",
        "cargo add surfrecon",
        "https://github.com/surfrecon/surfrecon/releases/latest/download/index.json",
    ],
)
def test_what_is_not_published_is_kept_out_until_it_is(line):
    before, after = "# Changelog\n\n## 0.2.0 (unreleased)\n", "# Changelog\n\n## 0.2.0\n"
    assert check_tree.unpublished(before, f"a\n{line}\n") == [(2, line)]
    assert not check_tree.unpublished(after, line)
    assert not check_tree.unpublished("## 0.3.0 (unreleased)\n\n## 0.2.0\n", line)


def test_what_is_built_here_may_be_said():
    assert not check_tree.unpublished("## 0.2.0 (unreleased)\n", "pip install target/wheels/surfrecon-*.whl")


def test_a_change_has_a_link():
    changelog = (
        "# Changelog\n\n## 0.2.0\n\n- [Linked](a.md).\n- Linked in\n  [line two](b.md).\n- Not\n  linked.\n\n### More\n"
    )
    assert check_tree.without_link(changelog) == [(8, "- Not\n  linked.\n")]


def test_all_pages_are_held_to_the_limits(monkeypatch, tmp_path):
    (tmp_path / "deep").mkdir()
    for name in ("README.md", "PARAMETERS.md", "deep/new.md", "deep/code.py"):
        (tmp_path / name).write_text(RIDDLE, "utf-8")
    monkeypatch.setattr(check_tree, "ROOT", tmp_path)
    monkeypatch.setattr(check_tree, "files", lambda: sorted(path for path in tmp_path.rglob("*") if path.is_file()))
    told = {problem.partition(":")[0] for problem in check_tree.word_problems()}
    assert told == {"README.md", "PARAMETERS.md", "deep/new.md"}
    for page in tmp_path.rglob("*.md"):
        page.write_text("| a |\n|---|\n| b; c |\n", "utf-8")
    told = {problem.rpartition(": make")[0] for problem in check_tree.word_problems()}
    assert told == {"README.md:3", "PARAMETERS.md:3", "deep/new.md:3"}


def test_rows_of_tables_have_no_semicolons_but_in_code():
    code = "```sh\n| a; b |\n```\n"
    assert not list(plain_words.rows_with_semicolons(f"| a | `b; c` | d&nbsp;e |\n\na; b\n\n{code}"))
    assert list(plain_words.rows_with_semicolons(f"{code}\n| a | b; c |\n")) == [(5, "| a | b; c |")]


def test_decisions_begin_with_their_verdict_and_are_in_the_index():
    folder = check_tree.ROOT / "docs" / "decisions"
    index = (folder / "README.md").read_text("utf-8")
    for path in folder.glob("*.md"):
        if path.name != "README.md":
            assert path.read_text("utf-8").splitlines()[2].startswith("**Verdict: "), path.name
            assert f"]({path.name})" in index
            assert (check_tree.ROOT / "docs" / "site" / "project" / "decisions" / path.name).is_file(), path.name


@pytest.mark.parametrize(
    "line",
    [
        "/// What lies outside.",
        "//! Who asks.",
        "    // Where they meet, one is left.",
        "let a = b; // Which of them was first.",
        "/// Outside.\n// What lies there.",
    ],
)
def test_comments_that_begin_with_a_question_are_told(line):
    number, _, text = list(plain_words.comments(f"fn a() {{}}\n{line}\n"))[-1]
    assert number == line.count("\n") + 2
    assert plain_words.QUESTION.match(text)


@pytest.mark.parametrize(
    "lines",
    [
        "/// Points outside.",
        "/// Points that lie\n/// What is more, outside.",
        "// Whether it is outside.",
        'let a = "http://example.com/What";',
        'let a = "What";',
    ],
)
def test_comments_begin_with_what_the_item_is(lines):
    assert not any(plain_words.QUESTION.match(text) for _, _, text in plain_words.comments(lines))


@pytest.mark.parametrize(
    ("lines", "number"),
    [
        ('"""What a module is for."""', 1),
        ('class A:\n    """\n    Who asks.\n    """', 2),
        ('def a():\n    """Which of them is meant.\n\n    The first.\n    """', 2),
        ('a = 1\n"""Where it lies."""', 2),
        ("# What lies outside.", 1),
        ("def a():\n    # Where it ends.\n    return 1", 2),
        ("a = 1  # Which of them was first.", 1),
        ("a = 1  # The first.\n# What comes then.", 2),
    ],
)
def test_comments_of_python_that_begin_with_a_question_are_told(lines, number):
    found = plain_words.python_comments(f"{lines}\n")
    assert [line for line, text in found if plain_words.QUESTION.match(text)] == [number]


@pytest.mark.parametrize(
    "lines",
    [
        '"""The content.\n\nWhat is more, it is outside.\n"""',
        "# Points that lie\n# What is more, outside.",
        'a = "# What lies outside."',
        'a = "What lies outside."',
        "# Whether it is outside.",
    ],
)
def test_comments_of_python_begin_with_what_the_item_is(lines):
    assert not any(plain_words.QUESTION.match(text) for _, text in plain_words.python_comments(f"{lines}\n"))


def test_doc_comments_are_prose_without_code():
    code = f"/// {PLAIN}///\n/// ```\n/// a; b, c\n/// ```\n// Not; for readers.\nfn a() {{ b; c }}\n/// # Errors\n"
    assert plain_words.doc_comments(code).figures() == plain_words.markdown(PLAIN).figures()
    assert plain_words.doc_comments(f"//! {RIDDLE}").inverted() == [RIDDLE.strip()]


@pytest.fixture
def crates(monkeypatch, tmp_path):
    """Two crates, the second one within the first, and the means to write files into them."""
    monkeypatch.setattr(check_tree, "ROOT", tmp_path)
    monkeypatch.setattr(check_tree, "files", lambda: sorted(path for path in tmp_path.rglob("*") if path.is_file()))
    for folder in ("core/src", "core/inner/src"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "lib.rs").write_text(f"//! {PLAIN}", "utf-8")
        (tmp_path / folder).with_name("Cargo.toml").touch()
    return tmp_path


def test_figures_of_doc_comments_are_those_of_a_crate(crates):
    assert not list(check_tree.comment_problems())
    (crates / "core/inner/src/a.rs").write_text("/// A place; it lies outside.\n", "utf-8")
    (found,) = check_tree.comment_problems()
    assert found.startswith("core/inner: ") and "semicolons" in found


def test_a_comment_that_begins_with_a_question_is_told_with_its_line(crates):
    (crates / "core/src/a.rs").write_text("/// Places.\nfn a() {\n    // Where it ends.\n}\n", "utf-8")
    (crates / "a.py").write_text("# Places.\na = 1\n# What it counts.\nb = 2\n", "utf-8")
    python, rust = check_tree.comment_problems()
    assert python.startswith("a.py:3: ") and rust.startswith("core/src/a.rs:3: ")


def test_docstrings_are_counted_without_their_examples():
    code = '''"""One. Two; three.

>>> a; b
"""

def f():
    """Four; five."""
    x = "six; seven"
'''
    assert plain_words.docstrings(code).figures()["semicolons per 1,000 words"] == pytest.approx(2 / 5 * 1000)
