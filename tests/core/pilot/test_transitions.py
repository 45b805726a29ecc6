from itertools import chain, combinations

import pytest
from flockwire_core.domain.order import MISSION_VERBS, Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.pilot.orders import came_down
from flockwire_core.pilot.phases import IN_FLIGHT, LAST_HOLD, ORDERLESS, FlightPhases, Situation
from flockwire_core.pilot.transitions import CONDITIONS, PHASES, transition, transitions
from flockwire_core.wire.phase import Phase

BORN = 1_790_000_000 * SECOND
NOW = BORN + 60 * SECOND
SENSED = ("stop", "airborne", "high", "unready", "disturbed", "danger")


def subsets(names):
    return map(frozenset, chain.from_iterable(combinations(names, count) for count in range(len(names) + 1)))


def ordered(verb, outdated):
    """Return the conditions that an order makes hold."""
    names = {"up": verb in ("takeoff", "start"), "formation": verb in ("start", "formation"), "landing": verb == "land"}
    return {name for name, holds in names.items() if holds} | ({"outdated"} if outdated else set())


def flight_in(phase, verb, outdated):
    """Return a flight in `phase` whose order is `verb` (empty: none), from before its process or not."""
    flight = FlightPhases(BORN)
    if verb:
        flight.order(Mission(BORN - SECOND if outdated else BORN + SECOND, "world", verb), NOW)
    flight.phase = phase
    return flight


def situation(conditions):
    reasons = {name: "why" if name in conditions else "" for name in ("unready", "disturbed", "danger")}
    return Situation(
        NOW, reasons["unready"], reasons["disturbed"], reasons["danger"], "airborne" in conditions, "high" in conditions
    )


@pytest.mark.parametrize("verb", ["", *MISSION_VERBS])
@pytest.mark.parametrize("phase", PHASES)
def test_the_code_does_what_the_table_says(phase, verb):
    for sensed in subsets(SENSED):
        for outdated in (False, True) if verb else (False,):
            flight = flight_in(phase, verb, outdated)
            if not verb:  # else it lands for want of an order
                flight._born = NOW - ORDERLESS + 1
            if "stop" in sensed:
                flight.stop()
            conditions = sensed | ordered(verb, outdated)
            assert flight.update(situation(sensed)) is transition(phase, conditions).after, conditions


def test_what_else_makes_a_condition_hold():
    orderless = flight_in(Phase.HOLD, "", False)
    assert orderless.update(situation({"airborne"})) is transition(Phase.HOLD, {"airborne", "danger"}).after
    early = flight_in(Phase.HOLD, "", False)
    early.order(Mission(BORN + 1, "world", "start", NOW + 1), NOW)
    conditions = {"airborne", "high"}
    later = transition(Phase.HOLD, conditions | ordered("start", False) | {"disturbed"})
    assert early.update(situation(conditions)) is later.after
    came_back = flight_in(Phase.READY, "start", False)
    came_back.orders.concurrent = (came_down(came_back.mission),)
    assert came_back.update(situation(set())) is transition(Phase.READY, ordered("start", True)).after
    retired = flight_in(Phase.FORMATION, "start", False)
    retired.retire(NOW - LAST_HOLD)
    conditions = {"airborne", "high", "disturbed", "danger", *ordered("start", False)}
    assert retired.update(situation(conditions)) is transition(Phase.FORMATION, conditions).after


def test_every_row_is_needed_and_names_what_there_is():
    every = list(subsets(CONDITIONS))
    used = {transition(phase, conditions) for phase in PHASES for conditions in every}
    assert used == set(transitions())
    assert {name for row in transitions() for name in row.required | row.forbidden} == set(CONDITIONS)


def test_nobody_takes_off_from_the_air_or_out_of_a_stop():
    for row in transitions():
        assert row.after is not Phase.TAKEOFF or row.before <= {Phase.GROUNDED, Phase.READY, Phase.TAKEOFF}
        assert row.after not in IN_FLIGHT or Phase.STOPPED not in row.before
