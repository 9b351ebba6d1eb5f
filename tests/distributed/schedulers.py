"""Stand-ins for what starts programs on a cluster, which is not there: they start them here, two at once.

`programs(folder)` puts `sbatch`, `scancel`, `kubectl` and `surfrecon` into a folder for PATH. They take what the guide
gives them and no more; what SLURM and Kubernetes themselves would say to it, they do not show. STAND_INS names a folder
for their jobs, SHARED what containers see as their volume, LOST a job and an index, as `merge-label 1`, whose first run
is killed as if its machine were lost.
"""

import argparse
import contextlib
import fcntl
import os
import shlex
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

AT_ONCE = 2


def programs(folder):
    """Makes the programs."""
    folder.mkdir()
    for name in ("sbatch", "scancel", "kubectl", "surfrecon"):
        called = f"{__file__} {name}" if name != "surfrecon" else "-m surfrecon"
        (folder / name).write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {called} "$@"\n')
        (folder / name).chmod(0o755)


def jobs():
    """The folders in which they keep what they know of jobs, one each."""
    return Path(os.environ["STAND_INS"])


def sbatch(given):
    """Starts a job, or an array of them, and says its number."""
    options = argparse.ArgumentParser(allow_abbrev=False)
    options.add_argument("--parsable", action="store_true")
    options.add_argument("--requeue", action="store_true")
    for name in ("job-name", "array", "dependency", "kill-on-invalid-dep", "cpus-per-task", "mem", "time", "wrap"):
        options.add_argument(f"--{name}")
    options.add_argument("script", nargs="?")
    asked = options.parse_args(given)
    number = 1
    while True:
        with contextlib.suppress(FileExistsError):
            (jobs() / str(number)).mkdir()
            break
        number += 1
    job = jobs() / str(number)
    (job / "script").write_text(f"#!/bin/sh\n{asked.wrap}\n" if asked.wrap else Path(asked.script).read_text())
    (job / "script").chmod(0o755)
    before = (asked.dependency or "").removeprefix("afterok:")
    command = [sys.executable, __file__, "job", job, asked.job_name or "", asked.array or "", before]
    with (job / "said").open("wb") as said:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=said, stderr=said, start_new_session=True)
    (job / "pid").write_text(str(process.pid))
    print(number if asked.parsable else f"Submitted batch job {number}")


def job(given):
    """A job to its end: waits for the one before, and leaves whether all went well."""
    folder, name, array, before = Path(given[0]), *given[1:]
    while before and not (jobs() / before / "ended").exists():
        time.sleep(0.05)
    first, _, last = array.partition("-")
    indices = range(int(first), int(last) + 1) if array else [None]
    well = not before or (jobs() / before / "ended").read_text() == "well"
    if well:
        with ThreadPoolExecutor(AT_ONCE) as pool:
            variables = [{"SLURM_ARRAY_TASK_ID": str(index)} if array else {} for index in indices]
            called = zip([[folder / "script"]] * len(indices), variables, indices, strict=True)
            well = all(pool.map(lambda one: run(*one, name), called))
    (folder / "part").write_text("well" if well else "badly")
    (folder / "part").rename(folder / "ended")


def run(command, variables, index, name, folder=None):
    """Runs a program when fewer than two run, again if its machine is lost; whether it ended well."""
    lost = os.environ.get("LOST") == f"{name} {index}"
    while True:
        with place():
            process = subprocess.Popen(command, env=os.environ | variables, cwd=folder, start_new_session=lost)
            if lost:
                # Whether it was about to begin, at work or done: nobody knows.
                time.sleep(0.2)
                os.killpg(process.pid, signal.SIGKILL)
            code = process.wait()
        if not lost:
            return code == 0
        (jobs() / "lost").touch()
        lost = False


@contextlib.contextmanager
def place():
    """One of the places for what runs at once."""
    while True:
        for number in range(AT_ONCE):
            with (jobs() / f"place-{number}").open("w") as file, contextlib.suppress(BlockingIOError):
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                yield
                return
        time.sleep(0.05)


def scancel(given):
    """Ends jobs and all that they have started."""
    for number in given:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(int((jobs() / number / "pid").read_text()), signal.SIGTERM)


def kubectl(given):
    """`apply -f -` runs an indexed job to its end, `wait` tells of it."""
    if given[0] == "wait":
        ended = jobs() / given[-1].removeprefix("job/") / "ended"
        sys.exit(0 if ended.read_text() == "well" else 1)
    import yaml

    assert given == ["apply", "-f", "-"]
    made = yaml.safe_load(sys.stdin)
    assert (made["apiVersion"], made["kind"]) == ("batch/v1", "Job")
    name, spec = made["metadata"]["name"], made["spec"]
    assert spec["completionMode"] == "Indexed" and spec["template"]["spec"]["restartPolicy"] == "Never"
    (container,) = spec["template"]["spec"]["containers"]
    (mount,), (volume,) = container["volumeMounts"], spec["template"]["spec"]["volumes"]
    assert mount["name"] == volume["name"] and container["workingDir"] == mount["mountPath"]
    indices = range(spec["completions"])
    with ThreadPoolExecutor(spec["parallelism"]) as pool:
        variables = [{"JOB_COMPLETION_INDEX": str(index)} for index in indices]
        called = zip([container["command"]] * len(indices), variables, indices, strict=True)
        well = all(pool.map(lambda one: run(*one, name, os.environ["SHARED"]), called))
    (jobs() / name).mkdir()
    (jobs() / name / "ended").write_text("well" if well else "badly")


if __name__ == "__main__":
    {"sbatch": sbatch, "job": job, "scancel": scancel, "kubectl": kubectl}[sys.argv[1]](sys.argv[2:])
