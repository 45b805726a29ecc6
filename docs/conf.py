"""The configuration of the documentation site (scripts/docs)."""

from __future__ import annotations

import inspect
import re
import sys
from importlib.metadata import version as version_of
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

project = "flockwire"
author = copyright = "The flockwire authors"
release = version = version_of("flockwire")
extensions = ["myst_parser", "sphinx.ext.autodoc"]
html_theme = "furo"
html_title = f"flockwire {release}"
html_static_path: list[str] = []
html_copy_source = False
html_show_sourcelink = False
templates_path: list[str] = []

myst_enable_extensions = ["attrs_inline"]
myst_heading_anchors = 4
nitpicky = False
highlight_language = "bash"  # of indented commands
default_role = "code"  # docstrings name code in single backquotes

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "undoc-members": True}
python_use_unqualified_type_names = True
FIELD = re.compile(r"^    (\w+): .*?  # (.*)$", re.MULTILINE)


def comments_of(owner: type) -> dict[str, str]:
    """Return the comment behind each field of a class; it is the field's documentation."""
    return dict(FIELD.findall(inspect.getsource(owner)))


def owner_of(name: str) -> object:
    """Return what `module.Class.member` is a member of."""
    module, _, owner = name.rpartition(".")[0].rpartition(".")
    return getattr(sys.modules.get(module), owner, None)


def adapt(app: Sphinx, what: str, name: str, one: Any, options: Any, lines: list[str]) -> None:  # noqa: ANN401
    """Document a field by the comment behind it; escape the bars of norms, which have a meaning in reStructuredText."""
    owner = owner_of(name)
    if what in ("attribute", "property") and inspect.isclass(owner) and not isinstance(one, property):
        lines[:] = [comments_of(owner).get(name.rpartition(".")[2], "")]
    lines[:] = [line.replace("|", "\\|") for line in lines]


def setup(app: Sphinx) -> None:
    """Connect what is above."""
    app.connect("autodoc-process-docstring", adapt)
