"""A follower's agent without clock, input or output: it observes the leader and flies the formation."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import dist, isfinite
from typing import Any

from flockwire.domain.motion import Estimate, Leading
from flockwire.domain.order import Mission
from flockwire.domain.vector import add
from flockwire.law import Decision, Observation, Reference
from flockwire.loading import make_law
from flockwire.parameters import AgentParameters, agent_parameters
from flockwire.pilot.ladder import shown
from flockwire.pilot.neighbourhood import Neighbourhood
from flockwire.pilot.orders import flown_formation, is_known
from flockwire.pilot.pilot import Pilot
from flockwire.process.cores import Start
from flockwire.swarm.model import uav
from flockwire.wire.codec import Message
from flockwire.wire.keys import MISSION, Key
from flockwire.wire.phase import Phase
from flockwire.wire.status import Report, Status

from flockwire_agent.guarded_law import GuardedLaw


class AgentCore:
    """One follower, which flies by `parameters`; started at `now` (Unix ns)."""

    def __init__(self, parameters: AgentParameters, now: int) -> None:
        self._pilot = pilot = Pilot(parameters.pilot, now)
        name, neighbours = uav(parameters.pilot.number), parameters.neighbours
        self.triggers = frozenset({pilot.pose_key})
        self.prompt = frozenset({MISSION})
        self.period = parameters.pilot.period
        self._frame = parameters.pilot.frame
        self._estimate_key = Key("estimate", name)
        self._rank, self._formations = parameters.rank, parameters.formations
        self._law = GuardedLaw(partial(make_law, parameters.law, parameters.settings), name)
        self._neighbourhood = Neighbourhood(neighbours, parameters.pilot.limits.staleness, parameters.leader_kind)
        self._reference: Reference | None = None  # the place to fly in the formation, None in any other phase
        self._flown: Mission | None = None  # the order that it comes from
        self._judged: tuple[Observation, Decision] | None = None  # what the error is of
        self._take: dict[Key, Callable[[Any], None]] = {  # what to do with a message, by its key
            **{Key("pose", uav(j)): self._neighbourhood.take_pose(j) for j in neighbours},
            **{Key("estimate", uav(j)): self._neighbourhood.take_estimate(j) for j in neighbours},
            **pilot.take,
        }

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take in a message; one of a key that it does not subscribe to is left out."""
        take = self._take.get(key)
        if take is not None:
            take(message)
        elif isinstance(message, Mission):
            self._take_mission(message, now)
        elif isinstance(message, Status):  # the only status that it subscribes to is the leader's
            self._neighbourhood.take_status(message)

    def due(self, key: Key) -> bool:
        """Return True: each own pose calls for a step."""
        return True

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Observe, decide, command: what to publish at `now`."""
        pilot, neighbourhood = self._pilot, self._neighbourhood
        estimates = neighbourhood.update(now)
        missing = () if len(estimates) == len(neighbourhood) else neighbourhood.missing(now)
        silence = neighbourhood.silence(now, pilot.born)
        leader_down = neighbourhood.leading is Leading.IS_DOWN
        fault = self._law.fault.text if self._law.fault is not None else ""
        self._refer(pilot.observe(now, silence, missing, fault, neighbourhood.positions, leader_down))
        observation = Observation(pilot.dt, pilot.stamp, pilot.motion, estimates, pilot.bodies, self._reference)
        decision = self._obey(observation, now)
        messages = pilot.command(decision.velocity, now)
        estimate = decision.estimate
        if estimate is None:
            return messages
        own = Estimate(
            decision.stamp or now, self._frame, estimate,
            neighbourhood.origin, neighbourhood.hops, neighbourhood.leading,
        )  # fmt: skip
        messages.append((self._estimate_key, own))
        return messages

    def retire(self, now: int) -> None:
        """Hold, then land: the process is to end."""
        self._pilot.retire(now)

    def may_end(self, now: int) -> bool:
        """Return whether the drone is down."""
        return self._pilot.may_end(now)

    def report(self, now: int) -> Report:
        """Return how the agent is; what its law raised is a reason with a code."""
        report, fault = self._pilot.report(now, self._error(), shown(self._neighbourhood.oldest(now))), self._law.fault
        if fault is None:
            return report
        detail = "" if report.detail == fault.text else report.detail
        return report._replace(detail=detail, reasons=(*report.reasons, fault))

    def _refer(self, phase: Phase) -> None:
        """Take the place in the formation that was ordered, in the formation phase."""
        mission = self._pilot.flight.mission
        if phase is not Phase.FORMATION or mission is None:
            self._reference = None
        elif self._reference is None or mission is not self._flown:
            self._flown = mission
            self._reference = Reference(flown_formation(self._formations, mission), self._rank, mission.start)

    def _obey(self, observation: Observation, now: int) -> Decision:
        """Return what the law decides; one that raises is not called again before the next order."""
        self._judged = None
        decision = self._law.step(observation, now)
        if decision is None:
            return Decision()
        self._judged = observation, decision
        return decision

    def _error(self) -> float:
        """Return the formation error |x_i − h_i − eta_i| of the last step, m; -1 when there is none."""
        if self._judged is None:
            return -1.0
        observation, decision = self._judged
        if decision.estimate is None or observation.motion is None or observation.reference is None:
            return -1.0
        error = dist(
            observation.motion.position,
            add(observation.reference.offset(observation.stamp), decision.estimate.position),
        )
        return error if isfinite(error) else -1.0

    def _take_mission(self, mission: Mission, now: int) -> None:
        """Take an order of a formation that is known; it restarts a law that failed."""
        if not is_known(self._formations, mission):
            return
        flight = self._pilot.flight
        if not flight.order(mission, now):  # an order is repeated, or another one holds
            return
        if flight.mission is not None:
            self._neighbourhood.leave_out(flight.mission.without)
        self._law.restart()


def make_core(start: Start) -> AgentCore:
    """Return the core of one follower's agent."""
    return AgentCore(agent_parameters(start.plan.swarm, start.drone), start.now)
