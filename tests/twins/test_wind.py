from itertools import count
from math import hypot
from random import Random

from flockwire_core.domain.time import SECOND
from flockwire_twins.wind import STEP, Wind
from hypothesis import given
from hypothesis import strategies as st


@given(st.integers(0, 10**18), st.floats(0.1, 3.0), st.integers(0, 99))
def test_a_gust_is_horizontal_and_never_more_than_said(now, gust, seed):
    x, y, z = Wind((1.0, -2.0, 0.5), gust, Random(seed).random).at(now)
    assert hypot(x - 1.0, y + 2.0) <= gust + 1e-9
    assert z == 0.5


def test_gusts_reach_most_of_their_bound_and_vanish_in_the_mean():
    wind = Wind((1.0, 0.0, 0.0), 0.5, Random(3).random)
    found = [wind.at(k * SECOND // 5) for k in range(48 * 5)]  # all periods divide 48 s
    assert abs(sum(x for x, _, _ in found) / len(found) - 1.0) < 1e-6
    assert max(hypot(x - 1.0, y) for x, y, _ in found) > 0.3


def test_drones_have_gusts_of_their_own_and_a_step_has_one_wind():
    chance = Random(5).random
    one, other = Wind((0.0, 0.0, 0.0), 0.5, chance), Wind((0.0, 0.0, 0.0), 0.5, chance)
    assert one.at(SECOND) != other.at(SECOND)
    assert one.at(SECOND) == one.at(SECOND + STEP - 1) != one.at(SECOND + STEP)


def test_a_calm_draws_nothing():
    drawn = count()
    assert not Wind((0.0, 0.0, 0.0), 0.0, lambda: float(next(drawn))).blows
    assert next(drawn) == 0
