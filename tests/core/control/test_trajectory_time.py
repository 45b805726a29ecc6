from flockwire_leader.course import CHANGE, LONGEST_STEP, TrajectoryTime, falling, free_error
from hypothesis import given
from hypothesis import strategies as st

steps = st.lists(st.tuples(st.floats(0.0, 0.5), st.floats(0.0, 1.0)), max_size=60)


@given(begin=st.floats(0.0, 1e3), steps=steps)
def test_it_never_goes_back_nor_faster_than_time_and_its_pace_never_jumps(
    begin: float, steps: list[tuple[float, float]]
) -> None:
    time, t, s = TrajectoryTime(), begin, begin
    time.restart(begin)
    for dt, wanted in steps:
        pace, t = time.pace, t + dt
        now = time.advance(t, wanted)
        assert -1e-9 <= now - s <= dt + 1e-9
        assert now - s <= LONGEST_STEP + 1e-9
        assert abs(time.pace - pace) <= min(dt, LONGEST_STEP) / CHANGE + 1e-9
        assert 0.0 <= time.pace <= 1.0
        s = now


@given(begin=st.floats(-10.0, 1e3), steps=st.lists(st.floats(0.0, LONGEST_STEP), max_size=60))
def test_while_nothing_holds_it_back_it_is_exactly_mission_time(begin: float, steps: list[float]) -> None:
    time, t = TrajectoryTime(), begin
    time.restart(begin)
    for dt in steps:
        t += dt
        assert time.advance(t, 1.0) == t


def test_it_continues_where_it_was_left() -> None:
    time = TrajectoryTime()
    time.restart(0.0)
    assert time.advance(0.1, 1.0) == 0.1
    time.resume(7.0)
    assert abs(time.at(7.0) - 0.1) < 1e-12
    assert abs(time.advance(7.05, 1.0) - 0.15) < 1e-12


def test_the_falling_share_goes_from_one_to_zero() -> None:
    assert [falling(x, 1.0, 2.0) for x in (0.0, 1.0, 2.0, 3.0, 9.0)] == [1.0, 1.0, 0.5, 0.0, 0.0]


def test_the_free_error_grows_with_speed_and_delay() -> None:
    assert free_error(0.0, 0.4, 10.0) == 0.1
    assert free_error(0.5, 0.4, 10.0) == 0.1 + 2.0 * 0.5 * 0.45
