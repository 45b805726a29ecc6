import os
from pathlib import Path

import pytest
from flockwire_core.loading import load_swarm
from flockwire_core.swarm.reading import NO_FILE
from flockwire_operator.station.warnings import warnings

SWARMS = Path(__file__).parents[3] / "examples"
CHAIN_OF_EIGHT = {
    "graph.edges": [[i, i + 1] for i in range(8)],
    "drones": [{"id": i, "start": [1.0 * i, 0.0, 0.0]} for i in range(9)],
}


def warned(swarm):
    return "\n".join(warnings(swarm))


@pytest.mark.parametrize("name", ["paper_simulation", "paper_flight"])
def test_the_papers_swarms_fly_well(name):
    assert "will oscillate" not in warned(load_swarm(SWARMS / f"{name}.toml"))


def test_a_chain_that_is_deep_gives_a_warning(make_swarm):
    assert "8 hops from the leader" in warned(make_swarm(CHAIN_OF_EIGHT))
    assert "hops from the leader" not in warned(make_swarm())


def test_an_observer_gain_that_proves_nothing_gives_a_warning(make_swarm):
    assert "theta" not in warned(make_swarm({"observer.gain": 50.0}))
    assert "observer.gain = 0.1 must be above" in warned(make_swarm({"observer.gain": 0.1}))


def test_a_compensation_below_the_leaders_input_gives_a_warning(make_swarm):
    assert "control.compensation_gain = 0.1 m/s is below" in warned(make_swarm({"control.compensation_gain": 0.1}))
    assert "compensation_gain" not in warned(make_swarm({"control.compensation_gain": 0.15}))


def test_a_wind_that_drones_do_not_compensate_gives_a_warning(make_swarm):
    wind = {"control": {"formation_gain": 2.0}, "wind.velocity": [0.8, 0.0, 0.0], "wind.gust": 0.2}
    assert "wind of up to 1 m/s is above what drones compensate, control.disturbance = 0" in warned(make_swarm(wind))
    assert "0.50 m off their places" in warned(make_swarm(wind))
    assert "the wind" not in warned(make_swarm(wind | {"control.disturbance": 1.0}))
    unfiltered = {"control.disturbance": 1.0, "control.law": "paper"}
    assert "control.disturbance is set but has no effect" in warned(make_swarm(wind | unfiltered))


def test_a_wind_as_fast_as_an_airframe_gives_a_warning(make_swarm):
    tellos = {"control.law": "extended", "limits.speed": 3.0, "drones.1.airframe": "tello"}
    assert "is not below 1 m/s, the highest speed of airframe tello" in warned(
        make_swarm(tellos | {"control.disturbance": 1.3})
    )
    assert "highest speed" not in warned(make_swarm(tellos | {"control.disturbance": 0.9}))


def test_poses_that_are_too_rare_to_take_off_give_a_warning(make_swarm):
    rare = {"control.rate_hz": 10, "gateway.rate_hz": 10}
    assert "makes poses up to 0.1 s old" in warned(make_swarm(rare | {"gateway.latency": 0.0}))
    assert "makes poses" not in warned(make_swarm(rare | {"limits.staleness.pose_zero": 0.2}))


def test_a_trace_to_replay_that_is_no_file_here_gives_a_warning(make_swarm, tmp_path):
    def replayed(trace):
        return warned(make_swarm({"gateway": {"source": "replay", "replay": {"trace": str(trace)}}}))

    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "file").touch()
    assert f"gateway.replay.trace = '{tmp_path}/none': No such file or directory" in replayed(tmp_path / "none")
    assert f"gateway.replay.trace = '{tmp_path}/pipe': {NO_FILE}" in replayed(tmp_path / "pipe")
    assert "replay.trace" not in replayed(tmp_path / "file")


def test_an_airframe_that_will_oscillate_is_named_with_a_cure(make_swarm):
    slow = {"airframes.slow": {"lag": 0.25, "dead_time": 0.1}, "drones.3.airframe": "slow"}
    changes = {"airframes": {"kinematics": {}}} | slow
    found = [line for line in warnings(make_swarm(changes)) if "will oscillate" in line]
    assert len(found) == 1
    assert found[0].startswith("uav3 will oscillate")
    cure = float(found[0].split("compensation_smoothing of ")[1].split(" ")[0])
    assert "will oscillate" not in warned(make_swarm(changes | {"control.compensation_smoothing": cure + 0.01}))


def test_a_lag_that_the_papers_law_does_not_compensate_gives_a_warning(make_swarm):
    late = {"airframes": {"kinematics": {"lag": 0.16, "dead_time": 0.1}}}
    turning = {"formation": {"kind": "circle", "radius": 2.0, "rate": 1.0}, "limits.speed": 3.0}
    assert "kinematics will trail its place by about 0.17 m" in warned(make_swarm(late | turning))
    assert "trail" not in warned(make_swarm(late | turning | {"control.law": "extended"}))
    assert "trail" not in warned(make_swarm(turning | {"airframes": {"kinematics": {"lag": 0.01}}}))


def test_a_sight_too_short_for_the_formation_gives_a_warning_with_the_radius_that_would_do(make_swarm):
    late = {"airframes": {"kinematics": {"lag": 0.16, "dead_time": 0.1}}, "control": {"law": "extended"}}
    fast = late | {"formation": {"kind": "circle", "radius": 2.0, "rate": 1.0}, "limits.speed": 3.0}
    (line,) = [line for line in warnings(make_swarm(fast)) if "stop in time" in line]
    radius = float(line.split("; ")[1].split(" m")[0])
    assert 2.0 < radius < 3.0
    assert "stop in time" not in warned(make_swarm(fast | {"avoidance.sensing_radius": radius}))
    assert "stop in time" in warned(make_swarm(fast | {"avoidance.sensing_radius": radius - 0.2}))


def test_a_formation_gain_that_is_too_high_alone_is_reported(make_swarm):
    changes = {"airframes": {"kinematics": {"lag": 0.3, "dead_time": 0.2}}, "control.formation_gain": 20.0}
    assert "control.formation_gain = 20 alone is too high" in warned(make_swarm(changes))
