"""Keys become a velocity for as long as they are held; whoever steers may do nothing else."""

import pytest
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.keys import STEERING, TIME_REPLY, TIME_REQUEST, Key
from flockwire_operator.cli.orders import app
from flockwire_operator.station.teleop import HELD, SteeringKeys
from typer.testing import CliRunner


def test_a_key_counts_while_it_repeats_and_a_little_longer():
    keys = SteeringKeys(0.4)
    keys.press("w", 0)
    assert keys.velocity(SECOND // 2) == pytest.approx((0.0, 0.4, 0.0))
    keys.press("w", SECOND // 2)
    assert keys.velocity(SECOND) == pytest.approx((0.0, 0.4, 0.0))
    assert keys.velocity(SECOND // 2 + round(HELD)) == (0.0, 0.0, 0.0)


def test_two_keys_go_between_no_faster_and_opposite_ones_nowhere():
    keys = SteeringKeys(0.4)
    keys.press("d", 0)
    keys.press("r", 0)
    assert keys.velocity(1) == pytest.approx((0.4 / 2**0.5, 0.0, 0.4 / 2**0.5))
    keys.press("a", 0)
    keys.press("f", 0)
    assert keys.velocity(1) == (0.0, 0.0, 0.0)


def test_space_stops_at_once_q_ends_and_other_keys_are_nothing():
    keys = SteeringKeys(0.4)
    for key in "wxS5":
        keys.press(key, 0)
    keys.press(" ", 1)
    assert (keys.velocity(2), keys.ended) == ((0.0, 0.0, 0.0), False)
    keys.press("q", 3)
    assert keys.ended


def test_teleop_publishes_to_the_leader_and_receives_the_time_alone(make_plan):
    plan = make_plan({"leader.kind": "teleoperated"})
    assert plan.publishes["teleop"] == (Key(STEERING, "uav0"), Key(TIME_REQUEST, "teleop"))
    assert plan.subscribes["teleop"] == (Key(TIME_REPLY, "teleop"),)
    assert plan.passes("teleop", "leader") == (Key(STEERING, "uav0"),)
    assert set(plan.links["teleop"]) == {"gateway", "leader", *plan.recorders}
    assert "teleop" not in make_plan().identities


def test_only_a_teleoperated_leader_is_steered_and_only_from_a_terminal(request, tmp_path):
    paper = (request.config.rootpath / "examples" / "paper_simulation.toml").read_text()
    file = tmp_path / "swarm.toml"
    file.write_text(paper)
    refused = CliRunner().invoke(app, ["teleop", str(file)])
    assert refused.exit_code == 2
    assert "leader.kind = 'trajectory': only a 'teleoperated' leader can be steered" in refused.stderr
    file.write_text(paper.replace('kind = "trajectory"', 'kind = "teleoperated"'))
    assert "there is no terminal to read keys from" in CliRunner().invoke(app, ["teleop", str(file)]).stderr
