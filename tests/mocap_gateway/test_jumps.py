from random import Random

import pytest
from flockwire.domain.pose import LEVEL
from flockwire.domain.time import SECOND, nanoseconds
from flockwire_mocap.claim import Claim
from flockwire_mocap.jumps import JumpFilter

FRAME = SECOND // 100


def fly(jumps, positions, *, begin=0, identity=1):
    """Return which of the positions, one each frame, pass."""
    return [jumps.passes(Claim((begin + k) * FRAME, identity, position, LEVEL)) for k, position in enumerate(positions)]


def test_flight_passes():
    jumps = JumpFilter(max_speed=2.0)
    dice = Random(1)
    places = [(0.019 * k + dice.gauss(0.0, 0.005), 0.0, 1.0) for k in range(500)]
    assert all(fly(jumps, places))
    assert jumps.jumps == 0


def test_a_jump_for_some_frames_is_held_back_and_counted():
    jumps = JumpFilter(max_speed=2.0)
    here, there = (0.0, 0.0, 1.0), (3.0, 0.0, 1.0)
    assert fly(jumps, [here] * 10 + [there] * 4 + [here] * 10) == [True] * 10 + [False] * 4 + [True] * 10
    assert (jumps.jumps, jumps.confirmed) == (1, 0)


def test_a_jump_that_lasts_is_believed():
    jumps = JumpFilter(max_speed=2.0, confirmations=5)
    here, there = (0.0, 0.0, 1.0), (3.0, 0.0, 1.0)
    assert fly(jumps, [here] * 3 + [there] * 8) == [True] * 3 + [False] * 4 + [True] * 4
    assert (jumps.jumps, jumps.confirmed) == (1, 1)


def test_frames_that_agree_with_nothing_confirm_nothing():
    jumps = JumpFilter(max_speed=2.0)
    fly(jumps, [(0.0, 0.0, 1.0)])
    assert not any(fly(jumps, [(5.0 + k % 2, 0.0, 1.0) for k in range(50)], begin=1))
    assert jumps.jumps == 50


def test_two_places_by_turns_let_the_true_one_through():
    jumps = JumpFilter(max_speed=2.0)
    passed = fly(jumps, [(3.0 * (k % 2), 0.0, 1.0) for k in range(20)])
    assert passed == [True, False] * 10


@pytest.mark.parametrize(("gap", "passes"), [(1.0, True), (0.9, False)])
def test_a_body_that_was_lost_may_have_flown_in_the_meantime(gap, passes):
    jumps = JumpFilter(max_speed=2.0, tolerance=0.05)
    assert jumps.passes(Claim(0, 1, (0.0, 0.0, 1.0), LEVEL))
    assert jumps.passes(Claim(nanoseconds(gap), 1, (2.04, 0.0, 1.0), LEVEL)) is passes


def test_bodies_are_apart_and_can_be_forgotten():
    jumps = JumpFilter(max_speed=2.0)
    assert jumps.passes(Claim(0, 1, (0.0, 0.0, 0.0), LEVEL))
    assert jumps.passes(Claim(0, 2, (9.0, 0.0, 0.0), LEVEL))
    assert not jumps.passes(Claim(FRAME, 1, (9.0, 0.0, 0.0), LEVEL))
    jumps.forget(1)
    assert jumps.passes(Claim(FRAME, 1, (9.0, 0.0, 0.0), LEVEL))


def test_constant_or_decreasing_stamps_give_no_reach():
    jumps = JumpFilter(max_speed=2.0)
    assert jumps.passes(Claim(SECOND, 1, (0.0, 0.0, 0.0), LEVEL))
    assert not jumps.passes(Claim(0, 1, (1.0, 0.0, 0.0), LEVEL))
    assert jumps.passes(Claim(SECOND, 1, (0.04, 0.0, 0.0), LEVEL))
