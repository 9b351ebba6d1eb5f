"""The systems that this is built for, in one place: python tools/platforms.py NAME prints the Rust target of one."""

import os
import platform
import re
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WHEELS = ROOT / "target" / "wheels"


@dataclass(frozen=True)
class Platform:
    """A system, under Blender's name of it."""

    name: str
    # By hosted machines; and where that differs, by a Linux machine that builds for all.
    triple: str
    cross_triple: str
    # The pattern of the tag in a wheel's file name.
    tag: str
    # Whether Blender runs there.
    has_blender: bool = True


PLATFORMS = [
    Platform("linux-x64", "x86_64-unknown-linux-gnu", "x86_64-unknown-linux-gnu", r"(many)?linux.*_x86_64"),
    # Blender has no builds of its own for it; its module is on no index.
    Platform("linux-arm64", "aarch64-unknown-linux-gnu", "aarch64-unknown-linux-gnu", r"(many)?linux.*_aarch64"),
    Platform("windows-x64", "x86_64-pc-windows-msvc", "x86_64-pc-windows-gnu", r"win_amd64"),
    Platform("macos-arm64", "aarch64-apple-darwin", "aarch64-apple-darwin", r"macosx.*_arm64"),
    Platform("macos-x64", "x86_64-apple-darwin", "x86_64-apple-darwin", r"macosx.*_x86_64"),
]


def named(name):
    """The platform of this name."""
    found = [one for one in PLATFORMS if one.name == name]
    return found[0] if found else sys.exit(f"there is no platform {name}: {', '.join(one.name for one in PLATFORMS)}")


def here():
    """The platform that runs this."""
    system = {"Linux": "linux", "Windows": "windows", "Darwin": "macos"}.get(platform.system(), platform.system())
    machine = {"x86_64": "x64", "AMD64": "x64", "aarch64": "arm64", "arm64": "arm64"}.get(platform.machine())
    return named(f"{system}-{machine}")


def of_wheel(wheel):
    """The platform of a wheel's file."""
    tag = wheel.stem.split("-")[-1]
    found = [one for one in PLATFORMS if any(re.fullmatch(one.tag, part) for part in tag.split("."))]
    return found[0] if found else sys.exit(f"{wheel.name}: no platform is known for the tag {tag}")


def version():
    """The version of this tree."""
    return tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]


def wheels(where=WHEELS):
    """The newest wheel of this version of each platform, by the platform's name."""
    oldest_first = sorted(where.glob(f"surfrecon-{version()}-*.whl"), key=lambda path: path.stat().st_mtime)
    return {of_wheel(wheel).name: wheel for wheel in oldest_first}


def commit_time():
    """Seconds of the commit, or of SOURCE_DATE_EPOCH: the time that files carry, so that two builds are the same."""
    asked = os.environ.get("SOURCE_DATE_EPOCH")
    if asked is None:
        command = ["git", "log", "-1", "--format=%ct"]
        asked = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False).stdout.strip()
    # Archives know no time before 1980, and none after 2107.
    if not asked.isdigit() or int(asked) > 4354819198:
        sys.exit(
            f"SOURCE_DATE_EPOCH must be a number of seconds since 1970, got {asked!r}; a tree without git needs it"
        )
    return max(int(asked), 315532800)


def commit():
    """The commit that is checked out: what is kept of a run says of which it is."""
    command = ["git", "rev-parse", "HEAD"]
    return subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False).stdout.strip()


if __name__ == "__main__":
    asked = named(sys.argv[1]) if len(sys.argv) > 1 else here()
    print(asked.triple if asked == here() else asked.cross_triple)
