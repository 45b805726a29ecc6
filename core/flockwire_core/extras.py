"""Optional packages, and the command that installs them into this environment: flockwire is not on any index."""

from __future__ import annotations

import re
import sys
from importlib.metadata import PackageNotFoundError, requires
from importlib.util import find_spec

MODULES = {"pillow": "pil", "foxglove_sdk": "foxglove"}  # of packages with another name than their module
_REQUIREMENT = re.compile(r"(?P<wanted>(?P<package>[\w.-]+)[^;]*);.*extra == ['\"](?P<extra>[\w-]+)['\"]")


def remedy(extra: str) -> str:
    """Return the command that installs the packages of an extra of flockwire into this environment."""
    installer = f"{sys.executable} -m pip install" if find_spec("pip") else f"uv pip install --python {sys.prefix}"
    wanted = (f"'{line['wanted'].strip()}'" for line in _requirements() if line["extra"] == extra)
    return f"{installer} {' '.join(wanted)}"


def require(module: str, extra: str, what: str) -> None:
    """Raise ModuleNotFoundError without the package `module` of an extra, before `what` is needed."""
    if find_spec(module) is None:
        raise ModuleNotFoundError(f"{what} needs the package {module}: {remedy(extra)}", name=module)


def lacking(error: ModuleNotFoundError) -> str:
    """Return a line with the missing extra of a failed import and its `remedy`; empty if no extra has it."""
    module = (error.name or "").partition(".")[0]
    extra = next((line["extra"] for line in _requirements() if _module(line["package"]) == module.lower()), None)
    return f"this needs the package {module}: {remedy(extra)}" if extra else ""


def _module(package: str) -> str:
    name = package.replace("-", "_").lower()
    return MODULES.get(name, name)


def _requirements() -> list[re.Match[str]]:
    """Return the extra and the requirement of each optional package."""
    try:
        lines = requires("flockwire") or []
    except PackageNotFoundError:
        lines = []
    return [found for line in lines if (found := _REQUIREMENT.match(line))]
