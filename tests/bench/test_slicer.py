"""The slicer that judges closed surfaces: it makes G-code of what we close and prepare, and repairs nothing."""

import numpy as np
import pytest
import slicer
import surfrecon

needs_slicer = pytest.mark.skipif(not slicer.is_there(), reason="prusa-slicer is not installed: make bench installs it")

GOOD = """[2026-01-01 00:00:00.000000] [0x0000] [trace]   Initializing StaticPrintConfigs
[surface.stl]
size_x = 40.000000
min_x = 0.000000
number_of_facets = 4
manifold = yes
number_of_parts =  1
volume = 1000.000000
10 => Processing triangulated mesh
Slicing result exported to surface.gcode
"""


def test_what_it_says_of_a_fault_is_heard():
    assert slicer.faults_told(GOOD, 1004.9) == []
    for line, expected in (
        ("facets_reversed = 1", "facets_reversed = 1"),
        ("print warning: the model has overlapping facets", "print warning: the model has overlapping facets"),
        ("[2026-01-01 00:00:00.000000] [0x0000] [error]   bad", "[2026-01-01 00:00:00.000000] [0x0000] [error]   bad"),
    ):
        assert slicer.faults_told(GOOD + line + "\n", 1000) == [expected]
    assert slicer.faults_told(GOOD.replace("yes", "no"), 1000) == ["manifold = no"]
    assert slicer.faults_told(GOOD, 1006) == ["its volume is 1000.0, ours 1006"]
    assert len(slicer.faults_told("", 1000)) == 2


@pytest.fixture(scope="module")
def closed():
    """A closed surface that scans saw a part of."""
    shape = surfrecon.sculpture(cell=8)
    scans = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=100))[:6]
    found = surfrecon.close(surfrecon.merge(scans, max_hole_length=0).mesh, scans)
    assert found.report.is_closed and found.report.closed > 0
    return found.mesh


def of(mesh):
    return np.array(mesh.positions), np.array(mesh.triangles, np.int64)


@needs_slicer
def test_it_slices_what_is_closed_and_what_is_prepared(closed):
    prepared = surfrecon.prepare_print(closed, scale_to=60, hollow=3, drain=6, flat_base=True)
    assert prepared.report.is_drained
    for mesh in (closed, prepared.mesh):
        assert slicer.faults(*of(mesh)) == []


@needs_slicer
def test_it_finds_what_is_broken(closed):
    vertices, faces = of(closed)
    turned = faces.copy()
    turned[7] = turned[7][::-1]
    assert "stl: facets_reversed = 1" in slicer.faults(vertices, turned)
    assert "3mf: manifold = no" in slicer.faults(vertices, faces[1:])
    assert "stl: facets_removed = 1" in slicer.faults(vertices, np.concatenate([faces, faces[:1]]))


@needs_slicer
def test_a_unit_of_3mf_is_that_of_the_slicer(closed, tmp_path):
    """In metres or in millimetres, the body has one size."""
    vertices, faces = of(closed)
    metres = vertices * (0.04 / np.ptp(vertices, axis=0).max())
    volume = 1e9 * slicer.volume_of(metres, faces)
    for scale, unit in ((1, 1), (1000, 0.001), (1 / 0.0254, 0.0254), (5, 0.2)):
        file = tmp_path / f"{unit}.3mf"
        surfrecon.Mesh(scale * metres, faces).write(file, metres_per_unit=unit)
        assert slicer.faults_of_file(file, volume) == [], unit
