"""Packs the extension module that tests compile as a wheel, without compiling anything: for this system alone, for
tests alone.

Usage: development_wheel.py LIBRARY FOLDER     FOLDER/wheel/ has the wheel then, FOLDER/files/ what is in it

What users get is tools/build_wheel.sh's, which is optimized, linked against an old glibc and compiled by itself.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import platforms

ROOT = platforms.ROOT
PACKAGE = ROOT / "python"


def environment():
    """The Python environment that has maturin and wheel."""
    made = subprocess.run([ROOT / "tools" / "venv.sh", "build"], stdout=subprocess.PIPE, text=True, check=True)
    return Path(made.stdout.strip()) / "bin"


def call(*command, **options):
    """Runs a command and shows its output only if it fails."""
    done = subprocess.run(
        list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, **options
    )
    if done.returncode != 0:
        sys.exit(f"{done.stdout}\nfailed: {' '.join(map(str, command))}")


def tag():
    """The wheel's tag: as that of a release, but of the system that it was compiled on."""
    return f"cp311-abi3-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def lay_out(library, folder):
    """Fills a folder with what the wheel has, but for its list of files."""
    shutil.copytree(PACKAGE / "python", folder, ignore=shutil.ignore_patterns("__pycache__", "*.so"))
    module = folder / "surfrecon" / "_native.abi3.so"
    shutil.copy(library, module)
    # As a release: what it weighs is tested.
    call("strip", "--strip-debug", module)
    tools = environment()
    path = f"{tools}{os.pathsep}{os.environ['PATH']}"
    command = [tools / "maturin", "pep517", "write-dist-info", "--metadata-directory", folder, "--interpreter"]
    call(*command, sys.executable, cwd=PACKAGE, env={**os.environ, "PATH": path})
    about = next(folder.glob("*.dist-info"))
    lines = [line for line in (about / "WHEEL").read_text().splitlines() if not line.startswith("Tag:")]
    (about / "WHEEL").write_text("\n".join([*lines, f"Tag: {tag()}"]) + "\n")
    licences = about / "licenses" / "LICENSES-THIRD-PARTY.txt"
    licences.parent.mkdir(exist_ok=True)
    call(sys.executable, ROOT / "tools" / "third_party_licences.py", licences, "--package", "surfrecon-python")


def main():
    """Packs it."""
    library, folder = (Path(name).resolve() for name in sys.argv[1:3])
    stage = folder / "stage"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    lay_out(library, stage)
    wheels = folder / "wheel"
    wheels.mkdir()
    call(environment() / "python", "-m", "wheel", "pack", stage, "--dest-dir", wheels)
    with zipfile.ZipFile(next(wheels.glob("*.whl"))) as packed:
        packed.extractall(folder / "files")
    shutil.rmtree(stage)


if __name__ == "__main__":
    main()
