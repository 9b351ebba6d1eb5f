"""Scans thrown about, aligned and in place, for the tests of aligning."""

import numpy as np
import pytest
import surfrecon
from heaps import look, rigid


@pytest.fixture(scope="session")
def truth():
    return look()


@pytest.fixture(scope="session")
def heap():
    """The same thrown about."""
    generator = np.random.default_rng(5)
    scans = look()
    for scan in scans:
        scan.world_from_sensor = rigid(generator)
    return scans


@pytest.fixture(scope="session")
def aligned(heap):
    return surfrecon.align(heap)


@pytest.fixture(scope="session")
def aligner(heap):
    return surfrecon.Aligner(heap)


@pytest.fixture(scope="session")
def in_place(truth):
    """The scans where they belong, made ready."""
    return surfrecon.Aligner(truth)
