"""How the pages of this folder become a site: `make docs`. Nothing in it comes from the network."""

from __future__ import annotations

import re
import shutil
import tomllib
from html import escape
from pathlib import Path
from typing import Any

import ziamath
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.logging import getLogger

from escort_mj.cli.listing import reference_pages
from escort_mj.version import __version__

LOG = getLogger(__name__)
HERE = Path(__file__).parent
NOTEBOOKS = HERE / "notebooks"  # copies: Sphinx reads nothing outside of its folder
PROJECT = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]

project = "escort_mj"
author = PROJECT["authors"][0]["name"]
copyright = author
version = release = __version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton"]
nb_execution_mode = "off"  # `python -m benchmarks.notebooks` runs them
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
napoleon_use_ivar = True
default_role = "code"
smartquotes = False  # -- begins an option
autodoc_typehints = "description"
autodoc_member_order = "bysource"
exclude_patterns = ["site", "jupyter_execute"]
copybutton_exclude = ".linenos, .gp, .go"

for name, text in reference_pages().items():
    (HERE / name).write_text(text, encoding="utf-8")
shutil.copytree(
    HERE.parent / "examples", NOTEBOOKS, dirs_exist_ok=True, ignore=shutil.ignore_patterns("*.py", "plugins")
)

html_theme = "furo"
html_title = f"escort_mj {version}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_math_renderer = "svg"
html_show_sphinx = False
html_copy_source = False
html_show_search_summary = False  # fetching it is forbidden to pages opened from a disk

SIZE = 16  # pixels of an em
_VIEW = re.compile(r'width="[\d.]+" height="[\d.]+" viewBox="(\S+) (\S+) (\S+) (\S+)"')


def picture(text: str, inline: bool) -> str:
    """An equation as SVG, on the text's line and in its color, without fonts or scripts.

    Args:
        text: LaTeX.
        inline: Whether it stands within a line.
    """
    drawn = ziamath.Latex(text, size=SIZE, color="currentColor", inline=inline).svg()
    _, top, width, height = map(float, _VIEW.search(drawn).groups())
    below = -(top + height)
    ems = {"width": width, "height": height, "vertical-align": below}
    place = ";".join(f"{name}:{length / SIZE:.3f}em" for name, length in ems.items())
    about = f'role="img" aria-label="{escape(text)}" style="{place}"'
    return _VIEW.sub(lambda match: f'{about} viewBox="{" ".join(match.groups())}"', drawn)


def equation(writer: Any, node: nodes.Element) -> None:
    """Writes an equation into a page; one that cannot be read is a warning, and ends a strict build."""
    inline = not isinstance(node, nodes.math_block)
    try:
        drawn = picture(node.astext(), inline)
    except Exception as fault:
        LOG.warning("%s in the equation %s", fault, node.astext(), location=node)
    else:
        writer.body.append(drawn if inline else f'<div class="math">{drawn}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> None:
    """Tells Sphinx of the renderer of equations."""
    app.add_html_math_renderer("svg", (equation, None), (equation, None))
