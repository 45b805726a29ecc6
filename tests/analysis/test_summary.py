"""The figures of flights that are known in closed form."""

from dataclasses import replace
from math import cos, exp, hypot, sin

import numpy as np
import pytest
from flockwire_analysis.phases import offsets
from flockwire_analysis.reading import read_trace
from flockwire_analysis.separation import surface_distance
from flockwire_analysis.summary import summarise
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.tables import Obstacle
from flockwire_core.wire.keys import Key
from flockwire_core.wire.status import LAW_SLOW

KEYS = [
    "duration_s", "mission_start_ns", "drones", "left_out", "observation_error_m", "formation_error_m",
    "min_distance_uav_m",
    "min_distance_obstacle_m", "max_speed_m_s", "max_outside_m", "latency_ms", "steps", "messages",
    "tracker", "rate", "filtered", "conflicts", "missing",
    "phases", "checks",
]  # fmt: skip


def summary_of(path):
    return summarise(read_trace(path))


def named(summary):
    return {check.name: check for check in summary.checks}


@pytest.fixture(scope="module")
def biased(tmp_path_factory, write_flight):
    path = tmp_path_factory.mktemp("flight") / "a.mcap"
    flight = write_flight(path, end=12.0, place_bias=0.03, estimate_bias=-0.02, holds_at=11.0, lost=7)
    return flight, summary_of(path)


def test_the_tail_shows_the_bias(biased):
    flight, summary = biased
    left = max(hypot(*flight.start_error(i)) for i in range(1, 5)) * exp(-0.7 * 11.0 / flight.decay)
    assert summary.formation_error_m.max_tail == pytest.approx(0.03, abs=left + 1e-9)
    assert summary.formation_error_m.rms_tail == pytest.approx(0.03, abs=left)
    assert summary.observation_error_m.max_tail == pytest.approx(0.02, abs=2e-3)


def test_settling_times(biased):
    flight, summary = biased

    def error(i, t):
        x, y = (e * exp(-t / flight.decay) for e in flight.start_error(i))
        return hypot(x + 0.03, y)

    last = max(t for i in range(1, 5) for t in (k / 100 for k in range(1000)) if error(i, t) >= 0.1)
    assert summary.formation_error_m.settled_s == pytest.approx(last + 0.01, abs=1e-9)
    assert 0.0 < summary.observation_error_m.settled_s < 3.0


def test_counts(biased):
    _, summary = biased
    assert summary.mission_start_ns == 1_790_000_000_000_000_000
    assert summary.duration_s == pytest.approx(18.0, abs=0.01)
    assert summary.drones == 5
    assert summary.messages.lost == 7
    assert summary.messages.rejected == 3
    assert summary.messages.rejected_by_key == {"paper/uav1/pose older than the last": 3}
    ticks = [1801 - 1 - (10 - i) % 10 for i in range(1, 5)]
    assert summary.steps.made == pytest.approx(sum(ticks), abs=4)
    assert summary.steps.skipped == 4
    assert summary.rate["uav1"] == pytest.approx(1.0, abs=2e-3)
    assert summary.rate["uav2"] == pytest.approx(1.0, abs=2e-3)  # what was lost on the way was commanded all the same
    assert list(summary.rate) == ["uav1", "uav2", "uav3", "uav4"]


def test_latencies(biased):
    _, summary = biased
    assert summary.latency_ms["capture_to_pose"].p50 == pytest.approx(1.0)
    assert summary.latency_ms["pose_to_command"].p50 == pytest.approx(2.4, abs=0.05)
    assert summary.latency_ms["pose_to_command"].p99 == pytest.approx(2.8, abs=0.01)
    assert summary.latency_ms["pose_to_estimate"].p50 == pytest.approx(2.3, abs=0.05)


def test_distances_and_speed(biased):
    flight, summary = biased
    times = [k / 1000 for k in range(-3900, 12000)]
    places = [[flight.position(i, t) for t in times] for i in range(5)]
    nearest = min(
        hypot(*(a - b for a, b in zip(p, q, strict=True)))
        for i in range(5) for j in range(i) for p, q in zip(places[i], places[j], strict=True)
    )  # fmt: skip
    (x, y, _), radius = flight.swarm.obstacles[0].center, flight.swarm.obstacles[0].radius
    clearance = min(hypot(p[0] - x, p[1] - y) - radius for track in places for p in track)
    assert summary.min_distance_uav_m == pytest.approx(nearest, abs=1e-4)
    assert summary.min_distance_obstacle_m == pytest.approx(clearance, abs=1e-3)
    fastest = max(
        hypot(*(a - b for a, b in zip(p, q, strict=True))) / 0.05
        for track in places for p, q in zip(track, track[50:], strict=False)
    )  # fmt: skip
    assert summary.max_speed_m_s == pytest.approx(fastest, rel=1e-3)


def test_checks_and_json(biased):
    _, summary = biased
    assert list(summary.as_json()) == KEYS
    assert summary.as_json()["latency_ms"]["pose_to_command"].keys() == {"p50", "p99"}
    assert [list(check) for check in summary.as_json()["checks"]] == [["name", "value", "limit", "ok"]] * 17
    checks = named(summary)
    assert [name for name, check in checks.items() if check.ok] == [
        "separation", "obstacle clearance", "speed", "fence", "emergency stop", "formation settled",
        "formation kept", "places", "formation tail", "observation tail", "on the ground in formation", "lost drones",
        "conformance",
        "landed", "control rate", "recording",
    ]  # fmt: skip
    assert not summary.ok
    assert summary.failures() == ("lost messages: 7, must be none",)
    assert summary.missing == ()


def test_a_slow_agent_fails(fly):
    check = named(summary_of(fly(begin=-1.0, end=6.0, skipped=40)))["control rate"]
    assert check.value == pytest.approx(1.0 - 40 / 600, abs=2e-3)
    assert not check.ok


def test_a_slow_agent_whose_law_is_slow_says_so(fly):
    trace = read_trace(fly(begin=-1.0, end=6.0, skipped=40))
    told = ("uav1: its law takes 12 ms", "uav2: its law takes 11 ms", "uav1: its law takes 13 ms")
    check = named(summarise(replace(trace, reasons=trace.reasons | {LAW_SLOW: told})))["control rate"]
    assert "uav1: its law takes 13 ms; uav2: its law takes 11 ms" in check.sentence()


def test_poses_slower_than_the_control_rate_are_not_missed_steps(fly):
    check = named(summary_of(fly(begin=-1.0, end=6.0, pose_every=2)))["control rate"]
    assert check.value == pytest.approx(1.0, abs=5e-3)


def test_a_slow_agent_fails_with_slow_poses_too(fly):
    check = named(summary_of(fly(begin=-1.0, end=6.0, pose_every=2, skipped=60)))["control rate"]
    assert check.value == pytest.approx(1.0 - 30 / 300, abs=5e-3)
    assert not check.ok


def test_more_steps_in_one_formation_make_up_for_none_in_another(fly, swarm_of):
    """Fly 5.5 s of a formation and 8 s of another, 50 steps/s due and 100 made; none in the first 6 s of the second."""
    swarm = swarm_of(control={"rate_hz": 50}, formations={"row": {"kind": "line", "spacing": 0.8}})
    check = named(summary_of(fly(swarm=swarm, begin=-1.0, end=14.0, second_start=5.5, skipped=700)))["control rate"]
    assert check.value == pytest.approx((275 + 200) / (275 + 400), abs=0.02)


def test_never_settled(fly):
    summary = summary_of(fly(end=5.0, place_bias=0.2))
    assert summary.formation_error_m.settled_s is None
    assert summary.formation_error_m.max_tail == pytest.approx(0.2, abs=0.06)
    assert [sentence.partition(":")[0] for sentence in summary.failures()] == ["formation settled", "formation tail"]
    assert "did not stay within 0.1 m of their places for 2 s (the formation, from 0.0 s on" in summary.failures()[0]


def test_settled_from_the_start(fly):
    assert summary_of(fly(begin=-9.0, end=4.0)).observation_error_m.settled_s == 0.0


def test_without_a_mission(fly):
    summary = summary_of(fly(begin=-2.0, end=1.0, started=False))
    reason = "no mission `start` was recorded, so there was no formation to judge"
    assert summary.mission_start_ns is None
    assert summary.formation_error_m.max_tail is None
    assert summary.rate["uav1"] is None
    assert summary.missing == (f"N{reason[1:]}.",)
    unjudged = ("formation settled", "formation tail", "observation tail", "control rate")
    assert summary.failures() == tuple(f"{name}: {reason}" for name in unjudged)


def test_without_the_leaders_pose(fly):
    silent = frozenset({Key("pose", "uav0"), Key("truth", "uav0")})
    summary = summary_of(fly(begin=-1.0, end=3.0, silent=silent))
    assert summary.formation_error_m.settled_s is None
    assert summary.min_distance_uav_m is None
    assert "No pose of the leader, uav0, was recorded." in summary.missing
    assert "separation: no position of uav0 was recorded" in summary.failures()


def test_a_follower_that_falls_silent_has_not_settled(fly):
    summary = summary_of(fly(begin=-1.0, end=3.0, silent=frozenset({Key("estimate", "uav3")})))
    assert summary.observation_error_m.settled_s is None
    assert summary.observation_error_m.max_tail is None
    assert summary.formation_error_m.max_tail is not None
    assert "No estimate of uav3 was recorded." in summary.missing


def test_poses_serve_where_there_is_no_truth(fly):
    silent = frozenset(Key("truth", f"uav{i}") for i in range(5))
    summary = summary_of(fly(begin=-1.0, end=3.0, silent=silent))
    assert summary.min_distance_uav_m == pytest.approx(1.29, abs=0.05)
    assert summary.latency_ms["capture_to_pose"].p50 == pytest.approx(1.0)


def test_without_obstacles(fly, swarm_of):
    summary = summary_of(fly(begin=-1.0, end=3.0, swarm=swarm_of(obstacle=False)))
    assert summary.min_distance_obstacle_m is None
    assert "obstacle clearance" not in named(summary)


def test_a_cylinder_of_some_height():
    places = np.array([[2.0, 0.0, 0.5], [2.0, 0.0, 3.0], [0.0, 0.0, 3.0], [0.5, 0.0, 1.0], [1.0, 0.0, 9.0]])
    pillar = Obstacle(center=(0.0, 0.0, 0.0), radius=1.0, height=2.0)
    assert surface_distance(places, pillar) == pytest.approx([1.0, 2**0.5, 1.0, -0.5, 7.0])
    endless = Obstacle(center=(0.0, 0.0, 0.0), radius=1.0)
    assert surface_distance(places, endless) == pytest.approx([1.0, 1.0, -1.0, -0.5, 0.0])


def test_the_newest_start_is_in_force(fly, swarm_of):
    trace = read_trace(fly(begin=-1.0, end=1.0, swarm=swarm_of(formations={"row": {"kind": "line"}}), lands=False))
    begin = trace.missions[-1].start
    switched = Mission(begin + 5 * SECOND, "world", "start", begin, "row")
    stamps = begin + np.array([-1, 0, 4, 6], np.int64) * SECOND
    found = offsets(replace(trace, missions=(*trace.missions, switched)), 1, stamps)
    assert np.isnan(found[0]).all()
    assert found[1] == pytest.approx([0.0, 2.0, 0.0])
    assert found[2] == pytest.approx([2 * sin(4.0), 2 * cos(4.0), 0.0])
    assert found[3] == pytest.approx([1.0, 0.0, 0.0])


def test_an_unknown_formation_is_said(fly):
    trace = read_trace(fly(begin=-1.0, end=1.0, lands=False))
    unknown = trace.missions[-1]._replace(formation="heart")
    summary = summarise(replace(trace, missions=(unknown,)))
    assert "The swarm has no formation 'heart', which was started." in summary.missing
    assert summary.formation_error_m.max_tail is None


def test_a_start_after_the_end_is_said(fly):
    trace = read_trace(fly(begin=-1.0, end=0.0, lands=False))
    late = trace.missions[-1]._replace(start=trace.end + SECOND)
    assert "The trace ends before the formation's time 0." in summarise(replace(trace, missions=(late,))).missing
