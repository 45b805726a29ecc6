"""The environment .venv of a clone has the code as it was when scripts/fly installed it."""

from __future__ import annotations

from pathlib import Path

CHANGED = "flockwire: {file} has changed since it was installed in {prefix}; {script} installs it again"


def changed_source(prefix: Path) -> str:
    """Return a line about a source that is newer than `prefix`, if this is a clone's .venv; empty without one."""
    root = prefix.parent
    if prefix.name != ".venv":
        return ""  # developers know
    try:
        since = (prefix / "flockwire-made").stat().st_mtime
    except OSError:
        return ""  # no environment of a clone
    sources = (file for package in root.glob("*/flockwire*") for file in package.rglob("*.py"))
    changed = next((file for file in sources if file.stat().st_mtime > since), None)
    return CHANGED.format(file=changed, prefix=prefix, script=root / "scripts/fly") if changed else ""
