"""Puts the compiled code of .venv before its sources, while none of them is newer.

`scripts/compile --venv` copies this file into .venv, with a .pth file that imports it whenever Python starts there.
"""

import sys
from pathlib import Path

COMPILED = Path(sys.prefix, "compiled")
STAMP = COMPILED / "sources"  # the folders of the sources, one in a line; as old as they were when they were compiled


def is_fresh() -> bool:
    """Return whether there is compiled code, and no source is newer."""
    try:
        made, root = STAMP.stat().st_mtime, Path(sys.prefix).parent
        folders = [root / line for line in STAMP.read_text().splitlines()]
        return all(file.stat().st_mtime <= made for folder in folders for file in folder.rglob("*.py"))
    except OSError:
        return False


if __name__ == "__main__":
    raise SystemExit(not is_fresh())
if is_fresh():
    sys.path.insert(1, str(COMPILED))
