"""The installed extension: versions, enabling and disabling, uninstalling without a trace."""

import importlib.util
import os
import sys
import tomllib
from pathlib import Path

import bpy
from conftest import MODULE, ROOT, install


def registered():
    return sorted(name for name in dir(bpy.types) if "surfrecon" in name.lower())


def test_versions_agree():
    cargo = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]
    manifest = tomllib.loads((ROOT / "blender-addon" / "extension" / "blender_manifest.toml").read_text())["version"]
    import surfrecon

    assert cargo == manifest == surfrecon.__version__


def test_the_wheel_is_the_bundled_one():
    import surfrecon

    assert Path(surfrecon.__file__).is_relative_to(os.environ["BLENDER_USER_RESOURCES"])


def test_disabling_and_enabling():
    import addon_utils

    before = registered()
    assert "SURFRECON_OT_merge" in before and hasattr(bpy.types.Scene, "surfrecon")
    addon_utils.disable(MODULE)
    assert registered() == [] and not hasattr(bpy.types.Scene, "surfrecon")
    addon_utils.enable(MODULE)
    assert registered() == before


def test_uninstalling_leaves_nothing():
    import surfrecon

    wheel = Path(surfrecon.__file__).parent
    folder = Path(sys.modules[MODULE].__file__).parent
    repositories = [repository.module for repository in bpy.context.preferences.extensions.repos]
    index = repositories.index("user_default")
    bpy.ops.extensions.package_uninstall(repo_index=index, pkg_id="surfrecon")
    assert registered() == [] and not hasattr(bpy.types.Scene, "surfrecon")
    assert MODULE not in bpy.context.preferences.addons
    assert not folder.exists() and not wheel.exists()
    for name in ("TOPBAR_MT_file_import", "TOPBAR_MT_file_export", "VIEW3D_MT_object"):
        menu = getattr(bpy.types, name).draw._draw_funcs
        assert not any("surfrecon" in function.__module__ for function in menu)
    # For the tests that follow.
    install()
    assert importlib.util.find_spec("surfrecon")
