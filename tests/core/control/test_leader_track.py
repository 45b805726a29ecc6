from __future__ import annotations

import pytest
from flockwire_core.control.leader_track import LeaderTrack, motion_error, noise_gain
from flockwire_core.control.trajectory import Circling, Constant
from flockwire_core.parameters import leader_time_constant


def test_noise_weighs_more_with_older_data_and_less_the_slower_the_tracker() -> None:
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
    assert leader_time_constant(10) == 0.25


@pytest.mark.parametrize("depth", [4, 10, 13, 20, 40])
def test_noise_at_most_doubles_along_a_chain(depth: int) -> None:
    """30 ms and a period of 10 ms a hop."""
    first, last = (noise_gain(leader_time_constant(depth), 0.04 * hops, 0.01) for hops in (1, depth))
    assert last <= 2.0 * first


def test_a_track_restarts_after_a_gap() -> None:
    track = LeaderTrack(0.2)
    for k in range(100):
        track.update((0.01 * k, 0.0, 0.0), 0.01 * k)
    assert track.update((9.0, 0.0, 0.0), 5.0).velocity == (0.0, 0.0, 0.0)


def test_the_same_pose_again_changes_nothing() -> None:
    track = LeaderTrack(0.2)
    for k in range(100):
        motion = track.update((0.01 * k, 0.0, 0.0), 0.01 * k)
    assert track.update((0.99, 0.0, 0.0), 0.99) == motion
