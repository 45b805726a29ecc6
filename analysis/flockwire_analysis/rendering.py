"""How HTML pages are rendered: every value is escaped, a value that a template lacks is an error."""

from __future__ import annotations

from base64 import b64encode
from pathlib import Path

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

SHARED = "flockwire_analysis"  # its templates may be used in those of any package


def render(package: str, template: str, /, **values: object) -> str:
    """Return a template from the folder templates/ of `package`, filled in with `values`.

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
    """Return a PNG file as an address that holds the file itself."""
    return f"data:image/png;base64,{b64encode(picture.read_bytes()).decode()}"
