"""The scenes of examples, and modules of the tools and of the other tests."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / folder) for folder in ("demo", "tools/docs", "tests/python", "tests/blender")]


@pytest.fixture(scope="session")
def scenes(tmp_path_factory):
    """Makes what examples find, each once."""
    from scenes import Scenes

    return Scenes(tmp_path_factory.mktemp("scenes"))
