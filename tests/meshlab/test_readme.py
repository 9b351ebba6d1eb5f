"""The example of the plugin's README.md runs."""

import contextlib
import re

import pymeshlab
import surfrecon
from conftest import ROOT, plugins
from heaps import look


def test_the_example_runs(tmp_path):
    surfrecon.write_scans(tmp_path / "placed.conf", look())
    text = (ROOT / "meshlab-plugin" / "README.md").read_text("utf-8")
    (source,) = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
    # The place of the plugin is for each to say. A second load of the same one is refused.
    load = 'pymeshlab.load_plugin("libfilter_surfrecon.so")\n'
    assert load in source and (plugins() / "libfilter_surfrecon.so").is_file()
    names = {"pymeshlab": pymeshlab}
    with contextlib.chdir(tmp_path):
        exec(compile(source.replace(load, ""), "README.md", "exec"), names)
    # The scans and the surface.
    assert len(names["meshes"]) == 7
