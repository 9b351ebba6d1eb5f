"""Builds what a release consists of, for all systems, on Linux: release.py [PLATFORM...]; the files are in out/release/

For each platform: the Python wheel, the Blender extension, the C library with headers, pkg-config and CMake files.
Once: the source distribution, Debian's package, the index that makes the folder a repository for Blender, a bill of
materials, checksums. What is published comes from the workflow .github/workflows/release.yml, whose machines have each
system's own compiler.
"""

import argparse
import gzip
import json
import os
import resource
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from pathlib import Path

import platforms
import release_folder

ROOT = platforms.ROOT
OUT = ROOT / "out" / "release"
VERSION = platforms.version()
# Windows finds no interpreter in the first line of a script, and another bash than Git's before it.
BASH = shutil.which("bash")
DEB_ARCHITECTURE = {"linux-x64": "amd64", "linux-arm64": "arm64"}


def main():
    """Builds what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    names = ", ".join(one.name for one in platforms.PLATFORMS)
    parser.add_argument("platforms", nargs="*", metavar="PLATFORM", help=names)
    parser.add_argument("--only", choices=["c", "wheel"], help="C libraries, or wheels and extensions, alone")
    parser.add_argument("--native", action="store_true", help="for this system alone; by its own compiler if not Linux")
    arguments = parser.parse_args()
    if arguments.native and arguments.platforms:
        parser.error("--native builds for this system: name no platform")
    chosen = [platforms.named(name) for name in arguments.platforms] or platforms.PLATFORMS
    if arguments.native:
        chosen = [platforms.here()]
    # On Linux zig links, here too, so that what comes out runs on older systems than this one.
    native = arguments.native and not chosen[0].name.startswith("linux")

    os.environ["SOURCE_DATE_EPOCH"] = str(platforms.commit_time())
    if native:
        os.environ["RUSTFLAGS"] = output(BASH, "-c", ". tools/lib.sh && without_paths")
    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    rows = []
    for platform in chosen:
        if arguments.only != "c":
            with timed(rows, "wheel", platform) as files:
                files.append(wheel(platform, native))
        if arguments.only != "wheel":
            with timed(rows, "c_library", platform) as files:
                files += c_library(platform, native)
    if arguments.only != "c":
        with timed(rows, "extension", None) as files:
            files += extensions(chosen)
    if not arguments.only:
        with timed(rows, "source", None) as files:
            files += sources()
    look_into(sorted(OUT.glob("*macos*")))
    release_folder.complete(OUT)
    (OUT.parent / "release.json").write_text(json.dumps({"commit": platforms.commit(), "rows": rows}, indent=1) + "\n")
    for row in rows:
        print(f"{row['case']:10} {row['platform'] or '':12} {row['minutes_cpu']:5.1f} CPU minutes {row['mb']:6.1f} MB")


class timed:
    """Measures one step, and how large its files are."""

    def __init__(self, rows, case, platform):
        self.rows, self.case, self.platform, self.files = rows, case, platform and platform.name, []

    def __enter__(self):
        self.started = cpu()
        return self.files

    def __exit__(self, kind, value, trace):
        if kind is None:
            size = sum(path.stat().st_size for path in self.files) / 1e6
            names = [path.name for path in self.files]
            minutes = (cpu() - self.started) / 60
            self.rows.append(
                {"case": self.case, "platform": self.platform, "minutes_cpu": minutes, "mb": size, "files": names}
            )


def cpu():
    """Seconds of computing of all programs that were called."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def output(*command, **options):
    """The output of a program. Its errors are the user's to see."""
    return subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True, **options).stdout.strip()


def environment(platform):
    """The environment while something is built for a platform."""
    script = 'environment=$(tools/cross.sh "$1") && eval "$environment" && env -0'
    found = output(BASH, "-c", script, "bash", platform.cross_triple)
    return dict(line.split("=", 1) for line in found.split("\0") if "=" in line)


def wheel(platform, native):
    """The wheel, in the release's folder."""
    output(BASH, "tools/build_wheel.sh", *([] if native else [platform.name]))
    return copied(platforms.wheels()[platform.name])


def copied(file):
    """The file, in the release's folder."""
    return Path(shutil.copy(file, OUT / file.name))


def extensions(chosen):
    """The extension's zips, and the index that makes the folder a repository for Blender."""
    output(sys.executable, "tools/build_extension.py", *(one.name for one in chosen))
    zips = [copied(file) for file in sorted((ROOT / "out" / "extension").glob("*.zip"))]
    output(sys.executable, "tools/extension_index.py", str(OUT))
    return [*zips, OUT / "index.json"]


def c_library(platform, native):
    """The archive of the C library, and Debian's package on Linux."""
    name = f"libsurfrecon-{VERSION}-{platform.name}"
    where = dict(os.environ)
    if not native:
        where = {**environment(platform), "SURFRECON_TARGET": platform.cross_triple}
    with tempfile.TemporaryDirectory() as scratch:
        # Everything in it names its neighbours from where it is, so it may be unpacked anywhere.
        output(BASH, "tools/install_c.sh", "/usr", env={**where, "DESTDIR": Path(scratch).as_posix()})
        installed = Path(scratch) / "usr"
        files = [archived(installed, name, zipped=platform.name.startswith("windows"))]
        if platform.name in DEB_ARCHITECTURE:
            files.append(debian_package(Path(scratch), DEB_ARCHITECTURE[platform.name]))
    return files


def archived(folder, name, zipped):
    """The archive of a folder: the same bytes for the same files."""
    paths = sorted(path for path in folder.rglob("*") if not path.is_dir())
    if zipped:
        target = OUT / f"{name}.zip"
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
            for path in paths:
                # The target of a link: Windows has no links.
                entry = zipfile.ZipInfo(
                    f"{name}/{path.relative_to(folder).as_posix()}", time.gmtime(platforms.commit_time())[:6]
                )
                entry.external_attr = 0o644 << 16
                archive.writestr(entry, path.read_bytes(), zipfile.ZIP_DEFLATED)
        return target
    target = OUT / f"{name}.tar.gz"
    with (
        target.open("wb") as file,
        gzip.GzipFile("", "wb", 9, file, mtime=platforms.commit_time()) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.GNU_FORMAT) as archive,
    ):
        for path in paths:
            archive.add(path, f"{name}/{path.relative_to(folder)}", filter=anonymous)
    return target


def anonymous(entry):
    """An entry of an archive without its owner and time."""
    entry.uid = entry.gid = 0
    entry.uname = entry.gname = "root"
    entry.mtime = platforms.commit_time()
    return entry


def debian_package(root, architecture):
    """The package for Debian and Ubuntu of what is installed under root, made by Debian's own tool."""
    if shutil.which("dpkg-deb") is None:
        sys.exit("release.py: dpkg-deb is missing, which makes the package for Debian: apt-get install dpkg")
    size = sum(path.lstat().st_size for path in root.rglob("*")) // 1024
    control = f"""Package: libsurfrecon-dev
Version: {VERSION}
Architecture: {architecture}
Maintainer: surfrecon contributors <noreply@surfrecon.invalid>
Installed-Size: {size}
Depends: libc6 (>= 2.28)
Section: libdevel
Priority: optional
Description: surfaces from range scans, for programs in C and C++
 Reads range scans, aligns them, merges them into one surface, sculpts them to adaptive
 meshes within an error bound and rebuilds surfaces from scattered points.
"""
    (root / "DEBIAN").mkdir()
    (root / "DEBIAN" / "control").write_text(control)
    target = OUT / f"libsurfrecon-dev_{VERSION}_{architecture}.deb"
    output("dpkg-deb", "--root-owner-group", "-Zxz", "--build", str(root), str(target))
    return target


def sources():
    """The source distribution of the wheel."""
    where = {**os.environ, "PATH": f"{output(BASH, 'tools/venv.sh', 'build')}/bin{os.pathsep}{os.environ['PATH']}"}
    output("maturin", "sdist", "--manifest-path", "python/Cargo.toml", "--out", str(OUT), env=where)
    return list(OUT.glob("surfrecon-*.tar.gz"))


def look_into(files):
    """Ends the release if something about libraries for macOS does not hold."""
    if files:
        python = f"{output(BASH, 'tools/venv.sh', 'release')}/bin/python"
        if subprocess.run([python, "tools/check_macos.py", *files], cwd=ROOT, check=False).returncode != 0:
            sys.exit("release.py: libraries for macOS are not as they should be, see above")


if __name__ == "__main__":
    main()
