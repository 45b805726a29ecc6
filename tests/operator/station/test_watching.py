"""Keys are not replaced while somebody flies with them, on whatever host."""

import asyncio

import pytest
from command_line import refused
from flockwire_core.runtime.session import RouterAbsentError
from flockwire_core.security.files import CredentialsError, default_folder
from flockwire_core.wire.phase import Phase
from flockwire_operator.station import watching
from simulated_pilots import SimulatedSwarm, started


@pytest.fixture
def swarm(make_plan, monkeypatch):
    found = SimulatedSwarm(make_plan())
    monkeypatch.setattr(watching, "Session", lambda plan, identity, keys: found)
    monkeypatch.setattr(watching, "LOOK_TIME", 0.1)
    return found


def flying(swarm):
    return asyncio.run(watching.flying(swarm.plan, None))


def test_no_drone_flies_on_the_ground(swarm):
    assert flying(swarm) == ()


def test_who_is_in_the_air_flies(swarm):
    swarm.all(Phase.FORMATION, started())
    swarm["uav2"].phase, swarm["uav2"].mission = Phase.READY, None
    assert flying(swarm) == ("uav0", "uav1", "uav3", "uav4")


def test_so_does_one_that_is_linked_and_does_not_report(swarm, monkeypatch):
    swarm["uav2"].silent = True
    assert flying(swarm) == ("uav2",)
    monkeypatch.setattr(swarm, "linked", tuple)  # its host is off
    assert flying(swarm) == ()


@pytest.mark.parametrize("error", [CredentialsError, RouterAbsentError])
def test_keys_that_no_peer_accepts_are_not_a_reason(make_plan, monkeypatch, error):
    def refuse(plan, identity, keys):
        raise error

    monkeypatch.setattr(watching, "Session", refuse)
    assert asyncio.run(watching.flying(make_plan(), None)) == ()


def test_a_rotation_is_refused_in_flight(flockwire, swarm, tmp_path):
    file = tmp_path / "flock.toml"
    flockwire("init", file)
    flockwire("keys", file)
    keys = default_folder("flock", tmp_path)
    before = (keys / "ca.crt").read_bytes()
    swarm.all(Phase.FORMATION, started())
    assert "not even a stop, would reach them" in refused(flockwire("keys", file, "--rotate"))
    assert (keys / "ca.crt").read_bytes() == before
    swarm.all(Phase.READY)
    assert flockwire("keys", file, "--rotate").returncode == 0
    assert (keys / "ca.crt").read_bytes() != before
