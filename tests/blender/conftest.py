"""Installs the built extension into a Blender of its own (the bpy module) and gives each test an empty scene."""

import inspect
import os
import sys
import tempfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MODULE = "bl_ext.user_default.surfrecon"

# Must be set before the first `import bpy`.
os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="surfrecon-blender-")
sys.path += [str(ROOT / "tests" / "python"), str(ROOT / "tools")]

import platforms  # noqa: E402 (the path is made above)


def built_zip():
    """The zip to test: EXTENSION_ZIP, else what tools/build_extension.py built for this platform."""
    zips = (ROOT / "out" / "extension").glob(f"surfrecon-*-{platforms.here().name}.zip")
    return os.environ.get("EXTENSION_ZIP") or str(next(zips))


@pytest.fixture
def extension():
    """The installed and enabled extension; reinstalling makes its modules anew."""
    return sys.modules[MODULE]


@pytest.fixture(autouse=True)
def empty_scene(extension):
    """Each test starts from an empty file; the factory settings would disable the extension."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True)
    # Undo needs a window, and pushes of its own where nobody clicks.
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        yield


@pytest.fixture
def previewed():
    """Runs an operator with options; returns the mesh that its preview shows of the input that it gathered, and the
    matrix with it. The preview is started as `modal` would start it.
    """
    import bpy

    def run(name, **options):
        cls, shown = getattr(bpy.types, f"SURFRECON_OT_{name}"), []
        launch = cls.launch

        def launched(self, context):
            job = launch(self, context)
            if inspect.isgenerator(job):
                job = yield from job
            shown.append(self.preview_mesh(self.preview(context).result()))
            return job

        cls.launch = launched
        try:
            getattr(bpy.ops.surfrecon, name)(**options)
        finally:
            cls.launch = launch
        return shown[0]

    return run


def install():
    """Installs and enables the zip."""
    import bpy

    bpy.ops.extensions.package_install_files(filepath=built_zip(), repo="user_default", enable_on_install=True)
    # Blender answers FINISHED even when it refuses the package.
    assert MODULE in bpy.context.preferences.addons


def pytest_configure(config):
    config.surfrecon_status = 1
    # Before the tests are collected: they import the wheel that the extension brings.
    install()


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session, exitstatus):
    session.config.surfrecon_status = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config):
    # The bpy module's own way out hangs in 4.5 and crashes in 4.2 when classes are still registered.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(config.surfrecon_status)
