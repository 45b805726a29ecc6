"""The core of a follower's agent: it knows of others what its law declares, asks the law, and flies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from math import dist, isfinite
from typing import Any

from flockwire_core.domain.law_message import Signals
from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector, add
from flockwire_core.follower_law import follower_law
from flockwire_core.law import Decision, Observation, Place, Sense
from flockwire_core.objects import load_object
from flockwire_core.parameters import pilot_parameters
from flockwire_core.pilot.orders import flown_place, is_known
from flockwire_core.pilot.pilot import Pilot, shown
from flockwire_core.pilot.wanted import LawCommand
from flockwire_core.process.cores import Start
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.information import accelerates, information_of
from flockwire_core.wire.keys import MISSION, Key
from flockwire_core.wire.law_form import law_form
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import CONFLICTS, FILTERED, LAW_STEPS, Report, Status, counted

from flockwire_agent.exchange import Exchange
from flockwire_agent.guarded_law import GuardedLaw

NONE = -1.0  # m: there is no formation error
AUCTIONED = "flockwire_agent.place_auction:AuctionedPlace"  # loaded by name: few swarms have an auction


class AgentCore:
    """The follower of `start`; its stopwatch measures a law of the user's own, and plans are computed aside."""

    def __init__(self, start: Start) -> None:
        swarm, number, now = start.plan.swarm, start.drone, start.now
        parameters, name = pilot_parameters(swarm, number), uav(number)
        self._pilot = pilot = Pilot(parameters, now)
        self.retire, self.may_end = pilot.retire, pilot.may_end
        self.triggers = frozenset({pilot.pose_key})
        self.prompt = frozenset({MISSION})
        self.period = parameters.guard.period
        self._frame, self._signals_key = swarm.frame, Key("signals", name)
        declared = information_of(swarm)
        form, make = law_form(declared), partial(start.law or follower_law, swarm, number)
        stopwatch = start.stopwatch if swarm.control.own_law else None
        self._law = GuardedLaw(make, name, stopwatch, declared, form, start.aside)
        self._exchange = Exchange(swarm, number, declared, form, pilot.born)
        self._site: OrderedPlace
        if swarm.auctioned:
            self._site = load_object(AUCTIONED)(swarm, number, pilot.born)
        else:
            self._site = OrderedPlace(swarm, number)
        pilot.accelerates = accelerates(swarm, number)
        self._command = LawCommand(declared, parameters, pilot.accelerates)
        own = declared.own  # a flag's & takes 1 us
        self._sees_position, self._sees_velocity = bool(own & Sense.POSITION), bool(own & Sense.VELOCITY)
        self._senses, self._is_own_law = bool(declared.around), swarm.control.own_law
        self._judged: tuple[Observation, Decision] | None = None  # of the last step
        self._take: dict[Key, Callable[[Any], None]] = {  # handlers of messages, by key
            **self._exchange.handlers,
            **self._site.handlers,
            **pilot.handlers,
        }

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a message; one of another key than its subscriptions is ignored."""
        take = self._take.get(key)
        if take is not None:
            take(message)
        elif isinstance(message, Mission):
            self._take_mission(message, now)
        elif isinstance(message, Status):  # it subscribes only to the leader's status
            self._exchange.neighbourhood.take_status(message)

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Observe, decide, command: what to publish at `now`."""
        pilot, exchange, site, law = self._pilot, self._exchange, self._site, self._law
        exchange.update(now)
        failure = law.failure.text if law.failure is not None else exchange.contradiction(now)
        positions = exchange.neighbourhood.positions
        phase = pilot.observe(now, exchange.silence, exchange.missing, failure, positions, exchange.leader_down)
        site.update(phase, pilot.flight.mission)
        observation = self._observation(now)
        decided = law.step(observation)  # a law that raises is not called again before the next order
        self._judged = (observation, decided) if decided is not None else None
        decision = decided if decided is not None else Decision()
        wanted = site.command(law.command, phase, pilot)
        in_formation = site.place is not None
        wanted = self._command.velocity(wanted, pilot.sent, pilot.dt, pilot.motion, in_formation, law.is_late)
        messages = pilot.command(wanted, now)
        messages += site.messages(phase, pilot, exchange.estimate(decision), now)
        if decision.signals is not None:
            values = tuple([(signal, float(value)) for signal, value in decision.signals.items()])
            messages.append((self._signals_key, Signals(now, self._frame, values)))
        messages += exchange.messages(decision, law.message, law.failure is not None, now)
        return messages

    def report(self, now: int) -> Report:
        """Return the agent's status; an error of its law, and a neighbour left out, are reasons with a code."""
        pilot, exchange, judged, failure = self._pilot, self._exchange, self._judged, self._law.failure
        place, error = place_and_error(*judged) if judged is not None else (None, NONE)
        report = exchange.reported(pilot.report(now, error, shown(exchange.oldest(now)), place))
        counts = counted(
            (LAW_STEPS, pilot.commanded),
            (FILTERED, pilot.filtered),
            (CONFLICTS, 0 if self._is_own_law else pilot.conflicts),
            ("plans late", self._law.late),
            ("law steps late", self._law.steps_late),
        )
        report = report._replace(counts=(*report.counts, *counts))
        report = self._site.reported(exchange.agreed(report, now))
        if failure is None:
            return report
        detail = "" if report.detail == failure.text else report.detail
        return report._replace(detail=detail, reasons=(*report.reasons, failure))

    def _observation(self, now: int) -> Observation:
        """Return what the law observes."""
        pilot, exchange, place, motion = self._pilot, self._exchange, self._site.place, self._pilot.motion
        sees_position, sees_velocity = self._sees_position, self._sees_velocity
        return Observation(
            (now - place.start) / SECOND if place is not None else 0.0,
            pilot.dt,
            pilot.stamp,
            motion.position if motion is not None and sees_position else None,
            motion.velocity if motion is not None and sees_velocity else None,
            exchange.neighbours,
            exchange.around,
            pilot.bodies if self._senses else (),
            exchange.heard,
            exchange.news,
            place,
            self._law.plan(now),
            now,
            motion if sees_position and sees_velocity else None,
        )

    def _take_mission(self, mission: Mission, now: int) -> None:
        """Receive an order of a known formation; it restarts a failed law."""
        if not is_known(self._site.formations, mission):
            return
        flight = self._pilot.flight
        if not flight.order(mission, now):  # a repeated order, or another one is in force
            return
        if flight.mission is not None:
            self._exchange.leave_out(flight.mission.without)
            self._site.order(flight.mission, now)
        self._law.restart()


def place_and_error(observation: Observation, decision: Decision) -> tuple[Vector | None, float]:
    """Return the place h_i + eta_i, m, and the law's own error, else |x_i − h_i − eta_i|, m; None and NONE without."""
    place, leader, motion, goal = observation.place, decision.message, observation.motion, None
    if isinstance(leader, LeaderMotion) and motion is not None and place is not None:
        found = add(place.offset((observation.stamp - place.start) / SECOND), leader.position)
        goal = found if all(map(isfinite, found)) else None
    if decision.error is not None and place is not None:
        return goal, float(decision.error)
    return goal, dist(motion.position, goal) if motion is not None and goal is not None else NONE


class OrderedPlace:
    """The place of follower `number` of `swarm`, by the order; `place` is that to fly in, None outside a formation."""

    def __init__(self, swarm: Swarm, number: int) -> None:
        self.place: Place | None = None
        self.formations = {name: swarm.build_formation(name) for name in swarm.formation_names}
        self.handlers: dict[Key, Callable[[Any], None]] = {}
        self._rank = swarm.followers.index(number)
        ranks = {j: rank for rank, j in enumerate(swarm.followers)}
        self._known: Mapping[int, int] = {j: ranks[j] for j in swarm.topology.neighbours(number) if j in ranks}
        self._held: int | None = None  # in place of the order's
        self._flown: Mission | None = None  # the order of the place

    def order(self, mission: Mission, now: int) -> None:
        """Receive the order in force, at `now` (Unix ns)."""

    def update(self, phase: Phase, mission: Mission | None) -> None:
        """Set the place, in the formation phase."""
        if phase is not Phase.FORMATION or mission is None:
            self.place = None
        elif self.place is None or mission is not self._flown:
            self._flown = mission
            formation, rank = flown_place(self.formations, mission, self._rank, self._held)
            self.place = Place(formation, rank, mission.start, self._known)

    def command(self, wanted: Vector, phase: Phase, pilot: Pilot) -> Vector:
        """Return the law's command, or what takes its place."""
        return wanted

    def messages(self, phase: Phase, pilot: Pilot, leader: LeaderMotion | None, now: int) -> list[tuple[Key, Message]]:
        """Return what to publish at `now` (Unix ns), by the estimate of the `leader`."""
        return []

    def reported(self, report: Report) -> Report:
        """Return `report` with what it adds."""
        return report
