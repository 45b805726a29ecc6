"""Optional packages, and the command that installs one, because flockwire is not on any index."""

from __future__ import annotations

import re
import shlex
import sys
from importlib.metadata import PackageNotFoundError, requires
from importlib.util import find_spec
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "scripts/extra"
_REQUIREMENT = re.compile(r"(?P<wanted>(?P<package>[\w.-]+)[^;]*);.*extra == ['\"](?P<extra>[\w-]+)['\"]")


def remedy(extra: str) -> str:
    """Return the command that installs an extra of flockwire into this environment.

    In a clone it is a script; elsewhere (a host's bundle, a container, a compiled environment) an installer with the
    extra's requirements.
    """
    if SCRIPT.exists():
        return f"{_short(SCRIPT)} {extra}"
    installer = f"{sys.executable} -m pip install" if find_spec("pip") else f"uv pip install --python {sys.prefix}"
    wanted = (f"'{line['wanted'].strip()}'" for line in _requirements() if line["extra"] == extra)
    return f"{installer} {' '.join(wanted)}"


def lacking(error: ModuleNotFoundError) -> str:
    """Return a line with the missing extra of a failed import and its `remedy`; empty if no extra has it."""
    module = (error.name or "").partition(".")[0]
    extras = (line["extra"] for line in _requirements() if line["package"].replace("-", "_").lower() == module)
    extra = next(extras, None)
    return f"this needs the package {module}: {remedy(extra)}" if extra else ""


def _short(file: Path) -> str:
    here = Path.cwd()
    return shlex.quote(str(file.relative_to(here) if file.is_relative_to(here) else file))


def _requirements() -> list[re.Match[str]]:
    """Return the extra and the requirement of each optional package."""
    try:
        lines = requires("flockwire") or []
    except PackageNotFoundError:
        lines = []
    return [found for line in lines if (found := _REQUIREMENT.match(line))]
