"""How Sphinx builds the site: `make site`, or `make docs` with every picture rendered anew."""

import importlib.metadata
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
sys.path.insert(0, str(HERE.parent))

import options  # noqa: E402, found by the line above

project = "ringlet"
author = "The ringlet authors"
copyright = f"2026, {author}"  # noqa: A001, Sphinx calls it so
release = version = importlib.metadata.version("ringlet")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.doctest",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["examples/*", "examples/**/*"]
html_theme = "furo"
html_title = f"ringlet {release}"

myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_preserve_defaults = True
suppress_warnings = ["ref.python"]  # one name in several rooms

sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "gallery_dirs": "examples_gallery",
    "filename_pattern": r"/plot_",
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "remove_config_comments": True,
    "show_memory": False,
    "show_signature": False,
}

options.write(HERE / "reference" / "options.md")
