"""The documentation site: `sphinx-build -c deploy/docs deploy OUT`.

The pages of ``deploy`` itself (operations, threat model) are pages of the site as they stand.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parents[1])]

from rampe_guard import __version__ as release  # noqa: E402 - the path is set above

project = "rampe-guard"
version = release
author = "the rampe-guard developers"
root_doc = "docs/index"
exclude_patterns = ["container", "grafana", "prometheus", "systemd", "docs/_*"]
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "docs_mathml",
    "docs_generated",
    "docs_alone",
]
nitpicky = True
nitpick_ignore_regex = [  # told by name; numpy's own site is not here
    ("py:class", r"numpy\..*"),
    ("py:class", r"rampe_guard\.core\.passing\.PassingWeights"),
]

myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]

autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_google_docstring = True
napoleon_use_ivar = True

smartquotes = False  # two dashes before an option are two dashes
html_theme = "furo"
html_title = f"rampe-guard {release}"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_extra_path = ["_extra"]
html_show_sphinx = False
html_show_copyright = False
html_copy_source = False
highlight_language = "none"
