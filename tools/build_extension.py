"""Builds the Blender extension: puts the wheel into it, builds and validates the zip with Blender's own tool.

The result is out/extension/surfrecon-<version>-<platform>.zip; the wheel comes from tools/build_wheel.sh.
"""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "blender-addon" / "extension"
OUT = ROOT / "out" / "extension"
STAGE = ROOT / "target" / "extension"
# Platform of a wheel's file name -> Blender's name of it.
PLATFORMS = {
    "manylinux.*_x86_64": "linux-x64",
    "manylinux.*_aarch64": "linux-arm64",
    "win_amd64": "windows-x64",
    "win_arm64": "windows-arm64",
    "macosx.*_x86_64": "macos-x64",
    "macosx.*_arm64": "macos-arm64",
}


def main():
    """Builds and validates."""
    wheels = sorted((ROOT / "target" / "wheels").glob("surfrecon-*.whl"))
    if not wheels:
        sys.exit("there is no wheel in target/wheels: run tools/build_wheel.sh first")
    manifest = (SOURCE / "blender_manifest.toml").read_text()
    version = tomllib.loads(manifest)["version"]
    for wheel in wheels:
        if wheel.name.split("-")[1] != version:
            sys.exit(f"{wheel.name} and blender_manifest.toml ({version}) differ in their version")

    shutil.rmtree(STAGE, ignore_errors=True)
    shutil.copytree(SOURCE, STAGE, ignore=shutil.ignore_patterns("__pycache__"))
    (STAGE / "wheels").mkdir()
    for wheel in wheels:
        shutil.copy(wheel, STAGE / "wheels")
    filled = {
        "platforms": sorted({platform_of(wheel) for wheel in wheels}),
        "wheels": [f"./wheels/{wheel.name}" for wheel in wheels],
    }
    for key, values in filled.items():
        manifest = manifest.replace(f"\n{key} = []\n", f"\n{key} = {str(values).replace(chr(39), chr(34))}\n")
    (STAGE / "blender_manifest.toml").write_text(manifest)

    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    tool = blender_tool()
    call([sys.executable, tool, "build", "--source-dir", STAGE, "--output-dir", OUT, "--split-platforms"])
    for built in sorted(OUT.glob("*.zip")):
        # Blender writes linux_x64 where its manifest says linux-x64.
        final = built.with_name(re.sub(r"-(\w+)_(x64|arm64)\.zip$", r"-\1-\2.zip", built.name))
        built.rename(final)
        call([sys.executable, tool, "validate", final])
        print(final.relative_to(ROOT))


def platform_of(wheel):
    """Blender's name of a wheel's platform."""
    tag = wheel.stem.split("-")[-1]
    for pattern, platform in PLATFORMS.items():
        if re.fullmatch(pattern, tag):
            return platform
    return sys.exit(f"{wheel.name}: Blender has no name for the platform {tag}")


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
