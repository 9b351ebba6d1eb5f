"""Builds the Blender extension: puts the wheel into it, builds and validates the zip with Blender's own tool.

The results are out/extension/surfrecon-<version>-<platform>.zip, one for each platform whose wheel
tools/build_wheel.sh has built. --wheels and --out name other folders. What was in the folder is replaced at once,
when all is built.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
import zipfile
from pathlib import Path

import platforms

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "blender-addon" / "extension"
OUT = ROOT / "out" / "extension"


def main():
    """Builds and validates."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("platforms", nargs="*", metavar="PLATFORM", help="all that have a wheel, unless named")
    parser.add_argument("--wheels", type=Path, default=platforms.WHEELS, metavar="FOLDER")
    parser.add_argument("--out", type=Path, default=OUT, metavar="FOLDER")
    given = parser.parse_args()
    built = platforms.wheels(given.wheels)
    asked = [platforms.named(name).name for name in given.platforms] or list(built)
    missing = [name for name in asked if name not in built]
    if missing or not built:
        which = ", ".join(missing) or "any platform"
        version = platforms.version()
        sys.exit(f"{given.wheels} has no wheel of version {version} for {which}: run tools/build_wheel.sh [PLATFORM]")
    wheels = {name: built[name] for name in asked}
    manifest = (SOURCE / "blender_manifest.toml").read_text()
    if tomllib.loads(manifest)["version"] != platforms.version():
        sys.exit(f"blender_manifest.toml does not say version {platforms.version()}: run make generate")

    given.out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=given.out.parent, prefix=".extension-") as scratch:
        zips = zipped(manifest, wheels, Path(scratch))
        replace(given.out, zips)
    for zip in sorted(given.out.glob("*.zip")):
        print(os.path.relpath(zip, ROOT))


def zipped(manifest, wheels, scratch):
    """The folder of the built and validated zips."""
    stage, zips = scratch / "stage", scratch / "zips"
    shutil.copytree(SOURCE, stage, ignore=shutil.ignore_patterns("__pycache__"))
    (stage / "wheels").mkdir()
    for wheel in wheels.values():
        shutil.copy(wheel, stage / "wheels")
    filled = {
        "platforms": sorted(wheels),
        "wheels": [f"./wheels/{wheel.name}" for wheel in wheels.values()],
    }
    for key, values in filled.items():
        manifest = manifest.replace(f"\n{key} = []\n", f"\n{key} = {str(values).replace(chr(39), chr(34))}\n")
    (stage / "blender_manifest.toml").write_text(manifest)

    zips.mkdir()
    tool = blender_tool()
    call([sys.executable, tool, "build", "--source-dir", stage, "--output-dir", zips, "--split-platforms"])
    for made in sorted(zips.glob("*.zip")):
        # Blender writes linux_x64 where its manifest says linux-x64.
        final = made.with_name(re.sub(r"-(\w+)_(x64|arm64)\.zip$", r"-\1-\2.zip", made.name))
        same_each_time(made, final)
        call([sys.executable, tool, "validate", final])
    return zips


def replace(folder, made):
    """Puts a made folder in the place of another, which is there until then."""
    old = made.with_name("old")
    if folder.exists():
        folder.rename(old)
    made.rename(folder)


def same_each_time(made, final):
    """Writes a zip anew, in the order of names and with the commit's time: Blender's tool takes both from the disk."""
    part = final.with_suffix(".part")
    with zipfile.ZipFile(made) as old, zipfile.ZipFile(part, "w") as new:
        for name in sorted(old.namelist()):
            entry = zipfile.ZipInfo(name, time.gmtime(platforms.commit_time())[:6])
            entry.external_attr = 0o644 << 16
            new.writestr(entry, old.read(name), zipfile.ZIP_DEFLATED, compresslevel=9)
    made.unlink()
    part.rename(final)


def blender_tool():
    """Blender's command-line tool for extensions, out of its Python module: it needs nothing but plain Python."""
    venv = subprocess.run([ROOT / "tools" / "venv.sh", "blender-4.5"], stdout=subprocess.PIPE, text=True, check=True)
    pattern = "lib/python*/site-packages/bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py"
    return next(Path(venv.stdout.strip()).glob(pattern))


def call(command):
    """Runs a command and shows its output only if it fails."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{done.stdout}\nfailed: {' '.join(map(str, command))}")


if __name__ == "__main__":
    main()
