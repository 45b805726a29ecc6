"""The operator's end of the wire: receives how everybody is, and publishes orders."""

from __future__ import annotations

from flockwire import clock
from flockwire.flight.fleet import Fleet
from flockwire.runtime.session import Session
from flockwire.runtime.swarm_clock import SwarmClock
from flockwire.swarm.model import uav
from flockwire.wire.keys import MISSION, STOP, TIME_REPLY
from flockwire.wire.messages import Mission, Stop, Telemetry
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR
from flockwire.wire.status import Status


class Operator:
    """Publishes and subscribes as `identity`, the operator or one with the same rights, on `session`."""

    def __init__(self, plan: Plan, session: Session, identity: str = OPERATOR.kind) -> None:
        self.statuses: dict[str, Status] = {}
        self.telemetry: dict[int, Telemetry] = {}
        self._plan, self._session = plan, session
        self._clock = SwarmClock(plan, identity, session)
        self._drones = {uav(drone): drone for drone in plan.pilots}
        self._inputs = [session.newest(key) for key in plan.subscribes[identity] if key.kind != TIME_REPLY]

    def poll(self) -> int:
        """Take in what is newest; returns the present time, Unix ns."""
        self._clock.step()
        now = clock.now()
        for source in self._inputs:
            message, owner = source.message(now), source.inbox.key.owner
            if isinstance(message, Status) and message.identity == owner:  # nobody publishes another's status
                self.statuses[owner] = message
            elif isinstance(message, Telemetry):
                self.telemetry[self._drones[owner]] = message
        return now

    def knows_time(self) -> bool:
        """Return whether the swarm's time is known here, by which orders are stamped; a stop needs none."""
        return self._clock.known()

    def fleet(self) -> Fleet:
        """Return what is known now of those who fly; who is left out of the flight, and silent, does not count."""
        now = self.poll()
        fleet = Fleet(self._plan.pilots, self.statuses, self.telemetry, now)
        running = fleet.mission()
        silent = [drone for drone in (running.without if running is not None else ()) if drone not in fleet.fresh]
        if not silent:
            return fleet
        pilots = {drone: pilot for drone, pilot in self._plan.pilots.items() if drone not in silent}
        return Fleet(pilots, self.statuses, self.telemetry, now)

    def order(self, message: Mission | Stop | None) -> None:
        """Publish an order; None is no order."""
        if message is not None:
            self._session.publish([(STOP if isinstance(message, Stop) else MISSION, message)])
