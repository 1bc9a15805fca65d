"""How Sphinx builds the site; `make docs` runs it."""

import os
import sys
from pathlib import Path

from pygments.lexers import DelphiLexer
from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parent / "_extensions"))

os.environ |= {"TTY_COMPATIBLE": "0", "COLUMNS": "80"}  # a page has no spinner

project = "livebode"
author = "the authors of livebode"
extensions = ["myst_nb", "sphinx.ext.autodoc", "numpydoc", "mathml", "api_pages"]
include_patterns = ["docs/**", "wings/*/README.md", "wings/*/docs/**"]  # the source is the whole repository
exclude_patterns = ["docs/_build", "docs/**/README.md"]
root_doc = "docs/index"

# Markdown
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_merge_streams = True
nb_execution_raise_on_error = True
nb_execution_timeout = 600

# Docstrings: a single backtick names a public object where there is one, otherwise it is code.
default_role = "py:obj"
autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

# Pages
html_theme = "pydata_sphinx_theme"
html_title = "livebode"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "show_prev_next": False,
    "navigation_with_keys": False,
    "footer_start": [],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}


def setup(app: Sphinx) -> None:
    """Structured Text has the words of Delphi; Pygments has no lexer of its own for it."""
    app.add_lexer("iecst", DelphiLexer)
