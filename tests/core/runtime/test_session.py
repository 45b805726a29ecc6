"""The Zenoh configuration of every process, as Zenoh itself reads it."""

import json
from itertools import product
from pathlib import Path

import pytest
import zenoh
from flockwire.runtime.session import BURST, SPARE_SESSIONS, Session, configuration
from flockwire.security.files import Credentials, CredentialsError
from flockwire.wire.access import access_control

FILES = Credentials(Path("ca.crt"), Path("own.crt"), Path("own.key"))
CASES = tuple(product(("peers", "router"), ("nearby", "neighbours")))


@pytest.mark.parametrize(("mode", "sensing"), CASES)
def test_zenoh_accepts_every_processes_configuration(make_plan, mode, sensing):
    plan = make_plan({"network.mode": mode, "avoidance.sensing": sensing})
    for identity in plan.identities:
        config = zenoh.Config.from_json5(json.dumps(configuration(plan, identity, FILES)))
        control = json.loads(config.get_json("access_control"))
        wanted = access_control(plan, identity)
        assert {rule["id"] for rule in control["rules"]} == {rule["id"] for rule in wanted["rules"]}
        assert (control["enabled"], control["default_permission"]) == (True, "deny")


@pytest.mark.parametrize(("mode", "sensing"), CASES)
def test_message_size_queues_and_sessions_are_bounded(make_plan, mode, sensing):
    plan = make_plan({"network.mode": mode, "avoidance.sensing": sensing})
    for identity in plan.identities:
        config = zenoh.Config.from_json5(json.dumps(configuration(plan, identity, FILES)))
        assert json.loads(config.get_json("transport/link/rx/max_message_size")) == 65536
        assert json.loads(config.get_json("transport/link/tx/queue/size/real_time")) == BURST
        links = len(plan.links[identity])
        assert links < json.loads(config.get_json("transport/unicast/max_sessions")) <= links + SPARE_SESSIONS


@pytest.mark.parametrize("mode", ["peers", "router"])
def test_every_link_is_mutual_tls_and_none_is_found_by_itself(make_plan, mode):
    plan = make_plan({"network.mode": mode})
    for identity in plan.identities:
        config = configuration(plan, identity, FILES)
        tls = config["transport"]["link"]["tls"]
        assert tls["enable_mtls"] is tls["verify_name_on_connect"] is tls["close_link_on_expiration"] is True
        for end in ("listen", "connect"):
            assert (tls[f"{end}_certificate"], tls[f"{end}_private_key"]) == ("own.crt", "own.key")
            assert all(where.startswith("tls/") for where in config[end]["endpoints"])
        assert {way["enabled"] for way in config["scouting"].values()} == {False}
        assert config["transport"]["shared_memory"] == {"enabled": False}


@pytest.mark.parametrize("mode", ["peers", "router"])
def test_everybody_dials_as_planned_and_listens_at_its_own_endpoint(make_plan, mode):
    plan = make_plan({"network.mode": mode})
    for identity in plan.identities:
        config = configuration(plan, identity, FILES)
        own = [f"tls/{plan.endpoints[identity]}"] if identity in plan.endpoints else []
        assert config["listen"]["endpoints"] == own
        dialled = [f"tls/{plan.endpoints[other]}" for other in plan.dials[identity]]
        assert config["connect"]["endpoints"] == dialled
        kind = "peer" if mode == "peers" else "router" if identity == "router" else "client"
        assert config["mode"] == kind


@pytest.mark.parametrize("mode", ["peers", "router"])
def test_without_security_nothing_is_encrypted_and_sizes_stay_bounded(make_plan, mode):
    plan = make_plan({"network.mode": mode, "network.security": "none"})
    for identity in plan.identities:
        config = configuration(plan, identity, None)
        assert "access_control" not in config
        assert "tls" not in config["transport"]["link"]
        zenoh.Config.from_json5(json.dumps(config))
        assert config["transport"]["link"]["rx"]["max_message_size"] == 65536


class OpenedError(Exception):
    """Zenoh would be opened now."""


def test_an_order_in_flight_does_not_wait_until_its_certificate_is_verified(make_plan, monkeypatch, tmp_path):
    def opened(_):
        raise OpenedError

    monkeypatch.setattr(zenoh, "open", opened)
    for name in ("ca.crt", "operator.crt", "operator.key"):
        (tmp_path / name).write_text("junk")
    with pytest.raises(CredentialsError):
        Session(make_plan(), "operator", tmp_path)
    with pytest.raises(OpenedError):
        Session(make_plan(), "operator", tmp_path, verified=False)


def test_an_order_in_flight_without_a_certificate_is_refused_with_the_reason(make_plan, tmp_path):
    with pytest.raises(CredentialsError, match="there is no such keys folder"):
        Session(make_plan(), "operator", tmp_path / "nowhere", verified=False)
