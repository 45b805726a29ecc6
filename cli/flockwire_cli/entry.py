"""Where the `flockwire` command begins: who is urgent does not wait for what only other commands need.

Urgent are orders in flight, and the processes of a swarm: one that is started again is missing until it is there.
"""

from __future__ import annotations

import sys
from typing import NoReturn

from flockwire.wire.processes import PROCESSES

ORDERS = ("stop", "land", "hold")


def main() -> NoReturn:
    """Run the command line."""
    command = next(iter(sys.argv[1:]), "")
    if command in ORDERS:
        from flockwire_cli.orders import app  # noqa: PLC0415
    elif any(row.started and row.kind == command for row in PROCESSES):
        from flockwire_cli.kinds import app  # noqa: PLC0415
    else:
        from flockwire_cli.main import app  # noqa: PLC0415
    app(prog_name="flockwire")
    raise SystemExit(0)
