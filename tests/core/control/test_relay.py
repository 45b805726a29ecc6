from __future__ import annotations

from math import cos, hypot, pi, sin

import pytest
from flockwire.control.depth import motion_error, noise_gain
from flockwire.control.leader_track import LeaderTrack, leader_time_constant
from flockwire.control.observer import ObserverParameters
from flockwire.control.relay import LeaderMotion, relay_step
from flockwire.control.sidestep import Impatience, sidestep
from flockwire.control.trajectory import Circling, Constant
from hypothesis import given
from hypothesis import strategies as st

OBSERVER = ObserverParameters(3.0, 1.5)


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_bringing_forward_twice_is_bringing_forward_once(first: float, second: float) -> None:
    motion = LeaderMotion((1.0, 2.0, 3.0), (0.1, -0.2, 0.3), (0.5, 0.4, -0.3))
    twice, once = motion.after(first).after(second), motion.after(first + second)
    for a, b in zip(twice, once, strict=True):
        assert a == pytest.approx(b, abs=1e-9)


def test_an_estimate_that_is_near_takes_over_what_it_hears() -> None:
    neighbour = LeaderMotion((1.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.2, 0.0))
    assert relay_step(LeaderMotion((0.99, 0.0, 0.0)), [(2.0, neighbour)], OBSERVER, 0.01) == neighbour


def test_several_neighbours_are_averaged_by_weight() -> None:
    a, b = LeaderMotion((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), LeaderMotion((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    stepped = relay_step(LeaderMotion((1.0, 0.0, 0.0)), [(3.0, a), (1.0, b)], OBSERVER, 0.01)
    assert stepped.velocity == pytest.approx((0.75, 0.0, 0.0))


def test_without_neighbours_it_coasts() -> None:
    own = LeaderMotion((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (9.0, 9.0, 9.0))
    assert relay_step(own, [], OBSERVER, 0.1).position == pytest.approx((0.1, 0.0, 0.0))


def test_noise_weighs_more_the_older_the_news_and_less_the_slower_the_tracker() -> None:
    gains = [noise_gain(0.3, age, 0.01) for age in (0.0, 0.03, 0.3, 0.6)]
    assert gains == sorted(gains)
    assert gains[0] < 1.0
    assert gains[3] < 3.0 * gains[1]
    assert noise_gain(0.15, 0.6, 0.01) > 2.0 * gains[3]


def test_a_leader_that_flies_straight_costs_nothing() -> None:
    assert motion_error(Constant((0.1, 0.1, 0.0)), 0.3, 0.6, 0.01, 10.0) < 1e-6
    assert motion_error(Circling(1.0, 0.14), 0.3, 0.6, 0.01, 10.0) < 0.002


def test_deep_swarms_track_the_leader_more_slowly() -> None:
    assert leader_time_constant(1) < leader_time_constant(20)


def test_a_track_begins_anew_after_a_gap() -> None:
    track = LeaderTrack(0.2)
    for k in range(100):
        track.update((0.01 * k, 0.0, 0.0), 0.01 * k)
    assert track.update((9.0, 0.0, 0.0), 5.0).velocity == (0.0, 0.0, 0.0)


def test_both_turn_to_their_right() -> None:
    near = [((-1.0, 0.0, 0.0), 0.0)]  # the body is ahead, along +X
    assert sidestep((1.0, 0.0, 0.2), near, 0.6, 1.0) == pytest.approx((0.0, -1.0, 0.2))
    assert sidestep((1.0, 0.0, 0.0), near, 0.6, -1.0) == pytest.approx((0.0, 1.0, 0.0))


@pytest.mark.parametrize("bodies", [[], [((1.0, 0.0, 0.0), 0.0)], [((-1.0, 0.0, 0.0), 0.7)]])
def test_nothing_in_the_way_turns_nobody(bodies: list[tuple[tuple[float, float, float], float]]) -> None:
    wanted = (1.0, 0.0, 0.0)
    assert sidestep(wanted, bodies, 0.6, 1.0) is wanted


@given(st.floats(0.0, 2 * pi), st.floats(-0.2, 1.0))
def test_turning_keeps_the_speed(angle: float, gap: float) -> None:
    turned = sidestep((1.0, 0.5, 0.0), [((cos(angle), sin(angle), 0.0), gap)], 0.6, 1.0)
    assert hypot(*turned) == pytest.approx(hypot(1.0, 0.5))


def test_who_gets_no_nearer_tries_the_other_side() -> None:
    impatience = Impatience(3.0)
    sides = [impatience.update(2.0, True, 0.1 * k) for k in range(80)]
    assert sides[0] == 1.0
    assert sides[40] == -1.0
    assert sides[75] == 1.0
    assert impatience.update(2.0, False, 9.0) == 1.0
