"""Settings of Sphinx; `make docs` composes the pages first, see tools/docs/build.py."""

import os

project = "surfrecon"
author = "the authors of surfrecon"
version = release = os.environ["SURFRECON_VERSION"]

extensions = ["myst_parser", "sphinx_copybutton"]
myst_heading_anchors = 6
# Fences of colons: what is inside stays Markdown for `tools/docs/sections.py`.
myst_enable_extensions = ["smartquotes", "colon_fence"]
# Sections of other files may begin deeper than the page.
suppress_warnings = ["myst.header"]

# One argument a line where all of them are too long for one.
maximum_signature_line_length = 88
add_module_names = False
python_use_unqualified_type_names = True
toc_object_entries_show_parents = "hide"
primary_domain = None
highlight_language = "text"
copybutton_exclude = ".linenos, .gp, .go"

html_theme = "furo"
html_title = f"surfrecon {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
pygments_style = "tango"
pygments_dark_style = "github-dark"


def setup(app):
    """The parameters of operations as things that can be found and linked."""
    app.add_object_type("parameter", "parameter", "pair: %s; parameter")
