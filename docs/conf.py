"""How the documentation is built: `make docs`."""

from __future__ import annotations

import os
import sys
import warnings
from importlib.metadata import version as version_of
from pathlib import Path

os.environ["TQDM_DISABLE"] = "1"  # a page that takes longer than a bar's patience must not show one

sys.path.insert(0, str(Path(__file__).parent))

project = "udd"
author = "The udd developers"
copyright = "the udd developers"
release = version = version_of("udd")

extensions = [
    "myst_nb",
    "sphinx.ext.autosummary",
    "sphinx.ext.viewcode",
    "numpydoc",
    "mathml",
    "command_reference",
]
exclude_patterns = ["_build"]
templates_path = ["_templates"]
myst_heading_anchors = 3
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]

# Every page is run when it is built; an error in a cell ends the build.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_execution_in_temp = True
nb_merge_streams = True
nb_output_stderr = "remove-warn"  # a warning in a cell fails the build too

html_math_renderer = "mathml"

autodoc_typehints = "none"  # the docstrings say them in words
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

html_theme = "pydata_sphinx_theme"
html_title = "udd"
html_static_path = ["_static"]
html_css_files = ["udd.css"]
html_sidebars = {"index": [], "**": ["sidebar-nav-bs"]}
html_show_sourcelink = False
html_theme_options = {
    "show_prev_next": True,
    "secondary_sidebar_items": ["page-toc"],
    "navbar_end": ["theme-switcher"],
    "footer_start": [],
    "footer_end": [],
}

warnings.filterwarnings("ignore", category=DeprecationWarning)  # of Sphinx's own extensions
