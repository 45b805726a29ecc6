"""Where the `flockwire` command begins: an order in flight does not wait for what only other commands need."""

from __future__ import annotations

import sys
from typing import NoReturn

URGENT = ("stop", "land", "hold")


def main() -> NoReturn:
    """Run the command line."""
    if sys.argv[1:] and sys.argv[1] in URGENT:
        from flockwire_cli.orders import app  # noqa: PLC0415
    else:
        from flockwire_cli.main import app  # noqa: PLC0415
    app(prog_name="flockwire")
    raise SystemExit(0)
