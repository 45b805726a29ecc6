"""The templates of what `flockwire deploy` writes."""

from __future__ import annotations

from jinja2 import Environment, PackageLoader, StrictUndefined, Template


def template(name: str) -> Template:
    """Return the template called `name`; what it needs and is not given raises jinja2.UndefinedError."""
    # Nothing of it is shown in a browser.
    pages = Environment(  # noqa: S701
        loader=PackageLoader("flockwire_cli.deploy"), undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True,
    )  # fmt: skip
    return pages.get_template(name)
