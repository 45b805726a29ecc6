"""Liveness: faults end, and then the drones must be in formation again in time, by themselves or after one start.

Nobody conducts such a flight: an operator orders its start, one more start if somebody came down or the formation does
not come back by itself, and the landing.
"""

from __future__ import annotations

from flockwire_core.domain.order import Order
from flockwire_core.domain.time import nanoseconds
from flockwire_core.wire.phase import Phase

from flockwire_lab.faults.injection import RESTART_TIME
from flockwire_lab.faults.kinds import Fault
from flockwire_lab.search.formation import errors
from flockwire_lab.search.record import Recorder
from flockwire_lab.world import EPOCH, World

EVERY = 0.25  # s between two looks
ON_GROUND = (Phase.GROUNDED, Phase.READY)


class Recovery:
    """Conducts one flight of `world` under `faults`."""

    def __init__(self, world: World, recorder: Recorder, faults: tuple[Fault, ...]) -> None:
        self._took: float | None = None  # s, until the formation stood, or was given up
        self._world, self._recorder, self._swarm = world, recorder, world.swarm
        self._healed = max((fault.at + getattr(fault, "duration", RESTART_TIME) for fault in faults), default=0.0)
        self._bound = self._swarm.checks.settle_within
        self._since: float | None = None  # when the formation has been owed since, s after the order to take off
        self._started_again = False
        self._kept = 0

    def begin(self) -> None:
        """Order the start, and look from then on."""
        first_start = 2.0  # s after the processes are started
        self._world.conduct(None)
        self._world.scheduler.at(EPOCH + nanoseconds(first_start), lambda _: self._order("start"))
        self._world.scheduler.at(EPOCH + nanoseconds(first_start + EVERY), self._look)

    def formed(self, seconds: float) -> tuple[float, float]:
        """Return how long a flight of `seconds` took until it was in formation again, s, and the bound.

        One that never was, not even in the air, took all its time.
        """
        return (seconds if self._took is None else self._took, self._bound)

    def _look(self, _: object) -> None:
        now = self._recorder.seconds(self._world.scheduler.now)
        if self._took is not None:
            if self._recorder.all_down():
                self._world.scheduler.stop()
                return
        elif self._recorder.took_off is not None and now >= self._healed:
            self._judge(now)
        self._world.scheduler.at(self._world.scheduler.now + nanoseconds(EVERY), self._look)

    def _judge(self, now: float) -> None:
        """Wait for the formation, once with another start; then land."""
        kept = 4  # looks at which all are at their places
        if self._since is None:
            self._since = now
        self._kept = self._kept + 1 if self._stands() else 0
        took = now - self._since
        if self._kept >= kept or (took > self._bound and self._started_again):
            self._took = took
            self._recorder.tell(f"formation after {took:.2f} s")
            self._order("land")
        elif not self._started_again and (took > self._bound or self._rest_on_ground()):
            self._started_again, self._since = True, now
            self._order("start")

    def _order(self, verb: str) -> None:
        self._world.station().ask(Order(verb))

    def _rest_on_ground(self) -> bool:
        """Return whether somebody is on the ground, and nobody on the way up or down."""
        phases = self._recorder.phases().values()
        moving = (Phase.TAKEOFF, Phase.LANDING)
        return any(phase in ON_GROUND for phase in phases) and not any(phase in moving for phase in phases)

    def _stands(self) -> bool:
        if not self._recorder.starts or any(phase != Phase.FORMATION for phase in self._recorder.phases().values()):
            return False
        now = self._world.scheduler.now
        off = errors(self._recorder, self._swarm, self._recorder.starts[-1][1], now, now).values()
        return max([error.values[-1] for error in off], default=0.0) < self._swarm.checks.formation_tail
