"""Reports are alike: figures by name and by key, whichever call they come from."""

import copy
import inspect
import json
import pickle

import numpy as np
import pytest
import surfrecon
from heaps import look
from photos import photo_of
from shapes import torus, torus_scans

KINDS = [
    thing
    for thing in vars(surfrecon).values()
    if inspect.isclass(thing) and issubclass(thing, surfrecon.Report) and thing is not surfrecon.Report
]


def same(a, b):
    """Whether two figures are the same, arrays in them too."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[name], b[name]) for name in a)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(same, a, b))
    return np.array_equal(a, b, equal_nan=isinstance(a, float))


# Those of a phone's recording and of a scan that slides, which other tests have.
ELSEWHERE = {surfrecon.LeftOutReport, surfrecon.Freedom}

# Operations whose reports are made one by one.
ONE_BY_ONE = {"align", "merge", "sculpt", "reconstruct", "cluster", "texture", "write"}


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """One of each kind, from the calls that give them, but for those of `ELSEWHERE`."""
    scans = torus_scans(pixels=40)
    mesh = surfrecon.merge(scans, voxel=0.1).mesh
    clustered = surfrecon.cluster(mesh, vertices=60).report
    aligner = surfrecon.Aligner(look())
    aligned = aligner.align(turntable="equal").report
    photos = [photo_of(mesh, "one", (0, 0, 6))]
    textured = surfrecon.texture(surfrecon.unwrap(torus(8)).mesh, torus(8), photos, size=64).report
    found = [
        surfrecon.merge(scans, voxel=0.1).report,
        surfrecon.sculpt(scans[0]).report,
        surfrecon.adaptive_quads(scans[0]).report,
        surfrecon.reconstruct(mesh.positions).report,
        clustered,
        clustered.after,
        surfrecon.surface_distance(mesh, torus()),
        mesh.check(),
        aligned,
        aligned.scans[0],
        aligned.pairs[0],
        aligned.turntable,
        aligner.snap(1, np.eye(4)),
        textured,
        textured.photos[0],
    ]
    # Operations that nothing above runs.
    content = {"a mesh": torus(), "points": mesh.positions, "a range image": scans[0], "scans": scans}
    for operation in surfrecon.operations():
        run = getattr(surfrecon, operation.name, None)
        if run is not None and operation.name not in ONE_BY_ONE:
            made = next((run(content[kind]) for kind in operation.takes if kind in content), None)
            found += [made.report] if hasattr(made, "report") else []
    return {type(report): report for report in found}


def test_each_kind_is_tried(reports):
    assert set(reports) == set(KINDS) - ELSEWHERE


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ELSEWHERE])
def test_figures_are_had_by_name_and_by_key(reports, kind):
    report = reports[kind]
    assert list(report.keys()) == list(report) and dict(report).keys() == report.keys()
    for name in report:
        assert getattr(report, name) is report[name] and name in dir(report)
    # Type checkers know each figure, and no other.
    assert set(inspect.get_annotations(kind)) == set(report)
    with pytest.raises(AttributeError, match=rf"{kind.__name__} has no 'nothing'\. There are {next(iter(report))}, "):
        report.nothing  # noqa: B018
    with pytest.raises(KeyError):
        report["nothing"]
    with pytest.raises(AttributeError):
        report.nothing = 1
    assert not hasattr(report, "__dict__")


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ELSEWHERE])
def test_reports_are_kept_and_shown(reports, kind):
    report = reports[kind]
    for again in (pickle.loads(pickle.dumps(report)), copy.deepcopy(report)):
        assert type(again) is kind and same(again, report)
    assert repr(report).startswith(f"{kind.__name__}({next(iter(report))}=") and "\n" not in repr(report)
    assert len(str(report).splitlines()) >= 1
    plain = report.as_dict()
    assert type(plain) is dict and same(plain, report)
    back = json.loads(report.json(), parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert back.keys() == report.keys()


def test_arrays_and_numbers_without_end_are_json():
    report = surfrecon.Report(matrix=np.eye(2, dtype=np.float32), far=np.inf, of=[surfrecon.Report(x=np.int32(1))])
    assert json.loads(report.json()) == {"matrix": [[1, 0], [0, 1]], "far": None, "of": [{"x": 1}]}
    assert type(report.as_dict()["of"][0]) is dict
    assert repr(report) == "Report(matrix=<array 2 x 2>, far=inf, of=<1 Report>)"


def test_a_report_of_numbers_is_json_as_it_is(reports):
    for kind in (surfrecon.MergeReport, surfrecon.ClusterReport, surfrecon.CheckReport):
        assert json.loads(json.dumps(reports[kind])) == json.loads(reports[kind].json())


def test_an_alignment_prints_its_summary(reports):
    report = reports[surfrecon.AlignReport]
    assert str(report) == "\n".join(report.summary) and report.summary[0] in report.json()


@pytest.mark.parametrize("read", [lambda scan: scan.free, lambda scan: scan["free"]])
def test_former_names_of_figures_are_told_the_new_ones(read):
    way = surfrecon.Freedom(turns=True, direction=(0.0, 0.0, 1.0), point=(1.0, 2.0, 3.0))
    slide = surfrecon.Freedom(turns=False, direction=(1.0, 0.0, 0.0), point=(0.0, 0.0, 0.0))
    scan = surfrecon.AlignedScan(name="a", freedoms=[way, slide])
    with pytest.warns(DeprecationWarning, match="^free of AlignedScan is called freedoms now$") as told:
        found = read(scan)
    assert found == [("turn", (0.0, 0.0, 1.0), (1.0, 2.0, 3.0)), ("slide", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))]
    # The line that used the name is the one to change.
    assert told[0].filename == __file__
    assert "free" not in scan and "free" not in scan.as_dict() and "free" not in dir(scan)


def test_former_names_are_none_of_other_reports():
    report = surfrecon.Report(voxel=1.0)
    with pytest.raises(AttributeError, match="Report has no 'free'"):
        report.free  # noqa: B018 (asking is what is tried)
    with pytest.raises(KeyError):
        report["free"]


def test_the_former_name_of_a_parameter_s_kind_is_told_the_new_one():
    for parameter in surfrecon.parameters("triangulate"):
        with pytest.warns(DeprecationWarning, match="^Parameter.unit is called Parameter.kind now$"):
            assert parameter.unit == parameter.kind
