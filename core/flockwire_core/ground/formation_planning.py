"""Plans a change of formation; refuses one that breaks limits of speed, acceleration, spacing or fence.

The operator plans; pilots fly the order (flown_formation.py). Each tried duration is rehearsed
(formation_rehearsal.py).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import chain

from flockwire_core.domain.order import LONGEST_CHANGE, Change, Mission
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.domain.vector import Vector
from flockwire_core.ground.delivery import ChangeDelivery
from flockwire_core.ground.formation_rehearsal import Rehearsal, Way
from flockwire_core.swarm.model import Swarm

LEAD_TIME = SECOND  # ns from the order to the change, so that all have received it
LONGEST = 60.0  # s, longest change, unless its duration is given
GROWTH = 1.06  # factor to the next tried duration, if one is too short
LEAP = 1.3  # factor for other problems that more time may solve, because formations turn


class ChangeRefusedError(ValueError):
    """A change of formation that cannot be flown; the text names drone, time and limit."""


def plan_change(
    swarm: Swarm,
    running: Mission,
    name: str,
    now: int,
    leader: Vector | None = None,
    duration: float | None = None,
    lead: int = LEAD_TIME,
) -> Mission:
    """Return the order that changes from the formation of `running`, flown or interrupted, to the formation `name`.

    `now` is Unix ns; `leader` is the leader's position (m, world frame; None: no check of the fence). Without a
    `duration`, s, the change takes the shortest within all limits that the safety filter does not slow. It begins
    `lead` ns from now. Raises ChangeRefusedError.
    """
    last = running.change
    order = running._replace(stamp=now, verb="formation")
    if last is not None and now < last.begin + nanoseconds(last.duration):
        left = (last.begin - now) / SECOND + last.duration
        raise ChangeRefusedError(f"the change to formation {running.formation!r} takes another {left:.1f} s")
    if name == running.formation:
        return order
    begin = now + lead
    rehearsal = Rehearsal(swarm, running, name, (begin - running.start) / SECOND, leader, lead)
    if duration is None:
        duration = _shortest(rehearsal)
    else:
        _check(rehearsal, duration)
    change = Change(begin, duration, running.formation, rehearsal.places_before, rehearsal.places(duration))
    return order._replace(formation=name, change=change)


def plan_in_time(swarm: Swarm, made: ChangeDelivery, clock: Callable[[], int]) -> Mission:
    """Plan what `made` waits for at the time that `clock` shows (Unix ns), and again if planning took too long.

    Half of the lead time is left for the order to arrive. Raises ChangeRefusedError.
    """
    wanted, running, lead = made.order, made.to_plan, LEAD_TIME
    assert running is not None  # noqa: S101  (it waits)
    while True:
        began = clock()
        order = plan_change(swarm, running, wanted.formation, began, made.leader, wanted.duration, lead)
        now = clock()
        if 2 * (now - began) <= lead:
            return order._replace(stamp=now)
        lead = 4 * (now - began)


def _shortest(rehearsal: Rehearsal) -> float:
    """Return the shortest duration, s, within all limits; raises ChangeRefusedError if there is none.

    It is the shortest that the safety filter does not slow or, without one, slows least.
    """
    duration, reason = 1.0, ""  # s, shortest change, unless its duration is given
    strained: list[tuple[float, float]] = []  # slowing, m/s, of each duration within the limits
    # times the shortest duration within the limits, if the safety filter would slow it
    while duration <= (4.0 * strained[0][1] if strained else LONGEST):
        way = rehearsal.way(duration)
        hurried = next(rehearsal.too_fast(way), "")
        elsewhere = "" if hurried else next(_elsewhere(rehearsal, way), "")
        if not (hurried or elsewhere):
            strained.append((rehearsal.strain(way), duration))
            if strained[-1][0] <= 0.0:
                return duration
        reason = hurried or elsewhere
        duration *= LEAP if elsewhere else GROWTH
    if strained:
        return min(strained)[1]
    raise ChangeRefusedError(f"{reason}, however long the change takes (up to {LONGEST:g} s)")


def _check(rehearsal: Rehearsal, duration: float) -> None:
    """Raise ChangeRefusedError when the change cannot be flown in `duration` s."""
    if not 0.0 < duration <= LONGEST_CHANGE:
        raise ChangeRefusedError(f"--duration = {duration:g}: must be above 0 and at most {LONGEST_CHANGE:g} s")
    way = rehearsal.way(duration)
    if problem := next(chain(rehearsal.too_fast(way), _elsewhere(rehearsal, way)), ""):
        raise ChangeRefusedError(problem)


def _elsewhere(rehearsal: Rehearsal, way: Way) -> Iterator[str]:
    """Yield problems other than speed, which more time may or may not solve."""
    return chain(rehearsal.too_close(way), rehearsal.outside(way))
