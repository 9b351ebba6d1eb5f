"""Runs the benchmarks: run.py [NAME] [--cases TEXT] [--repeats N]. Called by run.sh, which builds and installs first.

A benchmark is a module beside this one with `main(only_cases, repeats)` that prints its tables and returns what
out/bench/NAME.json holds besides the machine: at least `rows`.
"""

import argparse
import importlib
import json
import os
import platform
import sys
from importlib.metadata import version
from pathlib import Path

BENCHMARKS = ["merge", "delaunay", "scattered", "sculpt", "quads", "cluster", "capi", "io", "blender", "meshlab"]
# A module named io would be Python's own.
MODULES = {"io": "files"}
OUT = Path(__file__).resolve().parent.parent / "out" / "bench"
PEERS = [
    "pymeshlab",
    "open3d",
    "trimesh",
    "meshio",
    "laspy",
    "pye57",
    "gmsh",
    "pydelatin",
    "pymartini",
    "numpy",
    "scipy",
]


def machine():
    """Where the figures were taken."""
    cpu = platform.processor()
    if Path("/proc/cpuinfo").is_file():
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        cpu = next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), cpu)
    return {
        "cpu": cpu,
        "cores": os.cpu_count(),
        "load_at_start": os.getloadavg()[0],
        "system": platform.platform(),
        "versions": {name: version(name) for name in PEERS} | {"python": platform.python_version()},
    }


def main():
    """Runs the named benchmark or all."""
    parser = argparse.ArgumentParser(description="This library beside its peers on the same data.")
    parser.add_argument("name", nargs="?", choices=BENCHMARKS, help="one benchmark; all without it")
    parser.add_argument("--cases", default="", help="only cases whose name contains this text")
    parser.add_argument("--repeats", type=int, default=3, help="runs a tool, of which the median counts")
    options = parser.parse_args()
    OUT.mkdir(parents=True, exist_ok=True)
    failed = False
    for name in [options.name] if options.name else BENCHMARKS:
        print(f"== {name}", flush=True)
        where = machine()
        results = importlib.import_module(MODULES.get(name, name)).main(options.cases, options.repeats)
        file = OUT / f"{name}.json"
        file.write_text(json.dumps({"benchmark": name, "machine": where} | results, indent=1) + "\n")
        print(f"\nwritten: {file.relative_to(OUT.parent.parent)}")
        failed |= any(
            "failed" in row for row in results["rows"] if row.get("tool", "surfrecon").startswith("surfrecon")
        )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
