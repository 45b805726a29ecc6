"""The operator's end of the wire: receives how everybody is, and publishes orders."""

from __future__ import annotations

from flockwire import clock
from flockwire.flight.fleet import Fleet
from flockwire.runtime.session import Session
from flockwire.swarm.model import uav
from flockwire.wire.keys import MISSION, STOP
from flockwire.wire.messages import Mission, Stop, Telemetry
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR
from flockwire.wire.status import Status


class Operator:
    """Publishes and subscribes as the operator on `session`."""

    def __init__(self, plan: Plan, session: Session) -> None:
        self.statuses: dict[str, Status] = {}
        self.telemetry: dict[int, Telemetry] = {}
        self._plan, self._session = plan, session
        self._drones = {uav(drone): drone for drone in plan.pilots}
        self._inputs = [session.newest(key) for key in plan.subscribes[OPERATOR.kind]]

    def poll(self) -> int:
        """Take in what is newest; returns the present time, Unix ns."""
        now = clock.now()
        for source in self._inputs:
            message, owner = source.message(now), source.inbox.key.owner
            if isinstance(message, Status) and message.identity == owner:  # nobody publishes another's status
                self.statuses[owner] = message
            elif isinstance(message, Telemetry):
                self.telemetry[self._drones[owner]] = message
        return now

    def fleet(self) -> Fleet:
        """Return what is known now."""
        return Fleet(self._plan.pilots, self.statuses, self.telemetry, self.poll())

    def order(self, message: Mission | Stop | None) -> None:
        """Publish an order; None is no order."""
        if message is not None:
            self._session.publish([(STOP if isinstance(message, Stop) else MISSION, message)])
