"""The Zenoh configuration of every process, as Zenoh itself reads it."""

import json
import os
import socket
from itertools import chain, product
from pathlib import Path

import pytest
import zenoh
from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from flockwire_core.runtime.configuration import (
    BURST,
    HANDSHAKE_TIME,
    SPARE_SESSIONS,
    access_control,
    configuration,
)
from flockwire_core.runtime.session import Session
from flockwire_core.security.files import Credentials, CredentialsError, in_use
from flockwire_core.security.pki import make_keys
from ports import free_ports

FILES = Credentials(Path("ca.crt"), Path("own.crt"), Path("own.key"))
PATIENT = f"#tls_handshake_timeout_ms={HANDSHAKE_TIME}"
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
        assert tls["enable_mtls"] is tls["verify_name_on_connect"] is True
        assert tls["close_link_on_expiration"] is False  # a certificate that ends in flight lands nobody
        for end in ("listen", "connect"):
            assert (tls[f"{end}_certificate"], tls[f"{end}_private_key"]) == ("own.crt", "own.key")
            assert all(where.startswith("tls/") for where in config[end]["endpoints"])
        assert {way["enabled"] for way in config["scouting"].values()} == {False}
        assert config["transport"]["shared_memory"] == {"enabled": False}


@pytest.mark.parametrize("mode", ["peers", "router"])
def test_over_quic_every_link_carries_state_as_datagrams_under_the_same_mutual_tls(make_plan, mode):
    plan, over_tls = make_plan({"network.mode": mode, "network.link": "quic"}), make_plan({"network.mode": mode})
    for identity in plan.identities:
        config, other = configuration(plan, identity, FILES), configuration(over_tls, identity, FILES)
        for end in ("listen", "connect"):
            expected = [f"quic/{where[4:].removesuffix(PATIENT)}?mixed_rel=1" for where in other[end]["endpoints"]]
            assert config[end].pop("endpoints") == expected
            del other[end]["endpoints"]
        patience = [one["transport"]["unicast"].pop("accept_timeout") for one in (config, other)]
        assert patience[0] > patience[1]  # a radio link loses packets of handshakes too
        assert config == other


@pytest.mark.parametrize("mode", ["peers", "router"])
def test_every_process_dials_as_planned_and_listens_at_its_own_endpoint(make_plan, mode):
    plan = make_plan({"network.mode": mode})
    for identity in plan.identities:
        config = configuration(plan, identity, FILES)
        own = [f"tls/{plan.endpoints[identity]}{PATIENT}"] if identity in plan.endpoints else []
        assert config["listen"]["endpoints"] == own
        dialled = [f"tls/{plan.dialled(identity, other)}" for other in plan.dials[identity]]
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


def test_whoever_listens_in_a_swarm_of_peers_listens_for_operators_apart(make_plan):
    plan = make_plan()
    assert plan.reserved.keys() == plan.endpoints.keys()
    assert not set(plan.reserved.values()) & set(plan.endpoints.values())
    assert make_plan({"network.mode": "router"}).reserved == make_plan({"network.security": "none"}).reserved == {}
    for identity, endpoint in plan.reserved.items():
        config = configuration(plan, identity, FILES, reserved=True)
        zenoh.Config.from_json5(json.dumps(config))
        assert config["listen"]["endpoints"] == [f"tls/{endpoint}{PATIENT}"]
        assert config["connect"]["endpoints"] == []
        tls = config["transport"]["link"]["tls"]
        assert (tls["root_ca_certificate"], tls["enable_mtls"]) == ("operators.crt", True)
        assert (tls["listen_certificate"], tls["listen_private_key"]) == ("own.crt", "own.key")
        assert config["access_control"] == access_control(plan, identity)
    dialled = configuration(plan, "operator", FILES)["connect"]["endpoints"]
    assert dialled == [f"tls/{endpoint}" for endpoint in plan.reserved.values()]


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


def test_orders_travel_before_state_and_no_put_waits_for_a_peer(make_plan):
    plan = make_plan({"network.security": "none", "network.base_port": free_ports()})
    with Session(plan, "operator") as operator, Session(plan, "gateway") as gateway:
        orders = [*chain(*(outlet.publishers for key, outlet in operator._publishing.outlets.items() if not key.owner))]
        state = [
            *chain(*(outlet.publishers for key, outlet in gateway._publishing.outlets.items() if key.kind == "pose"))
        ]
        assert len(orders) == 3
        assert state
        assert all(publisher.congestion_control == zenoh.CongestionControl.DROP for publisher in orders + state)
        assert all(publisher.priority == zenoh.Priority.REAL_TIME for publisher in orders)
        assert int(zenoh.Priority.REAL_TIME) < min(int(publisher.priority) for publisher in state)


def test_a_session_holds_its_keys_until_it_ends(make_plan, tmp_path):
    plan = make_plan()
    make_keys(plan, tmp_path, clock.utc())
    for verified in (True, False):
        with Session(plan, "operator", tmp_path, verified=verified):
            assert in_use(tmp_path)
        assert not in_use(tmp_path)


@pytest.mark.parametrize("security", ["none", "mtls"])
def test_a_frozen_process_delays_the_end_of_another_for_seconds_only(make_plan, keys, security):
    with socket.create_server(("127.0.0.1", 0)) as frozen:  # the system accepts, nobody answers
        detours = {"uav1": f"127.0.0.1:{frozen.getsockname()[1]}"}
        session = Session(make_plan({"network.security": security}), "operator", keys, detours)
        connection, _ = frozen.accept()
        begun = clock.monotonic()
        session.close()
        connection.close()
    assert clock.monotonic() - begun < 8 * SECOND  # Zenoh's own bound is 10 s


@pytest.mark.parametrize("mode", ["peers", "router"])
@pytest.mark.parametrize("link", ["tls", "quic"])
def test_an_ipv6_address_is_dialled_as_its_certificate_has_it(make_plan, mode, link):
    plan = make_plan({"network.mode": mode, "network.link": link, "hosts": {"local": {"address": "fd00::7"}}})
    for identity in plan.identities:
        config = configuration(plan, identity, FILES)
        for where in (*config["listen"]["endpoints"], *config["connect"]["endpoints"]):
            assert where.partition("#")[0].partition("/")[2].rpartition(":")[0] == "fd00::7"


@pytest.mark.parametrize("seconds", [-1, 1 << 31])
def test_a_clock_that_no_message_can_carry_is_refused_with_the_reason(make_plan, keys, monkeypatch, seconds):
    monkeypatch.setattr(clock, "now", lambda: seconds * SECOND)
    with pytest.raises(CredentialsError, match=r"this machine's clock says .*; set the clock"):
        Session(make_plan(), "uav1", keys)


def test_a_folder_of_keys_whose_name_is_not_utf_8_is_refused_in_one_line(make_plan, tmp_path):
    with pytest.raises(CredentialsError, match=r"not UTF-8, which Zenoh reads; name another one with --keys"):
        Session(make_plan(), "uav1", tmp_path / os.fsdecode(b"Versuch\xe4"))
