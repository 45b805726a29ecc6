"""The child that plans a change of formation (planning.py): the only part that imports numpy and scipy."""

from __future__ import annotations

import sys

from flockwire_core import clock
from flockwire_core.domain.order import Mission
from flockwire_core.ground.formation_planning import ChangeRefusedError, plan_in_time
from flockwire_core.wire.codec import decode, encode

from flockwire_operator.station.planning import REFUSED, Request


def main() -> None:
    """Read the request from the standard input; write the order's message to the standard output."""
    request = Request.model_validate_json(sys.stdin.buffer.read())
    running = decode(Mission, bytes.fromhex(request.running))
    try:
        order = plan_in_time(
            request.swarm, running, request.formation, lambda: request.epoch + clock.monotonic(),
            request.leader, request.duration,
        )  # fmt: skip
    except ChangeRefusedError as error:
        print(error, file=sys.stderr)
        raise SystemExit(REFUSED) from None
    sys.stdout.buffer.write(encode(order))


if __name__ == "__main__":
    main()
