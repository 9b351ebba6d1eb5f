"""Three whole jobs as programs: the examples of the C library beside the same with Open3D's C++ library and with CGAL.

Lines count what a programmer writes; each program is compiled and run where its library is at hand. Neither peer reads
scans from memory or can be cancelled: their server starts a process a request, its lines are those of both programs.
CGAL has no merge: its programs do what is nearest.
"""

import os
import re
import shutil
import signal
import socket
import statistics
import subprocess
import threading
import time
from pathlib import Path

import measured
from merge import Virtual, virtual_scans
from prepare import prepare
from source_lines import lines

HERE = Path(__file__).resolve().parent
EXAMPLES = HERE.parent / "c-api" / "examples"
COLUMNS = ["lines", "compiled", "ran", "seconds", "triangles", "answers", "as_alone"]
OURS, PEERS = "surfrecon", ["open3d-cpp", "cgal"]
SCANS, FRAMES, SERVER = "job: scans on disk", "job: frames of a tracking camera", "job: server, four threads"
# Sources by job and tool, of what is run first. What a peer's server starts is its program of the first job.
SOURCES = {
    (SCANS, OURS): [EXAMPLES / "c" / "merge_scans.c"],
    (SCANS, "open3d-cpp"): [HERE / "jobs" / "scans_open3d.cpp"],
    (SCANS, "cgal"): [HERE / "jobs" / "scans_cgal.cpp"],
    (FRAMES, OURS): [EXAMPLES / "cpp" / "tracked_camera.cpp"],
    (FRAMES, "open3d-cpp"): [HERE / "jobs" / "frames_open3d.cpp"],
    (FRAMES, "cgal"): [HERE / "jobs" / "frames_cgal.cpp"],
    (SERVER, OURS): [EXAMPLES / "cpp" / "merge_server.cpp"],
    (SERVER, "open3d-cpp"): [HERE / "jobs" / "server_of_processes.cpp", HERE / "jobs" / "scans_open3d.cpp"],
    (SERVER, "cgal"): [HERE / "jobs" / "server_of_processes.cpp", HERE / "jobs" / "scans_cgal.cpp"],
}
EIGEN = ["-isystem", "/usr/include/eigen3"]
NEEDED = {"open3d-cpp": "libopen3d-dev", "cgal": "libcgal-dev"}
USUAL, SMALLEST = Virtual(12, 260, 1.8, 2.0), Virtual(4, 60, 12.0, 8.0)
REQUESTS, CLIENTS = 200, 8
SERVE_S = 60  # after which a server is asked for no more merges
CPU_S = 300  # for a run


def flags(tool, wanted):
    """The compiler's flags for a tool's library. None where it is not at hand."""
    if tool == OURS:
        where = ["-L", wanted.programs, f"-Wl,-rpath,{wanted.programs}"]
        return ["-I", EXAMPLES.parent / "include", *where, "-lsurfrecon", "-lm"]
    if tool == "cgal":
        there = Path("/usr/include/CGAL/poisson_surface_reconstruction.h").is_file()
        return [*EIGEN, "-lgmp", "-lmpfr"] if there else None
    asked = subprocess.run(["pkg-config", "--cflags", "--libs", "Open3D"], capture_output=True, text=True, check=False)
    # Its own flags ask for an older standard.
    return [*asked.stdout.split(), "-std=c++17", *EIGEN, "-lfmt"] if asked.returncode == 0 else None


class Programs:
    """The programs of a run, each compiled once."""

    def __init__(self, wanted):
        self.wanted, self.made = wanted, {}
        self.folder = wanted.out / "jobs"
        self.folder.mkdir(parents=True, exist_ok=True)

    def of(self, source, tool):
        """The program of a source, or why there is none."""
        if (source, tool) not in self.made:
            self.made[source, tool] = self.compiled(source, tool)
        return self.made[source, tool]

    def compiled(self, source, tool):
        """Compiles a program, or gives `None`."""
        # The smallest case does without what takes minutes to compile.
        if tool != OURS and self.wanted.smallest:
            return None
        plain = source.stem == "server_of_processes"
        told = [] if plain else flags(tool, self.wanted)
        compiler, standard = ("cc", "-std=c99") if source.suffix == ".c" else ("c++", "-std=c++17")
        if told is None or not shutil.which(compiler):
            return None
        program = self.folder / f"{source.stem}-{tool}"
        command = [compiler, standard, "-O2", "-DNDEBUG", "-pthread", source, "-o", program, *told]
        subprocess.run(list(map(str, command)), check=True)
        return program


def ask(port, request):
    """The answer of a server."""
    with socket.create_connection(("127.0.0.1", port)) as connection:
        connection.sendall(request)
        return b"".join(iter(lambda: connection.recv(1 << 20), b""))


def serve(command, files, requests):
    """Asks a server for so many merges from several clients: seconds, answers, and how many were as one alone."""
    request = f"merge ply 60000 {len(files)}\n".encode()
    for file in files:
        content = Path(file).read_bytes()
        request += f"{Path(file).name} {len(content)}\n".encode() + content
    # As measured.run() has it: spinning threads of a process a request would keep the others from working.
    quiet = {
        "stdout": subprocess.PIPE,
        "stderr": subprocess.DEVNULL,
        "env": {"OMP_WAIT_POLICY": "passive", **os.environ},
    }
    with subprocess.Popen(list(map(str, command)), text=True, **quiet) as server:
        try:
            port = int(server.stdout.readline().rsplit(":", 1)[1])
            alone = ask(port, request)
            if not alone.startswith(b"ok "):
                raise measured.Failed(alone.decode(errors="replace").strip())
            left, answers = iter(range(requests)), []

            def client():
                while time.monotonic() - began < SERVE_S and next(left, None) is not None:
                    answers.append(ask(port, request))

            clients = [threading.Thread(target=client) for _ in range(CLIENTS)]
            began = time.monotonic()
            for thread in clients:
                thread.start()
            for thread in clients:
                thread.join()
            merged = [answer for answer in answers if answer.startswith(b"ok ")]
            return time.monotonic() - began, len(merged), merged.count(alone)
        finally:
            server.send_signal(signal.SIGTERM)


def do(case, programs, files, out, wanted):
    """One run of a job: its figures."""
    if case == SERVER:
        fewer = 8 if wanted.smallest else REQUESTS
        seconds, answers, same = serve([programs[0], 0, *programs[1:]], files, fewer)
        return {"seconds": seconds, "answers": answers, "as_alone": same, "triangles": None}
    command = [programs[0], out, *(files if case == SCANS else [])]
    figures, printed = measured.run(command, cpu_limit=CPU_S)
    triangles = int(re.findall(r"(\d+) (?:triangles(?! in)|out)", printed)[-1])
    return {"seconds": figures["wall_s"], "triangles": triangles, "answers": None, "as_alone": None}


def prepared(wanted):
    """Files of triangulated scans in the world, which all tools read: the first job's, and smaller ones."""
    found = []
    for virtual in (SMALLEST if wanted.smallest else USUAL, SMALLEST):
        folder = virtual_scans(wanted, virtual)
        ready = wanted.out / "inputs" / f"{folder.name}_prepared"
        prepare(folder / "scans.conf", ready)
        found.append((ready / "scans.txt").read_text().split("\n")[:-1])
    return dict(zip((SCANS, SERVER), found, strict=True))


def main(wanted, record, columns):
    """A row a job and tool, with `columns` empty besides."""
    if not any(wanted.takes(case) for case, _ in SOURCES):
        return
    programs, files = Programs(wanted), prepared(wanted)
    missing = [tool for tool in PEERS if not wanted.smallest and flags(tool, wanted) is None]
    for tool in missing:
        record.skip(f"{tool}: {NEEDED[tool]} is not installed; its lines are counted")
    for (case, tool), sources in SOURCES.items():
        if not wanted.takes(case, tool):
            continue
        made = [programs.of(source, tool) for source in sources]
        row = dict.fromkeys(columns) | {"case": case, "tool": tool, "ran": False, "compiled": None not in made}
        row["lines"] = sum(lines(source.read_text()) for source in sources)
        if row["compiled"]:
            runs = []
            try:
                for _ in range(1 if case == SERVER else wanted.repeats):
                    runs.append(do(case, made, files.get(case), programs.folder / f"{tool}.ply", wanted))
                row |= runs[0] | {"ran": True, "seconds": statistics.median(run["seconds"] for run in runs)}
            except measured.Failed as failed:
                row["failed"] = str(failed)
        record.put(row)
