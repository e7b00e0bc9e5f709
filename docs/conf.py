"""Sphinx's settings: `make docs` builds the site. Everything that a page loads is local: no web font, no CDN.

Sphinx because it reads the docstrings as they are (numpydoc) and makes a reference that leads nowhere a warning, which
the build takes as an error; Furo because it loads nothing from elsewhere, and is readable on a telephone.
"""

import os
import re
import shutil
import sys
from dataclasses import is_dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent))

from figures.draw import draw_all
from generated import MADE, SCHEMAS, key_lines, schema_text

from dzdesign.core.version import __version__

HERE = Path(__file__).parent

project, author, copyright = "dzdesign", "the authors of dzdesign", "the authors of dzdesign, Apache-2.0"
version = release = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["derivation/*", "_build"]
suppress_warnings = ["config.cache"]
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3
napoleon_google_docstring = False
napoleon_use_ivar = True
autodoc_typehints = "none"  # the docstrings name types and units
autodoc_member_order = "bysource"
add_module_names = False
default_role = "code"  # the docstrings' `name` is a name, not a reference

smartquotes = False  # what is copied from a page is typed as it stands

html_theme = "furo"
html_title = f"dzdesign {version}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_show_sphinx = html_copy_source = html_show_sourcelink = False
html_last_updated_fmt = None
pygments_style, pygments_dark_style = "friendly", "github-dark"
#: The account of the paper, where `make docs` has built it.
ACCOUNT = HERE / "derivation"


def _say(text: str) -> None:
    """Say what comes next: a build takes two minutes, and Sphinx is told to be quiet but for warnings."""
    print(f"docs: {text}", flush=True)


def _draw(app) -> None:
    draw_all(HERE / "_made" / "figures", _say)


def _say_reading(app, env, pages: list[str]) -> None:
    _say(f"reading {len(pages)} pages, with the reference of commands, files and Python")


def _say_writing(app, env) -> None:
    _say("writing the pages")


def _insert(app, page: str, source: list[str]) -> None:
    source[0] = re.sub(r"<!-- made: (\w+) -->", lambda found: MADE[found[1]](), source[0])


def _escape(app, what, name, obj, options, lines: list[str]) -> None:
    """Keep reStructuredText from taking names for markup: an underscore at the end, a pattern's `*`, several names."""
    for index, line in enumerate(lines):
        parts = line.split("`")  # what stands in backticks is taken as it is
        parts[::2] = [re.sub(r"(?<=/)\*|\*(?=[/.])", r"\\*", part) for part in parts[::2]]
        line = "`".join(parts)
        line = re.sub(r"\b([A-Za-z]\w*)_(?![\w`])", r"\1\\_", line)
        lines[index] = re.sub(r"^:(ivar|vartype) ([^:]+):", lambda found: found[0].replace(", ", ","), line)


def _describe_keys(app, what, name, obj, options, lines: list[str]) -> None:
    """Describe the keys of an artefact by its annotations, which its docstring does not repeat."""
    if is_dataclass(obj) and not any(line.startswith(":ivar") for line in lines):
        lines += ["", *key_lines(obj), ""]


def _publish(app, error: Exception | None) -> None:
    """Put the schemas and the derivation's account beside the pages."""
    if error or app.builder.format != "html":
        return
    schemas = Path(app.outdir) / "schemas"
    schemas.mkdir(exist_ok=True)
    for name in SCHEMAS:
        (schemas / f"{name}.schema.json").write_text(schema_text(name), encoding="utf-8")
    if ACCOUNT.is_dir():
        shutil.copytree(ACCOUNT, Path(app.outdir) / "derivation", dirs_exist_ok=True)


def setup(app) -> None:
    """Tell Sphinx when to draw, to insert what is made, and to publish."""
    app.connect("builder-inited", _draw)
    app.connect("env-before-read-docs", _say_reading)
    app.connect("env-updated", _say_writing)
    app.connect("source-read", _insert)
    app.connect("autodoc-process-docstring", _describe_keys, priority=800)
    app.connect("autodoc-process-docstring", _escape, priority=900)
    app.connect("build-finished", _publish)
