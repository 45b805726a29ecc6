"""The environment .venv of a clone has the code as it was when scripts/fly installed it."""

from __future__ import annotations

from pathlib import Path

CHANGED = "flockwire: {file} has changed since it was installed in {prefix}; {script} installs it again"


def changed_source(prefix: Path) -> str:
    """Return a line about a source that is newer than the environment `prefix` of its clone; empty without one."""
    made, root = prefix / "flockwire-made", prefix.parent
    try:
        if made.read_text() == "editable\n":
            return ""
        since = made.stat().st_mtime
    except OSError:
        return ""  # no environment of a clone
    sources = (file for package in root.glob("*/flockwire*") for file in package.rglob("*.py"))
    changed = next((file for file in sources if file.stat().st_mtime > since), None)
    return CHANGED.format(file=changed, prefix=prefix, script=root / "scripts/fly") if changed else ""
