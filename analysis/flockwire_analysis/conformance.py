"""Whether pilots did what the protocol allows: each change of phase and of order, replayed through the same rules.

Each status shows a pilot just after a step. Between two statuses there are others, under conditions of which the trace
shows only a part. A change is allowed where some conditions that agree with the trace lead to it: for phases by the
table pilot/transitions.csv, for orders by the numbers of the gateway's log.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import reduce
from itertools import pairwise, product
from operator import or_
from typing import NamedTuple

import numpy as np
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.order import Mission, Version
from flockwire_core.domain.time import SECOND
from flockwire_core.pilot.orders import rank
from flockwire_core.pilot.phases import IN_FLIGHT, ORDERED, bits, reachable
from flockwire_core.swarm.model import uav
from flockwire_core.wire.phase import PILOT_PHASES, Phase

from flockwire_analysis.observed import Observed, version_of
from flockwire_analysis.phases import at
from flockwire_analysis.recorded import Trace

TOLERANCE = SECOND // 1000  # ns by which an age in a status may be rounded
AIRBORNE = (FlightState.FLYING, FlightState.LANDING)


class Life(NamedTuple):
    """What one process of a pilot reported; it began after `after` and not later than `before`, Unix ns."""

    history: tuple[Observed, ...]
    after: int
    before: int


def deviations(trace: Trace) -> tuple[str, ...]:
    """Return a sentence for each change of a phase or an order that the protocol forbids."""
    return tuple(
        sentence
        for number in trace.plan.pilots
        for life in lives(trace.histories.get(trace.plan.pilots[number], ()))
        for sentence in _Replay(trace, number, life).deviations()
    )


def lives(history: Iterable[Observed]) -> Iterator[Life]:
    """Yield what each process of one pilot reported, in turn."""
    own: list[Observed] = []
    after = 0
    for one in history:
        if one.phase not in PILOT_PHASES:  # it waits for swarm time
            continue
        if own and one.restarted_since(own[-1]):
            yield Life(tuple(own), after, own[0].stamp)
            after, own = own[-1].stamp, []
        own.append(one)
    if own:
        yield Life(tuple(own), after, own[0].stamp)


class _Replay:
    """Replays one life of the pilot of drone `number`."""

    def __init__(self, trace: Trace, number: int, life: Life) -> None:
        self._trace, self._number, self._life = trace, number, life
        telemetry = trace.of("telemetry", number)
        self._stamps, self._flew = telemetry.stamps, np.isin(telemetry.values[:, 0], AIRBORNE)
        self._landed = (0, 0)  # after when and by when it came down last without an order to land, Unix ns
        self._set_back = False  # its clock: from then on, stamps of others are none of its own

    def deviations(self) -> Iterator[str]:
        past: set[Version] = set()  # of the log: of these none holds again
        for before, after in pairwise(self._life.history):
            back = after.stamp < before.stamp or after.telemetry < before.telemetry - TOLERANCE
            self._set_back = self._set_back or back
            orders = self._orders(before, after)
            where = f"{uav(self._number)} at {at(self._trace, after.stamp)}"
            if after.phase not in self._phases(before, after, orders):
                yield f"{where}: {after.phase} after {before.phase} ({_verb(before)}, {_verb(after)})"
            if before.phase in IN_FLIGHT and after.phase not in IN_FLIGHT and _verb(after) != "land":
                self._landed = before.stamp, after.stamp
            if version_of(before.mission) == version_of(after.mission):
                continue
            if before.mission is not None and before.mission.number:
                past.add(before.mission.version)
            if version_of(after.mission) in past or not _may_follow(before, after, orders):
                yield f"{where}: {_verb(after)} holds after {_verb(before)}"

    def _phases(self, before: Observed, after: Observed, orders: tuple[Mission | None, ...]) -> frozenset[Phase]:
        """Return the phases in which the pilot may be by `after`."""
        found = frozenset({Phase(before.phase)})
        possible = self._conditions(before, after, orders)
        for _ in PILOT_PHASES:
            found |= reachable(found, possible)
        return reachable(found, self._last_conditions(before, after))

    def _conditions(self, before: Observed, after: Observed, orders: tuple[Mission | None, ...]) -> frozenset[int]:
        """Return the conditions under which a step between two statuses may have been made."""
        return _combined(
            [one for order in orders for one in self._by_order(order, before, after)],
            _either("airborne", *self._airborne(before.telemetry, after.telemetry)),
            *(_either(name, False, True) for name in ("unready", "disturbed")),
            *self._rest(before, after),
        )

    def _last_conditions(self, before: Observed, after: Observed) -> frozenset[int]:
        """Return the conditions under which the step that the later status shows may have been made.

        A pilot on the ground that is not ready gives its reason, and so does one that holds against an order.
        """
        order, early = after.mission, after.mission is not None and after.mission.start > after.stamp
        holds = after.phase == Phase.HOLD and order is not None and order.in_formation and not early
        ready = {Phase.GROUNDED: (after.reasoned,), Phase.READY: (False,)}
        return _combined(
            self._by_order(order, before, after),
            _either("airborne", *self._airborne(after.telemetry, after.telemetry)),
            _either("unready", *ready.get(Phase(after.phase), (False, True))),
            _either("disturbed", *((after.reasoned or early,) if holds or early else (False, True))),
            *self._rest(before, after),
        )

    def _rest(self, before: Observed, after: Observed) -> Iterator[tuple[int, ...]]:
        """Yield the conditions that any step between two statuses may have had.

        Nobody takes off and is high at once; a pilot that lands without an order gives a reason.
        """
        shortest_climb = 3 * SECOND // 10  # ns: no drone takes off to its height sooner
        high = before.phase == Phase.TAKEOFF or after.stamp - before.stamp > shortest_climb
        landed = after.phase == Phase.LANDING != before.phase and not after.reasoned
        yield _either("high", *((False, True) if high else (False,)))
        yield _either("stop", *((False, True) if self._trace.stops else (False,)))
        yield _either("danger", *((False,) if landed else (False, True)))

    def _by_order(self, order: Mission | None, before: Observed, after: Observed) -> list[int]:
        """Return the conditions that `order` may make hold."""
        fixed = ORDERED.get(order.verb, 0) if order is not None else 0
        return [fixed | outdated for outdated in _either("outdated", *self._outdated(order, before, after))]

    def _outdated(self, order: Mission | None, before: Observed, after: Observed) -> tuple[bool, ...]:
        """Return whether `order` may be from before the process, or the drone have come down since."""
        if order is None or order.stamp <= self._life.after:
            return (True,)
        flew, stood = self._landed
        if order.stamp <= flew:
            return (True,)
        landed = before.phase in IN_FLIGHT and after.phase not in IN_FLIGHT
        return (False, True) if landed or order.stamp <= max(stood, self._life.before) else (False,)

    def _airborne(self, first: int, last: int) -> tuple[bool, ...]:
        """Return whether the drone may have flown, by the telemetry from `first` to `last` (Unix ns, 0: none)."""
        if not last:
            return (False,)
        if self._set_back:
            return (False, True)
        stamps = self._stamps
        if not len(stamps) or stamps[0] > first + TOLERANCE:  # the recording of it began later
            return (False, True)
        known = (stamps >= first - TOLERANCE) & (stamps <= last + TOLERANCE)
        found = {*self._flew[known].tolist(), *(() if first else (False,))}
        return tuple(found) if known.any() else (False, True)

    def _orders(self, before: Observed, after: Observed) -> tuple[Mission | None, ...]:
        """Return the orders that may have held between two statuses: the pilot may take several in."""
        unseen = 10 * SECOND  # ns before a status from which on an order may have been given that no status shows
        if version_of(before.mission) == version_of(after.mission):
            return (after.mission,)
        ends = (before.mission, after.mission)
        known = {version_of(order) for order in ends}
        given = range(before.stamp - unseen, (self._trace.end if self._set_back else after.stamp) + SECOND)
        return (*ends, *(one for one in self._trace.orders if one.version not in known and one.stamp in given))


def _may_follow(before: Observed, after: Observed, orders: tuple[Mission | None, ...]) -> bool:
    """Return whether the order of `after` may have taken the place of that of `before`, with `orders` between.

    An order of the log follows one with a lower number, and a hold or landing that it has numbered, or that does not
    outrank it. One without a number follows what it outranks, or an upward order that came between.
    """
    order, was = after.mission, before.mission
    if order is None or was is None:
        return order is not None
    if order.number and was.number:
        return order.number > was.number
    if order.number:
        numbered = {*order.downs, order.version}
        return rank(order) >= rank(was) or not numbered.isdisjoint(before.unnumbered)
    return rank(order) >= rank(was) or any(one is not None and not rank(one) for one in orders)


def _combined(*alternatives: Iterable[int]) -> frozenset[int]:
    """Return every choice of one from each of the alternatives, together."""
    return frozenset(reduce(or_, choice, 0) for choice in product(*alternatives))


def _either(name: str, *holds: bool) -> tuple[int, ...]:
    """Return the condition `name` as it may be: holding, not holding."""
    return tuple(bits([name]) if so else 0 for so in holds)


def _verb(one: Observed) -> str:
    return one.mission.verb if one.mission is not None else "no order"
