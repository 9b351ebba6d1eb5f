"""Builds the Blender extension: puts the wheel into it, builds and validates the zip with Blender's own tool.

The results are out/extension/surfrecon-<version>-<platform>.zip, one for each platform whose wheel tools/build_wheel.sh
has built.
"""

import argparse
import re
import shutil
import subprocess
import sys
import time
import tomllib
import zipfile
from pathlib import Path

import platforms

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "blender-addon" / "extension"
OUT = ROOT / "out" / "extension"
STAGE = ROOT / "target" / "extension"


def main():
    """Builds and validates."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("platforms", nargs="*", metavar="PLATFORM", help="all that have a wheel, unless named")
    built = platforms.wheels()
    asked = [platforms.named(name).name for name in parser.parse_args().platforms] or list(built)
    missing = [name for name in asked if name not in built]
    if missing or not built:
        which = ", ".join(missing) or "any platform"
        version = platforms.version()
        sys.exit(f"target/wheels has no wheel of version {version} for {which}: run tools/build_wheel.sh [PLATFORM]")
    wheels = {name: built[name] for name in asked}
    manifest = (SOURCE / "blender_manifest.toml").read_text()
    if tomllib.loads(manifest)["version"] != platforms.version():
        sys.exit(f"blender_manifest.toml does not say version {platforms.version()}: run make generate")

    shutil.rmtree(STAGE, ignore_errors=True)
    shutil.copytree(SOURCE, STAGE, ignore=shutil.ignore_patterns("__pycache__"))
    (STAGE / "wheels").mkdir()
    for wheel in wheels.values():
        shutil.copy(wheel, STAGE / "wheels")
    filled = {
        "platforms": sorted(wheels),
        "wheels": [f"./wheels/{wheel.name}" for wheel in wheels.values()],
    }
    for key, values in filled.items():
        manifest = manifest.replace(f"\n{key} = []\n", f"\n{key} = {str(values).replace(chr(39), chr(34))}\n")
    (STAGE / "blender_manifest.toml").write_text(manifest)

    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    tool = blender_tool()
    call([sys.executable, tool, "build", "--source-dir", STAGE, "--output-dir", OUT, "--split-platforms"])
    for zipped in sorted(OUT.glob("*.zip")):
        # Blender writes linux_x64 where its manifest says linux-x64.
        final = zipped.with_name(re.sub(r"-(\w+)_(x64|arm64)\.zip$", r"-\1-\2.zip", zipped.name))
        same_each_time(zipped, final)
        call([sys.executable, tool, "validate", final])
        print(final.relative_to(ROOT))


def same_each_time(zipped, final):
    """Writes a zip anew, in the order of names and with the commit's time: Blender's tool takes both from the disk."""
    part = final.with_suffix(".part")
    with zipfile.ZipFile(zipped) as old, zipfile.ZipFile(part, "w") as new:
        for name in sorted(old.namelist()):
            entry = zipfile.ZipInfo(name, time.gmtime(platforms.commit_time())[:6])
            entry.external_attr = 0o644 << 16
            new.writestr(entry, old.read(name), zipfile.ZIP_DEFLATED, compresslevel=9)
    zipped.unlink()
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
