"""Installs the extension from a repository at an address of this machine, in the preferences, and uses it once."""

import functools
import os
import sys
import tempfile
import threading
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))

import driver  # noqa: E402 (the path is made above)
from driver import check, drive, picture, run, until  # noqa: E402

NAME = "Scans of this machine"
# The button of the only row that is listed, in pixels: below the search, and with a message between them.
INSTALL = [(74, 85), (74, 116)]


class Files(SimpleHTTPRequestHandler):
    """Serves the folder that tools/extension_index.py has made, and notes what is asked for."""

    asked = []

    def log_message(self, form, *values):
        """Called for each request."""
        self.asked.append(self.path.split("?")[0])


def serve():
    """The address of the folder's index, on a free port."""
    handler = functools.partial(Files, directory=os.environ["SURFRECON_REPOSITORY"])
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}/index.json"


def repository():
    """The repository that the preferences have under our name. None before."""
    repos = bpy.context.preferences.extensions.repos
    return next((repo for repo in repos if repo.name == NAME), None)


def click(window, place):
    """The left button, so far from the upper right corner of a window."""
    x, y = window.width - place[0], window.height - place[1]
    # The first move lets the button know of the mouse, which slow drawing may keep from it.
    moves = [("MOUSEMOVE", "NOTHING", 3), ("MOUSEMOVE", "NOTHING", 0)]
    for kind, value, off in (*moves, ("LEFTMOUSE", "PRESS", 0), ("LEFTMOUSE", "RELEASE", 0)):
        window.event_simulate(type=kind, value=value, x=x + off, y=y)
        yield 0.5


def installed():
    """Whether the extension is there and enabled."""
    return driver.MODULE in bpy.context.preferences.addons


def installing():
    """Preferences > Get Extensions: the address is added, the list comes, a click installs."""
    for repo in bpy.context.preferences.extensions.repos:
        # Blender's own repository, which is not on this machine.
        repo.enabled = not repo.use_remote_url
    url = serve()
    window = bpy.context.window_manager.windows[0]
    # The preferences open where the mouse is.
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=window.width // 2, y=window.height // 2)
    yield 0.5
    run(bpy.ops.screen.userpref_show, "INVOKE_DEFAULT", section="EXTENSIONS")
    yield 1.0
    check("without online access nothing can be installed", not bpy.ops.extensions.package_install.poll())
    bpy.ops.extensions.userpref_allow_online()
    bpy.ops.preferences.extension_repo_add(name=NAME, remote_url=url, type="REMOTE")
    check("the repository is added", repository() is not None)
    repo = repository()
    bpy.ops.extensions.repo_sync("INVOKE_DEFAULT", repo_directory=repo.directory)
    listed = Path(repo.directory) / ".blender_ext" / "index.json"
    yield from until(listed.exists, 60)
    check("its list is fetched", listed.exists())
    bpy.context.window_manager.extension_search = "Range"
    # As long as Blender says that it looks for updates, what folds the list is where the button will be.
    yield 20.0
    picture("11_repository")
    driver.MODULE = f"bl_ext.{repo.module}.surfrecon"
    # The message comes and goes.
    for place in 3 * INSTALL:
        yield from click(bpy.context.window_manager.windows[-1], place)
        yield from until(installed, 10)
        if installed():
            break
    check("the extension is installed and enabled", installed())
    zips = [path for path in Files.asked if path.endswith(".zip")]
    check(f"of all platforms this one's zip was taken: {zips}", len(zips) == 1 and "linux-x64" in zips[0])
    yield 1.0
    picture("11_repository_installed")
    bpy.context.preferences.system.use_online_access = False
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[-1]):
        bpy.ops.wm.window_close()
    yield 0.5


def using(folder):
    """Scans of a made-up shape are brought in and merged, without being online."""
    import surfrecon

    home = Path(os.environ["BLENDER_USER_RESOURCES"])
    check("Python's package is the one that came with it", Path(surfrecon.__file__).is_relative_to(home))
    shape = surfrecon.sculpture(cell=8.0)
    images = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=100))
    for k, image in enumerate(images):
        image.name = f"scan{k:02}"
    surfrecon.write_scans(folder / "scans.conf", images)
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    options = {"filepath": str(folder / "scans.conf"), "directory": f"{folder}/", "files": [{"name": "scans.conf"}]}
    running = driver.extension().job.Running
    run(bpy.ops.surfrecon.import_scans, "EXEC_DEFAULT", True, **options, unit="MM")
    yield from until(lambda: bpy.data.objects and running.job is None)
    check("it brings scans in", len(bpy.data.objects) > 1)
    run(bpy.ops.surfrecon.merge)
    yield from until(lambda: running.job is None)
    yield 0.5
    merged = bpy.data.objects.get("scans merged")
    check("and merges them", merged is not None and len(merged.data.polygons) > 1000)
    picture("11_repository_used")


def steps():
    """Both."""
    yield from installing()
    with tempfile.TemporaryDirectory() as folder:
        yield from using(Path(folder))


if __name__ == "__main__":
    drive(steps())
