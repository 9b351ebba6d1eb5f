"""The options of a benchmark: which cases, how often, with which programs, and where its files go."""

from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

SMALLEST, USUAL, ALL = "smallest", "usual", "all"

# Rows that only --all runs, by benchmark: patterns of "CASE: TOOL". The others are meant to fit record.BUDGET_CPU_S.
HEAVY = {
    # Peers try all pairs, which takes a minute of ten scans: they are shown on the bunny and some virtual sets.
    "align": ["bunny: open3d-ransac", "dragon: *-*", "happy: *-*", "pairs, [!3]*: *-*", "pairs, 30 %, noise 1: *-*"]
    + ["pairs, 30 %, warp 1: *-*", "ring of 15, *: open3d-*", "ring of 15, noise 0.5: *-*", "ring of 15, warp 1: *-*"]
    + ["ring of 30, *: *-*"]
    # Rooms: usual are those of which peers show what they can, and one of each way.
    + [f"room {kind} *: *" for kind in ("L", "stairs", "office", "twins", "empty")]
    + [f"room {kind} *, {way}, *: *" for kind in ("corridor", "furnished") for way in ("heap", "exact")]
    + ["room corridor *, rough, *: *", "room *, 300 frames*: *", "room *, 100 frames, *: *", "room heaps, 200 *: *"]
    + ["room * at 640 x 480, *: *"]
    + ["room box 1, 12 *: *", "room box 2, 12 *: *", "room *, 40 frames, heap, *: *", "room box *, exact, *: *"]
    + [
        "room box 1, *: *-*",
        "room furnished *: *-*",
        "room heaps, *: *-*",
        "7-Scenes, * heap: *",
        "7-Scenes, * exact: *",
    ]
    + ["living room, *: *-*", "TUM desk, * exact: *"],
    "scale": ["1,000 frames: *", "100 frames: surfrecon-tasks-*", "100 frames: surfrecon-dask-4"],
    "merge": ["dragon 0.75 mm: *", "happy 0.60 mm: *"],
    # MeshLab's two take a quarter of a minute and more: shown without noise and with a cell of it.
    "noise": ["sculpture 40, white 0.05: *", "sculpture 40, white 3: *", "sculpture 400, *: *", "room 300: *"]
    + ["room 1000: *", "left out of *, all: *", "sculpture 40, correlated 0.25: *", "sculpture 40, quantized 0.25: *"]
    + ["sculpture 40, white 0.*: pymeshlab-*", "sculpture 40, white 2: pymeshlab-*", "*, poses *: pymeshlab-*"]
    + [f"*, {kind} *: pymeshlab-*" for kind in ("correlated", "quantized", "mixed")]
    + [f"{case}: pymeshlab-*" for case in ("sculpture [15], *", "plates 10, white [01]", "plates 10, white 0.25")]
    + ["plates *: pymeshlab-vcg"],
    # Gmsh does not end on two layers; how long the exact torus takes others than CGAL is not known.
    "delaunay": ["uniform 3 M: *", "two layers of integers 500 k: gmsh"]
    + [f"exact torus 100 k: {tool}" for tool in ("gmsh", "tetgen")],
    "scattered": [
        "armadillo 1M: *",
        "bunny scans: *",
        "igea: [om]*",
        "torus 200000: *",
        "torus [0-9]*: open3d-*",
        "torus [0-9]*: meshlab-*",
    ]
    + ["scan *: open3d-*", "scan *: meshlab-*"]
    + ["*, noise 0, *: screened-*", "*, noise 0.5, *: screened-*", "*, noise *: screened-poisson-[78]"],
    # Variants of ours and quadric collapses, which run a dozen times, are shown on the bunny and the camera's image.
    "sculpt": ["growth 2048: *", "growth 4096: *", "synthetic 1024: *", "N37E014: *"]
    + [f"{case}: *-*" for case in ("N37E015", "dragonStandRight_0", "forked pipe", "bottle", "head")],
    # Other Poisson reconstructions, VCG and pockets alone are shown on the figure, pockets on the chair as well.
    "close": ["*, noise 0.5: *", "*, 5 %*: *", "*, 15 %*: *", "dragon: *", "happy: *", "chair: meshfix"]
    + [f"[!f]*: {tool}" for tool in ("poisson-10", "*-trimmed", "vcg", "open3d-*")]
    + ["[!fc]*: surfrecon-seen"],
    "cluster": ["dragon merged, *: *", "bunny, 800 vertices: *", "bunny, 10,000 vertices: *-kmeans", "igea, *: acvd-*"],
}


@dataclass
class Wanted:
    """The options of bench/run.py for one benchmark."""

    benchmark: str
    out: Path
    programs: Path  # where this library's own programs are
    repeats: int
    extent: str = USUAL
    cases: str = ""

    @property
    def smallest(self):
        """Whether only the case is asked for that shows that the benchmark works."""
        return self.extent == SMALLEST

    def takes(self, case, tool=""):
        """Whether the tool runs on the case; without a tool, whether any does."""
        if self.cases not in case:
            return False
        return self.extent != USUAL or not any(
            fnmatchcase(f"{case}: {tool}", pattern) for pattern in HEAVY.get(self.benchmark, [])
        )

    def tools(self, case, tools):
        """Those of the tools that run on the case."""
        return [tool for tool in tools if self.takes(case, tool)]
