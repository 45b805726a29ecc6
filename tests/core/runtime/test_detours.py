"""Where the environment tells a process to dial."""

import pytest
from flockwire_core.runtime.configuration import configuration
from flockwire_core.runtime.job import DETOURS, DetoursError, detour_environment, read_detours


@pytest.mark.parametrize("detours", [{}, {"gateway": "127.0.0.1:40001"}, {"gateway": "[::1]:1", "uav12": "10.0.0.1:2"}])
def test_what_is_set_is_read(detours):
    assert read_detours(detour_environment(detours)) == detours


def test_every_process_of_a_plan_can_be_dialled_elsewhere(make_plan):
    plan = make_plan({"gateway": {"source": "natnet", "twin": {}}})
    detours = {identity: f"127.0.0.1:{40001 + k}" for k, identity in enumerate(plan.identities)}
    assert "tracker-sim" in detours
    assert read_detours(detour_environment(detours)) == detours


def test_without_detours_the_environment_says_nothing():
    assert detour_environment({}) == {}
    assert read_detours({DETOURS: ""}) == {}


@pytest.mark.parametrize("text", ["uav1", "uav1=", "uav1=127.0.0.1", "uav1=a:1,", "=127.0.0.1:1", "uav1=127.0.0.1:x"])
def test_nonsense_is_refused_with_its_name_value_and_rule(text):
    with pytest.raises(DetoursError) as caught:
        read_detours({DETOURS: text})
    assert str(caught.value) == f"{DETOURS} = {text!r}: must be IDENTITY=IP:PORT, several separated by commas"


def test_only_who_is_dialled_is_dialled_elsewhere(make_plan):
    plan = make_plan({"network.security": "none"})
    plain = configuration(plan, "uav2", None)
    detoured = configuration(plan, "uav2", None, {"uav1": "127.0.0.1:40001", "uav3": "127.0.0.1:40002"})
    there = plain["connect"]["endpoints"]
    assert detoured["connect"]["endpoints"] == [
        "tcp/127.0.0.1:40001" if endpoint == "tcp/127.0.0.1:7470" else endpoint for endpoint in there
    ]
    assert "tcp/127.0.0.1:7470" in there
    assert detoured["listen"] == plain["listen"]
