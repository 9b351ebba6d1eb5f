"""The command line among other programs: closed pipes, full disks, Ctrl-C at any time, names that are not UTF-8."""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import surfrecon
from command_line import ENVIRONMENT, PROGRAM, run, start
from shapes import torus, torus_scans

POSIX = os.name == "posix"
posix = pytest.mark.skipif(not POSIX, reason="signals, limits and devices of POSIX")
# Of a name that is not UTF-8, as POSIX has it; elsewhere no system lets files have one.
ODD = os.fsdecode(b"sc\xe9an \xff") if sys.platform == "linux" else "scéan ÿ"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Scans that take about a second to merge into small cells."""
    folder = tmp_path_factory.mktemp("data")
    surfrecon.write_scans(folder / "ring.conf", torus_scans(pixels=60))
    torus(24).write(folder / "torus.ply")
    return folder


def closed_pipe():
    """The end of a pipe that nobody reads."""
    reading, writing = os.pipe()
    os.close(reading)
    return writing


SAYING = {
    "help": ["merge", "--help"],
    "version": ["--version"],
    "info": ["info", "torus.ply"],
    "json": ["info", "torus.ply", "--json"],
    "completion": ["completion", "bash"],
    "merge": ["merge", "ring.conf", "-o", "{}/a.ply", "--voxel", "0.1"],
    "merge json": ["merge", "ring.conf", "-o", "{}/a.ply", "--voxel", "0.1", "--json"],
    "batch": ["batch", "jobs.toml", "--report", "{}/a.json"],
}


def output_that_goes_nowhere(folder, tmp_path, output, name):
    if name == "completion":
        pytest.importorskip("shtab")
    (folder / "jobs.toml").write_text('[[job]]\ncommand = "info"\ninputs = ["torus.ply"]\nreport = "info.json"\n')
    arguments = [argument.format(tmp_path) for argument in SAYING[name]]
    # Without a buffer what is said is written at once, with one in the end.
    for buffer in ({}, {"PYTHONUNBUFFERED": "1"}):
        options = {"cwd": folder, "stderr": subprocess.PIPE, "env": ENVIRONMENT | buffer}
        done = nowhere(output, arguments, options)
        assert "Exception" not in done.stderr
        said = [line for line in done.stderr.splitlines() if "quaternions" not in line and "batch: info" not in line]
        if output == "closed pipe":
            assert (done.returncode, said) == (141, [])
        else:
            reason = "is closed" if output == "closed" else "No space left on device"
            assert done.returncode == 1 and len(said) == 1 and reason in said[0] and "standard output" in said[0]
        # The result is whole all the same.
        if "-o" in arguments:
            assert surfrecon.read(tmp_path / "a.ply").check().is_manifold
            (tmp_path / "a.ply").unlink()
        if "--report" in arguments:
            assert json.loads((tmp_path / "a.json").read_text())["jobs"][0]["state"] in ("done", "up to date")
            (tmp_path / "a.json").unlink()


def nowhere(output, arguments, options):
    """A command whose output can't be written."""
    if output == "closed":
        return run(*arguments, preexec_fn=lambda: os.close(1), **options)
    if output == "full disk":
        if not os.path.exists("/dev/full"):
            pytest.skip("this system has no /dev/full")
        with open("/dev/full", "w") as stdout:
            return run(*arguments, stdout=stdout, **options)
    stdout = closed_pipe()
    try:
        return run(*arguments, stdout=stdout, **options)
    finally:
        os.close(stdout)


def no_stream_at_all_does_not_harm_the_result(folder, tmp_path):
    """A file that is opened while a standard stream is closed would get its number, and what is printed its content."""
    expected = run("merge", folder / "ring.conf", "-o", tmp_path / "a.ply", "--voxel", "0.1", "--no-provenance")
    assert expected.returncode == 0
    for closed in ([0], [2], [0, 1, 2]):
        arguments = ["merge", folder / "ring.conf", "-o", tmp_path / "b.ply", "--voxel", "0.1", "--no-provenance"]
        close = lambda closed=closed: [os.close(number) for number in closed]  # noqa: E731
        done = subprocess.run([*PROGRAM, *arguments], env=ENVIRONMENT, preexec_fn=close, timeout=100)
        assert done.returncode == (1 if 1 in closed else 0)
        assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()
        (tmp_path / "b.ply").unlink()


def files_do_not_get_the_numbers_of_streams(_, tmp_path):
    program = """
import os, sys
from surfrecon.cli import streams
streams.prepare()
os._exit(os.open(sys.argv[1], os.O_WRONLY | os.O_CREAT))
"""
    close = lambda: [os.close(number) for number in range(3)]  # noqa: E731
    command = [sys.executable, "-c", program, tmp_path / "a"]
    assert subprocess.run(command, env=ENVIRONMENT, preexec_fn=close, timeout=100).returncode > 2


def a_full_disk_leaves_what_was_there(folder, tmp_path, ending):
    """The system refuses to let any file grow beyond a number of bytes."""
    resource = pytest.importorskip("resource")
    report = tmp_path / "a.json"
    arguments = ["info", folder / "torus.ply"]
    if ending != "json":
        arguments = ["convert", folder / "torus.ply", "-o", tmp_path / f"a.{ending}"]
    arguments += ["--report", report]
    assert run(*arguments).returncode == 0
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    whole = len(before[f"a.{ending}"])
    # A report has times, whose digits differ in number from run to run.
    least_missing = 64 if ending == "json" else 1
    for room in sorted({0, 1, whole // 2, whole - least_missing}):
        limits = (room, resource.RLIM_INFINITY)
        done = run(*arguments, preexec_fn=lambda limits=limits: resource.setrlimit(resource.RLIMIT_FSIZE, limits))
        assert done.returncode == 1 and str(tmp_path) in done.stderr and "too large" in done.stderr, done.stderr
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    if ending == "json" and os.path.exists("/dev/full"):
        done = run(*arguments[:-1], "/dev/full")
        assert done.returncode == 1 and "/dev/full: No space left on device" in done.stderr


# Says a dot once the program itself cares for signals: what Python loads before that answers Ctrl-C as in any program.
BEGUN = """
import os, signal
from surfrecon.cli import main
first = signal.signal
def told(*arguments):
    signal.signal = first
    before = first(*arguments)
    os.write(1, b".")
    return before
signal.signal = told
main()
"""


def begun(arguments, **options):
    """Starts the command line and waits until it has begun."""
    program = subprocess.Popen(
        [sys.executable, "-c", BEGUN, *map(str, arguments)],
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        **options,
    )
    assert program.stdout.read(1) == b"."
    return program


def stopped(arguments, wait, numbers, **options):
    """Exit code and errors of a command that gets signals after a time."""
    program = begun(arguments, **options)
    time.sleep(wait)
    for number in numbers:
        program.send_signal(number)
        time.sleep(0.002)
    _, said = program.communicate(timeout=100)
    said = said.decode()
    assert "Traceback" not in said and "Exception" not in said, said
    return program.returncode, said


def commands_to_stop(folder, out):
    """Commands that write into a folder."""
    ring, report = folder / "ring.conf", out / "report.json"
    manifest = folder / f"{out.name}.toml"
    job = {"command": "merge", "inputs": [str(ring)], "output": str(out / "a.ply")}
    lines = [f"{key} = {json.dumps(value)}" for key, value in job.items()]
    manifest.write_text("\n".join(["[[job]]", *lines, "parameters.voxel = 0.02"]), "utf-8")
    return {
        "merge": ["merge", ring, "-o", out / "a.glb", "--voxel", "0.02", "--report", report],
        "convert": ["convert", ring, "-o", out / "a.conf", "--report", report],
        "batch": ["batch", manifest],
        "align": ["align", *sorted(folder.glob("scan*.ply"))[:5], "-o", out / "a.tum", "--fixed", "0"],
        "measure": ["measure", folder / "torus.ply", ring, "--report", report],
    }


def ctrl_c_at_any_time_leaves_nothing_or_all(folder, tmp_path, name):
    whole = tmp_path / "whole"
    whole.mkdir()
    program = begun(commands_to_stop(folder, whole)[name])
    began = time.monotonic()
    assert program.communicate(timeout=100) and program.returncode == 0
    length = time.monotonic() - began
    expected = sorted(path.name for path in whole.iterdir())
    codes = []
    for k in range(14):
        out = tmp_path / f"{k}"
        out.mkdir()
        code, said = stopped(commands_to_stop(folder, out)[name], length * k / 12, [signal.SIGINT])
        codes.append(code)
        # Before it listens the system ends it, which shells call 130, too.
        assert code in (0, 130, -signal.SIGINT), said
        left = sorted(path.name for path in out.iterdir())
        if code == 130:
            assert said.splitlines()[-1] == f"surfrecon: {name}: stopped"
        # Once all is written an interrupt changes nothing; a job is done then, whatever becomes of those after it.
        if code == 130 and name == "batch":
            assert left in ([], expected), (k, left)
        else:
            assert left == (expected if code == 0 else []), (k, code, left)
        if left and (out / "report.json").exists():
            for file in json.loads((out / "report.json").read_text())["outputs"]:
                with open(file["path"], "rb") as content:
                    assert hashlib.file_digest(content, "sha256").hexdigest() == file["sha256"]
        shutil.rmtree(out)
    assert any(code != 0 for code in codes)


# The script that is installed as the program.
INSTALLED = "import sys\nfrom surfrecon.cli import main\nif __name__ == '__main__':\n    sys.exit(main())\n"


def ctrl_c_from_the_start(folder, tmp_path, how):
    """Python takes a hundredth of a second to begin. Nothing is traced once the package's first module has run."""
    (tmp_path / "surfrecon").write_text(INSTALLED, "utf-8")
    program = PROGRAM if how == "module" else [sys.executable, tmp_path / "surfrecon"]
    arguments = ["merge", folder / "ring.conf", "-o", tmp_path / "a.ply", "--voxel", "0.004"]
    package = os.path.dirname(surfrecon.__file__)
    for wait in (*(k / 250 for k in range(50)), *(k / 20 for k in range(4, 21))):
        options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        began = subprocess.Popen([*program, *arguments], env=ENVIRONMENT, **options)
        time.sleep(wait)
        began.send_signal(signal.SIGINT)
        said = began.communicate(timeout=100)[1].decode()
        if "Traceback" in said:
            # Of Python's beginning, which no package has a say in, and of finding and running the first module of this
            # one.
            frames = [line for line in said.splitlines() if f'File "{package}' in line]
            first, rest = frames[:1], frames[1:]
            assert all(f'{package}{os.sep}__init__.py", line' in line for line in first), said
            assert all(f'{package}{os.sep}_interrupts.py", line' in line for line in rest), said
            assert "_interrupts" in said or not frames, said
        else:
            assert began.returncode in (130, -signal.SIGINT) and len(said.splitlines()) < 2, said
        assert [path.name for path in tmp_path.iterdir()] == ["surfrecon"]


# Interrupts itself where a function of a module is called; or while a class is made there, when Python makes an error
# of its own of what is raised; or at the end of an object, when nothing can be raised.
AT_A_PLACE = """
import importlib, os, signal, sys
from surfrecon.cli import main
how, module, name = (sys.argv.pop(1) for _ in range(3))
module = importlib.import_module("surfrecon.cli." + module)
called = getattr(module, name)
class Late:
    def __set_name__(self, owner, name):
        os.kill(os.getpid(), signal.SIGINT)
class Ending:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
def interrupted(*arguments):
    if how == "class":
        type("Made", (), {"late": Late()})
    elif how == "end":
        Ending()
    else:
        os.kill(os.getpid(), signal.SIGINT)
    return called(*arguments)
setattr(module, name, interrupted)
main()
"""


def ctrl_c_at_certain_places(folder, tmp_path):
    """Before the result has its name the writer stops, afterwards the report is written as well."""
    out, report = tmp_path / "a.ply", tmp_path / "a.json"
    arguments = ["merge", folder / "ring.conf", "-o", out, "--voxel", "0.1", "--report", report]
    for how, module, name, code in (
        ("function", "inputs", "of_scans", 130),
        ("class", "inputs", "of_scans", 130),
        ("end", "inputs", "of_scans", 130),
        ("function", "record", "provenance", 130),
        ("function", "record", "finished", 0),
        ("function", "files", "_write", 0),
        ("function", "streams", "finish", 0),
        ("function", "streams", "drop", 0),
    ):
        program = [sys.executable, "-c", AT_A_PLACE, how, module, name, *arguments]
        done = subprocess.run(program, env=ENVIRONMENT, capture_output=True, timeout=100)
        assert done.returncode == code and (b"stopped" in done.stderr) == (code == 130), done.stderr
        assert b"Traceback" not in done.stderr and b"Exception" not in done.stderr, done.stderr
        left = sorted(path.name for path in tmp_path.iterdir())
        assert left == ([] if code else ["a.json", "a.ply"])
        for path in tmp_path.iterdir():
            path.unlink()


def signals_as_programs_take_them(folder, tmp_path):
    arguments = ["merge", folder / "ring.conf", "-o", tmp_path / "a.ply", "--voxel", "0.002"]
    for numbers, code in (
        ([signal.SIGINT], 130),
        ([signal.SIGINT] * 5, 130),
        ([signal.SIGTERM], 143),
        ([signal.SIGHUP], 129),
    ):
        began = time.monotonic()
        found, said = stopped(arguments, 0.5, numbers)
        assert (found, list(tmp_path.iterdir())) == (code, []), said
        assert time.monotonic() - began < 60
    # A program started in the background does not hear Ctrl-C.
    arguments[-1] = "0.05"
    ignoring = lambda: signal.signal(signal.SIGINT, signal.SIG_IGN)  # noqa: E731
    code, said = stopped(arguments, 0.1, [signal.SIGINT], preexec_fn=ignoring)
    assert code == 0 and (tmp_path / "a.ply").exists(), said


def test_names_that_are_not_utf_8(folder, tmp_path):
    place = os.path.join(os.fspath(tmp_path), ODD)
    os.mkdir(place)
    source, out, report = (os.path.join(place, ODD + ending) for ending in (".ply", ".stl", ".json"))
    shutil.copy(folder / "torus.ply", source)
    done = run("info", source)
    assert done.returncode == 0 and "mesh, 1,152 vertices" in done.stdout, done.stderr
    done = subprocess.run(
        [*PROGRAM, "convert", source, "-o", out, "--report", report], env=ENVIRONMENT, capture_output=True
    )
    assert done.returncode == 0, done.stderr
    # Its output has the name's own bytes.
    assert os.fsencode(out) in done.stdout or sys.platform == "win32"
    found = json.loads(Path(report).read_text("ascii"))
    for files, name in ((found["inputs"], source), (found["outputs"], out)):
        (file,) = files
        assert os.fsdecode(bytes.fromhex(file["path_hex"])) == name if "path_hex" in file else file["path"] == name
        # Readers of other languages take no halves of surrogate pairs.
        assert all(not "\ud800" <= letter <= "\udfff" for letter in file["path"])
    assert len(surfrecon.read(out).triangles) == len(torus(24).triangles)
    listed = subprocess.run([*PROGRAM, "info", source, "--json"], env=ENVIRONMENT, capture_output=True).stdout
    assert json.loads(listed)["report"]["scans"][0]["vertices"] == 1152 and rb"\ud" not in listed
    # A folder of scans, one that is missing, in text and in an encoding that has no such letters.
    for encoding in ("utf-8", "ascii"):
        environment = ENVIRONMENT | {"PYTHONIOENCODING": encoding}
        assert subprocess.run([*PROGRAM, "info", place], env=environment, capture_output=True).returncode == 0
        missing = subprocess.run([*PROGRAM, "info", source + "x"], env=environment, capture_output=True)
        assert missing.returncode == 1 and missing.stderr.startswith(b"surfrecon: info: "), missing.stderr
        bad = subprocess.run([*PROGRAM, "merge", source, "-o", source], env=environment, capture_output=True)
        assert bad.returncode == 2 and b"is read: give the output another name" in bad.stderr
        bad = subprocess.run([*PROGRAM, "merge", "-o", source, f"--voxel={ODD}"], env=environment, capture_output=True)
        assert bad.returncode == 2 and b"voxel must be" in bad.stderr
        bad = subprocess.run([*PROGRAM, ODD], env=environment, capture_output=True)
        assert bad.returncode == 2 and b"must be one of" in bad.stderr


def a_list_of_poses_cannot_have_names_that_are_not_utf_8(_, tmp_path):
    if sys.platform != "linux":
        pytest.skip("names that are not UTF-8 are Linux's")
    names = []
    for image in torus_scans(pixels=30)[:2]:
        names.append(os.path.join(os.fspath(tmp_path), image.name + ODD + ".ply"))
        image.write(names[-1])
    done = run("align", *names, "-o", tmp_path / "a.conf", "--fixed", "0,1")
    assert done.returncode == 1 and "a list of poses is UTF-8, which this name is not: rename the file" in done.stderr
    with pytest.raises(surfrecon.FileError) as missing:
        surfrecon.open(names[0] + "x")
    assert missing.value.filename == names[0] + "x"


def progress_is_shown_on_terminals_alone(folder, tmp_path):
    pytest.importorskip("tqdm")
    pty = pytest.importorskip("pty")
    arguments = ["merge", folder / "ring.conf", "-o", tmp_path / "a.ply", "--voxel", "0.03"]
    assert "%" not in run(*arguments).stderr
    for quiet in ([], ["--quiet"]):
        own, terminal = pty.openpty()
        program = start(*arguments, *quiet, stderr=terminal, stdout=subprocess.DEVNULL)
        os.close(terminal)
        said = b""
        # The terminal's end is an error once nobody has the other.
        try:
            while part := os.read(own, 65536):
                said += part
        except OSError:
            pass
        os.close(own)
        assert program.wait(100) == 0
        assert (b"%" in said) == (not quiet), said
    # Without tqdm there is none.
    (tmp_path / "tqdm.py").write_text("raise ImportError")
    own, terminal = pty.openpty()
    path = os.pathsep.join([os.fspath(tmp_path), ENVIRONMENT["PYTHONPATH"]])
    assert run(*arguments, stdout=terminal, stderr=terminal, env=ENVIRONMENT | {"PYTHONPATH": path}).returncode == 0
    os.close(terminal)
    os.close(own)
    # A terminal that goes away ends nothing.
    own, terminal = pty.openpty()
    program = start(*arguments, stderr=terminal, stdout=subprocess.DEVNULL, start_new_session=True)
    os.close(terminal)
    os.read(own, 1)
    os.close(own)
    assert program.wait(100) == 0


STREAMS = [
    *((output_that_goes_nowhere, output, name) for output in ("closed pipe", "full disk", "closed") for name in SAYING),
    (no_stream_at_all_does_not_harm_the_result,),
    (files_do_not_get_the_numbers_of_streams,),
    *((a_full_disk_leaves_what_was_there, ending) for ending in ("ply", "glb", "json")),
    (progress_is_shown_on_terminals_alone,),
    (a_list_of_poses_cannot_have_names_that_are_not_utf_8,),
]
SIGNALS = [
    (ctrl_c_at_any_time_leaves_nothing_or_all, "merge"),
    (ctrl_c_at_certain_places,),
    *((ctrl_c_from_the_start, how) for how in ("module", "installed")),
    (signals_as_programs_take_them,),
]
MORE_SIGNALS = [(ctrl_c_at_any_time_leaves_nothing_or_all, name) for name in ("convert", "align", "measure", "batch")]


def named(case):
    function, *rest = case
    return " ".join([function.__name__.replace("_", " "), *rest])


@pytest.mark.parametrize("case", STREAMS, ids=named)
@posix
def test_streams_and_disks_of_posix(folder, tmp_path, case):
    function, *rest = case
    function(folder, tmp_path, *rest)


@pytest.mark.parametrize("case", SIGNALS, ids=named)
@posix
def test_signals_of_posix(folder, tmp_path, case):
    function, *rest = case
    function(folder, tmp_path, *rest)


@pytest.mark.thorough
@pytest.mark.parametrize("case", MORE_SIGNALS, ids=named)
@posix
def test_more_signals_of_posix(folder, tmp_path, case):
    function, *rest = case
    function(folder, tmp_path, *rest)
