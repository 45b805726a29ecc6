"""Which dead processes are restarted in a flight, and after what pause."""

import pytest
from flockwire_core.domain.time import SECOND
from flockwire_operator.station.restarts import LONGEST_PAUSE, MOST_AT_ONCE, Restarts
from simulated_children import Processes


@pytest.fixture
def flight(make_plan):
    """Return the processes of a flight, and a function that steps to a time, s: it returns why the flight ends."""
    children, notes = Processes(), []
    restarts = Restarts(make_plan({"ros.orders": []}), children, notes.append)

    return children, notes, lambda seconds: restarts.step(round(seconds * SECOND))


def test_a_dispensable_process_is_restarted_after_a_growing_pause_and_ends_no_flight(flight):
    children, notes, step = flight
    now, pauses = 0.0, []
    for count in range(MOST_AT_ONCE + 9):
        children.dead.append("ros")
        died = now
        while len(children.started) == count:
            assert step(now) == ""
            now += 0.25
        pauses.append(now - 0.25 - died)
    assert pauses == [0.0] * MOST_AT_ONCE + [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 60.0, 60.0, LONGEST_PAUSE / SECOND]
    assert notes[0] == "ros ended unexpectedly (signal SIGKILL); restarted"
    assert notes[-1] == "ros ended unexpectedly (signal SIGKILL); restarted in 60 s"


def test_a_dispensable_process_that_refuses_its_configuration_is_given_up(flight):
    children, notes, step = flight
    children.refusing = True
    children.dead.append("ros")
    assert [step(now) for now in (0.0, 1.0, 100.0)] == ["", "", ""]
    assert children.started == []
    assert notes == ["ros ended unexpectedly (signal SIGKILL); given up, the flight goes on without it"]


def test_the_death_of_another_process_ends_the_flight_at_once_or_at_its_sixth_time(flight):
    children, _, step = flight
    for _ in range(MOST_AT_ONCE):
        children.dead.append("recorder")
        assert step(0.0) == ""
    children.dead.append("recorder")
    assert step(0.0) == "recorder ended unexpectedly (signal SIGKILL)"
    children.dead[:] = ["uav1", "ros"]
    assert step(0.0) == "uav1 ended unexpectedly (signal SIGKILL)"
    assert children.started == ["recorder"] * MOST_AT_ONCE + ["ros"]
