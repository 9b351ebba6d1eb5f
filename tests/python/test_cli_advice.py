"""Advice of the library in terms of the command line."""

import re
from pathlib import Path

from command_line import run
from surfrecon.cli.advice import TABLE, advised

ROOT = Path(__file__).resolve().parents[2]


def test_the_library_says_what_the_table_has():
    files = [*(ROOT / "rust-core").glob("*/src/**/*.rs"), *(ROOT / "python/src").glob("*.rs")]
    said = re.sub(r"\\\n\s*", "", " ".join(path.read_text("utf-8") for path in files)).replace('\\"', '"')
    for theirs, _ in TABLE:
        assert theirs in said, theirs


def test_the_command_line_has_the_options_that_it_advises():
    options = set(re.findall(r"--[a-z][a-z-]+", run("align", "--help").stdout + run("merge", "--help").stdout))
    for theirs, ours in TABLE:
        assert set(re.findall(r"--[a-z][a-z-]+", ours)) <= options, ours
        assert advised(f"a, {theirs}.") == f"a, {ours}."


def test_a_list_that_leads_out_of_its_folder_is_told_of_the_option(tmp_path):
    (tmp_path / "set.conf").write_text("bmesh ../a.ply 0 0 0 0 0 0 1\n")
    done = run("info", tmp_path / "set.conf")
    assert done.returncode == 1 and "or allow files outside (--allow-outside)" in done.stderr
