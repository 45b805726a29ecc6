"""The core of a follower's agent: it observes the leader and flies the formation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from math import dist, inf, isfinite
from typing import TYPE_CHECKING, Any

from flockwire_core.control.airframe.acceleration import AccelerationInput
from flockwire_core.domain.motion import Estimate, LeaderMotion, Leading
from flockwire_core.domain.order import Mission
from flockwire_core.domain.signals import Signals
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add
from flockwire_core.law import STATE, Decision, Heard, Observation, Output, Place, Sense
from flockwire_core.objects import load_object
from flockwire_core.parameters import auction_parameters, law_settings, pilot_parameters
from flockwire_core.pilot.law_messages import Hearing, LawSender
from flockwire_core.pilot.leadership import Leadership
from flockwire_core.pilot.neighbourhood import Neighbourhood
from flockwire_core.pilot.orders import flown_place, is_known
from flockwire_core.pilot.pilot import Pilot, shown
from flockwire_core.pilot.place import Place as WaitingPlace
from flockwire_core.pilot.place import keep_place
from flockwire_core.pilot.sight import Sight
from flockwire_core.process.cores import Aside, Core, Done, Start
from flockwire_core.process.stopwatch import Stopwatch
from flockwire_core.swarm.laws import law_object
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.information import information_of, relays, sees, speakers
from flockwire_core.wire.keys import MISSION, Key
from flockwire_core.wire.law_form import law_form
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import FILTERED, LAW_STEPS, Report, Status, counted

from flockwire_agent.guarded_law import GuardedLaw

if TYPE_CHECKING:
    from flockwire_agent.place_auction import PlaceAuction


class AgentCore:
    """Follower `number` of `swarm`; started at `now` (Unix ns). The `stopwatch` measures its law, `aside` plans."""

    def __init__(
        self, swarm: Swarm, number: int, now: int, stopwatch: Stopwatch | None = None, aside: Aside = Done
    ) -> None:
        parameters, name = pilot_parameters(swarm, number), uav(number)
        self._pilot = pilot = Pilot(parameters, now)
        self.triggers = frozenset({pilot.pose_key})
        self.prompt = frozenset({MISSION})
        self.period = parameters.period
        self._frame = swarm.frame
        self._estimate_key, self._bids_key = Key("estimate", name), Key("bids", name)
        self._signals_key, self._law_key = Key("signals", name), Key("law", name)
        self._rank = swarm.followers.index(number)
        ranks = {j: rank for rank, j in enumerate(swarm.followers)}
        self._neighbour_ranks = {j: ranks[j] for j in swarm.topology.neighbours(number) if j in ranks}
        self._formations = {name: swarm.build_formation(name) for name in swarm.formation_names}
        neighbours, depths, filtered = (
            swarm.topology.neighbours(number),
            swarm.topology.depths(),
            swarm.control.filtered,
        )
        self._declared = declared = information_of(swarm)
        own, form, leaders = declared.own, law_form(declared), frozenset(swarm.leaders)
        make = partial(load_object(law_object(swarm)), law_settings(swarm, number))
        self._law = GuardedLaw(make, name, stopwatch, declared, form, aside)
        self._relays, self._whole = relays(swarm), own & STATE == STATE
        seen = neighbours if declared.neighbours else {}
        self._sight = Sight(seen, leaders, declared.silence) if sees(swarm) else None
        self._hearing = self._sender = None
        if form is not None:
            heard = {j: weight for j, weight in neighbours.items() if j in speakers(swarm)}
            self._hearing = Hearing(heard, leaders, form, declared.pace, declared.silence)
            self._sender = LawSender(form, declared.pace, self._frame, now)
        self._neighbourhood = Neighbourhood(
            neighbours,
            swarm.limits.staleness,
            swarm.reference.kind,
            swarm.limits.disagreement if filtered else inf,
            frozenset(j for j in neighbours if filtered and depths.get(j, 0) < depths.get(number, 0)),
            parameters.limits.speed,
            swarm.sole_leader,
        )
        accelerates = declared.output is Output.ACCELERATION
        self._accelerations = AccelerationInput(parameters.lag, parameters.period) if accelerates else None
        self._height: float | None = None  # m, that the pilot holds
        self._rise, pilot.counts_filtered = parameters.limits.vertical_speed, swarm.control.own_law
        self._reference: Place | None = None  # the place to fly in the formation, None in any other phase
        self._flown: Mission | None = None  # its order
        self._held: int | None = None  # the place that it holds by an auction, of that order
        self._auction: PlaceAuction | None = None
        if swarm.auctioned:
            from flockwire_agent.place_auction import PlaceAuction  # noqa: PLC0415  (few swarms have an auction)

            self._auction = PlaceAuction(auction_parameters(swarm), number, self._frame, pilot.born)
            self._waiting = WaitingPlace(parameters)  # where it waits for a place
        self._judged: tuple[Observation, Decision] | None = None  # the formation of the error
        self._leadership = Leadership(swarm)
        self._awaits_signs = bool(self._leadership.handlers)
        self._take: dict[Key, Callable[[Any], None]] = {  # handlers of messages, by key
            **{Key("pose", uav(j)): self._neighbourhood.take_pose(j) for j in neighbours},
            **{Key("estimate", uav(j)): self._neighbourhood.take_estimate(j) for j in neighbours},
            **({Key("law", uav(j)): self._hearing.take(j) for j in self._hearing.speakers} if self._hearing else {}),
            **({Key("seen", name): self._sight.take} if self._sight else {}),
            **(
                {Key("bids", uav(j)): self._auction.take for j in neighbours if j not in swarm.leaders}
                if self._auction
                else {}
            ),
            **self._leadership.handlers,
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
            self._neighbourhood.take_status(message)

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Observe, decide, command: what to publish at `now`."""
        pilot, neighbourhood = self._pilot, self._neighbourhood
        estimates = neighbourhood.update(now) if self._relays else []
        silence, missing = self._update(now)
        leader_down = neighbourhood.leading is Leading.IS_DOWN
        if self._awaits_signs and self._leadership.is_down(now):
            leader_down = True
        failure = self._law.failure.text if self._law.failure is not None else ""
        if not failure and neighbourhood.agreement.contradicted:
            failure = neighbourhood.agreement.reason(now)
        phase = pilot.observe(now, silence, missing, failure, neighbourhood.positions, leader_down)
        if self._auction is None:
            self._refer(phase)
        else:
            self._refer_by(self._auction, phase)
        decision = self._obey(self._observation(estimates, now))
        estimate, wanted = decision.message if self._relays else None, self._law.command
        if self._auction is not None and phase is Phase.FORMATION and self._reference is None:
            wanted = self._wait()
        messages = pilot.command(self._flyable(wanted), now)
        if self._auction is not None:
            bids = self._auction.step(phase, pilot.motion, estimate, now)
            if bids is not None:
                messages.append((self._bids_key, bids))
        if decision.signals is not None:
            values = tuple([(signal, float(value)) for signal, value in decision.signals.items()])
            messages.append((self._signals_key, Signals(now, self._frame, values)))
        if self._sender is not None and self._law.failure is None:  # a failed law gives no sign of life
            sent = self._sender.send(self._law.message, now, decision.stamp)
            if sent is not None:
                messages.append((self._law_key, sent))
        if estimate is None:
            return messages
        origin, hops, leading = neighbourhood.origin, neighbourhood.hops, neighbourhood.leading
        own = Estimate(decision.stamp or now, self._frame, estimate, origin, hops, leading)
        messages.append((self._estimate_key, own))
        return messages

    def retire(self, now: int) -> None:
        """Hold, then land, because the process must end."""
        self._pilot.retire(now)

    def may_end(self, now: int) -> bool:
        """Return whether the drone is down."""
        return self._pilot.may_end(now)

    def report(self, now: int) -> Report:
        """Return the agent's status; an error of its law, and a neighbour left out, are reasons with a code."""
        place, failure = self._place(), self._law.failure
        oldest = self._neighbourhood.oldest(now) if self._relays else 0.0
        for part in (self._sight, self._hearing):
            oldest = max(oldest, part.oldest(now)) if part is not None else oldest
        report = self._pilot.report(now, self._error(place), shown(oldest), place)
        if self._hearing is not None:
            speakers = self._hearing.speakers.values()
            counts = counted(
                ("law messages lost", sum([one.lost for one in speakers])),
                ("law messages rejected", sum([one.rejected for one in speakers])),
            )
            report = report._replace(counts=(*report.counts, *counts))
        if self._pilot.counts_filtered:
            counts = counted(
                (LAW_STEPS, self._pilot.commanded),
                (FILTERED, self._pilot.filtered),
                ("plans late", self._law.late),
            )
            report = report._replace(counts=(*report.counts, *counts))
        agreement = self._neighbourhood.agreement
        if agreement.count:
            counts = (*report.counts, ("estimates left out", agreement.count))
            report = report._replace(reasons=(*report.reasons, *agreement.reasons(now)), counts=counts)
        if self._auction is not None:
            report = self._auction.reported(report)
        if failure is None:
            return report
        detail = "" if report.detail == failure.text else report.detail
        return report._replace(detail=detail, reasons=(*report.reasons, failure))

    def _refer(self, phase: Phase) -> None:
        """Set the place in the ordered formation, in the formation phase."""
        mission = self._pilot.flight.mission
        if phase is not Phase.FORMATION or mission is None:
            self._reference = None
        elif self._reference is None or mission is not self._flown:
            self._flown = mission
            formation, index = flown_place(self._formations, mission, self._rank, self._held)
            auctioned = self._auction is not None and self._auction.ordered
            ranks = {} if auctioned else self._neighbour_ranks  # nobody knows the others' places by an auction
            self._reference = Place(formation, index, mission.start, ranks)

    def _refer_by(self, auction: PlaceAuction, phase: Phase) -> None:
        """Set the place as `_refer` does: that which it holds in a formation with an auction; without one, none."""
        if auction.place != self._held:
            self._held, self._flown = auction.place, None
        self._refer(phase)
        if auction.ordered and self._held is None:
            self._reference = None
        if phase is not Phase.FORMATION or self._reference is not None:
            self._waiting.forget()

    def _observation(self, heard: Sequence[Heard], now: int) -> Observation:
        """Return what the law observes."""
        pilot, place, motion, declared = self._pilot, self._reference, self._pilot.motion, self._declared
        sight, hearing = self._sight, self._hearing
        t = (now - place.start) / SECOND if place is not None else 0.0
        return Observation(
            t,
            pilot.dt,
            pilot.stamp,
            motion.position if motion is not None and declared.own & Sense.POSITION else None,
            motion.velocity if motion is not None and declared.own & Sense.VELOCITY else None,
            sight.neighbours if sight is not None else (),
            sight.around if sight is not None else (),
            pilot.bodies if declared.around else (),
            hearing.heard if hearing is not None else heard,
            hearing.news if hearing is not None else (),
            place,
            self._law.plan(now),
            now,
            motion if self._whole else None,
        )

    def _flyable(self, wanted: Vector) -> Vector:
        """Return the law's command as a velocity, m/s; the pilot holds the height if the law cannot, or need not."""
        pilot, motion, declared = self._pilot, self._pilot.motion, self._declared
        if self._accelerations is not None:
            self._accelerations.follow(pilot.sent, pilot.dt)
            wanted = self._accelerations.velocity(wanted)
        if (declared.own & Sense.POSITION and not declared.planar) or motion is None:
            return wanted
        if self._reference is None or self._height is None:
            self._height = motion.position[2]
        above = (wanted[0], wanted[1], self._height)
        rise = keep_place((wanted[0], wanted[1], motion.position[2]), above, self._rise)[2]
        return (wanted[0], wanted[1], rise)

    def _update(self, now: int) -> tuple[float, tuple[int, ...]]:
        """Update what it sees and hears; return the s for which nobody was, and whom it misses."""
        silence, missing, born = 0.0, list[int](), self._pilot.born
        for part in (self._sight, self._hearing):
            if part is not None:
                part.update(now)
                silence, missing = max(silence, part.silence(now, born)), [*missing, *part.missing]
        if self._relays:
            silence = max(silence, self._neighbourhood.silence(now, born))
            missing += self._neighbourhood.missing
        return silence, tuple(dict.fromkeys(missing)) if missing else ()

    def _wait(self) -> Vector:
        """Return the velocity, m/s, that keeps the drone where it began to wait for a place."""
        pilot = self._pilot
        if pilot.motion is None:
            return ZERO
        return self._waiting.velocity(Phase.HOLD, pilot.motion.position, pilot.bodies)

    def _obey(self, observation: Observation) -> Decision:
        """Return the law's decision; a law that raises is not called again before the next order."""
        self._judged = None
        decision = self._law.step(observation)
        if decision is None:
            return Decision()
        self._judged = observation, decision
        return decision

    def _place(self) -> Vector | None:
        """Return the place h_i + eta_i of the last step, m; None when there is none."""
        if self._judged is None:
            return None
        observation, decision = self._judged
        place, leader = observation.place, decision.message
        if not isinstance(leader, LeaderMotion) or observation.motion is None or place is None:
            return None
        offset = place.offset((observation.stamp - place.start) / SECOND)
        goal = add(offset, leader.position)
        return goal if all(map(isfinite, goal)) else None

    def _error(self, place: Vector | None) -> float:
        """Return the formation error |x_i − h_i − eta_i| of the last step, m; -1 when there is none."""
        if self._judged is not None and self._judged[1].error is not None and self._judged[0].place is not None:
            return float(self._judged[1].error)
        motion = self._judged[0].motion if self._judged is not None else None
        return dist(motion.position, place) if motion is not None and place is not None else -1.0

    def _take_mission(self, mission: Mission, now: int) -> None:
        """Receive an order of a known formation; it restarts a failed law."""
        if not is_known(self._formations, mission):
            return
        flight = self._pilot.flight
        if not flight.order(mission, now):  # a repeated order, or another one is in force
            return
        if flight.mission is not None:
            for part in (self._neighbourhood, self._sight, self._hearing):
                if part is not None:
                    part.leave_out(flight.mission.without)
            if self._auction is not None:
                self._auction.order(flight.mission, now)
        self._law.restart()


def make_core(start: Start) -> Core:
    """Return the core of one follower's agent."""
    swarm = start.plan.swarm
    stopwatch = start.stopwatch if swarm.control.own_law else None
    return AgentCore(swarm, start.drone, start.now, stopwatch, start.aside)
