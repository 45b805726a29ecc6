"""Files in the current folder that are called as modules of Python are: no process of flockwire imports them."""

from pathlib import Path

NAMES = ("random", "statistics", "queue", "types", "signal", "socket", "flockwire")


def lay_shadows(folder: Path) -> None:
    """Put them into `folder`."""
    for name in NAMES:
        (folder / f"{name}.py").write_text("raise SystemExit('code of the current folder')\n")
