from itertools import chain, combinations

import pytest
from flockwire_core.domain.order import MISSION_VERBS, Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.pilot.phases import CONDITIONS, IN_FLIGHT, FlightPhases, bits, transition, transitions
from flockwire_core.pilot.reactions import HOLD, LAND, REFUSE
from flockwire_core.wire.phase import PILOT_PHASES, Phase
from flockwire_core.wire.status import Reason

BORN = 1_790_000_000 * SECOND
NOW = BORN + 60 * SECOND
SENSED = ("stop", "airborne", "high", "unready", "disturbed", "danger")


def subsets(names):
    return map(frozenset, chain.from_iterable(combinations(names, count) for count in range(len(names) + 1)))


def ordered(verb, outdated=False):
    """Return the conditions that an order makes hold."""
    names = {"up": verb in ("takeoff", "start"), "formation": verb in ("start", "formation"), "landing": verb == "land"}
    return {name for name, holds in names.items() if holds} | ({"outdated"} if outdated else set())


def flight_in(phase, verb, outdated=False, start=0):
    """Return a flight in `phase` whose order is `verb` (empty: none), from before its process or not."""
    flight = FlightPhases(BORN)
    if verb:
        flight.order(Mission(BORN - SECOND if outdated else BORN + SECOND, "world", verb, start, number=1), NOW)
    flight.phase = phase
    return flight


def update(flight, sensed):
    if "stop" in sensed:
        flight.stop()
    reasons = {"unready": REFUSE, "disturbed": HOLD, "danger": LAND}
    found = {reaction: Reason(name, "why") for name, reaction in reasons.items() if name in sensed}
    return flight.update(NOW, "airborne" in sensed, "high" in sensed, found)


@pytest.mark.parametrize("verb", ["", *MISSION_VERBS])
@pytest.mark.parametrize("phase", PILOT_PHASES)
def test_a_pilot_knows_its_conditions(phase, verb):
    for sensed in subsets(SENSED):
        for outdated in (False, True) if verb else (False,):
            after = transition(phase, bits(sensed | ordered(verb, outdated))).after
            assert update(flight_in(phase, verb, outdated), sensed) is after, sensed


def test_what_else_makes_a_condition_hold():
    early = flight_in(Phase.HOLD, "start", start=NOW + 1)
    later = transition(Phase.HOLD, bits({"airborne", "high", "disturbed"} | ordered("start")))
    assert update(early, {"airborne", "high"}) is later.after
    came_back = flight_in(Phase.HOLD, "start")
    assert update(came_back, ()) is Phase.GROUNDED
    assert update(came_back, ()) is transition(Phase.READY, bits(ordered("start", True))).after


def test_every_row_is_needed_and_names_what_there_is():
    every = list(map(bits, subsets(CONDITIONS)))
    used = {transition(phase, conditions) for phase in PILOT_PHASES for conditions in every}
    assert used == set(transitions())
    assert {name for row in transitions() for name in (*row.required, *row.forbidden)} == set(CONDITIONS)


def test_nobody_takes_off_from_the_air_or_out_of_a_stop():
    for row in transitions():
        assert row.after is not Phase.TAKEOFF or row.before <= {Phase.GROUNDED, Phase.READY, Phase.TAKEOFF}
        assert row.after not in IN_FLIGHT or Phase.STOPPED not in row.before
