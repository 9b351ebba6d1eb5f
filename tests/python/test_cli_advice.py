"""Advice of the library in terms of the command line."""

import re
from pathlib import Path

from command_line import run
from heaps import look
from surfrecon.cli.advice import TABLE, advised, advised_all
from surfrecon.cli.commands import COMMANDS

ROOT = Path(__file__).resolve().parents[2]


def test_the_library_says_what_the_table_has():
    files = [*(ROOT / "rust-core").glob("*/src/**/*.rs"), *(ROOT / "python/src").glob("*.rs")]
    said = re.sub(r"\\\n\s*", "", " ".join(path.read_text("utf-8") for path in files)).replace('\\"', '"')
    for theirs, _ in TABLE:
        assert theirs in said, theirs


def test_names_of_parameters_are_options_of_their_command():
    for command in COMMANDS.values():
        for name, row in command.options().items():
            is_number = row.kind in ("angle", "count", "length", "number", "ratio")
            option = f"--{name.replace('_', '-')}"
            assert advised(f'say {name} = "b".', command.name) == f"say {option} b."
            if is_number or "_" in name:
                assert advised(f"a: raise {name}, or not", command.name) == f"a: raise {option}, or not"
                assert advised(f"and {name} allows 3", command.name) == f"and {option} allows 3"
            if "_" in name:
                assert advised(f"{name} must be > 0", command.name) == f"{option} must be > 0"
            for kept in (f'"{name}"', f"in/{name}.ply", f"{name}s", f"{name}/a.ply", f"a_{name}"):
                assert advised(f"raise {kept}", command.name) == f"raise {kept}"


def test_an_option_of_another_command_is_said_with_that():
    assert advised('say start = "sequence".', "align") == "say --start sequence."
    assert advised('say start = "sequence".', "merge") == "say --start sequence (of surfrecon align)."


def test_manifests_have_parameters_by_their_names():
    text = "a job: grazing_limit must be > 0, or raise reach"
    assert advised(text, "batch") == text


def test_words_of_english_are_no_options():
    for text in ("use a smaller mesh, or raise the limit", "a voxel smaller than 3", "read as depth images"):
        assert all(advised(text, command) == text for command in COMMANDS)
    assert advised("choose a larger voxel", "info") == "choose a larger voxel"


def test_points_are_picked_elsewhere():
    said = advised("give it a rough pose, or pairs of points", "align")
    assert said == "give it a rough pose, or pairs of points (picked in Python, by surfrecon.Pick)"


def test_sentences_of_reports_name_options():
    report = {"messages": ["raise reach"], "scans": [{"name": "raise reach", "reason": "raise reach"}]}
    said = {"messages": ["raise --reach"], "scans": [{"name": "raise reach", "reason": "raise --reach"}]}
    assert advised_all(report, "align") == said


def test_scans_without_poses_are_told_of_options_in_reports_too(tmp_path):
    """Scans in their sensors' frames, and nothing but small motions allowed."""
    for image in look(60)[:3]:
        image.write(tmp_path / f"{image.name}.ply")
    done = run("align", tmp_path, "--start", "rough", "--reach", "0.001", "--json")
    for text in (done.stdout, run("align", tmp_path, "--start", "rough", "--reach", "0.001").stdout):
        assert "no scan has a pose, and --start rough looks near poses alone. Say --start unknown instead" in text


def test_a_list_that_leads_out_of_its_folder_is_told_of_the_option(tmp_path):
    (tmp_path / "set.conf").write_text("bmesh ../a.ply 0 0 0 0 0 0 1\n")
    done = run("info", tmp_path / "set.conf")
    assert done.returncode == 1 and "or allow files outside (--allow-outside)" in done.stderr
