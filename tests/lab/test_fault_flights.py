"""The first flights of lab/bench/fault_flights.py: faults of every kind, drawn by seed, harm nobody."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from random import Random

import pytest
from fault_draws import KINDS, drawn
from fault_judge import Judge, Result, fly, fly_rare
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.plan import Plan
from flockwire_lab.search.margin import BOUNDS
from flockwire_lab.search.record import DRIVER_LANDS, DRIVER_STOPS
from rare_draws import RARE_KINDS, rare_faults
from stacked import drawn as stacked

FLIGHTS = 4
RARE, TELLO = 18, 3  # of rare faults: a small swarm and orders of a second station; airframes with drivers


@pytest.fixture(scope="module")
def flown() -> list[Result]:
    return [fly(seed) for seed in range(FLIGHTS)]


def test_no_drones_collide_and_all_are_down_at_the_end(flown: list[Result]) -> None:
    assert [(result.seed, result.bad) for result in flown if result.bad] == []


def test_drivers_and_pilots_react(flown: list[Result]) -> None:
    reached = {code for result in flown for code in result.reactions}
    assert {"own pose: hold", "own pose lost: land", DRIVER_STOPS, DRIVER_LANDS} <= reached


def test_a_seed_draws_the_same_flight_again(flown: list[Result]) -> None:
    assert fly(0) == flown[0]


def test_every_kind_of_fault_is_drawn() -> None:
    kinds = {fault["kind"] for seed in range(80) for fault in drawn(seed).faults}
    assert kinds == set(KINDS)


def test_rare_draws_add_every_kind(make_swarm: Callable[..., Swarm]) -> None:
    watching = make_swarm({"control.law": "extended", "limits.body_drift": 0.2})
    plans = [*(Plan(drawn(seed).swarm) for seed in (RARE, TELLO)), Plan(watching)]
    kinds = {f["kind"] for plan in plans for seed in range(200) for f in rare_faults(plan, (), Random(seed))}
    assert set(RARE_KINDS) <= kinds


def test_a_rare_flight_is_the_same_again_and_not_the_usual_one() -> None:
    assert drawn(RARE, rare=True) == drawn(RARE, rare=True) != drawn(RARE)
    rare = fly_rare(RARE)
    assert rare == fly_rare(RARE)
    assert rare.bad == []


def test_a_collision_would_be_seen(flown: list[Result]) -> None:
    seed = next(result.seed for result in flown if result.closest < 1.0)
    bad = fly(seed, bounds=replace(BOUNDS, collision=5.0)).bad
    assert any("distance: uav" in what for what in bad)


def test_a_hard_touch_down_would_be_seen(flown: list[Result]) -> None:
    seed = next(result.seed for result in flown if result.fastest_contact > 0.6)
    assert any("touched down at 0." in what for what in fly(seed, bounds=replace(BOUNDS, hard=-0.5)).bad)


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(1464, id="drivers that stood still while told to end"),
        pytest.param(
            2301, id="a landing into the hollow between two on the ground and the fence", marks=pytest.mark.long
        ),
        pytest.param(4087, id="an agent restarted in flight that does not hear its driver", marks=pytest.mark.long),
        pytest.param(470, id="a body that is lost above one who is about to touch down", marks=pytest.mark.long),
        pytest.param(1767, id="a stop after the drivers' clock was set back"),
        pytest.param(3319, id="a pilot's clock is set back before it takes off"),
        pytest.param(183, id="a pilot's clock is set back in formation", marks=pytest.mark.long),
    ],
)
def test_what_went_wrong_once(seed: int) -> None:
    assert fly(seed).bad == []


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(320390, id="without poses beneath one that its driver lands, beside another one"),
        pytest.param(321151, id="without poses between two that land"),
        pytest.param(320093, id="a pilot that wakes up in the take-off of before"),
        pytest.param(322183, id="a Tello that takes off as the flight ends, its driver frozen", marks=pytest.mark.long),
        pytest.param(1820, id="a landing that holds again before the log numbers it", marks=pytest.mark.long),
        pytest.param(2515, id="a landing numbered after another one that never arrived"),
        pytest.param(552, id="an order given while its driver sets it down"),
        pytest.param(271, id="two names exchanged half a metre apart"),
    ],
)
def test_what_went_wrong_once_in_rare_flights(seed: int) -> None:
    assert fly_rare(seed).bad == []


def test_a_pilot_between_two_does_not_descend_onto_one_whose_driver_still_waits_for_commands() -> None:
    assert Judge(stacked(180)).fly().bad == []  # pose_land 0.53 s, command_land 1.2 s
