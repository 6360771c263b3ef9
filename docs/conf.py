"""Sphinx settings of the handbook's site. `make docs` builds it; docs/build.py prepares the folder that is read."""

import os
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

DOCS = Path(__file__).resolve().parent
sys.path[:0] = [str(DOCS), str(DOCS.parent)]

from functools import cache  # noqa: E402

from docutils.nodes import SkipNode  # noqa: E402
from docutils.utils.math.latex2mathml import tex2mathml  # noqa: E402
from pages.api_pages import source_of  # noqa: E402
from pages.docstrings import as_restructured_text  # noqa: E402
from sphinx.search.en import SearchEnglish  # noqa: E402

project = "Flight Graph"
author = "the authors of Flight Graph"
project_copyright = "the authors of Flight Graph. Licence: Apache-2.0"
version = release = ElementTree.parse(DOCS.parent / "package.xml").findtext("version")
language = "en"

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.linkcode"]
exclude_patterns = ["jupyter_execute"]
myst_enable_extensions = ["html_image", "dollarmath"]
html_math_renderer = "mathml"
myst_heading_anchors = 4
nb_execution_mode = os.environ.get("HANDBOOK_NOTEBOOKS", "off")
nb_execution_timeout = 300  # [s] a cell
nb_execution_show_tb = True
nb_merge_streams = True
highlight_language = "text"
smartquotes = False
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
autodoc_use_type_comments = False
autodoc_inherit_docstrings = False

html_extra_path = [os.environ["HANDBOOK_FILES"]]
html_theme = "pydata_sphinx_theme"
html_title = "Flight Graph"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "logo": {"text": "Flight Graph"},
    "header_links_before_dropdown": 9,
    "show_prev_next": True,
    "navigation_depth": 2,
    "show_nav_level": 1,
    "show_toc_level": 2,
    "navbar_align": "left",
    "footer_start": ["copyright"],
    "footer_end": [],
    "back_to_top_button": False,
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}


class Search(SearchEnglish):
    """English, each word's stem found once."""

    stem = cache(SearchEnglish.stem)


def _write_inline_formula(writer, node):
    _write_formula(writer, node, as_block=False)


def _write_formula(writer, node, as_block=True):
    """A formula as MathML, which browsers draw without a script from elsewhere."""
    writer.body.append(tex2mathml(node.astext(), as_block=as_block))
    raise SkipNode


def linkcode_resolve(domain, info):
    """Where the source of a thing stands in the site."""
    return source_of(info["module"], info["fullname"])


def _read_prose(app, what, name, thing, options, lines):
    lines[:] = as_restructured_text(lines)


def setup(app):
    app.add_search_language(Search)
    app.add_html_math_renderer("mathml", (_write_inline_formula, None), (_write_formula, None))
    app.connect("autodoc-process-docstring", _read_prose)
    return {"parallel_read_safe": True}
