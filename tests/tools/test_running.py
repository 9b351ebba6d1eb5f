"""The tools that run the tests: steps in their order, outcomes as they are, a place for every test, a cost for each."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from testing import catalogue, costs, outputs
from testing.graph import Graph, Step, chosen
from testing.outcome import Test
from testing.rust import Program

ROOT = Path(__file__).resolve().parents[2]


def python(code):
    """A call that runs some Python."""
    return [sys.executable, "-c", code]


def ended(folder, *steps, cores=2):
    """The outcome of each step, by its name."""
    return {one.step.name: one for one in Graph(steps, folder / "logs", folder, cores).run()}


def test_steps_wait_for_what_they_need_and_others_fail_with_it(tmp_path):
    found = ended(
        tmp_path,
        Step("after", python("open('made').read()"), needs=("before",)),
        Step("before", python("import time; time.sleep(0.2); open('made', 'w')")),
        Step("broken", python("raise SystemExit(4)")),
        Step("without", python(""), needs=("broken",)),
        Step("last", python(""), needs=("without",)),
        Step("absent", python("raise SystemExit(3)"), unavailable=3),
        Step("passed over", python(""), needs=("absent",)),
    )
    how = {name: one.how for name, one in found.items()}
    assert how == {
        "after": "ok",
        "before": "ok",
        "broken": "failed",
        "without": "not run",
        "last": "not run",
        "absent": "unavailable",
        "passed over": "unavailable",
    }
    assert [found[name].tally.failed for name in ("after", "broken", "without", "last")] == [0, 1, 1, 1]
    assert [found[name].tally.skipped for name in ("absent", "passed over")] == [1, 1]


def test_what_one_step_holds_another_does_not_use(tmp_path):
    exclusive = "import os, time; os.mkdir('held'); time.sleep(0.1); os.rmdir('held')"
    found = ended(tmp_path, *(Step(f"{k}", python(exclusive), holds=("it",), cores=0) for k in range(4)))
    assert {one.how for one in found.values()} == {"ok"}


def test_no_more_steps_run_at_once_than_there_is_room_for(tmp_path):
    beside = (
        "import os, time; me = str(os.getpid()); open(me, 'w'); n = len(os.listdir()) - 1; time.sleep(0.2); print(n)"
    )
    beside += "; os.remove(me)"
    found = ended(tmp_path, *(Step(f"{k}", python(beside)) for k in range(6)), cores=1)
    assert max(int(one.step.output.shown[0]) for one in found.values()) <= 2


def test_steps_that_are_named_come_with_those_that_they_need():
    steps = [Step("a", []), Step("b", [], needs=("a",)), Step("c", [], needs=("b",)), Step("d", [])]
    assert [one.name for one in chosen(steps, ["c"])] == ["a", "b", "c"]
    assert chosen(steps, []) == steps
    with pytest.raises(SystemExit, match="no step is called 'e'. The steps are: a, b, c, d."):
        chosen(steps, ["e"])


def test_a_step_that_nobody_knows_or_that_is_there_twice_is_refused(tmp_path):
    with pytest.raises(ValueError, match="nobody"):
        Graph([Step("a", [], needs=("nobody",))], tmp_path, tmp_path)
    with pytest.raises(ValueError, match="twice"):
        Graph([Step("a", []), Step("a", [])], tmp_path, tmp_path)


def test_a_command_that_cannot_be_made_or_found_fails(tmp_path):
    found = ended(
        tmp_path, Step("none", ["no-such-program-anywhere"]), Step("raises", lambda: {}[0]), Step("fine", python(""))
    )
    assert [found[name].how for name in ("none", "raises", "fine")] == ["failed", "failed", "ok"]


def rust(*events):
    """The outcomes read from the JSON lines of a Rust program that took two seconds."""
    output = outputs.RustOutput("program")
    for event in events:
        output.line(event if isinstance(event, str) else json.dumps({"type": "test"} | event))
    output.ended(2.0)
    return output


def test_outcomes_of_rust():
    output = rust(
        {"name": "a", "event": "started"},
        {"name": "a", "event": "ok", "exec_time": 3.0},
        "{ not of the runner",
        {"name": "b", "event": "failed", "exec_time": 1.0, "stdout": "it is\nred"},
        {"name": "c", "event": "ok", "exec_time": 0.0, "stdout": "SKIPPED: no data\n"},
        {"name": "d", "event": "ignored"},
    )
    assert str(output.tally) == "1 passed, 1 failed, 1 skipped"
    assert [(test.name, test.cpu) for test in output.tests] == [
        ("program a", 1.5),
        ("program b", 0.5),
        ("program c", 0.0),
    ]
    assert output.shown == ["{ not of the runner", "---- b", "it is", "red", "", "SKIPPED: no data (c)"]


TESTS = """
import pytest, time
def test_a(): sum(range(10**7))
@pytest.mark.thorough
def test_b(): pass
@pytest.mark.parametrize("k", [1, 2])
def test_c(k): assert k == 1
def test_d(): pytest.skip("no reason")
@pytest.fixture
def broken(): raise ValueError
def test_e(broken): pass
class TestClass:
    def test_f(self): pass
"""


def recorded(folder, tier):
    """The outcomes read from a run of pytest over TESTS."""
    (folder / "pytest.ini").write_bytes((ROOT / "tests" / "pytest.ini").read_bytes())
    (folder / "conftest.py").write_bytes((ROOT / "tests" / "conftest.py").read_bytes())
    (folder / "test_it.py").write_text(TESTS)
    record = folder / f"{tier}.jsonl"
    output = outputs.PytestOutput("step", record)
    env = {"SURFRECON_TEST_RECORD": str(record), "SURFRECON_TIER": tier, "PATH": ""}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(folder)]
    subprocess.run(command, cwd=folder, env=env, stdout=subprocess.DEVNULL, check=False)
    output.ended(0.0)
    return output


def test_outcomes_of_pytest_and_the_tiers(tmp_path):
    first, everything = recorded(tmp_path, "first"), recorded(tmp_path, "all")
    assert str(first.tally) == "3 passed, 2 failed, 1 skipped"
    assert str(everything.tally) == "4 passed, 2 failed, 1 skipped"
    found = {test.name: test for test in everything.tests}
    assert (
        found["step: test_it.py::test_c[2]"].outcome == "failed"
        and found["step: test_it.py::test_e"].outcome == "failed"
    )
    assert found["step: test_it.py::test_a"].cpu > 0.01
    names = {catalogue.plain(test.name) for test in everything.tests}
    declared = catalogue.declared(tmp_path / "test_it.py")
    assert {f"test_it.py::{name}" for name in declared} == names
    assert [name for name, thorough in declared.items() if thorough] == ["test_b"]


def test_a_file_of_tests_that_does_not_load_is_a_failure(tmp_path):
    (tmp_path / "test_broken.py").write_text("import no_such_module_anywhere\n")
    assert recorded(tmp_path, "all").tally.failed == 1


def test_a_test_of_neither_tier_is_told_and_so_is_one_that_did_not_run():
    rows = [
        ("p a", {"first", "all"}),
        ("p thorough", {"all"}),
        ("python/test_x.py::test_y", {"first", "all"}),
        ("new/test_z.py::test", set()),
    ]
    ran = [Test("p a", "passed", 0.0), Test("Python: python/test_x.py::test_y[1]", "passed", 0.0)]
    assert [line.split(":")[0] for line in catalogue.problems(rows, ran, "first")] == ["new/test_z.py"]
    told = list(catalogue.problems(rows, ran[:1], "all"))
    assert any(line.startswith("p thorough belongs") for line in told)
    assert any(line.startswith("python/test_x.py::test_y belongs") for line in told)
    assert len(list(catalogue.problems(rows, ran[:1], "first", {"tests/python"}))) == 1


def test_the_closest_folder_decides_the_tiers():
    folders = [
        ("tests/meshlab", ("first", "all")),
        ("tests/meshlab/test_gui.py", ("all",)),
        ("tests/meshlab", ("all",)),
    ]
    assert catalogue.of_file(ROOT / "tests/meshlab/test_gui.py", folders) == {"all"}
    assert catalogue.of_file(ROOT / "tests/meshlab/test_merge.py", folders) == {"first", "all"}
    assert catalogue.of_file(ROOT / "tests/mesh/test_merge.py", folders) == set()


def test_every_file_of_tests_in_this_tree_has_a_tier():
    from testing import plan

    rows = catalogue.listed({}, plan.Plan(plan.ALL, ROOT / "out" / "tests" / "of_tests").folders)
    assert len(rows) > 500 and not [name for name, tiers in rows if "all" not in tiers]


def test_costs_are_written_and_the_dearest_are_told(tmp_path):
    slow = Step("slow", python("sum(range(3 * 10**7))"))
    slow.output.tests.append(Test("slow test", "passed", 20.0, 11.0))
    done = Graph([slow, Step("quick", python(""))], tmp_path / "logs", tmp_path).run()
    found = costs.written(done, 30.0, "first", 0.5, tmp_path / "times.json")
    assert json.loads((tmp_path / "times.json").read_text()) == found
    told = list(costs.table(found))
    assert "slow test" in told[1] and "step: slow" in told[2]
    assert told.index("tests of the first tier that took more than 10 s of CPU:") == len(told) - 3
    assert not any("more than" in line for line in costs.table(found | {"tier": "all"}))


def test_programs_list_their_tests(tmp_path):
    file = tmp_path / "program"
    listed = "printf 'a: test\\nb::thorough: test\\nc: test\\n\\n3 tests'"
    file.write_text(f"#!/bin/sh\ncase \"$*\" in *--ignored*) echo 'c: test' ;; *) {listed} ;; esac\n")
    file.chmod(0o755)
    rows = dict(catalogue.listed({"p": Program("p", tmp_path, file)}, []))
    assert rows["p a"] == {"first", "all"} and rows["p b::thorough"] == {"all"} and "p c" not in rows
