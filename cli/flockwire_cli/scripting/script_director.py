"""The director of a flight by script: it begins when it is told to, and remembers what it knew last."""

from __future__ import annotations

from collections.abc import Mapping

from flockwire.flight.director import Director, Stage
from flockwire.flight.fleet import Fleet
from flockwire.flight.phases import Phase
from flockwire.flight.preflight import Preflight
from flockwire.wire.messages import Mission, Telemetry
from flockwire.wire.plan import Plan
from flockwire.wire.status import Status


class ScriptDirector(Director):
    """Conducts the flight of a plan's drones, from `begin` to the script's order to land."""

    def __init__(self, plan: Plan, now: int) -> None:
        swarm = plan.swarm
        super().__init__(plan.pilots, swarm.frame, 0.0, now, preflight=Preflight.of(swarm))
        self.plan, self.begun = plan, False
        self.statuses: Mapping[str, Status] = {}
        self.telemetry: Mapping[int, Telemetry] = {}
        self.now = now

    def step(self, statuses: Mapping[str, Status], telemetry: Mapping[int, Telemetry], now: int) -> Mission | None:
        """Return the order that is due, as Director does; none before the script began."""
        self.statuses, self.telemetry, self.now = statuses, telemetry, now
        return super().step(statuses, telemetry, now) if self.begun and self.stage is not Stage.OVER else None

    def begin(self, formation: str, now: int) -> None:
        """Take off, then fly `formation`."""
        self.begun, self.stage, self._formation, self._since = True, Stage.PREPARING, formation, now
        self._started = None

    @property
    def fleet(self) -> Fleet:
        """What was known at the last step."""
        return Fleet(self.plan.pilots, self.statuses, self.telemetry, self.now)

    def confirmed(self) -> bool:
        """Return whether every pilot obeys the newest order."""
        return self._order is not None and not self.fleet.unconfirmed(self._order)

    def flying(self) -> bool:
        """Return whether every drone is in formation."""
        return self.stage is Stage.FLYING and self.fleet.all_in(Phase.FORMATION)
