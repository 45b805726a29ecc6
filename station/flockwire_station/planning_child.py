"""The child that plans a change of formation (planning.py): the only part that imports numpy and scipy."""

from __future__ import annotations

import pickle
import sys

from flockwire import clock
from flockwire.domain.order import Mission
from flockwire.ground.formation_planning import ChangeRefusedError, plan_in_time


def main() -> None:
    """Read the request from the standard input; write the order, or the refusal, to the standard output."""
    epoch, swarm, running, name, leader, duration = pickle.load(sys.stdin.buffer)  # noqa: S301  (of the own parent)
    answer: Mission | str
    try:
        answer = plan_in_time(swarm, running, name, lambda: epoch + clock.monotonic(), leader, duration)
    except ChangeRefusedError as error:
        answer = str(error)
    sys.stdout.buffer.write(pickle.dumps(answer))


if __name__ == "__main__":
    main()
