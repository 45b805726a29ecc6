"""Renders HTML pages: every value is escaped, a missing value is an error."""

from __future__ import annotations

from base64 import b64encode
from pathlib import Path

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

SHARED = "flockwire_analysis"  # templates that those of any package may use


def render(package: str, template: str, /, **values: object) -> str:
    """Render a template from the folder templates/ of `package` with `values`.

    Raises jinja2.UndefinedError if the template needs a value that is not given.
    """
    return _environment(package).get_template(template).render(values)


def _environment(package: str) -> Environment:
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(name) for name in (package, SHARED)]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["data_uri"] = _data_uri
    return environment


def _data_uri(picture: Path) -> str:
    """Return a PNG file as a data URI."""
    return f"data:image/png;base64,{b64encode(picture.read_bytes()).decode()}"
